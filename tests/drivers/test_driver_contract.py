"""What every driver in the catalogue does, each with its own simulated device: whoever enters the list is held to it.

Each driver goes through two courses, once: an undisturbed one, and one in which everything goes wrong that can go wrong
on its wire, one thing after the other. Each test then looks at one thing that came of it.
"""

import os
import threading
import time
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq_app import wiring
from daq_app.wiring import connected
from drivers import rate, streaming
from drivers.address import parse_address
from drivers.catalog import DRIVERS, reachable
from drivers.clock import PacedClock
from drivers.digital_ft import device as digital_ft
from drivers.net_ft import device as net_ft
from drivers.readings import ReadingBlock
from drivers.serial_ft import device as serial_ft
from drivers.transducer import LinkLost, SetupError
from simulators.bench import Bench
from simulators.boxes import SIMULATORS, Simulated
from simulators.faults import Fault, Faults
from simulators.net_ft_box import NetFtBox
from simulators.stroke import Stroke
from simulators.surface import paper_surfaces

pytestmark = pytest.mark.skipif(os.name != "posix", reason="there are no pseudo-terminals on this system")

SEED = 3
RECORDED = Path(__file__).parents[1] / "data" / "sessions" / "version-1" / "sealed"
IDENTIFY = {driver.name: driver.identify for driver in DRIVERS}
LIVE = [*IDENTIFY, "sim"]
NAMES = [*LIVE, "replay"]
PATIENCE = 15.0  # until a stream is taken not to have gone on [real s]
LENGTH = {"unplug": 0.5, "reboot": 0.5, "slow": PATIENCE}  # of a fault, where not 0.25 [real s]
SHARE = {"corrupt": 0.1, "shorten": 0.1, "repeat": 0.3, "reorder": 0.3, "delay": 0.3, "slow": 0.6}
STOPS_WITHIN = 0.2  # [real s]
AGAIN = 5  # times a fault is tried again that happened while nothing was sent
FIELD = {  # of Health, which a fault must show in
    "lose": "lost",
    "repeat": "repeated",
    "reorder": "late",
    "delay": "late",
    "corrupt": "malformed",
    "shorten": "malformed",
    "stall": "stalled",
    "saturate": "saturated",
    "unplug": "lost",
    "reboot": "restarted",
    "slow": "off_rate",
}
ONE_AFTER_THE_OTHER = tuple(FIELD)  # with the slow clock last: it stays slow


def simulated_bench(faults, monkeypatch):
    monkeypatch.setattr(wiring, "NetFtBox", partial(NetFtBox, faults=faults))
    return Simulated(f"sim:?seed={SEED}", Bench(SEED), lambda: 0.0, lambda: None)


def recording():
    return Simulated(f"replay:{RECORDED}", Bench(SEED), lambda: 0.0, lambda: None)


def started(name, faults, clock, folder, monkeypatch):
    match name:
        case "sim":
            return simulated_bench(faults, monkeypatch)
        case "replay":
            return recording()
        case _:
            return SIMULATORS[name].start(Bench(SEED), clock, faults, folder)


def simulator(name):
    return SIMULATORS["net-ft" if name in ("sim", "replay") else name]


def handles(device, before=0):
    """Return how many handles are open beyond `before`; a simulated device needs a moment to hang up."""
    for _ in range(50):
        count = len(list(Path("/dev/fd").iterdir())) + device.held() - before
        if not before or count <= 0:
            break
        time.sleep(0.02)
    return count


def quickened(monkeypatch):
    """Let what a driver waits for be no longer than a test needs; a first reading comes, however busy the machine."""
    monkeypatch.setattr(net_ft, "_PATIENCE", 120.0)
    monkeypatch.setattr(serial_ft, "_MEASURED", 0.25)
    monkeypatch.setattr(digital_ft, "_MEASURED", 0.15)
    monkeypatch.setattr(streaming, "_SILENCE", 0.8)
    monkeypatch.setattr(net_ft, "_SILENCE", 0.9)
    monkeypatch.setattr(rate, "WINDOW", 0.25)


@dataclass
class Undisturbed:
    """What came of an undisturbed course."""

    uri: str
    bench: Bench
    found: Any = None  # who was identified before, during and after it was open; or the refusal
    found_in_use: Any = None
    found_after: Any = None
    info: Any = None
    healths: list[Any] = field(default_factory=list)  # of the first stream, and of a second one
    blocks: list[ReadingBlock] = field(default_factory=list)
    planted: Any = None
    stops: list[float] = field(default_factory=list)  # how long each took [real s]
    started_twice: str = ""
    after_stop: int = -1  # readings still coming
    threads_left: set[Any] = field(default_factory=set)
    handles_left: int = -1


