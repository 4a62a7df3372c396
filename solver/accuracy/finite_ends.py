"""Ends of courses at finite strain that depend on their way: how many load steps they take."""

from collections.abc import Callable

from solver.continuation.finite_states import course, depends_on_way
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.finite_relaxation import RelaxingCourse
from solver.equilibrium.newton import EquilibriumState
from solver.equilibrium.step_error import Steps
from solver.scene import Scene


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

    def after(times: float) -> EquilibriumState:
        return shape if times == 1.0 and not relaxes(scene) else end(finger, scene, stop, times)

    return Steps.asked(after, finger.all_numbers, scene.solve.tolerance)


def times_on_way(scene: Scene, finger: FiniteFinger, stop: Callable[[], bool]) -> int:
    """Return how many times the usual load steps a history takes whose end does not depend on them.

    Those that a tolerance asks for at the end of its press, judged on a mesh. Raises NotConverged, Cancelled.
    """
    if scene.solve.course == "steady" or scene.solve.tolerance is None or scene.friction.mu == 0.0:
        return 1
    press = scene.pressed_only()
    steps = steps_asked(press, finger, end(finger, press, stop), stop)
    return 1 if steps is None else steps.times
