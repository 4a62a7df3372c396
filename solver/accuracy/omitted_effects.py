"""Effects that the model omits, each with an estimate of its size for the scene.

With `[solve] evidence = "measured"` the scene is solved again on a coarse mesh, with an effect and without it. Most of
the mesh error cancels in the difference. A meshed bone does not change the mesh of the soft tissues. Finite strain has
other meshes, so that its difference must exceed the errors.

For viscosity, a load path of relaxing tissues is marched on a coarse mesh in few steps, which are exact for strain that
grows linearly. The slide is as long as the skin's displacement along it: at its end all of an elastic finger slips.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from solver.arrays import Array, Indices, determinant
from solver.body import Patches
from solver.constitutive import HUMAN_SKIN
from solver.continuation.finite_states import rough_state
from solver.continuation.small_states import settled_state
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import KINDS, Finger, FiniteFinger, LinearFinger, cached_finger
from solver.equilibrium.load_path import PRESSING_TIME, LoadPoint, undeformed_path
from solver.failures import NoSteadyState, SolveFailure
from solver.mesh.mesher import Sizing
from solver.prediction import Prediction, percent
from solver.scene import Scene
from solver.scene.tables import Materials, Relaxation, SceneError, Solve

_DENSITY = 1.1e-9  # of soft tissue [t/mm3 = N s2/mm4]
# Relaxation of the fingerpad under load: times from Pawluk and Howe 1999 (J. Biomech. Eng. 121, 178). Their weights are
# not in the abstract; a fifth of the instantaneous stiffness is assumed for each, so that two fifths remain.
RELAXATION = ((0.004, 0.2), (0.07, 0.2), (1.4, 0.2))
WARNING_CHANGE = 0.02  # relative change of the SED by an omitted effect from which there is a warning
STRAIN_LIMIT = 0.1  # strain from which there is a warning at small strain [-]


def _describe_laws(scene: Scene) -> str:
    usual = "Hooke" if scene.solve.kinematics == "small" else "compressible neo-Hookean"
    laws: list[str] = []
    for name in ("epidermis", "dermis", "fat"):
        tissue = scene.materials.of(name)
        default = f"{HUMAN_SKIN:g} (default: human skin, ascribed to Shergold and Fleck 2004)"
        exponent = default if tissue.stiffening is None else f"{tissue.stiffening:g}"
        law = f"Ogden, exponent {exponent}" if tissue.law == "ogden" else usual
        laws.append(f"{name} {law}" + (f", relaxing in {len(tissue.prony)} terms" if tissue.prony else ""))
    return "; ".join(laws)


def _describe_support(scene: Scene) -> str:
    """Return the model of the bone, the cut and the nail as text."""
    finger = scene.finger
    text = "driven as a whole" if finger.bone == "rigid" else "meshed, driven at its core of a third of its radius"
    text += "; the cut is free" if finger.cut == "free" else "; the cut is driven with it"
    return text + (f"; a nail plate of {finger.nail_length:g} mm is fixed to it" if finger.nail_length else "; no nail")


def model(
    scene: Scene, finger: Finger[Patches], state: EquilibriumState, displacement: Array, width: float
) -> dict[str, Any]:
    """Return the model and its omitted effects as plain data; `width` is the width of the contact [mm].

    Every entry of `left_out` has `estimate`, the relative change of the SED by the effect or a lower bound of it,
    `from`, the scene's values that it is based on, and `how`, the method.
    """
    slide = _sideways(displacement, finger.geometry.mesh.skin[state.touching])
    small = {"finite strain": _finite_strain(finger, displacement)} if isinstance(finger, LinearFinger) else {}
    modes, skin, tractions = ("pressure", "skin", "tractions") if small else ("ln J", "deformed skin", "true tractions")
    return {
        "kinematics": f"{scene.solve.kinematics} strain, plane strain",
        "material": _describe_laws(scene),
        "element": f"Q2/P-1: nine nodes, three modes of {modes} condensed in the element",
        "contact": f"unilateral on the {skin}, Coulomb with |t| <= min(mu p, tau_max) on {tractions}, each node of the "
        "skin open, in stick, in slip or in slip at the bound",
        "course": _describe_course(scene),
        "bone": _describe_support(scene),
        "width": "forces are per mm of width",
        "left_out": small
        | {
            "bone compliance": _bone(scene, state.force),
            "inertia": _inertia(scene, float(state.force[1]), width),
            "viscosity": _viscosity(scene, slide),
            "history": _history(scene, state.sticking, slide),
            "the third dimension": _width(scene, width),
        },
    }


def _entry(estimate: float | None, how: str, **numbers: object) -> dict[str, Any]:
    return {"estimate": estimate, "from": numbers, "how": how}


def _sideways(displacement: Array, touching: Indices) -> float:
    """Return the largest displacement along the surface [mm] of the nodes `touching`."""
    return float(np.abs(displacement[touching, 0]).max(initial=0.0))


def warnings(scene: Scene, left_out: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a warning for every omitted effect that matters in this scene."""
    sentences: list[str] = []
    if "finite strain" in left_out:
        sentences += _strain_warnings(left_out["finite strain"])
    needs = {
        "bone compliance": 'ask for finger.bone = "meshed"',
        "history": 'ask for solve.course = "history"',
        "inertia": "the solver does not model it",
    }
    if scene.solve.course == "history":
        needs["viscosity"] = "give the tissues a Prony series"
    elif scene.materials.relax:
        needs["viscosity"] = 'ask for solve.course = "history"'
    for name, cure in needs.items():
        change = left_out[name]["estimate"] if name in left_out else None
        if change is not None and change > WARNING_CHANGE:
            sentences.append(f"Leaving out {name} may have changed the ending's SED by {percent(change)}: {cure}.")
    return tuple(sentences)


