"""What leaving something out changed, measured: the scene is solved again on a coarse mesh, with it and without it.

Only for scenes with `[solve] evidence = "measured"`, since it costs more than the solve itself; `evidence_s` says what.
Numbers are differences on one coarse mesh, so they are better than the mesh's own error; with a bone that is meshed the
mesh of the soft tissues stays the same. Finite strain has meshes of its own: there a difference must exceed the errors.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

from solver.accuracy.omitted_effects import warnings
from solver.failures import NoSteadyState, SolveFailure
from solver.prediction import Prediction
from solver.scene.scene import Materials, Scene, Solve

COARSE = 0.5  # tolerance that asks for the coarsest mesh
Answer = Prediction | SolveFailure
Answers = Callable[[Sequence[Scene]], tuple[Answer, ...]]
TOLD = "measured on a coarse mesh: change of the ending's SED "


def measured(found: Prediction, answers: Answers) -> Prediction:
    """Return `found` with measured differences in place of estimates where they can be had."""
    begun = perf_counter()
    scene = replace(found.scene, solve=replace(found.scene.solve, evidence="estimated", tolerance=COARSE))
    left_out = {name: dict(entry) for name, entry in found.model["left_out"].items()}
    plain = replace(scene, solve=replace(scene.solve, course="steady"))
    base = answers((plain,))[0]
    if isinstance(base, Prediction):
        for name, entry in _differences(plain, base, answers).items():
            if name in left_out:
                estimated = left_out[name]["estimate"]
                left_out[name] |= {"estimated": estimated, **entry}
    kept = tuple(one for one in found.warnings if one not in warnings(found.scene, found.model["left_out"]))
    return replace(
        found,
        model={**found.model, "left_out": left_out},
        warnings=(*kept, *warnings(found.scene, left_out)),
        evidence_s=perf_counter() - begun + (found.evidence_s or 0.0),
    )


def _differences(scene: Scene, base: Prediction, answers: Answers) -> dict[str, dict[str, Any]]:
    """Return the entries that could be measured: new values of `estimate`, `from` and `how`."""
    out: dict[str, dict[str, Any]] = {}
    if scene.finger.bone == "rigid":
        yielding = replace(scene, finger=replace(scene.finger, bone="meshed"))
        out["bone compliance"] = _difference(base, answers((yielding,))[0], "with the bone meshed")
    if scene.solve.kinematics == "small" and not scene.materials.relax:
        out["finite strain"] = _beyond_errors(base, answers((_at_finite_strain(scene),))[0], "at finite strain")
    if scene.loading.directions and not scene.loading.dragged and not scene.materials.relax:
        marched = replace(scene, solve=replace(scene.solve, course="history"))
        out["history"] = _difference(base, answers((marched,))[0], "when the whole course is marched")
    return out


def _difference(base: Prediction, other: Answer, how: str) -> dict[str, Any]:
    if isinstance(other, NoSteadyState):
        return {
            "estimate": None,
            "from": {"limit_mu": other.limit_mu},
            "how": f"{TOLD}{how}: no settled state is there",
        }
    if isinstance(other, SolveFailure):
        return {"how": f"{TOLD}{how} was to be measured, but: {other}"}
    change = abs(other.sed_ending / base.sed_ending - 1.0) if base.sed_ending else None
    numbers = {"without_MPa": base.sed_ending, "with_MPa": other.sed_ending}
    return {"estimate": change, "from": numbers, "how": TOLD + how}


def _beyond_errors(base: Prediction, other: Answer, how: str) -> dict[str, Any]:
    """Return the same of a solve on another mesh, the estimate left as it was where both meshes explain the change."""
    found = _difference(base, other, how)
    if not isinstance(other, Prediction) or base.sed_ending == 0.0:
        return found
    change, errors = found["estimate"], base.error_estimate + other.error_estimate
    if change > errors:
        return found
    return {"how": f"{TOLD}{how}: {change:.2g}, within both meshes' errors, {errors:.2g}; the estimate stands"}


def _at_finite_strain(scene: Scene) -> Scene:
    tissues = (replace(tissue, law=None) for tissue in scene.materials.by_region)
    return replace(scene, materials=Materials(*tissues), solve=Solve("finite", "steady", COARSE))
