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
def running_device(name, faults, clock, folder):
    """Run the simulated device of a driver, and let the driver wait no longer than a test needs."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        shorten_waits(monkeypatch)
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


def count_handles(device, before=0):
    """Return how many handles are open beyond `before`; a simulated device needs a moment to hang up."""
    for _ in range(50):
        count = len(list(Path("/dev/fd").iterdir())) + device.open_handles() - before
        if not before or count <= 0:
            break
        time.sleep(0.02)
    return count


def shorten_waits(monkeypatch):
    """Let a driver wait no longer than a test needs, but for its first reading however busy the machine is."""
    monkeypatch.setattr(deadline, "CONNECTING", 120.0)
    monkeypatch.setattr(serial_ft, "_MEASURED", 0.25)
    monkeypatch.setattr(digital_ft, "_MEASURED", 0.15)
    monkeypatch.setattr(streaming, "_SILENCE", 0.8)
    monkeypatch.setattr(net_ft, "_SILENCE", 0.9)
    monkeypatch.setattr(clock_recovery, "WINDOW", 0.25)


@dataclass
class CalmCourse:
    """What came of an undisturbed course."""

    uri: str
    bench: Bench
    identity: Any = None  # who was identified before, during and after it was open; or the refusal
    identity_in_use: Any = None
    identity_after: Any = None
    info: Any = None
    healths: list[Any] = field(default_factory=list)  # of the first stream, and of a second one
    blocks: list[ReadingBlock] = field(default_factory=list)
    ground_truth: Any = None
    stops: list[float] = field(default_factory=list)  # how long each took [real s]
    second_start: str = ""
    after_stop: int = -1  # readings still coming
    threads_left: set[Any] = field(default_factory=set)
    handles_left: int = -1


@dataclass
class FaultyCourse:
    """What came of a course full of faults."""

    outcomes: dict[str, tuple[Any, Any, bool]]  # by fault: health before and after, and whether the stream went on
    info: Any
    block: ReadingBlock
    health: Any
    sentence: str  # when the device went away
    uri: str
    threads_left: set[Any]
    handles_left: int


def identity_or_reason(name, uri):
    """Return who answers, or why nobody may ask; None where the catalogue has no such driver."""
    if name not in IDENTIFY:
        return None
    for _ in range(20):  # a device may be deaf for a moment after its stream was ended
        try:
            return IDENTIFY[name](parse_address(uri), Deadline(2.0))
        except SetupError as error:
            return str(error)
        except LinkLost as error:
            reason = str(error)
            time.sleep(0.05)
    return reason


def time_stop(transducer, course):
    began = time.monotonic()
    transducer.stop()
    course.stops.append(time.monotonic() - began)


class Metronome:
    """Measures how long this process stood still: by how much a thread overslept."""

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


def retry_if_interrupted(run, accept=lambda _: True, pause=PAUSE):
    """Return what `run` returns; again where the machine stood still for `pause`, a device was lost, or not `whole`."""
    for _ in range(AGAIN):
        try:
            with Metronome() as metronome:
                result = run()
        except LinkLost:  # as of a device that had no time to answer
            continue
        if metronome.longest < pause and accept(result):
            return result
    return run()


def run_calm_course(name, folder):
    """Go through the undisturbed course with one driver; again where it lost readings, as a faulty one always does."""

    def is_whole(course):
        return name == "replay" or not any(health.lost for health in course.healths)

    return retry_if_interrupted(lambda: run_calm_course_once(name, folder), is_whole)


def run_calm_course_once(name, folder):
    """Go through the undisturbed course with one driver, once."""
    clock, threads = PacedClock(simulator(name).factor), set(threading.enumerate())
    with running_device(name, Faults(), clock, folder) as device:
        before = count_handles(device)
        course = CalmCourse(device.uri, device.bench)
        course.identity = identity_or_reason(name, device.uri)
        with connect(device.uri, clock) as connection:
            transducer, bench, now = (
                connection.transducer,
                connection.bench or device.bench,
                connection.bench_now or device.now,
            )
            course.info, course.bench = transducer.info, bench
            bench.mount(paper_surfaces()["stickiness", 80])
            start = now()
            transducer.start()
            stroke = Stroke(7.81, 17.5, approach=0.2, stick=0.2, slide=0.8)
            course.ground_truth = bench.begin_stroke(stroke, now() + 0.2 * clock.factor)
            course.identity_in_use = identity_or_reason(name, device.uri)
            blocks, newest = [], 0.0
            duration = (
                0.5 if name == "replay" else course.ground_truth.end - start
            )  # readings count from the first of them
            try:
                while newest < duration:
                    blocks.append(transducer.read(0.1))
                    newest = max([newest, *blocks[-1].time[-1:].tolist()])
            finally:
                time_stop(transducer, course)
            course.blocks.append(ReadingBlock.concatenate([*blocks, transducer.read(0.0)]))
            course.after_stop = len(transducer.read(0.0))
            course.healths.append(transducer.health)
            if name != "replay":
                transducer.start()
                course.second_start = refusal(transducer)
                second_block = transducer.read(10.0)
                time_stop(transducer, course)
                course.blocks.append(ReadingBlock.concatenate([second_block, transducer.read(0.0)]))
                course.healths.append(transducer.health)
                while min(course.stops) >= STOPS_WITHIN and len(course.stops) < 4 * AGAIN:  # a busy machine
                    transducer.start()
                    time_stop(transducer, course)
            transducer.stop()
            transducer.close()
        course.identity_after = identity_or_reason(name, device.uri)
        course.handles_left = count_handles(device, before)
    course.threads_left = set(threading.enumerate()) - threads
    return course


def refusal(transducer):
    try:
        transducer.start()
    except SetupError as error:
        return str(error)
    return ""


def run_faulty_course(name, folder):
    """Go through all that can go wrong; again where the device is given up too early, as by a faulty driver always."""
    return retry_if_interrupted(lambda: run_faulty_course_once(name, folder), pause=math.inf)


def run_faulty_course_once(name, folder):
    """Go through all that can go wrong with one driver, once, and lose the device at the end."""
    clock, faults, threads = PacedClock(simulator(name).factor), Faults(seed=1), set(threading.enumerate())
    with running_device(name, faults, clock, folder) as device:
        before = count_handles(device)
        outcomes, blocks, sentence = {}, [], ""
        with connect(device.uri, clock) as connection:
            transducer, now = connection.transducer, connection.bench_now or device.now
            transducer.start()
            blocks.append(transducer.read(10.0))
            for kind in ONE_AFTER_THE_OTHER:
                tells = kind in simulator(name).tells
                for _ in range(1 + AGAIN if tells or kind in simulator(name).hides else 0):
                    outcomes[kind] = inject_fault(kind, tells, transducer, blocks, faults, clock, now)
                    if not tells or is_counted(kind, outcomes[kind]):
                        break  # else the machine slept through the fault, and there was none
            if name == "sim":  # whose device cannot be taken away: it is closed with it
                transducer.stop()
                blocks.append(transducer.read(0.0))
            else:
                device.close()
                sentence = read_until_lost(transducer, blocks)
            health, info = transducer.health, transducer.info
        handles_left = count_handles(device, before)
    return FaultyCourse(
        outcomes,
        info,
        ReadingBlock.concatenate(blocks),
        health,
        sentence,
        device.uri,
        set(threading.enumerate()) - threads,
        handles_left,
    )


def run_status_course(name, folder):
    """Set each status that the maker lists, in turn; return the device's info and health before and after each."""
    clock, faults, health_by_status = PacedClock(1.0), Faults(), {}
    with running_device(name, faults, clock, folder) as device, connect(device.uri, clock) as connection:
        transducer, now = connection.transducer, connection.bench_now or device.now
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
            health_by_status[status] = before, transducer.health, time.monotonic() - since
            faults.put()
            while (block := transducer.read(0.1)) is not None and len(block) and block.status[-1]:
                pass
        transducer.stop()
    return connection.transducer.info, health_by_status


