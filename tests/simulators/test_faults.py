"""What befalls a box's datagrams."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ledger import Ledger

from simulators.bench import Bench, BenchSettings
from simulators.faults import FAULT_KINDS, Fault, Faults

ONES = BenchSettings(noise_force=0.0, noise_torque=0.0, drift_force=0.0, drift_torque=0.0, offset=(1.0,) * 6)


def datagrams_after_faults(*timetable, count=100, seed=1, repeat=0.0):
    """Return what leaves when one datagram a hundredth of a second is sent, numbered from 0, 36 bytes each."""
    faults = Faults(timetable, seed=seed, repeat=repeat)
    leaving = [d for i in range(count) for d in faults.route(i / 100, [(i / 100, bytes([i]) * 36)])]
    return leaving + faults.route(count / 100 + 10, [])


def numbers(datagrams):
    return [d[0] for d in datagrams]


def test_without_faults_everything_leaves_as_it_came():
    assert numbers(datagrams_after_faults()) == list(range(100))


def test_a_fault_lasts_from_its_start_to_its_stop():
    assert numbers(datagrams_after_faults(Fault("lose", 0.10, 0.20))) == [*range(10), *range(20, 100)]


def test_a_timetable_that_repeats_begins_anew():
    assert numbers(datagrams_after_faults(Fault("lose", 0.0, 0.095), repeat=0.5)) == [*range(10, 50), *range(60, 100)]


def test_repeated_datagrams_leave_twice():
    assert numbers(datagrams_after_faults(Fault("repeat", 0.0, 0.02))) == [0, 0, 1, 1, *range(2, 100)]


def test_reordered_datagrams_leave_after_the_next():
    assert numbers(datagrams_after_faults(Fault("reorder", 0.10, 0.11)))[9:13] == [9, 11, 10, 12]


def test_delayed_datagrams_leave_later():
    assert numbers(datagrams_after_faults(Fault("delay", 0.10, 0.11, delay=0.025)))[9:15] == [9, 11, 12, 10, 13, 14]


def test_corrupt_datagrams_keep_their_length_and_shortened_ones_their_beginning():
    corrupt = datagrams_after_faults(Fault("corrupt", 0.0, 1.0))
    short = datagrams_after_faults(Fault("shorten", 0.0, 1.0))
    assert {len(d) for d in corrupt} == {36}
    assert not {bytes([i]) * 36 for i in range(100)} & set(corrupt)
    assert all(len(d) < 36 and set(d) <= {i} for i, d in enumerate(short))


def test_nothing_leaves_while_it_is_unplugged():
    assert numbers(datagrams_after_faults(Fault("unplug", 0.5, 1.0))) == list(range(50))


@given(st.floats(0.05, 0.95), st.integers(0, 100))
def test_the_share_is_kept_and_the_same_seed_hurts_the_same(share, seed):
    fault = Fault("lose", 0.0, 10.0, share=share)
    remaining = numbers(datagrams_after_faults(fault, count=200, seed=seed))
    assert remaining == numbers(datagrams_after_faults(fault, count=200, seed=seed))
    assert abs(len(remaining) / 200 - (1 - share)) < 0.2


@given(
    st.lists(
        st.builds(Fault, st.sampled_from(FAULT_KINDS[:6]), st.floats(0, 0.5), st.floats(0.6, 1), st.floats(0.1, 1)),
        max_size=4,
    )
)
def test_whatever_the_timetable_nothing_is_made_up_and_the_ledger_knows_all(timetable):
    faults = Ledger(timetable)
    leaving = [d for i in range(100) for d in faults.route(i / 100, [(i / 100, bytes([i]) * 36)])] + faults.route(
        99, []
    )
    assert faults.datagrams == [bytes([i]) * 36 for i in range(100)]
    assert faults.delivered == leaving
    assert len(leaving) <= 200


@pytest.mark.parametrize("kind", FAULT_KINDS[:6])
def test_the_same_happens_however_many_datagrams_are_sent_at_one_go(kind):
    timetable = [Fault(kind, 0.2, 0.8, share=0.5, delay=0.024)]
    leaving = Faults(timetable, seed=1).route(50.0, [(i / 100, bytes([i]) * 36) for i in range(100)])
    assert leaving == datagrams_after_faults(*timetable)


def test_faults_of_the_box_itself_are_reported_by_time():
    faults = Faults([Fault("stall", 1.0, 2.0)])
    assert [faults.active("stall", t) for t in (0.5, 1.0, 1.9, 2.0)] == [False, True, True, False]
    assert not faults.active("reboot", 1.5)


@pytest.mark.parametrize(
    "properties",
    [{"kind": "explode"}, {"start": -1.0}, {"stop": 0.0}, {"share": 0.0}, {"share": 1.1}, {"delay": 0.0}],
)
def test_a_fault_that_cannot_be_carried_out_is_refused(properties):
    with pytest.raises(ValueError, match="fault"):
        Fault(**({"kind": "lose", "start": 0.0, "stop": 1.0} | properties))


def test_a_drift_walks_to_its_share_of_each_range_and_stays():
    faults, times = Faults([Fault("drift", 1.0, 3.0, share=0.1)]), np.array([0.5, 2.0, 3.0, 9.0])
    drift = faults.sensed_wrench(Bench(1, ONES), times) - 1.0  # of ranges of 36 N and 500 N mm
    np.testing.assert_allclose(drift[:, 2], [0.0, 1.8, 3.6, 3.6])
    np.testing.assert_allclose(drift[:, 5], [0.0, 25.0, 50.0, 50.0])


def test_a_wrong_calibration_feels_more_than_there_is_while_it_lasts():
    faults, times = Faults([Fault("miscalibrate", 1.0, 2.0, share=0.25)]), np.array([0.0, 1.0, 2.0])
    np.testing.assert_allclose(faults.sensed_wrench(Bench(1, ONES), times)[:, 0], [1.0, 1.25, 1.0])
