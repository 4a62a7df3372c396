"""Contact of a reduced body with a flat rigid surface: which points touch, stick, slip or slip at the bound.

Unknown are the normal forces of the touching points, the tangential forces of the sticking ones and, for a body that
is free to move as a whole, its motion. For one guess of every point's state they follow from one small dense linear
system; states that contradict its solution are changed, and again, until none does (primal-dual active set: Alart and
Curnier 1991; Hüeber and Wohlmuth 2005). No penalty: what touches has a gap of zero, what slips has exactly the force
of the law.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from solver import ContactLost
from solver.body import CondensedLinear
from solver.body.validation import finite
from solver.contact import OPEN, SHEAR_LIMITED, SLIP, STICK, FrictionLaw
from tests.solver.oracle.laws import friction_slopes, frictionless

Array = NDArray[np.float64]
States = NDArray[np.int8]
Flags = NDArray[np.bool_]
SMALL = 1e-11  # a contradiction smaller than this, relative to the largest of its kind, is round-off
FIRST = (0.3, 0.1, 0.03, 0.01, 0.6, 1.0)  # parts of the skin's height tried as what touches under a force, in turn

AMBIGUOUS = "the touching points have no unique forces"
CONTRADICTORY = "the states of the touching points still contradicted each other after {} corrections"


@dataclass(frozen=True, slots=True, eq=False)
class CondensedSurface:
    """What the surface feels of a body: k points that may touch, and r free motions of the body as a whole.

    Displacements [mm] are relative to the driven part of the body; forces [N/mm] are those of the surface on the body.
    """

    gap: Array  # (k,) height over the surface before any motion [mm]
    length: Array  # (k,) skin each point stands for [mm]
    normal_by_normal: Array  # (k, k) compliance: displacement along +y by forces along +y [mm per N/mm]
    normal_by_tangential: Array  # (k, k) displacement along +y by forces along +x
    tangential_by_tangential: Array  # (k, k) displacement along +x by forces along +x
    normal_free: Array  # (k,) displacement along +y by the dead loads alone [mm]
    tangential_free: Array  # (k,)
    motions: Array  # (2 k, r) displacement of the points, normal ones first, by each free motion
    resultants: Array  # (r,) what the surface's forces must amount to along each free motion [N/mm]


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """A state of contact that contradicts nothing."""

    state: States  # (k,)
    sense: Array  # (k,) direction of the friction force on a slipping point: +1 along +x, -1 along -x
    normal: Array  # (k,) force on the body along +y [N/mm]
    tangential: Array  # (k,) along +x [N/mm]
    shift: Array  # (k,) position along the surface relative to where it would be undeformed and not driven [mm]
    gap: Array  # (k,) [mm]
    motion: Array  # (r,) free motion
    iterations: int  # linear systems solved

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Return which points touch, (k,)."""
        return self.state != OPEN


def condense_surface(body: CondensedLinear) -> CondensedSurface:
    """Return what the surface feels of a held body: the inverse of its skin's stiffness."""
    compliance = np.linalg.inv(body.stiffness)
    free = (compliance @ body.load).reshape(-1, 2)
    no_motions = np.zeros((2 * len(free), 0))
    return CondensedSurface(
        body.rest[:, 1], body.fixed_length, compliance[1::2, 1::2], compliance[1::2, ::2], compliance[::2, ::2],
        free[:, 1], free[:, 0], no_motions, np.zeros(0),
    )  # fmt: skip


class System:
    """The linear system of one guess of states, factorised."""

    def __init__(self, body: CondensedSurface, law: FrictionLaw, state: States, sense: Array) -> None:
        """Factorise the system of `state` (k,), friction forces pointing along `sense` (k,)."""
        self.key = state.tobytes() + sense.tobytes()
        self.contacts = np.flatnonzero(state != OPEN)
        self.sticking = np.flatnonzero(state == STICK)
        touching, sticking, free = self.contacts, self.sticking, body.motions.shape[1]
        by_force, by_length = friction_slopes(law, state, sense)
        self.drag = drag = by_force[touching]  # tangential by normal force
        self.bounded = by_length * body.length  # (k,) tangential force of points at the bound
        n, count = len(touching), len(touching) + len(sticking)
        matrix = np.zeros((count + free, count + free))
        pairs = np.ix_(touching, touching)
        matrix[:n, :n] = body.normal_by_normal[pairs] + body.normal_by_tangential[pairs] * drag
        if len(sticking):
            coupling = body.normal_by_tangential[np.ix_(touching, sticking)]
            inside = body.tangential_by_tangential[np.ix_(sticking, touching)]
            matrix[:n, n:count] = coupling
            matrix[n:count, :n] = coupling.T + inside * drag
            matrix[n:count, n:count] = body.tangential_by_tangential[np.ix_(sticking, sticking)]
        if free:
            normal, tangential = np.split(body.motions, 2)
            matrix[:n, count:], matrix[n:count, count:] = normal[touching], tangential[sticking]
            matrix[count:, :n] = (normal[touching] + tangential[touching] * drag[:, None]).T
            matrix[count:, n:count] = tangential[sticking].T
        self._factors = dgetrf(matrix) if len(matrix) else None
        self.singular = self._factors is not None and bool(self._factors[2])

    def solve(self, rhs: Array) -> Array:
        """Return the solution for the right-hand side `right`, or for several side by side."""
        return rhs if self._factors is None else dgetrs(self._factors[0], self._factors[1], rhs)[0]


