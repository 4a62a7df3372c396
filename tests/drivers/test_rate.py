"""A rate that is not as set is found, from counts and arrivals alone, and nothing else is taken for it."""

import numpy as np
import pytest

from drivers.clock_recovery import ClockRecovery, RateWatch, rate_of_least_late, rate_words

START = 7.0  # [s]


def watched(watch, counted, arrival):
    """Feed counts and arrivals [s]; return when, and at which rate, the watch found another one."""
    found = []
    for count, at in zip(counted.tolist(), arrival.tolist(), strict=True):
        if watch.take(count, round((START + at) * 1e9)):
            found.append((at, watch.rate))
    return found


def late(made, seed=1, jitter=0.02, stalls=5):
    """Arrivals of what was made at some times [s]: a few ms late, now and then up to 0.4 s, never out of order."""
    draw = np.random.default_rng(seed)
    arrival = made + draw.exponential(jitter, len(made))
    for at in draw.uniform(made[0], made[-1], stalls):
        arrival = np.where((made > at) & (made < at + 0.4), at + 0.4, arrival)
    return np.maximum.accumulate(arrival)


@pytest.mark.parametrize("rate", [21.0, 200.0, 7000.0])
@pytest.mark.parametrize("error", [-0.005, 0.0, 0.005])
def test_a_clock_within_its_half_percent_is_as_set_however_late_records_come(rate, error):
    counted = np.arange(round(60 * rate))
    watch = RateWatch(rate, 1.0, 0.5)
    assert watched(watch, counted, late(counted / (rate * (1.0 + error)))) == []
    assert watch.rate == watch.nominal


@pytest.mark.parametrize("to", [0.5, 0.9, 0.95, 1.05, 1.3, 2.0])
def test_a_rate_that_becomes_another_is_found_within_seconds_and_so_is_its_return(to):
    rate = 200.0
    made = np.cumsum(np.repeat([1.0, 1.0 / to, 1.0], [2000, round(2000 * to), 4000]) / rate)  # 10 s, 10 s, 20 s
    watch = RateWatch(rate, 1.0, 1.0)
    (first, found), (back, again) = watched(watch, np.arange(len(made)), late(made, jitter=0.004, stalls=0))
    assert 10.0 < first < (14.0 if abs(to - 1) > 0.15 else 18.5)
    assert found == pytest.approx(rate * to, rel=0.02)
    assert 20.0 < back < (24.0 if abs(to - 1) > 0.15 else 28.5)
    assert again == rate
    assert watch.changes == 2


def test_a_rate_that_was_only_measured_for_a_moment_is_put_right_without_a_word_and_watched_from_then_on():
    made = np.cumsum(np.repeat([1.0, 2.0], [3000, 2000]) / 300.0)  # 10 s at 300 Hz, then half of it
    watch = RateWatch(282.0, 1.0, 1.0, vague=0.1)
    (_, right), (_, half) = watched(watch, np.arange(len(made)), late(made, jitter=0.004, stalls=0))
    assert right == pytest.approx(300.0, rel=0.01)
    assert watch.nominal == right
    assert half == pytest.approx(150.0, rel=0.02)
    assert watch.changes == 1


def test_time_that_runs_faster_is_allowed_for():
    counted = np.arange(8000)
    watch = RateWatch(200.0, 10.0, 5.0)
    (found,) = watched(watch, counted, late(counted / 100.0, jitter=0.04, stalls=0))
    assert found[1] == pytest.approx(100.0, rel=0.02)


def test_a_stretch_without_records_is_a_loss_and_no_slower_rate():
    made = np.arange(6000) / 200.0
    made += np.where(made > 10.0, 0.9, 0.0) + np.where(made > 20.0, 0.6, 0.0)
    watch = RateWatch(200.0, 1.0, 0.1)
    assert watched(watch, np.arange(6000), made) == []


@pytest.mark.parametrize("to", [0.5, 1.5])
def test_a_line_without_numbers_is_followed_at_its_new_rate(to):
    rate = 295.0
    made = np.cumsum(np.repeat([1.0, 1.0 / to], [round(5 * rate), round(30 * rate * to)]) / rate)
    recovery, blocks = ClockRecovery(rate), []
    for at in made:
        blocks.append(recovery.take(np.zeros(1, np.int64), round((START + at) * 1e9)))
    time = np.concatenate([block.time for block in [*blocks, recovery.release()]])
    assert recovery.watch.changes == 1
    assert recovery.watch.rate == pytest.approx(rate * to, rel=0.02)
    assert len(time) == len(made)
    assert np.all(np.diff(time) > 0.0)
    settled = made > 25.0
    np.testing.assert_allclose((time - made)[settled], made[0] * -1.0, atol=0.02)
    lost_before = recovery.lost
    assert lost_before <= (4.0 * rate if to < 1 else 0)


def test_words_name_both_rates():
    assert rate_words("its clock runs", 6510.44, 7000.0) == "its clock runs at 6510 Hz, not at 7000 Hz"


@pytest.mark.parametrize("seed", range(5))
def test_the_rate_of_a_moment_is_exact_where_two_came_in_time_however_late_the_others(seed):
    draw = np.random.default_rng(seed)
    waited = draw.exponential(0.1, 40)
    waited[[draw.integers(0, 10), draw.integers(30, 40)]] = 0.0
    counted = np.cumsum(draw.integers(1, 60, 40))
    came = zip(counted.tolist(), np.rint((counted / 250.0 + waited) * 1e9).astype(int).tolist(), strict=True)
    assert rate_of_least_late(list(came)) == pytest.approx(250.0, rel=1e-8)


def test_of_fewer_than_two_arrivals_there_is_no_rate():
    assert np.isnan([rate_of_least_late([]), rate_of_least_late([(4, 10)]), rate_of_least_late([(4, 9), (7, 9)])]).all()
