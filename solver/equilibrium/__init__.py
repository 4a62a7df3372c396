"""One load step of a body: Newton's method, which updates displacements and contact states together.

The states of the skin's nodes (open, stick, slip, shear-limited) change with every iteration by a primal-dual active
set, without a penalty (Alart and Curnier 1991; Hüeber and Wohlmuth 2005). The geometric stiffness uses the pressure
predicted by the last iteration (Magisano, Leonetti and Garcea 2017), so nearly incompressible bodies need few steps.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from solver._kernels import HELD_X, HELD_Y, OPEN, SLIP, STICK, active_set, bind_arguments
from solver._kernels.active_set import DEPTH_CONTROL, DRAG_CONTROL, PUSH_CONTROL, SINGULAR, UNSETTLED
from solver.arrays import (
    Array,
    CondensedArrays,
    ContactControl,
    ContactStates,
    ContactSystem,
    LoadArguments,
    Skin,
    SkinPosition,
)
from solver.body import CondensedBody
from solver.contact import ForceLoad, LoadState
from solver.failures import ContactLost, NotConverged

States = NDArray[np.int32]
EQUILIBRIUM, BY_DEPTH, BY_FRICTION, BY_TRAVEL = 0, 1, 2, 3  # columns of Newton.steps


@dataclass(frozen=True, slots=True)
class NewtonControl:
    """Criteria to halve a step, keep a tangent or stop; lengths are relative to the length scale of the body.

    Halving or doubling any of these changed no state of eighteen slides, presses and load paths at finite strain by
    more than 6e-10, and the number of tangents by 3 % at most. Without keeping tangents there are 5 % more.
    """

    min_damping: float = 1.0 / 16.0  # smallest part of a step, where the whole step turns the body inside out
    max_increment: float = 0.02  # of depth or travel in one iteration, where forces are given
    max_rounds: int = 12  # changes of contact states within one linearisation: its systems are small, and so cheap
    reuse_step: float = 0.01  # first step below which the tangent of the previous state is kept
    reuse_ratio: float = 0.02  # ratio of consecutive steps below which a new tangent is kept
    renewal_ratio: float = 0.5  # ratio of consecutive steps above which a kept tangent is renewed
    reuse_bulk_step: float = 1e-3  # step times bulk over shear stiffness, above which no tangent is kept
    max_systems: int = 20  # for the contact states of a linear body, plus four for each node
    ratio_safety: float = 2.0  # factor on the ratio of consecutive steps, from which the remaining step is estimated
    error_share: float = 0.5  # part of the tolerance for the estimated remaining step
    cycle_tolerance: float = 1e-3  # relative difference below which two steps count as equal
    cycle_steps: int = 4  # equal steps in a row that count as a cycle
    divergence: float = 100.0  # displacement from which the body counts as loose


CONTROL = NewtonControl()


class Termination(NamedTuple):
    """Criteria that end the iterations: the larger of two tolerances, or a failure after too many iterations."""

    tolerance: float = 1e-11  # of displacements, relative to the length scale of the body [-]
    relative_to_first: float = 0.0  # of displacements, relative to the largest in the first step [-]
    max_iterations: int = 25


TO_ROUND_OFF = Termination()


_UNLOADED = LoadState(0.0, 0.0)
Anchor = Callable[[LoadState], Array]  # positions along x (k,) at which nodes stick under a load [mm]


@dataclass(frozen=True, slots=True, eq=False)
class EquilibriumState:
    """An immutable state of a body with k nodes of skin and e elements."""

    u: Array  # (nodes, 2) displacements relative to the bone [mm]
    pressure: Array  # (e, 3) modes of the pressure, predicted for the next tangent
    state: States  # (k,) OPEN, STICK, SLIP or SHEAR_LIMITED
    sense: States  # (k,) direction of the friction force on the skin where it slips
    reaction: Array  # (k, 2) forces of the surface on the skin [N/mm]
    load: LoadState
    iterations: int  # linear systems solved since the undeformed state

    @staticmethod
    def undeformed(body: CondensedBody, load: LoadState = _UNLOADED) -> "EquilibriumState":
        """Return the undeformed body without contact, with the friction of `load`."""
        u, pressure = body.undeformed()
        zero = np.zeros(len(body.held), np.int32)
        return EquilibriumState(u, pressure, zero, zero, np.zeros((len(zero), 2)), load.validate(), 0)

    def skin_positions(self, body: CondensedBody) -> Array:
        """Return the deformed positions of the skin's nodes (k, 2) [mm]."""
        return body.skin_positions(self.u)

    def anchor(self, body: CondensedBody) -> Anchor:
        """Return the positions at which nodes stick in a step from this state: they move with the surface."""
        origin, travel = self.skin_positions(body)[:, 0].copy(), self.load.travel
        return lambda load: origin + (load.travel - travel)

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Whether each node is in contact, (k,)."""
        return self.state != OPEN

    @property
    def reaches_end(self) -> bool:
        """Whether contact reaches an end of the skin that may touch, beyond which contact is not considered."""
        return bool(self.touching[[0, -1]].any())

    @property
    def sticking(self) -> float:
        """Fraction of the nodes in contact that stick [-]."""
        return float(np.sum(self.state == STICK) / max(int(self.touching.sum()), 1))

    @property
    def normal(self) -> Array:
        """Normal force of the surface on each node along +y, (k,) [N/mm]."""
        return self.reaction[:, 1]

    @property
    def tangential(self) -> Array:
        """Tangential force of the surface on each node along +x, (k,) [N/mm]."""
        return self.reaction[:, 0]

    @property
    def force(self) -> Array:
        """Force of the surface on the body along x and y (2,) [N/mm]."""
        return self.reaction.sum(axis=0)


class Newton:
    """Newton's method on one condensed body, with its work arrays."""

    def __init__(self, condensed: CondensedBody) -> None:
        skin = len(condensed.held)
        self.condensed = condensed
        self.systems = 0  # tangents assembled so far
        unknowns = 2 * skin + 3
        self.system = ContactSystem(
            np.zeros(skin), np.zeros(unknowns, np.int32), np.zeros(unknowns**2), np.zeros((unknowns, 4)),
            np.zeros((2 * skin, 4)), np.zeros(2),
        )  # fmt: skip
        self.steps = self.system.steps  # (2 k, 4) of the skin, which the kernels fill
        self.bulk, self.length_scale = condensed.bulk, condensed.length_scale
        self.skin = Skin(condensed.held, condensed.middle, condensed.fixed_length)
        self._rest = condensed.undeformed()[0]
        self.skin_x = condensed.skin_positions(self._rest)[:, 0].copy()
        zero = np.zeros(skin, np.int32)
        self._states = ContactStates(zero, zero.copy(), np.zeros((skin, 2)))
        self._active_set = bind_arguments(active_set.solve_active_set, self.system)
        self._update_states = bind_arguments(active_set.update_contact_states, self.skin, self.system.length)

    def linearise(
        self,
        state: EquilibriumState,
        anchor: Array,
        rounds: int = 0,
        forces: ForceLoad | None = None,
        *,
        reuse: bool = False,
    ) -> bool:
        """Linearise the body at `state` and solve its contact for the `steps` (2 k, 4); return False where that fails.

        `anchor` (k,) are the positions along x where nodes stick [mm]. Contact states change up to `rounds` times,
        until none contradicts the linearised body. The first step also meets the `forces`, if given. `reuse` keeps the
        last tangent and its factors.
        """
        self.systems += 0 if reuse else 1
        body = self.condensed
        if not body.linearise(state.u, None if reuse else state.pressure):
            return False
        return self.solve_contact(state, anchor, rounds, forces) != SINGULAR

    def solve_contact(self, state: EquilibriumState, anchor: Array, rounds: int, forces: ForceLoad | None) -> int:
        """Solve the contact of the linearised body at `state`; return the result of `solve_active_set`."""
        body = self.condensed
        self._states.state[:], self._states.sense[:] = state.state, state.sense
        max_increment = np.inf if body.constant else CONTROL.max_increment * self.length_scale
        kind, drag, push = DEPTH_CONTROL, 0.0, 0.0
        if forces is not None:
            kind = PUSH_CONTROL if forces.tangential is None else DRAG_CONTROL
            drag, push = forces.tangential or 0.0, forces.normal
        return self._active_set(
            self.arrays(), body.compliance, self.skin, self._states, load_arguments(state.load),
            self._position(state.u, state.load, anchor),
            ContactControl(kind, float(drag), float(push), max_increment, rounds),
        )  # fmt: skip

    def arrays(self) -> CondensedArrays:
        """Return the linearised body as an argument of the kernels."""
        body = self.condensed
        return CondensedArrays(body.stiffness, body.force)

    def _position(self, u: Array, load: LoadState, anchor: Array) -> SkinPosition:
        """Return the position of the skin relative to the surface at displacements `u`."""
        place = self.condensed.skin_positions(u)
        return SkinPosition(place[:, 0].copy(), place[:, 1] - load.depth, anchor)

    def force_changes(self, steps: Array) -> Array:
        """Return the changes of the surface's force along x and y (2, c) for `steps` of the skin (2 k, c)."""
        return self.condensed.stiffness.reshape(-1, 2, len(steps)).sum(axis=0) @ steps

    def is_stable(self, state: EquilibriumState) -> bool:
        """Return whether every small motion of a state that keeps its contact increases the energy.

        Touching nodes stay on the surface, and sticking nodes do not move. Friction forces are constant.
        """
        body, x = self.condensed, np.ascontiguousarray(state.skin_positions(self.condensed)[:, 0])
        if not self.linearise(state, x, reuse=body.equilibrium is state.u) or not body.definite:
            return False
        free = np.column_stack([state.state != STICK, ~state.touching])
        free &= (body.held[:, None] & [HELD_X, HELD_Y]) == 0
        movable = np.flatnonzero(free)
        try:
            np.linalg.cholesky(body.stiffness[np.ix_(movable, movable)])
        except LinAlgError:
            return False
        return True

    def apply_step(
        self, state: EquilibriumState, load: LoadState, skin: Array, anchor: Array, scale: float = 1.0
    ) -> tuple[EquilibriumState, float, int]:
        """Return the state after a step of the skin (2 k,), its largest displacement [mm], and the changed states."""
        body, skin = self.condensed, np.ascontiguousarray(skin)
        reaction = (body.force + body.stiffness @ skin).reshape(-1, 2)
        u, pressure, largest = body.recover(state.u, state.pressure, skin, scale)
        states = ContactStates(self._states.state.copy(), self._states.sense.copy(), reaction)
        changes = self._update_states(states, self._position(u, load, anchor), load_arguments(load))
        return EquilibriumState(u, pressure, *states, load, state.iterations + 1), largest, changes

    def correct(
        self, state: EquilibriumState, anchor: Anchor, scale: float = 1.0
    ) -> tuple[EquilibriumState, float, int]:
        """Return `state` after the step of the last linearisation, its largest displacement [mm], and changed states.

        Under given forces, the step changes depth and travel too.
        """
        deeper, along = (scale * self.system.motion).tolist()
        load = state.load._replace(depth=state.load.depth + deeper, travel=state.load.travel + along)
        corrected, largest, changes = self.apply_step(state, load, self.steps[:, EQUILIBRIUM], anchor(load), scale)
        return corrected, max(largest, abs(deeper), abs(along)), changes

    def solve(
        self, start: EquilibriumState, load: LoadState, termination: Termination = TO_ROUND_OFF
    ) -> EquilibriumState:
        """Return the equilibrium under `load`, from `start`.

        Tangents and their factors are kept where steps are small or decrease fast. The remaining error is estimated
        from consecutive steps: convergence is quadratic with a new tangent, linear with a kept one. Raises NotConverged
        after the iterations of `termination`, or where the body would turn inside out.
        """
        states = ContactStates(start.state.copy(), start.sense.copy(), start.reaction)
        position = self._position(start.u, load, start.skin_positions(self.condensed)[:, 0].copy())
        self._update_states(states, position, load_arguments(load))
        begin = replace(start, state=states.state, sense=states.sense, load=load)
        if self.condensed.constant and self.condensed.motions.shape[1]:
            begin = lower_onto_surface(self.condensed, begin)
        return self.solve_from(begin, start, None, termination)

    def solve_from(
        self, begin: EquilibriumState, start: EquilibriumState, forces: ForceLoad | None, termination: Termination
    ) -> EquilibriumState:
        """Return the equilibrium one step from `start`, as `solve` does, with iterations that begin at `begin`.

        Depth and travel are those of `begin`, unless they follow from `forces`.
        """
        if forces is not None and forces.tangential is None:
            begin = replace(begin, load=begin.load._replace(travel=forces.travel))
        anchor = start.anchor(self.condensed)
        if self.condensed.constant:
            return self.solve_linear(begin, anchor(begin.load), forces)
        rounds = CONTROL.max_rounds if forces is None else 0  # more rounds lose drags near the friction limit

        def linearise(state: EquilibriumState, *, reuse: bool = False) -> bool:
            return self.linearise(state, anchor(state.load), rounds, forces, reuse=reuse)

        return self._iterate(begin, linearise, anchor, termination)

    def _iterate(
        self, begin: EquilibriumState, linearise: Callable[..., bool], anchor: Anchor, termination: Termination
    ) -> EquilibriumState:
        """Return the equilibrium to which iterations from `begin` converge. Raises NotConverged."""
        state = previous = begin
        reuse = self.condensed.equilibrium is begin.u
        size = self.length_scale
        scale, first, last, new, equal_steps = 1.0, 0.0, 0.0, False, 0
        for _ in range(termination.max_iterations):
            if reuse:
                if not linearise(state, reuse=True):
                    reuse = False
                    continue
                previous = state
            elif not linearise(state):
                scale /= 2.0  # the last step went too far
                if state is previous or scale < CONTROL.min_damping or not linearise(previous):
                    raise NotConverged("the body would turn inside out, or nothing holds it along the surface")
                state = previous
            elif state is not previous:
                previous, scale = state, min(1.0, 2.0 * scale)
            state, largest, changes = self.correct(previous, anchor, scale)
            if not largest < CONTROL.divergence * size:
                raise NotConverged("the displacements grow without bound")
            first = first or largest
            fall = min(largest / last, 1.0) if last > 0.0 else 1.0
            equal_steps = equal_steps + 1 if changes and abs(largest - last) <= CONTROL.cycle_tolerance * last else 0
            if equal_steps == CONTROL.cycle_steps:
                raise NotConverged("states of contact come again and again")
            ratio = CONTROL.ratio_safety * fall
            remainder = min(ratio**2 if not reuse else 2.0 * ratio if new else ratio, 1.0)
            accuracy = max(termination.tolerance * size, termination.relative_to_first * first)
            if largest * remainder < CONTROL.error_share * accuracy and not changes and scale == 1.0:
                self.condensed.equilibrium = state.u
                return state
            new = not reuse
            still = largest < CONTROL.reuse_step * size if last == 0.0 else fall < CONTROL.renewal_ratio
            # The body has turned since a kept tangent: steps change volume at second order, against high stiffness.
            may_turn = self.bulk * largest < CONTROL.reuse_bulk_step * size
            reuse = (still if reuse else fall < CONTROL.reuse_ratio and scale == 1.0) and may_turn
            last = largest
        raise NotConverged(f"no equilibrium within {termination.max_iterations} iterations")

    def solve_linear(
        self, state: EquilibriumState, anchor: Array, forces: ForceLoad | None = None, rounds: int | None = None
    ) -> EquilibriumState:
        """Return the equilibrium of a body of constant stiffness; the search for contact states begins at `state`.

        Under `forces`, depth and travel are unknown. Raises ContactLost, at the latest after `rounds` systems.
        """
        self.systems += 1
        self.condensed.linearise(self._rest, None)  # any state is one step away
        rounds = CONTROL.max_systems + 4 * len(self.skin_x) if rounds is None else rounds
        count = self.solve_contact(replace(state, u=self._rest), anchor, rounds, forces)
        if count == SINGULAR:
            raise ContactLost("the touching points have no unique forces")
        if count == UNSETTLED:
            raise ContactLost(f"the states of the touching points still contradicted each other after {rounds} systems")
        u = self.steps[:, EQUILIBRIUM].reshape(-1, 2).copy()
        deeper, along = self.system.motion.tolist()
        load = state.load._replace(depth=state.load.depth + deeper, travel=state.load.travel + along)
        iterations = state.iterations + count
        contact = self._states
        return EquilibriumState(
            u, state.pressure, contact.state.copy(), contact.sense.copy(), contact.reaction.copy(), load, iterations
        )


def lower_onto_surface(body: CondensedBody, start: EquilibriumState) -> EquilibriumState:
    """Return a state without contact with its lowest node in contact, on which forces can act.

    A body without supports gets one node for each rigid motion.
    """
    if start.touching.any():
        return start
    state, count = start.state.copy(), max(body.motions.shape[1], 1)
    lowest = np.argsort(start.skin_positions(body)[:, 1], kind="stable")[:count]
    state[lowest] = SLIP if start.load.frictionless else STICK
    return replace(start, state=state)


def load_arguments(load: LoadState) -> LoadArguments:
    """Return `load` as an argument of the kernels."""
    return LoadArguments(float(load.depth), float(load.mu), float(load.tau), load.sense)
