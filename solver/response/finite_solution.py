"""From scenes at finite strain to predictions, each on a mesh made for its contact, and an error estimate with each.

Settled sliding is found directly and refused where it does not exist (`existence`); the course is marched, and
where tissues relax, in time (`solver.equilibrium.finite_relaxation`).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import groupby
from time import perf_counter

import numpy as np

from solver import _kernels as kernels
from solver._kernels import STICK
from solver.accuracy import omitted_effects as evidence
from solver.accuracy.adaptivity import Maker, MeshSolution, NestedSolution, coarse_solution, on_nested, refine
from solver.accuracy.audits import forces_missed, refuse_unsound, rounding, unbalanced
from solver.accuracy.error_estimate import errors, responses, row_errors
from solver.accuracy.finite_audits import audits, course_audits
from solver.accuracy.finite_ends import times_on_way
from solver.contact.law import NAMES
from solver.continuation.existence import doubts
from solver.continuation.finite_states import course
from solver.equilibrium.expected_depth import within_reach
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.finite_relaxation import RelaxingCourse
from solver.equilibrium.load_path import Way
from solver.equilibrium.newton import EQUILIBRIUM, EquilibriumState, FiniteNewton
from solver.failures import Cancelled, NotConverged, SolveFailure
from solver.mesh.mesher import Sizing
from solver.prediction import FORCES_AND_PLACES, ROW, History, Prediction, Row, Skin, drag, sed_alone
from solver.progress import report_progress
from solver.scene import Scene

ROUGH = 1e-8  # unbalanced part of the forces from which displacements are corrected further [-]
CORRECTIONS = 4  # at most

Answer = Prediction | SolveFailure
Progress = Callable[[float], bool]


def answers(
    scenes: Sequence[Scene], expected: float, fineness: float, progress: Progress | None = None
) -> list[Answer]:
    """Return the predictions of scenes, or why there is none, on meshes of that fineness.

    Those pressed alike and moved the same way share one mesh and are solved one after the other, friction rising, each
    begun at the one before. `expected` is the depth [mm] that they reach, or about it where forces are given. Raises
    SceneError where the finger cannot be meshed, Cancelled where `progress` (told the part done) says so.
    """
    found: dict[int, Answer] = {}

    def stop() -> bool:
        return progress is not None and not progress(len(found) / len(scenes))

    keys = [alike(scene) for scene in scenes]
    for _, group in groupby(sorted(range(len(scenes)), key=lambda n: keys[n]), lambda n: keys[n][0]):
        meshes: dict[Sizing, FiniteFinger] = {}

        def make(scene: Scene, sizing: Sizing, meshes: dict[Sizing, FiniteFinger] = meshes) -> FiniteFinger:
            if sizing not in meshes:
                meshes[sizing] = FiniteFinger.of(scene, sizing)
            return meshes[sizing]

        low: MeshSolution | None = None
        for number in group:
            if stop():
                raise Cancelled
            begun, scene = perf_counter(), scenes[number]
            report_progress(f"solving on a mesh of {fineness:g} elements to the tip radius")
            try:
                low = coarse_solution(scene, expected, fineness, stop, make, low)
                found[number] = _predicted(scene, refine(scene, fineness, low, stop, make), stop, make, begun)
            except SolveFailure as failure:
                found[number] = failure
    return [found[number] for number in range(len(scenes))]


def alike(scene: Scene) -> tuple[tuple[float, float, str], float]:
    """Return what scenes are sorted by, so that neighbours are alike: how they are pressed, then their friction."""
    return scene.pressed, float(scene.friction.mu)


def _predicted(scene: Scene, nested: NestedSolution, stop: Callable[[], bool], make: Maker, begun: float) -> Prediction:
    at = nested.top
    finger, shape = at.finger, at.shape
    setup = nested.coarse.setup_s + at.setup_s
    steps = nested.steps
    times = times_on_way(scene, nested.coarse.finger, stop) if steps is None else steps.times
    way: Way | None = None
    relaxing: RelaxingCourse | None = None
    if scene.solve.course == "history":
        relaxing = RelaxingCourse(scene, finger, stop, times=times) if scene.materials.relax else None
        way = relaxing or course(scene, finger, stop, times)
        shape = way.last
    if not shape.touching.any():
        raise NotConverged(f"No contact was found at {shape.pull.depth:g} mm of indentation: ask for more depth.")
    within_reach(scene, shape.pull.depth)
    driven = scene.driven(shape.pull.depth)
    body = finger.newton.body
    newton = finger.newton if relaxing is None else relaxing.relaxing
    shape, checks = _balanced(newton, shape, lambda found: audits(driven, finger, found, newton))
    refuse_unsound(checks, shape.pull.depth)
    numbers = finger.all_numbers([shape])[0]
    sed, normal, tangential, depth, shift, width, point = numbers[:FORCES_AND_PLACES].tolist()
    skin = _skin(finger, shape)
    checks |= forces_missed(scene, float(shape.force[1]), float(shape.force[0]))
    if way:
        checks |= course_audits(newton, way.states)
    if way and (relaxing is None or _sticking(shape) == 0.0):  # stuck and relaxing, the end depends on the way
        checks["course_against_direct"] = abs(finger.sed_ending(at.shape) / sed - 1.0)
    held = scene.loading.dragged and _sticking(shape) > 0.0  # sliding, a finger may have shifted by anything
    solved = perf_counter()
    report_progress("estimating errors, on the nested mesh")
    finer, steps = on_nested(scene, at, steps, stop, make)
    off = errors(scene, numbers, finer, steps)
    row = finger.row.average(body, shape.u)
    estimated = perf_counter()
    model = evidence.finite_model(
        driven, force=shape.force, width=width, sticking=_sticking(shape), slide=_slide(finger, shape)
    )
    return Prediction(
        scene=scene,
        sed_ending=sed,
        sed_point=point,
        normal_force=normal,
        tangential_force=drag(scene, tangential),
        contact_width=width,
        indentation=depth,
        shift=shift if held else None,
        error_estimate=off.sed,
        normal_force_error=off.normal,
        tangential_force_error=off.tangential,
        indentation_error=off.indentation,
        shift_error=off.shift if held else None,
        contact_width_error=off.width,
        nested=finer,
        sed_point_error=off.point,
        dofs=body.dofs,
        newton_iterations=shape.iterations,
        wall_s=solved - begun - setup,
        setup_s=setup,
        estimate_s=estimated - solved,
        row=Row(ROW, row, row_errors(row, finer)),
        responses=responses(numbers, off),
        model=model,
        audits=checks,
        skin=skin,
        geometry=finger.geometry,
        displacement=shape.u,
        history=_history(scene, finger, way, relaxing) if way else None,
        warnings=(*evidence.warnings(driven, model["left_out"]), *doubts(finger, shape, stop), *rounding(checks)),
    )


def _sticking(shape: EquilibriumState) -> float:
    touching = int(shape.touching.sum())
    return int((shape.state == STICK).sum()) / touching if touching else 0.0


def _slide(finger: FiniteFinger, shape: EquilibriumState) -> float:
    """Return the largest sideways displacement of the skin that may touch [mm]."""
    return float(np.abs(shape.u[finger.geometry.mesh.skin, 0]).max())


def _skin(finger: FiniteFinger, shape: EquilibriumState) -> Skin:
    body = finger.newton.body
    place, touching, length = shape.place(body), shape.touching, np.empty(len(shape.state))
    kernels.tributary(np.ascontiguousarray(place[:, 0]), body.middle, length)
    length = np.where(touching, length, 1.0)
    return Skin(
        x=place[:, 0],
        gap=np.where(touching, 0.0, place[:, 1] - shape.pull.depth),
        pressure=shape.reaction[:, 1] / length,
        traction=shape.reaction[:, 0] / length,
        state=tuple(NAMES[int(state)] for state in shape.state),
    )


def _balanced(
    newton: FiniteNewton, shape: EquilibriumState, audits: Callable[[EquilibriumState], dict[str, float]]
) -> tuple[EquilibriumState, dict[str, float]]:
    """Return a state and its checks, its displacements so good that no force is left over but by round-off.

    Displacements good to a part of a nanometre leave much of a light touch on a nearly incompressible body unbalanced.
    """
    checks = audits(shape)
    for _ in range(CORRECTIONS):
        if unbalanced(checks) <= ROUGH:
            break
        x = shape.place(newton.body)[:, 0]
        if not newton.linearise(shape, shape.pull, x):
            break
        after, _, _ = newton.moved(shape, shape.pull, newton.steps[:, EQUILIBRIUM].copy(), x)
        after = replace(after, state=shape.state, sense=shape.sense)  # a step of nanometres turns no slip into stick
        better = audits(after)
        if _contradicting(better) > max(_contradicting(checks), ROUGH) or unbalanced(better) >= unbalanced(checks):
            break
        shape, checks = after, better
    return shape, checks


def _contradicting(checks: dict[str, float]) -> float:
    return max(checks[name] for name in ("penetration", "tension", "cone_violation"))


def _history(scene: Scene, finger: FiniteFinger, way: Way, relaxing: RelaxingCourse | None) -> History:
    states = way.states
    if relaxing is None:
        point = [float(finger.point.average(finger.newton.body, shape.u)[0]) for shape in states]
        sed = np.stack([[finger.sed_ending(shape) for shape in states], point], axis=1)
    else:
        sed = np.array(relaxing.sed)
    return History(
        time=np.array([instant.time for instant in way.instants[1:]]),
        bone_x=np.array([-shape.pull.travel for shape in states]),
        bone_y=np.array([-shape.pull.depth for shape in states]),
        sed_ending=sed[:, 0],
        sed_point=sed[:, 1],
        normal_force=np.array([float(shape.force[1]) for shape in states]),
        tangential_force=np.array([drag(scene, float(shape.force[0])) for shape in states]),
        contact_width=np.array([finger.contact_width(shape) for shape in states]),
        slipping=np.array([1.0 - _sticking(shape) if shape.touching.any() else 0.0 for shape in states]),
        responses=finger.responses_of(states) if relaxing is None else sed_alone(sed[:, 0]),
    )
