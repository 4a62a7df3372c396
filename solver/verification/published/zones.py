"""Half-width of a zone on the skin, such as the stick zone, to a fraction of an element."""

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.contact import last_edge


def half_width(x: Array, force: Array, inside: NDArray[np.bool_]) -> float:
    """Return the half-width of the zone of nodes `inside` (k,), at whose ends a `force` (k,) falls like a pressure.

    Returns nan where the zone is too short.
    """
    high, low = last_edge(x, force, inside), last_edge(-x[::-1], force[::-1], inside[::-1])
    return float("nan") if high is None or low is None else (high + low) / 2.0


def half_above(x: Array, value: Array) -> float:
    """Return the half-width of the zone of `value` (k,) above 0, interpolated between nodes; 0 without such a zone.

    >>> half_above(np.array([-2.0, -1.0, 0.0, 1.0, 2.0]), np.array([-1.0, -0.5, 0.5, -1.5, -2.0]))
    0.375
    """
    above = np.flatnonzero(value > 0.0)
    if not len(above):
        return 0.0
    first, last = int(above[0]), int(above[-1])
    low = np.interp(0.0, value[first - 1 : first + 1], x[first - 1 : first + 1])
    high = np.interp(0.0, value[last : last + 2][::-1], x[last : last + 2][::-1])
    return float(high - low) / 2.0
