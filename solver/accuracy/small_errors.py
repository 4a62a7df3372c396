"""A scene at small strain on the nested mesh, and the load steps it asks for: what its errors are estimated from."""

from collections.abc import Sequence

import numpy as np

from solver.accuracy.error_estimate import edge_changes, nested_numbers
from solver.continuation.small_states import end, nearest
from solver.equilibrium.finger import LinearFinger, forces_of
from solver.equilibrium.load_path import Steps
from solver.equilibrium.newton import EquilibriumState
from solver.failures import SolveFailure
from solver.prediction import COUNT, NestedNumbers
from solver.scene.scene import Scene


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
    states = [_state(scene, mesh, steps) for scene, steps in asked]
    held = [number for number, state in enumerate(states) if state is not None]
    out: list[NestedNumbers | None] = [None] * len(asked)
    known = [state for state in states if state is not None]
    if not known:
        return out
    forced = [(state, forces_of(asked[n][0], state.load)) for n, state in zip(held, known, strict=True)]
    for number, values, changes in zip(held, *edge_changes(mesh.newton, forced, mesh.numbers_and_row), strict=True):
        out[number] = nested_numbers(values, changes, asked[number][1])
    return out


def _state(scene: Scene, mesh: LinearFinger, steps: Steps | None) -> EquilibriumState | None:
    try:
        return nearest(scene, mesh) if steps is None else end(scene, mesh)
    except SolveFailure:
        return None