class ContactSolver:
    """Contact of one body under one law, step after step; keeps the last factorisation, since most steps reuse it."""

    def __init__(self, body: CondensedSurface, law: FrictionLaw, patience: int | None = None) -> None:
        """Start with nothing known; a step is given up after `patience` corrections (None: when nothing can help)."""
        self.body = body
        self.law = law
        self._patience = 20 + 4 * len(body.gap) if patience is None else patience
        self._system: System | None = None
        self._entering = SLIP  # what a point is first thought to do when it comes to touch
        self._resultants = body.resultants

    def solve_full_slip(self, depth: float, direction: int, guess: States | None = None) -> Contact:
        """Return the settled sliding state of a body driven `depth` [mm] into the surface and along +x or -x.

        Every touching point slips, so nothing is left of how it came there. Raises ContactLost where no such state
        was found, ValueError for a depth or direction that is none.
        """
        depth = finite("depth", depth)
        if direction not in (-1, 1):
            raise ValueError(f"direction = {direction} is not allowed: it must be +1 or -1")
        count = len(self.body.gap)
        sense = np.full(count, -float(direction))
        low = self.body.gap + self.body.normal_free < depth
        guesses = [np.where(low, SLIP, OPEN)] if guess is None else [guess]
        if guess is None and self.body.motions.shape[1]:  # the depth, or a part of it, is found
            guesses = guesses if low.any() else []
            guesses += [np.where(self.body.gap <= height, SLIP, OPEN) for height in self._heights()]
        if guess is None and np.isfinite(self.law.tau_max):
            guesses.append(np.where(low, SHEAR_LIMITED, OPEN))
        for number, first in enumerate(guesses):
            try:
                return self._solve_active_set(depth, 0.0, np.zeros(count), first.astype(np.int8), sense, free=False)
            except ContactLost:
                if number == len(guesses) - 1:
                    raise
        raise AssertionError  # there is always a guess

    def _heights(self) -> Array:
        """Return heights [mm] below which skin may first be thought to touch where a force finds the depth."""
        low, high = float(self.body.gap.min()), float(self.body.gap.max())
        return low + np.array(FIRST) * (high - low)

    def step(self, before: Contact, depth: float, travel: float, resultants: Array | None = None) -> Contact:
        """Return the state after the body was driven to `depth` and `travel` along +x [mm], coming from `before`.

        Backward Euler: a point sticks where it was, or slips from there against its friction force. `resultants` (r,)
        [N/mm] take the place of the body's own where the forces along its free motions change with time. Raises
        ContactLost, and ValueError for a depth or travel that is not finite.
        """
        depth, travel = finite("depth", depth), finite("travel", travel)
        if self.body.motions.shape[1]:
            before = lower_contact(self.law, before)
        self._resultants = self.body.resultants if resultants is None else resultants
        try:
            return self._solve_active_set(depth, travel, before.shift, before.state, before.sense, free=True)
        except ContactLost:  # points that come to touch are then first thought to stick, not to slip
            self._entering = SLIP if frictionless(self.law) else STICK
            return self._solve_active_set(depth, travel, before.shift, before.state, before.sense, free=True)
        finally:
            self._entering = SLIP

    def _solve_active_set(
        self, depth: float, travel: float, anchor: Array, state: States, sense: Array, *, free: bool
    ) -> Contact:
        """Change states until none contradicts the solution; with `free`, points may stick and turn round."""
        past_keys: set[bytes] = set()
        one_by_one = all_stuck = False
        for iteration in range(1, self._patience + 1):
            if self._system is None or self._system.key != state.tobytes() + sense.tobytes():
                self._system = System(self.body, self.law, state, sense)
            if self._system.singular:
                touching = state != OPEN
                if not free or all_stuck or (state == STICK).any() or not touching.any():
                    raise ContactLost(AMBIGUOUS)
                # a body that is free along x needs a point that holds it: all are tried again, one by one
                state = np.where(touching, STICK, OPEN).astype(np.int8)
                all_stuck = one_by_one = True
                continue
            contact = self._solve_system(self._system, depth, travel, anchor, state, sense, iteration)
            new_state, new_sense, contradiction = self._update_contact_states(contact, anchor, free=free)
            contradicting = np.flatnonzero((new_state != state) | (new_sense != sense))
            if not len(contradicting):
                return contact
            if one_by_one:
                worst = contradicting[np.argmax(contradiction[contradicting])]
                keep = np.arange(len(state)) != worst
                new_state, new_sense = np.where(keep, state, new_state), np.where(keep, sense, new_sense)
            state, sense = new_state.astype(np.int8), new_sense
            key = state.tobytes() + sense.tobytes()
            if key in past_keys:
                one_by_one = True
                past_keys.clear()
            past_keys.add(key)
        raise ContactLost(CONTRADICTORY.format(self._patience))

    def _solve_system(
        self,
        system: System,
        depth: float,
        travel: float,
        anchor: Array,
        state: States,
        sense: Array,
        iteration: int,
    ) -> Contact:
        body, touching, sticking, tangential = self.body, system.contacts, system.sticking, system.bounded
        free_gap = body.gap + body.normal_free - depth + body.normal_by_tangential @ tangential
        free_shift = body.tangential_free + travel + body.tangential_by_tangential @ tangential
        residual = self._resultants - body.motions[len(state) :].T @ tangential
        answer = system.solve(np.concatenate([-free_gap[touching], (anchor - free_shift)[sticking], residual]))
        normal = np.zeros(len(state))
        normal[touching] = answer[: len(touching)]
        rest = np.zeros(len(state))
        rest[touching] = system.drag * normal[touching]
        rest[sticking] = answer[len(touching) : len(touching) + len(sticking)]
        motion = answer[len(touching) + len(sticking) :]
        along_y, along_x = np.split(body.motions @ motion, 2)
        gap = free_gap + along_y + body.normal_by_normal @ normal + body.normal_by_tangential @ rest
        shift = free_shift + along_x + body.normal_by_tangential.T @ normal + body.tangential_by_tangential @ rest
        return Contact(state, sense, normal, tangential + rest, shift, gap, motion, iteration)

    def _update_contact_states(self, contact: Contact, anchor: Array, *, free: bool) -> tuple[States, Array, Array]:
        """Return the states and senses that the solution calls for, and how badly each point contradicts its own."""
        body, law = self.body, self.law
        state, sense = contact.state.copy(), contact.sense.copy()
        force = np.abs(contact.normal).max(initial=0.0)
        lengths = np.concatenate([body.gap, contact.gap, contact.shift])
        height = max(float(np.abs(lengths).max(initial=0.0)), np.finfo(float).tiny)
        contradiction = np.zeros(len(state))

        def change(mask: NDArray[np.bool_], to: int, size: Array) -> None:
            state[mask] = to
            contradiction[mask] = size[mask]

        touching = contact.state != OPEN
        slack = SMALL * force
        bound = law.bound(body.length)
        change((contact.state == SLIP) & (law.mu * contact.normal > bound + slack), SHEAR_LIMITED, contact.normal)
        change((contact.state == SHEAR_LIMITED) & (law.mu * contact.normal < bound - slack), SLIP, contact.normal)
        if free and not frictionless(law):
            over = np.abs(contact.tangential) - law.limit(contact.normal, body.length)
            exceeds = (contact.state == STICK) & (over > slack)
            sense[exceeds] = np.sign(contact.tangential[exceeds])
            at_bound = law.mu * contact.normal > bound
            change(exceeds & ~at_bound, SLIP, over)
            change(exceeds & at_bound, SHEAR_LIMITED, over)
            # a point that slips along its friction force sticks; one whose force is about to change is asked later
            forward = (contact.shift - anchor) * contact.sense
            sticks = (contact.state >= SLIP) & (state == contact.state) & (forward > SMALL * height)
            change(sticks, STICK, forward * force / height)
        change(touching & (contact.normal < -slack), OPEN, -contact.normal)
        enters = ~touching & (contact.gap < -SMALL * height)
        if free:
            sense[enters] = np.where(contact.shift > anchor, -1.0, 1.0)[enters]
        change(enters, self._entering, -contact.gap * force / height)
        return state, sense, contradiction


