"""The edges of a stroke's windows: where they are, how far each can be moved, and which decision a move is."""

from dataclasses import dataclass

from daq_app.analyst.messages import EDGES, Edge, History
from sessions.report.contents import StrokeFinding
from sessions.strokes.decisions import Decision, Decisions

APART = 0.02  # edges keep so far from each other [s]
STEP, LEAP = 0.005, 0.05  # a key moves an edge by so much [s]
WHAT: dict[Edge, str] = {"onset": "onset", "lift": "lift", "steady begin": "steady", "steady end": "steady"}


@dataclass(frozen=True, slots=True)
class Placed:
    """One edge."""

    edge: Edge
    time: float  # [s, device time]
    present: bool  # False where there is none yet and this is only where one could be
    decided: str  # who decided it and why; "" where the analysis found it


def edges_of(stroke: StrokeFinding) -> tuple[Placed, ...]:
    """Return the edges in order of time; of a stroke without a steady window where one could lie."""
    if stroke.onset is None and stroke.trace is None:
        return ()
    begin = stroke.onset if stroke.onset is not None else 0.0 if stroke.trace is None else stroke.trace.origin
    end = stroke.lift
    if end is None:
        end = begin if stroke.trace is None or not stroke.trace.time else begin + stroke.trace.time[-1]
    steady = stroke.steady or (begin + 0.35 * (end - begin), begin + 0.75 * (end - begin))
    times = dict(zip(EDGES, (begin, *steady, end), strict=True))
    there = {"onset": stroke.onset is not None, "lift": stroke.lift is not None, "steady": stroke.steady is not None}
    return tuple(Placed(e, times[e], there[WHAT[e]], stroke.decided.get(WHAT[e], "")) for e in EDGES)


def within(stroke: StrokeFinding, edge: Edge, time: float) -> float:
    """Return the instant nearest to `time` [s] at which an edge may lie: between its neighbours."""
    times = {placed.edge: placed.time for placed in edges_of(stroke)}
    at = EDGES.index(edge)
    low = times[EDGES[at - 1]] + APART if at > 0 else float("-inf")
    high = times[EDGES[at + 1]] - APART if at + 1 < len(EDGES) else float("inf")
    return min(max(time, low), high)


def decision_of(stroke: StrokeFinding, edge: Edge, time: float, by: str, why: str) -> Decision:
    """Return the decision that moves an edge."""
    what, new = WHAT[edge], within(stroke, edge, time)
    old: object = getattr(stroke, what)
    if what == "steady":
        times = {placed.edge: placed.time for placed in edges_of(stroke)} | {edge: new}
        span = (times["steady begin"], times["steady end"])
        return Decision(by, why, what, stroke.trial, stroke.within, stroke.steady, span)
    assert old is None or isinstance(old, float)
    return Decision(by, why, what, stroke.trial, stroke.within, old, new)


def taken_back(decisions: Decisions, by: str) -> Decision | None:
    """Return the line that undoes the last decision in force; None where there is none."""
    last = _last(_standing(decisions))
    return None if last is None else Decision(by, "undone in the window", undoes=last.number)


def brought_back(decisions: Decisions, by: str) -> Decision | None:
    """Return the line that redoes what was undone last; None where nothing was undone since the last decision."""
    last = _last(_undone(decisions))
    return None if last is None else Decision(by, "redone in the window", undoes=last.number)


def history(decisions: Decisions) -> History:
    """Return which decisions can be undone, and which redone."""
    undone = [decision_meant(decisions, line) for line in reversed(_undone(decisions))]
    return History(*(tuple(f"{one.what} of {one.of}" for one in lines) for lines in (_standing(decisions), undone)))


def _standing(decisions: Decisions) -> list[Decision]:
    return [line for line in decisions.standing if line.undoes is None]


def _undone(decisions: Decisions) -> list[Decision]:
    """Return the lines that undo a decision, and have come since the last one."""
    decided = {line.number for line in decisions.lines if line.undoes is None}
    return [line for line in decisions.standing if line.undoes in decided and line.number > max(decided)]


def _last(lines: list[Decision]) -> Decision | None:
    return lines[-1] if lines else None


def decision_meant(decisions: Decisions, line: Decision) -> Decision:
    """Return the decision that a line undoes or redoes, however often it was undone and redone before."""
    by_number = {one.number: one for one in decisions.lines}
    while line.undoes is not None:
        line = by_number[line.undoes]
    return line
