"""Lost, repeated, late and frozen records, from their numbers alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.sequence import SequenceAccount

STEP = 35
WRAP = 2**32
PERIOD_NS = 5_000_000


def new_account(**changes):
    return SequenceAccount(**({"step": STEP, "counter_rate": 7000.0} | changes))


def take(account, records, *, end=False, arrival_ns=None):
    numbers = np.array([n % WRAP for n, _ in records], np.uint32)
    counters = np.array([c % WRAP for _, c in records], np.uint32)
    return account.take(numbers, counters, arrival_ns or [PERIOD_NS * i for i in range(len(records))], end=end)


def line(first, last, *, number=1, counter=1000, step=STEP):
    return [(number + k, counter + k * step) for k in range(first, last)]


def classify_by_greatest_number(deliveries):
    """The rule in its plainest form: ahead is kept, equal is repeated, behind is late."""
    survivors, repeated, late, greatest = [], 0, 0, -1
    for index in deliveries:
        if index > greatest:
            survivors.append(index)
            greatest = index
        elif index == greatest:
            repeated += 1
        else:
            late += 1
    return survivors, repeated, late


@st.composite
def arrival_orders(draw):
    """Indices of records in the order they arrive, None for garbage; the first two arrive undisturbed."""
    indices = draw(st.lists(st.integers(2, 40), max_size=60))
    order = [0, 1]
    for index in sorted(indices, key=lambda i: i + draw(st.integers(-2, 2))):
        order += [None] * draw(st.integers(0, 2)) + [index]
    return order


@given(
    order=arrival_orders(),
    number=st.sampled_from([1, 7, WRAP - 20, WRAP - 1]),
    counter=st.sampled_from([0, 5, 2**31 - 100, WRAP - 500]),
    cuts=st.lists(st.integers(0, 90), max_size=6).map(sorted),
    seed=st.integers(0, 2**32),
)
def test_every_record_is_kept_lost_repeated_late_or_garbage_however_the_batches_were_cut(
    order, number, counter, cuts, seed
):
    rng = np.random.default_rng(seed)
    records = [
        (int(rng.integers(WRAP)), int(rng.integers(WRAP))) if i is None else (number + i, counter + i * STEP)
        for i in order
    ]
    account = new_account(first=number)
    sequence, counters, head = [], [], []
    for a, b in zip([0, *cuts], [*cuts, len(records)], strict=True):
        batch = head + records[a:b]
        verdict = take(account, batch, end=b == len(records))
        head = batch[-1:] if verdict.undecided else []
        sequence += verdict.sequence.tolist()
        counters += verdict.counter.tolist()
        assert [n % WRAP for n in sequence[len(sequence) - len(verdict.positions) :]] == [
            batch[k][0] % WRAP for k in verdict.positions
        ]
    survivors, repeated, late = classify_by_greatest_number([i for i in order if i is not None])
    assert [s - number for s in sequence] == survivors
    assert [c - counter for c in counters] == [i * STEP for i in survivors]
    assert (account.repeated, account.late, account.garbage) == (repeated, late, order.count(None))
    assert len(survivors) + account.lost == survivors[-1] + 1
    assert account.frozen == account.restarted == 0


@given(
    st.lists(st.tuples(st.integers(0, WRAP - 1), st.integers(0, WRAP - 1)), max_size=40),
    st.sampled_from([None, 1, STEP, 7000]),
)
def test_any_numbers_at_all_are_accounted_for(records, step):
    account = new_account(step=step)
    verdict = take(account, records, end=True)
    assert len(verdict.positions) + account.repeated + account.late + account.garbage == len(records)
    assert np.all(np.diff(verdict.sequence) > 0)
    assert np.all(np.diff(verdict.counter) >= 0)


def test_records_missing_before_the_first_that_came_are_lost():
    account = new_account()
    take(account, line(3, 6))
    assert account.lost == 3


def test_a_counter_that_stands_still_is_kept_and_counted():
    account = new_account()
    frozen = [(k, 1070) for k in (4, 5, 6)]
    verdict = take(account, [*line(0, 3), *frozen, *line(6, 9)])
    assert verdict.sequence.tolist() == list(range(1, 10))
    assert account.frozen == 3
    assert account.lost == account.garbage == 0


def test_a_stream_that_is_numbered_anew_goes_on_by_the_devices_counter():
    account = new_account()
    verdict = take(account, [*line(0, 10), *line(0, 3, counter=1000 + 13 * STEP)])
    assert verdict.sequence.tolist() == [*range(1, 11), 14, 15, 16]
    assert account.lost == 3
    assert account.restarted == 0


def test_a_rebooted_device_leaves_a_gap_as_long_as_the_hosts_clock_says():
    account = new_account()
    before, after = line(0, 10, counter=500_000), line(0, 3, counter=70)
    arrival_ns = [PERIOD_NS * i for i in range(10)] + [PERIOD_NS * (9 + 40 + i) for i in range(3)]
    verdict = take(account, [*before, *after], arrival_ns=arrival_ns)
    assert account.restarted == 1
    assert verdict.sequence.tolist() == [*range(1, 11), 50, 51, 52]
    assert (verdict.counter - 500_000).tolist() == [i * STEP for i in [*range(10), 49, 50, 51]]
    assert account.lost == 39


def test_a_changed_rate_is_learned_and_loses_nothing():
    account = new_account()
    verdict = take(account, [*line(0, 5), *[(6 + k, 1000 + 4 * STEP + 7 * (k + 1)) for k in range(5)]])
    assert account.step == 7
    assert verdict.sequence.tolist() == list(range(1, 11))
    assert account.lost == 0


def test_an_unknown_step_is_learned_from_the_first_two_records():
    account = new_account(step=None)
    take(account, line(0, 2, step=7))
    assert account.step == 7


def test_a_record_is_held_until_the_next_decides():
    account = new_account()
    assert take(account, line(0, 1)).undecided
    assert not take(account, line(0, 2)).undecided


@pytest.mark.parametrize("first", [1, WRAP - 2])
def test_both_wraps_go_unnoticed(first):
    account = new_account(first=first)
    verdict = take(account, line(0, 6, number=first, counter=WRAP - 70))
    assert np.diff(verdict.sequence).tolist() == [1] * 5
    assert np.diff(verdict.counter).tolist() == [STEP] * 5
    assert account.lost == 0
