"""One load step of a body at finite strain: Newton, contact states and displacements updated together.

Unknown are the displacements; the states of the skin's nodes (open, stick, slip, slip at the bound) change with every
iteration (primal-dual active set: Alart and Curnier 1991; Hüeber and Wohlmuth 2005). Nothing is left of a penalty. The
pressure in the geometric stiffness is the linearised prediction of the iteration before (mixed integration points:
Magisano, Leonetti and Garcea 2017), which lets a nearly incompressible body take the whole depth in a step or two.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver import _kernels as kernels
from solver._kernels import OPEN, bind_arguments
from solver._kernels.arguments import (
    BodyState,
    ContactStates,
    ContactSystem,
    ElementSystem,
    LoadState,
    SkinPosition,
)
from solver.body.finite import FiniteBody
from solver.body.validation import finite
from solver.contact.law import FrictionLaw
from solver.failures import NotConverged
from solver.linalg.multifrontal import Elimination
from solver.mesh import Array

States = NDArray[np.int32]
SHORTEST = 1.0 / 16.0  # part of a Newton step below which a body that turns inside out is given up
ROUNDS = 12  # of changes of contact states within one linear system: dense, of the skin alone, and so cheap
NEAR = 0.1  # step below which the tangent of the state before is tried again [mm]
FAST = 0.02  # fall of the steps' size, below which a new tangent is kept
SLOW = 0.5  # the same, above which a kept one is given up
TURNED = 0.01  # step times bulk over shear stiffness, above which no tangent is kept [mm]
MARGIN = 0.5  # part of the tolerance that the step still missing, as judged, may take
SAME, AGAIN = 1e-3, 4  # relative difference of steps that are the same, and how many in a row are a circle
EQUILIBRIUM, BY_DEPTH, BY_FRICTION, BY_TRAVEL = 0, 1, 2, 3  # columns of Newton.steps


class Pull(NamedTuple):
    """What the surface does: how far it has risen, how far it has moved, and its friction."""

    depth: float  # of the bone's travel towards the surface [mm]
    mu: float  # [-]
    tau: float = np.inf  # traction bound [MPa]
    sense: int = (
        0  # +1, -1: the settled sliding state whose friction force on the skin points there; 0: sticks or slips
    )
    travel: float = 0.0  # of the surface along +x relative to the bone [mm]

    def checked(self) -> "Pull":
        """Return the same of floats alone, as loops take them. Raises ValueError for friction or ways that are none."""
        law = FrictionLaw(float(self.mu), float(self.tau))
        if self.sense not in (-1, 0, 1):
            raise ValueError(f"sense = {self.sense} is not allowed: friction points along +1 or -1, or is found by 0")
        depth, travel = finite("depth", self.depth), finite("travel", self.travel)
        return Pull(depth, law.mu, law.tau_max, int(self.sense), travel)


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A state of the body; never changed once made. k nodes of skin, e elements."""

    u: Array  # (nodes, 2) displacements relative to the bone [mm]
    pressure: Array  # (e, 3) modes of the pressure as the next tangent sees them
    state: States  # (k,)
    sense: States  # (k,) direction of the friction force on the skin where it slips
    reaction: Array  # (k, 2) forces of the surface on the skin [N/mm]
    pull: Pull
    iterations: int  # linear systems solved on the way here, from undeformed

    @staticmethod
    def undeformed(body: FiniteBody) -> "Shape":
        """Return the body before anything touches it."""
        count = len(body.skin)
        zero = np.zeros(count, np.int32)
        u, pressure = np.zeros(body.mesh.nodes.shape), np.zeros((len(body.nodes), 3))
        return Shape(u, pressure, zero, zero, np.zeros((count, 2)), Pull(0.0, 0.0), 0)

    def place(self, body: FiniteBody) -> Array:
        """Return the deformed positions of the skin's nodes (k, 2) [mm]."""
        return body.mesh.nodes[body.mesh.skin] + self.u[body.mesh.skin]

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Which nodes touch, (k,)."""
        return self.state != OPEN

    @property
    def force(self) -> Array:
        """Force of the surface on the body along x and y (2,) [N/mm]."""
        return self.reaction.sum(axis=0)


class Newton:
    """The iterations on one body, with the memory they need."""

    def __init__(self, body: FiniteBody, beside: "Newton | None" = None) -> None:
        """Set memory aside for `body`, or share that of `beside` where both are eliminated by one plan.

        What is there then belongs to whichever was linearised last.
        """
        count, skin = len(body.nodes), len(body.skin)
        self.body = body
        self.systems = 0  # tangents assembled, or tried
        self.load = np.zeros(body.size)  # dead loads on the body, of `solver.body.dead_loads`
        self.force = np.zeros(body.size)
        if beside is not None and beside.body.plan is body.plan:
            self.inside, self.system = beside.inside, beside.system._replace(force=self.force)
        else:
            self.inside = Elimination(body.plan)
            self.system = ElementSystem(
                np.zeros((count, 16, 16)), self.force, np.zeros((count, 2, 17)), np.zeros((count, 3)),
                np.zeros((count, 3, 18)), np.zeros((count, 3)),
            )  # fmt: skip
        self.steps = np.zeros((2 * skin, 4))  # of the skin
        self.bulk = float((body.lame / body.shear).max())  # how much stiffer the body is to a change of volume [-]
        self.skin_x, self._skin_y = body.mesh.nodes[body.skin, 0], body.mesh.nodes[body.skin, 1]
        zero = np.zeros(skin, np.int32)
        self._states = ContactStates(zero, zero.copy(), np.zeros((skin, 2)))
        self._contact = ContactSystem(
            np.zeros(skin), np.zeros(2 * skin, np.int32), np.zeros(4 * skin * skin), np.zeros((2 * skin, 4)), self.steps
        )
        elements, inside = body.elements, self.inside
        self._assemble = bind_arguments(kernels.assemble, elements, self.system)
        self._forces = bind_arguments(kernels.forces, elements, self.system)
        self._condense = bind_arguments(kernels.condense_forces, self.force, self.load, inside.carried, inside.factors)
        self._solve_contact = bind_arguments(kernels.solve_active_set, self._contact)
        self._meet_skin = bind_arguments(kernels.meet, body.contact_skin, self._contact.length)
        self._move = bind_arguments(kernels.move, inside.carried, inside.factors, elements, self.system)

    def linearise(self, shape: Shape, pull: Pull, anchor: Array, rounds: int = 0) -> bool:
        """Set up the system at `shape` under `pull`, solve it for the skin's `steps` (2 k, 4); False where it fails.

        `anchor` (k,) are the positions along x where nodes stick [mm]. The states of contact are changed up to `rounds`
        times until none contradicts the linearised body.
        """
        self.inside.found = None
        self.systems += 1
        if not self._assembled(shape) > 0.0 or not self.inside.factorise(self.system.tangent):
            return False
        return self._touch(shape, pull, anchor, rounds)

    def relinearise(self, shape: Shape, pull: Pull, anchor: Array, rounds: int) -> bool:
        """Do the same with the forces at `shape`, but the tangent and its factors that are there already."""
        return self._resisted(shape) > 0.0 and self._touch(shape, pull, anchor, rounds)

    def _assembled(self, shape: Shape) -> float:
        """Fill tangents and forces at `shape` and return the least det F."""
        return self._assemble(shape.u, shape.pressure)

    def _resisted(self, shape: Shape) -> float:
        """Fill the forces at `shape` for the tangent that is there and return the least det F."""
        return self._forces(shape.u)

    def _touch(self, shape: Shape, pull: Pull, anchor: Array, rounds: int) -> bool:
        self._states.state[:], self._states.sense[:] = shape.state, shape.sense
        self._condense()
        inside, body = self.inside, self.body
        solved = self._solve_contact(
            inside.stiffness, inside.felt, body.contact_skin, self._states, load_state(pull),
            self._position(shape.u, pull, anchor), rounds,
        )  # fmt: skip
        return solved and bool(np.isfinite(self.steps[:, EQUILIBRIUM]).all())

    def _position(self, u: Array, pull: Pull, anchor: Array) -> SkinPosition:
        """Return where the skin lies for displacements `u` (nodes, 2), relative to the surface."""
        skin = self.body.skin
        return SkinPosition(self.skin_x + u[skin, 0], self._skin_y + u[skin, 1] - pull.depth, anchor)

    def follows(self, steps: Array) -> Array:
        """Return how the force of the surface along x and y (2, c) changes with `steps` of the skin (2 k, c)."""
        return self.inside.stiffness.reshape(-1, 2, len(steps)).sum(axis=0) @ steps

    def moved(
        self, shape: Shape, pull: Pull, skin: Array, anchor: Array, scale: float = 1.0
    ) -> tuple[Shape, float, int]:
        """Return the shape after the skin's step (2 k,), its largest move [mm], and how many states it changed."""
        after = BodyState(np.empty_like(shape.u), np.empty_like(shape.pressure))
        skin = np.ascontiguousarray(skin)
        reaction = (self.inside.felt + self.inside.stiffness @ skin).reshape(-1, 2)
        states = ContactStates(self._states.state.copy(), self._states.sense.copy(), reaction)
        largest = self._move(BodyState(shape.u, shape.pressure), skin, scale, after)
        changed = self._meet_skin(states, self._position(after.u, pull, anchor), load_state(pull))
        return Shape(*after, *states, pull, shape.iterations + 1), largest, changed

    def settle(self, start: Shape, pull: Pull, tolerance: float = 1e-10, limit: int = 25) -> Shape:
        """Return the equilibrium under `pull`, from `start`, its displacements good to `tolerance` [mm].

        Tangents are kept, factors and all, where steps are small or fall fast. What is still missing is judged from how
        the steps fall: with a new tangent as the square, with a kept one in proportion. Raises NotConverged where
        `limit` iterations do not do it or the body would turn inside out.
        """
        x = self.skin_x + start.u[self.body.skin, 0]
        anchor = x + (pull.travel - start.pull.travel)
        shape = before = self._entered(start, pull, x)
        kept = self.inside.found is start.u
        scale, last, new, alike = 1.0, 0.0, False, 0
        for _ in range(limit):
            if kept:
                if not self.relinearise(shape, pull, anchor, ROUNDS):
                    kept = False
                    continue
                before = shape
            elif not self.linearise(shape, pull, anchor, ROUNDS):
                scale /= 2.0  # the last step went too far
                if shape is before or scale < SHORTEST or not self.linearise(before, pull, anchor, ROUNDS):
                    raise NotConverged("the body would turn inside out")
                shape = before
            elif shape is not before:
                before, scale = shape, min(1.0, 2.0 * scale)
            shape, largest, changed = self.moved(before, pull, self.steps[:, EQUILIBRIUM].copy(), anchor, scale)
            if not largest < 1e3:
                raise NotConverged("the displacements grow without bound")
            fall = min(largest / last, 1.0) if last > 0.0 else 1.0
            alike = alike + 1 if changed and abs(largest - last) <= SAME * last else 0
            if alike == AGAIN:
                raise NotConverged("states of contact come again and again")
            left = min((2.0 * fall) ** 2 if not kept else 4.0 * fall if new else 2.0 * fall, 1.0)
            if largest * left < MARGIN * tolerance and not changed and scale == 1.0:
                self.inside.found = shape.u
                return shape
            new = not kept
            still = largest < NEAR if last == 0.0 else fall < SLOW
            # A step along a tangent that has turned changes volume to second order, and a stiff body answers strongly.
            kept = (still if kept else fall < FAST and scale == 1.0) and self.bulk * largest < TURNED
            last = largest
        raise NotConverged(f"no equilibrium within {limit} iterations")

    def _entered(self, start: Shape, pull: Pull, x: Array) -> Shape:
        """Return `start`, whose skin lies at `x` (k,) along the surface, with the states that `pull` brings at once."""
        states = ContactStates(start.state.copy(), start.sense.copy(), start.reaction)
        position = SkinPosition(x, self._skin_y + start.u[self.body.skin, 1] - pull.depth, x)
        self._meet_skin(states, position, load_state(pull))
        return Shape(start.u, start.pressure, *states, start.pull, start.iterations)


def load_state(pull: Pull) -> LoadState:
    """Return `pull` as loops take it."""
    return LoadState(float(pull.depth), float(pull.mu), float(pull.tau), int(pull.sense))
