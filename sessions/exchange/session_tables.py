"""A session as tables: trials, answers, strokes, friction, predictions; every column with its unit and its meaning.

Columns that are not fields of a record are described in `columns.toml`.
"""

import hashlib
import json
import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sessions.exchange import ExportSource
from sessions.prediction import Scene, TrialPrediction
from sessions.prediction.stored import Alternative, Variant
from sessions.recording import LoggedEvent, Recording
from sessions.recording.head import compact_json
from sessions.recording.log import ANSWERS, OUTCOMES, event_data
from sessions.strokes.bootstrap import NUMBERS
from sessions.strokes.stroke import FrictionParameters, Stroke, meanings
from sessions.toml_file import from_table, toml_text

Cell = str | int | float | None
Columns = Mapping[str, tuple[str, str]]  # by name: unit ("" for none) and meaning
WRENCH = (("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Tx", "N mm"), ("Ty", "N mm"), ("Tz", "N mm"))
_ZERO = {f"zero_{axis}": unit for axis, unit in WRENCH}
_COLUMNS: Mapping[str, Any] = tomllib.loads((Path(__file__).parent / "columns.toml").read_text("utf-8"))


def _columns_of(name: str) -> Columns:
    return {column: (unit, meaning) for column, (unit, meaning) in _COLUMNS[name].items()}


def _prediction_cells(prediction: Mapping[str, Any], row: Mapping[str, Any]) -> dict[str, Cell]:
    """Return options, scene and mesh of one trial's prediction, as cells of the columns after `wall_s`."""
    options: Mapping[str, Any] = prediction.get("options") or {}
    area: Mapping[str, Any] = prediction.get("area") or {}
    table: Mapping[str, Any] | None = prediction.get("scene")
    scene = None if table is None else from_table(table, Scene, "scene")
    solver: Mapping[str, Any] = row.get("solver") or {}
    return {
        "kinematics": options.get("kinematics"),
        "tau_reading": options.get("tau_reading"),
        "area_law": area.get("law"),
        "area_exponent": area.get("exponent"),
        "area_force": None if area.get("law") == "fixed" else area.get("force"),
        "indentation_origin": "block" if options.get("indentation") is None else "set",
        "width": prediction.get("width"),
        "width_origin": prediction.get("width_origin"),
        "scene_sha256": None if scene is None else hashlib.sha256(toml_text(scene).encode()).hexdigest(),
        "tolerance": None if scene is None else scene.solve.tolerance,
        "dofs": solver.get("dofs"),
    }


def _columns(record: type, name: str) -> dict[str, tuple[str, str]]:
    """Return the meanings of a record's fields, with further columns after some of them."""
    further: Mapping[str, Mapping[str, list[str]]] = _COLUMNS["further"].get(name, {})
    columns: dict[str, tuple[str, str]] = {}
    for field, (unit, meaning) in meanings(record).items():
        columns[field] = unit, meaning
        if name == "stroke" and field == "flaws":
            units = {name: unit for name, (unit, _) in meanings(record).items()}
            columns |= {f"{name}_bootstrap": (units[name], f"95 % bootstrap interval of {name}") for name in NUMBERS}
        columns |= {column: (unit, text) for column, (unit, text) in further.get(field, {}).items()}
    return columns


TRIAL = {
    **_columns_of("trial"),
    "outcome": ("", OUTCOMES),
    **{name: (unit, "of the wrench in the take's unloaded stretch") for name, unit in _ZERO.items()},
}
_STROKE = _columns(Stroke, "stroke")
_FRICTION = _columns(FrictionParameters, "friction")
ALTERNATIVE = {
    "trial": ("", "number of the trial"), **_columns(Variant, "variant"), **_columns(Alternative, "alternative")
}  # fmt: skip
_PREDICTION = _columns(TrialPrediction, "prediction")
FLAW, DECISION, _ANSWER, POSITION, RESPONSE = map(_columns_of, ("flaw", "decision", "answer", "position", "response"))