def undeformed_contact(body: CondensedSurface, depth: float = 0.0) -> Contact:
    """Return the state before first touch."""
    count = len(body.gap)
    zero = np.zeros(count)
    state = np.full(count, OPEN, np.int8)
    gap = body.gap + body.normal_free - depth
    return Contact(state, np.ones(count), zero, zero, body.tangential_free, gap, np.zeros(0), 0)


def lower_contact(law: FrictionLaw, contact: Contact) -> Contact:
    """Return `contact` with the lowest point on the surface, where nothing touches: under a force something does."""
    if contact.touching.any():
        return contact
    state = contact.state.copy()
    state[np.argmin(contact.gap)] = SLIP if frictionless(law) else STICK
    return replace(contact, state=state)


def under_forces(
    body: CondensedSurface, normal_force: float, tangential_force: float | None = None
) -> CondensedSurface:
    """Return the body free to move along y under a given normal force [N/mm] instead of being driven to a depth.

    With a `tangential_force`, of the surface on the body along +x [N/mm], it is free to move along x too. Its motions
    are the last of `Contact.motion`: up, then along +x.
    """
    ones, zeros = np.ones(len(body.gap)), np.zeros(len(body.gap))
    motions, resultants = [body.motions, np.r_[ones, zeros][:, None]], [body.resultants, [normal_force]]
    if tangential_force is not None:
        motions.append(np.r_[zeros, ones][:, None])
        resultants.append([tangential_force])
    return replace(body, motions=np.concatenate(motions, axis=1), resultants=np.concatenate(resultants))
