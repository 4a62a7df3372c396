"""Solve scenes of one finger at small strain on a shared mesh, each with an error estimate.

Settled sliding is solved directly, and refused where it does not exist. A load path is marched step by step, in time
where tissues relax (`solver.equilibrium.relaxation`).
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from time import perf_counter

import numpy as np

from solver.accuracy import audits
from solver.accuracy.adaptivity import choose_steps, nested_numbers, steps_of_press
from solver.accuracy.error_estimate import NO_NESTED_STATE, Steps, edge_changes_of_all
from solver.arrays import Array
from solver.continuation.small_states import (
    WIDE_MARGIN,
    is_unstable_under_force,
    nearest_state,
    refuse_beyond_tissue,
    remove_round_off,
    state_on_branch,
)
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import end_of_path, march_scene
from solver.equilibrium.load_stepping import forces_of
from solver.failures import NotConverged, SolveFailure
from solver.mesh import Fineness
from solver.mesh.mesher import Sizing
from solver.prediction import COUNT, FORCES_AND_PLACES, NestedNumbers, Prediction
from solver.progress import check_stop
from solver.response import Answers, Meshing, Scenes, SceneSolution, Watch, complete_audits, prediction
from solver.scene import Scene

SMALL_IMBALANCE = 1e-10  # relative residual of the forces from which a state is refined [-]

UNSTABLE = (
    "The drag lifts the bone: pressed a little harder, the finger would slide at a smaller depth. Under a constant "
    "weight this slide is unstable; held at this depth, the finger slides under less force."
)

BEYOND_THE_SKIN = NotConverged(
    "The drag brings more skin into contact than the finger's palmar side has, where contact is looked for: ask "
    "for less friction, drag or depth."
)


class SmallMeshing(Meshing):
    """Small strain: all scenes share one mesh and its nested mesh."""

    def __init__(self, scenes: Scenes) -> None:
        super().__init__(scenes)
        self._fingers: dict[Sizing, tuple[LinearFinger, float]] = {}  # and the time to make each [s]

    def _finger(self, sizing: Sizing) -> tuple[LinearFinger, float]:
        if sizing not in self._fingers:
            start = perf_counter()
            finger = LinearFinger.of(self.scene, sizing)
            self._fingers[sizing] = finger, perf_counter() - start
        return self._fingers[sizing]

    def answers(self, scenes: Scenes, fineness: Fineness, watch: Watch | None = None) -> Answers:
        """Return the answers as `Meshing`; where contact leaves the skin considered, solve all on a mesh with more."""
        self._fingers = {sizing: entry for sizing, entry in self._fingers.items() if sizing.fineness == fineness}
        deep = max(self.deepest.values())
        most = max(deep, min(WIDE_MARGIN * deep, self.scene.finger.pulp_thickness()))  # for drags with much contact
        narrow, wide = (Sizing(fineness, depth, margin=WIDE_MARGIN) for depth in (deep, most))
        try:
            results = self._on_mesh(scenes, narrow, watch, last=False)
            return self._on_mesh(scenes, wide, watch, last=True) if len(results) < len(scenes) else results
        except NotConverged as failure:  # the stiffness of a mesh is lost in round-off
            return dict.fromkeys(scenes, failure)

    def _on_mesh(self, scenes: Scenes, sizing: Sizing, watch: Watch | None, *, last: bool) -> Answers:
        """Return the answers on one mesh; none where contact leaves the skin that this mesh considers.

        Full slip is solved by falling friction, since the steepest has the longest contact. On the `last` mesh a scene
        whose contact leaves that skin gets a failure.
        """
        finger, setup_s = self._finger(sizing)
        answers: Answers = {}
        # Full slip takes milliseconds and shares one estimate; `watch` receives a load path as soon as it is marched.
        steepest_first = sorted(scenes, key=lambda number: -float(scenes[number].friction.mu))
        stepwise = any(scene.solve.course == "history" for scene in scenes.values())
        for batch in [[number] for number in scenes] if stepwise else [steepest_first]:
            states: dict[int, SceneSolution] = {}
            for number in batch:
                position = len(answers) + len(states)
                check_stop(position / len(scenes))
                try:
                    solution = self._solve_state(scenes[number], finger, position, len(scenes))
                except SolveFailure as failure:
                    answers[number] = failure.in_a_sentence()
                    continue
                if solution is not None:
                    states[number] = replace(solution, setup_s=setup_s - finger.solve_s)
                elif last:
                    answers[number] = BEYOND_THE_SKIN
                else:
                    return {}
            if states:
                answers |= zip(states, self._predict(list(states.values()), finger, sizing), strict=True)
            if watch is not None:
                for number in batch:
                    if answers[number] is not BEYOND_THE_SKIN:
                        path = states[number].elastic_path if number in states else None
                        watch(number, answers[number], finger, path)
        return {number: answers[number] for number in scenes}

    def _solve_state(self, scene: Scene, finger: LinearFinger, position: int, count: int) -> SceneSolution | None:
        """Return the state of one of `count` scenes; None where contact leaves the skin that the mesh considers.

        Where the scene requests the load path, an earlier slide without full slip is refused with its limits. Raises
        SolveFailure.
        """
        start = perf_counter()
        history = scene.solve.course == "history"
        for slide in scene.earlier_slides() if history else ():
            state_on_branch(slide, finger)
        steady = state_on_branch(scene, finger)
        try:
            steps = choose_steps(scene, finger, settled=steady)
            step_factor = steps_of_press(scene, finger) if steps is None else steps.factor
        except SolveFailure:
            steps, step_factor = Steps(1, np.zeros(COUNT), np.zeros(COUNT)), 1  # no estimate follows either
        if step_factor > 1 and steps is not None:
            steady = state_on_branch(scene, finger, step_factor)
        path, state, relaxing = None, steady, history and scene.materials.relax
        if history:

            def report(_: str, part: float) -> None:
                check_stop((position + part) / count)

            path = march_scene(scene, finger, step_factor, relaxing=relaxing, report=report)
            state = path.last
            if relaxing:
                state = replace(state, u=finger.body.condensed.displacement_under(state.reaction))
        displacement = finger.displacement(state)
        refuse_beyond_tissue(scene, finger, state.load.depth)
        if finger.reaches_out(state, displacement):
            return None
        direct_solve = path is None and scene.normal_force is None and not state.load.path_dependent
        (state, displacement), checks = _remove_round_off(scene, finger, (state, displacement), always=direct_solve)
        solution = SceneSolution(scene, state, displacement, checks, steps, path)
        complete_audits(finger, solution, finger.newton, lambda: finger.sed_ending(finger.displacement(steady)))
        unstable = UNSTABLE if is_unstable_under_force(scene, finger, state) else ""
        warnings = tuple(filter(None, [audits.inside_out_warning(checks), unstable]))
        return replace(solution, warnings=warnings, wall_s=perf_counter() - start + finger.solve_s / count)

    def _predict(self, solutions: list[SceneSolution], finger: LinearFinger, sizing: Sizing) -> list[Prediction]:
        """Return the prediction of each state with its error estimate; all results are computed together."""
        start = perf_counter()
        states = [(solution.state, forces_of(solution.scene, solution.state.load)) for solution in solutions]
        values, changes = edge_changes_of_all(finger.newton, states, finger.numbers_and_row)
        numbers = values[:, :COUNT]
        displacements = np.stack([solution.displacement for solution in solutions], axis=2)
        numbers[:, FORCES_AND_PLACES:] = finger.ending.responses(displacements)[:, 0].T
        numbers[:, 0] = numbers[:, FORCES_AND_PLACES]
        rows = finger.row.average(displacements)
        mesh, _ = self._finger(replace(sizing, halved=True))
        nested = nested_numbers_of_all(finger, mesh, solutions, numbers, changes)
        estimate_s = (perf_counter() - start) / len(solutions)
        return [
            prediction(solution, finger, numbers[number], rows[:, number], nested[number], estimate_s)
            for number, solution in enumerate(solutions)
        ]


Solution = tuple[EquilibriumState, Array]  # and its displacement (nodes, 2)


def _remove_round_off(
    scene: Scene, finger: LinearFinger, solution: Solution, *, always: bool
) -> tuple[Solution, dict[str, float]]:
    """Return a solution without its round-off, and its audits.

    With `always` it takes at least one step, otherwise only where audits show round-off. Relaxing tissue has additional
    forces, which are not round-off.
    """

    def correct(current: Solution, _: object = None) -> tuple[Solution, dict[str, float]]:
        corrected = remove_round_off(scene, finger, *current)
        return corrected, audits.audits(finger, *corrected)

    first = correct(solution) if always else (solution, audits.audits(finger, *solution))
    return first if scene.viscoelastic else audits.balance(*first, SMALL_IMBALANCE, correct)


def nested_numbers_of_all(
    finger: LinearFinger,
    mesh: LinearFinger,
    solutions: Sequence[SceneSolution],
    numbers: Array,
    changes: Sequence[Array],
) -> list[NestedNumbers | NotConverged]:
    """Return the results of scenes solved on `finger` on its nested `mesh`, or the failure of a scene there.

    `numbers` (c, COUNT) are the results on the finger, `changes` (m, COUNT + r) of each those by moved edges there.
    """
    states: dict[int, EquilibriumState] = {}
    for number, solution in enumerate(solutions):
        with suppress(SolveFailure):
            states[number] = (
                nearest_state(solution.scene, mesh) if solution.steps is None else end_of_path(solution.scene, mesh)
            )
    out: list[NestedNumbers | NotConverged] = [NO_NESTED_STATE] * len(solutions)
    if states:
        with_forces = [(state, forces_of(solutions[number].scene, state.load)) for number, state in states.items()]
        values, nested_changes = edge_changes_of_all(mesh.newton, with_forces, mesh.numbers_and_row)
        for (number, state), value, nested_change in zip(states.items(), values, nested_changes, strict=True):
            solution = solutions[number]
            answer, nested, moves = (finger, solution.state), (mesh, state), (changes[number], nested_change)
            out[number] = nested_numbers(solution.scene, numbers[number], answer, nested, value, moves, solution.steps)
    return out
