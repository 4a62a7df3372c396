"""Test crash safety on this computer and this disk, and write a dated certificate of the result.

In a temporary folder it kills the recorder, cuts the end off its log, fills the space for a session, and stops the
recorder. Sessions that are later recorded below DIR carry the certificate. It takes less than a minute.
"""

import argparse
import random
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from daq_app.console import DONE, FLAWED, Console
from daq_app.recorder import messages as m
from daq_app.recorder.client import Recorder
from drivers.calibration import Calibration
from drivers.clock import RealClock
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import LoggedEvent, Recording, RecordingError, SessionWriter, provenance
from sessions.recording.head import SELFTEST_FORMAT, machine, software_versions, write_certificate
from sessions.recording.schema import LIVE_FILE, event_row
from sessions.recording.storage import RESERVE, file_system, unsafe
from sessions.run.runner import Status

EXAMPLE = "daq-app selftest --out recordings"
KILLS = 6
STOPS = 3
CUTS = 20
_PACE = 20.0  # simulated seconds per real second
RUNNING = (0.2, 1.0)  # duration of a session before it is killed [s]
DEADLINE = 40.0  # for a recorder to answer [s]
QUOTA = 4 * 2**20  # [bytes]
_RATE = 7000  # of the artificial readings that fill it [Hz]
_PLAN = plan(protocol("sensotact-friction"), "SELFTEST", 1)
Progress = Callable[[float, str], None]
AReport = TypeVar("AReport", bound=m.Report)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    meaning = "folder for the sessions (recordings/)"
    parser.add_argument("--out", type=Path, metavar="DIR", default=Path("recordings"), help=meaning)


def run(options: argparse.Namespace, console: Console) -> int:
    parent: Path = options.out
    parent.mkdir(parents=True, exist_ok=True)
    warning = unsafe(parent)
    room = Path(tempfile.mkdtemp(prefix="selftest-", dir=parent))
    try:
        certificate = selftest(room, console.progress)
    except SelfTestFailed as failure:
        console.result(passed=False, sentence=str(failure), left_in=str(room))
        console.say(f"FAILED: {failure}. Its files are in {room}; report it")
        return FLAWED
    except KeyboardInterrupt:
        shutil.rmtree(room, ignore_errors=True)
        raise
    shutil.rmtree(room)
    path = write_certificate(parent, certificate)
    console.result(passed=True, certificate=str(path), warning=warning, **certificate)
    console.say(certificate["sentence"])
    console.note(None if warning is None else f"however, {warning}")
    console.say(f"certificate  {path}")
    return DONE if warning is None else FLAWED


class SelfTestFailed(Exception):
    """A guarantee did not hold; the message says which."""


def selftest(room: Path, progress: Progress) -> dict[str, Any]:
    """Run every test in the empty folder `room`, and return the certificate.

    Raises SelfTestFailed if a guarantee does not hold, RecordingError if the disk allows no recording at all.
    """
    start = time.monotonic()
    chance = random.Random()
    kills, logs = _try_kills(room, chance, progress)
    progress(0.75, "stopping sessions")
    stop_ms = _try_stops(room / "stopped")
    progress(0.85, "cutting the ends off logs")
    _try_cuts(logs, room / "cut", chance)
    progress(0.9, "filling the disk space of a session")
    quota = _try_quota(room / "full")
    return {
        "format": SELFTEST_FORMAT,
        "utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "sentence": (
            f"On this computer and disk the recorder was killed {KILLS} times, the end of its log was cut off "
            f"{CUTS} times and its disk space was filled: everything acknowledged was there afterwards "
            f"({kills['readings'] + quota['readings']} readings, {kills['events']} events), at most "
            f"{kills['most_lost']:.2f} s of the rest was lost, and each session resumed at the same trial. "
            f"A stop took {stop_ms:.0f} ms."
        ),
        "kills": kills,
        "cuts": CUTS,
        "quota": quota,
        "stop_ms": stop_ms,
        "disk": {"file_system": file_system(room)},
        "machine": machine(),
        "software": software_versions(),
        "seconds": round(time.monotonic() - start, 1),
    }


