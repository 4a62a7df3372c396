"""What a prediction's model holds, in words: finger, materials, readings, unknowns and audits."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, cast

from sessions.prediction.stored import SessionPrediction

_SCENE = {"finger": "mm, degrees", "materials": "E in MPa", "receptor": "mm"}  # what all trials share, with its units
_READINGS = {
    "computed": "greatest tangential force over the contact area",
    "as-printed": "a hundredth of that, as the paper's tables are headed",
}
UNKNOWNS = "unknowns"  # of the mesh: the name of that fact
_AUDITS = {  # 0 is perfect, but for the volume
    "equilibrium_x": "imbalance of forces along the surface, as a share of the contact force",
    "equilibrium_y": "imbalance of forces across the surface, as a share of the contact force",
    "inner_forces": "largest unbalanced force inside the tissue, as a share of the contact force",
    "work_balance": "difference of the work of the contact forces and the stored energy, relative",
    "penetration": "penetration of the skin, as a share of the indentation",
    "tension": "largest tension at a touching node, as a share of the largest pressure",
    "cone_violation": "friction above its law, as a share of the largest nodal force",
    "normal_force_missed": "deviation from the given normal force, relative",
    "drag_missed": "deviation from the given drag, as a share of the friction limit",
    "smallest_det_F": "smallest volume ratio",
    "course_work_balance": "over the course, imbalance of work, stored and lost energy, as a share of the work",
    "course_step_work": "over the course, work of nodes that touch or release in a step, as a share of the bone's work",
    "course_least_dissipation": "least dissipation of friction in a step of the course, as a share of the bone's work",
}


def model_facts(prediction: SessionPrediction | None) -> tuple[tuple[str, str, str], ...]:
    """Return name, value and remark of each thing that the model holds; audits are the worst over all trials."""
    solved = [] if prediction is None else [row.prediction for row in prediction.trials if row.prediction is not None]
    if prediction is None or not solved:
        return ()
    first = solved[0]
    facts = [(name, str(value), "") for name, value in first.model.items() if name != "left_out"]
    facts += [(name, _values(asdict(getattr(first.scene, name))), units) for name, units in _SCENE.items()]
    facts.append(("finger's width", f"{prediction.width:g} mm", prediction.width_origin))
    facts.append(("τ max", _READINGS[prediction.options.tau_reading], ""))
    facts.append((UNKNOWNS, f"{first.dofs} displacements", "one mesh for all trials"))
    audits = "; ".join(
        f"{_AUDITS.get(name, name.replace('_', ' '))}: {_worst(name, [p.audits for p in solved]):.2g}"
        for name in first.audits
    )
    return (*facts, ("audits", audits, "the worst over all trials; 0 is perfect, 1 for the volume ratio"))


def _worst(audit: str, all_audits: Sequence[Mapping[str, float]]) -> float:
    """Return the least value of an audit whose name says that it has one, else the greatest."""
    values = [audits[audit] for audits in all_audits if audit in audits]
    return (min(values) if "least" in audit or "smallest" in audit else max(values, key=abs)) + 0.0  # no minus zero


def _values(table: Mapping[str, Any]) -> str:
    """Return a scene's table in words, mm, degrees and MPa as in a scene file; what is not set is left out.

    >>> _values({"E": 0.08, "law": None, "prony": ({"g": 0.2, "tau": 0.07},)})
    'E 0.08; prony (g 0.2, tau 0.07)'
    """
    return "; ".join(f"{name.replace('_', ' ')} {_value(value)}" for name, value in table.items() if _is_set(value))


def _is_set(value: object) -> bool:
    return value is not None and value != ()


def _value(value: Any) -> str:  # noqa: ANN401  whatever a scene file holds
    if isinstance(value, Mapping):
        inside = cast("Mapping[str, Any]", value)
        return ", ".join(f"{name} {_value(item)}" for name, item in inside.items() if _is_set(item))
    if isinstance(value, tuple):
        return "(" + ", ".join(_value(item) for item in cast("tuple[Any, ...]", value)) + ")"
    return value if isinstance(value, str) else f"{value:g}"
