"""The finger as the solver sees it: a mesh, Newton's iterations on its body, its endings. One serves many surfaces."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from solver.arrays import Array, Indices
from solver.body.receptor import Endings, Patches, endings, middle
from solver.body.stiffness import Centred
from solver.contact.edges import arcs_of, width
from solver.equilibrium.newton import EquilibriumState, Newton
from solver.mesh.mesh import distinct
from solver.mesh.mesher import FingerMesh
from solver.prediction import ROW
from solver.scene.scene import Scene

Placed = TypeVar("Placed", bound=Patches, covariant=True)  # endings as a kind of body feels them


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class Finger(ABC, Generic[Placed]):
    """A finger on one mesh. Bone frame: the bone stays, the surface comes up by the indentation."""

    scene: Scene  # whose finger it is; its friction and load may be those of another surface
    geometry: FingerMesh
    newton: Newton

    @property
    @abstractmethod
    def elements(self) -> Centred:
        """The elements of its body."""

    @property
    @abstractmethod
    def dofs(self) -> int:
        """Number of unknown displacements."""

    @abstractmethod
    def patches(self, placed: Endings) -> Placed:
        """Return endings that were `placed` on its mesh, as its body feels them."""

    @abstractmethod
    def displacements(self, states: Sequence[EquilibriumState], only: Indices | None = None) -> Array:
        """Return the displacements (nodes, 2, c) of all nodes relative to the bone [mm] in c states.

        With `only` (node numbers), other nodes may be left at 0.
        """

    @abstractmethod
    def displacement(self, state: EquilibriumState) -> Array:
        """Return the displacement (nodes, 2) of all nodes relative to the bone [mm]."""

    @abstractmethod
    def following(self, skin: Array) -> Array:
        """Return the small displacements (nodes, 2, c) that go with those of the skin (2 k, c), by the last tangent."""

    @abstractmethod
    def inner_forces(self, displacement: Array) -> Array:
        """Return the forces (nodes, 2) that hold all nodes at `displacement` (nodes, 2) [N/mm]."""

    @abstractmethod
    def energy_growth(self, displacement: Array) -> float:
        """Return by how much the stored energy grows as `displacement` (nodes, 2) grows by a part of itself [N]."""

    @abstractmethod
    def smallest_det(self, displacement: Array) -> float:
        """Return the least det F [-] at `displacement` (nodes, 2); not positive where tissue is inside out."""

    @cached_property
    def ending(self) -> Placed:
        """The reference ending alone."""
        return self.patches(endings(self.geometry, self.elements, self.scene.receptor, np.zeros(1)))

    @cached_property
    def point(self) -> Placed:
        """The middle of the reference ending."""
        return self.patches(middle(self.geometry, self.elements, self.scene.receptor))

    @cached_property
    def row(self) -> Placed:
        """The row of receptors."""
        return self.patches(endings(self.geometry, self.elements, self.scene.receptor, ROW))

    def sed_ending(self, displacement: Array) -> float:
        """Return the SED averaged over the reference ending [MPa] for displacements (nodes, 2)."""
        return float(self.ending.average(displacement)[0])

    def seds(self, states: Sequence[EquilibriumState]) -> Array:
        """Return the SED of the reference ending and in its middle (c, 2) [MPa] of several states."""
        displacement = self._recovered(states, self.ending, self.point)
        return np.stack([patch.average(displacement)[0] for patch in (self.ending, self.point)], axis=1)

    def numbers(self, states: Sequence[EquilibriumState]) -> Array:
        """Return SED of the ending, normal and tangential force along +x (c, 3) of several states."""
        sed = self.ending.average(self._recovered(states, self.ending))[0]
        return np.column_stack([sed, [state.force[::-1] for state in states]])

    def all_numbers(self, states: Sequence[EquilibriumState]) -> Array:
        """Return the `COUNT` numbers of each state (c, COUNT) whose errors are estimated.

        They are the SED, both forces, depth, the bone's shift along +x, contact width, the middle's SED, and every
        quantity at the ending.
        """
        displacement = self._recovered(states, self.ending, self.point)
        responses = self.ending.responses(displacement)[:, 0].T
        rest = [(*s.force[::-1], s.load.depth, 0.0 - s.load.travel, self.contact_width(s)) for s in states]
        return np.column_stack([responses[:, 0], rest, self.point.average(displacement)[0], responses])

    def numbers_and_row(self, states: Sequence[EquilibriumState]) -> Array:
        """Return `all_numbers`, then the SED of each ending of the row (c, COUNT + r); nan where it ends."""
        return np.hstack([self.all_numbers(states), self.row.average(self._recovered(states, self.row)).T])

    def responses(self, states: Sequence[EquilibriumState]) -> Array:
        """Return every quantity at the reference ending of several states (c, q)."""
        return self.ending.responses(self._recovered(states, self.ending))[:, 0].T

    def _recovered(self, states: Sequence[EquilibriumState], *patches: Patches) -> Array:
        """Return the displacements (nodes, 2, c) of states, of the nodes that patches need alone."""
        return self.displacements(states, distinct(np.concatenate([patch.nodes() for patch in patches])))

    def contact_width(self, state: EquilibriumState) -> float:
        """Return how long the contact is along the surface [mm]."""
        x = state.place(self.newton.condensed)[:, 0]
        return width(self.arcs, x, state.normal, state.touching)

    @cached_property
    def arcs(self) -> Array:
        """Arc positions (k,) of the nodes that may touch [mm]."""
        return arcs_of(self.geometry)
