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

from solver._kernels import rubbing
from solver.body.validation import finite
from solver.contact.law import OPEN, SHEAR_LIMITED, SLIP, STICK, FrictionLaw

Array = NDArray[np.float64]
States = NDArray[np.int8]
Flags = NDArray[np.bool_]
SMALL = 1e-11  # a contradiction smaller than this, relative to the largest of its kind, is round-off
ROUNDS = 12  # systems after which the short way to settled sliding is given up
FIRST = (0.3, 0.1, 0.03, 0.01, 0.6, 1.0)  # parts of the skin's height tried as what touches under a force, in turn
HERTZ = 0.5  # part of the depth below which skin is first thought to touch: half as deep is half the overlap's square

AMBIGUOUS = "the touching points have no unique forces"
CONTRADICTORY = "the states of the touching points still contradicted each other after {} corrections"


class ContactLost(Exception):
    """No set of states was found that contradicts nothing; the message says what was tried."""


@dataclass(frozen=True, slots=True, eq=False)
class Touchable:
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
    carried: bool = False  # whether dead loads are balanced by the surface alone, so that they act from first touch on


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


class System:
    """The linear system of one guess of states."""

    def __init__(self, body: Touchable, law: FrictionLaw, state: States, sense: Array) -> None:
        """Write down the system of `state` (k,), friction forces pointing along `sense` (k,)."""
        self.on = np.flatnonzero(state != OPEN)
        self.stuck = np.flatnonzero(state == STICK)
        on, stuck, free = self.on, self.stuck, body.motions.shape[1]
        by_force, by_length = law.slopes(state, sense)
        self.drag = drag = by_force[on]  # tangential by normal force
        self.capped = by_length * body.length  # (k,) tangential force of points at the bound
        count = len(on) + len(stuck)
        matrix = np.zeros((count + free, count + free))
        touch = body.normal_by_normal[np.ix_(on, on)] + body.normal_by_tangential[np.ix_(on, on)] * drag
        matrix[: len(on), : len(on)] = touch
        if len(stuck):
            coupling = body.normal_by_tangential[np.ix_(on, stuck)]
            inside = body.tangential_by_tangential[np.ix_(stuck, on)]
            matrix[: len(on), len(on) : count] = coupling
            matrix[len(on) : count, : len(on)] = coupling.T + inside * drag
            matrix[len(on) : count, len(on) : count] = body.tangential_by_tangential[np.ix_(stuck, stuck)]
        if free:
            normal, tangential = np.split(body.motions, 2)
            matrix[: len(on), count:], matrix[len(on) : count, count:] = normal[on], tangential[stuck]
            matrix[count:, : len(on)] = (normal[on] + tangential[on] * drag[:, None]).T
            matrix[count:, len(on) : count] = tangential[stuck].T
        self._matrix = matrix

    def solve(self, right: Array) -> Array:
        """Return the solution for the right-hand side `right`, or for several side by side."""
        return np.asarray(np.linalg.solve(self._matrix, right), np.float64)


