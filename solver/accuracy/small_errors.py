"""A scene at small strain on the nested mesh, and the load steps it asks for: what its errors are estimated from."""

import numpy as np

from solver.accuracy.error_estimate import edge_changes
from solver.continuation.small_states import end, nearest
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.loads import forces_of, pull_of
from solver.equilibrium.step_error import HALF, Steps
from solver.failures import SolveFailure
from solver.prediction import NestedNumbers
from solver.scene import Scene


def steps_asked(scene: Scene, finger: FingerModel) -> Steps:
    """Return the load steps that a scene asks for whose end depends on its way, judged on a mesh."""
    try:
        whole, half = finger.all_numbers([end(scene, finger, times) for times in (1.0, HALF)])
    except SolveFailure:
        return Steps(1, np.full(7, np.nan), np.zeros(7))  # nor will there be an estimate
    return Steps.of(whole, half, scene.solve.tolerance)


def times_on_way(scene: Scene, finger: FingerModel) -> int:
    """Return how many times the usual load steps a history takes whose end does not depend on them.

    Those that a tolerance asks for at the end of its press, judged on a mesh.
    """
    if scene.solve.course == "steady" or scene.solve.tolerance is None or pull_of(scene).frictionless:
        return 1
    return steps_asked(scene.pressed_only(), finger).times


def on_nested(scene: Scene, mesh: FingerModel, steps: Steps | None) -> NestedNumbers | None:
    """Return the numbers of a scene on the nested `mesh`, None where it has no state there.

    `steps` are those taken where they depend on their way.
    """
    try:
        state = nearest(scene, mesh) if steps is None else end(scene, mesh)
    except SolveFailure:
        return None
    numbers = mesh.all_numbers([state])[0]
    of_edges = edge_changes(mesh.newton, state, forces_of(scene, state.pull), mesh.all_numbers)
    row = mesh.sed_row(mesh.displacement(state))
    return NestedNumbers(numbers if steps is None else steps.taken(numbers), of_edges, row)
