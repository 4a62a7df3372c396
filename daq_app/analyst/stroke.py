"""A stroke: its recorded readings, the edges of its windows, and the decisions that move them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from msgspec import Struct

from daq_app.wording import tr, tr_noop
from drivers.arrays import Array
from drivers.readings import ReadingBlock
from sessions.recording import Recording
from sessions.recording.schema import LIVE_FILE, SEALED_FILE
from sessions.report.contents import StrokeFinding
from sessions.strokes.decisions import Decision, Decisions
from sessions.strokes.forces import in_face_frame

AROUND = 1.0  # before and after a stroke of a recording without trials [s]
MOST_FOR_ZERO = 0.3  # longest stretch of readings before contact for a replay's zero [s]
Edge = Literal["onset", "lift", "steady begin", "steady end"]
EDGES: tuple[Edge, ...] = tr_noop(("onset", "steady begin", "steady end", "lift"))
_PLACES = tr_noop(("{name}/{file}, table blocks{rows}", "{name}/{file}, data sets readings/…{rows}"))  # live, sealed
EDGE_DISTANCE = 0.02  # least distance between two edges [s]
EDGE_STEP, EDGE_LEAP = 0.005, 0.05  # step of an edge by a key, and with Shift [s]
# The kind of decision that moves an edge, which is also the name of that number of a stroke.
EDGE_DECISIONS: dict[Edge, str] = {"onset": "onset", "steady begin": "steady", "steady end": "steady", "lift": "lift"}


@dataclass(frozen=True, slots=True, eq=False)
class RawReadings:
    """n readings and their location in the file."""

    location: str  # file, data set and rows
    unit: str  # of the raw numbers
    block: ReadingBlock
    normal: Array  # (n,) unfiltered, `zero` subtracted [N]
    tangential: Array  # (n,) unfiltered, `zero` subtracted [N]
    zero: str  # description of the subtracted zero


class RawFile:
    """The readings of a recording, with their rows in its file. Caches data for later calls."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._all_readings: ReadingBlock | None = None  # of a recording without trials
        self._first_rows: dict[tuple[int, int], int] | None = None  # rows before a block, by its beginning

    def around(self, stroke: StrokeFinding) -> RawReadings:
        """Return the readings of a stroke's take; in a recording without trials, those around the stroke."""
        block = self._block(stroke)
        return _with_forces(self._recording, stroke, block, self._location(block))

    def _block(self, stroke: StrokeFinding) -> ReadingBlock:
        if stroke.trial is not None:
            return self._recording.readings(stroke.trial)
        if self._all_readings is None:
            self._all_readings = self._recording.readings()
        begin = -np.inf if stroke.onset is None else stroke.onset - AROUND
        end = np.inf if stroke.lift is None else stroke.lift + AROUND
        return self._all_readings.between(*np.searchsorted(self._all_readings.time, [begin, end]).tolist())

    def _location(self, block: ReadingBlock) -> str:
        """Return file and data set of readings, with their rows there."""
        folder = self._recording.folder
        if not len(block):
            return tr("{name}: no readings", name=folder.name)
        first = self._row(int(block.sequence[0]), int(block.received_ns[0]))
        rows = "" if first is None else tr(", rows {first} to {last}", first=first, last=first + len(block) - 1)
        sealed = (folder / SEALED_FILE).is_file()
        return tr(_PLACES[sealed], name=folder.name, file=SEALED_FILE if sealed else LIVE_FILE, rows=rows)

    def _row(self, sequence: int, received_ns: int) -> int | None:
        """Return the row of a reading; None if its block is damaged or gone."""
        if self._first_rows is None:
            self._first_rows, count = {}, 0
            for block in self._recording.blocks():
                self._first_rows[int(block.sequence[0]), int(block.received_ns[0])] = count
                count += len(block)
        for block in self._recording.blocks(span=(received_ns, received_ns + 1)):
            matches = np.flatnonzero((block.sequence == sequence) & (block.received_ns == received_ns))
            if len(matches):
                return self._first_rows[int(block.sequence[0]), int(block.received_ns[0])] + int(matches[0])
        return None


