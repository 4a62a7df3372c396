"""The warm stepper at small strain: a measured force in, the state of the finger and its response out.

Without contact the finger is linear, so all that is ever asked of it is condensed once onto the skin that may touch:
its stiffness, the skin's outline (a matrix) and the SED of every ending (a quadratic form of the skin's displacements).
A reading is then one search for contact states, forces given.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.body.linear import CondensedLinear
from solver.body.receptor import LinearPatches
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.newton import Given, Newton, lowered
from solver.failures import ContactLost
from solver.response.stepper import SLIDING, Stepper

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
    def of(cls, finger: LinearFinger) -> Self:
        """Condense `finger`."""
        everywhere = finger.body.every_step()  # (nodes, 2, 2 k)
        parts = _square_roots(finger.row, everywhere)
        starts = np.cumsum([0, *(len(part) for part in parts[:-1])])
        whole = finger.geometry.whole
        return cls(
            finger.body.condensed,
            _square_roots(finger.ending, everywhere)[0],
            np.concatenate(parts),
            starts,
            np.array([bool(part.any()) for part in parts]),
            finger.geometry.mesh.nodes[whole],
            np.ascontiguousarray(everywhere[whole].reshape(2 * len(whole), -1)),
        )


def _square_roots(patches: LinearPatches, everywhere: Array) -> list[Array]:
    """Return for each ending a matrix (a, 2 k): the SED is the sum of squares of it times the skin's unknowns."""
    mesh, elastic, endings = patches.mesh, patches.elastic, patches.endings
    probes = endings.probes
    shear, lame = elastic.shear[probes.element, None, None], elastic.lame[probes.element, None, None]
    lines = probes.strains(mesh, everywhere)  # (p, 4, 2 k)
    lines *= np.sqrt(np.concatenate([shear, shear, shear, lame / 2.0], axis=1))  # W = G eps:eps + lambda/2 theta^2
    area = endings.areas
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


class SmallStepper(Stepper):
    """Follows one finger on one surface at small strain."""

    def __init__(self, finger: Condensed, mu: float, tau: float = np.inf) -> None:
        """Start untouched, for a surface of friction `mu` and traction bound `tau` [MPa]."""
        super().__init__(finger.skin, mu, tau)
        self._finger, self._newton = finger, Newton(finger.skin)

    def _advance(self, normal: float, tangential: float) -> float:
        """Do as `Stepper` says.

        Backward Euler: a point sticks where it was, or slips from there against its friction force.
        """
        slides = abs(tangential) >= SLIDING * self._most(normal)
        start = self._under_friction(slides=slides, sense=1 if tangential > 0.0 else -1)
        if not start.state.any():
            start = lowered(self._newton.condensed, start)
        given = Given(normal, None, start.load.travel) if slides else Given(normal, tangential)
        x = start.u[:, 0] + self._newton.skin_x
        try:
            found = self._newton.solved(start, start.load, x, given, CHANGES)
        except ContactLost:
            self.forget()
            return float("nan")
        if found.touching[0] or found.touching[-1]:
            self.forget()
            return float("nan")
        self.state = found
        stretched = self._finger.ending @ found.u.ravel()
        return float(stretched @ stretched)

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
