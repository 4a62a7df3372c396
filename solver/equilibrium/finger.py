"""The finger as the solver sees it: meshed, reduced to its skin, with its endings placed. One serves many surfaces."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter

import numpy as np

from solver.arrays import Array
from solver.body.linear import LinearBody
from solver.body.receptor import Endings, endings, middle
from solver.body.stiffness import Probes
from solver.body.tissues import settled_moduli
from solver.contact.edges import arcs_of, width
from solver.element import Q2P1
from solver.equilibrium.newton import EquilibriumState, Newton
from solver.mesh import distinct
from solver.mesh.mesher import FingerMesh, Sizing, finger_mesh
from solver.prediction import ROW
from solver.scene import Receptor, Scene


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class FingerModel:
    """A finger on one mesh. Bone frame: the bone stays, the surface comes up by the indentation."""

    receptor: Receptor
    geometry: FingerMesh
    body: LinearBody
    ending: Endings  # the reference ending alone
    solve_s: float  # what assembling and reducing took, beside mesh and tables [s]

    @staticmethod
    def of(scene: Scene, sizing: Sizing) -> "FingerModel":
        """Mesh and reduce the finger of `scene`, whose friction and loading do not matter here.

        Raises MeshError where the outline cannot be meshed.
        """
        return FingerModel.on(scene, finger_mesh(scene.finger, scene.receptor, sizing))

    @staticmethod
    def on(scene: Scene, geometry: FingerMesh) -> "FingerModel":
        """Do the same on a mesh of the finger that was made before."""
        begun = perf_counter()
        body = LinearBody.of(geometry.mesh, settled_moduli(scene.materials), checked=True)
        took = perf_counter() - begun
        at_touch = endings(geometry, body.elastic, scene.receptor, np.zeros(1))
        return FingerModel(scene.receptor, geometry, body, at_touch, took)

    @cached_property
    def point(self) -> Endings:
        """The middle of the reference ending."""
        return middle(self.geometry, self.body.elastic, self.receptor)

    @cached_property
    def row(self) -> Endings:
        """The row of receptors."""
        return endings(self.geometry, self.body.elastic, self.receptor, ROW)

    @cached_property
    def _corners(self) -> Array:
        """The gradients (e, 8, 9) of shape functions, along x and y at each corner: strains are largest at corners."""
        count = len(self.geometry.mesh.elements)
        element, local = np.repeat(np.arange(count), 4), np.tile(Q2P1.corners, (count, 1))
        gradient = Probes.at(self.geometry.mesh, self.body.elastic, element, local).gradient
        return np.ascontiguousarray(np.swapaxes(gradient, 1, 2).reshape(count, 8, 9))

    @cached_property
    def newton(self) -> Newton:
        """The iterations on its body."""
        return Newton(self.body.condensed)

    def relaxed(self, state: EquilibriumState) -> EquilibriumState:
        """Return a state of tissues that relax with the displacements that its forces hold once they have."""
        skin = self.body.condensed
        free = np.flatnonzero(skin.stiffness.diagonal() > 0.0)  # what is held along the surface has none
        u = np.zeros(len(skin.load))
        u[free] = np.linalg.solve(skin.stiffness[np.ix_(free, free)], (skin.load + state.reaction.ravel())[free])
        return replace(state, u=u.reshape(-1, 2))

    def displacement(self, state: EquilibriumState) -> Array:
        """Return the displacement (nodes, 2) of all nodes relative to the bone [mm]."""
        return self.body.displacement(state.u)

    def sed_ending(self, displacement: Array) -> float:
        """Return the SED averaged over the reference ending [MPa] for displacements (nodes, 2)."""
        return float(self.ending.average(self.geometry.mesh, self.body.elastic, displacement[:, :, None])[0, 0])

    def seds(self, states: Sequence[EquilibriumState]) -> Array:
        """Return the SED of the reference ending and in its middle (c, 2) [MPa] of several states."""
        return self._averaged(states, self.ending, self.point)

    def numbers(self, states: Sequence[EquilibriumState]) -> Array:
        """Return SED of the ending, normal and tangential force along +x (c, 3) of several states."""
        forces = [(state.normal.sum(), state.tangential.sum()) for state in states]
        return np.column_stack([self._averaged(states, self.ending)[:, 0], forces])

    def all_numbers(self, states: Sequence[EquilibriumState]) -> Array:
        """Return the `COUNT` numbers of each state (c, COUNT) whose errors are estimated.

        They are the SED, both forces, depth, the bone's shift along +x, contact width, the middle's SED, and every
        quantity at the ending.
        """
        rest = [
            (s.normal.sum(), s.tangential.sum(), s.pull.depth, 0.0 - s.pull.travel, self.contact_width(s))
            for s in states
        ]
        mesh, elastic = self.geometry.mesh, self.body.elastic
        displacement = self._recovered(states, self.ending, self.point)
        middle = self.point.average(mesh, elastic, displacement)[0]
        responses = self.responses(displacement)
        return np.column_stack([responses[:, 0], rest, middle, responses])

    def responses_of(self, states: Sequence[EquilibriumState]) -> Array:
        """Return every quantity at the reference ending of several states (c, q)."""
        return self.responses(self._recovered(states, self.ending))

    def responses(self, displacement: Array) -> Array:
        """Return every quantity at the reference ending (c, q) for displacements (nodes, 2, c), even complex ones."""
        return self.ending.responses(self.geometry.mesh, self.body.elastic, displacement)[:, 0].T

    def numbers_and_row(self, states: Sequence[EquilibriumState]) -> Array:
        """Return `all_numbers`, then the SED of each ending of the row (c, COUNT + r); nan where it ends."""
        row = self.row.average(self.geometry.mesh, self.body.elastic, self._recovered(states, self.row))
        return np.hstack([self.all_numbers(states), row.T])

    def _averaged(self, states: Sequence[EquilibriumState], *patches: Endings) -> Array:
        """Return the SED averaged over the first ending of each of the patches (c, p) [MPa]."""
        mesh, elastic = self.geometry.mesh, self.body.elastic
        displacement = self._recovered(states, *patches)
        return np.stack([patch.average(mesh, elastic, displacement)[0] for patch in patches], axis=1)

    def _recovered(self, states: Sequence[EquilibriumState], *patches: Endings) -> Array:
        """Return the displacements (nodes, 2, c) of states, of the nodes that patches need alone."""
        nodes = distinct(np.concatenate([patch.nodes(self.geometry.mesh) for patch in patches]))
        return self.body.displacement(np.stack([state.u for state in states], axis=2), only=nodes)

    def sed_row(self, displacement: Array) -> Array:
        """Return the SED averaged over each ending of the row (r,) [MPa]; nan where the finger ends before it."""
        return self.row.average(self.geometry.mesh, self.body.elastic, displacement[:, :, None])[:, 0]

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

    def contact_width(self, state: EquilibriumState) -> float:
        """Return how long the contact is along the surface [mm]."""
        x = state.place(self.body.condensed)[:, 0]
        return width(arcs_of(self.geometry), x, state.normal, state.touching)

    def reaches_out(self, state: EquilibriumState, displacement: Array, indentation: float) -> bool:
        """Return whether skin outside the part that may touch would, so that the part must be made larger."""
        whole = self.geometry.whole
        below = self.geometry.mesh.nodes[whole, 1] + displacement[whole, 1] < indentation * (1.0 - 1e-9)
        may = np.zeros(len(displacement), bool)
        may[self.geometry.mesh.skin] = True
        may = may[whole]
        ends = bool(state.touching[0] and may[0] == 0) or bool(state.touching[-1] and may[-1] == 0)
        return ends or bool((below & ~may).any())
