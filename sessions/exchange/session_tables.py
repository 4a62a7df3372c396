"""A session as tables: trials, answers, strokes, friction, predictions; every column with its unit and its meaning."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from sessions.exchange import ExportSource
from sessions.exchange.column_meanings import (
    ALTERNATIVE,
    ANSWER,
    DECISION,
    FLAW,
    FRICTION,
    POSITION,
    PREDICTION,
    RESPONSE,
    STROKE,
)
from sessions.exchange.given_and_made import given, made_with
from sessions.recording import LoggedEvent, Recording
from sessions.recording.head import json_text
from sessions.recording.log import ANSWERS, OUTCOMES
from sessions.strokes.bootstrap import NUMBERS

Cell = str | int | float | None

AXES = (("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Tx", "N mm"), ("Ty", "N mm"), ("Tz", "N mm"))
_SUFFIXES = {"mm/s": "mm_per_s", "N/mm": "N_per_mm", "N mm": "Nmm", "mm2": "mm2"}
_OTHERWISE_TOLD = ("solver", "alternatives", "interval", "opposite_interval")
_PAIRS = {
    "steady": ("start", "stop"),
    "mu_interval": ("low", "high"),
    "tau_max_interval": ("low", "high"),
    "sed_interval": ("low", "high"),
    "opposite_sed_interval": ("low", "high"),
    "normal_force_interval": ("low", "high"),
    "tangential_force_interval": ("low", "high"),
    "indentation_interval": ("low", "high"),
    "matching_depth_interval": ("low", "high"),
    "mu_dynamic_interval": ("low", "high"),
} | {f"{name}_bootstrap": ("low", "high") for name in NUMBERS}

EACH_EVENT = "a row for each thing that happened, in order"


@dataclass(frozen=True, slots=True)
class Column:
    """One column; None in it is a number that honesty does not allow, or a thing that is not there."""

    name: str
    unit: str  # "" for none
    meaning: str
    values: tuple[Cell, ...]

    @property
    def heading(self) -> str:
        """The name with the unit at its end.

        >>> Column("speed", "mm/s", "", ()).heading
        'speed_mm_per_s'
        """
        return f"{self.name}_{_SUFFIXES.get(self.unit, self.unit)}" if self.unit else self.name


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of one kind of thing."""

    name: str
    meaning: str
    columns: tuple[Column, ...]

    @property
    def rows(self) -> list[tuple[Cell, ...]]:
        """The table row by row."""
        return list(zip(*(column.values for column in self.columns), strict=True))


def tables(source: ExportSource) -> tuple[Table, ...]:
    """Return every table of a session but those of events and readings; predictions only where they were stored."""
    analysis, prediction = source.analysis, source.prediction
    made = (
        trials(source.recording),
        answers(source.recording),
        positions(source.recording),
        _of("strokes", "a row for each stroke", _strokes(analysis), STROKE),
        _of("friction", "what the model is given: a row for each trial with a stroke", given(analysis), FRICTION),
        _of("flaws", "what is wrong with the recording or with a stroke", [_named(f) for f in analysis["flaws"]], FLAW),
    )
    if analysis.get("decisions"):
        made = (*made, _of("decisions", "what people decided, in force", analysis["decisions"], DECISION))
    if prediction is None:
        return made
    rows = [{k: v for k, v in row.items() if k not in _OTHERWISE_TOLD} for row in prediction["trials"]]
    for row, told in zip(rows, prediction["trials"], strict=True):
        row |= _sed_interval("sed", told.get("interval")) | _sed_interval("opposite_sed", told.get("opposite_interval"))
        row |= _force_intervals(told.get("interval"))
        row |= made_with(prediction, told)
    predicted = _of("predictions", "what the finite-element finger predicts for each trial", rows, PREDICTION)
    made = (*made, predicted, *_responses(prediction))
    otherwise = [
        {
            "trial": row["trial"],
            **one["variant"],
            **{k: v for k, v in one.items() if k not in ("variant", "interval")},
            **_sed_interval("sed", one.get("interval")),
            **_force_intervals(one.get("interval")),
            "indentation_interval": None if one.get("interval") is None else one["interval"].get("indentation"),
        }
        for row in prediction["trials"]
        for one in row.get("alternatives", ())
    ]
    if not otherwise:
        return made
    meaning = "the same trials predicted otherwise: another reading of tau_max, another strain, by the measured force"
    return (*made, _of("alternatives", meaning, otherwise, ALTERNATIVE))


