"""The course of a recorded session, step by step: what its log says happened, when, and after how many readings."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from sessions.recording import LoggedEvent
from sessions.steps import (
    Abort,
    Begin,
    Event,
    Finish,
    Pause,
    Redo,
    Resume,
    Scored,
    Skip,
    StimulusMounted,
    StrokeDone,
)

# What experimenter and subject do. All else that happens comes of the readings, and is found in them once more.
ACTS: dict[str, type[Event]] = {
    "begin": Begin,
    "stimulus_mounted": StimulusMounted,
    "stroke_done": StrokeDone,
    "scored": Scored,
    "redo": Redo,
    "skip": Skip,
    "pause": Pause,
    "resume": Resume,
    "abort": Abort,
    "finish": Finish,
}
NOTICED = frozenset({"zeroed", "contact_onset", "finger_lifted"})  # in the readings, by the runner


@dataclass(frozen=True, slots=True)
class Step:
    """One look of the runner at transducer and operator at which something happened."""

    readings: int  # handed over by then, from the beginning
    instant_ns: int  # session clock [ns]
    act: Event | None = None  # what somebody did then
    losses: LoggedEvent | None = None  # what was reported of lost and distrusted readings
    told: bool = False  # somebody was told that the zero cannot be measured
    end: Mapping[str, Any] | None = None  # how the session ended; empty for one that was cut short


def steps(events: Sequence[LoggedEvent]) -> tuple[Step, ...]:
    """Return the steps of a session from its log; the last is its end, or where it was cut short."""
    found: list[Step] = []
    for i, event in enumerate(events):
        place = event.readings, event.time_ns
        kind = event.data.get("event") if event.kind == "refused" else event.kind
        if event.kind == "ended":
            found.append(Step(*place, end=event.data))
        elif kind in ACTS:
            found.append(Step(*place, act=_act(str(kind), event)))
        elif kind in NOTICED:
            found.append(Step(*place))
        elif event.kind == "losses" and not _at_the_end(events, i):
            found.append(Step(*place, losses=event))
        elif event.kind == "told" and event.trial is not None:  # the machine's own words belong to no trial
            found.append(Step(*place, told=True))
    if not found or found[-1].end is None:
        last = events[-1] if events else LoggedEvent(0, 0, "", None, 0, {})
        found.append(Step(last.readings, last.time_ns, end={}))
    return tuple(found)


def _act(kind: str, event: LoggedEvent) -> Event:
    """Return what was done; of what was refused the log keeps the sentence, which names what matters."""
    if event.kind != "refused":
        return msgspec.convert(dict(event.data), ACTS[kind])
    sentence = str(event.data.get("sentence", ""))
    if kind == "scored":
        outside = re.search(r"; (\S+) does not$", sentence)
        return Scored(float(outside[1]) if outside else None)
    if kind == "stimulus_mounted":
        wrong = re.search(r", not (.*)$", sentence)
        return StimulusMounted(wrong[1] if wrong else "")
    if kind in {"redo", "skip", "abort"}:
        reason = "" if sentence.startswith("say why") else "not recorded"
        return msgspec.convert({"reason": reason}, ACTS[kind])
    return msgspec.convert({}, ACTS[kind])


def _at_the_end(events: Sequence[LoggedEvent], position: int) -> bool:
    """Say whether losses were reported while the session was being ended: then the end reports them once more."""
    after = events[position + 1 : position + 2]
    return bool(after) and after[0].kind == "ended" and events[position].trial is None
