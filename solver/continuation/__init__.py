"""Arc-length continuation of a branch of settled slides to its limit point or to the folding of the skin.

Under a deep press and a drag towards the tip, the skin behind the contact folds. Then the friction coefficient or the
depth passes a maximum along the branch, or the surface of the skin loses stability at one place. Beyond, there is no
settled state. The constraint is the plane of Riks (1979, Int. J. Solids Struct. 15, 529; Crisfield 1981, Comput.
Struct. 13, 55).

A compressed half-space loses stability at all wavelengths at once (Biot 1963, Appl. Sci. Res. A 12, 168). There the
surface impedance, which maps displacements exp(i k X) to tractions, is singular. The equations of a free surface are
ill-posed at that stretch, and finer meshes come ever nearer to it. The theory is that of small motions on a large
strain (Dowaikh and Ogden 1990, IMA J. Appl. Math. 44, 261), here for any law in plane strain.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.body.skin import SkinCompression
from solver.constitutive import Law, stress, tangent
from solver.equilibrium import BY_FRICTION, EQUILIBRIUM, EquilibriumState, LoadState, Newton
from solver.failures import NotConverged
from solver.progress import check_stop, report_progress

_ROUND_OFF = 1e-12  # relative difference below which a target is reached
LARGEST_MU = 2.0  # largest coefficient of friction to which a branch is followed


@dataclass(frozen=True, slots=True)
class BranchControl:
    """Control of the continuation and of its end; steps are fractions of the largest range.

    A tolerance of 1e-6 mm changed no limit of eleven slides by more than 0.013 %, steps a quarter as long by 0.17 %.
    """

    tolerance: float = 1e-4  # of a point on the branch [mm]
    first: float = 0.1  # first step along the branch
    shortest: float = 1e-3  # shortest step
    growth: float = 1.5  # ratio of the next step to one with few iterations
    easy: int = 5  # iterations that count as few
    corrections: int = 12  # iterations for a point, at most
    most: int = 400  # points, at most
    turn: float = 0.7  # least cosine between the directions of the branch and of a step along it
    squeeze: float = 0.85  # smallest ratio of least stretches at consecutive points: a jump to a fold has less
    crease: float = 0.6  # kink from which skin has a crease: smooth skin on coarse meshes has 0.3, creases 1 and more
    steep: float = 0.1  # share of the parameter in the tangent from which a limit point is far
    hops: int = 3  # attempts to continue beyond the end of a branch
    hop: tuple[float, ...] = (0.01, 0.03)  # relative steps of the parameter for that
    force_change: float = 0.05  # largest relative change of the forces in such a step
    apart: float = 0.04  # largest difference of least stretches at consecutive points
    aim: float = 0.5  # part of that difference at which a step aims


BRANCH = BranchControl()


class BranchBody(Protocol):
    """A body with skin on which a branch can be followed."""

    @property
    def newton(self) -> Newton:
        """Newton's method on the body."""
        ...

    def skin_compression(self, state: EquilibriumState) -> SkinCompression:
        """Return how far the skin is squeezed, and whether it has a crease."""
        ...

    def crosses(self, state: EquilibriumState) -> bool:
        """Return whether the skin crosses itself."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """A branch of settled slides; its last state is at the target, a step beyond it, or the last before the limit."""

    states: tuple[EquilibriumState, ...]
    value: float  # largest friction coefficient or depth [mm] on it
    limited: bool  # whether the branch ends before its target
    lost: bool = False  # whether only the corrector failed there, far from a limit point and from a fold
    length: float | None = None  # of the next step along it, where it continues

    @property
    def last(self) -> EquilibriumState:
        """The last state."""
        return self.states[-1]


def continue_branch(finger: BranchBody, start: EquilibriumState, by: int, target: float, folds: float) -> Branch:
    """Follow a branch as `trace` does, up to exactly `target`."""
    return stop_at(finger, trace(finger, start, by, target, folds), by, target)


def trace(
    finger: BranchBody, start: EquilibriumState, by: int, target: float, folds: float, length: float | None = None
) -> Branch:
    """Follow a branch as `follow` does, and continue where it turns back only over a short stretch."""
    branch = follow(finger, start, by, target, folds, length)
    for _ in range(BRANCH.hops):
        beyond = _beyond(finger, branch, by, target, folds) if branch.limited else None
        if beyond is None:
            break
        hop = follow(finger, beyond, by, target, folds)
        branch = replace(hop, states=(*branch.states, *hop.states))
    return branch


def _beyond(finger: BranchBody, branch: Branch, by: int, target: float, folds: float) -> EquilibriumState | None:
    """Return a state a little beyond the end of a branch; None where it really ends.

    Where a node of the contact reaches the shear limit, a discrete branch may turn back over a short stretch.
    """
    last = branch.last
    compression = finger.skin_compression(last)
    if compression.least < folds + BRANCH.apart:
        return None
    for part in BRANCH.hop:
        value = min((1.0 + part) * branch.value, target)
        try:
            there = finger.newton.settle(last, with_value(last.load, by, value), BRANCH.tolerance)
        except NotConverged:
            continue
        near = abs(there.force - last.force).max() <= BRANCH.force_change * abs(last.force).max()
        if (
            near
            and finger.skin_compression(there).least > compression.least - BRANCH.apart
            and not jumped_branch(finger, last, there)
        ):
            return there
    return None


def follow(
    finger: BranchBody, start: EquilibriumState, by: int, target: float, folds: float, length: float | None = None
) -> Branch:
    """Follow the branch from `start` until the friction coefficient (BY_FRICTION) or depth (BY_DEPTH) passes `target`.

    It ends where that parameter passes a maximum, or where the least stretch of the skin reaches `folds`. `length` is
    that of the first step. In friction no step depends on `target`, so that all targets beyond the end have one limit.
    """
    way = [_Point(start, finger.skin_compression(start), value_of(start.load, by))]
    best = 0  # the point with the largest parameter
    scale = LARGEST_MU if by == BY_FRICTION else target - way[0].value
    shortest = BRANCH.shortest * scale
    length = BRANCH.first * scale if length is None else length
    direction, rate = _tangent(finger.newton, start, by)
    doing = f"following sliding to its {'largest friction' if by == BY_FRICTION else 'largest depth'}"

    def finish(value: float, *, limited: bool = True, lost: bool = False) -> Branch:
        return Branch(tuple(point.state for point in way[: best + 1]), value, limited, lost, length)

    while way[best].value < target * (1.0 - _ROUND_OFF):
        check_stop()
        report_progress(doing, way[best].value / target)
        last = way[-1]
        step = _further(finger, last, by, direction, rate, length, shortest)
        if step is None or len(way) > BRANCH.most:
            lost = rate > BRANCH.steep and last.compression.least > folds + BRANCH.apart
            return finish(way[best].value, lost=lost)
        point, length = step
        fall = last.compression.least - point.compression.least
        if point.compression.least < folds:
            part = min(max((last.compression.least - folds) / fall, 0.0), 1.0)
            return finish(max(way[best].value, last.value + part * (point.value - last.value)))
        way.append(point)
        if point.value > way[best].value:
            best = len(way) - 1
        easy = point.state.iterations - last.state.iterations <= BRANCH.easy
        most = BRANCH.growth * length if easy else length
        if fall > 0.0:  # the next step aims at a part of the largest fall of the stretch, or just beyond the fold
            aim = min(BRANCH.aim * BRANCH.apart, BRANCH.growth * (point.compression.least - folds))
            most = min(most, max(aim / fall * length, shortest))
        before, length = (direction, rate), most
        direction, rate = _tangent(finger.newton, point.state, by)
        if direction @ before[0] + rate * before[1] < 0.0:
            direction, rate = -direction, -rate
        if rate <= 0.0:
            return finish(way[best].value)
    return finish(way[best].value, limited=False)


def stop_at(finger: BranchBody, branch: Branch, by: int, target: float) -> Branch:
    """Return a branch up to `target`; the whole branch where it ends before."""
    if branch.value < target * (1.0 - _ROUND_OFF):
        return branch
    values = [value_of(state.load, by) for state in branch.states]
    after = next((number for number, value in enumerate(values) if value >= target), len(values))
    if after < len(values) and values[after] <= target * (1.0 + _ROUND_OFF):
        return Branch(branch.states[: after + 1], values[after], limited=False)
    for near in branch.states[max(after - 1, 0) : after + 1]:
        with suppress(NotConverged):
            state = finger.newton.settle(near, with_value(near.load, by, target), BRANCH.tolerance)
            if not jumped_branch(finger, near, state):
                return Branch((*branch.states[:after], state), target, limited=False)
    return Branch(branch.states[:after], values[after - 1], limited=True, lost=True)


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    state: EquilibriumState
    compression: SkinCompression
    value: float


def _further(
    finger: BranchBody,
    last: _Point,
    by: int,
    direction: Array,
    rate: float,
    length: float,
    shortest: float,
) -> tuple[_Point, float] | None:
    """Return the next point of the branch and the length of the step to it; None where every step fails."""
    while length >= shortest:
        state = _next(finger.newton, last.state, by, direction, rate, length)
        if state is not None:
            compression = finger.skin_compression(state)
            if compression.least >= last.compression.least - BRANCH.apart and not jumped_branch(
                finger, last.state, state
            ):
                return _Point(state, compression, value_of(state.load, by)), length
        length /= 2.0
    return None


def value_of(load: LoadState, by: int) -> float:
    """Return the coefficient of friction or the depth [mm]."""
    return load.mu if by == BY_FRICTION else load.depth


def with_value(load: LoadState, by: int, value: float) -> LoadState:
    """Return `load` with another coefficient of friction or depth [mm]."""
    return load._replace(mu=value) if by == BY_FRICTION else load._replace(depth=value)


def jumped_branch(finger: BranchBody, before: EquilibriumState, after: EquilibriumState) -> bool:
    """Return whether a step led to another branch, on which the skin is folded."""
    start, end = finger.skin_compression(before), finger.skin_compression(after)
    return end.least < BRANCH.squeeze * start.least or end.kink > BRANCH.crease or finger.crosses(after)


def _tangent(newton: Newton, state: EquilibriumState, by: int) -> tuple[Array, float]:
    """Return the unit tangent of the branch: unknowns over root n [mm], and the parameter."""
    newton.linearise(state, state.load, newton.skin_x)
    direction = newton.steps[:, by] / np.sqrt(len(newton.steps))
    size = np.sqrt(direction @ direction + 1.0)
    return direction / size, 1.0 / size


def _next(
    newton: Newton, start: EquilibriumState, by: int, direction: Array, rate: float, length: float
) -> EquilibriumState | None:
    """Return the state a step of `length` along the branch; None where the corrector fails."""
    root = np.sqrt(len(newton.steps))
    value = value_of(start.load, by)
    state, load = start, start.load
    total = np.zeros(len(newton.steps))
    for _ in range(BRANCH.corrections):
        if not newton.linearise(state, load, newton.skin_x):
            return None
        to, along = newton.steps[:, EQUILIBRIUM] / root, newton.steps[:, by] / root
        current = value_of(load, by)
        ahead = direction @ along + rate
        if ahead == 0.0:
            return None
        change = (length - direction @ (total + to) - rate * (current - value)) / ahead
        step = to + change * along
        load = with_value(load, by, current + change)
        state, largest, changes = newton.apply_step(state, load, step * root, newton.skin_x)
        total = total + step
        if not largest < 10.0:
            return None
        if largest < BRANCH.tolerance and not changes:
            way = np.sqrt(total @ total + (value_of(load, by) - value) ** 2)
            straight = direction @ total + rate * (value_of(load, by) - value)
            return state if straight > BRANCH.turn * way else None
    return None


Waves = NDArray[np.complex128]
_STEP = 0.01  # step of the stretch in the search for the loss of stability
_LEAST = 0.05  # smallest stretch of that search
HALVINGS = 40  # of its last step


@lru_cache(maxsize=16)
def folds_at(law: Law) -> float:
    """Return the stretch along a free surface at which it loses stability in plane strain; LEAST where it never does.

    Biot's root for neo-Hookean tissue that keeps its volume, 0.5437:

    >>> from solver.constitutive import NeoHooke
    >>> round(folds_at(NeoHooke(1.0, 0.4999999)), 4)
    0.5437
    """
    high = 1.0 - 5.0 * _STEP
    while high > _LEAST and _stable(law, high - _STEP):
        high -= _STEP
    if high <= _LEAST:
        return _LEAST
    low = high - _STEP
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if _stable(law, middle) else (middle, high)
    return high


def _stable(law: Law, stretch: float) -> bool:
    """Return whether the surface impedance is positive definite at a stretch along a traction-free surface."""
    across = 1.0 / stretch
    for _ in range(50):
        F = np.diag([stretch, across])
        step = float(stress(law, F)[1, 1] / tangent(law, F)[1, 1, 1, 1])
        across -= step
        if abs(step) < 1e-14 * across:
            break
    moduli = tangent(law, np.diag([stretch, across]))
    impedance = _impedance(moduli[:, 0, :, 0], moduli[:, 0, :, 1], moduli[:, 1, :, 1])
    return impedance is not None and float(np.linalg.det(impedance).real) > 0.0


def _impedance(along: Array, mixed: Array, across: Array) -> Waves | None:
    """Return the impedance (2, 2) of waves exp(i (X + p Y)) that decay with depth; None where two do not.

    `along`, `mixed`, `across` (2, 2) are the moduli dP_aA/dF_bB with A, B = X, X; X, Y; Y, Y.
    """
    inverse = np.linalg.inv(across)
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ along, -inverse @ (mixed + mixed.T)]])
    eigen = np.linalg.eig(system.astype(np.complex128))
    p: Waves = np.asarray(eigen[0], np.complex128)
    waves: Waves = np.asarray(eigen[1], np.complex128)
    decay = p.imag > 0.0
    if decay.sum() != 2:
        return None
    shapes = waves[:2, decay]
    tractions = mixed.T @ shapes + across @ shapes * p[decay]
    return -1j * tractions @ np.linalg.inv(shapes)
