"""How events and commands of a session are written into its log. `docs/session-format.md` lists the kinds."""

import re
from typing import Any, get_args

import msgspec

from sessions.recording.log import LoggedEvent
from sessions.steps import (
    AskMount,
    AskScore,
    AskStroke,
    Command,
    DiscardTake,
    Event,
    KeepTake,
    ShowInstruction,
    StartTake,
    Tell,
)

Line = tuple[str, int | None, dict[str, Any]]  # kind, number of the trial, data


def kind_of(event: Event) -> str:
    """Return the kind an event is logged as: its name in small letters.

    >>> from sessions.steps import ContactOnset
    >>> kind_of(ContactOnset())
    'contact_onset'
    """
    return _kind(type(event))


def event_of(logged: LoggedEvent) -> Event | None:
    """Return the event that was logged; None for a line that tells of a command, or of the recording itself.

    Raises ValueError where the line does not hold what such an event has.
    """
    cls = _EVENTS.get(logged.kind)
    return None if cls is None else msgspec.convert(dict(logged.data), cls)


def line_of(command: Command) -> Line | None:
    """Return how a command is logged; None for one that leaves no trace of its own."""
    match command:
        case StartTake(trial, take):
            return "take_started", trial, {"take": take}
        case KeepTake(trial, take):
            return "take_kept", trial, {"take": take}
        case DiscardTake(trial, take, reason):
            return "take_discarded", trial, {"take": take, "reason": reason}
        case ShowInstruction(block):
            return "instruction_shown", None, {"block": block.name}
        case AskMount(trial):
            return "mount_asked", trial.number, {"code": trial.stimulus.code}
        case AskStroke(trial):
            return "stroke_asked", trial.number, {}
        case AskScore(trial):
            return "score_asked", trial.number, {}
        case Tell(sentence):
            return "told", None, {"sentence": sentence}
        case _:
            return None


def _kind(cls: type[Event]) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()


_EVENTS: dict[str, type[Event]] = {_kind(cls): cls for cls in get_args(Event)}
