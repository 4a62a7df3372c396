"""The finger at finite strain on one mesh, ready for any surface."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.linalg import LinAlgError

from solver import _kernels as kernels
from solver._kernels import OPEN
from solver.arrays import Array
from solver.body.finite import FiniteBody, FiniteProbes
from solver.body.receptor import endings, middle
from solver.body.tissues import finite_laws
from solver.contact.edges import width
from solver.contact.skin_compression import SkinCompression
from solver.equilibrium.mesh_transfer import MeshTransfer, Places
from solver.equilibrium.newton import EquilibriumState, FiniteNewton
from solver.mesh.grid import MeshError
from solver.mesh.mesher import FingerMesh, Sizing, finger_mesh
from solver.prediction import ROW
from solver.scene import Scene, SceneError


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class FiniteFinger:
    """A finger on one mesh, ready for any surface."""

    scene: Scene  # whose finger it is; its friction and load may be those of another surface
    geometry: FingerMesh
    newton: FiniteNewton
    ending: FiniteProbes  # the reference ending alone

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
        at_touch = FiniteProbes.of(body, endings(geometry, body, scene.receptor, np.zeros(1)))
        newton = FiniteNewton(body, None if beside is None else beside.newton)
        return FiniteFinger(scene, geometry, newton, at_touch)

    @cached_property
    def point(self) -> FiniteProbes:
        """The middle of the reference ending."""
        body = self.newton.body
        return FiniteProbes.of(body, middle(self.geometry, body, self.scene.receptor))

    @cached_property
    def row(self) -> FiniteProbes:
        """The row of receptors."""
        body = self.newton.body
        return FiniteProbes.of(body, endings(self.geometry, body, self.scene.receptor, ROW))

    def sed_ending(self, shape: EquilibriumState) -> float:
        """Return the SED averaged over the reference ending [MPa]."""
        return float(self.ending.average(self.newton.body, shape.u)[0])

    def seds(self, shape: EquilibriumState) -> tuple[float, float]:
        """Return the SED averaged over the reference ending and that in its middle [MPa]."""
        return self.sed_ending(shape), float(self.point.average(self.newton.body, shape.u)[0])

    def numbers(self, shape: EquilibriumState) -> Array:
        """Return SED of the ending, normal and tangential force along +x (3,)."""
        along, up = shape.force
        return np.array([self.sed_ending(shape), up, along])

    def all_numbers(self, states: Sequence[EquilibriumState]) -> Array:
        """Return the numbers of each state (c, COUNT) whose errors are estimated, as `FingerModel` has them."""
        return np.array([self._all_numbers(state) for state in states])

    def _all_numbers(self, s: EquilibriumState) -> tuple[float, ...]:
        middle = self.point.average(self.newton.body, s.u)[0]
        rest = s.pull.depth, 0.0 - s.pull.travel, self.contact_width(s), middle
        return *self.numbers(s), *rest, *self.responses(s.u[:, :, None])[0]

    def responses_of(self, states: Sequence[EquilibriumState]) -> Array:
        """Return every quantity at the reference ending of several states (c, q)."""
        return np.concatenate([self.responses(state.u[:, :, None]) for state in states])

    def responses(self, displacement: Array) -> Array:
        """Return every quantity at the reference ending (c, q) for displacements (nodes, 2, c), even complex ones."""
        return self.ending.responses(self.newton.body, displacement)[:, 0].T

    def numbers_and_row(self, states: Sequence[EquilibriumState]) -> Array:
        """Return `all_numbers`, then the SED of each ending of the row (c, COUNT + r); nan where it ends."""
        row = [self.row.average(self.newton.body, state.u) for state in states]
        return np.hstack([self.all_numbers(states), row])

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

    def contact_width(self, shape: EquilibriumState) -> float:
        """Return how long the contact is along the surface [mm]."""
        return width(self.places.skin, shape.place(self.newton.body)[:, 0], shape.reaction[:, 1], shape.touching)