def _strain_warnings(entry: Mapping[str, Any]) -> list[str]:
    numbers, change = entry["from"], entry["estimate"]
    if "limit_mu" in numbers:
        return ["At finite strain this scene has no settled state: the skin folds first. Small strain hides that."]
    if "with_MPa" in numbers:
        if change is None or change <= WARNING_CHANGE:
            return []
        return [f"At finite strain the ending's SED differs by {percent(change)}: small strain is not meant for it."]
    if numbers["largest_strain"] <= STRAIN_LIMIT:
        return []
    return [
        f"Strains reach {100 * numbers['largest_strain']:.0f} % in the skin and "
        f"{100 * numbers['strain_at_ending']:.0f} % at the ending, outside the range of small strain: "
        "finite strain would give another answer."
    ]


def _describe_course(scene: Scene) -> str:
    if scene.loading.direction == 0:
        return "pre-indentation, marched with stick and slip"
    if scene.solve.course == "history":
        return "pre-indentation, stick, partial slip and slide, marched until settled"
    return "settled sliding, solved directly"


def _finite_strain(finger: LinearFinger, displacement: Array) -> dict[str, Any]:
    small, large = finger.body.stretches(displacement)
    elastic, endings = finger.body.elastic, finger.ending.endings
    probes, weights = endings.probes, endings.weights
    gradient = probes.displacement_gradient(elastic.mesh, displacement)
    f = gradient + np.eye(2)
    det = determinant(f)
    shear, lame = elastic.elements.shear[probes.element], elastic.elements.lame[probes.element]
    estimate = None
    if det.min() > 0.0:
        log = np.log(det)
        finite = shear / 2.0 * (np.sum(f * f, axis=(1, 2)) - 2.0 - 2.0 * log) + lame / 2.0 * log**2
        hooke = elastic.energy(probes, displacement[:, :, None])[:, 0]
        estimate = abs(float(weights @ finite) / float(weights @ hooke) - 1.0)
    strain = (gradient + np.swapaxes(gradient, 1, 2)) / 2.0
    at_ending = float(np.abs(np.linalg.eigvalsh(strain)).max())
    return _entry(
        estimate,
        "change of the ending's SED when these displacements enter the neo-Hookean law; contact and forces would "
        "change too, so it is no bound: solved at finite strain, six published surfaces changed 0.1 to 2.1 times as "
        "much",
        largest_strain=float(max(1.0 - small.min(), large.max() - 1.0)),
        strain_at_ending=at_ending,
    )


