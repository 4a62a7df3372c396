"""The event log of a session: the data of each kind of event, and the record of each trial."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

from drivers.transducer import COUNTS, Health
from sessions.file_access import as_type, json_object
from sessions.plan.plan import Answer, Choice, SessionPlan, Trial

Outcome = Literal["scored", "numbered", "chosen", "presented", "not answered", "skipped", "open"]
OUTCOMES = "scored, numbered, chosen, presented (no answer asked for), not answered, skipped or open"


@dataclass(frozen=True, slots=True)
class LoggedEvent:
    """One event of a session, as it was logged."""

    number: int  # from 1, without gaps
    time_ns: int  # session clock [ns]
    kind: str  # one of the kinds of docs/session-format/events.md
    trial: int | None  # number of the trial it belongs to
    readings: int  # how many readings had been handed to the recording before it
    data: Mapping[str, Any]  # further data by name; plain JSON values


@dataclass(frozen=True, slots=True)
class Take:
    """One attempt at a trial: the readings received from `start_ns` up to, not including, `stop_ns`."""

    number: int  # from 1 within its trial
    start_ns: int  # session clock [ns]
    stop_ns: int | None  # None when the recording ended in the middle of it
    strokes: int  # contacts the live detector saw, or strokes the experimenter reported, in it
    discard_reason: str | None  # why it does not count; None for the take that counts or is still open


@dataclass(frozen=True, slots=True)
class TrialRecord:
    """The outcome of one planned trial."""

    trial: Trial
    outcome: Outcome  # "presented": no answer was asked for; "open": the session ended before the trial was done
    take: Take | None  # the take that counts
    other_takes: tuple[Take, ...]  # discarded ones, and one cut off by the recording's end; their readings are kept too
    score: float | None  # the subject's answer on the line, 0 to 100; None unless outcome is "scored"
    number: float | None = None  # on a scale of the subject's own; None unless outcome is "numbered"
    choice: Choice | None = None  # of the two compared; None unless outcome is "chosen"

    @property
    def answer(self) -> float | Choice | None:
        """Return the subject's answer: a score, a number or which of two; None without an answer."""
        return next((value for value in (self.score, self.number, self.choice) if value is not None), None)

    @property
    def start_ns(self) -> int | None:
        """Return when the take that counts began [ns, session clock]."""
        return self.take.start_ns if self.take else None

    @property
    def stop_ns(self) -> int | None:
        """Return when the take that counts ended [ns, session clock]."""
        return self.take.stop_ns if self.take else None


def trial_records(plan: SessionPlan, events: Sequence[LoggedEvent]) -> tuple[TrialRecord, ...]:
    """Return the record of every planned trial, in the plan's order."""
    return tuple(_record(trial, [event for event in events if event.trial == trial.number]) for trial in plan.trials)


def _record(trial: Trial, events: Sequence[LoggedEvent]) -> TrialRecord:
    """Follow the events of one trial; a later outcome replaces an earlier one."""
    takes: dict[int, Take] = {}
    answers: dict[int, Any] = {}  # by take
    outcome: Outcome = "open"
    in_hand: int = 0  # number of a take
    valid_take: int | None = None
    for event in events:
        number = event.data.get("take")
        match event.kind:
            case "take_started":
                in_hand = event.data["take"]
                takes[in_hand] = Take(in_hand, event.time_ns, None, 0, None)
                outcome, valid_take = "open", None
            case "contact_onset" | "stroke_done" if takes:
                takes[in_hand] = replace(takes[in_hand], strokes=takes[in_hand].strokes + 1)
            case "scored" | "number_given" | "chosen" if event.kind == _ANSWER_KINDS.get(trial.answer):
                answers[in_hand] = event.data[ANSWERS[event.kind]]
            case "take_kept" if number in takes:
                takes[number] = _end_take(takes[number], event, None)
                outcome, valid_take = _outcome(trial, answers.get(number)), number
            case "take_discarded" if number in takes:
                takes[number] = _end_take(takes[number], event, event.data["reason"])
                outcome, valid_take = ("skipped" if outcome == "skipped" else "open"), None
            case "take_restored" if number in takes:
                in_hand = number
                takes[number] = replace(takes[number], discard_reason=None)
            case "skip" | "left_out":
                outcome = "skipped"
    counts = takes[valid_take] if valid_take is not None else None
    other_takes = tuple(take for take in takes.values() if take is not counts)
    answer = answers.get(in_hand)
    return TrialRecord(
        trial,
        outcome,
        counts,
        other_takes,
        score=answer if outcome == "scored" else None,
        number=answer if outcome == "numbered" else None,
        choice=answer if outcome == "chosen" else None,
    )


ANSWERS = {"scored": "score", "number_given": "number", "chosen": "choice"}
_ANSWER_KINDS: Mapping[Answer, str] = {"line": "scored", "number": "number_given", "choice": "chosen"}
_OUTCOMES: Mapping[Answer, Outcome] = {"line": "scored", "number": "numbered", "choice": "chosen", "none": "presented"}


def _end_take(take: Take, event: LoggedEvent, reason: str | None) -> Take:
    """Return a take with its end; a take that has an end already keeps it."""
    return replace(take, stop_ns=event.time_ns if take.stop_ns is None else take.stop_ns, discard_reason=reason)


def _outcome(trial: Trial, answer: Any) -> Outcome:  # noqa: ANN401  a score, a number or a choice
    if answer is not None:
        return _OUTCOMES[trial.answer]
    return "presented" if trial.answer == "none" else "not answered"


Int64: TypeAlias = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]  # the range of SQLite, HDF5 and NumPy
Count: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
SixNumbers: TypeAlias = tuple[float, float, float, float, float, float]

_TAKE: list[Any] = [("take", Count)]
_FIELDS: Mapping[str, list[Any]] = {  # name and type of each required field; a default where it is optional
    "take_started": _TAKE,
    "take_kept": _TAKE,
    "take_restored": _TAKE,
    "take_discarded": [*_TAKE, ("reason", str)],
    "scored": [("score", float | None), ("positions", list[tuple[float, float]] | None, None)],
    "number_given": [("number", float | None)],
    "chosen": [("choice", Choice | None)],
    "zeroed": [("mean", SixNumbers)],
    "losses": [*((name, Count, 0) for name in COUNTS), ("rate_words", str, "")],
    "log_torn": [("sentence", str)],
    "not_restored": [("sentence", str)],
    "ended": [
        *(("reason", str, ""), ("cause", str, ""), ("complete", bool, False), ("readings", Count, 0)),
        ("health", dict[str, Any] | None, None),
    ],
    "resumed": [("last_ns", Int64), ("gap", float | None, None)],
}
SHAPES = {kind: msgspec.defstruct("Event", fields) for kind, fields in _FIELDS.items()}


def event_data(kind: str, text: str) -> dict[str, Any]:
    """Return the data of an event from its JSON text. Raises ValueError where it does not fit the kind."""
    data = json_object(text)
    as_type(data, SHAPES.get(kind, dict[str, Any]))
    return data


def health_of(log: Iterable[LoggedEvent]) -> Health:
    """Return the totals of "losses" events."""
    events = list(log)
    counts = {name: sum(int(event.data.get(name, 0)) for event in events) for name in COUNTS}
    rate_texts = [str(event.data["rate_words"]) for event in events if "rate_words" in event.data]
    by_flag: Counter[str] = Counter()
    for event in events:
        by_flag.update(event.data.get("flagged", {}))
    return Health(**counts, rate_words=rate_texts[-1] if rate_texts else "", flagged=dict(by_flag))
