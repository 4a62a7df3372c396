"""The two courses that every driver goes through: an undisturbed one, and one full of faults, one after the other."""

import math
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from daq_app.simulation import wiring
from daq_app.simulation.wiring import connect
from drivers import clock_recovery, deadline, digital_ft, serial_ft, streaming
from drivers.address import parse_address
from drivers.catalog import DRIVERS
from drivers.clock import PacedClock
from drivers.deadline import Deadline
from drivers.net_ft import device as net_ft
from drivers.readings import ReadingBlock
from drivers.transducer import Health, LinkLost, SetupError
from simulators.bench import Bench
from simulators.faults import Fault, Faults
from simulators.net_ft_box import NetFtBox
from simulators.serving import SIMULATORS
from simulators.simulator import RunningSimulator
from simulators.stroke import Stroke, paper_surfaces

SEED = 3
RECORDED = Path(__file__).parents[1] / "data" / "sessions" / "version-1" / "sealed"
IDENTIFY = {driver.name: driver.identify for driver in DRIVERS}
LIVE = [*IDENTIFY, "sim"]
NAMES = [*LIVE, "replay"]
PATIENCE = 15.0  # until a stream is taken not to have gone on [real s]
LENGTH = {"unplug": 0.5, "reboot": 0.5, "slow": PATIENCE}  # of a fault, where not 0.25 [real s]
SHARE = {"corrupt": 0.1, "shorten": 0.1, "repeat": 0.3, "reorder": 0.3, "delay": 0.3, "slow": 0.6}
STOPS_WITHIN = 0.2  # [real s]
LAGS = 3.0  # by which a device on a busy machine sends late at most [real s]
AGAIN = 5  # times a fault is tried again that happened while nothing was sent, and a course in which nothing ran
PAUSE = 0.1  # of this whole process, after which a course counts as disturbed [real s]: readings may seem lost in it
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
    return RunningSimulator(f"sim:?seed={SEED}", Bench(SEED), lambda: 0.0, lambda: None)


def recording():
    return RunningSimulator(f"replay:{RECORDED}", Bench(SEED), lambda: 0.0, lambda: None)