def _bone(scene: Scene, force: Array) -> dict[str, Any]:
    bone = scene.materials.bone
    if scene.finger.bone == "meshed":
        return _entry(0.0, "the bone was meshed", E_MPa=bone.E)
    pressure = float(np.hypot(*force)) / (2.0 * scene.finger.bone_radius)
    yields = pressure * (1.0 - bone.nu**2) / bone.E * 2.0 * scene.finger.bone_radius
    how = "the bone's own shortening under the force on it, as part of the indentation, twice for an energy"
    return _entry(2.0 * yields / scene.loading.depth, how, bone_pressure_MPa=pressure, bone_shortening_mm=yields)


def _inertia(scene: Scene, normal: float, length: float) -> dict[str, Any]:
    if scene.loading.direction and scene.solve.course == "steady" and not scene.loading.dragged:
        return _entry(0.0, "a finger that slides at constant speed keeps its shape")
    pressure = normal / length if length else 0.0
    speed = max(scene.loading.speed if scene.loading.direction else 0.0, scene.loading.depth / PRESSING_TIME)
    how = (
        "pressure of tissue that starts or stops (density times speed squared, 1.1 g/cm3) by the mean contact "
        "pressure, twice for an energy"
    )
    estimate = 2.0 * _DENSITY * speed**2 / pressure if pressure else None
    return _entry(estimate, how, mean_pressure_MPa=pressure, speed_mm_s=speed)


def _viscosity(scene: Scene, slide: float) -> dict[str, Any]:
    duration = _slide_duration(scene, slide)
    if scene.materials.relax and scene.solve.course == "history":
        how = "tissues relaxed as the scene says, until nothing changed"
        return _entry(0.0, how, longest_relaxation_s=scene.materials.longest_relaxation)
    if scene.materials.relax:
        series = [[(t.tau, t.g) for t in tissue.prony] for tissue in scene.materials.by_region]
        series_text = "the tissues relaxing by the scene's own series, the largest of them"
    else:
        series = [list(RELAXATION)]
        series_text = (
            "all layers relaxing alike with the times of Pawluk and Howe (1999) and assumed weights of a fifth each; "
            "it would scale all surfaces alike"
        )
    return _entry(
        max(_overstress_after(duration, terms) for terms in series),
        f"energy of the stress above its relaxed value when sliding has settled, {series_text}",
        slide_s=duration,
        relaxation_s=sorted({tau for terms in series for tau, _ in terms}),
    )


def _overstress_after(duration: float, terms: Sequence[tuple[float, float]]) -> float:
    """Return the relative surplus of energy after a press of 1 s and a slide that lasts `duration` [s]."""
    overstress = sum(g * tau * (np.exp(-duration / tau) - np.exp(-(duration + 1.0) / tau)) for tau, g in terms)
    return float(1.0 + overstress / (1.0 - sum(g for _, g in terms))) ** 2 - 1.0


def _slide_duration(scene: Scene, drift: float) -> float:
    """Return the duration [s] of a slide until it settles: the bone travels by the skin's displacement `drift` [mm]."""
    return drift / scene.loading.speed if scene.loading.direction else 0.0


def _history(scene: Scene, sticking: float, slide: float) -> dict[str, Any]:
    if scene.solve.course == "history" or scene.loading.direction == 0:
        return _entry(0.0, "the history was marched", sticking_part=sticking, elastic_slide_mm=slide)
    how = (
        "part of the touching points that stick: only these depend on the load path, whose effect vanishes once the "
        "bone has slid a few times the skin's own sideways displacement"
    )
    return _entry(sticking, how, sticking_part=sticking, elastic_slide_mm=slide)


