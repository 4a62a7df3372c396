import hashlib
from collections import Counter
from itertools import pairwise, permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.plan.orders import draw, opaque_codes, pairs, pairs_with, shuffle, williams

STIMULI = (0, 20, 50, 80, 100)


@given(seed=st.integers(0, 2**31 - 1), name=st.text(max_size=8))
def test_a_shuffled_order_holds_every_stimulus_once(seed, name):
    assert sorted(shuffle(STIMULI, seed, name)) == list(STIMULI)


@given(seed=st.integers(0, 2**31 - 1), stimuli=st.permutations(STIMULI))
def test_the_order_depends_on_seed_and_name_alone_not_on_how_the_stimuli_were_listed(seed, stimuli):
    assert shuffle(stimuli, seed, "stickiness") == shuffle(STIMULI, seed, "stickiness")


def test_blocks_of_one_session_are_shuffled_apart():
    assert len({shuffle(STIMULI, 1, name) for name in ("stickiness", "slipperiness", "roughness")}) > 1


def test_an_order_follows_the_rule_that_the_docs_state():
    by_hand = sorted(STIMULI, key=lambda item: hashlib.sha256(f"42/stickiness/{item}".encode()).hexdigest())
    assert list(shuffle(STIMULI, 42, "stickiness")) == by_hand


def test_every_stimulus_comes_first_about_equally_often_over_seeds():
    first = Counter(shuffle(STIMULI, seed, "stickiness")[0] for seed in range(2000))
    # 400 expected of each; the standard deviation of a binomial count is 18.
    assert all(abs(count - 400) < 90 for count in first.values())


@given(count=st.integers(0, 60), seed=st.integers(0, 2**31 - 1))
def test_labels_differ_and_are_a_consonant_and_two_digits(count, seed):
    codes = opaque_codes(count, seed)
    assert len(set(codes)) == count
    assert all(code[0] in "BCDFGHJKLMNPQRSTVWXZ" and code[1:].isdigit() and len(code) == 3 for code in codes)


def test_a_label_once_given_stays_when_more_are_asked_for():
    assert opaque_codes(20, 3)[:10] == opaque_codes(10, 3)


def test_more_labels_than_there_are_is_refused():
    with pytest.raises(ValueError, match="at most 2000"):
        opaque_codes(2001, 1)


# ---- Williams designs: the properties by which the literature defines them


@pytest.mark.parametrize("count", range(2, 12))
def test_in_a_williams_design_every_stimulus_follows_every_other_equally_often(count):
    rows = williams(count)
    follows = Counter(pair for row in rows for pair in pairwise(row))
    assert set(follows) == set(permutations(range(count), 2))
    assert set(follows.values()) == {1 if count % 2 == 0 else 2}


@pytest.mark.parametrize("count", range(2, 12))
def test_in_a_williams_design_every_stimulus_stands_in_every_position_equally_often(count):
    rows = williams(count)
    stands = Counter((item, position) for row in rows for position, item in enumerate(row))
    assert len(stands) == count * count
    assert len(set(stands.values())) == 1


def test_five_stimuli_take_two_squares_which_are_ten_rows():
    assert len(williams(5)) == 10
    assert williams(5)[0] == (0, 1, 4, 2, 3)  # the first row the literature prints, counted from 0
    assert len(set(williams(5))) == 10
    assert len(williams(6)) == 6


# ---- constraints


def apart(order):
    return all(abs(STIMULI.index(a) - STIMULI.index(b)) > 1 for a, b in pairwise(order))


@given(seed=st.integers(0, 2**31 - 1))
def test_an_order_that_is_to_meet_a_constraint_meets_it_and_one_that_does_at_once_is_the_shuffled_one(seed):
    order = draw(STIMULI, seed, "b", apart)
    assert apart(order)
    plain = shuffle(STIMULI, seed, "b")
    assert order == plain or not apart(plain)


def test_all_fourteen_orders_of_five_without_neighbours_come_about_equally_often():
    # 14 is the fifth number of Hertzsprung's problem (OEIS A002464).
    counts = Counter(draw(STIMULI, seed, "b", apart) for seed in range(1400))
    assert len(counts) == 14
    assert all(abs(count - 100) < 50 for count in counts.values())  # five standard deviations of a binomial count


def test_a_constraint_that_no_order_meets_gives_none():
    assert draw((0, 1, 2), 1, "b", lambda order: abs(order[0] - order[1]) > 1 and abs(order[1] - order[2]) > 1) is None


# ---- pairs


@given(seed=st.integers(0, 2**31 - 1), count=st.integers(2, 9))
def test_every_two_are_compared_once_and_each_is_first_as_often_as_second(seed, count):
    order = pairs(range(count), seed, "b")
    assert sorted(tuple(sorted(pair)) for pair in order) == [(a, b) for a in range(count) for b in range(a + 1, count)]
    first = Counter(a for a, _ in order)
    assert all(abs(2 * first[item] - (count - 1)) <= (count % 2 == 0) for item in range(count))


def test_the_order_of_pairs_changes_with_the_seed():
    assert len({pairs(STIMULI, seed, "b") for seed in range(50)}) > 45


@given(seed=st.integers(0, 2**31 - 1), count=st.integers(1, 9))
def test_in_two_repetitions_each_item_meets_the_standard_once_before_it_and_once_after(seed, count):
    odd, even = (pairs_with("S", range(count), seed, "b", repetition) for repetition in (5, 6))
    assert all("S" in pair for pair in (*odd, *even))
    assert sorted((a, b) for a, b in odd if b == "S") == sorted((b, a) for a, b in even if a == "S")
    assert len(odd) == len(even) == len(set(odd) | set(even)) / 2 == count
    assert sum(b == "S" for _, b in odd) == count // 2
