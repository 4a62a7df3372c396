"""From scenes at small strain to predictions: one mesh for all that share a finger, an error estimate with each.

Settled sliding is found directly and refused where it does not exist (`continuation.small_states`); the course is
marched, and where tissues relax, in time (`solver.equilibrium.relaxation`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from solver._kernels.compiling import STICK
from solver.accuracy.audits import (
    audits,
    course_audits,
    forces_missed,
    inside_out,
    refuse_beyond_finger,
    refuse_unsound,
    unbalanced,
)
from solver.accuracy.error_estimate import Steps, edge_changes, nested_numbers, times_on_way
from solver.arrays import Array
from solver.continuation.small_states import (
    WIDE,
    depends_on_way,
    direct,
    end,
    gives_way,
    in_tissue,
    marched,
    nearest,
    refined,
)
from solver.equilibrium.finger import LinearFinger, forces_of
from solver.equilibrium.load_path import Instant
from solver.equilibrium.newton import EquilibriumState
from solver.failures import NotConverged, SolveFailure
from solver.mesh.mesher import Sizing
from solver.prediction import COUNT, FORCES_AND_PLACES, NestedNumbers, Prediction
from solver.progress import Progress, report_part
from solver.response.answer import Solved, history, prediction
from solver.scene.scene import Scene

ROUGH = 1e-10  # unbalanced part of the forces from which round-off is taken out of the displacements once more

YIELDS = (
    "The drag lifts the bone: pressed a little harder, the finger would slide at a smaller depth. Under a weight, that "
    "follows it down, this slide would not last; held at this depth, the finger slides under less force."
)

BEYOND_THE_SKIN = NotConverged(
    "The drag lays more skin on the surface than the finger's palmar side has, where contact is looked for: ask "
    "for less friction, drag or depth."
)

Answer = Prediction | SolveFailure
Way = tuple[Instant, ...]
Watch = Callable[[int, Answer, LinearFinger, Way | None], None]  # called with each answer as it is found, and how


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """What scenes solved together share."""

    mesh: LinearFinger
    nested: Callable[[], LinearFinger]  # made when first asked for
    setup_s: float
    count: int  # of scenes


class Fingers:
    """Makes the fingers of one group of scenes, each mesh once; those of the last fineness asked for are kept."""

    def __init__(self, scene: Scene) -> None:
        """Make none yet."""
        self._scene = scene
        self._fineness = 0.0
        self._made: dict[Sizing, tuple[LinearFinger, float]] = {}

    def begin(self, fineness: float) -> None:
        """Forget those of another fineness."""
        if fineness != self._fineness:
            self._made.clear()
        self._fineness = fineness

    def of(self, sizing: Sizing) -> tuple[LinearFinger, float]:
        """Return the finger, and what it took to make [s]. Raises SceneError, NotConverged."""
        if sizing not in self._made:
            begun = perf_counter()
            finger = LinearFinger.of(self._scene, sizing)
            self._made[sizing] = finger, perf_counter() - begun
        return self._made[sizing]


def answers(
    scenes: list[Scene], depth: float, fineness: float, progress: Progress | None, watch: Watch | None, fingers: Fingers
) -> list[Answer]:
    """Solve all scenes on one mesh, and on its nested one for the estimate; look wider where contact reaches out."""
    fingers.begin(fineness)
    most = max(depth, min(WIDE * depth, scenes[0].finger.pulp_thickness()))  # for drags that lay much skin on
    for sizing in (Sizing(fineness, depth, margin=WIDE), last := Sizing(fineness, most, margin=WIDE)):
        try:
            mesh, took = fingers.of(sizing)
            shared = _Shared(mesh, partial(_nested, fingers, sizing), took - mesh.solve_s, len(scenes))
            done = _on_mesh(scenes, shared, progress, watch, all_of_them=sizing is last)
        except NotConverged as failure:
            return [failure] * len(scenes)
        if done is not None:
            return done
    raise AssertionError  # the last mesh answers all


def _nested(fingers: Fingers, sizing: Sizing) -> LinearFinger:
    return fingers.of(replace(sizing, halved=True))[0]


def _on_mesh(
    scenes: list[Scene], shared: _Shared, progress: Progress | None, watch: Watch | None, *, all_of_them: bool
) -> list[Answer] | None:
    """Return the answers on one mesh; None where contact must be looked for on more of the skin than this.

    Of settled slides the steepest, whose contact reaches farthest, comes first. Where `all_of_them` must be answered,
    what reaches out nevertheless has no answer. Raises NotConverged where a mesh does not stand for a body.
    """
    done: dict[int, Answer] = {}
    # Settled slides take milliseconds and are estimated together; a course is watched as soon as it is marched.
    every = range(len(scenes))
    steepest_first = sorted(every, key=lambda number: -float(scenes[number].friction.mu))
    marched = any(scene.solve.course == "history" for scene in scenes)
    for batch in [[number] for number in every] if marched else [steepest_first]:
        states: list[tuple[Solved, Way | None] | SolveFailure] = []
        for number in batch:
            position = len(done) + len(states)
            report_part(progress, position / len(scenes))
            try:
                state = _solved(scenes[number], shared, _of_all(progress, position, len(scenes)))
            except SolveFailure as failure:
                state = failure
            if state is None and not all_of_them:
                return None
            states.append(BEYOND_THE_SKIN if state is None else state)
        for number, (answer, way) in zip(batch, _estimated(states, shared), strict=True):
            if watch is not None and answer is not BEYOND_THE_SKIN:
                watch(number, answer.in_a_sentence() if isinstance(answer, SolveFailure) else answer, shared.mesh, way)
            done[number] = answer
    return [done[number] for number in range(len(scenes))]


def _of_all(progress: Progress | None, number: int, count: int) -> Progress | None:
    """Return `progress` for one of `count` scenes."""
    return None if progress is None else lambda part: progress((number + part) / count)


def _in_steps(scene: Scene, mesh: LinearFinger) -> tuple[EquilibriumState, Steps | None]:
    """Return the settled state as `direct` does, and the load steps it took where it depends on its way.

    Where the course is asked for, an earlier slide that never settles is refused as the last one is, with its limits.
    """
    for leg in scene.earlier_slides() if scene.solve.course == "history" else ():
        direct(leg, mesh)
    contact = direct(scene, mesh)
    if not depends_on_way(scene, contact):
        return contact, None
    steps = steps_asked(scene, mesh)
    return (contact if steps.times == 1 else direct(scene, mesh, steps.times)), steps


def _solved(scene: Scene, shared: _Shared, progress: Progress | None) -> tuple[Solved, Way | None] | None:
    """Return the state of one scene, and its way where that can be drawn from forces alone.

    None where contact must be looked for on more of the skin. Raises SolveFailure.
    """
    finger = shared.mesh
    begun = perf_counter()
    contact, steps = _in_steps(scene, finger)
    times = times_on_way(scene, lambda press: steps_asked(press, finger)) if steps is None else steps.times
    way: Way | None = None
    over_time: Array | None = None
    settled = contact
    if scene.solve.course == "history":
        way, over_time = marched(scene, finger, progress, times)
        contact = way[-1].state
        if over_time is not None:
            contact = replace(contact, u=finger.body.condensed.held_by(contact.reaction))
    displacement = finger.displacement(contact)
    depth = contact.load.depth
    in_tissue(scene, finger, depth)
    if finger.reaches_out(contact, displacement, depth):
        return None
    free = way is None and scene.normal_force is None and not (contact.state == STICK).any()
    relaxed = over_time is not None
    contact, displacement, checks = _balanced(
        scene, finger, contact, displacement, at_once=free, where_seen=not relaxed
    )
    sed = finger.sed_ending(displacement)
    refuse_unsound(checks, depth)
    refuse_beyond_finger(finger, contact, displacement)
    checks |= forces_missed(scene, float(contact.normal.sum()), float(contact.tangential.sum()))
    if way is not None:
        checks |= course_audits(finger.newton, [instant.state for instant in way], relaxing=relaxed)
        if over_time is None or not (contact.state == STICK).any():  # stuck and relaxing, the end depends on the way
            checks["course_against_direct"] = abs(finger.sed_ending(finger.displacement(settled)) / sed - 1.0)
    warnings = tuple(filter(None, [inside_out(checks), YIELDS if gives_way(scene, finger, contact) else ""]))
    course = None if way is None else history(scene, finger, way, over_time)
    took = perf_counter() - begun + finger.solve_s / shared.count
    solved = Solved(scene, contact, displacement, checks, steps, course, warnings, took, shared.setup_s)
    return solved, way if over_time is None else None


def _estimated(
    states: Sequence[tuple[Solved, Way | None] | SolveFailure], shared: _Shared
) -> list[tuple[Answer, Way | None]]:
    """Return the prediction of each state that was solved, and its way where that can be drawn from forces alone."""
    solved = [one[0] for one in states if isinstance(one, tuple)]
    if not solved:
        return [(one, None) for one in states if not isinstance(one, tuple)]
    begun, finger = perf_counter(), shared.mesh
    numbers = finger.all_numbers([one.state for one in solved])
    displacements = np.stack([one.displacement for one in solved], axis=2)
    numbers[:, FORCES_AND_PLACES:] = finger.ending.responses(displacements)[:, 0].T
    numbers[:, 0] = numbers[:, FORCES_AND_PLACES]
    rows = finger.row.average(displacements)
    nested = on_nested(shared.nested(), [(one.scene, one.steps) for one in solved])
    took = (perf_counter() - begun) / len(solved)
    made = (
        prediction(one, finger, numbers[number], rows[:, number], nested[number], took)
        for number, one in enumerate(solved)
    )
    return [(next(made), one[1]) if isinstance(one, tuple) else (one, None) for one in states]


def _balanced(
    scene: Scene, finger: LinearFinger, state: EquilibriumState, displacement: Array, *, at_once: bool, where_seen: bool
) -> tuple[EquilibriumState, Array, dict[str, float]]:
    """Return a state, its displacement and their audits with less round-off, taken out `at_once` or where it shows."""
    if at_once:
        state, displacement = refined(scene, finger, state, displacement)
    checks = audits(finger, state, displacement)
    if where_seen and unbalanced(checks) > ROUGH:
        state, displacement = refined(scene, finger, state, displacement)
        checks = audits(finger, state, displacement)
    return state, displacement, checks


def steps_asked(scene: Scene, finger: LinearFinger) -> Steps:
    """Return the load steps that a scene asks for whose end depends on its way, judged on a mesh."""
    try:
        return Steps.asked(lambda times: end(scene, finger, times), finger.all_numbers, scene.solve.tolerance)
    except SolveFailure:
        return Steps(1, np.zeros(COUNT), np.zeros(COUNT))  # nor will there be an estimate


def on_nested(mesh: LinearFinger, asked: Sequence[tuple[Scene, Steps | None]]) -> list[NestedNumbers | None]:
    """Return the numbers of scenes on the nested `mesh`, None where one has no state there.

    Each comes with the load steps that it takes where its state depends on its way. Numbers of all are made at once.
    """
    states = [_nested_state(scene, mesh, steps) for scene, steps in asked]
    held = [number for number, state in enumerate(states) if state is not None]
    out: list[NestedNumbers | None] = [None] * len(asked)
    known = [state for state in states if state is not None]
    if not known:
        return out
    forced = [(state, forces_of(asked[n][0], state.load)) for n, state in zip(held, known, strict=True)]
    for number, values, changes in zip(held, *edge_changes(mesh.newton, forced, mesh.numbers_and_row), strict=True):
        out[number] = nested_numbers(values, changes, asked[number][1])
    return out


def _nested_state(scene: Scene, mesh: LinearFinger, steps: Steps | None) -> EquilibriumState | None:
    try:
        return nearest(scene, mesh) if steps is None else end(scene, mesh)
    except SolveFailure:
        return None
