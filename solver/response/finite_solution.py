"""From scenes at finite strain to predictions, each on a mesh made for its contact, and an error estimate with each.

Settled sliding is found directly and refused where it does not exist (`existence`); the course is marched, and
where tissues relax, in time (`solver.equilibrium.relaxation`).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from solver.accuracy.adaptivity import Meshes, NestedSolution, coarse_solution, on_nested, refine, steps_asked
from solver.accuracy.audits import audits, course_audits, forces_missed, refuse_unsound, unbalanced
from solver.accuracy.error_estimate import times_on_way
from solver.continuation.existence import doubts
from solver.continuation.finite_states import course
from solver.equilibrium.expected_depth import within_reach
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.load_path import RelaxingWay, Way, march
from solver.equilibrium.newton import EQUILIBRIUM, EquilibriumState, Newton
from solver.equilibrium.relaxation import CondensedRelaxing
from solver.failures import NotConverged, SolveFailure
from solver.prediction import Prediction
from solver.progress import Cancelled, Progress, report_progress
from solver.response.answer import Solved, history, prediction
from solver.scene.scene import Scene

ROUGH = 1e-8  # unbalanced part of the forces from which displacements are corrected further [-]
CORRECTIONS = 4  # at most

Answer = Prediction | SolveFailure
Pressed = tuple[float, float, str]  # how deep or hard, and which way: `Scene.pressed`


def answers(
    scenes: Sequence[Scene], expected: float, fineness: float, progress: Progress | None, kept: dict[Pressed, Meshes]
) -> list[Answer]:
    """Return the predictions of scenes, or why there is none, on meshes of that fineness.

    Those pressed alike and moved the same way share one mesh and are solved one after the other, friction rising, each
    begun at the one before. `expected` is the depth [mm] that they reach, or about it where forces are given. Coarse
    meshes and their states are `kept` for the next fineness. Raises SceneError where the finger cannot be meshed,
    Cancelled where `progress` (given the part done) says so.
    """
    found: dict[int, Answer] = {}

    def stop() -> bool:
        return progress is not None and not progress(len(found) / len(scenes))

    for number in sorted(range(len(scenes)), key=lambda n: alike(scenes[n])):
        if stop():
            raise Cancelled
        begun, scene = perf_counter(), scenes[number]
        report_progress(f"solving on a mesh of {fineness:g} elements to the tip radius")
        meshes = kept.setdefault(scene.pressed, Meshes())
        meshes.keep(fineness)
        try:
            low = coarse_solution(scene, expected, fineness, stop, meshes)
            found[number] = _predicted(scene, refine(scene, fineness, low, stop, meshes), stop, meshes, begun)
        except SolveFailure as failure:
            found[number] = failure
    return [found[number] for number in range(len(scenes))]


def alike(scene: Scene) -> tuple[Pressed, float]:
    """Return what scenes are sorted by, so that neighbours are alike: how they are pressed, then their friction."""
    return scene.pressed, float(scene.friction.mu)


def _predicted(
    scene: Scene, nested: NestedSolution, stop: Callable[[], bool], meshes: Meshes, begun: float
) -> Prediction:
    at = nested.top
    finger, shape = at.finger, at.shape
    setup = nested.coarse.setup_s + at.setup_s
    steps = nested.steps
    coarse = nested.coarse.finger
    times = times_on_way(scene, lambda press: steps_asked(press, coarse, stop)) if steps is None else steps.times
    way: Way | None = None
    relaxing: RelaxingWay | None = None
    if scene.solve.course == "history":
        if scene.materials.relax:
            way = march(scene, finger, times, relaxing=True, stop=stop)
            relaxing = way if isinstance(way, RelaxingWay) else None
        else:
            way = course(scene, finger, stop, times)
        shape = way.last
    if not shape.touching.any():
        raise NotConverged(f"No contact was found at {shape.load.depth:g} mm of indentation: ask for more depth.")
    within_reach(scene, shape.load.depth)
    newton = finger.newton if relaxing is None else relaxing.newton
    shape, checks = _balanced(finger, newton, shape)
    refuse_unsound(checks, shape.load.depth)
    checks |= forces_missed(scene, float(shape.force[1]), float(shape.force[0]))
    numbers = finger.all_numbers([shape])[0]
    if way:
        states = [instant.state for instant in way.instants]
        checks |= course_audits(newton, states, relaxing=relaxing is not None)
    if way and (relaxing is None or shape.sticking == 0.0):  # stuck and relaxing, the end depends on the way
        checks["course_against_direct"] = abs(finger.sed_ending(at.shape.u) / numbers[0] - 1.0)
    over_time = None if relaxing is None else np.array(relaxing.energies)
    marched = history(scene, finger, way.instants[1:], over_time) if way else None
    solved = perf_counter()
    report_progress("estimating errors, on the nested mesh")
    finer, steps = on_nested(scene, at, steps, stop, meshes)
    row = finger.row.average(shape.u)
    took = perf_counter() - solved
    done = Solved(
        scene, shape, shape.u, checks, steps, marched, doubts(finger, shape, stop), solved - begun - setup, setup
    )
    return prediction(done, finger, numbers, row, finer, took)


def _balanced(
    finger: FiniteFinger, newton: Newton, shape: EquilibriumState
) -> tuple[EquilibriumState, dict[str, float]]:
    """Return a state and its checks, its displacements so good that no force is left over but by round-off.

    `newton` is the finger's own, or that of its tissues as they relax. Displacements good to a part of a nanometre
    leave much of a light touch on a nearly incompressible body unbalanced.
    """
    checks = _audits(finger, newton, shape)
    for _ in range(CORRECTIONS):
        if unbalanced(checks) <= ROUGH:
            break
        x = shape.place(newton.condensed)[:, 0]
        if not newton.linearise(shape, shape.load, x):
            break
        after, _, _ = newton.moved(shape, shape.load, newton.steps[:, EQUILIBRIUM].copy(), x)
        after = replace(after, state=shape.state, sense=shape.sense)  # a step of nanometres turns no slip into stick
        better = _audits(finger, newton, after)
        if _contradicting(better) > max(_contradicting(checks), ROUGH) or unbalanced(better) >= unbalanced(checks):
            break
        shape, checks = after, better
    return shape, checks


def _audits(finger: FiniteFinger, newton: Newton, shape: EquilibriumState) -> dict[str, float]:
    body = newton.condensed
    over = finger.body.nodal(body.excess(shape.u)) if isinstance(body, CondensedRelaxing) else None
    return audits(finger, shape, shape.u, over)


def _contradicting(checks: dict[str, float]) -> float:
    return max(checks[name] for name in ("penetration", "tension", "cone_violation"))