class _WatchedRecorder:
    """A recorder on the simulated bench, and its reports."""

    def __init__(self) -> None:
        self.recorder = Recorder.start(_PACE)
        self.events: list[LoggedEvent] = []
        self.safe = 0  # readings acknowledged
        self.newest_ns = 0  # when the newest reading shown was received [ns, session clock]
        self._has_ended = False
        self._queue: list[m.Report] = []

    def until(self, report_type: type[AReport]) -> AReport:
        """Return the next report of a type. Raises SelfTestFailed."""
        for report in self._reports(DEADLINE):
            if isinstance(report, report_type):
                return report
            if isinstance(report, m.Failed | m.Gone):
                raise SelfTestFailed(report.sentence)
        raise SelfTestFailed(f"the recorder did not answer within {DEADLINE:g} s")

    def hear(self, seconds: float) -> None:
        """Take note of the reports within `seconds`."""
        for _ in self._reports(seconds):
            pass

    def close(self) -> None:
        """Kill the recorder, and note reports under way; alive, it would rescue the folder that is then removed."""
        self.recorder.kill()
        if not any(isinstance(report, m.Gone) for report in self._reports(DEADLINE)):
            raise SelfTestFailed("a recorder that was killed did not end")

    def _reports(self, seconds: float) -> Iterator[m.Report]:
        """Yield the reports within `seconds`, after noting each; those not consumed wait for the next call."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._queue += self.recorder.poll(0.01)
            while self._queue:
                report = self._queue.pop(0)
                match report:
                    case LoggedEvent():
                        self.events.append(report)
                    case Status(safe=safe):
                        self.safe = max(self.safe, safe.readings)
                    case m.Live(received_ns=received_ns) if len(received_ns) and not self._has_ended:
                        self.newest_ns = int(received_ns[-1])
                    case m.SessionEnded():
                        self._has_ended = True  # later readings are not recorded
                yield report


def _try_kills(room: Path, chance: random.Random, progress: Progress) -> tuple[dict[str, Any], list[Path]]:
    """Kill the recorder during a session, and resume it, repeatedly.

    Return the number of readings and events acknowledged and found afterwards, the greatest loss of readings shown but
    not yet acknowledged [s, session clock], and copies of the folder as the kills left it.
    """
    readings = events = 0
    most_lost = 0.0
    copies: list[Path] = []
    folder = room / "killed-0"
    for number in range(KILLS):
        progress(0.75 * number / KILLS, f"killing the recorder, {number + 1} of {KILLS}")
        with closing(_WatchedRecorder()) as witness:
            trial = _begin_or_resume(witness, folder)
            witness.hear(chance.uniform(*RUNNING))
        recording = Recording.open(folder)
        _check_recording(recording, witness, trial)
        block = recording.last_block()
        if len(block):
            most_lost = max(most_lost, (witness.newest_ns - int(block.received_ns[-1])) * 1e-9)
        readings, events = readings + witness.safe, events + len(witness.events)
        copies.append(room / f"copy-{number}")
        shutil.copytree(folder, copies[-1])
        if recording.end is not None:
            folder = room / f"killed-{number + 1}"  # the session had ended before the kill
    return {"number": KILLS, "readings": readings, "events": events, "most_lost": max(most_lost, 0.0)}, copies


def _begin_or_resume(witness: _WatchedRecorder, folder: Path) -> int | None:
    """Begin or resume a session, and return the trial at which it was resumed, None if it is new."""
    if not folder.exists():
        witness.recorder.send(m.Connect("sim:?seed=1"))
        witness.until(m.Device)
        witness.recorder.send(m.StartSession(_PLAN, str(folder), m.People("simulated people", 1), any_folder=True))
        witness.until(m.SessionBegun)
        return None
    witness.recorder.send(m.ResumeSession(str(folder)))
    witness.until(m.SessionBegun)
    return witness.until(Status).trial


def _check_recording(recording: Recording, witness: _WatchedRecorder, trial: int | None) -> None:
    """Raise SelfTestFailed unless everything acknowledged is in the file and the session resumed at its trial."""
    rows = {event.number: event_row(event) for event in recording.events}
    if any(rows.get(event.number) != event_row(event) for event in witness.events):
        raise SelfTestFailed("an event that had been acknowledged was not in the file after a kill")
    block = recording.readings()
    if len(block) < witness.safe or (np.diff(block.sequence) != 1).any():
        raise SelfTestFailed(f"after a kill, {len(block)} of {witness.safe} acknowledged readings were left")
    resumed = max((event.number for event in recording.events if event.kind == "resumed"), default=0)
    trials = {event.trial for event in recording.events if event.kind == "take_kept" and event.number < resumed}
    if trial is not None and trial != len(trials) + 1:
        raise SelfTestFailed(f"the session was killed in trial {len(trials) + 1} and resumed at trial {trial}")


def _try_stops(room: Path) -> float:
    """Return the median time from a stop to the written end [ms]. Raises SelfTestFailed."""
    spans: list[float] = []
    for number in range(STOPS):
        with closing(_WatchedRecorder()) as witness:
            _begin_or_resume(witness, room / str(number))
            witness.hear(0.3)
            start = time.monotonic()
            witness.recorder.send(m.Stop())
            witness.until(m.SessionEnded)
            spans.append(time.monotonic() - start)
        if Recording.open(room / str(number)).end is None:
            raise SelfTestFailed("a session that was stopped had no written end")
    return round(float(np.median(spans)) * 1e3, 1)


def _try_cuts(copies: list[Path], folder: Path, chance: random.Random) -> None:
    """Cut the ends off copies of a log, as a power cut may. Raises SelfTestFailed."""
    for number in range(CUTS):
        shutil.copytree(copies[number % len(copies)], folder)
        log = folder / f"{LIVE_FILE}-wal"
        if log.exists():
            content = log.read_bytes()
            log.write_bytes(content[: max(len(content) - chance.randrange(1, 200_000), 0)])
        try:
            sequence = Recording.open(folder).readings().sequence
        except RecordingError as error:
            # A log cut back to before its first commit leaves no session.
            if log.stat().st_size > 100_000:
                raise SelfTestFailed(f"a log whose end was cut off could not be read ({error})") from error
        else:
            if (np.diff(sequence) != 1).any():
                raise SelfTestFailed("a log whose end was cut off gave readings with a gap inside")
        shutil.rmtree(folder)


class _QuotaWriter(SessionWriter):
    """A writer whose file may grow up to a quota, and by the reserve once that is released."""

    def give_back_reserve(self) -> None:
        """Release the reserve, and let the file grow into it."""
        super().give_back_reserve()
        self.limit(QUOTA + RESERVE)


def _try_quota(folder: Path) -> dict[str, Any]:
    """Record until the quota is full; every reading and the end must be stored. Raises SelfTestFailed.

    Return the quota [bytes], the readings acknowledged, and the median time to make a second of them safe [ms].
    """
    clock = RealClock()
    calibration = Calibration("SELFTEST", "counts", np.eye(6), np.full(6, np.nan), "made up for the selftest")
    rate = float(_RATE)
    info = TransducerInfo("selftest:", "selftest", "SIMULATED", "SELFTEST", True, rate, rate, calibration)
    writer = _QuotaWriter.create(folder, _PLAN, info, provenance(clock), clock=clock, reserve=RESERVE)
    writer.limit(QUOTA)
    spans: list[float] = []
    position = 0
    while writer.must_end is None:
        if position > 100 * _RATE:
            raise SelfTestFailed("a session without disk space continued without a warning")
        writer.readings(_numbered_readings(position, clock.now_ns()))
        position += _RATE
        start = time.monotonic()
        writer.commit()
        spans.append(time.monotonic() - start)
    safe = writer.acknowledged.readings
    writer.event("ended", data={"reason": writer.must_end, "cause": "disk", "complete": False, "readings": safe})
    writer.close()
    recording = Recording.open(folder)
    block = recording.readings()
    if len(block) != safe or safe != position or recording.end is None:
        raise SelfTestFailed(f"with the disk space filled, {len(block)} of {safe} acknowledged readings were left")
    if not np.array_equal(block.raw, _numbered_readings(0, 0, position).raw):
        raise SelfTestFailed("readings written while the disk space ran out came back with other values")
    return {"bytes": QUOTA, "readings": safe, "commit_ms": round(float(np.median(spans)) * 1e3, 2)}


def _numbered_readings(first: int, received_ns: int, count: int = _RATE) -> ReadingBlock:
    """Return readings whose values follow from their sequence numbers."""
    i = np.arange(first, first + count, dtype=np.int64)
    return ReadingBlock(i, i, i * 0, i / _RATE, np.full(count, received_ns, np.int64), np.outer(i, np.arange(1.0, 7.0)))
