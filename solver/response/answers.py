"""Solve scenes of one finger on meshes of one fineness, each with an error estimate.

Settled sliding is solved directly, and refused where it does not exist. A load path is marched step by step, in time
where tissues relax (`solver.equilibrium.relaxation`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from solver.accuracy import audits as audit
from solver.accuracy.adaptivity import Meshes, NestedSolution, coarse_solution, refine, solve_nested
from solver.accuracy.error_estimate import Steps, choose_steps, edge_changes, nested_state, steps_of_press
from solver.accuracy.refinement import with_shares
from solver.arrays import Array
from solver.body import Patches
from solver.continuation.existence import doubts
from solver.continuation.finite_states import settled_state
from solver.continuation.small_states import WIDE, direct, gives_way, in_tissue, nearest, remove_round_off, within_reach
from solver.equilibrium import EQUILIBRIUM, EquilibriumState, Newton
from solver.equilibrium.finger import Finger, FiniteFinger, LinearFinger
from solver.equilibrium.load_path import Instant, end, march
from solver.equilibrium.load_stepping import forces_of
from solver.equilibrium.relaxation import CondensedRelaxing
from solver.failures import NotConverged, SolveFailure
from solver.mesh import Lines
from solver.mesh.mesher import Sizing
from solver.prediction import COUNT, FORCES_AND_PLACES, NestedNumbers, Prediction
from solver.progress import Progress, check_stop, interruptible, report_part, report_progress
from solver.response.answer import SceneSolution, prediction
from solver.scene import Scene

# unbalanced part of the forces from which displacements are corrected further [-]
SMALL_IMBALANCE, FINITE_IMBALANCE = 1e-10, 1e-8
CORRECTIONS = 4  # at finite strain, at most

YIELDS = (
    "The drag lifts the bone: pressed a little harder, the finger would slide at a smaller depth. Under a weight, that "
    "follows it down, this slide would not last; held at this depth, the finger slides under less force."
)

BEYOND_THE_SKIN = NotConverged(
    "The drag lays more skin on the surface than the finger's palmar side has, where contact is looked for: ask "
    "for less friction, drag or depth."
)

Answer = Prediction | SolveFailure
LoadingGroup = tuple[float, float, str]  # how deep or hard, and which way: `Scene.loading_group`
Watch = Callable[[int, Answer, LinearFinger, tuple[Instant, ...] | None], None]  # position, answer, finger, load path


class Meshing(ABC):
    """Solves scenes of one finger on meshes of any fineness, and keeps meshes for reuse."""

    def __init__(self, depth: float, progress: Progress | None) -> None:
        """Start without meshes. `depth` [mm] is the deepest indentation, an estimate where forces are given."""
        self.depth, self.progress = depth, progress

    @abstractmethod
    def answers(self, scenes: list[Scene], fineness: float | Lines, watch: Watch | None = None) -> list[Answer]:
        """Return the prediction or the failure of each scene on meshes of a `fineness`.

        Raises SceneError where the finger cannot be meshed, Cancelled where `progress` says so.
        """


def _audit(
    scene: Scene, finger: Finger[Patches], solution: SceneSolution, newton: Newton, settled_sed: Callable[[], float]
) -> None:
    """Complete the audits of a state and of its load path; raise SolveFailure where they fail.

    `newton` belongs to the body that stores the energy of the load path. `settled_sed` returns the SED of the state
    that was solved directly, with which a load path must end.
    """
    checks, state, way = solution.audits, solution.state, solution.way
    audit.refuse_unsound(checks, state.load.depth)
    audit.refuse_beyond_finger(finger, state, solution.displacement)
    checks |= audit.force_residuals(scene, float(state.force[1]), float(state.force[0]))
    if way is None:
        return
    relaxing = way.tissue is not None
    checks |= audit.course_audits(newton, [instant.state for instant in way.instants], relaxing=relaxing)
    if not relaxing or state.sticking == 0.0:  # stuck and relaxing, the end depends on the way
        checks["course_against_direct"] = abs(settled_sed() / finger.sed_ending(solution.displacement) - 1.0)


class SmallMeshing(Meshing):
    """Small strain: all scenes share one mesh and its nested mesh."""

    def __init__(self, depth: float, progress: Progress | None) -> None:
        """Start without meshes."""
        super().__init__(depth, progress)
        self._fingers: dict[Sizing, tuple[LinearFinger, float]] = {}  # and what each took to make [s]

    def _finger(self, scene: Scene, sizing: Sizing) -> tuple[LinearFinger, float]:
        if sizing not in self._fingers:
            start = perf_counter()
            finger = LinearFinger.of(scene, sizing)
            self._fingers[sizing] = finger, perf_counter() - start
        return self._fingers[sizing]

    def answers(self, scenes: list[Scene], fineness: float | Lines, watch: Watch | None = None) -> list[Answer]:
        """Do as `Meshing` says; where contact leaves the skin considered, solve all on a mesh with more of it."""
        self._fingers = {sizing: kept for sizing, kept in self._fingers.items() if sizing.fineness == fineness}
        most = max(self.depth, min(WIDE * self.depth, scenes[0].finger.pulp_thickness()))  # for drags that lay much on
        narrow, wide = (Sizing(fineness, depth, margin=WIDE) for depth in (self.depth, most))
        try:
            done = self._on_mesh(scenes, narrow, watch, last=False)
            return self._on_mesh(scenes, wide, watch, last=True) if len(done) < len(scenes) else done
        except NotConverged as failure:  # a mesh does not stand for a body
            return [failure] * len(scenes)

    def _on_mesh(self, scenes: list[Scene], sizing: Sizing, watch: Watch | None, *, last: bool) -> list[Answer]:
        """Return the answers on one mesh; an empty list where contact leaves the skin that this mesh considers.

        Settled slides are solved by falling friction, since the steepest has the longest contact. On the `last` mesh a
        scene whose contact leaves that skin gets a failure.
        """
        finger, setup_s = self._finger(scenes[0], sizing)
        answers: dict[int, Answer] = {}
        # Settled slides take milliseconds and share one estimate; a load path is watched as soon as it is marched.
        every = range(len(scenes))
        steepest_first = sorted(every, key=lambda number: -float(scenes[number].friction.mu))
        marched = any(scene.solve.course == "history" for scene in scenes)
        for batch in [[number] for number in every] if marched else [steepest_first]:
            states: dict[int, SceneSolution] = {}
            for number in batch:
                position = len(answers) + len(states)
                report_part(self.progress, position / len(scenes))
                try:
                    solved = self._solve_state(scenes[number], finger, position, len(scenes))
                except SolveFailure as failure:
                    answers[number] = failure.in_a_sentence()
                    continue
                if solved is not None:
                    states[number] = replace(solved, setup_s=setup_s - finger.solve_s)
                elif last:
                    answers[number] = BEYOND_THE_SKIN
                else:
                    return []
            if states:
                answers |= zip(states, self._predict(list(states.values()), finger, sizing), strict=True)
            if watch is not None:
                for number in batch:
                    if answers[number] is not BEYOND_THE_SKIN:
                        watch(number, answers[number], finger, states[number].elastic_way if number in states else None)
        return [answers[number] for number in every]

    def _solve_state(self, scene: Scene, finger: LinearFinger, position: int, count: int) -> SceneSolution | None:
        """Return the state of one of `count` scenes; None where contact leaves the skin that the mesh considers.

        Where the load path is asked for, an earlier slide that never settles is refused with its limits. Raises
        SolveFailure.
        """
        start = perf_counter()
        history = scene.solve.course == "history"
        for leg in scene.earlier_slides() if history else ():
            direct(leg, finger)
        steady = direct(scene, finger)
        try:
            steps = choose_steps(scene, finger, settled=steady)
            times = steps_of_press(scene, finger) if steps is None else steps.times
        except SolveFailure:
            steps, times = Steps(1, np.zeros(COUNT), np.zeros(COUNT)), 1  # there will be no estimate either
        if times > 1 and steps is not None:
            steady = direct(scene, finger, times)
        way, state, relaxing = None, steady, history and scene.materials.relax
        if history:
            progress = self.progress

            def report(_: str, part: float) -> None:
                report_part(progress, (position + part) / count)

            way = march(scene, finger, times, relaxing=relaxing, report=report)
            state = way.last
            if relaxing:
                state = replace(state, u=finger.body.condensed.displacement_under(state.reaction))
        displacement = finger.displacement(state)
        in_tissue(scene, finger, state.load.depth)
        if finger.reaches_out(state, displacement, state.load.depth):
            return None
        directly_refinable = way is None and scene.normal_force is None and not state.load.path_dependent
        if directly_refinable:  # other states lose their round-off only where audits show it
            state, displacement = remove_round_off(scene, finger, state, displacement)
        checks = audit.audits(finger, state, displacement)
        if not relaxing and audit.imbalance(checks) > SMALL_IMBALANCE:
            state, displacement = remove_round_off(scene, finger, state, displacement)
            checks = audit.audits(finger, state, displacement)
        solved = SceneSolution(scene, state, displacement, checks, steps, way)
        _audit(scene, finger, solved, finger.newton, lambda: finger.sed_ending(finger.displacement(steady)))
        warnings = tuple(filter(None, [audit.inside_out(checks), YIELDS if gives_way(scene, finger, state) else ""]))
        return replace(solved, warnings=warnings, wall_s=perf_counter() - start + finger.solve_s / count)

    def _predict(self, solved: list[SceneSolution], finger: LinearFinger, sizing: Sizing) -> list[Prediction]:
        """Return the prediction of each state with its error estimate; the numbers of all are computed together."""
        start = perf_counter()
        numbers = finger.all_numbers([one.state for one in solved])
        displacements = np.stack([one.displacement for one in solved], axis=2)
        numbers[:, FORCES_AND_PLACES:] = finger.ending.responses(displacements)[:, 0].T
        numbers[:, 0] = numbers[:, FORCES_AND_PLACES]
        rows = finger.row.average(displacements)
        nested = nested_numbers_of_all(self._finger(solved[0].scene, replace(sizing, halved=True))[0], solved, numbers)
        estimate_s = (perf_counter() - start) / len(solved)
        return [
            prediction(one, finger, numbers[number], rows[:, number], nested[number], estimate_s)
            for number, one in enumerate(solved)
        ]


def nested_numbers_of_all(
    mesh: LinearFinger, solved: Sequence[SceneSolution], numbers: Array
) -> list[NestedNumbers | None]:
    """Return the numbers of solved scenes on the nested `mesh`, None for a scene without a state there.

    `numbers` (c, COUNT) are those on the mesh of the answers.
    """
    states: dict[int, EquilibriumState] = {}
    for number, one in enumerate(solved):
        try:
            states[number] = nearest(one.scene, mesh) if one.steps is None else end(one.scene, mesh)
        except SolveFailure:
            continue
    out: list[NestedNumbers | None] = [None] * len(solved)
    if states:
        forced = [(state, forces_of(solved[number].scene, state.load)) for number, state in states.items()]
        values, changes = edge_changes(mesh.newton, forced, mesh.numbers_and_row)
        for (number, state), value, change in zip(states.items(), values, changes, strict=True):
            one = solved[number]
            there = nested_state(mesh, state, value, change, one.steps)
            out[number] = None if there is None else with_shares(one.scene, numbers[number], there, one.steps)
    return out


class FiniteMeshing(Meshing):
    """Finite strain: each scene starts on a coarse mesh and is refined on a mesh made for its contact.

    Scenes that are pressed and move alike share meshes. They are solved by rising friction, each from the one before.
    """

    def __init__(self, depth: float, progress: Progress | None) -> None:
        """Start without meshes."""
        super().__init__(depth, progress)
        self._meshes: dict[LoadingGroup, Meshes] = {}

    def answers(self, scenes: list[Scene], fineness: float | Lines, watch: Watch | None = None) -> list[Answer]:  # noqa: ARG002 - of small strain
        """Do as `Meshing` says."""
        answers: dict[int, Answer] = {}
        with interruptible(self.progress, lambda: len(answers) / len(scenes)):
            for number in sorted(range(len(scenes)), key=lambda n: alike(scenes[n])):
                check_stop()
                start, scene = perf_counter(), scenes[number]
                report_progress("solving on a finer mesh" if isinstance(fineness, Lines) else "solving on a mesh")
                meshes = self._meshes.setdefault(scene.loading_group, Meshes())
                meshes.keep(fineness)
                try:
                    coarse = coarse_solution(scene, self.depth, fineness, meshes)
                    answers[number] = _predict(scene, refine(scene, fineness, coarse, meshes), meshes, start)
                except SolveFailure as failure:
                    answers[number] = failure
        return [answers[number] for number in range(len(scenes))]


def alike(scene: Scene) -> tuple[LoadingGroup, float]:
    """Return a key that sorts scenes by how they are pressed, then by friction, so that neighbours are similar."""
    return scene.loading_group, float(scene.friction.mu)


def _predict(scene: Scene, nested: NestedSolution, meshes: Meshes, start: float) -> Prediction:
    """Return the prediction of a scene solved at finite strain. Raises SolveFailure, Cancelled."""
    top, steps = nested.top, nested.steps
    finger, state, way = top.finger, top.state, None
    setup = nested.coarse.setup_s + top.setup_s
    if scene.solve.course == "history":
        times = steps_of_press(scene, nested.coarse.finger) if steps is None else steps.times
        for leg in scene.earlier_slides():  # one that never settles is refused with its limits
            settled_state(finger, leg)
        way = march(scene, finger, times, relaxing=scene.materials.relax)
        state = way.last
    if not state.touching.any():
        raise NotConverged(f"No contact was found at {state.load.depth:g} mm of indentation: ask for more depth.")
    within_reach(scene, state.load.depth)
    newton = finger.newton if way is None else way.newton
    state, checks = _balance(finger, newton, state)
    solved = SceneSolution(scene, state, state.u, checks, steps, way)
    _audit(scene, finger, solved, newton, lambda: finger.sed_ending(top.state.u))
    numbers = finger.all_numbers([state])[0]
    solved_at = perf_counter()
    report_progress("estimating errors, on the nested mesh")
    on_nested, steps = solve_nested(scene, top, steps, meshes)
    nested_numbers = None if on_nested is None else with_shares(scene, numbers, on_nested, steps)
    row = finger.row.average(state.u)
    estimate_s = perf_counter() - solved_at
    warnings, wall = doubts(finger, state), solved_at - start - setup
    solved = replace(solved, steps=steps, warnings=warnings, wall_s=wall, setup_s=setup)
    return prediction(solved, finger, numbers, row, nested_numbers, estimate_s)


def _balance(
    finger: FiniteFinger, newton: Newton, state: EquilibriumState
) -> tuple[EquilibriumState, dict[str, float]]:
    """Return a state and its audits after further Newton steps that bring unbalanced forces down to round-off.

    `newton` is that of the finger, or of its relaxing tissues. Under a light touch, errors of displacements far below a
    nanometre leave a large part of the forces on nearly incompressible tissue unbalanced.
    """
    checks = _audits(finger, newton, state)
    for _ in range(CORRECTIONS):
        if audit.imbalance(checks) <= FINITE_IMBALANCE:
            break
        x = state.place(newton.condensed)[:, 0]
        if not newton.linearise(state, state.load, x):
            break
        corrected, _, _ = newton.apply_step(state, state.load, newton.steps[:, EQUILIBRIUM].copy(), x)
        corrected = replace(
            corrected, state=state.state, sense=state.sense
        )  # a step of nanometres changes no contact state
        corrected_checks = _audits(finger, newton, corrected)
        worse = _contradicting(corrected_checks) > max(_contradicting(checks), FINITE_IMBALANCE)
        if worse or audit.imbalance(corrected_checks) >= audit.imbalance(checks):
            break
        state, checks = corrected, corrected_checks
    return state, checks


def _audits(finger: FiniteFinger, newton: Newton, state: EquilibriumState) -> dict[str, float]:
    body = newton.condensed
    over: Array | None = (
        finger.body.mesh.assemble(body.excess(state.u)) if isinstance(body, CondensedRelaxing) else None
    )
    return audit.audits(finger, state, state.u, over)


def _contradicting(checks: dict[str, float]) -> float:
    return max(checks[name] for name in ("penetration", "tension", "cone_violation"))


MESHINGS: dict[str, type[Meshing]] = {"small": SmallMeshing, "finite": FiniteMeshing}  # by kinematics
