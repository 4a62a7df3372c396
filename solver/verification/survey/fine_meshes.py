"""The truth of a survey: the numbers of a scene on three or more meshes far finer than an answer's."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import product

import numpy as np

from solver.arrays import Array
from solver.continuation.small_states import settled
from solver.continuation.wedging import WIDE
from solver.equilibrium.linear_finger import LinearFinger
from solver.failures import NotConverged, SolveFailure
from solver.mesh.mesher import Sizing
from solver.scene.scene import Scene
from solver.verification.methods import FiniteMeshed
from solver.verification.truth import SHIFTED

HARD_SHIFTED = {  # in hard scenes some of these have no state
    "small": tuple(product((30.0, 28.0, 26.0, 24.0), (False, True))),
    "finite": tuple(product((18.0, 16.0), (False, True))),
}
ENOUGH = 3  # meshes


def numbers_on_mesh(scenes: Sequence[Scene], fineness: float, shift: bool) -> Array:
    """Return SED [MPa], normal force and drag [N/mm] (n, 3) of surfaces on one mesh."""
    if scenes[0].solve.kinematics == "finite":
        mesh = FiniteMeshed(max(scenes, key=lambda scene: scene.loading.depth), fineness, shift)
        return mesh.numbers_together([mesh.solve(scene) for scene in scenes])
    depth = scenes[0].loading.depth
    for margin in (1.0, 4.0, WIDE):
        finger = LinearFinger.of(scenes[0], Sizing(fineness, depth, shift, margin))
        states = [settled(scene, finger) for scene in scenes]
        if not any(finger.reaches_out(state, finger.displacement(state), depth) for state in states):
            break
    return np.abs(finger.numbers(states))


def fine_numbers(scene: Scene, *, hard: bool) -> Array:
    """Return the three numbers of a scene (n, 3) on n meshes, three at least; a hard scene is tried on more.

    Raises SolveFailure where too few meshes have a state.
    """
    kind, solves = scene.solve.kinematics, list[Array]()
    for fineness, shift in HARD_SHIFTED[kind] if hard else SHIFTED[kind]:
        with suppress(SolveFailure):
            solves.append(numbers_on_mesh([scene], fineness, shift)[0])
    if len(solves) < ENOUGH:
        raise NotConverged("Fewer than three fine meshes have a state.")
    return np.array(solves)
