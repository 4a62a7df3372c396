"""Mean rates of the quantities at the ending in press, break-away and slide of a load path, with error estimates.

For error estimates the load path is marched again on the nested mesh, and in fewer steps on the answer's mesh
(`solver.accuracy.error_estimate`). Edges of contact are left out where tissues relax, because the strain history is
valid only for the given edges.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from solver.accuracy.adaptivity import FingerState
from solver.accuracy.convergence_order import refuse_folds
from solver.accuracy.error_estimate import PARTS, WIDTH, edge_changes, edge_errors, half_width
from solver.arrays import Array
from solver.contact import ForceLoad
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import KINDS, Finger
from solver.equilibrium.load_path import PRESSING_TIME, LoadPath, march_scene
from solver.failures import SolveFailure
from solver.prediction import History, Prediction
from solver.quantities import NAMES
from solver.response import history
from solver.scene import Scene

FULL_SLIP = 1.0 - 1e-9  # part of the touching nodes that slips when all do [-]


class Rates(NamedTuple):
    """Mean rates of one quantity, in its unit per second; nan for a part that a load path does not have."""

    press: float  # from first touch until the bone slides or is dragged along the surface
    break_away: float  # from there until all of the contact slips
    slide: float  # from full slip to the end: 0 once the state is settled


def rates(history: History) -> Mapping[str, Rates]:
    """Return the mean rates of every quantity by name; `course_errors` returns their errors."""
    time = np.concatenate([[0.0], history.time])  # undeformed at first touch
    values = np.concatenate([np.zeros((1, len(NAMES))), history.responses])
    first, last, end = instants(history)
    parts = np.array([_mean(time, values, *part) for part in ((0, first), (first, last), (last, end))])
    return {name: Rates(*row) for name, row in zip(NAMES, parts.T.tolist(), strict=True)}


def instants(history: History) -> tuple[int, int, int]:
    """Return the numbers of instants up to the end of the press, up to full slip, and in total.

    A part that is not reached ends with the previous part.
    """
    count = len(history.time)
    # Under given forces the bone may move along the surface during the press too.
    moving = np.flatnonzero((history.time > PRESSING_TIME) & (np.abs(history.bone_x) > 0.0))
    first = int(moving[0]) if len(moving) else count
    slip = np.flatnonzero((history.slipping >= FULL_SLIP) & (np.arange(count) >= first))
    return first, int(slip[0]) + 1 if len(slip) else count, count


def _mean(time: Array, values: Array, begin: int, end: int) -> Array:
    """Return the mean rates (q,) between two instants."""
    step = float(time[end] - time[begin])
    growth: Array = values[end] - values[begin]
    return growth / (step if step > 0.0 else np.nan)


INSTANTS = ("press", "break_away", "slide")  # parts at whose ends the results are taken
# followed by the quantities
COURSE_NUMBERS = ("sed_ending", "sed_point", "normal_force", "tangential_force", "contact_width")
_PLACES = [0, 6, 1, 2, 5]  # indices of these in `Finger.all_numbers`, in which quantities begin at index 7


@dataclass(frozen=True, slots=True, eq=False)
class CourseNumbers:
    """The results of a load path at three instants and in three parts, or their errors; nan for a missing part."""

    value: Array  # (3, 5 + q) at INSTANTS: COURSE_NUMBERS, then every quantity at the ending, each in its unit
    rate: Array  # (3, q) in the parts that end there, per second


def course_numbers(course: History) -> CourseNumbers:
    """Return the results of a load path."""
    table = np.column_stack([*(getattr(course, name) for name in COURSE_NUMBERS), course.responses])
    ends = instants(course)
    values = np.array(
        [table[end - 1] if end > begin else table[0] * np.nan for begin, end in zip((0, *ends), ends, strict=False)]
    )
    return CourseNumbers(values, np.array([rates(course)[name] for name in NAMES]).T)


def course_errors(prediction: Prediction) -> CourseNumbers:
    """Return the error estimates of a prediction's history, nan where the nested mesh has no such load path."""
    assert prediction.history is not None
    usual = course_numbers(prediction.history)
    scene, geometry = prediction.scene, prediction.geometry
    kind = KINDS[scene.solve.kinematics]
    mesh, nested = kind.on(scene, geometry), kind.of(scene, replace(geometry.sizing, halved=True))

    def march_on(finger: Finger[Any], part: float) -> LoadPath:
        return march_scene(scene, finger, part, relaxing=scene.materials.relax)

    def states_at(path: LoadPath, course: History) -> list[EquilibriumState]:
        return [path.instants[end - 1 - len(course.time)].state for end in instants(course)]

    try:
        paths = [march_on(mesh, part) for part in PARTS.tolist()]
        courses = [history(scene, mesh, path) for path in paths]
        path = march_on(nested, float(PARTS[0]))
        course = history(scene, nested, path)
        for state in states_at(path, course):
            refuse_folds(nested, state)
    except SolveFailure:
        return CourseNumbers(usual.value * np.nan, usual.rate * np.nan)
    finer, fewer = course_numbers(course), [course_numbers(numbers) for numbers in courses]
    edges = np.zeros((2, *usual.value.shape))
    if not scene.materials.relax:
        at_ends = zip(states_at(paths[0], courses[0]), states_at(path, course), strict=True)
        edges += np.stack([_edge_errors(scene, (mesh, a), (nested, b)) for a, b in at_ends], axis=1)
    times = np.concatenate([[0.0], course.time])[[0, *instants(course)]]
    of_quantities = np.pad(edges[:, :, len(COURSE_NUMBERS) :], ((0, 0), (1, 0), (0, 0)))
    with np.errstate(divide="ignore", invalid="ignore"):  # of a missing part
        rate_edges = (of_quantities[:, 1:] + of_quantities[:, :-1]) / np.diff(times)[:, None]

    def error(name: str, by_edges: Array) -> Array:
        value, nested_value, *by_part = (getattr(numbers, name) for numbers in (usual, finer, *fewer))
        by_steps = sum(
            abs(number - value) / (1.0 / part - 1.0) for number, part in zip(by_part, PARTS.tolist(), strict=True)
        )
        return half_width(nested_value - by_part[0], by_edges[:, None]) + by_steps

    return CourseNumbers(error("value", edges), error("rate", rate_edges))


def _edge_errors(scene: Scene, answer: FingerState, nested: FingerState) -> Array:
    """Return the `edge_errors` (2, 5 + q) of the results at an instant, summed over edges of contact."""

    def changes(finger: Finger[Any], state: EquilibriumState) -> Array:
        by_force = scene.normal_force is not None
        forces = ForceLoad(float(state.normal.sum()), None, state.load.travel) if by_force else None
        return edge_changes(finger.newton, state, forces, finger.all_numbers)[1]

    sums = edge_errors(changes(*answer), changes(*nested), linear=[WIDTH]).sum(axis=1)
    return np.concatenate([sums[:, _PLACES], sums[:, len(_PLACES) + 2 :]], axis=1)
