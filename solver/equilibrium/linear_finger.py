"""The finger at small strain on one mesh, reduced to its skin."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter

import numpy as np

from solver.arrays import Array, Indices
from solver.body.linear import LinearBody
from solver.body.receptor import Endings, LinearPatches
from solver.body.stiffness import Elastic, Probes
from solver.body.tissues import settled_moduli
from solver.element import Q2P1
from solver.equilibrium.finger import Finger
from solver.equilibrium.newton import EquilibriumState, Newton
from solver.mesh.mesher import FingerMesh, Sizing, finger_mesh
from solver.scene.scene import Scene


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class LinearFinger(Finger[LinearPatches]):
    """A finger at small strain on one mesh."""

    body: LinearBody
    solve_s: float  # what assembling and reducing took, beside mesh and tables [s]

    @staticmethod
    def of(scene: Scene, sizing: Sizing) -> "LinearFinger":
        """Mesh and reduce the finger of `scene`, whose friction and loading do not matter here.

        Raises MeshError where the outline cannot be meshed.
        """
        return LinearFinger.on(scene, finger_mesh(scene.finger, scene.receptor, sizing))

    @staticmethod
    def on(scene: Scene, geometry: FingerMesh) -> "LinearFinger":
        """Do the same on a mesh of the finger that was made before."""
        begun = perf_counter()
        body = LinearBody.of(geometry.mesh, settled_moduli(scene.materials), checked=True)
        return LinearFinger(scene, geometry, Newton(body.condensed), body, perf_counter() - begun)

    @property
    def elements(self) -> Elastic:
        """The elements of its body."""
        return self.body.elastic

    @property
    def dofs(self) -> int:
        """Number of unknown displacements."""
        return self.body.dofs

    def patches(self, placed: Endings) -> LinearPatches:
        """Do as `Finger` says."""
        return LinearPatches(self.geometry.mesh, self.body.elastic, placed)

    def displacements(self, states: Sequence[EquilibriumState], only: Indices | None = None) -> Array:
        """Do as `Finger` says."""
        return self.body.displacement(np.stack([state.u for state in states], axis=2), only)

    def displacement(self, state: EquilibriumState) -> Array:
        """Do as `Finger` says."""
        return self.body.displacement(state.u)

    def following(self, skin: Array) -> Array:
        """Do as `Finger` says."""
        return self.body.displacement(skin.reshape(len(skin) // 2, 2, -1))

    def inner_forces(self, displacement: Array) -> Array:
        """Do as `Finger` says."""
        return self.body.reactions(displacement[:, :, None])[:, :, 0]

    def energy_growth(self, displacement: Array) -> float:
        """Do as `Finger` says."""
        return float(np.sum(self.inner_forces(displacement) * displacement))

    def smallest_det(self, displacement: Array) -> float:
        """Do as `Finger` says, of the corners of elements, where strains are largest."""
        return float(np.prod(self.stretches(displacement), axis=0).min())

    @cached_property
    def _corners(self) -> Array:
        """The gradients (e, 8, 9) of shape functions, along x and y at each corner: strains are largest at corners."""
        count = len(self.geometry.mesh.elements)
        element, local = np.repeat(np.arange(count), 4), np.tile(Q2P1.corners, (count, 1))
        gradient = Probes.at(self.geometry.mesh, self.body.elastic, element, local).gradient
        return np.ascontiguousarray(np.swapaxes(gradient, 1, 2).reshape(count, 8, 9))

    def stretches(self, displacement: Array) -> Array:
        """Return the smallest and largest in-plane stretch (2, p) at every corner of every element.

        They are the singular values of F = 1 + du/dX; a folded place has a negative smallest one.
        """
        local = displacement[self.geometry.mesh.elements]
        f = (self._corners @ (local - local[:, 8:])).reshape(-1, 2, 2) + np.eye(2)  # transposed, of the same stretches
        det = f[:, 0, 0] * f[:, 1, 1] - f[:, 0, 1] * f[:, 1, 0]
        total = np.sum(f * f, axis=(1, 2))
        plus, minus = np.sqrt(total + 2.0 * det), np.sqrt(np.maximum(total - 2.0 * det, 0.0))
        return np.stack([(plus - minus) / 2.0, (plus + minus) / 2.0])

    def reaches_out(self, state: EquilibriumState, displacement: Array, indentation: float) -> bool:
        """Return whether skin outside the part that may touch would, so that the part must be made larger."""
        whole = self.geometry.whole
        below = self.geometry.mesh.nodes[whole, 1] + displacement[whole, 1] < indentation * (1.0 - 1e-9)
        may = np.zeros(len(displacement), bool)
        may[self.geometry.mesh.skin] = True
        may = may[whole]
        ends = bool(state.touching[0] and may[0] == 0) or bool(state.touching[-1] and may[-1] == 0)
        return ends or bool((below & ~may).any())