def _width(scene: Scene, width: float) -> dict[str, Any]:
    nu = max(tissue.nu for tissue in scene.meshed_tissues)
    return _entry(
        nu**2 * min(1.0, width / scene.finger.width),
        "within half a contact width of either side of the finger tissue is free to widen, as in plane stress, and nu "
        "squared softer: that by the part of the finger's width so near a side; that the pulp is round across its "
        "width too is not in it, and changes more",
        contact_width_mm=width,
        finger_width_mm=scene.finger.width,
        poisson_ratio=nu,
    )


COARSE = 0.5  # tolerance that the coarsest mesh meets
Answer = Prediction | SolveFailure
SolveMany = Callable[[Sequence[Scene]], tuple[Answer, ...]]
MEASURED = "measured on a coarse mesh: change of the ending's SED "


def measure_differences(prediction: Prediction, answers: SolveMany) -> Prediction:
    """Return `prediction` with measured differences in place of estimates where a solve gives them."""
    start = perf_counter()
    solve = replace(prediction.scene.solve, course="steady", evidence="estimated", tolerance=COARSE)
    plain = replace(prediction.scene, solve=solve)
    left_out = {name: dict(entry) for name, entry in prediction.model["left_out"].items()}
    base = answers((plain,))[0]
    if isinstance(base, Prediction):
        for name, entry in _differences(plain, base, answers).items():
            if name in left_out:
                left_out[name] |= {"estimated": left_out[name]["estimate"], **entry}
    return _with_left_out(prediction, left_out, start)


def _with_left_out(prediction: Prediction, left_out: Mapping[str, Any], start: float) -> Prediction:
    """Return `prediction` with new entries `left_out` and their warnings; the work on them began at `start` [s]."""
    usual = warnings(prediction.scene, prediction.model["left_out"])
    remaining = [warning for warning in prediction.warnings if warning not in usual]
    return replace(
        prediction,
        model={**prediction.model, "left_out": left_out},
        warnings=(*remaining, *warnings(prediction.scene, left_out)),
        evidence_s=perf_counter() - start + (prediction.evidence_s or 0.0),
    )


def _differences(scene: Scene, base: Prediction, answers: SolveMany) -> dict[str, dict[str, Any]]:
    """Return the entries that were measured, with new `estimate`, `from` and `how`."""
    out: dict[str, dict[str, Any]] = {}
    if scene.finger.bone == "rigid":
        meshed: Answer | SceneError
        try:
            meshed = answers((replace(scene, finger=replace(scene.finger, bone="meshed")),))[0]
        except SceneError as error:  # of a bone too stiff for the tissues
            meshed = error
        out["bone compliance"] = _difference(base, meshed, "with the bone meshed")
    if scene.solve.kinematics == "small" and not scene.materials.relax:
        tissues = (replace(tissue, law=None) for tissue in scene.materials.by_region)
        finite = replace(scene, materials=Materials(*tissues), solve=Solve("finite", "steady", COARSE))
        out["finite strain"] = _beyond_errors(base, answers((finite,))[0], "at finite strain")
    if scene.loading.directions and not scene.loading.dragged and not scene.materials.relax:
        history = replace(scene, solve=replace(scene.solve, course="history"))
        out["history"] = _difference(base, answers((history,))[0], "when the whole course is marched")
    return out


def _difference(base: Prediction, variant: Answer | SceneError, variation: str) -> dict[str, Any]:
    if isinstance(variant, NoSteadyState):
        return _entry(None, f"{MEASURED}{variation}: no settled state exists", limit_mu=variant.limit_mu)
    if not isinstance(variant, Prediction):
        return {"how": f"{MEASURED}{variation} was to be measured, but: {variant}"}
    change = abs(variant.sed_ending / base.sed_ending - 1.0) if base.sed_ending else None
    return _entry(change, MEASURED + variation, without_MPa=base.sed_ending, with_MPa=variant.sed_ending)


