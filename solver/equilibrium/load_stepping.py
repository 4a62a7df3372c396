"""Load stepping with the solver's only cut-back, force control, and full slip in one step.

Under given forces, depth and travel are unknown too: Newton's method solves the bordered system. Every linear solve
also returns the derivatives with respect to depth and travel. These give the changes of both that balance the forces.
In full slip every point in contact slips, so that the state does not depend on its load path.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.arrays import Array
from solver.contact import ForceLoad, LoadState
from solver.equilibrium import TO_ROUND_OFF, EquilibriumState, Newton, Termination, lower_onto_surface
from solver.failures import ContactLost, NotConverged, at_end_of_path
from solver.progress import check_stop, report_progress
from solver.scene import Scene

DRAG_TOLERANCE = 1e-9  # accepted error of a drag, relative to the friction limit
_UNDER_FORCES = Termination(max_iterations=30)  # more than usual, since the depth is unknown too


@dataclass(frozen=True, slots=True)
class StepControl:
    """Division of a load path into steps; lengths are fractions of the path."""

    first_step: float = 1.0
    min_step: float = 2.0**-8
    step_growth: float = 1.0  # ratio of the next step to one that succeeded


Step = Callable[[float], None]
Refusal = Callable[[float, float, NotConverged], NotConverged]
ONE_STEP = StepControl()


def advance(
    step: Step, refusal: Refusal, control: StepControl = ONE_STEP, exhausted: Callable[[], bool] = lambda: False
) -> None:
    """Call `step` with growing fractions of the path up to 1; halve the step that fails.

    `step` raises NotConverged where it fails, and leaves the state unchanged. Where the next step is too short, or the
    allowed work is `exhausted`, this raises the exception that `refusal` returns for the fraction reached, this step
    and the reason. Raises Cancelled.
    """
    fraction, part = 0.0, control.first_step
    while fraction < 1.0:
        check_stop()
        aim = min(fraction + part, 1.0)
        try:
            step(aim)
        except NotConverged as reason:
            part /= 2.0
            if part < control.min_step or exhausted():
                raise refusal(fraction, part, reason) from reason
        else:
            fraction, part = aim, control.step_growth * part


def load_of(scene: Scene) -> LoadState:
    """Return the load state of a scene's press; a bound of zero means no friction."""
    bound = scene.friction.cap
    depth = scene.loading.depth if scene.normal_force is None else 0.0  # unknown where a force is given
    return LoadState(depth, float(scene.friction.mu) if bound > 0.0 else 0.0, bound)


def sliding_load(scene: Scene) -> LoadState:
    """Return the load state of a scene's full slip, along +x where the scene has no direction."""
    return load_of(scene)._replace(sense=-(scene.loading.direction or 1))


def forces_of(scene: Scene, load: LoadState) -> ForceLoad | None:
    """Return the forces that a scene prescribes for a state under `load`; None where it prescribes a depth."""
    force, drag = scene.normal_force, scene.tangential_force
    if force is None:
        return None
    tangential = None if drag is None or not load.path_dependent else -scene.loading.direction * drag
    return ForceLoad(force, tangential, load.travel)


def march(
    newton: Newton,
    course: Iterable[LoadState | ForceLoad],
    start: EquilibriumState | None = None,
    tolerance: float = 1e-8,
) -> Iterator[EquilibriumState]:
    """Yield the equilibrium at each load of `course`, from `start` or the undeformed state, with cut-back.

    A load is a load state, or forces under the friction of `start`. Backward Euler: within a step a point sticks where
    it was, or slips from there. `tolerance` is that of displacements, relative to the length scale of the body. Raises
    NotConverged with the depth and travel reached, Cancelled, and ValueError for a load that is not allowed.
    """
    state, end = EquilibriumState.undeformed(newton.condensed) if start is None else start, Termination(tolerance)
    for number, aim in enumerate(aims := [aim.validate() for aim in course]):
        if len(aims) > 1:
            report_progress("pressing and sliding step by step", number / len(aims))

        def step(part: float, begin: EquilibriumState = state, aim: LoadState | ForceLoad = aim) -> None:
            nonlocal state
            if isinstance(aim, ForceLoad):
                drag, normal = begin.force.tolist()
                forces = ForceLoad(normal, drag, begin.load.travel).towards(aim, part)
                state = solve_under_forces(newton, lower_onto_surface(newton.condensed, state), forces)
            else:
                state = newton.solve(state, begin.load._replace(mu=aim.mu, tau=aim.tau).towards(aim, part), end)

        advance(step, lambda _fraction, _part, why: at_end_of_path(state.load.depth, state.load.travel, why))
        yield state


State = TypeVar("State")
_FIRST_STRIDE, _MAX_STRIDE = 1e-8, 0.1  # of the search for a bracket, relative to the length scale of the body
_MAX_EVALUATIONS = 60  # within the bracket


