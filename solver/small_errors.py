"""How far the numbers of a scene at small strain may be off: what coarser meshes and fewer load steps make of them."""

from collections.abc import Sequence

import numpy as np

from solver.contact import Contact, ContactLost
from solver.estimate import Errors, errors
from solver.failures import SolveFailure
from solver.finger import FingerModel
from solver.load_steps import HALF, Steps
from solver.mesh import Array
from solver.scene import Scene
from solver.small_states import (
    NUDGE,
    all_numbers,
    end,
    felt_of_bound,
    law_of,
    nearest,
    numbers_on,
    rubbed_more,
)

LOST = (ContactLost, SolveFailure)


def steps_asked(scene: Scene, finger: FingerModel) -> Steps:
    """Return the load steps that a scene asks for whose end depends on its way, judged on a coarse mesh."""
    try:
        whole, half = (all_numbers(scene, finger, end(scene, finger, times)) for times in (1.0, HALF))
    except LOST:
        return Steps(1, np.full(6, np.nan), np.zeros(6))  # nor will there be an estimate
    return Steps.of(whole, half, scene.solve.tolerance)


def times_on_way(scene: Scene, finger: FingerModel) -> int:
    """Return how many times the usual load steps a history takes whose end does not depend on them.

    Those that a tolerance asks for at the end of its press, judged on a coarse mesh.
    """
    if scene.solve.course == "steady" or scene.solve.tolerance is None or law_of(scene).frictionless:
        return 1
    return steps_asked(scene.pressed_only(), finger).times


def error_estimates(
    scene: Scene, fineness: float, coarse: Sequence[FingerModel], numbers: Array, steps: Steps | None
) -> Errors:
    """Return how far the `numbers` (6,) of a scene may be off, found on a mesh of `fineness`.

    The same scene is solved on the `coarse` meshes: one with elements twice as long, and that mesh moved along the skin
    by half an element, so that the edges of contact fall differently between nodes. `steps` are those taken where
    they depend on their way.
    """
    try:
        if steps is None:
            return _settled(scene, fineness, coarse, numbers)
        return _on_way(scene, fineness, coarse, numbers, steps)
    except LOST:
        return errors(scene, fineness, numbers, np.empty((0, 6)), np.zeros(6), steps)


def _settled(scene: Scene, fineness: float, coarse: Sequence[FingerModel], numbers: Array) -> Errors:
    states = [nearest(scene, finger) for finger in coarse]
    others = np.array([all_numbers(scene, *found) for found in zip(coarse, states, strict=True)])
    felt = np.zeros(6)
    if (beside := rubbed_more(scene, coarse[0], states[0])) is not None:
        felt[:3] = (numbers_on(coarse[0], [beside])[0] / others[0, :3] - 1.0) / NUDGE
    return errors(scene, fineness, numbers, others, felt, None)


def _on_way(scene: Scene, fineness: float, coarse: Sequence[FingerModel], numbers: Array, steps: Steps) -> Errors:
    first, *more = coarse  # of which the first has told the steps
    whole = [steps.whole if np.isfinite(steps.whole).all() else all_numbers(scene, first, nearest(scene, first))]
    whole += [all_numbers(scene, finger, _near(scene, finger)) for finger in more]
    others = np.array([steps.taken(numbers) for numbers in whole])
    felt = np.zeros(6)
    if scene.friction.tau_max is not None:
        felt = felt_of_bound(scene, first, end(scene, first, HALF))
    return errors(scene, fineness, numbers, others, felt, steps)


def _near(scene: Scene, finger: FingerModel) -> Contact:
    """Return the end of the course, or the slide where the friction limit lies just below the drag asked for."""
    try:
        return end(scene, finger)
    except LOST:
        return nearest(scene, finger)