def _beyond_errors(base: Prediction, variant: Answer, variation: str) -> dict[str, Any]:
    """Return the entry of a solve on another mesh, without `estimate` where the mesh errors explain the change."""
    entry = _difference(base, variant, variation)
    if isinstance(variant, Prediction) and base.sed_ending:
        change, errors = entry["estimate"], base.error_estimate + variant.error_estimate
        within = f"{change:.2g}, within both meshes' errors, {errors:.2g}; the estimate is kept"
        return entry if change > errors else {"how": f"{MEASURED}{variation}: {within}"}
    return entry


_MARGIN = 4.0  # `Sizing.margin`: undeformed skin lower than twice the indentation may touch
# Elements per tip radius, and load steps of the press and of the slide each. Compared with 16 steps at a fineness of 5,
# estimates of 42 small-strain scenes differ by at most 4 % of the SED. Compared with 8 at a fineness of 4, those of 60
# finite-strain scenes differ by 5 % of it or a tenth of the estimate, four by a sixth: but the weights are assumed.
_FINENESS = 2.0
_STEPS = {"small": 1, "finite": 2}


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
    residual = _residual_overstress(prediction)
    if residual is None:
        return replace(prediction, evidence_s=perf_counter() - start)
    left_out, (estimate, slide_s) = prediction.model["left_out"], residual
    relaxing = "to the moduli of the scene with the times of Pawluk and Howe (1999) and assumed weights of a fifth each"
    if scene.materials.relax:
        relaxing = "with the scene's own series"
    how = (
        f"change of the ending's SED when an elastic finger's slide has settled, all soft tissues relaxing {relaxing}: "
        "press and slide marched on a coarse mesh in few steps"
    )
    entry = _entry(estimate, how, **{**left_out["viscosity"]["from"], "slide_s": slide_s})
    return _with_left_out(prediction, {**left_out, "viscosity": entry}, start)


def _residual_overstress(prediction: Prediction) -> tuple[float, float] | None:
    """Return the overstress that remains once a `prediction`'s slide has settled, and the duration of the slide [s].

    The overstress is the surplus of the ending's SED, relative to the settled SED [-]. The skin of the prediction
    determines the length of the slide. None where the coarse mesh has no such load path. Raises Cancelled.
    """
    scene = relaxing_scene(prediction.scene.driven(prediction.indentation))
    if scene is None or not prediction.sed_ending > 0.0:
        return None
    kind, depth, direction = scene.solve.kinematics, scene.loading.depth, scene.loading.direction
    touching = prediction.mesh.skin[[state != "open" for state in prediction.skin.state]]
    slide = _sideways(prediction.displacement, touching) if direction else 0.0
    slide_s = _slide_duration(scene, slide)
    parts = (np.arange(1, _STEPS[kind] + 1) / _STEPS[kind]).tolist()
    points = [LoadPoint(PRESSING_TIME * part, depth * part, 0.0) for part in parts]
    if slide > 0.0:
        points += [LoadPoint(PRESSING_TIME + slide_s * part, depth, direction * slide * part) for part in parts]
    try:
        finger = cached_finger(KINDS[kind], scene.frictionless_press(depth), Sizing(_FINENESS, depth, margin=_MARGIN))
        state = rough_state(finger, scene) if isinstance(finger, FiniteFinger) else settled_state(scene, finger)
        at_last = finger.sed_ending(finger.displacement(state))
        path = undeformed_path(scene, finger, relaxing=True)
        for point in points:
            path.advance_to(point)
    except SolveFailure:
        return None
    return (abs(path.energies[-1][0] / at_last - 1.0), slide_s) if at_last > 0.0 else None
