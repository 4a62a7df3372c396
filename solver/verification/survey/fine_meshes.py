"""The truth of a survey: the numbers of a scene on three or more meshes far finer than an answer's."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import product

import numpy as np

from solver.arrays import Array
from solver.continuation.small_states import settled
from solver.continuation.wedging import WIDE
from solver.equilibrium.finger import FingerModel
from solver.failures import NotConverged, SolveFailure
from solver.mesh.mesher import AT_CUT, Sizing
from solver.scene import Scene
from solver.verification.methods import fine_solutions
from solver.verification.truth import SHIFTED

HARD_SHIFTED = tuple(product((30.0, 28.0, 26.0, 24.0), (False, True)))  # in hard scenes some of these have no state
PLAIN, LINED = 17.0, (23.0, 26.0, 29.0)  # fineness at finite strain; the last in hard scenes, in place of the plain one
ENOUGH = 3  # meshes


def numbers_on_mesh(scenes: Sequence[Scene], fineness: float, shift: bool) -> Array:
    """Return SED [MPa], normal force and drag [N/mm] (n, 3) of surfaces on one mesh at small strain."""
    depth = scenes[0].loading.depth
    for margin in (1.0, 4.0, WIDE):
        finger = FingerModel.of(scenes[0], Sizing(fineness, depth, shift, margin))
        states = [settled(scene, finger) for scene in scenes]
        if not any(finger.reaches_out(state, finger.displacement(state), depth) for state in states):
            break
    return np.abs(finger.numbers(states))


def fine_numbers(scene: Scene, *, hard: bool) -> Array:
    """Return the three numbers of a scene (n, 3) on n meshes, three at least.

    A hard scene has more of them, and at finite strain none without lines at the edges of contact. Raises SolveFailure
    where too few meshes have a state, or where elements at the cut cannot be shortened.
    """
    if scene.solve.kinematics == "small":
        solves: list[Array] = []
        for fineness, shift in HARD_SHIFTED if hard else SHIFTED:
            with suppress(SolveFailure):
                solves.append(numbers_on_mesh([scene], fineness, shift)[0])
        if len(solves) < ENOUGH:
            raise NotConverged("Fewer than three fine meshes have a state.")
        return np.array(solves)
    found = fine_solutions(scene, (PLAIN, *(LINED if hard else LINED[:2])))[1 if hard else 0 :]
    if scene.loading.direction > 0 and max(one.at_cut for one in found) >= AT_CUT:
        raise NotConverged("The elements where the cut meets the bone cannot be shortened.")
    return np.abs([one.numbers for one in found])
