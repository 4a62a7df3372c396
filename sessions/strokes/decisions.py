"""Decisions of people about a session's strokes, in an append-only file in the session's folder.

Readings never change. A decision sets one value of a stroke, a trial or the session, and states its author, date,
reason and the value before. Another line can undo it. The decisions in force follow from all lines.
"""

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, cast

import msgspec
from msgspec import Meta

from sessions.file_access import as_type, json_object, name_failure, one_at_a_time
from sessions.recording import Recording
from sessions.recording.derived import bytes_of
from sessions.recording.head import compact_json
from sessions.recording.schema import RecordingError, text_crc

MOST_TILT = 20.0  # a larger tilt is a wrongly mounted face [degrees]
DECISIONS = "decisions.jsonl"  # in a session's folder

Span = tuple[float, float]
Value = float | int | bool | Span | None

_Instant = Annotated[float, Meta(gt=-1e9, lt=1e9)]
_Angle = Annotated[float, Meta(ge=-MOST_TILT, le=MOST_TILT)]
_Count = Annotated[int, Meta(ge=1)]
_Stretch = tuple[_Instant, _Instant]


class Kind(NamedTuple):
    """The kind of value that a decision sets."""

    form: Any  # the type that msgspec checks
    sentence: str  # the same, for people
    unit: str = ""


# Values that can be decided. Times are on the device's clock.
OF_STROKE: Mapping[str, Kind] = {
    "onset": Kind(_Instant, "an instant [s]", "s"),
    "lift": Kind(_Instant, "an instant [s]", "s"),
    "steady": Kind(_Stretch, "two instants [s], the earlier first: where the mean of T/N and the speed are taken", "s"),
    "stick": Kind(
        _Stretch,
        "two instants [s], the earlier first: the stick phase, whose greatest T/N is mu_static and whose end the "
        "break-away",
        "s",
    ),
    "slide_onset": Kind(
        _Instant, "an instant [s]: from which the contact slides; a static peak is looked for up to then", "s"
    ),
    "direction": Kind(Literal[1, -1], "1 (proximal to distal) or -1 (distal to proximal)"),
    "kept": Kind(bool, "true, or false where the stroke is left out"),
}
OF_TRIAL: Mapping[str, Kind] = {"choice": Kind(_Count, "the number of the stroke that the model gets, from 1")}
OF_SESSION: Mapping[str, Kind] = {
    "tilt": Kind(
        tuple[_Angle, _Angle],
        f"two angles of at most {MOST_TILT:g}°: how far the face's normal leans to +x and to +y, which is levelled",
        "degrees",
    )
}


class DecisionError(ValueError):
    """A decision that is not possible; the message says what is allowed."""


@dataclass(frozen=True, slots=True)
class Decision:
    """One line. Either it sets `what` of a stroke to `new`, or it undoes the line `undoes`."""

    by: str  # a code, never a name
    why: str
    what: str = ""  # a name of OF_STROKE, OF_TRIAL or OF_SESSION; "" where a line is undone
    trial: int | None = None  # None: of a recording without trials, or of the session
    stroke: int | None = None  # its number within the trial, from 1; None: of the trial, or of the session
    old: Value = None  # value before
    new: Value = None
    undoes: int | None = None  # number of a line
    number: int = 0  # from 1; 0 until it is recorded
    made_utc: str = ""

    @property
    def target(self) -> tuple[int | None, int | None, str]:
        """The value that it sets; the latest decision about one value acts."""
        return self.trial, self.stroke, self.what

    @property
    def target_text(self) -> str:
        """The stroke or trial, for people.

        >>> Decision("E02", "", "kept", trial=3, stroke=1).target_text
        'stroke 1 of trial 3'
        """
        trial = "the recording" if self.trial is None else f"trial {self.trial}"
        return trial if self.stroke is None else f"stroke {self.stroke} of {trial}"

    @property
    def sentence(self) -> str:
        """The decision, for people.

        >>> Decision("E02", "a ramp", "steady", 3, 1, (1.0, 2.0), (1.2, 2.0), number=4).sentence
        'decision 4 by E02: steady of stroke 1 of trial 3 is 1.200 to 2.000 s (it was 1.000 to 2.000 s): a ramp'
        """
        opening = f"decision {self.number} by {self.by}: "
        if self.undoes is not None:
            return f"{opening}decision {self.undoes} is undone: {self.why}"
        if self.what == "kept":
            return f"{opening}{self.target_text} is {'kept' if self.new else 'left out'}: {self.why}"
        unit = {**OF_STROKE, **OF_TRIAL, **OF_SESSION}[self.what].unit
        values = f"is {_value_text(self.new, unit)} (it was {_value_text(self.old, unit)})"
        return f"{opening}{self.what} of {self.target_text} {values}: {self.why}"

    @property
    def leaves_out(self) -> bool:
        """Whether it leaves a stroke out of the results."""
        return self.what == "kept" and not self.new and self.undoes is None

    def to_dict(self) -> dict[str, Any]:
        """Return the decision as plain data, as in its line."""
        document = asdict(self)
        record = {name: document.pop(name) for name in ("number", "made_utc", "by", "why")}
        undoes = document.pop("undoes")
        return {**record, "undoes": undoes} if undoes is not None else {**record, **document}


