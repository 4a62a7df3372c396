"""The warm stepper at small strain: a measured force in, the state of the finger and its response out.

Without contact the finger is linear, so all that is ever asked of it is condensed once onto the skin that may touch:
its displacements there (a compliance), the skin's outline (a matrix) and the SED of every ending (a quadratic form of
the contact forces). A reading is then an active-set search on a matrix of some tens of unknowns.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Self

import numpy as np
from numpy.typing import NDArray

from solver._kernels.following import LOST, follow
from solver.body.receptor import Endings
from solver.contact.active_set import OPEN
from solver.equilibrium.finger import FingerModel
from solver.mesh import Array

SLIDING = 0.995  # part of the friction limit beyond which the tangential force means sliding
LIGHT = 1e-7  # N/mm: less than this is no touch
NOTHING = 1e-14  # part of an energy that is left out of its quadratic form


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """A finger as its contact forces (2 k,) see it, those along y first."""

    gap: Array  # (k,) height over the surface before any motion [mm]
    length: Array  # (k,) skin that each point stands for [mm]
    compliance: Array  # (2 k, 2 k) [mm per N/mm]
    ending: Array  # (a, 2 k): the reference ending's SED is the sum of squares of this times the forces
    row: Array  # (b, 2 k): likewise, one ending of the row after the other
    row_starts: NDArray[np.int64]  # (r,) first line of each ending in `row`
    row_known: NDArray[np.bool_]  # (r,) whether the finger reaches there
    outline: Array  # (w, 2) undeformed skin, from the palmar cut round the tip to the dorsal one [mm]
    outline_by_force: Array  # (2 w, 2 k) its displacements, x and y in turn [mm per N/mm]

    @classmethod
    def of(cls, finger: FingerModel) -> Self:
        """Condense `finger`."""
        touch, mesh = finger.body.touchable, finger.geometry.mesh
        compliance = finger.skin_compliance()
        everywhere = finger.body.displacement(compliance)  # (nodes, 2, 2 k)
        parts = _square_roots(finger, finger.row, everywhere)
        starts = np.cumsum([0, *(len(part) for part in parts[:-1])])
        whole = finger.geometry.whole
        return cls(
            touch.gap.copy(),
            touch.length.copy(),
            compliance,
            _square_roots(finger, finger.ending, everywhere)[0],
            np.concatenate(parts),
            starts,
            np.array([bool(part.any()) for part in parts]),
            mesh.nodes[whole],
            np.ascontiguousarray(everywhere[whole].reshape(2 * len(whole), -1)),
        )


def _square_roots(finger: FingerModel, endings: Endings, everywhere: Array) -> list[Array]:
    """Return for each ending a matrix (a, 2 k) whose product with the forces has the SED as its sum of squares."""
    mesh, elastic, probes = finger.geometry.mesh, finger.body.elastic, endings.probes
    gradient = probes.displacement_gradient(mesh, everywhere)  # (p, 2, 2, 2 k)
    theta = probes.volume_strain(mesh, elastic, everywhere)
    shear, lame = elastic.shear[probes.element, None], elastic.lame[probes.element, None]
    # W = G (exx^2 + eyy^2 + 2 exy^2) + lambda/2 theta^2
    lines = np.stack(
        [
            np.sqrt(shear) * gradient[:, 0, 0],
            np.sqrt(shear) * gradient[:, 1, 1],
            np.sqrt(shear / 2.0) * (gradient[:, 0, 1] + gradient[:, 1, 0]),
            np.sqrt(lame / 2.0) * theta,
        ],
        axis=1,
    )  # (p, 4, 2 k)
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
        k = len(finger.gap)
        self._finger = finger
        self.mu, self.tau = mu, tau
        self.state, self._sense = np.zeros(k, np.int32), np.ones(k, np.int32)
        self._anchor = np.zeros(k)
        self._force, self._moved = np.zeros(2 * k), np.zeros(2 * k)
        self._motion = np.zeros(2)

    @property
    def depth(self) -> float:
        """Indentation found [mm]."""
        return float(self._motion[0])

    @property
    def travel(self) -> float:
        """How far the bone has moved along +x while something stuck [mm]; sliding, which forces do not tell, adds 0."""
        return float(self._motion[1])

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        self.state[:] = OPEN
        self._anchor[:] = self._force[:] = self._moved[:] = 0.0
        self._motion[:] = 0.0

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
        finger = self._finger
        pull = min(max(tangential, -self.mu * normal), self.mu * normal)
        slides = abs(pull) >= SLIDING * self._most(normal)
        ended = follow(
            finger.gap, finger.length, finger.compliance, self.mu, self.tau, normal, pull, slides, self._anchor,
            self.state, self._sense, self._force, self._moved, self._motion,
        )  # fmt: skip
        beyond = self.state[0] != OPEN or self.state[-1] != OPEN
        if ended == LOST or beyond or not isfinite(float(self._motion.sum())):
            self.forget()
            return float("nan")
        k = len(self.state)
        np.add(self._moved[k:], self._motion[1], out=self._anchor)
        stretched = finger.ending @ self._force
        return float(stretched @ stretched)

    def _most(self, normal: float) -> float:
        """Return the largest tangential force the surface can carry [N/mm], pressures shared out as they last were."""
        if self.tau == np.inf:
            return self.mu * normal
        push = self._force[: len(self.state)]
        total = float(push.sum())
        if total <= 0.0:
            return self.mu * normal
        length = self._finger.length
        return float(np.minimum(self.mu * push * (normal / total), np.where(push > 0.0, self.tau * length, 0.0)).sum())

    def forces(self) -> Array:
        """Return the surface's forces on the skin that may touch (k, 2) along x and y [N/mm]."""
        k = len(self.state)
        return np.stack([self._force[k:], self._force[:k]], axis=1)

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa]; nan where the finger ends before one."""
        finger = self._finger
        stretched = finger.row @ self._force
        sed = np.add.reduceat(stretched * stretched, finger.row_starts)
        return np.where(finger.row_known, sed, np.nan)

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""
        finger = self._finger
        moved = (finger.outline_by_force @ self._force).reshape(-1, 2)
        return finger.outline + moved - [0.0, self.depth]
