"""How events and commands of a session are written into its log. `docs/session-format/events.md` lists the kinds."""

import math
import re
from collections.abc import Mapping
from typing import Any, cast, get_args

import msgspec

from sessions.recording.log import LoggedEvent
from sessions.run import steps

Line = tuple[str, int | None, dict[str, Any]]  # kind, number of the trial, data


def kind_of(event: steps.Event) -> str:
    """Return the kind an event is logged as: its name in small letters, or the one that the file format has for it.

    >>> from sessions.run.steps import ContactOnset
    >>> kind_of(ContactOnset())
    'contact_onset'
    """
    return _kind(type(event))


def data_of(event: steps.Event) -> dict[str, Any]:
    """Return what an event holds as JSON can: numbers that are none become texts such as "nan"."""
    return cast("dict[str, Any]", _plain(msgspec.structs.asdict(event)))


def event_of(logged: LoggedEvent) -> steps.Event | None:
    """Return the event that was logged; None for a line that tells of a command, or of the recording itself.

    Raises ValueError where the line does not hold what such an event has.
    """
    return None if logged.kind not in _EVENTS else event_from_data(logged.kind, logged.data)


def event_from_data(kind: str, data: Mapping[str, Any]) -> steps.Event:
    """Return the event of a kind that `data_of` gave `data` for. Raises ValueError where it is none."""
    if kind not in _EVENTS:
        raise ValueError(f"{kind} is no event of a session's course")
    return msgspec.convert(dict(data), _EVENTS[kind], strict=False)


def line_of(command: steps.Command) -> Line | None:
    """Return how a command is logged; None for one that leaves no trace of its own."""
    match command:
        case steps.StartTake(trial, take):
            return "take_started", trial, {"take": take}
        case steps.KeepTake(trial, take):
            return "take_kept", trial, {"take": take}
        case steps.DiscardTake(trial, take, reason):
            return "take_discarded", trial, {"take": take, "reason": reason}
        case steps.RestoreTake(trial, take):
            return "take_restored", trial, {"take": take}
        case steps.LeaveOut(trial, reason):
            return "left_out", trial, {"reason": reason}
        case steps.Tell(sentence):
            return "told", None, {"sentence": sentence}
        case _:
            return _question_line(command)


def _question_line(command: steps.Command) -> Line | None:
    """Return how it is logged that something was asked for."""
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


def _plain(value: Any) -> Any:  # noqa: ANN401  whatever an event holds
    """Return plain data with every nan and infinity written as a text."""
    if isinstance(value, dict):
        return {name: _plain(inside) for name, inside in cast("dict[str, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [_plain(inside) for inside in cast("list[Any]", value)]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _kind(cls: type[steps.Event]) -> str:
    return _RECORDED_AS.get(cls) or re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()


_RECORDED_AS: dict[type[steps.Event], str] = {steps.MagnitudeEstimate: "number_given", steps.PairedChoice: "chosen"}
_EVENTS: dict[str, type[steps.Event]] = {_kind(cls): cls for cls in get_args(steps.Event)}
