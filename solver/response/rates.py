"""How fast every quantity at the ending changes in the three parts of a course: press, break-away and slide."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.prediction import History
from solver.quantities import NAMES

ALL = 1.0 - 1e-9  # part of the touching nodes that slips when all do [-]


class Rates(NamedTuple):
    """Mean rates of one quantity, in its unit per second; nan for a part that a course has not."""

    press: float  # from first touch until the bone moves along the surface
    break_away: float  # from then until all of the contact slips
    slide: float  # from then to the end: 0 once nothing changes any more


def rates(history: History) -> Mapping[str, Rates]:
    """Return the mean rates of every quantity, by its name; `solver.response.course_errors` has their errors."""
    time = np.concatenate([[0.0], history.time])  # undeformed at first touch
    values = np.concatenate([np.zeros((1, len(NAMES))), history.responses])
    first, last, end = instants(history)
    parts = np.array([_mean(time, values, *part) for part in ((0, first), (first, last), (last, end))])
    return {name: Rates(*row) for name, row in zip(NAMES, parts.T.tolist(), strict=True)}


def instants(history: History) -> tuple[int, int, int]:
    """Return how many instants there are up to the end of the press, up to full slip, and in all.

    They are one number where a course does not come so far.
    """
    count = len(history.time)
    moved = np.flatnonzero(np.abs(history.bone_x) > 0.0)
    first = int(moved[0]) if len(moved) else count
    slip = np.flatnonzero((history.slipping >= ALL) & (np.arange(count) >= first))
    return first, int(slip[0]) + 1 if len(slip) else count, count


def _mean(time: Array, values: Array, begin: int, end: int) -> Array:
    """Return the mean rates (q,) between two instants."""
    step = float(time[end] - time[begin])
    grown: Array = values[end] - values[begin]
    return grown / (step if step > 0.0 else np.nan)