_SUBTABLES = ("solver", "alternatives", "interval", "opposite_interval")
EACH_EVENT = "a row for each thing that happened, in order"


def heading(name: str, unit: str) -> str:
    """Return a column's name with its unit at the end, in characters that any program accepts.

    >>> heading("speed", "mm/s"), heading("torque", "N mm"), heading("mu", ""), heading("wall_s", "s")
    ('speed_mm_per_s', 'torque_Nmm', 'mu', 'wall_s')
    """
    suffix = f"_{unit.replace('/', '_per_').replace(' ', '')}" if unit else ""
    return name if name.endswith(suffix) else name + suffix


@dataclass(frozen=True, slots=True)
class Column:
    """One column; None is a withheld number or a missing value."""

    name: str
    unit: str  # "" for none
    meaning: str
    values: tuple[Cell, ...]

    @property
    def heading(self) -> str:
        """The name with the unit as a suffix."""
        return heading(self.name, self.unit)

    @property
    def kind(self) -> type[str] | type[float] | type[int]:
        """Type of the values: whole numbers only if none is missing."""
        if any(isinstance(value, str) for value in self.values):
            return str
        return float if any(value is None or isinstance(value, float) for value in self.values) else int

    @property
    def complete_values(self) -> list[Any]:
        """The values as one type; an empty text or NaN where missing."""
        kind = self.kind
        return [("" if kind is str else math.nan) if value is None else kind(value) for value in self.values]


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
    """Return all tables of a session except events and readings; predictions only where stored."""
    analysis = source.analysis
    flaws = [{"flaw": row["name"], **_without(row, "name")} for row in analysis["flaws"]]
    of_model, decisions = "what the model is given: a row for each trial with a stroke", analysis.get("decisions")
    return (
        trials(source.recording),
        answers(source.recording),
        positions(source.recording),
        _table("strokes", "a row for each stroke", _strokes(analysis), _STROKE),
        _table("friction", of_model, _friction(analysis), _FRICTION),
        _table("flaws", "what is wrong with the recording or with a stroke", flaws, FLAW),
        *([_table("decisions", "what people decided, in force", decisions, DECISION)] if decisions else []),
        *(() if source.prediction is None else _predictions(source.prediction)),
    )


def _predictions(prediction: Mapping[str, Any]) -> Iterable[Table]:
    """Yield the predictions, the quantities at the ending, and the variants, where there are any."""
    rows = [
        {
            **_without(row, *_SUBTABLES),
            **_sed_interval("sed", row.get("interval")),
            **_sed_interval("opposite_sed", row.get("opposite_interval")),
            **_force_intervals(row.get("interval")),
            **_prediction_cells(prediction, row),
        }
        for row in prediction["trials"]
    ]
    yield _table("predictions", "what the finite-element finger predicts for each trial", rows, _PREDICTION)
    responses = [
        {"trial": row["trial"], "quantity": name, **response}
        for row in prediction["trials"]
        for name, response in (row.get("solver") or {}).get("responses", {}).items()  # absent in older documents
    ]
    if responses:
        yield _table("responses", "every quantity at the ending for each predicted trial", responses, RESPONSE)
    variants = [
        {
            "trial": row["trial"],
            **alternative["variant"],
            **_without(alternative, "variant", "interval"),
            **_sed_interval("sed", interval),
            **_force_intervals(interval),
            "indentation_interval": None if interval is None else interval.get("indentation"),
        }
        for row in prediction["trials"]
        for alternative in row.get("alternatives", ())
        for interval in [alternative.get("interval")]
    ]
    if variants:
        meaning = (
            "the same trials predicted otherwise: another reading of tau_max, another strain, by the measured force"
        )
        yield _table("alternatives", meaning, variants, ALTERNATIVE)


def _without(row: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in row.items() if name not in names}


