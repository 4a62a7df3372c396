"""How far the numbers of a scene at small strain may be off: what a coarser mesh and fewer load steps make of them."""

import numpy as np

from solver.accuracy.error_estimate import Errors, errors
from solver.arrays import Array
from solver.continuation.small_states import NUDGE, bounded_more, end, nearest, rubbed_more, sensitivity_to_bound
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.loads import pull_of
from solver.equilibrium.step_error import HALF, Steps
from solver.failures import SolveFailure
from solver.scene import Scene


def steps_asked(scene: Scene, finger: FingerModel) -> Steps:
    """Return the load steps that a scene asks for whose end depends on its way, judged on a coarse mesh."""
    try:
        whole, half = (finger.all_numbers(end(scene, finger, times)) for times in (1.0, HALF))
    except SolveFailure:
        return Steps(1, np.full(6, np.nan), np.zeros(6))  # nor will there be an estimate
    return Steps.of(whole, half, scene.solve.tolerance)


def times_on_way(scene: Scene, finger: FingerModel) -> int:
    """Return how many times the usual load steps a history takes whose end does not depend on them.

    Those that a tolerance asks for at the end of its press, judged on a coarse mesh.
    """
    if scene.solve.course == "steady" or scene.solve.tolerance is None or pull_of(scene).frictionless:
        return 1
    return steps_asked(scene.pressed_only(), finger).times


def error_estimates(
    scene: Scene, fineness: float, coarse: FingerModel, numbers: Array, steps: Steps | None
) -> tuple[Errors, Array]:
    """Return how far the `numbers` (6,) of a scene may be off, found on a mesh of `fineness`.

    The same scene is solved on the `coarse` mesh: elements twice as long, moved along the skin by half of one, so that
    the edges of contact fall differently between nodes. `steps` are those taken where they depend on their way. Beside
    the errors: its numbers there (1, 6), or none where it has no state.
    """
    felt, bounded = np.zeros(6), np.zeros(6)
    try:
        if steps is None:
            others, felt, bounded = _settled(scene, coarse)
        else:
            others, felt = _on_way(scene, coarse, steps)
    except SolveFailure:
        others = np.empty((0, 6))
    return errors(scene, fineness, numbers, others, felt, steps, bounded), others


def others_on(scene: Scene, mesh: FingerModel, steps: Steps | None) -> Array:
    """Return the numbers of a scene on one more mesh (1, 6), or none where it has no state; `steps` as above."""
    try:
        numbers = mesh.all_numbers(nearest(scene, mesh) if steps is None else end(scene, mesh))
    except SolveFailure:
        return np.empty((0, 6))
    return (numbers if steps is None else steps.taken(numbers))[None]


def _settled(scene: Scene, coarse: FingerModel) -> tuple[Array, Array, Array]:
    state = nearest(scene, coarse)
    other, felt, bounded = coarse.all_numbers(state), np.zeros(6), np.zeros(6)
    if (beside := rubbed_more(scene, coarse, state)) is not None:
        felt[:3] = (coarse.numbers([beside])[0] / other[:3] - 1.0) / NUDGE
    if (beside := bounded_more(scene, coarse, state)) is not None:
        bounded = (coarse.all_numbers(beside) / np.where(other == 0.0, 1.0, other) - 1.0) / NUDGE
        bounded[other == 0.0] = 0.0
    return other[None], felt, bounded


def _on_way(scene: Scene, coarse: FingerModel, steps: Steps) -> tuple[Array, Array]:
    told = np.isfinite(steps.whole).all()  # when the steps were judged
    other = steps.taken(steps.whole if told else coarse.all_numbers(nearest(scene, coarse)))
    felt = np.zeros(6)
    if scene.friction.tau_max is not None:
        felt = sensitivity_to_bound(scene, coarse, end(scene, coarse, HALF))
    return other[None], felt