def _value_text(value: Value, unit: str) -> str:
    """Return a value for people: a stretch of time from its begin to its end, else one number or two."""
    if value is None:
        return "not known"
    numbers = value if isinstance(value, tuple) else (value,)
    form, between = (".3f", " to ") if unit == "s" else (".6g", " and ")
    return f"{between.join(format(number, form) for number in numbers)} {unit}".rstrip()


@dataclass(frozen=True, slots=True)
class StrokeDecisions:
    """Decisions in force about one stroke."""

    by_name: Mapping[str, Decision]  # by name of the value

    def value(self, name: str) -> Any:  # noqa: ANN401 - of the kind in `OF_STROKE` names
        """Return the decided value, None without a decision."""
        return self.by_name[name].new if name in self.by_name else None

    def instant(self, name: str) -> float | None:
        """Return an instant [s] that was decided."""
        return float(self.value(name)) if name in self.by_name else None


@dataclass(frozen=True, slots=True)
class Decisions:
    """All lines of a session's file, in order, and problems of the file."""

    lines: tuple[Decision, ...] = ()
    problems: tuple[str, ...] = ()

    @property
    def in_force(self) -> tuple[Decision, ...]:
        """Return the decisions in force, by number: neither undone (undoing can be undone too) nor replaced since."""
        latest = {decision.target: decision for decision in self.standing if decision.undoes is None}
        return tuple(sorted(latest.values(), key=lambda decision: decision.number))

    @property
    def standing(self) -> tuple[Decision, ...]:
        """Return the lines that are not undone, in order."""
        undone: set[int] = set()
        standing: list[Decision] = []
        for decision in reversed(self.lines):  # a line that undoes another comes after it
            if decision.number not in undone:
                standing.append(decision)
                if decision.undoes is not None:
                    undone.add(decision.undoes)
        return tuple(reversed(standing))

    def of_stroke(self, trial: int | None, stroke: int) -> StrokeDecisions:
        """Return the decisions in force about a stroke, numbered within the trial from 1."""
        about = (decision for decision in self.in_force if (decision.trial, decision.stroke) == (trial, stroke))
        return StrokeDecisions({decision.what: decision for decision in about})

    def choice(self, trial: int | None) -> Decision | None:
        """Return the decision which stroke of a trial the model uses, None without one."""
        choices = (decision for decision in self.in_force if decision.what == "choice")
        return next((decision for decision in choices if decision.trial == trial), None)

    @property
    def tilt(self) -> Span | None:
        """Return the decided tilt of the face towards +x and +y [degrees], None without one."""
        return next((cast("Span", decision.new) for decision in self.in_force if decision.what == "tilt"), None)

    def with_line(self, decision: Decision) -> "Decisions":
        """Return the decisions with one more, not recorded, for a preview. Raises DecisionError."""
        _check(decision, self)
        last = max((line.number for line in self.lines), default=0)
        return replace(self, lines=(*self.lines, replace(decision, number=last + 1)))


