"""What every driver in the catalogue does, each with its own simulated device: whoever enters the list is held to it.

Each driver goes through two courses, once: an undisturbed one, and one in which everything goes wrong that can go wrong
on its wire, one thing after the other. Each test then looks at one thing that came of it.
"""

import os
from functools import cache

import numpy as np
import pytest
from driver_courses import (
    IDENTIFY,
    LIVE,
    NAMES,
    ONE_AFTER_THE_OTHER,
    SEED,
    STOPS_WITHIN,
    is_counted,
    run_calm_course,
    run_faulty_course,
    run_status_course,
    simulator,
)

from daq_app.simulation.wiring import connect
from drivers.catalog import DRIVERS, reachable
from drivers.clock import PacedClock
from drivers.clock_recovery import rate_of_least_late
from drivers.transducer import SetupError
from sessions.recording.head import info_from_dict, info_to_dict
from simulators.serving import SIMULATORS

pytestmark = pytest.mark.skipif(os.name != "posix", reason="there are no pseudo-terminals on this system")


@pytest.fixture(scope="module")
def calm_course(tmp_path_factory):
    """Return a function that gives the undisturbed course of a driver, gone through once."""
    return cache(lambda name: run_calm_course(name, tmp_path_factory.mktemp("device")))


@pytest.fixture(scope="module")
def faulty_course(tmp_path_factory):
    """Return a function that gives the course full of faults of a driver, gone through once."""
    return cache(lambda name: run_faulty_course(name, tmp_path_factory.mktemp("device")))


def test_every_driver_in_the_list_has_a_simulated_device_in_its_own():
    assert {driver.name for driver in DRIVERS} == SIMULATORS.keys()


# ---- the undisturbed course


@pytest.mark.parametrize("name", NAMES)
def test_it_says_who_it_is_and_that_it_is_simulated(calm_course, name):
    course = calm_course(name)
    info = course.info
    assert info.simulated
    assert info.uri == course.uri or course.uri.startswith("sim:")
    assert info.model
    assert info.serial == info.calibration.serial
    assert info.serial == ("FT1" if name == "replay" else f"SIM{SEED:05d}")
    assert info.settings, "nothing was read back"


@pytest.mark.parametrize("name", NAMES)
def test_its_calibration_is_read(calm_course, name):
    course = calm_course(name)
    calibration = course.info.calibration
    assert np.linalg.matrix_rank(calibration.matrix) == 6
    rated = [50.0, 50.0, 70.0, 500.0, 500.0, 500.0] if name == "replay" else None
    assert calibration.rated.tolist() == pytest.approx(rated or course.bench.settings.rated)
    assert calibration.source


@pytest.mark.parametrize("name", IDENTIFY)
def test_who_is_there_can_be_asked_before_and_after_and_the_port_is_free_again(calm_course, name):
    course = calm_course(name)
    for identity in (course.identity, course.identity_after):
        assert identity.serial == course.info.serial, identity
        assert identity.model == course.info.model


@pytest.mark.parametrize("name", NAMES)
def test_asking_who_is_there_does_not_disturb_a_stream(calm_course, name):
    course = calm_course(name)
    identity = course.identity_in_use
    if identity is not None:
        port_busy = isinstance(identity, str) and "another program has it" in identity
        assert port_busy or identity.serial == course.info.serial, identity
    health = course.healths[0]
    assert health.restarted == 0
    assert health.lost == 0 or name == "replay"  # which loses what its recording lost


@pytest.mark.parametrize("name", NAMES)
def test_an_undisturbed_stream_is_whole(calm_course, name):
    course = calm_course(name)
    block, health = course.blocks[0], course.healths[0]
    assert health.received == len(block) > 50
    assert health.repeated == health.late == health.malformed == health.stalled == 0
    assert health.restarted == health.saturated == health.off_rate == 0
    assert block.time[0] == 0.0
    if name != "replay":
        assert health.lost == 0
        assert np.diff(block.sequence).tolist() == [1] * (len(block) - 1)
        lag = (block.received_ns - block.received_ns[0]) * 1e-9 - block.time
        half = len(lag) // 2
        drift = lag[half:].min() - lag[:half].min()  # by readings that waited least: the others came late
        assert abs(drift) < 0.05 * block.time[-1] + 0.1 * simulator(name).factor
    assert np.all(np.diff(block.time) > 0.0)
    assert np.all(np.diff(block.received_ns) >= 0)


@pytest.mark.parametrize("name", LIVE)
def test_the_rate_it_states_is_the_one_at_which_readings_come(calm_course, name):
    course = calm_course(name)
    arrivals = list(zip(course.blocks[0].sequence.tolist(), course.blocks[0].received_ns.tolist(), strict=True))
    assert course.info.rate == pytest.approx(rate_of_least_late(arrivals), rel=0.1)