def find_root(
    function: Callable[[float], tuple[float, State]], start: float, close: float, size: float = 1.0
) -> State | None:
    """Return the state at the root of an increasing function, to within `close`; None where no bracket is found.

    `function` returns its value at an argument, and the state there. Doubling strides from `start` find a bracket, up
    to a part of `size`. Regula falsi with the Illinois rule finds the root (Dowell and Jarratt 1971).

    >>> round(find_root(lambda x: (x**3 - 8e-9, x), 0.0, 1e-18), 9)
    0.002
    """
    previous = latest = start
    bracket, state = function(start)
    beyond, stride = bracket, _FIRST_STRIDE * size if bracket < 0.0 else -_FIRST_STRIDE * size
    while beyond * bracket > 0.0:
        previous, bracket = latest, beyond
        latest, stride = latest + stride, 2.0 * stride
        if abs(stride) > _MAX_STRIDE * size:
            return None
        beyond, state = function(latest)
    for _ in range(_MAX_EVALUATIONS):
        if abs(beyond) <= close:
            return state
        between = latest - beyond * (latest - previous) / (beyond - bracket)
        new, state = function(between)
        if new * beyond < 0.0:
            previous, bracket = latest, beyond
        else:
            bracket /= 2.0
        latest, beyond = between, new
    return None


def solve_under_forces(
    newton: Newton, start: EquilibriumState, forces: ForceLoad, termination: Termination = _UNDER_FORCES
) -> EquilibriumState:
    """Return the equilibrium under `forces`, one backward Euler step from `start`, with its friction and sense.

    Raises NotConverged.
    """
    try:
        state = newton.solve_from(start, start, forces, termination)
    except ContactLost:  # for example where friction is so small that all but one node slip
        if forces.tangential is None:
            raise
        return _find_travel(newton, start, start, forces, termination)
    return _find_travel(newton, start, state, forces, termination) if _slips_freely(state, forces) else state


def _slips_freely(state: EquilibriumState, forces: ForceLoad) -> bool:
    """Return whether every node in contact slips and the drag differs from the given one."""
    if forces.tangential is None or not state.load.mu > 0.0 or (state.state == STICK).any():
        return False
    return abs(state.force[0] - forces.tangential) > DRAG_TOLERANCE * state.load.mu * forces.normal


def _find_travel(
    newton: Newton, start: EquilibriumState, state: EquilibriumState, forces: ForceLoad, termination: Termination
) -> EquilibriumState:
    """Return the equilibrium under the given drag, one step from `start`, by a search for its travel from `state` on.

    A given travel determines a body without sticking nodes, and the drag grows with the travel. Raises NotConverged.
    """
    drag, near = forces.tangential or 0.0, state

    def drag_error(travel: float) -> tuple[float, EquilibriumState]:
        nonlocal near
        near = newton.solve_from(near, start, ForceLoad(forces.normal, None, travel), termination)
        return float(near.force[0]) - drag, near

    close = DRAG_TOLERANCE * state.load.mu * forces.normal
    state_at_drag = find_root(drag_error, state.load.travel, close, newton.length_scale)
    if state_at_drag is None:
        raise NotConverged("no travel meets the drag")
    return state_at_drag


@dataclass(frozen=True, slots=True)
class SlipControl:
    """First guesses of the contact in full slip, and the cut-back where one step does not reach it.

    Halving or doubling the values for finite strain changed neither states nor tangents of sixteen slides.
    """

    hertz_overlap: float = 0.5  # relative to the depth, from which skin is guessed to touch: half does for Hertz
    max_hertz_systems: int = 12  # for that guess
    overlaps: tuple[float, ...] = (0.3, 0.6, 0.1, 0.9, 0.03, 0.01)  # relative to the depth, tried in turn
    intermediate_tolerance: float = 1e-4  # tolerance of steps before the last [-]; looser ones diverge near nu = 0.5
    max_tangents: int = 160  # after which no step is halved: 80 lose deep presses, 320 gain none
    min_step: float = 1.0 / 64.0  # fraction of the path


SLIP_CONTROL = SlipControl()


def solve_full_slip(
    newton: Newton, load: LoadState, start: EquilibriumState | None = None, tolerance: float = TO_ROUND_OFF.tolerance
) -> EquilibriumState:
    """Return full slip under `load` (sense +1 or -1), in one step from `start` or the undeformed state.

    A step that fails is halved in depth, friction and bound together. `tolerance` is as in `march`. Raises NotConverged
    where that does not help, Cancelled, and ValueError for a load state that is not allowed.
    """
    load = load.validate()
    if newton.condensed.constant:
        return _linear_slide(newton, load, start)
    state = EquilibriumState.undeformed(newton.condensed) if start is None else start
    begin = state.load if start is not None else LoadState(0.0, load.mu, load.tau, load.sense)
    most = newton.systems + SLIP_CONTROL.max_tangents

    def step(part: float) -> None:
        nonlocal state
        if part < 1.0:
            report_progress(f"approaching full slip at mu = {load.mu:.3g} in small steps", part)
        termination = Termination(tolerance if part == 1.0 else SLIP_CONTROL.intermediate_tolerance)
        state = newton.solve(state, begin.towards(load, part), termination)

    def refusal(fraction: float, part: float, reason: NotConverged) -> NotConverged:
        last = begin.towards(load, fraction)
        return NotConverged(
            f"no sliding state was found beyond {last.depth:.3g} mm of indentation at mu = {last.mu:.3g}: {reason}, in "
            f"steps of 1/{1 / part:.0f} of the way"
        )

    control = StepControl(min_step=1.0 if begin == load else SLIP_CONTROL.min_step)
    advance(step, refusal, control, exhausted=lambda: newton.systems > most)
    return state


