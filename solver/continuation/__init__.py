"""Arc-length continuation of a branch of full slip to its limit point or to the folding of the skin.

Under a deep press and a drag towards the tip, the skin behind the contact folds. Then the friction coefficient or the
depth passes a maximum along the branch, or the surface of the skin loses stability at one place. Beyond, full slip does
not exist. The constraint is the plane of Riks (1979, Int. J. Solids Struct. 15, 529; Crisfield 1981, Comput. Struct.
13, 55).

A compressed half-space loses stability at all wavelengths simultaneously (Biot 1963, Appl. Sci. Res. A 12, 168). The
surface impedance, which maps displacements exp(i k X) to tractions, is singular at that stretch. The equations of a
free surface are ill-posed there, and finer meshes come ever nearer to it. The theory is that of small motions
superposed on a large strain (Dowaikh and Ogden 1990, IMA J. Appl. Math. 44, 261), here for any law in plane strain.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from solver.arrays import Array, Flags
from solver.body.skin import SkinCompression
from solver.constitutive import Law, stress, tangent
from solver.contact import LoadState
from solver.equilibrium import BY_FRICTION, EQUILIBRIUM, EquilibriumState, Newton, Termination
from solver.failures import NotConverged
from solver.progress import check_stop, report_progress

_ROUND_OFF = 1e-12  # relative difference below which a target is reached
LARGEST_MU = 2.0  # largest coefficient of friction to which a branch is followed


@dataclass(frozen=True, slots=True)
class BranchControl:
    """Control of the continuation and of its end; steps are fractions of the largest range.

    On eleven slides, limits change by at most 0.013 % with a hundredth of the tolerance, by 0.17 % with steps a quarter
    as long, and by 0.7 % with half or double the displacement scale.
    """

    tolerance: float = 1e-5  # of a point on the branch, relative to the length scale of the body
    first_step: float = 0.1  # arc length along the branch
    min_step: float = 1e-3
    step_growth: float = 1.5  # ratio of the next step to one with few iterations
    few_iterations: int = 5  # iterations that count as few
    max_corrections: int = 12  # iterations for a point
    max_points: int = 400
    min_cosine: float = 0.7  # between the directions of the branch and of a step along it
    min_stretch_ratio: float = 0.85  # of consecutive points: a jump to a fold has less
    max_kink: float = 0.6  # kink from which skin has a crease: smooth skin on coarse meshes has 0.3, creases 1 and more
    regular_rate: float = 0.1  # share of the parameter in the tangent above which a limit point is far
    max_restarts: int = 3  # attempts to continue beyond the end of a branch
    restart_steps: tuple[float, ...] = (0.01, 0.03)  # relative steps of the parameter in these attempts
    max_force_change: float = 0.05  # relative, in a restart step
    max_stretch_change: float = 0.04  # of the least stretch, between consecutive points
    stretch_change_share: float = 0.5  # part of `max_stretch_change` that a step aims at
    displacement_scale: float = 0.1  # relative to the body's length scale: weighs as much as a friction of 1


BRANCH = BranchControl()
_ON_BRANCH = Termination(BRANCH.tolerance)


class BranchBody(Protocol):
    """A body with skin on which a branch can be followed."""

    @property
    def newton(self) -> Newton:
        """Newton's method on the body."""

    def skin_compression(self, state: EquilibriumState) -> SkinCompression:
        """Return the compression of the skin, and its creases."""

    def crosses(self, state: EquilibriumState) -> bool:
        """Return whether the skin crosses itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """A branch of full slip; its last state is at the target, a step beyond it, or the last before the limit."""

    states: tuple[EquilibriumState, ...]
    value: float  # largest friction coefficient or depth [mm] on it
    ends_early: bool  # whether the branch ends before its target
    corrector_failed: bool = False  # whether only the corrector failed, far from a limit point and from a fold
    length: float | None = None  # of the next step along it, where it continues

    @property
    def last(self) -> EquilibriumState:
        """The last state."""
        return self.states[-1]


class _Point(NamedTuple):
    state: EquilibriumState
    compression: SkinCompression
    value: float  # of the parameter


class _Tangent(NamedTuple):
    """A unit tangent of a branch."""

    direction: Array  # (2 k,) unknowns of the skin, relative to `Continuation.unit`
    rate: float  # of the parameter


@dataclass(frozen=True, slots=True, eq=False)
class Continuation:
    """The continuation of a body's full slip in friction or depth, up to the fold of its skin."""

    body: BranchBody
    parameter: int  # BY_FRICTION or BY_DEPTH
    critical_stretch: float  # least stretch of the skin, at which a branch ends [-]

    def branch(self, start: EquilibriumState, target: float) -> Branch:
        """Follow a branch as `trace` does, up to exactly `target`."""
        return self.stop_at(self.trace(start, target), target)

    def trace(self, start: EquilibriumState, target: float, length: float | None = None) -> Branch:
        """Follow a branch as `follow` does, and continue where it turns back only over a short range."""
        branch = self.follow(start, target, length)
        for _ in range(BRANCH.max_restarts):
            beyond = self._restart(branch, target) if branch.ends_early else None
            if beyond is None:
                break
            hop = self.follow(beyond, target)
            branch = replace(hop, states=(*branch.states, *hop.states))
        return branch

    def _restart(self, branch: Branch, target: float) -> EquilibriumState | None:
        """Return a state a little beyond the end of a branch; None where the branch ends for good.

        Where a node in contact reaches the shear limit, a discrete branch may turn back over a short range.
        """
        last = branch.last
        least = self.body.skin_compression(last).least_chord
        if least < self.critical_stretch + BRANCH.max_stretch_change:
            return None
        for part in BRANCH.restart_steps:
            load = self._with_value(last.load, min((1.0 + part) * branch.value, target))
            try:
                state = self.body.newton.solve(last, load, _ON_BRANCH)
            except NotConverged:
                continue
            near = abs(state.force - last.force).max() <= BRANCH.max_force_change * abs(last.force).max()
            if near and self._continues(least, last, state):
                return state
        return None

    def _continues(self, least: float, last: EquilibriumState, state: EquilibriumState) -> bool:
        """Return whether a state follows the `last` one, with the least stretch `least`, without a jump."""
        return self.body.skin_compression(state).least_chord >= least - BRANCH.max_stretch_change and not jumped_branch(
            self.body, last, state
        )

    def follow(self, start: EquilibriumState, target: float, length: float | None = None) -> Branch:
        """Follow the branch from `start` until the parameter passes `target`.

        It ends where the parameter passes a maximum, or where the least stretch of the skin reaches `critical_stretch`.
        `length` is that of the first step. In friction no step depends on `target`, so that all targets beyond the end
        have one limit.
        """
        points = [self._point(start)]
        best = 0  # the point with the largest parameter
        in_friction = self.parameter == BY_FRICTION
        scale = LARGEST_MU if in_friction else target - points[0].value
        shortest = BRANCH.min_step * scale
        length = BRANCH.first_step * scale if length is None else length
        tangent = self._tangent(start)
        doing = f"following sliding to its {'largest friction' if in_friction else 'largest depth'}"

        def finish(value: float, *, ends_early: bool = True, corrector_failed: bool = False) -> Branch:
            return Branch(
                tuple(point.state for point in points[: best + 1]), value, ends_early, corrector_failed, length
            )

        while points[best].value < target * (1.0 - _ROUND_OFF):
            check_stop()
            report_progress(doing, points[best].value / target)
            last = points[-1]
            step = self._step(last, tangent, length, shortest)
            if step is None or len(points) > BRANCH.max_points:
                far = last.compression.least_chord > self.critical_stretch + BRANCH.max_stretch_change
                return finish(points[best].value, corrector_failed=far and tangent.rate > BRANCH.regular_rate)
            point, length = step
            fall = last.compression.least_chord - point.compression.least_chord
            if point.compression.least_chord < self.critical_stretch:
                part = min(max((last.compression.least_chord - self.critical_stretch) / fall, 0.0), 1.0)
                return finish(max(points[best].value, last.value + part * (point.value - last.value)))
            points.append(point)
            if point.value > points[best].value:
                best = len(points) - 1
            easy = point.state.iterations - last.state.iterations <= BRANCH.few_iterations
            most = BRANCH.step_growth * length if easy else length
            if fall > 0.0:  # the next step aims at a part of the largest fall of the stretch, or just beyond the fold
                to_fold = point.compression.least_chord - self.critical_stretch
                aim = min(BRANCH.stretch_change_share * BRANCH.max_stretch_change, BRANCH.step_growth * to_fold)
                most = min(most, max(aim / fall * length, shortest))
            previous, length, tangent = tangent, most, self._tangent(point.state)
            if tangent.direction @ previous.direction + tangent.rate * previous.rate < 0.0:
                tangent = _Tangent(-tangent.direction, -tangent.rate)
            if tangent.rate <= 0.0:
                return finish(points[best].value)
        return finish(points[best].value, ends_early=False)

    def stop_at(self, branch: Branch, target: float) -> Branch:
        """Return a branch up to `target`; the whole branch where it ends before."""
        if branch.value < target * (1.0 - _ROUND_OFF):
            return branch
        values = [self._value(state.load) for state in branch.states]
        after = next((number for number, value in enumerate(values) if value >= target), len(values))
        if after < len(values) and values[after] <= target * (1.0 + _ROUND_OFF):
            return Branch(branch.states[: after + 1], values[after], ends_early=False)
        for near in branch.states[max(after - 1, 0) : after + 1]:
            with suppress(NotConverged):
                state = self.body.newton.solve(near, self._with_value(near.load, target), _ON_BRANCH)
                if not jumped_branch(self.body, near, state):
                    return Branch((*branch.states[:after], state), target, ends_early=False)
        return Branch(branch.states[:after], values[after - 1], ends_early=True, corrector_failed=True)

    @property
    def unit(self) -> float:
        """Displacement of one unknown that weighs as much as a unit of the parameter: a friction of 1, or 1 mm [mm]."""
        newton = self.body.newton
        norm = BRANCH.displacement_scale * newton.length_scale if self.parameter == BY_FRICTION else 1.0
        return norm * float(np.sqrt(len(newton.steps)))

    def _point(self, state: EquilibriumState) -> _Point:
        return _Point(state, self.body.skin_compression(state), self._value(state.load))

    def _step(self, last: _Point, tangent: _Tangent, length: float, shortest: float) -> tuple[_Point, float] | None:
        """Return the next point of the branch and the length of the step to it; None where every step fails."""
        while length >= shortest:
            state = self._arc_step(last, tangent, length)
            if state is not None and self._continues(last.compression.least_chord, last.state, state):
                return self._point(state), length
            length /= 2.0
        return None

    def _value(self, load: LoadState) -> float:
        """Return the coefficient of friction or the depth [mm]."""
        return load.mu if self.parameter == BY_FRICTION else load.depth

    def _with_value(self, load: LoadState, value: float) -> LoadState:
        """Return `load` with another coefficient of friction or depth [mm]."""
        return load._replace(mu=value) if self.parameter == BY_FRICTION else load._replace(depth=value)

    def _tangent(self, state: EquilibriumState) -> _Tangent:
        newton = self.body.newton
        newton.linearise(state, newton.skin_x)
        direction = newton.steps[:, self.parameter] / self.unit
        size = float(np.sqrt(direction @ direction + 1.0))
        return _Tangent(direction / size, 1.0 / size)

    def _arc_step(self, start: _Point, tangent: _Tangent, length: float) -> EquilibriumState | None:
        """Return the state a step of `length` along the branch; None where the corrector fails."""
        newton, (direction, rate), unit = self.body.newton, tangent, self.unit
        state = start.state
        total = np.zeros(len(newton.steps))
        for _ in range(BRANCH.max_corrections):
            if not newton.linearise(state, newton.skin_x):
                return None
            to, along = newton.steps[:, EQUILIBRIUM] / unit, newton.steps[:, self.parameter] / unit
            current = self._value(state.load)
            ahead = float(direction @ along) + rate
            if ahead == 0.0:
                return None
            change = (length - float(direction @ (total + to)) - rate * (current - start.value)) / ahead
            step = to + change * along
            load = self._with_value(state.load, current + change)
            state, largest, changes = newton.apply_step(state, load, step * unit, newton.skin_x)
            total = total + step
            if not largest < newton.length_scale:
                return None
            if largest < BRANCH.tolerance * newton.length_scale and not changes:
                moved = self._value(load) - start.value
                distance = np.sqrt(total @ total + moved**2)
                return state if direction @ total + rate * moved > BRANCH.min_cosine * distance else None
        return None