def read(folder: Path) -> Decisions:
    """Return the decisions stored in a session's folder, none without a file.

    A torn or damaged line is left out and reported. Raises RecordingError where the file cannot be read.
    """
    return parse(bytes_of(folder / DECISIONS))


def parse(content: bytes) -> Decisions:
    """Return the decisions in the bytes of a file."""
    lines: list[Decision] = []
    problems: list[str] = []
    *complete, tail = content.split(b"\n")
    for number, line in enumerate(complete, 1):
        decision = _decision(line)
        if isinstance(decision, str):
            problems.append(f"line {number} of {DECISIONS} is left out: {decision}")
        elif decision is not None and lines and decision.number <= lines[-1].number:
            problems.append(f"line {number} of {DECISIONS} is left out: its number, {decision.number}, comes before it")
        elif decision is not None:
            lines.append(decision)
    if tail:
        problems.append(f"the last line of {DECISIONS} is torn and left out: it was never acknowledged, or was cut off")
    gaps = sorted({*range(1, max((line.number for line in lines), default=0))} - {line.number for line in lines})
    if gaps and not problems:
        problems.append(f"{DECISIONS} lacks decision {', '.join(map(str, gaps))}: lines were removed")
    return Decisions(tuple(lines), tuple(problems))


def append(recording: Recording, decision: Decision) -> Decision:
    """Record a decision or an undoing; return it with number and date once it is safe on the disk.

    Raises DecisionError for one that is not possible, RecordingError where writing fails.
    """
    path = recording.folder / DECISIONS
    with name_failure(RecordingError, f"{path} cannot be written"), one_at_a_time(recording.folder):
        content = bytes_of(path)
        torn = bool(content) and not content.endswith(b"\n")
        number = max(parse(content).with_line(decision).lines[-1].number, content.count(b"\n") + torn + 1)
        entry = replace(decision, number=number, made_utc=datetime.now(UTC).isoformat(timespec="seconds"))
        # A line is compact JSON; its last entry, crc32, is the sum of the JSON text without that entry.
        text = compact_json({**recording.mark, **entry.to_dict()})
        newline = "\n" if torn else ""  # a torn line stays as a separate line
        with path.open("ab") as file:
            file.write(f'{newline}{text[:-1]},"crc32":{text_crc(text)}}}\n'.encode())
            file.flush()
            os.fsync(file.fileno())
    return entry


def _decision(line: bytes) -> Decision | str | None:
    """Return the decision in a line, or a sentence on its fault; None for an empty line."""
    if not line.strip():
        return None
    try:
        document = json_object(line)
        crc = document.pop("crc32")
        if text_crc(compact_json(document)) != crc:
            return "its CRC-32 is not that of its text, which was changed or damaged"
        document.pop("SIMULATED", None)
        decision = as_type(document, Decision)
    except (ValueError, KeyError):
        return "it holds no decision"
    return decision if document.keys() <= asdict(decision).keys() else "it holds no decision"


def _check(decision: Decision, decisions: Decisions) -> None:
    """Raise DecisionError unless a decision is possible after the earlier ones."""
    if not decision.by.strip() or not decision.why.strip():
        raise DecisionError("a decision says who decides and why: give both")
    if decision.undoes is not None:
        if decision.undoes not in {line.number for line in decisions.standing}:
            raise DecisionError(f"decision {decision.undoes} is not in force: there is nothing to undo")
        return
    target = decision.target_text
    kinds = OF_STROKE if decision.stroke is not None else OF_SESSION if decision.trial is None else OF_TRIAL
    if decision.what not in kinds:
        raise DecisionError(f"{decision.what!r} of {target} cannot be decided: give one of {', '.join(kinds)}")
    value_kind = kinds[decision.what]
    if not _fits(decision.new, value_kind.form):
        raise DecisionError(f"{decision.what} of {target} cannot be {decision.new!r}: {value_kind.sentence}")


def _fits(value: Value, form: object) -> bool:
    """Say whether a value has the right type; of two instants the first must be earlier."""
    try:
        msgspec.convert(value, form)
    except msgspec.ValidationError:
        return False
    return form != _Stretch or (isinstance(value, tuple) and value[0] < value[1])
