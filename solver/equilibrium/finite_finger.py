"""The finger at finite strain on one mesh."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.linalg import LinAlgError

from solver import _kernels as kernels
from solver._kernels import OPEN
from solver.arrays import Array, Indices
from solver.body.finite import FiniteBody, FinitePatches, deformation, element_forces, energy_slope
from solver.body.receptor import Endings
from solver.body.tissues import finite_laws
from solver.contact.skin_compression import SkinCompression
from solver.equilibrium.finger import Finger
from solver.equilibrium.mesh_transfer import MeshTransfer, Places
from solver.equilibrium.newton import EquilibriumState, FiniteNewton
from solver.mesh.mesh import MeshError
from solver.mesh.mesher import FingerMesh, Sizing, finger_mesh
from solver.scene.scene import Scene, SceneError


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class FiniteFinger(Finger[FinitePatches]):
    """A finger at finite strain on one mesh."""

    newton: FiniteNewton

    @staticmethod
    def of(scene: Scene, sizing: Sizing, beside: "FiniteFinger | None" = None) -> "FiniteFinger":
        """Mesh the finger of `scene`; `beside` is one whose memory it may share, since both are never used at once.

        Raises SceneError where its outline cannot be meshed.
        """
        try:
            return FiniteFinger.on(scene, finger_mesh(scene.finger, scene.receptor, sizing), beside)
        except (MeshError, LinAlgError) as bad:
            raise SceneError("finger.tip_radius", scene.finger.tip_radius, f"no mesh fits this finger ({bad})") from bad

    @staticmethod
    def on(scene: Scene, geometry: FingerMesh, beside: "FiniteFinger | None" = None) -> "FiniteFinger":
        """Do the same on a mesh of the finger that was made before."""
        body = FiniteBody.of(geometry.mesh, finite_laws(scene.materials), checked=True)
        return FiniteFinger(scene, geometry, FiniteNewton(body, None if beside is None else beside.newton))

    @property
    def body(self) -> FiniteBody:
        """Its body."""
        return self.newton.body

    @property
    def elements(self) -> FiniteBody:
        """The elements of its body."""
        return self.newton.body

    @property
    def dofs(self) -> int:
        """Number of unknown displacements."""
        return self.body.dofs

    def patches(self, placed: Endings) -> FinitePatches:
        """Do as `Finger` says."""
        return FinitePatches.of(self.newton.body, placed)

    def displacements(self, states: Sequence[EquilibriumState], only: Indices | None = None) -> Array:  # noqa: ARG002
        """Do as `Finger` says; all nodes are there anyway."""
        return np.stack([state.u for state in states], axis=2)

    def displacement(self, state: EquilibriumState) -> Array:
        """Do as `Finger` says."""
        return state.u

    def following(self, skin: Array) -> Array:
        """Do as `Finger` says, the centres of elements with their other nodes."""
        body, inside = self.body, self.newton.finite.inside
        unknowns = np.stack([inside.back_substitute(one, still=True) for one in skin.T.copy()], axis=1)
        out = np.zeros((*body.mesh.nodes.shape, unknowns.shape[1]))
        outer = np.where((body.unknown >= 0)[..., None], unknowns[body.unknown], 0.0)  # (e, 8, 2, c)
        out[body.nodes[:, :8]] = outer
        recovery = self.newton.finite.system.recovery_matrix[:, :, :16]
        out[body.nodes[:, 8]] = -recovery @ outer.reshape(len(outer), 16, -1)
        return out

    def inner_forces(self, displacement: Array) -> Array:
        """Do as `Finger` says."""
        return self.body.nodal(element_forces(self.body, displacement))

    def energy_growth(self, displacement: Array) -> float:
        """Do as `Finger` says, from the energy alone."""
        return energy_slope(self.body, displacement, displacement)

    def smallest_det(self, displacement: Array) -> float:
        """Do as `Finger` says, of the quadrature points."""
        return float(np.linalg.det(deformation(self.body, displacement)).min())

    def transfer(self, shape: EquilibriumState, other: "FiniteFinger") -> EquilibriumState:
        """Return `shape`, found on `other`, as a start on this mesh."""
        return self.bridge(other).carried(shape)

    def bridge(self, other: "FiniteFinger") -> MeshTransfer:
        """Return the way here from the mesh of `other`, made when first asked for."""
        if other not in self._bridges:
            self._bridges[other] = MeshTransfer.of(other.places, self.places)
        return self._bridges[other]

    @cached_property
    def _bridges(self) -> "WeakKeyDictionary[FiniteFinger, MeshTransfer]":
        return WeakKeyDictionary()

    @cached_property
    def places(self) -> Places:
        """Where nodes and quadrature points lie, for states that are carried."""
        return Places.of(self.geometry, self.newton.body)

    def runs_out(self, shape: EquilibriumState) -> bool:
        """Return whether contact reaches an end of the skin that is looked at."""
        return bool(shape.state[0] != OPEN or shape.state[-1] != OPEN)

    def skin_compression(self, shape: EquilibriumState) -> SkinCompression:
        """Return how far the skin is squeezed, and whether it has a crease."""
        geometry, first = self.geometry, self._first
        return SkinCompression(
            *kernels.pinched(geometry.mesh.nodes, shape.u, geometry.whole, geometry.loose, shape.state, first)
        )

    @cached_property
    def _first(self) -> int:
        """The first node of the whole skin that may touch."""
        return int(np.searchsorted(self.geometry.whole, self.geometry.mesh.skin)[0])

    def crosses(self, shape: EquilibriumState) -> bool:
        """Return whether the skin crosses itself."""
        return kernels.crosses(self.geometry.mesh.nodes, shape.u, self.geometry.whole)