def is_counted(kind, outcome):
    """Return whether the counter of a fault has grown."""
    before, after, _ = outcome
    return getattr(after, FIELD[kind]) > getattr(before, FIELD[kind])


def inject_fault(kind, tells, transducer, blocks, faults, clock, now):
    """Let one thing go wrong, and read until the stream has gone on behind it and, where it `tells`, is counted."""
    before = transducer.health
    begin = now() + 0.02 * clock.factor
    end = begin + LENGTH.get(kind, 0.25) * clock.factor
    faults.put(Fault(kind, begin, end, SHARE.get(kind, 1.0), 0.05 * clock.factor))
    origin_ns = clock.now_ns() - round(now() * 1e9)
    deadline, lag_limit = Deadline(PATIENCE), None
    went_on = False
    while deadline.remaining > 0.0:
        block = transducer.read(0.1 * clock.factor)
        blocks.append(block)
        if kind == "slow":
            went_on = transducer.health.off_rate > before.off_rate
        elif len(block):
            went_on = (int(block.received_ns[-1]) - origin_ns) * 1e-9 > end + 0.05 * clock.factor
        if went_on and lag_limit is None:
            lag_limit = Deadline(LAGS)  # a busy device may still have to send what it made before the fault
        if lag_limit is not None and (
            not tells or lag_limit.remaining <= 0.0 or is_counted(kind, (before, transducer.health, True))
        ):
            break
    return before, transducer.health, went_on


def read_until_lost(transducer, blocks):
    """Return the sentence with which the driver gives up a device that has gone away."""
    while True:
        try:
            blocks.append(transducer.read(10.0))
        except LinkLost as error:
            return str(error)