def slide_from_limited_skin(
    newton: Newton, load: LoadState, tolerance: float = TO_ROUND_OFF.tolerance
) -> EquilibriumState:
    """Return full slip from the frictionless state, with all its contact shear-limited under a growing bound.

    Under a low bound and a large mu, skin is shear-limited even at small pressures, so that slip is a bad first guess.
    Raises NotConverged.
    """
    frictionless = solve_full_slip(newton, load._replace(mu=0.0), None, tolerance)
    state = np.where(frictionless.touching, SHEAR_LIMITED, OPEN).astype(frictionless.state.dtype)
    return solve_full_slip(newton, load, replace(frictionless, state=state, load=load._replace(tau=0.0)), tolerance)


def _linear_slide(newton: Newton, load: LoadState, start: EquilibriumState | None) -> EquilibriumState:
    """Return full slip of a body of constant stiffness in one step. Raises ContactLost.

    The first guess of its contact is that of `start`, or the skin that overlaps the surface.
    """
    if load.sense == 0:
        raise ValueError("sense = 0 is not allowed: friction on what slides points along +1 or -1")
    if start is not None:
        return slide_from_guess(newton, load, start.state)
    height = _skin_heights(newton)
    if newton.condensed.motions.shape[1]:  # a rigid motion changes its depth
        return _first_slide(newton, load, _lowest_skin(height, float(np.ptp(height))))
    above = height - load.depth
    low = above < -SLIP_CONTROL.hertz_overlap * load.depth
    guesses: list[Guess] = [(np.where(low, SLIP, OPEN), SLIP_CONTROL.max_hertz_systems)]
    guesses += [(np.where(above < 0.0, slips, OPEN), None) for slips in (SLIP, SHEAR_LIMITED)]
    return _first_slide(newton, load, guesses if isfinite(load.tau) else guesses[:-1])


def slide_from_guess(
    newton: Newton, load: LoadState, guess: NDArray[np.integer], force: float | None = None, rounds: int | None = None
) -> EquilibriumState:
    """Return full slip of a body of constant stiffness from a `guess` (k,) of its contact states.

    Under a normal `force` [N/mm] the depth is unknown. Raises ContactLost, at the latest after `rounds` systems.
    """
    start = EquilibriumState.undeformed(newton.condensed, load)
    states = guess.astype(np.int32)
    begin = replace(start, state=states, sense=np.full(len(states), load.sense, np.int32))
    forces = None if force is None else ForceLoad(force, None)
    return newton.solve_linear(begin, newton.skin_x, forces, rounds)


def slide_under(newton: Newton, load: LoadState, force: float, deepest: float | None = None) -> EquilibriumState:
    """Return full slip of a body of constant stiffness under a normal `force` [N/mm].

    `deepest` [mm] scales the first guesses of the depth, by default the height of the skin. Raises ContactLost.
    """
    height = _skin_heights(newton)
    guesses = _lowest_skin(height, float(np.ptp(height)) if deepest is None else deepest)
    state = _first_slide(newton, load, guesses, force)
    if deepest is None or state.load.depth > 0.0:
        return state
    raise ContactLost("the touching points have no forces that amount to the normal force")


Guess = tuple[NDArray[np.integer], int | None]  # contact states (k,), and the most systems to solve from there


def _skin_heights(newton: Newton) -> Array:
    return newton.condensed.skin_positions(newton.condensed.undeformed()[0])[:, 1]


def _lowest_skin(height: Array, scale: float) -> list[Guess]:
    """Return guesses of contact: skin up to parts of `scale` [mm] above the lowest node, at `height` (k,) [mm]."""
    limits = (float(height.min()) + part * scale for part in SLIP_CONTROL.overlaps)
    return [(np.where(height <= limit, SLIP, OPEN), None) for limit in limits]


def _first_slide(
    newton: Newton, load: LoadState, guesses: Sequence[Guess], force: float | None = None
) -> EquilibriumState:
    """Return full slip from the first successful one of the guesses. Raises ContactLost where the last one fails."""
    for guess, rounds in guesses[:-1]:
        with suppress(ContactLost):
            state = slide_from_guess(newton, load, guess, force, rounds)
            if force is None or state.load.depth > 0.0:
                return state
    return slide_from_guess(newton, load, guesses[-1][0], force)
