"""The settled sliding state directly: every touching point slips, so nothing is left of how it came there."""

from collections.abc import Callable

from solver.equilibrium.newton import Newton, Pull, Shape
from solver.failures import Cancelled, NotConverged
from solver.progress import tell

FIRST_TOLERANCE = 1e-3  # of the steps that only lead to the last one [mm]; looser ones go astray near nu = 0.5
WORK = 80  # tangents after which no more steps are halved: a state that is there takes 5 to 30
SMALLEST = 1.0 / 64.0  # part of the way below which a failing step is given up


def settled(
    newton: Newton,
    pull: Pull,
    start: Shape | None = None,
    tolerance: float = 1e-10,
    stop: Callable[[], bool] = lambda: False,
) -> Shape:
    """Return the sliding state under `pull` (sense +1 or -1), from undeformed or from `start`, in one step.

    A step that fails is halved, depth, friction and bound together. Raises NotConverged where that does not help,
    Cancelled where `stop` says so, ValueError for a pull that is none.
    """
    pull = pull.checked()
    shape = Shape.undeformed(newton.body) if start is None else start
    begin = shape.pull if start is not None else Pull(0.0, pull.mu, pull.tau, pull.sense)
    done, part = 0.0, 1.0
    used, most = 0, newton.systems + WORK
    while done < 1.0:
        if stop():
            raise Cancelled
        if part < 1.0:
            tell(f"coming to sliding at mu = {pull.mu:.3g} in small steps", done)
        aim = min(done + part, 1.0)
        try:
            shape = newton.settle(shape, _between(begin, pull, aim), tolerance if aim == 1.0 else FIRST_TOLERANCE)
        except NotConverged as reason:
            part /= 2.0
            used += 1
            if part < SMALLEST or used > 12 or begin == pull or newton.systems > most:
                raise NotConverged(
                    f"no sliding state was found beyond {_between(begin, pull, done).depth:.3g} mm of indentation at "
                    f"mu = {_between(begin, pull, done).mu:.3g}: {reason}, in steps of 1/{1 / part:.0f} of the way"
                ) from reason
        else:
            done = aim
    return shape


def _between(begin: Pull, end: Pull, part: float) -> Pull:
    """Return the pull `part` of the way; a bound that was not there before takes its value at once."""
    if part == 1.0:
        return end
    both = begin.tau < float("inf") and end.tau < float("inf")
    tau = begin.tau + part * (end.tau - begin.tau) if both else end.tau
    mu = begin.mu + part * (end.mu - begin.mu)
    return Pull(begin.depth + part * (end.depth - begin.depth), mu, tau, end.sense)