def jumped_branch(body: BranchBody, before: EquilibriumState, after: EquilibriumState) -> bool:
    """Return whether a step led to another branch, on which the skin is folded."""
    start, end = body.skin_compression(before), body.skin_compression(after)
    return (
        end.least_chord < BRANCH.min_stretch_ratio * start.least_chord
        or end.kink > BRANCH.max_kink
        or body.crosses(after)
    )


_LEAST = 0.05  # smallest stretch of the search for the loss of stability
_TRIALS = 90  # stretches tried at once: every 0.01 at first
_ACCURACY = 1e-9  # of that stretch; round-off hides more in tissue that hardly changes its volume


@lru_cache(maxsize=16)
def critical_stretch(law: Law) -> float:
    """Return the stretch at which a free surface loses stability in plane strain; _LEAST where it never does.

    Biot's root for neo-Hookean tissue that keeps its volume, 0.5437:

    >>> from solver.constitutive import NeoHooke
    >>> round(critical_stretch(NeoHooke(1.0, 0.4999999)), 4)
    0.5437
    """
    high, low = 0.95, _LEAST  # isotropic tissue is stable at small strain
    while high - low > _ACCURACY:
        stretches = np.linspace(high, low, _TRIALS + 1)
        lost = np.flatnonzero(~_stable(law, stretches[1:]))
        if not len(lost):
            return _LEAST
        high, low = stretches[lost[0] : lost[0] + 2].tolist()
    return high


