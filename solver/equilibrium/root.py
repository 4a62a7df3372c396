"""Search for the place at which something that grows meets what is given: the travel at which a drag is met."""

from collections.abc import Callable
from typing import TypeVar

State = TypeVar("State")
FIRST, FURTHEST = 1e-7, 1.0  # first stride [mm], and where the search for two ends is given up
SEARCHES = 60
UNMET = 1e-9  # part of the friction limit by which a given drag may be missed


def find_root(at: Callable[[float], tuple[float, State]], start: float, close: float) -> State | None:
    """Return the state in which what `at` tells of a place is 0 to `close`, sought from `start` on; None where none is.

    The function grows with the place, and comes with the state there: strides that double find two ends, and regula
    falsi with the Illinois rule (Dowell and Jarratt 1971) what lies between.

    >>> round(find_root(lambda x: (x**3 - 8e-9, x), 0.0, 1e-18), 9)
    0.002
    """
    here = there = start
    off, state = at(start)
    beyond, stride = off, FIRST if off < 0.0 else -FIRST
    while beyond * off > 0.0:
        here, off = there, beyond
        there, stride = there + stride, 2.0 * stride
        if abs(stride) > FURTHEST:
            return None
        beyond, state = at(there)
    for _ in range(SEARCHES):
        if abs(beyond) <= close:
            return state
        between = there - beyond * (there - here) / (beyond - off)
        new, state = at(between)
        if new * beyond < 0.0:
            here, off = there, beyond
        else:
            off /= 2.0
        there, beyond = between, new
    return None
