"""The settled sliding state directly: every touching point slips, so nothing is left of how it came there."""

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from solver._kernels.compiling import OPEN, SHEAR_LIMITED, SLIP
from solver.equilibrium import EquilibriumState, ForceLoad, LoadState, Newton
from solver.equilibrium.load_stepping import StepControl, advance
from solver.failures import ContactLost, NotConverged
from solver.progress import report_progress


@dataclass(frozen=True, slots=True)
class SlipControl:
    """Where skin is first thought to touch, and how a slide is led to that one step does not reach.

    To halve or double the numbers of a slide at finite strain changes neither states nor tangents of sixteen slides.
    """

    hertz: float = 0.5  # part of the depth below which skin may touch: half as deep is half the overlap's square
    short: int = 12  # systems after which that guess is given up
    parts: tuple[float, ...] = (0.3, 0.6, 0.1, 0.9, 0.03, 0.01)  # of the depth in which skin may touch, in turn
    leading: float = 1e-3  # tolerance of steps that only lead to the last [mm]; looser ones go astray near nu = 0.5
    work: int = 80  # tangents after which no more steps are halved: a state that is there takes 5 to 30
    smallest: float = 1.0 / 64.0  # part of the way below which a failing step is given up


CONTROL = SlipControl()


def settled(
    newton: Newton,
    load: LoadState,
    start: EquilibriumState | None = None,
    tolerance: float = 1e-10,
) -> EquilibriumState:
    """Return the sliding state under `load` (sense +1 or -1), from undeformed or from `start`, in one step.

    A step that fails is halved, depth, friction and bound together. Raises NotConverged where that does not help,
    Cancelled, ValueError for a load state that is none.
    """
    load = load.checked()
    if newton.condensed.constant:
        return _at_once(newton, load, start)
    state = EquilibriumState.undeformed(newton.condensed) if start is None else start
    begin = state.load if start is not None else LoadState(0.0, load.mu, load.tau, load.sense)
    most = newton.systems + CONTROL.work

    def step(part: float) -> None:
        nonlocal state
        if part < 1.0:
            report_progress(f"coming to sliding at mu = {load.mu:.3g} in small steps", part)
        state = newton.settle(state, _between(begin, load, part), tolerance if part == 1.0 else CONTROL.leading)

    def refusal(done: float, part: float, reason: NotConverged) -> NotConverged:
        last = _between(begin, load, done)
        return NotConverged(
            f"no sliding state was found beyond {last.depth:.3g} mm of indentation at mu = {last.mu:.3g}: {reason}, in "
            f"steps of 1/{1 / part:.0f} of the way"
        )

    control = StepControl(smallest=1.0 if begin == load else CONTROL.smallest)
    advance(step, refusal, control, exhausted=lambda: newton.systems > most)
    return state


def _at_once(newton: Newton, load: LoadState, start: EquilibriumState | None) -> EquilibriumState:
    """Return the sliding state of a body of constant stiffness, which is one step from any. Raises ContactLost.

    What differs is the contact that is thought of first: that of `start`, or skin that would lie deep in the surface.
    """
    if load.sense == 0:
        raise ValueError("sense = 0 is not allowed: friction on what slides points along +1 or -1")
    if start is not None:
        return slide_beside(newton, load, start.state)
    height = newton.condensed.place(newton.condensed.undeformed()[0])[:, 1]
    if newton.condensed.motions.shape[1]:  # how deep it lies, or a part of it, is found
        return _first_of(newton, load, float(np.ptp(height)), None)
    above = height - load.depth
    guesses = [(above < -CONTROL.hertz * load.depth, SLIP, CONTROL.short), (above < 0.0, SLIP, None)]
    if isfinite(load.tau):
        guesses.append((above < 0.0, SHEAR_LIMITED, None))
    for number, (low, slips, rounds) in enumerate(guesses):
        try:
            return slide_beside(newton, load, np.where(low, slips, OPEN), rounds=rounds)
        except ContactLost:
            if number == len(guesses) - 1:
                raise
    raise AssertionError  # there is always a guess


def slide_beside(
    newton: Newton, load: LoadState, guess: NDArray[np.integer], force: float | None = None, rounds: int | None = None
) -> EquilibriumState:
    """Return the slide of a body of constant stiffness whose contact states are sought from a `guess` (k,) of them.

    Under a normal `force` [N/mm] the depth of `load` is found. Raises ContactLost, after so many `rounds` of changes.
    """
    rest = EquilibriumState.undeformed(newton.condensed)
    states = guess.astype(np.int32)
    begin = replace(rest, state=states, sense=np.full(len(states), load.sense, np.int32))
    forces = None if force is None else ForceLoad(force, None)
    return newton.solved(begin, load, newton.skin_x, forces, rounds)


def slide_under(newton: Newton, load: LoadState, force: float, deepest: float | None = None) -> EquilibriumState:
    """Return the slide of a body of constant stiffness under a normal `force` [N/mm], its depth found.

    `deepest` [mm] is the scale of the first guesses, by default the height of the skin. Raises ContactLost.
    """
    height = newton.condensed.place(newton.condensed.undeformed()[0])[:, 1]
    state = _first_of(newton, load, float(np.ptp(height)) if deepest is None else deepest, force)
    if deepest is None or state.load.depth > 0.0:
        return state
    raise ContactLost("the touching points have no forces that amount to the normal force")


def _first_of(newton: Newton, load: LoadState, scale: float, force: float | None) -> EquilibriumState:
    """Return the first slide that touching skin leads to which reaches up to parts of a `scale` [mm]."""
    height = newton.condensed.place(newton.condensed.undeformed()[0])[:, 1]
    for number, part in enumerate(CONTROL.parts):
        guess = np.where(height <= float(height.min()) + part * scale, SLIP, OPEN)
        try:
            state = slide_beside(newton, load, guess, force)
        except ContactLost:
            if number == len(CONTROL.parts) - 1:
                raise
            continue
        if force is None or state.load.depth > 0.0 or number == len(CONTROL.parts) - 1:
            return state
    raise AssertionError  # there is always a guess


def _between(begin: LoadState, end: LoadState, part: float) -> LoadState:
    """Return the load state `part` of the way; a bound that was not there before takes its value at once."""
    if part == 1.0:
        return end
    bounded = begin.tau < float("inf") and end.tau < float("inf")
    tau = begin.tau + part * (end.tau - begin.tau) if bounded else end.tau
    mu = begin.mu + part * (end.mu - begin.mu)
    return LoadState(begin.depth + part * (end.depth - begin.depth), mu, tau, end.sense)
