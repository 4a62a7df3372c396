import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.clock_recovery import GAP, ClockRecovery

START = 5_000_000_000


def paced(recovery, arrivals):
    """Place (time [s], records) in order; return sequence and time of all."""
    blocks = [recovery.take(np.zeros(count, np.int64), START + round(time * 1e9)) for time, count in arrivals]
    blocks.append(recovery.release())
    return np.concatenate([b.sequence for b in blocks]), np.concatenate([b.time for b in blocks])


def lumps(rate, seconds, lump, lost=(0.0, 0.0)):
    """Records at `rate`, handed over every `lump` seconds, none made between the two times `lost`."""
    made = np.arange(round(rate * seconds)) / rate
    made = made[(made < lost[0]) | (made >= lost[1])]
    handed = (np.floor(made / lump) + 1) * lump
    times, counts = np.unique(handed, return_counts=True)
    return list(zip(times.tolist(), counts.tolist(), strict=True)), made


@pytest.mark.parametrize("error", [-0.02, 0.0, 0.005, 0.02])
@pytest.mark.parametrize("rate", [74.0, 295.0, 7000.0])
def test_times_follow_the_clock_though_the_rate_is_a_little_wrong(rate, error):
    arrivals, made = lumps(rate, 20.0, 0.016)
    recovery = ClockRecovery(rate * (1.0 + error))
    sequence, time = paced(recovery, arrivals)
    np.testing.assert_array_equal(sequence, np.arange(1, len(made) + 1))
    assert recovery.lost == 0
    assert np.all(np.diff(time) > 0.0)
    np.testing.assert_allclose(time, made, atol=0.02)


@pytest.mark.parametrize("rate", [74.0, 295.0, 7000.0])
def test_a_pause_that_nothing_makes_up_for_is_a_loss_of_its_length(rate):
    arrivals, made = lumps(rate, 8.0, 0.01, lost=(4.0, 4.5))
    recovery = ClockRecovery(rate)
    sequence, time = paced(recovery, arrivals)
    missing = 0.5 * rate
    assert abs(recovery.lost - missing) <= 0.02 * rate + 1
    assert sequence[-1] == len(made) + recovery.lost
    np.testing.assert_allclose(time, made, atol=0.03)


def test_a_pause_followed_by_the_lump_that_was_kept_back_is_no_loss():
    rate = 295.0
    made = np.arange(round(rate * 6)) / rate
    handed = np.where((made > 3.0) & (made < 3.4), 3.4, made)
    handed[(made > 3.0) & (made < 3.1)] = 3.41
    handed.sort()
    times, counts = np.unique(handed, return_counts=True)
    recovery = ClockRecovery(rate)
    sequence, time = paced(recovery, zip(times.tolist(), counts.tolist(), strict=True))
    assert recovery.lost == 0
    np.testing.assert_array_equal(sequence, np.arange(1, len(made) + 1))
    np.testing.assert_allclose(time, made, atol=0.07)  # half of the lump came late by GAP


def test_a_lump_that_a_busy_computer_hands_over_bit_by_bit_is_no_loss_either():
    rate = 7000.0
    made = np.arange(round(rate * 4)) / rate
    slow = (made > 2.0) & (made < 3.0)
    handed = np.where(slow, 2.5 + (made - 2.0) * 0.5, made)  # half a second of nothing, then twice as fast
    times, counts = np.unique(np.ceil(handed / 0.01) * 0.01, return_counts=True)
    recovery = ClockRecovery(rate)
    sequence, time = paced(recovery, zip(times.tolist(), counts.tolist(), strict=True))
    assert recovery.lost == 0
    np.testing.assert_array_equal(sequence, np.arange(1, len(made) + 1))
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
    after = recovery.take(np.zeros(1, np.int64), START + 2_000_000_000)
    assert after.sequence.tolist() == [301]
    assert recovery.lost == 199
    np.testing.assert_allclose(after.time, [3.0], atol=0.01)


def test_the_shortest_gap_noticed_grows_with_a_told_clock():
    recovery = ClockRecovery(100.0, factor=10.0)
    arrivals, _ = lumps(100.0, 8.0, 0.01, lost=(4.0, 4.0 + 5 * GAP))
    paced(recovery, arrivals)
    assert recovery.lost == 0


@given(
    pauses=st.lists(st.tuples(st.floats(0.0, 2.0), st.integers(0, 50), st.integers(0, 3)), max_size=60),
    rate=st.floats(1.0, 7000.0),
)
def test_numbers_and_times_always_rise_and_every_missing_number_is_counted(pauses, rate):
    recovery, now, blocks, given_ = ClockRecovery(rate), START, [], 0
    for pause, count, broken in pauses:
        now += round(pause * 1e9)
        given_ += count
        blocks.append(recovery.take(np.full(count, broken), now))
    blocks.append(recovery.release())
    sequence = np.concatenate([b.sequence for b in blocks])
    time = np.concatenate([b.time for b in blocks])
    assert len(sequence) == len(time) == given_
    assert np.all(np.diff(sequence) > 0)
    assert np.all(np.diff(time) > 0.0)
    if given_:
        assert sequence[0] == 1
        assert sequence[-1] - given_ == recovery.lost
