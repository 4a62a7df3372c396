"""A session that was cut short goes on: where it was, by its log; and how the new clock and readings join the old."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np

from drivers.clock import Clock
from drivers.clock_recovery import SPREAD
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import SessionPlan
from sessions.recording import LoggedEvent, Recording, RecordingError
from sessions.recording.head import calibration_hash
from sessions.recording.manifest import is_sealed
from sessions.run.event_log import Line, event_of, line_of
from sessions.run.machine import advance, resume_interrupted, start
from sessions.run.states import State
from sessions.run.steps import Command, Refuse

CUT_SHORT = "the recording was cut short in the middle of it"
OF_TAKES = frozenset({"take_started", "take_kept", "take_discarded", "take_restored", "left_out"})
RESUMABLE = frozenset({"device", "client", "disk"})  # causes of an end that cut a session short
CLOCKS_AGREE = 1.0  # wall clock and session clock drift apart by less within a session [s]
LEAST_GAP_NS = 1_000_000  # where the wall clock shows none: the session clock never stands still or runs backwards


@dataclass(frozen=True, slots=True)
class Resumption:
    """Where a session that was cut short goes on."""

    state: State
    due_lines: tuple[Line, ...]  # about takes: decided, or now due, and not in the log yet
    commands: tuple[Command, ...]  # that enter the state, without those about takes


def resumption(plan: SessionPlan, events: Sequence[LoggedEvent]) -> Resumption:
    """Return where a session with this log goes on: at the same trial, its open take discarded.

    Raises RecordingError where an event does not follow from those before it.
    """
    state, _ = start(plan)
    due_lines: list[Line] = []
    for entry in events:
        line = (entry.kind, entry.trial, dict(entry.data))
        try:
            event = event_of(entry)
        except ValueError as error:
            raise RecordingError(f"event {entry.number} of the log is not readable ({error})") from error
        if event is not None:
            state, commands = advance(state, event)
            if any(isinstance(command, Refuse) for command in commands):
                raise RecordingError(
                    f"event {entry.number} ({entry.kind}) of the log does not follow from those before it:"
                    " the session can be analysed, not resumed"
                )
            due_lines = _of_takes(commands)
        elif line in due_lines:
            due_lines.remove(line)
        elif entry.kind in ("take_discarded", "resumed"):  # by the end of an earlier part, or by its resumption
            state, _ = resume_interrupted(state, CUT_SHORT)
    state, commands = resume_interrupted(state, CUT_SHORT)
    due = _of_takes(commands)
    pending = tuple(command for command in commands if line_of(command) not in due)
    return Resumption(state, (*due_lines, *due), pending)


def check_resumable(recording: Recording) -> None:
    """Raise RecordingError unless the session was cut short, its log is whole and its clock can go on."""
    folder, end = recording.folder, recording.end
    seals = "" if is_sealed(folder) else f"; 'daq-app resume {folder} --end' seals it"
    if not recording.log_is_whole:
        raise RecordingError(f"{folder} cannot be resumed: its log is damaged; it can still be analysed{seals}")
    if end is not None and end.get("cause") not in RESUMABLE:
        raise RecordingError(f"{folder} has ended ({end.get('reason')}); only one cut short is resumed{seals}")
    if recording.provenance["clock"]["factor"] == 0.0:
        raise RecordingError(f"{folder} ran on simulated time without a pace; begin a new session{seals}")


def check_same_transducer(original: TransducerInfo | None, present: TransducerInfo | None) -> None:
    """Raise RecordingError unless the transducer is the one the session began with, set and calibrated alike."""
    if original is None or present is None:
        if original is not present:
            raise RecordingError("the session began without a transducer, or is to go on without its own")
        return
    if present.serial != original.serial:
        raise RecordingError(
            f"the session began on the transducer with serial number {original.serial}, and this one has"
            f" {present.serial}; connect the first, or begin a new session"
        )
    if calibration_hash(present.calibration) != calibration_hash(original.calibration):
        raise RecordingError(f"transducer {present.serial} is calibrated otherwise than before; begin a new session")
    # A device that counts no ticks of its own has its rate measured when it is opened, good to a few per cent.
    tolerance = SPREAD if np.isnan(original.counter_rate) else 1e-3
    if not np.isclose(present.rate, original.rate, rtol=tolerance, equal_nan=True):
        raise RecordingError(
            f"transducer {present.serial} gives {present.rate:g} readings a second, and gave {original.rate:g};"
            " set it as it was"
        )


@dataclass(frozen=True, slots=True)
class ContinuedClock:
    """A clock that goes on where the session's clock was."""

    clock: Clock
    offset_ns: int  # added to the clock's time [ns]

    @property
    def factor(self) -> float:
        """Return the session seconds in one real second."""
        return self.clock.factor

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return self.clock.now_ns() + self.offset_ns

    def sleep(self, seconds: float) -> None:
        """Wait."""
        self.clock.sleep(seconds)


