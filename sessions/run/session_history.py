"""The course of a recorded session, step by step: what its log says happened, when, and after how many readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sessions.recording import LoggedEvent
from sessions.run.event_log import event_from_data
from sessions.run.steps import Event

# What experimenter and subject do. All else that happens comes of readings and clock, and is found in them once more.
ACTS = frozenset(
    {
        "begin",
        "stimulus_mounted",
        "stroke_done",
        "scored",
        "number_given",
        "chosen",
        "note",
        "redo",
        "undo_redo",
        "skip",
        "pause",
        "resume",
        "abort",
        "finish",
    }
)
NOTICED = frozenset({"zeroed", "contact_onset", "finger_lifted", "settled", "rest_over"})  # by the runner


@dataclass(frozen=True, slots=True)
class Step:
    """One look of the runner at transducer and operator at which something happened."""

    readings: int  # handed over by then, from the beginning
    instant_ns: int  # session clock [ns]
    act: Event | None = None  # what somebody did then
    losses: LoggedEvent | None = None  # what was reported of lost and distrusted readings
    zero_missing: bool = False  # somebody was told that the zero cannot be measured
    end: Mapping[str, Any] | None = None  # how the session ended; empty for one that was cut short


def parts(events: Sequence[LoggedEvent]) -> tuple[tuple[LoggedEvent, ...], ...]:
    """Return the log of a session in parts: a new one begins wherever it was resumed, with what was owed then."""
    begins = [0]
    for i, event in enumerate(events):
        if event.kind == "resumed":
            last_ns = int(event.data["last_ns"])
            begins.append(next(j for j in range(i + 1) if events[j].time_ns > last_ns))
    return tuple(tuple(events[a:b]) for a, b in zip(begins, [*begins[1:], len(events)], strict=True))


def steps(events: Sequence[LoggedEvent]) -> tuple[Step, ...]:
    """Return the steps of a session from its log; the last is its end, or where it was cut short."""
    history: list[Step] = []
    for i, event in enumerate(events):
        place = event.readings, event.time_ns
        refused = event.kind == "refused"
        kind = event.data.get("event") if refused else event.kind
        if event.kind == "ended":
            history.append(Step(*place, end=event.data))
        elif kind is not None and kind in ACTS:
            history.append(Step(*place, act=event_from_data(kind, event.data["given"] if refused else event.data)))
        elif kind in NOTICED:
            history.append(Step(*place))
        elif event.kind == "losses" and not _at_the_end(events, i):
            history.append(Step(*place, losses=event))
        elif event.kind == "told" and event.trial is not None:  # the machine's own words belong to no trial
            history.append(Step(*place, zero_missing=True))
    if not history or history[-1].end is None:
        last = events[-1] if events else LoggedEvent(0, 0, "", None, 0, {})
        history.append(Step(last.readings, last.time_ns, end={}))
    return tuple(history)


def _at_the_end(events: Sequence[LoggedEvent], position: int) -> bool:
    """Say whether losses were reported while the session was being ended: then the end reports them once more."""
    after = events[position + 1 : position + 2]
    return bool(after) and after[0].kind == "ended" and events[position].trial is None
