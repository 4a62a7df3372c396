"""Ends of courses at finite strain that depend on their way: how many load steps they take."""

from collections.abc import Callable

from solver.continuation.finite_states import course, depends_on_way
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.load_path import Steps, march
from solver.equilibrium.newton import EquilibriumState
from solver.scene.scene import Scene


def relaxes(scene: Scene) -> bool:
    """Return whether the course of a scene is marched in time."""
    return scene.materials.relax and scene.solve.course == "history"


def end(finger: FiniteFinger, scene: Scene, stop: Callable[[], bool], times: float = 1.0) -> EquilibriumState:
    """Return the end of a course, in so many `times` the usual load steps. Raises NotConverged, Cancelled."""
    if relaxes(scene):
        return march(scene, finger, times, relaxing=True, stop=stop).last
    return course(scene, finger, stop, times).last


def steps_asked(
    scene: Scene, finger: FiniteFinger, stop: Callable[[], bool], shape: EquilibriumState | None = None
) -> Steps | None:
    """Return the load steps that a scene asks for, judged on a mesh, on which it may have led to `shape` already.

    None where that is a settled slide. Raises NotConverged, Cancelled.
    """
    usual = end(finger, scene, stop) if shape is None else shape
    if not depends_on_way(scene, usual):
        return None

    def after(times: float) -> EquilibriumState:
        settled_only = shape is not None and relaxes(scene)
        return usual if times == 1.0 and not settled_only else end(finger, scene, stop, times)

    return Steps.asked(after, finger.all_numbers, scene.solve.tolerance)
