import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.clock_recovery import GAP, ClockRecovery, ScanCount

START = 5_000_000_000


def recover(recovery, arrivals):
    """Place (time [s], records) in order; return sequence and time of all."""
    blocks = [recovery.take(np.zeros(count, np.int64), START + round(time * 1e9)) for time, count in arrivals]
    blocks.append(recovery.release())
    return np.concatenate([b.sequence for b in blocks]), np.concatenate([b.time for b in blocks])


def lumps(rate, seconds, lump, outage=(0.0, 0.0)):
    """Records at `rate`, handed over every `lump` seconds, none made between the two times `lost`."""
    record_times = np.arange(round(rate * seconds)) / rate
    record_times = record_times[(record_times < outage[0]) | (record_times >= outage[1])]
    arrival_times = (np.floor(record_times / lump) + 1) * lump
    times, counts = np.unique(arrival_times, return_counts=True)
    return list(zip(times.tolist(), counts.tolist(), strict=True)), record_times


@pytest.mark.parametrize("error", [-0.02, 0.0, 0.005, 0.02])
@pytest.mark.parametrize("rate", [74.0, 295.0, 7000.0])
def test_times_follow_the_clock_though_the_rate_is_a_little_wrong(rate, error):
    arrivals, record_times = lumps(rate, 20.0, 0.016)
    recovery = ClockRecovery(rate * (1.0 + error))
    sequence, time = recover(recovery, arrivals)
    np.testing.assert_array_equal(sequence, np.arange(1, len(record_times) + 1))
    assert recovery.lost == 0
    assert np.all(np.diff(time) > 0.0)
    np.testing.assert_allclose(time, record_times, atol=0.02)


@pytest.mark.parametrize("rate", [74.0, 295.0, 7000.0])
def test_a_pause_that_nothing_makes_up_for_is_a_loss_of_its_length(rate):
    arrivals, record_times = lumps(rate, 8.0, 0.01, outage=(4.0, 4.5))
    recovery = ClockRecovery(rate)
    sequence, time = recover(recovery, arrivals)
    lost_count = 0.5 * rate
    assert abs(recovery.lost - lost_count) <= 0.02 * rate + 1
    assert sequence[-1] == len(record_times) + recovery.lost
    np.testing.assert_allclose(time, record_times, atol=0.03)


def test_a_pause_followed_by_the_lump_that_was_kept_back_is_no_loss():
    rate = 295.0
    record_times = np.arange(round(rate * 6)) / rate
    arrival_times = np.where((record_times > 3.0) & (record_times < 3.4), 3.4, record_times)
    arrival_times[(record_times > 3.0) & (record_times < 3.1)] = 3.41
    arrival_times.sort()
    times, counts = np.unique(arrival_times, return_counts=True)
    recovery = ClockRecovery(rate)
    sequence, time = recover(recovery, zip(times.tolist(), counts.tolist(), strict=True))
    assert recovery.lost == 0
    np.testing.assert_array_equal(sequence, np.arange(1, len(record_times) + 1))
    np.testing.assert_allclose(time, record_times, atol=0.07)  # half of the lump came late by GAP


def test_a_lump_that_a_busy_computer_hands_over_bit_by_bit_is_no_loss_either():
    rate = 7000.0
    record_times = np.arange(round(rate * 4)) / rate
    slow = (record_times > 2.0) & (record_times < 3.0)
    arrival_times = np.where(
        slow, 2.5 + (record_times - 2.0) * 0.5, record_times
    )  # half a second of nothing, then twice as fast
    times, counts = np.unique(np.ceil(arrival_times / 0.01) * 0.01, return_counts=True)
    recovery = ClockRecovery(rate)
    sequence, time = recover(recovery, zip(times.tolist(), counts.tolist(), strict=True))
    assert recovery.lost == 0
    np.testing.assert_array_equal(sequence, np.arange(1, len(record_times) + 1))
    assert np.all(np.diff(time) > 0.0)


def test_broken_records_take_their_numbers_with_them():
    recovery = ClockRecovery(100.0)
    first = recovery.take(np.array([3, 0]), START)
    second = recovery.take(np.array([2, 0]), START + 40_000_000)
    assert first.sequence.tolist() == [1, 2]  # what came before the first record is not of this stream
    assert second.sequence.tolist() == [5, 6]
    assert recovery.lost == 2
    np.testing.assert_allclose(second.time, [0.04, 0.05], atol=0.002)


def test_a_stream_begun_anew_goes_on_behind_a_gap_as_long_as_the_clock_says():
    recovery = ClockRecovery(100.0)
    recovery.take(np.zeros(101, np.int64), START)
    recovery.bridge(START + 2_000_000_000)
    block = recovery.take(np.zeros(1, np.int64), START + 2_000_000_000)
    assert block.sequence.tolist() == [301]
    assert recovery.lost == 199
    np.testing.assert_allclose(block.time, [3.0], atol=0.01)


def test_the_shortest_gap_noticed_grows_with_the_factor_of_simulated_time():
    recovery = ClockRecovery(100.0, factor=10.0)
    arrivals, _ = lumps(100.0, 8.0, 0.01, outage=(4.0, 4.0 + 5 * GAP))
    recover(recovery, arrivals)
    assert recovery.lost == 0


@given(
    pauses=st.lists(st.tuples(st.floats(0.0, 2.0), st.integers(0, 50), st.integers(0, 3)), max_size=60),
    rate=st.floats(1.0, 7000.0),
)
def test_numbers_and_times_always_rise_and_every_missing_number_is_counted(pauses, rate):
    recovery, now, blocks, record_count = ClockRecovery(rate), START, [], 0
    for pause, count, damage in pauses:
        now += round(pause * 1e9)
        record_count += count
        blocks.append(recovery.take(np.full(count, damage), now))
    blocks.append(recovery.release())
    sequence = np.concatenate([b.sequence for b in blocks])
    time = np.concatenate([b.time for b in blocks])
    assert len(sequence) == len(time) == record_count
    assert np.all(np.diff(sequence) > 0)
    assert np.all(np.diff(time) > 0.0)
    if record_count:
        assert sequence[0] == 1
        assert sequence[-1] - record_count == recovery.lost


def test_scans_lie_at_even_times_of_the_converters_clock_and_a_gap_is_as_many_as_its_time_holds():
    count = ScanCount(500.0)
    first = count.take(np.array([0, 0, 2]), 20_000_000)
    assert (first.sequence.tolist(), first.time.tolist(), count.lost) == ([1, 2, 5], [0.0, 0.002, 0.008], 2)
    count.bridge(1_020_000_000)  # a second later: 500 scans, of which the last is the next
    after = count.take(np.array([0]), 1_020_000_000)
    assert (after.sequence.tolist(), after.time.tolist(), count.lost) == ([505], [1.008], 501)
    assert not len(count.take(np.array([], np.int64), 2_000_000_000).sequence)
