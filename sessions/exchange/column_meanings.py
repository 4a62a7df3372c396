"""The unit and the meaning of every column of a session's tables: column to (unit, "" for none; meaning).

What is no field of a record stands in `columns.toml` beside this file.
"""

import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sessions.prediction import Scene, TrialPrediction
from sessions.prediction.stored import Alternative, Variant
from sessions.recording.log import OUTCOMES
from sessions.strokes.bootstrap import NUMBERS
from sessions.strokes.stroke import FrictionParameters, Stroke, meanings
from sessions.toml_file import from_table, toml_text

Cell = str | int | float | None
Columns = Mapping[str, tuple[str, str]]

AXES = (("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Tx", "N mm"), ("Ty", "N mm"), ("Tz", "N mm"))
_LISTED: Mapping[str, Any] = tomllib.loads((Path(__file__).parent / "columns.toml").read_text("utf-8"))


def _listed(name: str) -> Columns:
    return {column: (unit, meaning) for column, (unit, meaning) in _LISTED[name].items()}


def predicted_with(prediction: Mapping[str, Any], row: Mapping[str, Any]) -> dict[str, Cell]:
    """Return what one trial's prediction was made with, as cells of the columns behind `wall_s`."""
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
    """Return the meanings that the fields of a record have, and further columns behind some of them."""
    further: Mapping[str, Mapping[str, list[str]]] = _LISTED["further"].get(name, {})
    columns: dict[str, tuple[str, str]] = {}
    for field, (unit, meaning) in meanings(record).items():
        columns[field] = unit, meaning
        if name == "stroke" and field == "flaws":
            own = meanings(record)
            columns |= {f"{one}_bootstrap": (own[one].unit, f"95 % bootstrap interval of {one}") for one in NUMBERS}
        columns |= {column: (unit, words) for column, (unit, words) in further.get(field, {}).items()}
    return columns


TRIAL = {
    **_listed("trial"),
    "outcome": ("", OUTCOMES),
    **{f"zero_{axis}": (unit, "of the wrench in the take's unloaded stretch") for axis, unit in AXES},
}
STROKE = _columns(Stroke, "stroke")
FRICTION = _columns(FrictionParameters, "friction")
ALTERNATIVE = {
    "trial": ("", "number of the trial"), **_columns(Variant, "variant"), **_columns(Alternative, "alternative")
}  # fmt: skip
PREDICTION = _columns(TrialPrediction, "prediction")
FLAW, DECISION, ANSWER, POSITION, RESPONSE = map(_listed, ("flaw", "decision", "answer", "position", "response"))
