"""The warm stepper at small strain: a measured force in, the state of the finger and its response out.

Without contact the finger is linear, so all that is ever asked of it is condensed once onto the skin that may touch:
its stiffness, the skin's outline (a matrix) and the SED of every ending (a quadratic form of the skin's displacements).
A reading is then one search for contact states, forces given.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Self

import numpy as np
from numpy.typing import NDArray

from solver._kernels import SLIP, STICK
from solver.arrays import Array
from solver.body.linear import CondensedLinear
from solver.body.receptor import Endings
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.newton import EquilibriumState, Given, Newton, Pull, lowered
from solver.failures import ContactLost

SLIDING = 0.995  # part of the friction limit beyond which the tangential force means sliding
LIGHT = 1e-7  # N/mm: less than this is no touch
CHANGES = 60  # systems after which a reading is given up: 1 to 3 are usual
NOTHING = 1e-14  # part of an energy that is left out of its quadratic form


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """A finger as the displacements (2 k,) of its skin see it, x and y of one node after the other."""

    skin: CondensedLinear
    ending: Array  # (a, 2 k): the reference ending's SED is the sum of squares of this times the displacements
    row: Array  # (b, 2 k): likewise, one ending of the row after the other
    row_starts: NDArray[np.int64]  # (r,) first line of each ending in `row`
    row_known: NDArray[np.bool_]  # (r,) whether the finger reaches there
    outline: Array  # (w, 2) undeformed skin, from the palmar cut round the tip to the dorsal one [mm]
    outline_by_skin: Array  # (2 w, 2 k) its displacements, x and y in turn [-]

    @classmethod
    def of(cls, finger: FingerModel) -> Self:
        """Condense `finger`."""
        everywhere = finger.body.every_step()  # (nodes, 2, 2 k)
        parts = _square_roots(finger, finger.row, everywhere)
        starts = np.cumsum([0, *(len(part) for part in parts[:-1])])
        whole = finger.geometry.whole
        return cls(
            finger.body.condensed,
            _square_roots(finger, finger.ending, everywhere)[0],
            np.concatenate(parts),
            starts,
            np.array([bool(part.any()) for part in parts]),
            finger.geometry.mesh.nodes[whole],
            np.ascontiguousarray(everywhere[whole].reshape(2 * len(whole), -1)),
        )


def _square_roots(finger: FingerModel, endings: Endings, everywhere: Array) -> list[Array]:
    """Return for each ending a matrix (a, 2 k): the SED is the sum of squares of it times the skin's unknowns."""
    mesh, elastic, probes = finger.geometry.mesh, finger.body.elastic, endings.probes
    shear, lame = elastic.shear[probes.element, None, None], elastic.lame[probes.element, None, None]
    lines = probes.strains(mesh, everywhere)  # (p, 4, 2 k)
    lines *= np.sqrt(np.concatenate([shear, shear, shear, lame / 2.0], axis=1))  # W = G eps:eps + lambda/2 theta^2
    area = np.bincount(endings.patch, endings.weights, endings.count)
    out: list[Array] = []
    for number in range(endings.count):
        mine = endings.patch == number
        if not mine.any():
            out.append(np.zeros((1, lines.shape[2])))
            continue
        scaled = np.sqrt(endings.weights[mine] / area[number])[:, None, None] * lines[mine]
        _, sizes, turns = np.linalg.svd(scaled.reshape(-1, lines.shape[2]), full_matrices=False)
        kept = sizes**2 > NOTHING * sizes[0] ** 2
        out.append(sizes[kept, None] * turns[kept])
    return out


class SmallStepper:
    """Follows one finger on one surface; holds the last state, and memory of fixed size."""

    def __init__(self, finger: Condensed, mu: float, tau: float = np.inf) -> None:
        """Start untouched, for a surface of friction `mu` and traction bound `tau` [MPa]."""
        self._finger, self._newton = finger, Newton(finger.skin)
        self.mu, self.tau = mu, tau
        self.state = EquilibriumState.undeformed(finger.skin)

    @property
    def depth(self) -> float:
        """Indentation found [mm]."""
        return self.state.pull.depth

    @property
    def travel(self) -> float:
        """How far the bone has moved along +x while something stuck [mm]; sliding, which forces do not tell, adds 0."""
        return 0.0 - self.state.pull.travel

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        self.state = EquilibriumState.undeformed(self._finger.skin)

    def step(self, normal: float, tangential: float) -> float:
        """Take one reading and return the SED averaged over the ending [MPa]; nan where the state was lost.

        `normal` [N/mm] presses the finger, `tangential` [N/mm] is the surface's pull on it along +x. Backward Euler: a
        point sticks where it was, or slips from there against its friction force. A lost state starts afresh from the
        untouched finger with the next reading; a reading that is no number is nan too, and leaves the state as it was.
        """
        normal, tangential = float(normal), float(tangential)  # loops are compiled for these alone
        if not isfinite(normal + tangential):
            return float("nan")
        if normal < LIGHT:
            self.forget()
            return 0.0
        pull = min(max(tangential, -self.mu * normal), self.mu * normal)
        slides = abs(pull) >= SLIDING * self._most(normal)
        start = self._ready(pull, slides=slides)
        before = start.pull.travel
        given = Given(normal, None, before) if slides else Given(normal, pull)
        x = start.u[:, 0] + self._newton.skin_x
        try:
            found = self._newton.solved(start, start.pull, x, given, CHANGES)
        except ContactLost:
            self.forget()
            return float("nan")
        if found.touching[0] or found.touching[-1]:
            self.forget()
            return float("nan")
        self.state = found
        stretched = self._finger.ending @ found.u.ravel()
        return float(stretched @ stretched)

    def _ready(self, tangential: float, *, slides: bool) -> EquilibriumState:
        """Return the last state under today's friction; where the finger `slides` all that touches slips."""
        state, sense = self.state.state, self.state.sense
        way = (1 if tangential > 0.0 else -1) if slides else 0
        if slides:
            state, sense = np.where(state == STICK, SLIP, state).astype(np.int32), np.full(len(sense), way, np.int32)
        last, before = self.state, self.state.pull
        under = Pull(before.depth, self.mu, self.tau, way, before.travel)
        start = EquilibriumState(last.u, last.pressure, state, sense, last.reaction, under, 0)
        return start if state.any() else lowered(self._newton.condensed, start)

    def _most(self, normal: float) -> float:
        """Return the largest tangential force the surface can carry [N/mm], pressures shared out as they last were."""
        if self.tau == np.inf:
            return self.mu * normal
        push = self.state.normal
        total = float(push.sum())
        if total <= 0.0:
            return self.mu * normal
        part = self.mu * normal / total
        return float(np.minimum(part * push, self.tau * self._finger.skin.fixed_length).sum())

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa]; nan where the finger ends before one."""
        finger = self._finger
        stretched = finger.row @ self.state.u.ravel()
        sed = np.add.reduceat(stretched * stretched, finger.row_starts)
        return np.where(finger.row_known, sed, np.nan)

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""
        finger = self._finger
        moved = (finger.outline_by_skin @ self.state.u.ravel()).reshape(-1, 2)
        return finger.outline + moved - [0.0, self.depth]
