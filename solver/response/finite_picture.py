"""The whole finger at finite strain as a picture: where its elements are, and what energy they hold."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from solver.arrays import Array, Indices
from solver.body.finite import FiniteBody, FiniteProbes
from solver.body.receptor import Endings
from solver.body.stiffness import Elastic, Probes
from solver.body.tissues import settled_moduli
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.newton import EquilibriumState
from solver.response.live_picture import MIDDLES, QUARTERS
from solver.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class FinitePicture:
    """A finger in quadrilaterals, four to an element."""

    faces: Indices  # (f, 4) nodes of the quadrilaterals that are drawn
    _body: FiniteBody
    _middles: FiniteProbes

    @classmethod
    def of(cls, finger: FiniteFinger, scene: Scene) -> Self:
        """Place a probe in the middle of each face of the `finger` of `scene`."""
        body, mesh = finger.newton.body, finger.geometry.mesh
        elastic = Elastic.of(mesh, settled_moduli(scene.materials))
        count = len(mesh.elements)
        element = np.repeat(np.arange(count), len(MIDDLES))
        probes = Probes.at(mesh, elastic, element, np.tile(MIDDLES, (count, 1)))
        each = Endings(probes, np.ones(len(element)), np.arange(len(element)), len(element))
        return cls(mesh.elements[:, QUARTERS].reshape(-1, 4), body, FiniteProbes.of(body, each))

    @property
    def rest(self) -> Array:
        """Return where the nodes are undeformed (n, 2) [mm]."""
        return self._body.mesh.nodes

    def nodes(self, shape: EquilibriumState) -> Array:
        """Return where the nodes are (n, 2) [mm], the surface being y = 0."""
        return self._body.mesh.nodes + shape.u - [0.0, shape.pull.depth]

    def sed(self, shape: EquilibriumState) -> Array:
        """Return the SED in the middle of each face (f,) [MPa]."""
        return self._middles.energy(self._body, shape.u)
