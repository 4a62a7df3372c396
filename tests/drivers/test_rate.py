"""A rate that is not as set is found, from counts and arrivals alone, and nothing else is taken for it."""

import numpy as np
import pytest

from drivers.clock_recovery import ClockRecovery, RateWatch, rate_of_least_late, rate_words

START = 7.0  # [s]


def rate_changes(watch, counts, arrival):
    """Feed counts and arrivals [s]; return when, and at which rate, the watch found another one."""
    changes = []
    for count, time in zip(counts.tolist(), arrival.tolist(), strict=True):
        if watch.take(count, round((START + time) * 1e9)):
            changes.append((time, watch.rate))
    return changes


def late_arrivals(times, seed=1, jitter=0.02, stalls=5):
    """Arrivals of what was made at some times [s]: a few ms late, now and then up to 0.4 s, never out of order."""
    rng = np.random.default_rng(seed)
    arrival = times + rng.exponential(jitter, len(times))
    for at in rng.uniform(times[0], times[-1], stalls):
        arrival = np.where((times > at) & (times < at + 0.4), at + 0.4, arrival)
    return np.maximum.accumulate(arrival)


@pytest.mark.parametrize("rate", [21.0, 200.0, 7000.0])
@pytest.mark.parametrize("error", [-0.005, 0.0, 0.005])
def test_a_clock_within_its_half_percent_is_as_set_however_late_records_come(rate, error):
    counts = np.arange(round(60 * rate))
    watch = RateWatch(rate, 1.0, 0.5)
    assert rate_changes(watch, counts, late_arrivals(counts / (rate * (1.0 + error)))) == []
    assert watch.rate == watch.nominal


@pytest.mark.parametrize("ratio", [0.5, 0.9, 0.95, 1.05, 1.3, 2.0])
def test_a_rate_that_becomes_another_is_found_within_seconds_and_so_is_its_return(ratio):
    rate = 200.0
    times = np.cumsum(np.repeat([1.0, 1.0 / ratio, 1.0], [2000, round(2000 * ratio), 4000]) / rate)  # 10 s, 10 s, 20 s
    watch = RateWatch(rate, 1.0, 1.0)
    (change_time, new_rate), (return_time, end_rate) = rate_changes(
        watch, np.arange(len(times)), late_arrivals(times, jitter=0.004, stalls=0)
    )
    assert 10.0 < change_time < (14.0 if abs(ratio - 1) > 0.15 else 18.5)
    assert new_rate == pytest.approx(rate * ratio, rel=0.02)
    assert 20.0 < return_time < (24.0 if abs(ratio - 1) > 0.15 else 28.5)
    assert end_rate == rate
    assert watch.changes == 2


def test_a_rate_that_was_only_measured_for_a_moment_is_put_right_without_a_word_and_watched_from_then_on():
    times = np.cumsum(np.repeat([1.0, 2.0], [3000, 2000]) / 300.0)  # 10 s at 300 Hz, then half of it
    watch = RateWatch(282.0, 1.0, 1.0, vague=0.1)
    (_, full_rate), (_, half_rate) = rate_changes(
        watch, np.arange(len(times)), late_arrivals(times, jitter=0.004, stalls=0)
    )
    assert full_rate == pytest.approx(300.0, rel=0.01)
    assert watch.nominal == full_rate
    assert half_rate == pytest.approx(150.0, rel=0.02)
    assert watch.changes == 1


def test_simulated_time_is_allowed_for():
    counts = np.arange(8000)
    watch = RateWatch(200.0, 10.0, 5.0)
    (change,) = rate_changes(watch, counts, late_arrivals(counts / 100.0, jitter=0.04, stalls=0))
    assert change[1] == pytest.approx(100.0, rel=0.02)


def test_a_stretch_without_records_is_a_loss_and_no_slower_rate():
    times = np.arange(6000) / 200.0
    times += np.where(times > 10.0, 0.9, 0.0) + np.where(times > 20.0, 0.6, 0.0)
    watch = RateWatch(200.0, 1.0, 0.1)
    assert rate_changes(watch, np.arange(6000), times) == []


@pytest.mark.parametrize("ratio", [0.5, 1.5])
def test_a_line_without_numbers_is_followed_at_its_new_rate(ratio):
    rate = 295.0
    times = np.cumsum(np.repeat([1.0, 1.0 / ratio], [round(5 * rate), round(30 * rate * ratio)]) / rate)
    recovery, blocks = ClockRecovery(rate), []
    for arrival in times:
        blocks.append(recovery.take(np.zeros(1, np.int64), round((START + arrival) * 1e9)))
    time = np.concatenate([block.time for block in [*blocks, recovery.release()]])
    assert recovery.watch.changes == 1
    assert recovery.watch.rate == pytest.approx(rate * ratio, rel=0.02)
    assert len(time) == len(times)
    assert np.all(np.diff(time) > 0.0)
    steady = times > 25.0
    np.testing.assert_allclose((time - times)[steady], times[0] * -1.0, atol=0.02)
    assert recovery.lost <= (4.0 * rate if ratio < 1 else 0)


def test_words_name_both_rates():
    assert rate_words("its clock runs", 6510.44, 7000.0) == "its clock runs at 6510 Hz, not at 7000 Hz"


@pytest.mark.parametrize("seed", range(5))
def test_the_rate_of_a_moment_is_exact_where_two_came_in_time_however_late_the_others(seed):
    rng = np.random.default_rng(seed)
    delays = rng.exponential(0.1, 40)
    delays[[rng.integers(0, 10), rng.integers(30, 40)]] = 0.0
    counts = np.cumsum(rng.integers(1, 60, 40))
    arrivals = zip(counts.tolist(), np.rint((counts / 250.0 + delays) * 1e9).astype(int).tolist(), strict=True)
    assert rate_of_least_late(list(arrivals)) == pytest.approx(250.0, rel=1e-8)


def test_of_fewer_than_two_arrivals_there_is_no_rate():
    assert np.isnan([rate_of_least_late([]), rate_of_least_late([(4, 10)]), rate_of_least_late([(4, 9), (7, 9)])]).all()
