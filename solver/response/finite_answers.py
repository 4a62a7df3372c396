"""Solve scenes at finite strain with error estimates, on successively finer meshes from coarser solutions."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from solver.accuracy import audits
from solver.accuracy.adaptivity import choose_steps, nested_numbers, steps_of_press
from solver.accuracy.convergence_order import refuse_folds
from solver.accuracy.error_estimate import NO_NESTED_STATE, Steps, edge_changes
from solver.arrays import Array
from solver.continuation.existence import is_folded, is_sound, limit_warnings, refuse_far_beyond
from solver.continuation.finite_states import rough_state, settled_state, slide_near
from solver.continuation.small_states import check_depth
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.load_path import end_of_path, march_scene
from solver.equilibrium.load_stepping import forces_of, sliding_load
from solver.equilibrium.relaxation import CondensedRelaxing
from solver.failures import WRINKLES, Folds, NoSteadyState, NotConverged, SolveFailure
from solver.mesh import Fineness, Lines
from solver.mesh.mesher import Sizing
from solver.prediction import COUNT, NestedNumbers, Prediction
from solver.progress import check_stop, report_progress
from solver.response import (
    FIRST_FINENESS,
    Answers,
    LoadingGroup,
    Meshing,
    Scenes,
    SceneSolution,
    Watch,
    complete_audits,
    prediction,
)
from solver.scene import Scene

NEAR_SLIDE = 0.98  # ratio of drag to friction limit from which contact lies where it lies in full slip
CONTACT_MARGIN = 3.0  # `Sizing.margin`: undeformed skin lower than 1.75 times the indentation may touch
WIDER = 6.0  # margin where contact reaches the end of that skin: 2.5 times the indentation


@dataclass(frozen=True, slots=True, eq=False)
class MeshSolution:
    """A settled state on the mesh made for it."""

    finger: FiniteFinger
    state: EquilibriumState
    setup_s: float  # meshes and tables [s]


class Meshes:
    """A cache of the meshes of one finger and of coarse solutions, for scenes with the same press and slide."""

    def __init__(self) -> None:
        self._fingers: dict[Sizing, FiniteFinger] = {}
        self._coarse: dict[tuple[Scene, Sizing], MeshSolution | SolveFailure] = {}
        self._last: MeshSolution | None = None

    def keep(self, fineness: Fineness) -> None:
        """Drop all meshes but the coarse one and those of this fineness."""
        self._fingers = {
            sizing: f for sizing, f in self._fingers.items() if sizing.fineness in (FIRST_FINENESS, fineness)
        }

    def finger(self, scene: Scene, sizing: Sizing) -> FiniteFinger:
        """Return the finger on a mesh. Raises SceneError where it cannot be meshed."""
        if sizing not in self._fingers:
            self._fingers[sizing] = FiniteFinger.of(scene, sizing)
        return self._fingers[sizing]

    def solve(self, scene: Scene, sizing: Sizing, settle: Callable[[FiniteFinger], EquilibriumState]) -> MeshSolution:
        """Return the state that `settle` finds on a mesh, and the time to set this up. Raises as `finger`, `settle`."""
        start = perf_counter()
        finger = self.finger(scene, sizing)
        setup = perf_counter() - start
        return MeshSolution(finger, settle(finger), setup)

    def coarse(self, scene: Scene, sizing: Sizing) -> MeshSolution:
        """Return a scene's solution on a coarse mesh, started from the last solution on it. Raises SolveFailure.

        It is the settled state, or full slip where a given drag is close to the friction limit.
        """
        solution = self._coarse.get((scene, sizing))
        if isinstance(solution, SolveFailure):
            raise solution
        if solution is not None:
            return replace(solution, setup_s=0.0)
        try:
            self._last = self.solve(scene, sizing, lambda finger: _on_coarse(finger, scene, self._last))
        except SolveFailure as failure:
            self._coarse[scene, sizing] = failure
            raise
        self._coarse[scene, sizing] = self._last
        return self._last


def coarse_solution(scene: Scene, guess: float, fineness: Fineness, meshes: Meshes) -> MeshSolution:
    """Return the settled state on a coarse mesh, from which solutions on finer meshes start.

    `guess` is the depth [mm], an estimate where forces are given. The friction limit differs a little between
    meshes, so that for a drag near it the solution is full slip. Where the coarse state is unsound, as near a limit, a
    mesh of `fineness` is solved directly. Raises NoSteadyState, NotConverged, Cancelled.
    """
    depth = guess if scene.normal_force is not None else scene.loading.depth
    sizing = Sizing(
        FIRST_FINENESS if isinstance(fineness, Lines) else min(FIRST_FINENESS, fineness), depth, margin=CONTACT_MARGIN
    )
    beyond_limit = False
    try:
        coarse = meshes.coarse(scene, sizing)
        if coarse.state.reaches_end:
            sizing = replace(sizing, margin=WIDER)
            coarse = meshes.coarse(scene, sizing)
        if is_sound(coarse.finger, coarse.state):
            return coarse
        beyond_limit = is_folded(coarse.finger, coarse.state)
    except NoSteadyState:
        if scene.normal_force is not None and not scene.loading.dragged:
            raise  # the limit comes from a mesh made for it, not from this one
    except NotConverged:
        beyond_limit = True
    except SolveFailure:
        pass
    if beyond_limit and scene.normal_force is None and scene.loading.direction != 0:
        refuse_far_beyond(scene, sliding_load(scene))
    sizing = replace(sizing, fineness=fineness)
    try:
        return _solve_uniform(scene, sizing, meshes)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return _solve_uniform(scene.without_drag(), sizing, meshes)


def _solve_uniform(scene: Scene, sizing: Sizing, meshes: Meshes) -> MeshSolution:
    solution = meshes.solve(scene, sizing, lambda finger: settled_state(finger, scene))
    if sizing.margin < WIDER and solution.state.reaches_end:
        return _solve_uniform(scene, replace(sizing, margin=WIDER), meshes)
    return solution


def _on_coarse(finger: FiniteFinger, scene: Scene, last: MeshSolution | None) -> EquilibriumState:
    """Return the state on the coarse mesh, or full slip where a given drag is close to the friction limit there.

    The search begins at the `last` solution, where it has this mesh.
    """
    near = last.state if last is not None and last.finger is finger else None
    drag = scene.tangential_force
    if drag is None:
        return rough_state(finger, scene, near)
    try:
        slide = rough_state(finger, scene.without_drag(), near)
    except SolveFailure:
        return march_scene(scene, finger).last  # the drag may be reached before sliding would fold the skin
    return slide if drag >= NEAR_SLIDE * abs(slide.force[0]) else march_scene(scene, finger).last


def refine(scene: Scene, fineness: Fineness, coarse: MeshSolution, meshes: Meshes) -> tuple[MeshSolution, Steps | None]:
    """Return the settled state, refined from the scene's `coarse` solution, and its load steps if it depends on them.

    Raises as `solution_on`.
    """
    steps = choose_steps(scene, coarse.finger, coarse.state)
    sizing = replace(coarse.finger.geometry.sizing, fineness=fineness)
    step_factor = 1 if steps is None else steps.factor
    top = solution_on(scene, sizing, coarse, meshes, step_factor)
    if sizing.margin < WIDER and top.state.reaches_end:
        top = solution_on(scene, replace(sizing, margin=WIDER), coarse, meshes, step_factor)
    return top, steps


def solution_on(
    scene: Scene, sizing: Sizing, below: MeshSolution, meshes: Meshes, step_factor: int = 1
) -> MeshSolution:
    """Return the settled state on a mesh of `sizing`, started from the coarser solution `below`.

    A load path takes `step_factor` times the usual steps. Raises NoSteadyState, NotConverged, Cancelled.
    """

    def settle(finger: FiniteFinger) -> EquilibriumState:
        start = below.state if finger is below.finger else finger.transfer(below.state, below.finger)
        return settled_state(finger, scene, start, step_factor)

    return meshes.solve(scene, sizing, settle)


def solve_nested(
    scene: Scene,
    top: MeshSolution,
    last: EquilibriumState,
    numbers: Array,
    changes: Array,
    steps: Steps | None,
    meshes: Meshes,
) -> tuple[NestedNumbers | NotConverged, Steps | None]:
    """Return the results of a scene on the nested mesh of `top`, or the reason for no estimate, and its load steps.

    `last` is the scene's state on the mesh of `top`, `numbers` (COUNT,) are its results, and `changes` (m, COUNT + r)
    come from `edge_changes` there. `steps` are the load steps taken where the state depends on its load path. Raises
    Cancelled.
    """
    if not top.finger.newton.is_stable(top.state):
        return Folds(WRINKLES), steps
    finger = meshes.finger(scene, replace(top.finger.geometry.sizing, halved=True))
    start = finger.transfer(top.state, top.finger)
    try:
        if top.state.load.path_dependent:
            if steps is None:  # the coarse mesh had full slip
                choice = choose_steps(scene, top.finger, top.state)
                steps = None if choice is None else replace(choice, factor=1)
            state = end_of_path(scene, finger)
        else:
            steps = None
            state = slide_near(finger, scene, start) or settled_state(finger, scene, start)
        refuse_folds(finger, state)
    except Folds as failure:
        return failure, steps
    except SolveFailure:
        return NO_NESTED_STATE, steps
    forces = None if scene.viscoelastic else forces_of(scene, state.load)
    values, nested_changes = edge_changes(finger.newton, state, forces, finger.numbers_and_row)
    answer, nested, moves = (top.finger, last), (finger, state), (changes, nested_changes)
    return nested_numbers(scene, numbers, answer, nested, values, moves, steps), steps


FINITE_IMBALANCE = 1e-8  # relative residual of the forces from which a state is corrected further [-]


class FiniteMeshing(Meshing):
    """Finite strain: each scene starts on a coarse mesh and is refined on a mesh made for its contact.

    Scenes with the same press and slide share meshes. They are solved by rising friction, each from the previous one.
    """

    def __init__(self, scenes: Scenes) -> None:
        super().__init__(scenes)
        self._meshes: dict[LoadingGroup, Meshes] = {}

    def answers(
        self,
        scenes: Scenes,
        fineness: Fineness,
        watch: Watch | None = None,  # noqa: ARG002 - for small strain
    ) -> Answers:
        """Return the prediction or the failure of each scene on meshes of a `fineness`. Raises as `Meshing`."""
        answers: Answers = {}
        for number, scene in sorted(scenes.items(), key=lambda entry: solution_order(entry[1])):
            check_stop(len(answers) / len(scenes))
            start = perf_counter()
            report_progress("solving on a finer mesh" if isinstance(fineness, Lines) else "solving on a mesh")
            meshes = self._meshes.setdefault(scene.loading_group, Meshes())
            meshes.keep(fineness)
            try:
                coarse = coarse_solution(scene, self.deepest[scene.loading_group], fineness, meshes)
                answers[number] = _predict(scene, fineness, coarse, meshes, start)
            except SolveFailure as failure:
                answers[number] = failure
        return {number: answers[number] for number in scenes}


def solution_order(scene: Scene) -> tuple[LoadingGroup, float]:
    """Return a key that sorts scenes by their loading, then by friction, so that neighbours are similar."""
    return scene.loading_group, float(scene.friction.mu)


def _predict(scene: Scene, fineness: Fineness, coarse: MeshSolution, meshes: Meshes, start: float) -> Prediction:
    """Return the prediction of a scene from its `coarse` solution; its work began at `start` [s].

    Raises SolveFailure, Cancelled.
    """
    top, steps = refine(scene, fineness, coarse, meshes)
    finger, state, path = top.finger, top.state, None
    setup = coarse.setup_s + top.setup_s
    if scene.solve.course == "history":
        step_factor = steps_of_press(scene, coarse.finger) if steps is None else steps.factor
        for slide in scene.earlier_slides():  # one that never settles is refused with its limits
            settled_state(finger, slide)
        path = march_scene(scene, finger, step_factor, relaxing=scene.materials.relax)
        state = path.last
    if not state.touching.any():
        raise NotConverged(f"No contact was found at {state.load.depth:g} mm of indentation: ask for more depth.")
    check_depth(scene, state.load.depth)
    newton = finger.newton if path is None else path.newton
    # Under a light touch, displacement errors far below a nanometre leave a large part of the forces unbalanced.
    checks = _audits(finger, newton, state)
    correct = partial(_correct, finger, newton)
    state, checks = audits.balance(state, checks, FINITE_IMBALANCE, correct)
    solution = SceneSolution(scene, state, state.u, checks, steps, path)
    complete_audits(finger, solution, newton, lambda: finger.sed_ending(top.state.u))
    solved_at = perf_counter()
    report_progress("estimating errors, on the nested mesh")
    forces = None if scene.viscoelastic else forces_of(scene, state.load)
    values, changes = edge_changes(finger.newton, state, forces, finger.numbers_and_row)
    numbers, row = np.split(values, [COUNT])
    on_nested, steps = solve_nested(scene, top, state, numbers, changes, steps, meshes)
    estimate_s = perf_counter() - solved_at
    wall = solved_at - start - setup
    solution = replace(solution, steps=steps, warnings=limit_warnings(finger, state), wall_s=wall, setup_s=setup)
    return prediction(solution, finger, numbers, row, on_nested, estimate_s)


def _correct(
    finger: FiniteFinger, newton: Newton, state: EquilibriumState, checks: dict[str, float]
) -> tuple[EquilibriumState, dict[str, float]] | None:
    """Return a state and its audits after one more Newton step, None where that increases contradictions of contact.

    `newton` belongs to the finger, or to its relaxing tissues; `checks` are the audits of `state`.
    """
    x = state.skin_positions(newton.condensed)[:, 0]
    if not newton.linearise(state, x):
        return None
    corrected = newton.correct(state, lambda _load: x)[0]
    corrected = replace(corrected, state=state.state, sense=state.sense)  # nanometres change no contact state
    corrected_checks = _audits(finger, newton, corrected)
    worse = _contradicting(corrected_checks) > max(_contradicting(checks), FINITE_IMBALANCE)
    return None if worse else (corrected, corrected_checks)


def _audits(finger: FiniteFinger, newton: Newton, state: EquilibriumState) -> dict[str, float]:
    body = newton.condensed
    over: Array | None = (
        finger.body.mesh.assemble(body.excess(state.u)) if isinstance(body, CondensedRelaxing) else None
    )
    return audits.audits(finger, state, state.u, over)


def _contradicting(checks: dict[str, float]) -> float:
    return max(checks[name] for name in ("penetration", "tension", "cone_violation"))
