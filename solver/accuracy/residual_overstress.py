"""Estimate the overstress that relaxing tissues would still carry once an elastic finger slides steadily.

The load path is marched on a coarse mesh in few steps: the press, then a slide as long as the skin's displacement along
the surface, at whose end all of an elastic finger slips. Few steps suffice, since a step is exact for a strain that
grows linearly.
"""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from solver.accuracy.omitted_effects import RELAXATION, sideways, slide_duration, with_left_out
from solver.continuation.finite_states import rough_state
from solver.continuation.small_states import settled_state
from solver.equilibrium.finger import FiniteFinger, LinearFinger, cached_finger
from solver.equilibrium.load_path import PRESSING_TIME, LoadPoint, undeformed_path
from solver.failures import SolveFailure
from solver.mesh.mesher import Sizing
from solver.prediction import Prediction
from solver.scene import Scene
from solver.scene.tables import Relaxation, SceneError

_MARGIN = 4.0  # `Sizing.margin`: undeformed skin lower than twice the indentation may touch
# Elements per tip radius, and load steps of the press and of the slide each. Compared with 16 steps at a fineness of 5,
# estimates of 42 small-strain scenes differ by at most 4 % of the SED. Compared with 8 at a fineness of 4, those of 60
# finite-strain scenes differ by 5 % of it or a tenth of the estimate, four by a sixth: but the weights are assumed.
_FINENESS = 2.0
_STEPS = {"small": 1, "finite": 2}


@dataclass(frozen=True, slots=True)
class ResidualOverstress:
    """The overstress that remains, and its instant."""

    part: float  # surplus of the ending's SED, relative to the settled SED [-]
    slide_s: float  # time since the slide began [s]


def relaxing_scene(scene: Scene) -> Scene | None:
    """Return the scene with relaxing tissues: its Prony series, or the literature's with its moduli as long-term ones.

    Bulk moduli do not relax. Returns None for tissue too compressible for that, or too stiff for a scene.
    """
    if scene.materials.relax:
        return scene
    long_term = 1.0 - sum(g for _, g in RELAXATION)
    terms = tuple(Relaxation(g, tau) for tau, g in RELAXATION)
    soft: dict[str, Any] = {}
    for name in ("epidermis", "dermis", "fat"):
        tissue = scene.materials.of(name)
        shear, bulk = tissue.E / (2.0 * (1.0 + tissue.nu)) / long_term, tissue.E / (3.0 * (1.0 - 2.0 * tissue.nu))
        nu = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
        if nu < 0.0:
            return None
        soft[name] = replace(tissue, E=2.0 * shear * (1.0 + nu), nu=nu, prony=terms)
    try:
        return replace(scene, materials=replace(scene.materials, **soft))
    except SceneError:
        return None


def with_viscosity(prediction: Prediction) -> Prediction:
    """Return `prediction` with the evidence on viscosity from a load path, where there is one. Raises Cancelled."""
    scene, start = prediction.scene, perf_counter()
    if scene.materials.relax and scene.solve.course == "history":
        return prediction
    still = residual_overstress(prediction)
    if still is None:
        return replace(prediction, evidence_s=perf_counter() - start)
    series_text = "with the scene's own series"
    if not scene.materials.relax:
        series_text = (
            "to the moduli of the scene with the times of Pawluk and Howe (1999) and assumed weights of a fifth each"
        )
    before = prediction.model["left_out"]
    entry = {
        "estimate": still.part,
        "from": {**before["viscosity"]["from"], "slide_s": still.slide_s},
        "how": "change of the ending's SED when an elastic finger's slide has settled, all soft tissues relaxing "
        f"{series_text}: press and slide marched on a coarse mesh in few steps",
    }
    return with_left_out(prediction, {**before, "viscosity": entry}, start)


def residual_overstress(prediction: Prediction) -> ResidualOverstress | None:
    """Return the remaining overstress for a `prediction`, whose skin determines the length of the slide.

    None where the coarse mesh has no such load path. Raises Cancelled.
    """
    scene = relaxing_scene(prediction.scene.driven(prediction.indentation))
    if scene is None or not prediction.sed_ending > 0.0:
        return None
    direction = scene.loading.direction
    touching = prediction.mesh.skin[[state != "open" for state in prediction.skin.state]]
    slide = sideways(prediction.displacement, touching) if direction else 0.0
    kind, depth = scene.solve.kinematics, scene.loading.depth
    slide_s = slide_duration(scene, slide)
    parts = (np.arange(1, _STEPS[kind] + 1) / _STEPS[kind]).tolist()
    points = [LoadPoint(PRESSING_TIME * part, depth * part, 0.0) for part in parts]
    if slide > 0.0:
        points += [LoadPoint(PRESSING_TIME + slide_s * part, depth, direction * slide * part) for part in parts]
    try:
        sizing = Sizing(_FINENESS, depth, margin=_MARGIN)
        finger = cached_finger(
            FiniteFinger if kind == "finite" else LinearFinger, scene.frictionless_press(depth), sizing
        )
        state = rough_state(finger, scene) if isinstance(finger, FiniteFinger) else settled_state(scene, finger)
        at_last = finger.sed_ending(finger.displacement(state))
        path = undeformed_path(scene, finger, relaxing=True)
        for point in points:
            path.advance_to(point)
    except SolveFailure:
        return None
    return ResidualOverstress(abs(path.energies[-1][0] / at_last - 1.0), slide_s) if at_last > 0.0 else None