def continue_clock(
    recording: Recording, last_block: ReadingBlock, clock: Clock, date: datetime
) -> tuple[ContinuedClock, dict[str, Any]]:
    """Return a clock that continues the session's, and what the event `resumed` records of the gap between.

    `last_block` holds the last readings (or none). The session clock goes on from its last instant by as much as the
    wall clock, now at `date`, says has passed, a second more or less: no two clocks of a computer survive its restart.
    """
    clock_readings = [(str(recording.provenance["created_utc"]), int(recording.provenance["clock"]["now_ns"]))]
    resumptions = (e.data for e in recording.events if e.kind == "resumed")
    clock_readings += [(data["resumed_utc"], _clock_at_resumption(data)) for data in resumptions]
    utc, at_ns = clock_readings[-1]
    instants = [at_ns, *(event.time_ns for event in recording.events), *last_block.received_ns.tolist()]
    last_ns = max(instants)
    elapsed_ns = round((date - datetime.fromisoformat(utc)).total_seconds() * 1e9)
    # A simulated clock ran faster; while nothing ran, time passed as on the wall.
    gap_ns = elapsed_ns - round((last_ns - at_ns) / float(recording.provenance["clock"]["factor"]))
    offset_ns = last_ns + max(gap_ns, LEAST_GAP_NS) - clock.now_ns()  # as `_clock_at_resumption` reads it again
    duration = gap_ns * 1e-9 if gap_ns * 1e-9 > -CLOCKS_AGREE else None
    gap = {
        "gap": None if duration is None else max(duration, 0.0),  # [s]; None where the wall clock ran backwards
        "last_ns": last_ns,  # session clock of the last thing recorded
        "clock_offset_ns": offset_ns,  # session clock minus the clock of the program that goes on
        "resumed_utc": date.astimezone(UTC).isoformat(timespec="milliseconds"),
    }
    return ContinuedClock(clock, offset_ns), gap


def _clock_at_resumption(data: Mapping[str, Any]) -> int:
    """Return the session clock [ns] at the date of a `resumed`, which is written once the device is open."""
    return int(data["last_ns"]) + max(round((data.get("gap") or 0.0) * 1e9), LEAST_GAP_NS)


@dataclass(frozen=True, slots=True)
class Seam:
    """What is added to readings after a resumption, so that their numbers and times go on from those before."""

    sequence_offset: int
    time_offset: float  # [s]

    @staticmethod
    def between(old: ReadingBlock, new: ReadingBlock) -> "Seam":
        """Return the seam of the last readings before and the first after it; the time between is the session clock's.

        A seam after no reading adds nothing.
        """
        if not len(old):
            return Seam(0, 0.0)
        gap_s = max(int(new.received_ns[0]) - int(old.received_ns[-1]), LEAST_GAP_NS) * 1e-9
        return Seam(int(old.sequence[-1]) + 1 - int(new.sequence[0]), float(old.time[-1]) + gap_s - float(new.time[0]))

    def join(self, block: ReadingBlock) -> ReadingBlock:
        """Return the readings with continuous numbers and times; raw values, counter and status stay the device's."""
        return replace(block, sequence=block.sequence + self.sequence_offset, time=block.time + self.time_offset)


def resumed_data(gap: Mapping[str, Any], info: TransducerInfo | None, software: Mapping[str, str]) -> dict[str, Any]:
    """Return what the event `resumed` holds."""
    return {
        **gap,
        "uri": None if info is None else info.uri,
        "settings": {} if info is None else dict(info.settings),
        "software": dict(software),
    }


def _of_takes(commands: Sequence[Command]) -> list[Line]:
    return [line for line in filter(None, map(line_of, commands)) if line[0] in OF_TAKES]