@dataclass
class Disturbed:
    """What came of a course full of faults."""

    told: dict[str, tuple[Any, Any, bool]]  # by fault: health before and after, and whether the stream went on
    info: Any
    block: ReadingBlock
    health: Any
    sentence: str  # when the device went away
    uri: str
    threads_left: set[Any]
    handles_left: int


def identified(name, uri):
    """Return who answers, or why nobody may ask; nothing where the address is not of the catalogue's."""
    if name not in IDENTIFY:
        return None
    for _ in range(20):  # a device may be deaf for a moment after its stream was ended
        try:
            return IDENTIFY[name](parse_address(uri), 2.0)
        except SetupError as error:
            return str(error)
        except LinkLost as error:
            why = str(error)
            time.sleep(0.05)
    return why


def stopped(transducer, course):
    began = time.monotonic()
    transducer.stop()
    course.stops.append(time.monotonic() - began)


def undisturbed_course(name, folder):
    """Go through the undisturbed course with one driver."""
    clock, threads = PacedClock(simulator(name).factor), set(threading.enumerate())
    with pytest.MonkeyPatch.context() as monkeypatch:
        quickened(monkeypatch)
        device = started(name, Faults(), clock, folder, monkeypatch)
        before = handles(device)
        course = Undisturbed(device.uri, device.bench)
        course.found = identified(name, device.uri)
        with connected(device.uri, clock) as opened:
            transducer, bench, now = opened.transducer, opened.bench or device.bench, opened.bench_now or device.now
            course.info, course.bench = transducer.info, bench
            bench.mount(paper_surfaces()["stickiness", 80])
            begun = now()
            transducer.start()
            stroke = Stroke(7.81, 17.5, approach=0.2, stick=0.2, slide=0.8)
            course.planted = bench.begin_stroke(stroke, now() + 0.2 * clock.factor)
            course.found_in_use = identified(name, device.uri)
            blocks, newest = [], 0.0
            far = 0.5 if name == "replay" else course.planted.end - begun  # readings count from the first of them
            try:
                while newest < far:
                    blocks.append(transducer.read(0.1))
                    newest = max([newest, *blocks[-1].time[-1:].tolist()])
            finally:
                stopped(transducer, course)
            course.blocks.append(ReadingBlock.joined([*blocks, transducer.read(0.0)]))
            course.after_stop = len(transducer.read(0.0))
            course.healths.append(transducer.health)
            if name != "replay":
                transducer.start()
                course.started_twice = refusal(transducer)
                again = transducer.read(10.0)
                stopped(transducer, course)
                course.blocks.append(ReadingBlock.joined([again, transducer.read(0.0)]))
                course.healths.append(transducer.health)
                while min(course.stops) >= STOPS_WITHIN and len(course.stops) < 4 * AGAIN:  # a busy machine
                    transducer.start()
                    stopped(transducer, course)
            transducer.stop()
            transducer.close()
        course.found_after = identified(name, device.uri)
        course.handles_left = handles(device, before)
        device.close()
        device.forget()
        course.threads_left = set(threading.enumerate()) - threads
    return course


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Return a function that gives the undisturbed course of a driver, gone through once."""
    return cache(lambda name: undisturbed_course(name, tmp_path_factory.mktemp("device")))


@pytest.fixture(scope="module")
def disturbed(tmp_path_factory):
    """Return a function that gives the course full of faults of a driver, gone through once."""
    return cache(lambda name: disturbed_course(name, tmp_path_factory.mktemp("device")))


def refusal(transducer):
    try:
        transducer.start()
    except SetupError as error:
        return str(error)
    return ""


def disturbed_course(name, folder):
    """Go through all that can go wrong with one driver, and lose the device at the end."""
    clock, faults, threads = PacedClock(simulator(name).factor), Faults(seed=1), set(threading.enumerate())
    with pytest.MonkeyPatch.context() as monkeypatch:
        quickened(monkeypatch)
        device = started(name, faults, clock, folder, monkeypatch)
        before = handles(device)
        told, blocks, sentence = {}, [], ""
        with connected(device.uri, clock) as opened:
            transducer, now = opened.transducer, opened.bench_now or device.now
            transducer.start()
            blocks.append(transducer.read(10.0))
            for kind in ONE_AFTER_THE_OTHER:
                if kind in (*simulator(name).tells, *simulator(name).hides):
                    told[kind] = gone_through(kind, transducer, blocks, faults, clock, now)
                    for _ in range(AGAIN):  # a machine that slept through the fault has had none
                        if kind not in simulator(name).tells or counted(kind, told[kind]):
                            break
                        told[kind] = gone_through(kind, transducer, blocks, faults, clock, now)
            if name == "sim":  # whose device cannot be taken away: it is closed with it
                transducer.stop()
                blocks.append(transducer.read(0.0))
            else:
                device.close()
                sentence = lost(transducer, blocks)
            health, info = transducer.health, transducer.info
        left = handles(device, before)
        device.forget()
    return Disturbed(
        told,
        info,
        ReadingBlock.joined(blocks),
        health,
        sentence,
        device.uri,
        set(threading.enumerate()) - threads,
        left,
    )


def counted(kind, told):
    """Say whether the counter of a fault has grown."""
    before, after, _ = told
    return getattr(after, FIELD[kind]) > getattr(before, FIELD[kind])


def gone_through(kind, transducer, blocks, faults, clock, now):
    """Let one thing go wrong, and read until the stream has gone on behind it, or what was looked for is found."""
    before = transducer.health
    begin = now() + 0.02 * clock.factor
    end = begin + LENGTH.get(kind, 0.25) * clock.factor
    faults.put(Fault(kind, begin, end, SHARE.get(kind, 1.0), 0.05 * clock.factor))
    origin_ns = clock.now_ns() - round(now() * 1e9)
    deadline = time.monotonic() + PATIENCE
    went_on = False
    while not went_on and time.monotonic() < deadline:
        block = transducer.read(0.1 * clock.factor)
        blocks.append(block)
        if kind == "slow":
            went_on = transducer.health.off_rate > before.off_rate
        elif len(block):
            went_on = (int(block.received_ns[-1]) - origin_ns) * 1e-9 > end + 0.05 * clock.factor
    return before, transducer.health, went_on


def lost(transducer, blocks):
    """Return what is said when the device has gone away."""
    while True:
        try:
            blocks.append(transducer.read(10.0))
        except LinkLost as error:
            return str(error)


def test_every_driver_in_the_list_has_a_simulated_device_in_its_own():
    assert {driver.name for driver in DRIVERS} == SIMULATORS.keys()


# ---- the undisturbed course


@pytest.mark.parametrize("name", NAMES)
def test_it_says_who_it_is_and_that_it_is_simulated(undisturbed, name):
    course = undisturbed(name)
    info = course.info
    assert info.simulated
    assert info.uri == course.uri or course.uri.startswith("sim:")
    assert info.model
    assert info.serial == info.calibration.serial
    assert info.serial == ("FT1" if name == "replay" else f"SIM{SEED:05d}")
    assert info.settings, "nothing was read back"


@pytest.mark.parametrize("name", NAMES)
def test_its_calibration_is_read(undisturbed, name):
    course = undisturbed(name)
    calibration = course.info.calibration
    assert np.linalg.matrix_rank(calibration.matrix) == 6
    rated = [50.0, 50.0, 70.0, 500.0, 500.0, 500.0] if name == "replay" else None
    assert calibration.rated.tolist() == pytest.approx(rated or course.bench.settings.rated)
    assert calibration.source


@pytest.mark.parametrize("name", IDENTIFY)
def test_who_is_there_can_be_asked_before_and_after_and_the_port_is_free_again(undisturbed, name):
    course = undisturbed(name)
    for found in (course.found, course.found_after):
        assert found.serial == course.info.serial, found
        assert found.model == course.info.model


@pytest.mark.parametrize("name", NAMES)
def test_asking_who_is_there_does_not_disturb_a_stream(undisturbed, name):
    course = undisturbed(name)
    in_use = course.found_in_use
    if in_use is not None:
        taken = isinstance(in_use, str) and "another program has it" in in_use
        assert taken or in_use.serial == course.info.serial, in_use
    health = course.healths[0]
    assert health.restarted == 0
    assert health.lost == 0 or name == "replay"  # which loses what its recording lost


@pytest.mark.parametrize("name", NAMES)
def test_an_undisturbed_stream_is_whole(undisturbed, name):
    course = undisturbed(name)
    block, health = course.blocks[0], course.healths[0]
    assert health.received == len(block) > 50
    assert health.repeated == health.late == health.malformed == health.stalled == 0
    assert health.restarted == health.saturated == health.off_rate == 0
    assert block.time[0] == 0.0
    if name != "replay":
        assert health.lost == 0
        assert np.diff(block.sequence).tolist() == [1] * (len(block) - 1)
        late = (block.received_ns - block.received_ns[0]) * 1e-9 - block.time
        half = len(late) // 2
        apart = late[half:].min() - late[:half].min()  # by readings that waited least: the others came late
        assert abs(apart) < 0.05 * block.time[-1] + 0.1 * simulator(name).factor
    assert np.all(np.diff(block.time) > 0.0)
    assert np.all(np.diff(block.received_ns) >= 0)


@pytest.mark.parametrize("name", LIVE)
def test_it_feels_what_the_bench_exerts(undisturbed, name):
    course = undisturbed(name)
    block, planted = course.blocks[0], course.planted
    bias = block.raw[: len(block) // 20].mean(axis=0)  # before the hand sets off
    wrench = course.info.calibration.wrench(block.raw, bias)
    assert -wrench[:, 2].min() == pytest.approx(planted.peak_normal_force, abs=0.06)
    assert wrench[:, 0].max() == pytest.approx(planted.mu * planted.peak_normal_force, abs=0.06)


@pytest.mark.parametrize("name", NAMES)
def test_its_lag_is_told(undisturbed, name):
    course = undisturbed(name)
    assert all(0.0 <= health.lag_ms < 1e4 for health in course.healths)


@pytest.mark.parametrize("name", NAMES)
def test_it_stops_within_a_fifth_of_a_second_and_nothing_comes_behind(undisturbed, name):
    course = undisturbed(name)
    assert min(course.stops) < STOPS_WITHIN
    assert course.after_stop == 0


@pytest.mark.parametrize("name", LIVE)
def test_it_can_be_started_again_but_not_twice(undisturbed, name):
    course = undisturbed(name)
    assert "already" in course.started_twice
    assert course.blocks[1].sequence[0] == 1
    assert course.blocks[1].time[0] == 0.0
    assert course.healths[1].received == len(course.blocks[1]) > 0


@pytest.mark.parametrize("name", NAMES)
def test_no_thread_port_or_handle_is_left_behind(undisturbed, name):
    course = undisturbed(name)
    assert course.threads_left == set()
    assert course.handles_left == 0


# ---- all that can go wrong


TOLD = [(name, kind) for name in LIVE for kind in ONE_AFTER_THE_OTHER if kind in simulator(name).tells]
HIDDEN = [(name, kind) for name in LIVE for kind in simulator(name).hides]


@pytest.mark.parametrize(("name", "kind"), TOLD)
def test_it_survives_each_fault_and_says_which(disturbed, name, kind):
    course = disturbed(name)
    before, after, went_on = course.told[kind]
    assert counted(kind, course.told[kind]), (before, after)
    assert went_on, "it did not go on after the fault"
    assert kind != "slow" or "Hz, not at" in after.rate_words


@pytest.mark.parametrize(("name", "kind"), HIDDEN)
def test_it_survives_what_its_wire_cannot_tell(disturbed, name, kind):
    course = disturbed(name)
    assert course.told[kind][2], "it did not go on after the fault"


@pytest.mark.parametrize("name", LIVE)
def test_every_reading_is_handed_over_or_counted_as_lost(disturbed, name):
    course = disturbed(name)
    block, health = course.block, course.health
    assert health.received == len(block)
    assert health.received + health.lost == block.sequence[-1]
    assert np.all(np.diff(block.sequence) >= 1)
    assert np.all(np.diff(block.time) >= 0.0)


@pytest.mark.parametrize("name", LIVE)
def test_no_wrong_reading_is_taken_for_a_sound_one(disturbed, name):
    course = disturbed(name)
    sound = course.block.raw[course.block.status == 0]
    wrench = course.info.calibration.wrench(sound, np.median(sound, axis=0))  # nothing touched
    wrong = (np.abs(wrench[:, :3]) > 0.1).any(axis=1) | (np.abs(wrench[:, 3:]) > 1.0).any(axis=1)
    # Neither the controller's binary records, without checksum, nor a sum of seven bits show every change of a byte.
    allowed = 0.2 * course.health.malformed + 2 if name in ("serial-ft", "digital-ft") else 0
    assert np.count_nonzero(wrong) <= allowed


@pytest.mark.parametrize("name", IDENTIFY)
def test_a_device_that_goes_away_is_lost_in_one_sentence(disturbed, name):
    course = disturbed(name)
    assert course.uri in course.sentence
    assert "\n" not in course.sentence


@pytest.mark.parametrize("name", LIVE)
def test_nothing_is_left_behind_by_a_device_that_went_away(disturbed, name):
    course = disturbed(name)
    assert course.threads_left == set()
    assert course.handles_left <= 0  # a simulated port goes with its device


# ---- addresses


@pytest.mark.parametrize("name", LIVE)
def test_a_malformed_address_is_refused_in_one_sentence(name):
    for wrong in ("unheard-of=1", "tool=1,2,3"):
        with pytest.raises(SetupError, match=wrong.split("=")[0]), connected(f"{name}:?{wrong}", PacedClock(1.0)):
            pass


def test_a_usual_address_is_well_formed():
    for driver in DRIVERS:
        for uri in driver.usual:
            assert uri.startswith(driver.name)
            assert [found.uri for found in reachable(patience=0.01)].count(uri) == 1
