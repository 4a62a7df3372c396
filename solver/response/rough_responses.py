"""Responses of many scenes without error estimates: for surveys, where a scene may cost no more than its solve.

On one coarse mesh for all scenes that share a finger. `sessions.prediction.series_slopes` says how good that is for
what it is used for.
"""

from collections.abc import Sequence
from contextlib import suppress
from itertools import groupby

import numpy as np
from numpy.linalg import LinAlgError

from solver.accuracy.adaptivity import COARSE, WIDER
from solver.arrays import Array
from solver.continuation.existence import sound
from solver.continuation.finite_states import roughly
from solver.continuation.small_states import WIDE, direct
from solver.equilibrium.expected_depth import expected_depth
from solver.equilibrium.finger import FiniteFinger, LinearFinger
from solver.equilibrium.load_stepping import never
from solver.equilibrium.newton import EquilibriumState
from solver.failures import SolveFailure
from solver.mesh.mesh import MeshError
from solver.mesh.mesher import Sizing
from solver.quantities import NAMES
from solver.scene.scene import Scene, SceneError

FINENESS = 6.0  # elements to a tip radius, at small strain


def rough_responses(scenes: Sequence[Scene], arcs: Sequence[float] = (0.0,)) -> Array:
    """Return every quantity (n, q, r) of settled slides at endings at arc positions [mm]; nan where there is none.

    All scenes are of one finger and one kinematics. Raises SceneError where the finger cannot be meshed.
    """
    first = scenes[0]
    if first.solve.kinematics == "finite":
        return _finite(scenes, np.asarray(arcs, np.float64))
    out = np.full((len(scenes), len(NAMES), len(arcs)), np.nan)
    depth = max(expected_depth(scene) for scene in scenes)
    try:
        finger = LinearFinger.of(first, Sizing(FINENESS, depth, margin=WIDE))
    except (MeshError, LinAlgError) as bad:
        key, value = "finger.tip_radius", first.finger.tip_radius
        raise SceneError(key, value, f"no mesh fits this finger ({bad})") from bad
    states: dict[int, EquilibriumState] = {}
    for number, scene in enumerate(scenes):
        with suppress(SolveFailure):
            state = direct(scene, finger)
            if not finger.reaches_out(state, finger.displacement(state), state.load.depth):
                states[number] = state
    if states:
        row = finger.endings(np.asarray(arcs, np.float64))
        out[list(states)] = np.moveaxis(row.responses(finger.displacements(list(states.values()))), 2, 0)
    return out


def _finite(scenes: Sequence[Scene], arcs: Array) -> Array:
    """Return the same at finite strain: those pressed alike share a mesh, each begun at the one with less friction."""
    out = np.full((len(scenes), len(NAMES), len(arcs)), np.nan)
    order = sorted(range(len(scenes)), key=lambda n: (scenes[n].pressed, float(scenes[n].friction.mu)))
    for _, numbers in groupby(order, lambda n: scenes[n].pressed):
        group, near = list(numbers), None
        depth = max(expected_depth(scenes[number]) for number in group)
        finger = FiniteFinger.of(scenes[group[0]], Sizing(COARSE, depth, margin=WIDER))
        row = finger.endings(arcs)
        for number in group:
            try:
                state = roughly(finger, scenes[number], never, near)
            except SolveFailure:
                continue
            if sound(finger, state):
                near = state
                out[number] = row.responses(state.u)
    return out
