"""Equilibria under given forces: the depth, and under a given drag the travel too, are unknowns.

Newton on the bordered system: the columns that say how the body follows depth and travel come with every linear solve,
and from them follows which change of both makes up for the forces that are missing.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import TypeVar

from solver._kernels import STICK
from solver.arrays import Array
from solver.equilibrium.load_stepping import advance
from solver.equilibrium.newton import CONTROL, EQUILIBRIUM, EquilibriumState, Given, LoadState, Newton, lowered
from solver.failures import ContactLost, NotConverged, followed_to
from solver.progress import report_progress
from solver.tolerances import UNMET

State = TypeVar("State")
FIRST, FURTHEST = 1e-7, 1.0  # first stride [mm], and where the search for two ends is given up
SEARCHES = 60


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


def corrected(
    newton: Newton, shape: EquilibriumState, given: Given, origin: Array, before: float, *, kept: bool = False
) -> tuple[EquilibriumState, float, int] | None:
    """Return the shape after one iteration towards the forces, its largest displacement, and changed contact states.

    `origin` (k,) are the positions along x where the skin's nodes were when the surface had travelled `before`. With
    `kept` the tangent is the last one. None where there is no way.
    """
    load = shape.load
    if given.tangential is None:
        load = load._replace(travel=given.travel)
    linearise = newton.relinearise if kept else newton.linearise
    if not linearise(shape, load, origin + load.travel - before, 0, given):
        return None
    deeper, along = newton.system.motion.tolist()
    load = load._replace(depth=load.depth + deeper, travel=load.travel + along)
    after, largest, changed = newton.moved(shape, load, newton.steps[:, EQUILIBRIUM], origin + load.travel - before)
    return after, max(largest, abs(deeper), abs(along)), changed


def balanced(
    newton: Newton, start: EquilibriumState, given: Given, tolerance: float = 1e-8, limit: int = 30
) -> EquilibriumState:
    """Return the equilibrium under `given`, one backward Euler step from `start`, whose load has friction and sense.

    Raises NotConverged where `limit` iterations do not do it.
    """
    try:
        shape = _iterated(newton, start, start, given, tolerance, limit)
    except ContactLost:  # as where friction is so small that all but one node slip
        if given.tangential is None:
            raise
        return _met_by_travel(newton, start, start, given, tolerance, limit)
    return _met_by_travel(newton, start, shape, given, tolerance, limit) if _slips_freely(shape, given) else shape


def _iterated(
    newton: Newton, start: EquilibriumState, begin: EquilibriumState, given: Given, tolerance: float, limit: int
) -> EquilibriumState:
    """Return the equilibrium one step from `start`, sought from `begin` on. Raises NotConverged."""
    origin, before = start.place(newton.condensed)[:, 0], start.load.travel
    shape = begin
    if newton.condensed.constant:
        if given.tangential is None:
            shape = replace(shape, load=shape.load._replace(travel=given.travel))
        return newton.solved(shape, shape.load, origin + shape.load.travel - before, given)
    for _ in range(limit):
        done = corrected(newton, shape, given, origin, before)
        if done is None:
            raise NotConverged("the body would turn inside out, or nothing holds it along the surface")
        shape, largest, changed = done
        if not largest < CONTROL.unbounded:
            raise NotConverged("the displacements grow without bound")
        if largest < tolerance and not changed:
            return shape
    raise NotConverged(f"no equilibrium within {limit} iterations")


def _slips_freely(shape: EquilibriumState, given: Given) -> bool:
    """Return whether all that touches slips, so that nothing was there to meet the given drag, and it is not met."""
    if given.tangential is None or not shape.load.mu > 0.0 or (shape.state == STICK).any():
        return False
    return abs(shape.force[0] - given.tangential) > UNMET * shape.load.mu * given.normal


def _met_by_travel(
    newton: Newton, start: EquilibriumState, shape: EquilibriumState, given: Given, tolerance: float, limit: int
) -> EquilibriumState:
    """Return the equilibrium that meets the given drag, one step from `start`, its travel sought from `shape` on.

    The travel holds a body of which nothing sticks, and the drag grows with it. Raises NotConverged.
    """
    wanted, near = given.tangential or 0.0, shape

    def at(travel: float) -> tuple[float, EquilibriumState]:
        nonlocal near
        near = _iterated(newton, start, near, Given(given.normal, None, travel), tolerance, limit)
        return float(near.force[0]) - wanted, near

    found = find_root(at, shape.load.travel, UNMET * shape.load.mu * given.normal)
    if found is None:
        raise NotConverged("no travel meets the drag")
    return found


def march(
    newton: Newton,
    start: EquilibriumState,
    begin: Given,
    course: Iterable[Given],
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[EquilibriumState]:
    """Yield the equilibrium at each aim of `course`, from `start`, which is that at `begin`.

    A step that fails is cut in two. Raises NotConverged, saying where, Cancelled where `stop` says so, and ValueError
    for forces that are none.
    """
    shape, begin = start, begin.checked()
    for number, aim in enumerate(aims := [aim.checked() for aim in course]):
        if len(aims) > 1:
            report_progress("letting the forces grow step by step", number / len(aims))

        def step(part: float, begin: Given = begin, aim: Given = aim) -> None:
            nonlocal shape
            shape = balanced(newton, lowered(newton.condensed, shape), begin.towards(aim, part))

        advance(step, lambda _done, _part, why: followed_to(shape.load.depth, shape.load.travel, why), stop=stop)
        begin = aim
        yield shape


def untouched(newton: Newton, mu: float, tau: float) -> EquilibriumState:
    """Return the undeformed body over a surface with this friction."""
    return replace(EquilibriumState.undeformed(newton.condensed), load=LoadState(0.0, mu, tau).checked())