def _sed_interval(name: str, interval: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the columns of an interval, if requested: its ends and its method, or why it is missing."""
    if interval is None:
        return {}
    limits = None if interval["low"] is None else (interval["low"], interval["high"])
    return {f"{name}_interval": limits, f"{name}_interval_by": interval["method"] or interval["reason"]}


def _force_intervals(interval: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the columns of the intervals of a state's forces, if requested."""
    forces = ("normal_force", "tangential_force")
    return {} if interval is None else {f"{name}_interval": interval.get(name) for name in forces}


def trials(recording: Recording) -> Table:
    """Return a row for each planned trial, in the plan's order."""
    rows = [
        {
            "trial": record.trial.number,
            **asdict(record.trial.stimulus),
            **{name: getattr(record.trial, name) for name in ("block", "direction", "repetition", "phase")},
            "compared_with": record.trial.compared_with,
            "standard": int(record.trial.standard),
            **{name: getattr(record, name) for name in ("outcome", "score", "choice")},
            "free_number": record.number,
            "take": record.take.number if record.take else None,
            "start": record.start_ns,
            "stop": record.stop_ns,
            **dict(zip(_ZERO, _zero(recording, record.trial.number, record.start_ns), strict=True)),
        }
        for record in recording.trials
    ]
    return _table("trials", "a row for each planned trial", rows, TRIAL)


def event_columns(events: Sequence[LoggedEvent]) -> tuple[Column, Column, Column, Column, Column, Column]:
    """Return number, time, kind, trial, readings and data of each event."""
    return (
        Column("number", "", "from 1", tuple(e.number for e in events)),
        Column("time", "ns", "session clock", tuple(e.time_ns for e in events)),
        Column("kind", "", "what happened, see docs/session-format.md", tuple(e.kind for e in events)),
        Column("trial", "", "number of the trial it belongs to", tuple(e.trial for e in events)),
        Column("readings", "", "how many readings were recorded before it", tuple(e.readings for e in events)),
        Column("data", "", "what else is known, as JSON", tuple(compact_json(dict(e.data)) for e in events)),
    )


def logged_event(cells: Mapping[str, str], kind_column: str) -> LoggedEvent:
    """Return the event in a row's cells, whose kind is in `kind_column`. Raises LookupError, ValueError."""
    kind, trial = cells[kind_column], int(cells["trial"]) if cells["trial"] else None
    number, time_ns, readings = (int(cells[name]) for name in ("number", "time_ns", "readings"))
    return LoggedEvent(number, time_ns, kind, trial, readings, event_data(kind, cells["data"]))


def answers(recording: Recording) -> Table:
    """Return a row for each answer a subject gave, with all recorded data except its positions."""
    rows = [
        {"trial": event.trial, "time": event.time_ns, "kind": event.kind, **_without(event.data, "positions")}
        for event in recording.events
        if event.kind in ANSWERS
    ]
    return _table("answers", "a row for each answer, those of discarded takes too", rows, _ANSWER)


def positions(recording: Recording) -> Table:
    """Return a row for each position the subject's mark had on the line."""
    rows = [
        {"trial": event.trial, "instant": instant, "position": position}
        for event in recording.events
        if event.kind == "scored"
        for instant, position in event.data.get("positions") or ()
    ]
    return _table("positions", "every position of the mark on the line before an answer", rows, POSITION)


def _zero(recording: Recording, trial: int, start_ns: int | None) -> tuple[float | None, ...]:
    """Return the wrench of the last unloaded stretch measured in the valid take; None for each axis without one."""
    zero: tuple[float | None, ...] = (None,) * 6
    for event in recording.events:
        in_take = start_ns is not None and event.time_ns >= start_ns
        if event.kind == "zeroed" and event.trial == trial and in_take and recording.info is not None:
            zero = tuple((recording.info.calibration.matrix @ event.data["mean"]).tolist())
    return zero


def _strokes(analysis: Mapping[str, Any]) -> list[dict[str, Any]]:
    strokes: Sequence[dict[str, Any]] = analysis["strokes"]
    bootstrap: Mapping[str, Any] = analysis.get("bootstrap") or {}
    if not bootstrap.get("strokes"):
        return list(strokes)
    calibration = {name: bootstrap["settings"][name] for name in ("gain_error", "gain_error_origin")}
    return [
        {
            **stroke,
            **{f"{name}_bootstrap": intervals[name] for name in NUMBERS},
            "direction_agrees": intervals["direction_agrees"],
            **calibration,
        }
        for stroke, intervals in zip(strokes, bootstrap["strokes"], strict=True)
    ]


def _friction(analysis: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the friction of each trial, with the interval of the model's number, and its method.

    The interval of mu is of the mean or the maximum, by `rule`, from the bootstrap where the analysis has it.
    """
    bootstrap: Mapping[str, Any] = analysis.get("bootstrap") or {}
    strokes: Sequence[Mapping[str, Any]] = bootstrap.get("strokes") or ()
    rows: list[dict[str, Any]] = []
    for friction in analysis["friction"]:
        row = dict(friction)
        if strokes:
            intervals = strokes[int(row["stroke"])]
            interval_kind = f"{100 * bootstrap['settings']['confidence']:g} % block bootstrap"
            mu_measure = "mu_max" if row["rule"] == "maximum" else "mu_dynamic"
            for name, measure in (("mu", mu_measure), ("tau_max", "tau_max")):
                limits: Any = None if row[name] is None else intervals[measure]
                row[f"{name}_interval"] = limits
                row[f"{name}_interval_by"] = None if limits is None else f"{interval_kind} of {measure}"
        else:
            row["mu_interval_by"] = None if row["mu_interval"] is None else analysis["interval"]
        rows.append(row)
    return rows


def _table(
    name: str, meaning: str, rows: Sequence[Mapping[str, Any]], meanings: Mapping[str, tuple[str, str]]
) -> Table:
    """Return plain data as a table: the columns with a known meaning first, then any others in the rows."""
    flat = [dict(_flat(row)) for row in rows]
    names = dict.fromkeys(name for parts in map(_names, meanings) for name in parts)
    names.update(dict.fromkeys(name for row in flat for name in row))
    columns: list[Column] = []
    for column in names:
        description = meanings.get(column) or meanings.get(column.rsplit("_", 1)[0])
        unit, text = description or ("", "see docs/session-format.md")
        columns.append(Column(column, unit, text, tuple(row.get(column) for row in flat)))
    if flat:  # columns without a value in this session are left out
        columns = [c for c in columns if c.name in flat[0] or any(value is not None for value in c.values)]
    return Table(name, meaning, tuple(columns))


def _names(column: str) -> tuple[str, ...]:
    """Return the columns of a value: two for a span or an interval."""
    if column == "steady":
        return ("steady_start", "steady_stop")
    return (f"{column}_low", f"{column}_high") if column.endswith(("_interval", "_bootstrap")) else (column,)


def _flat(row: Mapping[str, Any]) -> Iterable[tuple[str, Cell]]:
    """Yield the cells of a row: pairs and stimuli as several, texts joined, other lists as JSON."""
    for name, value in row.items():
        names = _names(name)
        match value:
            case _ if len(names) > 1:
                yield from zip(names, value or (None, None), strict=True)
            case {} if name == "stimulus":
                yield from ((f"{name}_{item}", cell) for item, cell in value.items())
            case {}:
                yield name, "; ".join(f"{key}: {item}" for key, item in value.items()) or None
            case [*items] if all(isinstance(item, str) for item in items):
                yield name, "; ".join(items) or None
            case [*items]:
                yield name, json.dumps(items, ensure_ascii=False)
            case bool():
                yield name, "true" if value else "false"
            case _:
                yield name, value
