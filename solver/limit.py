"""How far settled sliding exists: the branch of sliding states followed by its arc length to its limit point.

Pressed hard and dragged against its tip, the skin behind the contact folds: the friction coefficient (or the depth)
passes a maximum along the branch, and beyond it there is no settled state. Riks 1979, Int. J. Solids Struct. 15, 529;
Crisfield 1981, Comput. Struct. 13, 55, with the plane of Riks.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver.crossing import crosses_itself, least_stretch
from solver.failures import Cancelled, NotConverged
from solver.mesh import Array, Indices
from solver.newton import BY_DEPTH, BY_FRICTION, EQUILIBRIUM, Newton, Pull, Shape
from solver.sliding import settled

LARGEST_MU = 2.0  # beyond this a coefficient of friction is not looked for
TOLERANCE = 1e-6  # of a point on the branch [mm]
TURN = 0.7  # least cosine between the directions of the branch and of a step along it
SQUEEZE = 0.85  # least ratio of the skin's least stretches at neighbouring points: a leap to a folded branch has less
STEEP = 0.1  # least part of the value in the branch's direction, at an end that is no limit point
FOLDED = 0.5  # and least stretch there may be: surfaces fold at 0.544 (Biot 1963); beyond, the mesh decides


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """A branch of settled sliding states."""

    last: Shape  # the state at the value asked for, or the last one before the limit
    value: float  # of the coefficient or the depth [mm] there: the largest one met
    limited: bool  # whether the branch ends there, short of what was asked for
    squeezed: bool = False  # whether it ends for the skin's squeeze alone, far from a limit point: as the mesh has it


def follow(
    newton: Newton,
    start: Shape,
    by: int,
    target: float,
    outline: Indices,
    stop: Callable[[], bool] = lambda: False,
) -> Branch:
    """Follow the branch from `start` until the friction coefficient (BY_FRICTION) or depth (BY_DEPTH) reaches `target`.

    `outline` (o,) are the nodes of the whole skin in order, which must not cross itself. Raises Cancelled where `stop`
    says so.
    """
    shape, previous = start, None
    value = _value(start.pull, by)
    reach = min(abs(target - value), LARGEST_MU)
    length = 0.1 * reach
    largest, best = value, start
    for _ in range(400):
        if stop():
            raise Cancelled
        direction, rate = _tangent(newton, shape, by)
        if previous is not None and direction @ previous[0] + rate * previous[1] < 0.0:
            direction, rate = -direction, -rate
        if previous is not None and rate <= 0.0:
            return Branch(best, largest, limited=True)
        while True:
            found = _next(newton, shape, by, direction, rate, length, target)
            if found is not None and not leapt(newton, shape, found, outline):
                break
            length /= 2.0
            if length < 1e-4 * reach:
                return Branch(best, largest, limited=True, squeezed=rate > STEEP)
        easy = found.iterations - shape.iterations <= 5
        previous, shape = (direction, rate), found
        value = _value(shape.pull, by)
        if value > largest:
            largest, best = value, shape
        if value >= target * (1.0 - 1e-12):
            return Branch(shape, value, limited=False)
        length *= 1.5 if easy else 1.0
    return Branch(best, largest, limited=True)


def largest_friction(
    newton: Newton,
    pull: Pull,
    outline: Indices,
    target: float | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Branch:
    """Follow settled sliding at the depth and bound of `pull` from mu = 0 to `target`, LARGEST_MU where there is none.

    Raises NotConverged where not even the frictionless state is found.
    """
    start = settled(newton, pull._replace(mu=0.0), None, TOLERANCE, stop)
    return follow(newton, start, BY_FRICTION, LARGEST_MU if target is None else target, outline, stop)


def largest_depth(newton: Newton, pull: Pull, outline: Indices, stop: Callable[[], bool] = lambda: False) -> Branch:
    """Follow settled sliding at the friction of `pull` from a small depth to the depth of `pull`.

    Raises NotConverged where there is none even at a hundredth of that depth.
    """
    for part in (0.3, 0.1, 0.03, 0.01):
        try:
            start = settled(newton, pull._replace(depth=part * pull.depth), None, TOLERANCE, stop)
        except NotConverged:
            continue
        if not _crossed(newton, start, outline):
            return follow(newton, start, BY_DEPTH, pull.depth, outline, stop)
    raise NotConverged(f"no sliding state was found at mu = {pull.mu:.3g} even at {0.01 * pull.depth:.3g} mm")


def _value(pull: Pull, by: int) -> float:
    return pull.mu if by == BY_FRICTION else pull.depth


def _with(pull: Pull, by: int, value: float) -> Pull:
    return pull._replace(mu=value) if by == BY_FRICTION else pull._replace(depth=value)


def _crossed(newton: Newton, shape: Shape, outline: Indices) -> bool:
    return crosses_itself(newton.body.mesh.nodes[outline] + shape.u[outline])


def leapt(newton: Newton, before: Shape, after: Shape, outline: Indices) -> bool:
    """Return whether a step went to another branch, where the skin is folded."""
    nodes = newton.body.mesh.nodes[outline]
    squeezed = [least_stretch(nodes, nodes + shape.u[outline]) for shape in (before, after)]
    return squeezed[1] < max(SQUEEZE * squeezed[0], FOLDED) or _crossed(newton, after, outline)


def _tangent(newton: Newton, shape: Shape, by: int) -> tuple[Array, float]:
    """Return the direction of the branch, of unit length: per unknown over root n [mm], and of the value."""
    newton.linearise(shape, shape.pull, newton.skin_x)
    direction = newton.steps[:, by] / np.sqrt(len(newton.steps))
    size = np.sqrt(direction @ direction + 1.0)
    return direction / size, 1.0 / size


def _next(
    newton: Newton, start: Shape, by: int, direction: Array, rate: float, length: float, target: float
) -> Shape | None:
    """Return the state `length` further along the branch, or at `target` where that is nearer; None where not found."""
    root = np.sqrt(len(newton.steps))
    value = _value(start.pull, by)
    to_target = rate * length >= target - value
    shape, pull = start, start.pull
    gone = np.zeros(len(newton.steps))
    for _ in range(12):
        if not newton.linearise(shape, pull, newton.skin_x):
            return None
        to, along = newton.steps[:, EQUILIBRIUM] / root, newton.steps[:, by] / root
        now = _value(pull, by)
        if to_target:
            change = target - now
        else:
            ahead = direction @ along + rate
            if ahead == 0.0:
                return None
            change = (length - direction @ (gone + to) - rate * (now - value)) / ahead
        step = to + change * along
        pull = _with(pull, by, now + change)
        shape, largest, changed = newton.moved(shape, pull, step * root, newton.skin_x)
        gone = gone + step
        if not largest < 10.0:
            return None
        if largest < TOLERANCE and not changed:
            way = np.sqrt(gone @ gone + (_value(pull, by) - value) ** 2)
            straight = direction @ gone + rate * (_value(pull, by) - value)
            return shape if straight > TURN * way else None
    return None