def _stable(law: Law, stretch: Array) -> Flags:
    """Return whether the surface impedance is positive definite at stretches (n,) along a traction-free surface."""
    across = 1.0 / stretch
    for _ in range(50):
        F = _diagonal(stretch, across)
        step = stress(law, F)[:, 1, 1] / tangent(law, F)[:, 1, 1, 1, 1]
        across -= step
        if np.all(np.abs(step) < 1e-14 * across):
            break
    moduli = tangent(law, _diagonal(stretch, across))
    return _has_positive_impedance(moduli[:, :, 0, :, 0], moduli[:, :, 0, :, 1], moduli[:, :, 1, :, 1])


def _diagonal(x: Array, y: Array) -> Array:
    """Return the deformation gradients (n, 2, 2) of stretches x and y (n,)."""
    return np.stack([x, y], axis=1)[:, :, None] * np.eye(2)


def _has_positive_impedance(along: Array, mixed: Array, across: Array) -> Flags:
    """Return whether two waves exp(i (X + p Y)) decay with depth, and their impedance has a positive determinant.

    `along`, `mixed`, `across` (n, 2, 2) are the moduli dP_aA/dF_bB with A, B = X, X; X, Y; Y, Y.
    """
    inverse, transpose = np.linalg.inv(across), np.swapaxes(mixed, 1, 2)
    system = np.zeros((len(along), 4, 4), np.complex128)
    system[:, :2, 2:] = np.eye(2)
    system[:, 2:, :2], system[:, 2:, 2:] = -inverse @ along, -inverse @ (mixed + transpose)
    p, waves = np.linalg.eig(system)
    deepest = np.argsort(-p.imag, axis=1)[:, None, :2]
    shapes = np.take_along_axis(waves[:, :2], deepest, axis=2)
    tractions = transpose @ shapes + across @ shapes * np.take_along_axis(p[:, None], deepest, axis=2)
    determinants = -np.linalg.det(tractions) / np.linalg.det(shapes)  # of -i tractions / shapes
    return ((p.imag > 0.0).sum(axis=1) == 2) & (determinants.real > 0.0)
