"""The unit and the meaning of every column of a session's tables: column to (unit, "" for none; meaning)."""

import hashlib
from collections.abc import Mapping
from typing import Any

from sessions.prediction import Scene, TrialPrediction
from sessions.prediction.stored import Alternative, Variant
from sessions.recording.log import OUTCOMES
from sessions.strokes.bootstrap import NUMBERS
from sessions.strokes.friction import FrictionParameters
from sessions.strokes.stroke import Stroke, meanings
from sessions.toml_file import from_table, toml_text

Cell = str | int | float | None

# A prediction made otherwise than usual must not look like the usual one.
PREDICTED_WITH: Mapping[str, tuple[str, str]] = {
    "kinematics": ("", "strain of the model: small or finite"),
    "tau_reading": ("", "of tau_max: computed, or as-printed (a hundredth)"),
    "area_law": ("", "by which the contact area of tau_max follows the normal force: fixed, hertz or power"),
    "area_exponent": ("", "of that law"),
    "area_force": ("N", "normal force at which that area is the planned one; none where it is fixed"),
    "indentation_origin": ("", "of indentation: block (of the trial), or set for all trials"),
    "width": ("mm", "of the finger: what forces per mm are multiplied by"),
    "width_origin": ("", "set, or assumed"),
    "scene_sha256": ("", "of the finger, materials, receptor and solve settings, as the scene file a report holds"),
    "tolerance": ("", "relative error of sed asked for; none: the solver's own mesh"),
    "dofs": ("", "unknowns of the mesh that sed and its error_estimate are of"),
}


def predicted_with(prediction: Mapping[str, Any], row: Mapping[str, Any]) -> dict[str, Cell]:
    """Return what one trial's prediction was made with, as cells of `PREDICTED_WITH`."""
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


Columns = Mapping[str, tuple[str, str]]

AXES = (("Fx", "N"), ("Fy", "N"), ("Fz", "N"), ("Tx", "N mm"), ("Ty", "N mm"), ("Tz", "N mm"))

TRIAL = {
    "trial": ("", "number over the whole session"),
    "block": ("", "name of its block"),
    "descriptor": ("", "what was judged"),
    "index": ("", "the maker's number of the stimulus; no score"),
    "code": ("", "label on the stimulus"),
    "direction": ("", "+1 proximal to distal, -1 back"),
    "repetition": ("", "from 1"),
    "phase": ("", "main; or practice, pre-evaluation"),
    "compared_with": ("", "trial with the first of two"),
    "standard": ("", "1 where the others are compared with it"),
    "outcome": ("", OUTCOMES),
    "score": ("", "the subject's answer, 0 to 100"),
    "free_number": ("", "the subject's answer on a scale of its own"),
    "choice": ("", "the subject's answer: first or second of two"),
    "take": ("", "number of the take that counts"),
    "start": ("ns", "first instant of that take, session clock"),
    "stop": ("ns", "first instant after it"),
    **{f"zero_{axis}": (unit, "of the wrench in the take's unloaded stretch") for axis, unit in AXES},
}

_Further = Mapping[str, Columns]  # further columns of a record, by the column they follow


def _columns(record: type, further: _Further) -> Columns:
    """Return the meanings that the fields of a record have, and further columns behind some of them."""
    own = meanings(record).items()
    return {name: words for one, meaning in own for name, words in {one: meaning, **further.get(one, {})}.items()}


