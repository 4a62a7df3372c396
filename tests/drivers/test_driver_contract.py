"""What every driver in the catalogue does, each on its own simulator."""

import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from drivers.catalog import DRIVERS, open_transducer, reachable
from drivers.clock import Clock, PacedClock
from drivers.readings import ReadingBlock
from drivers.transducer import LinkLost, SetupError
from simulators.bench import Bench
from simulators.faults import Fault, Faults
from simulators.net_ft_box import NetFtBox
from simulators.stroke import Stroke
from simulators.surface import paper_surfaces

FACTOR = 10.0


@dataclass
class Simulated:
    """A simulated device: where it is, what it feels, its clock, and how to switch it off."""

    uri: str
    bench: Bench
    clock: Clock
    now: Any
    close: Any


def net_ft(faults):
    bench, clock = Bench(3), PacedClock(FACTOR)
    box = NetFtBox(bench, clock, faults=faults, first_tick=10_000_000)  # on since long before
    box.start()
    return Simulated(box.uri, bench, clock, box.now, box.close)


SIMULATORS = {"net-ft": net_ft}  # a driver's name: how its simulator is made
# A serial line has no sequence numbers and one user: repeated, late and stalled records cannot be told on it, and none
# can ask who is there while it is in use. tests/drivers/test_serial_wires.py holds these to what a line allows, and
# tests/drivers/labjack_u6 and nidaq the gauges, whose simulators are no addresses.
ONE_USER = {"serial-ft", "digital-ft", "labjack-u6", "nidaq"}


def test_every_driver_has_a_simulator_here_or_is_held_to_what_its_line_allows():
    assert {driver.name for driver in DRIVERS} == SIMULATORS.keys() | ONE_USER


@pytest.fixture(params=sorted(SIMULATORS))
def simulator(request):
    """Return a function that starts the simulator with a timetable of faults."""
    threads_before = set(threading.enumerate())
    started = []

    def start(*timetable, **options):
        started.append(SIMULATORS[request.param](Faults(timetable, seed=1, **options)))
        return started[-1]

    yield start
    for one in started:
        one.close()
    assert set(threading.enumerate()) <= threads_before, "a thread was left running"


def readings(transducer, seconds):
    """Return what comes until so many seconds of the device's time have passed, and the rest after a stop."""
    blocks, newest = [], 0.0
    while newest < seconds:
        blocks.append(transducer.read(0.1))
        newest = max([newest, *blocks[-1].time[-1:].tolist()])
    transducer.stop()
    return ReadingBlock.joined([*blocks, transducer.read(0.0)])


def test_it_says_who_it_is_and_that_it_is_simulated(simulator):
    device = simulator()
    info = open_transducer(device.uri, device.clock).info
    assert info.simulated
    assert info.uri == device.uri
    assert info.model
    assert info.serial
    assert info.calibration.serial == info.serial
    assert np.all(np.isfinite(info.calibration.matrix))
    assert info.calibration.rated.tolist() == pytest.approx(device.bench.settings.rated)


def test_it_is_found_without_being_disturbed(simulator):
    device = simulator()
    transducer = open_transducer(device.uri, device.clock)
    transducer.start()
    before = transducer.health
    (found,) = [one for one in reachable([device.uri], patience=5.0) if one.uri == device.uri]
    while transducer.health.received == before.received:
        time.sleep(0.001)
    after = transducer.health
    transducer.close()
    assert found.info is not None
    assert found.info.serial == transducer.info.serial
    assert after.lost == after.restarted == 0


def test_an_undisturbed_stream_is_whole_evenly_timed_and_feels_what_the_bench_exerts(simulator):
    device = simulator()
    transducer = open_transducer(device.uri, device.clock)
    device.bench.mount(paper_surfaces()["stickiness", 80])
    planted = device.bench.begin_stroke(Stroke(7.81, 17.5, approach=0.6), device.now() + 0.2)
    transducer.start()
    block = readings(transducer, planted.end + 0.5 - device.now())
    transducer.close()
    info, health = transducer.info, transducer.health
    assert health.received == len(block)
    assert health.lost == health.repeated == health.late == health.malformed == health.stalled == 0
    assert np.diff(block.sequence).tolist() == [1] * (len(block) - 1)
    np.testing.assert_allclose(np.diff(block.time), 1.0 / info.rate, rtol=1e-9)
    assert np.all(np.diff(block.received_ns) >= 0)
    wrench = info.calibration.wrench(block.raw, np.zeros(6))
    assert -wrench[:, 2].min() == pytest.approx(planted.peak_normal_force, abs=0.05)
    assert wrench[:, 0].max() == pytest.approx(planted.mu * planted.peak_normal_force, abs=0.05)


FAULTS = {
    "lose": lambda health: health.lost > 0,
    "repeat": lambda health: health.repeated > 0,
    "reorder": lambda health: health.late > 0,
    "corrupt": lambda health: health.malformed > 0,
    "shorten": lambda health: health.malformed > 0,
    "delay": lambda health: health.late > 0,
    "stall": lambda health: health.stalled > 0,
    "saturate": lambda health: health.saturated > 0,
    "reboot": lambda health: health.restarted == 1,
    "unplug": lambda health: health.lost > 0,
}


@pytest.mark.parametrize("kind", FAULTS)
def test_it_survives_each_fault_and_accounts_for_every_reading(simulator, kind):
    whole = kind in ("stall", "saturate", "reboot", "unplug")
    device = simulator(Fault(kind, 1.0, 2.0, share=1.0 if whole else 0.3))
    transducer = open_transducer(device.uri, device.clock)
    transducer.start()
    block = readings(transducer, 10.0 if kind in ("reboot", "unplug") else 4.0)
    health = transducer.health
    transducer.close()
    assert FAULTS[kind](health), health
    assert health.received == len(block)
    assert health.received + health.lost == block.sequence[-1]
    assert np.all(np.diff(block.sequence) >= 1)
    assert np.all(np.diff(block.time) >= 0)
    assert block.time[-1] > 2.5, "it did not go on after the fault"


def test_a_device_that_goes_away_is_lost_in_one_sentence(simulator):
    device = simulator()
    transducer = open_transducer(device.uri, device.clock)
    transducer.start()
    device.close()
    sentence = None
    while sentence is None:
        try:
            transducer.read(10.0)
        except LinkLost as error:
            sentence = str(error)
    transducer.close()
    assert device.uri in sentence
    assert "\n" not in sentence


def test_stopping_and_closing_twice_are_harmless_and_it_can_start_again(simulator):
    device = simulator()
    transducer = open_transducer(device.uri, device.clock)
    transducer.start()
    transducer.stop()
    transducer.stop()
    transducer.start()
    block = readings(transducer, 1.0)
    transducer.close()
    transducer.close()
    assert block.time[0] == 0.0
    assert transducer.health.lost == 0


def test_a_malformed_address_is_refused_in_one_sentence(simulator):
    device = simulator()
    with pytest.raises(SetupError, match="unheard-of"):
        open_transducer(device.uri + "&unheard-of=1", device.clock)


def test_a_usual_address_is_well_formed():
    for driver in DRIVERS:
        for uri in driver.usual:
            assert uri.startswith(driver.name)
            assert [found.uri for found in reachable(patience=0.01)].count(uri) == 1
