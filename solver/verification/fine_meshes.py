"""The truth of a random scene: its results on two uniformly fine meshes, and on one refined by its estimated error."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from solver.arrays import Array
from solver.continuation.small_states import WIDE_MARGIN, expected_depth, settled_state
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import Finger, LinearFinger
from solver.equilibrium.load_path import end_of_path
from solver.failures import NotConverged, SolveFailure
from solver.mesh.mesher import Sizing
from solver.prediction import COUNT, Prediction
from solver.response import FIRST_FINENESS
from solver.response.finite_answers import WIDER, Meshes, coarse_solution, solution_on
from solver.response.solution import solve_many
from solver.scene import Scene
from solver.verification.methods import Kinematics

# Fineness and factor on the usual load steps, by kinematics and `depends_on_way`. Each mesh is also solved shifted by
# half an element, with the factor increased by 1. The first meshes with a solution are used.
_MESHES: dict[tuple[Kinematics, bool], Sequence[tuple[float, int]]] = {
    ("small", False): ((50.0, 1), (44.0, 1), (26.0, 1)),
    ("small", True): ((24.0, 24), (20.0, 28)),
    ("finite", False): ((40.0, 1), (34.0, 1), (15.0, 1)),
    ("finite", True): ((16.0, 8), (14.0, 10)),
}
ENOUGH = 2  # number of meshes used
_REFINED = {"small": 1e-4, "finite": 3e-4}  # tolerance that refines the third mesh


def fine_numbers(scenes: Sequence[Scene], coarsening: float = 1.0) -> Array:
    """Return SED [MPa], normal force, drag [N/mm], then the SED of the row (3, n, 3 + r) of scenes on three meshes.

    All scenes have one finger. Elements are `coarsening` times as large as usual. Raises SolveFailure where fewer
    meshes have a solution.
    """
    solves: list[Array] = []
    meshes = _MESHES[scenes[0].solve.kinematics, any(map(depends_on_way, scenes))]
    for (fineness, step_factor), shift in product(meshes, (False, True)):
        with suppress(SolveFailure):
            solves.append(numbers_on_mesh(scenes, fineness / coarsening, shift, step_factor + shift))
        if len(solves) == ENOUGH:
            return np.array([*solves, _solve_refined(scenes, coarsening)])
    raise NotConverged("Fewer than two fine meshes have a state.")


def _solve_refined(scenes: Sequence[Scene], coarsening: float) -> Array:
    """Return the results (n, 3 + r) on the nested mesh of answers with a tight tolerance."""
    tolerance = coarsening**2 * _REFINED[scenes[0].solve.kinematics]
    contrast = tolerance if len(scenes) > 1 else None
    answers = solve_many(
        [
            replace(s, solve=replace(s.solve, tolerance=tolerance, contrast_tolerance=contrast, evidence="quick"))
            for s in scenes
        ]
    )
    nested = [answer.nested for answer in answers if isinstance(answer, Prediction) and answer.nested is not None]
    numbers = [[*result.numbers[:3], *result.row] for result in nested]
    if len(numbers) < len(scenes):
        raise NotConverged("No refined mesh has a state.")
    return np.abs(numbers)


def depends_on_way(scene: Scene) -> bool:
    """Return whether the final state of a scene may depend on its load steps."""
    return scene.loading.direction == 0 or scene.loading.dragged


def numbers_on_mesh(scenes: Sequence[Scene], fineness: float, shift: bool, step_factor: int = 1) -> Array:
    """Return SED [MPa], normal force, drag [N/mm], then the SED of the row (n, 3 + r) of surfaces on one mesh.

    Load paths take `step_factor` times the usual steps.
    """
    on_mesh = _finite if scenes[0].solve.kinematics == "finite" else _small
    return np.array(list(on_mesh(scenes, fineness, shift, step_factor)))


def _small(scenes: Sequence[Scene], fineness: float, shift: bool, step_factor: int) -> Iterator[Array]:
    depth = max(expected_depth(scene) for scene in scenes)
    finger = LinearFinger.of(scenes[0], Sizing(fineness, depth, shift, WIDE_MARGIN))
    for scene in scenes:
        stepwise = scene.viscoelastic and depends_on_way(scene)
        state = (end_of_path if stepwise else settled_state)(scene, finger, step_factor)
        if finger.reaches_out(state, finger.displacement(state)):
            raise NotConverged("Contact reaches out of the skin that is looked at.")
        yield _numbers(finger, state)


def _finite(scenes: Sequence[Scene], fineness: float, shift: bool, step_factor: int) -> Iterator[Array]:
    meshes, depth = Meshes(), max(expected_depth(scene) for scene in scenes)
    for scene in scenes:
        low = coarse_solution(scene, depth, FIRST_FINENESS, meshes)
        sizing = replace(low.finger.geometry.sizing, fineness=fineness, shift=shift)
        if scene.viscoelastic and depends_on_way(scene):
            finger = meshes.finger(scene, replace(sizing, margin=WIDER))
            yield _numbers(finger, end_of_path(scene, finger, step_factor))
            continue
        top = solution_on(scene, sizing, low, meshes, step_factor)
        if top.state.reaches_end:
            top = solution_on(scene, replace(sizing, margin=WIDER), low, meshes, step_factor)
        yield _numbers(top.finger, top.state)


def _numbers(finger: Finger[Any], state: EquilibriumState) -> Array:
    return np.abs(np.delete(finger.numbers_and_row([state])[0], np.s_[3:COUNT]))