def _responses(prediction: Mapping[str, Any]) -> tuple[Table, ...]:
    """Return the table of every quantity at the ending, where the prediction holds them: older ones do not."""
    rows: list[dict[str, Any]] = []
    for row in prediction["trials"]:
        solved: Mapping[str, Any] = row.get("solver") or {"responses": {}}
        held: Mapping[str, Mapping[str, Any]] = solved.get("responses", {})
        rows += [{"trial": row["trial"], "quantity": name, **found} for name, found in held.items()]
    meaning = "every quantity at the ending for each predicted trial"
    return (_of("responses", meaning, rows, RESPONSE),) if rows else ()


def _sed_interval(name: str, told: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the columns of an interval, where one was asked for: its ends, how it was found, or why it is none."""
    if told is None:
        return {}
    ends = None if told["low"] is None else (told["low"], told["high"])
    return {f"{name}_interval": ends, f"{name}_interval_by": told["method"] or told["reason"]}


def _force_intervals(told: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the columns of the intervals of a state's forces, and of its depth where that was found."""
    return {} if told is None else {f"{name}_interval": told.get(name) for name in ("normal_force", "tangential_force")}


def trials(recording: Recording) -> Table:
    """Return a row for each planned trial, in the plan's order."""
    records = recording.trials
    zeros = [_zero(recording, record.trial.number, record.start_ns) for record in records]

    def column(name: str, unit: str, meaning: str, values: Iterable[Cell]) -> Column:
        return Column(name, unit, meaning, tuple(values))

    return Table(
        "trials",
        "a row for each planned trial",
        (
            column("trial", "", "number over the whole session", (r.trial.number for r in records)),
            column("block", "", "name of its block", (r.trial.block for r in records)),
            column("descriptor", "", "what was judged", (r.trial.stimulus.descriptor for r in records)),
            column(
                "index", "", "the maker's number of the stimulus; no score", (r.trial.stimulus.index for r in records)
            ),
            column("code", "", "label on the stimulus", (r.trial.stimulus.code for r in records)),
            column("direction", "", "+1 proximal to distal, -1 back", (r.trial.direction for r in records)),
            column("repetition", "", "from 1", (r.trial.repetition for r in records)),
            column("phase", "", "main; or practice, pre-evaluation", (r.trial.phase for r in records)),
            column("compared_with", "", "trial with the first of two", (r.trial.compared_with for r in records)),
            column("standard", "", "1 where the others are compared with it", (int(r.trial.standard) for r in records)),
            column("outcome", "", OUTCOMES, (r.outcome for r in records)),
            column("score", "", "the subject's answer, 0 to 100", (r.score for r in records)),
            column("free_number", "", "the subject's answer on a scale of its own", (r.number for r in records)),
            column("choice", "", "the subject's answer: first or second of two", (r.choice for r in records)),
            column("take", "", "number of the take that counts", (r.take.number if r.take else None for r in records)),
            column("start", "ns", "first instant of that take, session clock", (r.start_ns for r in records)),
            column("stop", "ns", "first instant after it", (r.stop_ns for r in records)),
            *(
                column(f"zero_{axis}", unit, "of the wrench in the take's unloaded stretch", (z[i] for z in zeros))
                for i, (axis, unit) in enumerate(AXES)
            ),
        ),
    )


def event_columns(events: Sequence[LoggedEvent]) -> tuple[Column, Column, Column, Column, Column]:
    """Return number, time, trial, readings and data of each event."""
    return (
        Column("number", "", "from 1", tuple(e.number for e in events)),
        Column("time", "ns", "session clock", tuple(e.time_ns for e in events)),
        Column("trial", "", "number of the trial it belongs to", tuple(e.trial for e in events)),
        Column("readings", "", "how many readings were recorded before it", tuple(e.readings for e in events)),
        Column("data", "", "what else is known, as JSON", tuple(json_text(dict(e.data)) for e in events)),
    )


def answers(recording: Recording) -> Table:
    """Return a row for each answer a subject gave, with all that was recorded of it but its positions."""
    given = [event for event in recording.events if event.kind in ANSWERS]
    rows = [
        {
            "trial": event.trial,
            "time": event.time_ns,
            "kind": event.kind,
            **{k: v for k, v in event.data.items() if k != "positions"},
        }
        for event in given
    ]
    return _of("answers", "a row for each answer, those of discarded takes too", rows, ANSWER)


def positions(recording: Recording) -> Table:
    """Return a row for each position the subject's mark had on the line."""
    rows = [
        {"trial": event.trial, "instant": instant, "position": position}
        for event in recording.events
        if event.kind == "scored"
        for instant, position in event.data.get("positions") or ()
    ]
    return _of("positions", "every position of the mark on the line before an answer", rows, POSITION)


def _zero(recording: Recording, trial: int, start_ns: int | None) -> tuple[float | None, ...]:
    """Return the wrench of the last unloaded stretch measured in the take that counts; None for each where none was."""
    zero: tuple[float | None, ...] = (None,) * 6
    for event in recording.events:
        after = start_ns is not None and event.time_ns >= start_ns
        if event.kind == "zeroed" and event.trial == trial and after and recording.info is not None:
            zero = tuple((recording.info.calibration.matrix @ event.data["mean"]).tolist())
    return zero


def _strokes(analysis: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the strokes with their bootstrap intervals, where the analysis holds them."""
    strokes: Sequence[dict[str, Any]] = analysis["strokes"]
    held: Mapping[str, Any] = analysis.get("bootstrap") or {}
    told: Sequence[Mapping[str, Any]] = held.get("strokes") or ()
    if not told:
        return list(strokes)
    drawn: Mapping[str, Any] = held["settings"]
    calibration = {name: drawn[name] for name in ("gain_error", "gain_error_origin")}
    ends: list[dict[str, Any]] = [
        {
            **{f"{name}_bootstrap": one[name] for name in NUMBERS},
            "direction_agrees": one["direction_agrees"],
            **calibration,
        }
        for one in told
    ]
    return [{**stroke, **end} for stroke, end in zip(strokes, ends, strict=True)]


def _named(flaw: Mapping[str, Any]) -> dict[str, Any]:
    return {"flaw": flaw["name"], **{key: value for key, value in flaw.items() if key != "name"}}


def _of(name: str, meaning: str, rows: Sequence[Mapping[str, Any]], told: Mapping[str, tuple[str, str]]) -> Table:
    """Return plain data as a table: the columns told first, then any others the rows hold."""
    flat = [dict(_flat(row)) for row in rows]
    names = dict.fromkeys(name for pair in map(_names, told) for name in pair)
    names.update(dict.fromkeys(name for row in flat for name in row))
    found: list[Column] = []
    for column in names:
        unit, what = told.get(column) or told.get(column.rsplit("_", 1)[0]) or ("", "see docs/session-format.md")
        found.append(Column(column, unit, what, tuple(row.get(column) for row in flat)))
    if flat:  # what is in no row of this session is left out
        found = [column for column in found if column.name in flat[0] or any(v is not None for v in column.values)]
    return Table(name, meaning, tuple(found))


def _names(column: str) -> tuple[str, ...]:
    return tuple(f"{column}_{end}" for end in _PAIRS[column]) if column in _PAIRS else (column,)


def _flat(row: Mapping[str, Any]) -> Iterable[tuple[str, Cell]]:
    """Yield the cells of a row: pairs and stimuli as several, texts joined, other lists as JSON."""
    for name, value in row.items():
        if name in _PAIRS:
            yield from zip(_names(name), value or (None, None), strict=True)
        elif isinstance(value, list | tuple) and all(isinstance(part, str) for part in cast("Sequence[Any]", value)):
            yield name, "; ".join(cast("Sequence[str]", value)) or None
        elif isinstance(value, Mapping) and name == "stimulus":
            yield from ((f"{name}_{part}", cell) for part, cell in cast("Mapping[str, Cell]", value).items())
        elif isinstance(value, Mapping):
            yield name, "; ".join(f"{part}: {why}" for part, why in cast("Mapping[str, Any]", value).items()) or None
        elif isinstance(value, list | tuple):
            yield name, json.dumps(value, ensure_ascii=False) if value else None
        elif isinstance(value, bool):
            yield name, "true" if value else "false"
        else:
            yield name, value