class Course:
    """Contact of one body under one law, step after step."""

    def __init__(self, body: Touchable, law: FrictionLaw, patience: int | None = None) -> None:
        """Start with nothing known; a step is given up after `patience` corrections (None: when nothing can help)."""
        self.body = body
        self.law = law
        self._patience = 20 + 4 * len(body.gap) if patience is None else patience
        self._entering = SLIP  # what a point is first thought to do when it comes to touch
        self._resultants = body.resultants

    def sliding(self, depth: float, direction: int, guess: States | None = None) -> Contact:
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
        if guess is None and not self.body.motions.shape[1]:
            found = self._slid(depth, -float(direction))
            if found is not None:
                return found
        for number, first in enumerate(guesses):
            try:
                return self._consistent(depth, 0.0, np.zeros(count), first.astype(np.int8), sense, free=False)
            except ContactLost:
                if number == len(guesses) - 1:
                    raise
        raise AssertionError  # there is always a guess

    def _heights(self) -> Array:
        """Return heights [mm] below which skin may first be thought to touch where a force finds the depth."""
        low, high = float(self.body.gap.min()), float(self.body.gap.max())
        return low + np.array(FIRST) * (high - low)

    def _slid(self, depth: float, sense: float) -> Contact | None:
        """Return what `_consistent` does where all that touches slips one way; None where that takes many rounds.

        Points are then open, slipping or slipping at the bound, and the drag follows from the pressure.
        """
        body, law, count = self.body, self.law, len(self.body.gap)
        found = _blank(body, np.zeros(count, np.int8), np.full(count, sense))
        systems = rubbing.slide(
            body.gap, body.length, body.normal_by_normal, body.normal_by_tangential, body.tangential_by_tangential,
            np.ascontiguousarray(body.normal_free),
            np.ascontiguousarray(body.tangential_free), law.mu, law.tau_max, depth, sense, ROUNDS, HERTZ, found.state,
            found.normal, found.tangential, found.shift, found.gap,
        )  # fmt: skip
        return None if systems == rubbing.LOST else replace(found, iterations=systems)

    def step(self, before: Contact, depth: float, travel: float, resultants: Array | None = None) -> Contact:
        """Return the state after the body was driven to `depth` and `travel` along +x [mm], coming from `before`.

        Backward Euler: a point sticks where it was, or slips from there against its friction force. `resultants` (r,)
        [N/mm] take the place of the body's own where the forces along its free motions change with time. Raises
        ContactLost, and ValueError for a depth or travel that is not finite.
        """
        depth, travel = finite("depth", depth), finite("travel", travel)
        if self.body.motions.shape[1]:
            before = lowered(self.law, before, len(self.body.resultants) if self.body.carried else 1)
        self._resultants = self.body.resultants if resultants is None else resultants
        try:
            return self._consistent(depth, travel, before.shift, before.state, before.sense, free=True)
        except ContactLost:  # points that come to touch are then first thought to stick, not to slip
            self._entering = SLIP if self.law.frictionless else STICK
            return self._consistent(depth, travel, before.shift, before.state, before.sense, free=True)
        finally:
            self._entering = SLIP

    def _consistent(
        self, depth: float, travel: float, anchor: Array, state: States, sense: Array, *, free: bool
    ) -> Contact:
        """Change states until none contradicts the solution; with `free`, points may stick and turn round."""
        body, law, found = self.body, self.law, _blank(self.body, state.copy(), sense.copy())
        # loops are compiled for one order of numbers in memory
        motions, anchor = np.ascontiguousarray(body.motions), np.ascontiguousarray(anchor)
        up, along = np.ascontiguousarray(body.normal_free), np.ascontiguousarray(body.tangential_free)
        systems = rubbing.solve_active_set(
            body.gap, body.length, body.normal_by_normal, body.normal_by_tangential, body.tangential_by_tangential,
            up, along, motions, self._resultants, law.mu, law.tau_max, depth, travel,
            anchor, free, self._entering if free else SLIP, self._patience, found.state, found.sense, found.normal,
            found.tangential, found.shift, found.gap, found.motion,
        )  # fmt: skip
        if systems == rubbing.AMBIGUOUS:
            raise ContactLost(AMBIGUOUS)
        if systems == rubbing.LOST:
            raise ContactLost(CONTRADICTORY.format(self._patience))
        return replace(found, iterations=systems)


def _blank(body: Touchable, state: States, sense: Array) -> Contact:
    """Return a contact for the loops to fill."""
    count, free = len(state), len(body.resultants)
    normal, tangential, shift, gap = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    return Contact(state, sense, normal, tangential, shift, gap, np.zeros(free), 0)


def untouched(body: Touchable, depth: float = 0.0) -> Contact:
    """Return the state before first touch of a body driven to `depth` [mm].

    Dead loads have displaced the skin that they leave clear of the surface. Skin that they would press into it, and all
    skin of a body whose loads the surface carries, touches before they act: it is where it was without them. Under
    a given force the body starts clear of the surface.
    """
    count = len(body.gap)
    zero = np.zeros(count)
    state = np.full(count, OPEN, np.int8)
    clear = np.full(count, not body.carried)
    if not body.motions.shape[1]:
        clear = body.gap + body.normal_free >= depth
    gap = body.gap + np.where(clear, body.normal_free, 0.0) - depth
    return Contact(state, np.ones(count), zero, zero, np.where(clear, body.tangential_free, 0.0), gap, np.zeros(0), 0)


def lowered(law: FrictionLaw, contact: Contact, count: int = 1) -> Contact:
    """Return `contact` with its `count` lowest points on the surface, where nothing touches: forces need some that do.

    A body that nothing holds needs as many as it has free motions.
    """
    if contact.touching.any():
        return contact
    state = contact.state.copy()
    state[np.argsort(contact.gap, kind="stable")[:count]] = SLIP if law.frictionless else STICK
    return replace(contact, state=state)


def forced(body: Touchable, normal_force: float, tangential_force: float | None = None) -> Touchable:
    """Return the body free to move along y under a given normal force [N/mm] instead of being driven to a depth.

    With a `tangential_force`, of the surface on the body along +x [N/mm], it is free to move along x too. Its motions
    are the last of `Contact.motion`: up, then along +x.
    """
    one, zero = np.ones(len(body.gap)), np.zeros(len(body.gap))
    motions, resultants = [body.motions, np.r_[one, zero][:, None]], [body.resultants, [normal_force]]
    if tangential_force is not None:
        motions.append(np.r_[zero, one][:, None])
        resultants.append([tangential_force])
    return replace(body, motions=np.concatenate(motions, axis=1), resultants=np.concatenate(resultants))