def _with_forces(recording: Recording, stroke: StrokeFinding, block: ReadingBlock, location: str) -> RawReadings:
    """Return readings with their forces, minus the mean before contact."""
    assert recording.info is not None  # a stroke implies a transducer
    calibration, contact = recording.info.calibration, -np.inf if stroke.onset is None else stroke.onset
    rows_before = np.flatnonzero((block.time < contact) & (block.status == 0))
    free = rows_before[block.time[rows_before] > block.time[rows_before].max(initial=-np.inf) - MOST_FOR_ZERO]
    zero = block.raw[free].mean(axis=0) if len(free) else np.zeros(6)
    zero_text = tr("mean before contact, readings: {count}", count=len(free)) if len(free) else tr("as recorded")
    wrench = in_face_frame(calibration.wrench(block.raw, zero), recording.plan.frame)
    tangential = np.hypot(wrench[:, 0], wrench[:, 1])
    return RawReadings(location, calibration.raw_unit, block, -wrench[:, 2], tangential, zero_text)


class History(Struct, frozen=True):
    """Descriptions of the next undo and redo; "" if there is none."""

    undo: str = ""
    redo: str = ""


@dataclass(frozen=True, slots=True)
class EdgePosition:
    """One edge of a stroke and its time."""

    edge: Edge
    time: float  # [s, device time]
    present: bool  # False if this is only a possible position
    decision: str  # who decided it and why; "" if it comes from the analysis


def edges_of(stroke: StrokeFinding) -> tuple[EdgePosition, ...]:
    """Return the edges in order of time; without a steady window, with possible edges of one."""
    trace = stroke.trace
    if stroke.onset is None and trace is None:
        return ()
    begin = stroke.onset if stroke.onset is not None else 0.0 if trace is None else trace.origin
    end = stroke.lift if stroke.lift is not None else begin + (0.0 if trace is None else float(trace.time[-1]))
    steady = stroke.steady or (begin + 0.35 * (end - begin), begin + 0.75 * (end - begin))
    times = dict(zip(EDGES, (begin, *steady, end), strict=True))
    return tuple(
        EdgePosition(edge, times[edge], getattr(stroke, target) is not None, stroke.decided.get(target, ""))
        for edge, target in EDGE_DECISIONS.items()
    )


def clamp_edge(stroke: StrokeFinding, edge: Edge, time: float) -> float:
    """Return the allowed time nearest to `time` [s] for an edge: between its neighbours."""
    times = {position.edge: position.time for position in edges_of(stroke)}
    index = EDGES.index(edge)
    low = times[EDGES[index - 1]] + EDGE_DISTANCE if index > 0 else float("-inf")
    high = times[EDGES[index + 1]] - EDGE_DISTANCE if index + 1 < len(EDGES) else float("inf")
    return min(max(time, low), high)


def decision_of(stroke: StrokeFinding, edge: Edge, time: float, author: str, reason: str) -> Decision:
    """Return the decision that moves an edge."""
    target, new_time = EDGE_DECISIONS[edge], clamp_edge(stroke, edge, time)
    times = {position.edge: position.time for position in edges_of(stroke)} | {edge: new_time}
    value = (times["steady begin"], times["steady end"]) if target == "steady" else new_time
    return Decision(author, reason, target, stroke.trial, stroke.within, getattr(stroke, target), value)


def reversal(decisions: Decisions, author: str, *, redo: bool) -> Decision | None:
    """Return the line that undoes the last decision in force, or with `redo` the last undo; None if there is none."""
    lines = _undone(decisions) if redo else [line for line in decisions.standing if line.undoes is None]
    reason = "redone in the window" if redo else "undone in the window"
    return Decision(author, reason, undoes=lines[-1].number) if lines else None


def history(decisions: Decisions) -> History:
    """Return the descriptions of the next undo and redo."""
    lines = (reversal(decisions, "", redo=redo) for redo in (False, True))
    effects = (None if line is None else effective_decision(decisions, line) for line in lines)
    return History(*("" if effect is None else f"{effect.what} of {effect.target_text}" for effect in effects))


def _undone(decisions: Decisions) -> list[Decision]:
    """Return the lines that undo a decision and are newer than the last decision."""
    numbers = {line.number for line in decisions.lines if line.undoes is None}
    return [line for line in decisions.standing if line.undoes in numbers and line.number > max(numbers)]


def effective_decision(decisions: Decisions, line: Decision) -> Decision:
    """Return the decision that a line undoes or redoes, through any chain of undo and redo."""
    by_number = {decision.number: decision for decision in decisions.lines}
    while line.undoes is not None:
        line = by_number[line.undoes]
    return line