_INTERVAL_BY = "derivatives (by the converged tangent) or sampling (of draws), or why there is no interval"
_FORCE_ERRORS = {
    "normal_force_error": ("", "relative, estimated by the solver, of normal_force"),
    "tangential_force_error": ("", "relative, estimated by the solver, of tangential_force"),
    "normal_force_interval": ("N", "95 % interval of normal_force that the uncertainty of friction makes"),
    "tangential_force_interval": ("N", "95 % interval of tangential_force that the uncertainty of friction makes"),
}
_OF_STROKE: _Further = {
    "direction_from": {"direction_agrees": ("", "share of bootstrap repeats with that direction")},
    "flaws": {
        **{
            f"{name}_bootstrap": (meanings(Stroke)[name].unit, f"95 % bootstrap interval of {name}") for name in NUMBERS
        },
        "gain_error": ("", "calibration: standard uncertainty of each axis' gain, which the bootstrap intervals hold"),
        "gain_error_origin": ("", "of that: set, or assumed where nobody stated it"),
    },
}
_OF_FRICTION: _Further = {
    "mu": {
        "mu_interval": ("", "95 % interval of that very number"),
        "mu_interval_by": ("", "the kind of that interval, and of which number of strokes it is"),
    },
    "tau_max": {
        "tau_max_interval": ("MPa", "95 % interval of it; the contact area is taken as given"),
        "tau_max_interval_by": ("", "the kind of that interval"),
    },
}
_OF_ALTERNATIVE: _Further = {
    "tangential_force": {
        **_FORCE_ERRORS,
        "indentation_error": ("", "relative, estimated by the solver, of a depth that was found"),
        "indentation_interval": ("mm", "95 % interval that friction, and the force, make of a depth that was found"),
    },
    "reason": {
        "doubt": ("", "why the numbers are not to be believed: the model was driven beyond its range"),
        "traction": ("MPa", "greatest friction traction on the skin; a tau_max above it bounds nothing"),
        "sed_interval": ("MPa", "95 % interval of sed that the uncertainty of friction, and of a driving force, makes"),
        "sed_interval_by": ("", _INTERVAL_BY),
    },
}
_OF_PREDICTION: _Further = {
    "block": {
        "stimulus_descriptor": ("", "what was judged"),
        "stimulus_index": ("", "the maker's number of the stimulus"),
        "stimulus_code": ("", "label on the stimulus"),
    },
    "sed": {
        "sed_interval": ("MPa", "95 % interval of sed that the uncertainty of friction makes, where it was asked for"),
        "sed_interval_by": ("", _INTERVAL_BY),
        "opposite_sed_interval": ("MPa", "likewise of opposite_sed"),
        "opposite_sed_interval_by": ("", "likewise"),
    },
    "measured_tangential": _FORCE_ERRORS,
    "matching_depth": {
        "matching_depth_error": ("", "relative, estimated by the solver; none where found on a rough mesh"),
        "matching_depth_interval": ("mm", "95 % interval that friction and the measured force make of it"),
    },
    "opposite_sed": {"opposite_error": ("", "relative, of opposite_sed")},
    "wall_s": PREDICTED_WITH,
}
STROKE = _columns(Stroke, _OF_STROKE)
FRICTION = _columns(FrictionParameters, _OF_FRICTION)
ALTERNATIVE = {"trial": ("", "number of the trial"), **_columns(Variant, {}), **_columns(Alternative, _OF_ALTERNATIVE)}
PREDICTION = _columns(TrialPrediction, _OF_PREDICTION)

FLAW = {
    "flaw": ("", "its name"),
    "sentence": ("", "what it is"),
    "grade": ("", "note, doubtful or refused"),
    "trial": ("", "number of the trial it belongs to"),
    "stroke": ("", "position of the stroke it belongs to, from 0"),
}

DECISION = {
    "number": ("", "of its line in decisions.jsonl"),
    "made_utc": ("", "when"),
    "by": ("", "who, a code"),
    "why": ("", "the reason given"),
    "what": ("", "what was decided"),
    "trial": ("", "number of the trial"),
    "stroke": ("", "number of the stroke within the trial, from 1; none: of the trial"),
    "old": ("", "what stood there before"),
    "new": ("", "what was decided for it"),
}

ANSWER = {
    "trial": ("", "number of the trial"),
    "time": ("ns", "when the answer was recorded, session clock"),
    "kind": ("", "scored, number_given or chosen"),
    "score": ("", "the answer, 0 to 100; none where the subject gave none"),
    "first_touch": ("s", "when the line was first touched, session clock"),
    "corrections": ("", "how often the answer was changed"),
    "hand": ("", "that answered"),
    "input_device": ("", "with which the answer was given"),
}

POSITION = {
    "trial": ("", "number of the trial"),
    "instant": ("s", "session clock"),
    "position": ("", "on the line, 0 to 100"),
}

RESPONSE = {
    "trial": ("", "number of the trial"),
    "quantity": ("", "its name in files and options"),
    "value": ("", "averaged over the ending, in the unit of its row"),
    "error": ("", "estimated by the solver, in the same unit"),
    "unit": ("", "of value and error; - for a strain"),
    "meaning": ("", "what the quantity is"),
}
