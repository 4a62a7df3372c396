"""Ends of courses at finite strain that depend on their way: how many load steps they take, what the bound does."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver._kernels import SHEAR_LIMITED
from solver.arrays import Array
from solver.continuation.finite_states import course, depends_on_way
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.finite_relaxation import RelaxingCourse
from solver.equilibrium.newton import EquilibriumState
from solver.equilibrium.step_error import HALF, Steps
from solver.scene import Scene

NUDGE = 1e-2  # of the traction bound, to see what it does on a whole course


def relaxes(scene: Scene) -> bool:
    """Return whether the course of a scene is marched in time."""
    return scene.materials.relax and scene.solve.course == "history"


def end(finger: FiniteFinger, scene: Scene, stop: Callable[[], bool], times: float = 1.0) -> EquilibriumState:
    """Return the end of a course, in so many `times` the usual load steps. Raises NotConverged, Cancelled."""
    if relaxes(scene):
        return RelaxingCourse(scene, finger, stop, times=times).last
    return course(scene, finger, stop, times).last


def steps_asked(scene: Scene, finger: FiniteFinger, shape: EquilibriumState, stop: Callable[[], bool]) -> Steps | None:
    """Return the load steps that a scene asks for, judged on a mesh on which it has led to `shape`.

    None where that is a settled slide. Raises NotConverged, Cancelled.
    """
    if not depends_on_way(scene, shape):
        return None
    whole = end(finger, scene, stop) if relaxes(scene) else shape
    half = end(finger, scene, stop, HALF)
    return Steps.of(finger.all_numbers(whole), finger.all_numbers(half), scene.solve.tolerance)


def times_on_way(scene: Scene, finger: FiniteFinger, stop: Callable[[], bool]) -> int:
    """Return how many times the usual load steps a history takes whose end does not depend on them.

    Those that a tolerance asks for at the end of its press, judged on a mesh. Raises NotConverged, Cancelled.
    """
    if scene.solve.course == "steady" or scene.solve.tolerance is None or scene.friction.mu == 0.0:
        return 1
    press = scene.pressed_only()
    steps = steps_asked(press, finger, end(finger, press, stop), stop)
    return 1 if steps is None else steps.times


def sensitivity_to_bound(
    scene: Scene, finger: FiniteFinger, shape: EquilibriumState, stop: Callable[[], bool]
) -> Array:
    """Return how the numbers (6,) at the end of a course answer to the traction bound: relative change by its own.

    Zero where nothing slips at the bound in `shape`, the end, or where that is a slide. Raises NotConverged, Cancelled.
    """
    bound = scene.friction.tau_max
    if bound is None or not (shape.state == SHEAR_LIMITED).any() or not depends_on_way(scene, shape):
        return np.zeros(6)
    scenes = [replace(scene, friction=replace(scene.friction, tau_max=most)) for most in (bound, (1.0 + NUDGE) * bound)]
    here, beside = (finger.all_numbers(end(finger, beside, stop, HALF)) for beside in scenes)
    return (beside - here) / np.where(here == 0.0, 1.0, here) / NUDGE
