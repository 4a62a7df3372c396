"""A session's events and commands as lines of its log, and the log read back as steps.

`docs/session-format/events.md` lists the kinds.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast, get_args

import msgspec

from sessions.recording.log import LoggedEvent
from sessions.run import steps
from sessions.run.steps import Event

Line = tuple[str, int | None, dict[str, Any]]  # kind, number of the trial, data


def kind_of(event: type[steps.Event]) -> str:
    """Return the kind an event is logged as: its name in small letters, or the name that the file format has for it.

    >>> kind_of(steps.ContactOnset)
    'contact_onset'
    """
    return _RECORDED_AS.get(event) or re.sub(r"(?<!^)(?=[A-Z])", "_", event.__name__).lower()


def data_of(event: steps.Event) -> dict[str, Any]:
    """Return an event's data for JSON: nan and infinities become texts such as "nan"."""
    return cast("dict[str, Any]", _plain(msgspec.structs.asdict(event)))


def event_of(entry: LoggedEvent) -> steps.Event | None:
    """Return the event that was logged; None for a line about a command, or about the recording itself.

    Raises ValueError where the line's data do not fit the event.
    """
    return None if entry.kind not in _EVENTS else event_from_data(entry.kind, entry.data)


def event_from_data(kind: str, data: Mapping[str, Any]) -> steps.Event:
    """Return the event of a kind from `data` of `data_of`. Raises ValueError where they do not fit."""
    if kind not in _EVENTS:
        raise ValueError(f"{kind} is no event of a session's course")
    return msgspec.convert(dict(data), _EVENTS[kind], strict=False)


def line_of(command: steps.Command) -> Line | None:
    """Return the log line of a command; None for a command that is not logged."""
    if (kind := _COMMANDS.get(type(command))) is not None:
        data = msgspec.structs.asdict(command)
        return kind, data.pop("trial", None), data
    match command:
        case steps.ShowInstruction(block):
            return "instruction_shown", None, {"block": block.name}
        case steps.AskMount(trial):
            return "mount_asked", trial.number, {"code": trial.stimulus.code}
        case steps.AskStroke(trial):
            return "stroke_asked", trial.number, {}
        case steps.AskScore(trial) | steps.AskNumber(trial):
            return ("score_asked" if isinstance(command, steps.AskScore) else "number_asked"), trial.number, {}
        case steps.AskChoice(first, second):
            return "choice_asked", second.number, {"first": first.number}
        case steps.AskRest(duration):
            return "rest_asked", None, {"duration": duration}
        case _:
            return None


def _plain(value: Any) -> Any:  # noqa: ANN401  any data of an event
    """Return plain data with every nan and infinity written as a text."""
    if isinstance(value, dict):
        return {name: _plain(content) for name, content in cast("dict[str, Any]", value).items()}
    if isinstance(value, (list, tuple)):
        return [_plain(content) for content in cast("list[Any]", value)]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


_COMMANDS: dict[type[steps.Command], str] = {  # whose line holds all fields of the command
    steps.StartTake: "take_started",
    steps.KeepTake: "take_kept",
    steps.DiscardTake: "take_discarded",
    steps.RestoreTake: "take_restored",
    steps.LeaveOut: "left_out",
    steps.Tell: "told",
}
_RECORDED_AS: dict[type[steps.Event], str] = {steps.MagnitudeEstimate: "number_given", steps.PairedChoice: "chosen"}
_EVENTS: dict[str, type[steps.Event]] = {kind_of(event): event for event in get_args(steps.Event)}


# The runner derives these from readings and clock, in a replay too. All other events are acts of people.
NOTICED = frozenset({"zeroed", "contact_onset", "finger_lifted", "settled", "rest_over"})
_ACTS = _EVENTS.keys() - NOTICED


@dataclass(frozen=True, slots=True)
class Step:
    """One cycle of the runner in which something happened."""

    readings: int  # handed over so far, from the beginning
    instant_ns: int  # session clock [ns]
    act: Event | None = None  # the act of a person
    losses: LoggedEvent | None = None  # what was reported of lost and distrusted readings
    zero_missing: bool = False  # a message has said that the zero cannot be measured
    end: Mapping[str, Any] | None = None  # how the session ended; empty for one that was cut short


def parts(events: Sequence[LoggedEvent]) -> tuple[tuple[LoggedEvent, ...], ...]:
    """Split the log of a session where it was resumed; a new part begins with the lines that were due then."""
    begins = [0]
    for i, event in enumerate(events):
        if event.kind == "resumed":
            last_ns = int(event.data["last_ns"])
            begins.append(next(n for n in range(i + 1) if events[n].time_ns > last_ns))
    return tuple(tuple(events[begin:end]) for begin, end in zip(begins, [*begins[1:], len(events)], strict=True))


def steps_of(events: Sequence[LoggedEvent]) -> tuple[Step, ...]:
    """Return the steps of a session from its log; the last is its end, or where it was cut short."""
    history: list[Step] = []
    for i, event in enumerate(events):
        point = event.readings, event.time_ns
        refused = event.kind == "refused"
        kind = event.data.get("event") if refused else event.kind
        if event.kind == "ended":
            history.append(Step(*point, end=event.data))
        elif kind is not None and kind in _ACTS:
            history.append(Step(*point, act=event_from_data(kind, event.data["given"] if refused else event.data)))
        elif kind in NOTICED:
            history.append(Step(*point))
        elif event.kind == "losses" and not _at_the_end(events, i):
            history.append(Step(*point, losses=event))
        elif event.kind == "told" and event.trial is not None:  # the machine's own messages have no trial
            history.append(Step(*point, zero_missing=True))
    if not history or history[-1].end is None:
        last_event = events[-1] if events else LoggedEvent(0, 0, "", None, 0, {})
        history.append(Step(last_event.readings, last_event.time_ns, end={}))
    return tuple(history)


def _at_the_end(events: Sequence[LoggedEvent], position: int) -> bool:
    """Say whether losses were reported as the session ended: a replay's end reports them itself."""
    following = events[position + 1 : position + 2]
    return bool(following) and following[0].kind == "ended" and events[position].trial is None
