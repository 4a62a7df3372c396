"""Resuming an interrupted session: its state from its log, and how the new clock and readings join the old."""

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
CLOCKS_AGREE = 1.0  # largest drift between wall clock and session clock within a session [s]
LEAST_GAP_NS = 1_000_000  # where the wall clock shows no gap: the session clock always advances


@dataclass(frozen=True, slots=True)
class Resumption:
    """Where an interrupted session continues."""

    state: State
    due_lines: tuple[Line, ...]  # about takes: decided, or now due, and not in the log yet
    commands: tuple[Command, ...]  # that enter the state, without those about takes


def resumption(plan: SessionPlan, events: Sequence[LoggedEvent], *, keep_answered: bool = True) -> Resumption:
    """Return where a session with this log continues: at the same trial, its open take discarded.

    With `keep_answered` it continues after a trial whose stroke and answer are done. Raises RecordingError where an
    event does not follow from those before it.
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
        elif entry.kind in ("take_kept", "take_discarded", "resumed"):  # by an earlier part's end, or its resumption
            state, _ = resume_interrupted(state, CUT_SHORT, keep_answered=entry.kind == "take_kept")
    state, commands = resume_interrupted(state, CUT_SHORT, keep_answered=keep_answered)
    due = _of_takes(commands)
    pending = tuple(command for command in commands if line_of(command) not in due)
    return Resumption(state, (*due_lines, *due), pending)


def check_resumable(recording: Recording) -> None:
    """Raise RecordingError unless the session was cut short, its log is whole and its clock can be continued."""
    folder, end = recording.folder, recording.end
    seals = "" if is_sealed(folder) else f"; 'daq-app resume {folder} --end' seals it"
    if not recording.log_is_whole:
        raise RecordingError(f"{folder} cannot be resumed: its log is damaged; it can still be analysed{seals}")
    if end is not None and end.get("cause") not in RESUMABLE:
        raise RecordingError(f"{folder} has ended ({end.get('reason')}); only one cut short is resumed{seals}")
    if recording.provenance["clock"]["factor"] == 0.0:
        raise RecordingError(f"{folder} ran on simulated time without a pace; begin a new session{seals}")


def check_same_transducer(original: TransducerInfo | None, present: TransducerInfo | None) -> None:
    """Raise RecordingError unless the transducer is the session's, with the same calibration and rate."""
    if original is None or present is None:
        if original is not present:
            raise RecordingError("the session began without a transducer, or is resumed without its own")
        return
    if present.serial != original.serial:
        raise RecordingError(
            f"the session began on the transducer with serial number {original.serial}, and this one has"
            f" {present.serial}; connect the first, or begin a new session"
        )
    if calibration_hash(present.calibration) != calibration_hash(original.calibration):
        raise RecordingError(f"transducer {present.serial} has another calibration than before; begin a new session")
    # The rate of a device without a counter is measured on opening, to a few per cent.
    tolerance = SPREAD if np.isnan(original.counter_rate) else 1e-3
    if not np.isclose(present.rate, original.rate, rtol=tolerance, equal_nan=True):
        raise RecordingError(
            f"transducer {present.serial} gives {present.rate:g} readings a second, and gave {original.rate:g};"
            " restore its settings"
        )


@dataclass(frozen=True, slots=True)
class ContinuedClock:
    """A clock that continues the session's clock."""

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
    """Return a clock that continues the session's, and the gap as the event `resumed` records it.

    `last_block` holds the last readings (or none). The session clock advances from its last instant by the time that
    the wall clock, now at `date`, shows, to about a second: no other clock survives a restart of the computer.
    """
    clock_readings = [(str(recording.provenance["created_utc"]), int(recording.provenance["clock"]["now_ns"]))]
    resumptions = (e.data for e in recording.events if e.kind == "resumed")
    clock_readings += [(data["resumed_utc"], _clock_at_resumption(data)) for data in resumptions]
    utc, at_ns = clock_readings[-1]
    instants = [at_ns, *(event.time_ns for event in recording.events), *last_block.received_ns.tolist()]
    last_ns = max(instants)
    elapsed_ns = round((date - datetime.fromisoformat(utc)).total_seconds() * 1e9)
    # A simulated clock ran faster; in the gap, time passed as on the wall clock.
    gap_ns = elapsed_ns - round((last_ns - at_ns) / float(recording.provenance["clock"]["factor"]))
    offset_ns = last_ns + max(gap_ns, LEAST_GAP_NS) - clock.now_ns()  # as `_clock_at_resumption` reads it again
    duration = gap_ns * 1e-9 if gap_ns * 1e-9 > -CLOCKS_AGREE else None
    gap = {
        "gap": None if duration is None else max(duration, 0.0),  # [s]; None where the wall clock ran backwards
        "last_ns": last_ns,  # session clock of the last recorded data
        "clock_offset_ns": offset_ns,  # session clock minus the clock of the continuing program
        "resumed_utc": date.astimezone(UTC).isoformat(timespec="milliseconds"),
    }
    return ContinuedClock(clock, offset_ns), gap


def _clock_at_resumption(data: Mapping[str, Any]) -> int:
    """Return the session clock [ns] at the date of a `resumed`, which is written once the device is open."""
    return int(data["last_ns"]) + max(round((data.get("gap") or 0.0) * 1e9), LEAST_GAP_NS)


@dataclass(frozen=True, slots=True)
class Seam:
    """Offsets with which numbers and times of readings after a resumption continue those before it."""

    sequence_offset: int
    time_offset: float  # [s]

    @staticmethod
    def between(old: ReadingBlock, new: ReadingBlock) -> "Seam":
        """Return the seam of the last readings before and the first after; the gap is taken from the session clock.

        Without old readings the offsets are zero.
        """
        if not len(old):
            return Seam(0, 0.0)
        gap_s = max(int(new.received_ns[0]) - int(old.received_ns[-1]), LEAST_GAP_NS) * 1e-9
        return Seam(int(old.sequence[-1]) + 1 - int(new.sequence[0]), float(old.time[-1]) + gap_s - float(new.time[0]))

    def join(self, block: ReadingBlock) -> ReadingBlock:
        """Return the readings with continuous numbers and times; raw values, counter and status stay the device's."""
        return replace(block, sequence=block.sequence + self.sequence_offset, time=block.time + self.time_offset)


def resumed_data(gap: Mapping[str, Any], info: TransducerInfo | None, software: Mapping[str, str]) -> dict[str, Any]:
    """Return the data of the event `resumed`."""
    return {
        **gap,
        "uri": None if info is None else info.uri,
        "settings": {} if info is None else dict(info.settings),
        "software": dict(software),
    }


def _of_takes(commands: Sequence[Command]) -> list[Line]:
    return [line for line in filter(None, map(line_of, commands)) if line[0] in OF_TAKES]