@contextmanager
def started(name, faults, clock, folder):
    """Let the device of a driver run inside, and the driver wait no longer than a test needs."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        quickened(monkeypatch)
        match name:
            case "sim":
                device = simulated_bench(faults, monkeypatch)
            case "replay":
                device = recording()
            case _:
                device = SIMULATORS[name].start(Bench(SEED), clock, faults, folder)
        try:
            yield device
        finally:
            device.close()
            device.forget()


def simulator(name):
    return SIMULATORS["net-ft" if name in ("sim", "replay") else name]


def handles(device, before=0):
    """Return how many handles are open beyond `before`; a simulated device needs a moment to hang up."""
    for _ in range(50):
        count = len(list(Path("/dev/fd").iterdir())) + device.open_handles() - before
        if not before or count <= 0:
            break
        time.sleep(0.02)
    return count


def quickened(monkeypatch):
    """Let what a driver waits for be no longer than a test needs; a first reading comes, however busy the machine."""
    monkeypatch.setattr(deadline, "CONNECTING", 120.0)
    monkeypatch.setattr(serial_ft, "_MEASURED", 0.25)
    monkeypatch.setattr(digital_ft, "_MEASURED", 0.15)
    monkeypatch.setattr(streaming, "_SILENCE", 0.8)
    monkeypatch.setattr(net_ft, "_SILENCE", 0.9)
    monkeypatch.setattr(clock_recovery, "WINDOW", 0.25)


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
            return IDENTIFY[name](parse_address(uri), Deadline(2.0))
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


class Metronome:
    """Measures for how long this process did not run: how much longer than asked a thread of it slept."""

    def __enter__(self):
        self.longest = 0.0  # [real s]
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)
        self._thread.start()
        return self

    def _beat(self):
        began = time.monotonic()
        while not self._over.wait(0.02):
            now = time.monotonic()
            self.longest, began = max(self.longest, now - began), now

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()


def uninterrupted(run, whole=lambda _: True, pause=PAUSE):
    """Return what `run` returns; again where the machine stood still for `pause`, a device was lost, or not `whole`."""
    for _ in range(AGAIN):
        try:
            with Metronome() as metronome:
                came = run()
        except LinkLost:  # as of a device that had no time to answer
            continue
        if metronome.longest < pause and whole(came):
            return came
    return run()


def undisturbed_course(name, folder):
    """Go through the undisturbed course with one driver; again where it lost readings, as a faulty one always does."""

    def whole(course):
        return name == "replay" or not any(health.lost for health in course.healths)

    return uninterrupted(lambda: undisturbed_run(name, folder), whole)


def undisturbed_run(name, folder):
    """Go through the undisturbed course with one driver, once."""
    clock, threads = PacedClock(simulator(name).factor), set(threading.enumerate())
    with started(name, Faults(), clock, folder) as device:
        before = handles(device)
        course = Undisturbed(device.uri, device.bench)
        course.found = identified(name, device.uri)
        with connect(device.uri, clock) as opened:
            transducer, bench, now = (
                opened.transducer,
                opened.bench or device.bench,
                opened.bench_now or device.now,
            )
            course.info, course.bench = transducer.info, bench
            bench.mount(paper_surfaces()["stickiness", 80])
            start = now()
            transducer.start()
            stroke = Stroke(7.81, 17.5, approach=0.2, stick=0.2, slide=0.8)
            course.planted = bench.begin_stroke(stroke, now() + 0.2 * clock.factor)
            course.found_in_use = identified(name, device.uri)
            blocks, newest = [], 0.0
            far = 0.5 if name == "replay" else course.planted.end - start  # readings count from the first of them
            try:
                while newest < far:
                    blocks.append(transducer.read(0.1))
                    newest = max([newest, *blocks[-1].time[-1:].tolist()])
            finally:
                stopped(transducer, course)
            course.blocks.append(ReadingBlock.concatenate([*blocks, transducer.read(0.0)]))
            course.after_stop = len(transducer.read(0.0))
            course.healths.append(transducer.health)
            if name != "replay":
                transducer.start()
                course.started_twice = refusal(transducer)
                again = transducer.read(10.0)
                stopped(transducer, course)
                course.blocks.append(ReadingBlock.concatenate([again, transducer.read(0.0)]))
                course.healths.append(transducer.health)
                while min(course.stops) >= STOPS_WITHIN and len(course.stops) < 4 * AGAIN:  # a busy machine
                    transducer.start()
                    stopped(transducer, course)
            transducer.stop()
            transducer.close()
        course.found_after = identified(name, device.uri)
        course.handles_left = handles(device, before)
    course.threads_left = set(threading.enumerate()) - threads
    return course


def refusal(transducer):
    try:
        transducer.start()
    except SetupError as error:
        return str(error)
    return ""


def disturbed_course(name, folder):
    """Go through all that can go wrong; again where the device is given up too early, as by a faulty driver always."""
    return uninterrupted(lambda: disturbed_run(name, folder), pause=math.inf)


def disturbed_run(name, folder):
    """Go through all that can go wrong with one driver, once, and lose the device at the end."""
    clock, faults, threads = PacedClock(simulator(name).factor), Faults(seed=1), set(threading.enumerate())
    with started(name, faults, clock, folder) as device:
        before = handles(device)
        told, blocks, sentence = {}, [], ""
        with connect(device.uri, clock) as opened:
            transducer, now = opened.transducer, opened.bench_now or device.now
            transducer.start()
            blocks.append(transducer.read(10.0))
            for kind in ONE_AFTER_THE_OTHER:
                tells = kind in simulator(name).tells
                for _ in range(1 + AGAIN if tells or kind in simulator(name).hides else 0):
                    told[kind] = gone_through(kind, tells, transducer, blocks, faults, clock, now)
                    if not tells or counted(kind, told[kind]):
                        break  # else the machine slept through the fault, and there was none
            if name == "sim":  # whose device cannot be taken away: it is closed with it
                transducer.stop()
                blocks.append(transducer.read(0.0))
            else:
                device.close()
                sentence = lost(transducer, blocks)
            health, info = transducer.health, transducer.info
        left = handles(device, before)
    return Disturbed(
        told,
        info,
        ReadingBlock.concatenate(blocks),
        health,
        sentence,
        device.uri,
        set(threading.enumerate()) - threads,
        left,
    )


def planted_statuses_course(name, folder):
    """Plant each status that the maker lists, one after the other; return who it is, and what health said of each."""
    clock, faults, said = PacedClock(1.0), Faults(), {}
    with started(name, faults, clock, folder) as device, connect(device.uri, clock) as opened:
        transducer, now = opened.transducer, opened.bench_now or device.now
        transducer.start()
        for status in simulator(name).statuses:
            if simulator(name).at_start:
                transducer.stop()
            before = transducer.health
            faults.put(Fault("status", now(), now() + 1e6, status=status))
            if simulator(name).at_start:
                transducer.start()
                before = Health()
            since = time.monotonic()
            while transducer.health.flagged == before.flagged and time.monotonic() - since < PATIENCE:
                transducer.read(0.02)
            said[status] = before, transducer.health, time.monotonic() - since
            faults.put()
            while (block := transducer.read(0.1)) is not None and len(block) and block.status[-1]:
                pass
        transducer.stop()
    return opened.transducer.info, said


def counted(kind, told):
    """Say whether the counter of a fault has grown."""
    before, after, _ = told
    return getattr(after, FIELD[kind]) > getattr(before, FIELD[kind])


def gone_through(kind, tells, transducer, blocks, faults, clock, now):
    """Let one thing go wrong, and read until the stream has gone on behind it and, where it `tells`, is counted."""
    before = transducer.health
    begin = now() + 0.02 * clock.factor
    end = begin + LENGTH.get(kind, 0.25) * clock.factor
    faults.put(Fault(kind, begin, end, SHARE.get(kind, 1.0), 0.05 * clock.factor))
    origin_ns = clock.now_ns() - round(now() * 1e9)
    deadline, behind = Deadline(PATIENCE), None
    went_on = False
    while deadline.remaining > 0.0:
        block = transducer.read(0.1 * clock.factor)
        blocks.append(block)
        if kind == "slow":
            went_on = transducer.health.off_rate > before.off_rate
        elif len(block):
            went_on = (int(block.received_ns[-1]) - origin_ns) * 1e-9 > end + 0.05 * clock.factor
        if went_on and behind is None:
            behind = Deadline(LAGS)  # a busy device may still have to send what it made before the fault
        if behind is not None and (
            not tells or behind.remaining <= 0.0 or counted(kind, (before, transducer.health, True))
        ):
            break
    return before, transducer.health, went_on


def lost(transducer, blocks):
    """Return what is said when the device has gone away."""
    while True:
        try:
            blocks.append(transducer.read(10.0))
        except LinkLost as error:
            return str(error)