@pytest.mark.parametrize("name", LIVE)
def test_it_feels_what_the_bench_exerts(calm_course, name):
    course = calm_course(name)
    block, ground_truth = course.blocks[0], course.ground_truth
    bias = block.raw[: len(block) // 20].mean(axis=0)  # before the hand sets off
    wrench = course.info.calibration.wrench(block.raw, bias)
    assert -wrench[:, 2].min() == pytest.approx(ground_truth.peak_normal_force, abs=0.06)
    assert wrench[:, 0].max() == pytest.approx(ground_truth.mu * ground_truth.peak_normal_force, abs=0.06)


@pytest.mark.parametrize("name", NAMES)
def test_its_lag_is_reported(calm_course, name):
    course = calm_course(name)
    assert all(0.0 <= health.lag_ms < 1e4 for health in course.healths)


@pytest.mark.parametrize("name", NAMES)
def test_it_stops_within_a_fifth_of_a_second_and_nothing_comes_behind(calm_course, name):
    course = calm_course(name)
    assert min(course.stops) < STOPS_WITHIN
    assert course.after_stop == 0


@pytest.mark.parametrize("name", LIVE)
def test_it_can_be_started_again_but_not_twice(calm_course, name):
    course = calm_course(name)
    assert "already" in course.second_start
    assert course.blocks[1].sequence[0] == 1
    assert course.blocks[1].time[0] == 0.0
    assert course.healths[1].received == len(course.blocks[1]) > 0


@pytest.mark.parametrize("name", NAMES)
def test_no_thread_port_or_handle_is_left_behind(calm_course, name):
    course = calm_course(name)
    assert course.threads_left == set()
    assert course.handles_left == 0


# ---- all that can go wrong


VISIBLE = [(name, kind) for name in LIVE for kind in ONE_AFTER_THE_OTHER if kind in simulator(name).tells]
HIDDEN = [(name, kind) for name in LIVE for kind in simulator(name).hides]


@pytest.mark.parametrize(("name", "kind"), VISIBLE)
def test_it_survives_each_fault_and_says_which(faulty_course, name, kind):
    course = faulty_course(name)
    before, after, went_on = course.outcomes[kind]
    assert is_counted(kind, course.outcomes[kind]), (before, after)
    assert went_on, "it did not go on after the fault"
    assert kind != "slow" or "Hz, not at" in after.rate_words


@pytest.mark.parametrize(("name", "kind"), HIDDEN)
def test_it_survives_what_its_wire_cannot_tell(faulty_course, name, kind):
    course = faulty_course(name)
    assert course.outcomes[kind][2], "it did not go on after the fault"


@pytest.mark.parametrize("name", LIVE)
def test_every_reading_is_handed_over_or_counted_as_lost(faulty_course, name):
    course = faulty_course(name)
    block, health = course.block, course.health
    assert health.received == len(block)
    assert health.received + health.lost == block.sequence[-1]
    assert np.all(np.diff(block.sequence) >= 1)
    assert np.all(np.diff(block.time) >= 0.0)


@pytest.mark.parametrize("name", LIVE)
def test_no_wrong_reading_is_taken_for_a_sound_one(faulty_course, name):
    course = faulty_course(name)
    sound_readings = course.block.raw[course.block.status == 0]
    wrench = course.info.calibration.wrench(sound_readings, np.median(sound_readings, axis=0))  # nothing touched
    wrong = (np.abs(wrench[:, :3]) > 0.1).any(axis=1) | (np.abs(wrench[:, 3:]) > 1.0).any(axis=1)
    unshown = simulator(name).unshown  # no checksum, or a short one
    allowed = unshown * course.health.malformed + 2 if unshown else 0
    assert np.count_nonzero(wrong) <= allowed


@pytest.mark.parametrize("name", IDENTIFY)
def test_a_device_that_goes_away_is_lost_in_one_sentence(faulty_course, name):
    course = faulty_course(name)
    assert course.uri in course.sentence
    assert "\n" not in course.sentence


@pytest.mark.parametrize("name", LIVE)
def test_nothing_is_left_behind_by_a_device_that_went_away(faulty_course, name):
    course = faulty_course(name)
    assert course.threads_left == set()
    assert course.handles_left <= 0  # a simulated port goes with its device


# ---- what the status says


STATUSES = [name for name in LIVE if simulator(name).statuses]


@pytest.mark.parametrize("name", STATUSES)
def test_every_status_that_the_maker_lists_is_named_and_judged_within_a_second(name, tmp_path):
    info, health_by_status = run_status_course(name, tmp_path)
    assert health_by_status.keys() == set(simulator(name).statuses)
    for before, after, elapsed_s in health_by_status.values():
        new_words = [words for words, count in after.flagged.items() if count > before.flagged.get(words, 0)]
        assert new_words, "nothing is named"
        assert not [words for words in new_words if "unknown" in words or "unnamed" in words]
        counts = (after.saturated - before.saturated, after.doubtful - before.doubtful, after.noted - before.noted)
        assert sum(count > 0 for count in counts) == 1, counts
        assert elapsed_s < 1.0
    all_words = {words for _, after, _ in health_by_status.values() for words in after.flagged}
    assert len(all_words) >= len(simulator(name).statuses)
    assert info_from_dict(info_to_dict(info)).status == info.status, "a recording holds the table"


# ---- addresses


@pytest.mark.parametrize("name", LIVE)
def test_a_malformed_address_is_refused_in_one_sentence(name):
    for option in ("unheard-of=1", "tool=1,2,3"):
        with pytest.raises(SetupError, match=option.split("=")[0]), connect(f"{name}:?{option}", PacedClock(1.0)):
            pass


def test_a_usual_address_is_well_formed():
    for driver in DRIVERS:
        for uri in driver.usual:
            assert uri.startswith(driver.name)
            assert [device.uri for device in reachable(patience=0.01)].count(uri) == 1
