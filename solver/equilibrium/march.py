"""The course in time: pressing, sticking, partial slip, sliding, turning round, one equilibrium after another."""

from collections.abc import Callable, Iterable, Iterator

from solver.equilibrium.load_stepping import advance
from solver.equilibrium.newton import EquilibriumState, LoadState, Newton
from solver.failures import followed_to
from solver.progress import report_progress


def press_and_slide(
    depth: float, mu: float, tau: float, direction: int, press: int, slides: int, distance: float
) -> list[LoadState]:
    """Return the course of a bone driven `depth` [mm] down in `press` steps, then `distance` [mm] along in `slides`.

    `direction` is that of the bone, +1 along +x: the surface goes the other way.

    >>> [(p.depth, p.travel) for p in press_and_slide(1.0, 0.3, 0.02, +1, press=2, slides=2, distance=4.0)]
    [(0.5, 0.0), (1.0, 0.0), (1.0, -2.0), (1.0, -4.0)]
    """
    down = [LoadState(depth * (i + 1) / press, mu, tau) for i in range(press)]
    along = [LoadState(depth, mu, tau, travel=-direction * distance * (i + 1) / slides) for i in range(slides)]
    return down + along


def march(
    newton: Newton,
    course: Iterable[LoadState],
    start: EquilibriumState | None = None,
    tolerance: float = 1e-7,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[EquilibriumState]:
    """Yield the equilibrium at each load state of `course`, from undeformed or `start`; a failing step is cut in two.

    Backward Euler: within a step a point sticks where it was or slips from there. Raises NotConverged, saying where,
    Cancelled where `stop` says so, and ValueError for a load state that is none.
    """
    shape = EquilibriumState.undeformed(newton.condensed) if start is None else start
    for number, load in enumerate(loads := [load.checked() for load in course]):
        if len(loads) > 1:
            report_progress("pressing and sliding step by step", number / len(loads))
        begin = shape.load

        def step(part: float, begin: LoadState = begin, load: LoadState = load) -> None:
            nonlocal shape
            shape = newton.settle(shape, between(begin, load, part), tolerance)

        advance(step, lambda _done, _part, why: followed_to(shape.load.depth, shape.load.travel, why), stop=stop)
        yield shape


def between(begin: LoadState, end: LoadState, part: float) -> LoadState:
    """Return the load state `part` of the way along a step, whose friction is that of its end."""
    if part == 1.0:
        return end
    depth = begin.depth + part * (end.depth - begin.depth)
    return end._replace(depth=depth, travel=begin.travel + part * (end.travel - begin.travel))
