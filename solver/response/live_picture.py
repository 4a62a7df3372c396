"""The whole finger as a picture, as fast as it moves: where its elements are and what energy they hold, by its forces.

At small strain both follow from the contact forces by matrices made once, so that a picture costs two products.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from solver.arrays import Array, Indices
from solver.body.stiffness import Probes
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.newton import EquilibriumState

# A nine-node element as four quadrilaterals, and the middle of each in its coordinates.
QUARTERS = np.array([[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]])
MIDDLES = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@dataclass(frozen=True, slots=True, eq=False)
class LivePicture:
    """A finger as the displacements (2 k,) of its skin see it."""

    faces: Indices  # (f, 4) nodes of the quadrilaterals that are drawn
    rest: Array  # (n, 2) undeformed nodes [mm]
    _moved: Array  # (2 n, 2 k) displacements, x and y in turn [mm per mm]
    _strain: Array  # (3, f, 2 k) xx, yy and xy times root of 2 in the middle of each face [1/mm]
    _theta: Array  # (f, 2 k) volume strain there
    _shear: Array  # (f,) [MPa]
    _lame: Array  # (f,) [MPa]

    @classmethod
    def of(cls, finger: FingerModel) -> Self:
        """Make the matrices of `finger`."""
        mesh, elastic = finger.geometry.mesh, finger.body.elastic
        everywhere = finger.body.every_step()  # (nodes, 2, 2 k)
        count = len(mesh.elements)
        element = np.repeat(np.arange(count), len(MIDDLES))
        probes = Probes.at(mesh, elastic, element, np.tile(MIDDLES, (count, 1)))
        strain = np.moveaxis(probes.strains(mesh, everywhere), 1, 0)
        return cls(
            mesh.elements[:, QUARTERS].reshape(-1, 4),
            mesh.nodes,
            np.ascontiguousarray(everywhere.reshape(2 * len(mesh.nodes), -1)),
            strain[:3],
            strain[3],
            elastic.shear[element],
            elastic.lame[element],
        )

    def nodes(self, state: EquilibriumState) -> Array:
        """Return where the nodes are (n, 2) [mm], the surface being y = 0."""
        return self.rest + (self._moved @ state.u.ravel()).reshape(-1, 2) - [0.0, state.pull.depth]

    def sed(self, state: EquilibriumState) -> Array:
        """Return the SED in the middle of each face (f,) [MPa]."""
        skin = state.u.ravel()
        xx, yy, xy = self._strain @ skin
        theta = self._theta @ skin
        return self._shear * (xx**2 + yy**2 + xy**2) + self._lame / 2.0 * theta**2
