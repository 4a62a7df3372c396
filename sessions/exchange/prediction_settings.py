"""The settings that each prediction was made with, as columns of its table."""

import hashlib
from collections.abc import Mapping
from typing import Any

from sessions.prediction import Scene
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
