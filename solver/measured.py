"""What leaving something out changed, measured: the scene is solved again on a coarse mesh, with it and without it.

Only for scenes with `[solve] evidence = "measured"`, since it costs more than the solve itself; `evidence_s` says what.
Numbers are differences on one coarse mesh, so they are better than the mesh's own error; with a bone that is meshed the
mesh of the soft tissues stays the same.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from solver.evidence import RELAXATION, warnings
from solver.failures import NoSteadyState, SolveFailure
from solver.prediction import Prediction
from solver.scene import Materials, Relaxation, Scene, Solve

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
    kept = tuple(told for told in found.warnings if told not in warnings(found.scene, found.model["left_out"]))
    return replace(
        found,
        model={**found.model, "left_out": left_out},
        warnings=(*kept, *warnings(found.scene, left_out)),
        evidence_s=perf_counter() - begun,
    )


def _differences(scene: Scene, base: Prediction, answers: Answers) -> dict[str, dict[str, Any]]:
    """Return the entries that could be measured: new values of `estimate`, `from` and `how`."""
    out: dict[str, dict[str, Any]] = {}
    if scene.finger.bone == "rigid":
        yielding = replace(scene, finger=replace(scene.finger, bone="meshed"))
        out["bone compliance"] = _difference(base, answers((yielding,))[0], "with the bone meshed")
    if scene.solve.kinematics == "small" and not scene.materials.relax:
        out["finite strain"] = _difference(base, answers((_at_finite_strain(scene),))[0], "at finite strain")
    if scene.loading.directions and not scene.loading.dragged and not scene.materials.relax:
        marched = replace(scene, solve=replace(scene.solve, course="history"))
        out["history"] = _difference(base, answers((marched,))[0], "when the whole course is marched")
        out |= _viscosity(scene, base, answers)
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


def _at_finite_strain(scene: Scene) -> Scene:
    tissues = (replace(tissue, law=None) for tissue in scene.materials.by_region)
    return replace(scene, materials=Materials(*tissues), solve=Solve("finite", "steady", COARSE))


def _viscosity(scene: Scene, base: Prediction, answers: Answers) -> dict[str, dict[str, Any]]:
    """Measure what tissues with the times of the fingerpad would still hold when an elastic slide has settled.

    Their relaxed moduli are the scene's, so that both end alike.
    """
    stays = 1.0 - sum(g for _, g in RELAXATION)
    terms = tuple(Relaxation(g, tau) for tau, g in RELAXATION)
    soft: dict[str, Any] = {}
    for name in ("epidermis", "dermis", "fat"):
        tissue = scene.materials.of(name)
        shear, bulk = tissue.E / (2.0 * (1.0 + tissue.nu)) / stays, tissue.E / (3.0 * (1.0 - 2.0 * tissue.nu))
        nu = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
        if nu < 0.0:
            return {}
        soft[name] = replace(tissue, E=2.0 * shear * (1.0 + nu), nu=nu, prony=terms)
    marched = replace(scene.solve, course="history")
    elastic, viscous = answers(
        (replace(scene, solve=marched), replace(scene, materials=replace(scene.materials, **soft), solve=marched))
    )
    if not isinstance(elastic, Prediction) or not isinstance(viscous, Prediction):
        return {}
    if elastic.history is None or viscous.history is None:
        return {}
    slips = np.flatnonzero((elastic.history.slipping >= 1.0) & (elastic.history.time > 1.0))
    when = float(elastic.history.time[slips[0]]) if len(slips) else float(elastic.history.time[-1])
    then = float(np.interp(when, viscous.history.time, viscous.history.sed_ending))
    return {
        "viscosity": {
            "estimate": abs(then / base.sed_ending - 1.0) if base.sed_ending else None,
            "from": {"at_s": when, "elastic_MPa": base.sed_ending, "then_MPa": then},
            "how": TOLD + "when the slide of an elastic finger has settled, all soft tissues relaxing to the moduli of "
            "the scene with the times of Pawluk and Howe (1999) and assumed weights of a fifth each",
        }
    }
