"""A body at small strain, assembled and condensed to its skin by the compiled loops, and its receptor endings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Literal

import numpy as np
from numpy.linalg import LinAlgError

from solver._kernels import elements as element_loops
from solver._kernels.multifrontal import DEFINITE
from solver.arrays import Array, ElementSystem, Indices, determinant, inverse
from solver.body import CondensedLinear, MeshElements, Patches, Probes, held_directions, integrate_elements, validation
from solver.constitutive import Elasticity
from solver.linalg import CondensedLoad, Elimination, StaticCondensation, symbolic_factorization
from solver.mesh import GAUSS_4, Q2P1, Mesh, jacobians, line
from solver.quantities import QUANTITIES, SED


class Elastic(MeshElements):
    """Elements made of Hooke materials; displacements of their nodes are ordered x, y, x, y, ..."""

    @cached_property
    def stiffness(self) -> Array:
        """Element stiffnesses (e, 18, 18) of 2 G eps:eps + lambda theta^2 [N/mm per mm], theta in three volume modes.

        This is the mixed form with its three pressure modes lambda theta eliminated, which is exact for Hooke's law.
        """
        of = self.elements
        weight = of.weight[:, :, None] * of.shear[:, None, None]
        along, up = np.swapaxes(weight * of.grad_x, 1, 2), np.swapaxes(weight * of.grad_y, 1, 2)
        xy = along @ of.grad_y
        out = np.swapaxes(of.lame[:, None, None] * self.divergence, 1, 2) @ self.divergence
        laplace = of.shear[:, None, None] * of.laplace
        out[:, ::2, ::2] += laplace + along @ of.grad_x
        out[:, 1::2, 1::2] += laplace + up @ of.grad_y
        out[:, ::2, 1::2] += np.swapaxes(xy, 1, 2)
        out[:, 1::2, ::2] += xy
        return out

    def forces(self, local: Array) -> Array:
        """Return the internal forces (e, 9, 2) [N/mm] of the elements at displacements `local` (e, 9, 2).

        The translation of an element is subtracted, since it would drown small strains in round-off.
        """
        return (self.stiffness @ (local - local[:, 8:]).reshape(-1, 18, 1)).reshape(local.shape)

    def energy(self, probes: Probes, displacement: Array) -> Array:
        """Return the SED (p, ...) [MPa] for displacements (nodes, 2, ...)."""
        return SED.small(self.state(self.probe_data(probes), displacement))


class LinearElimination(StaticCondensation):
    """A body at small strain, assembled, and condensed to its skin."""

    def __init__(self, mesh: Mesh, materials: Sequence[Elasticity]) -> None:
        """Assemble `mesh` with `materials` by region, and eliminate all unknowns but the skin's.

        Raises MeshError where an element is folded, LinAlgError where the stiffness inside is not positive definite.
        """
        plan = symbolic_factorization(mesh)
        self.elastic = Elastic(*integrate_elements(mesh, materials, plan.unknown))
        count, inside = len(mesh.elements), Elimination(plan)
        system = ElementSystem(
            np.empty((count, 16, 16)), np.zeros(plan.size), np.zeros((count, 2, 17)), np.zeros((count, 3)),
            np.empty((count, 3, 18)), np.empty((count, 3)), np.zeros((0, 18)), np.zeros((0, 18, 18)),
        )  # fmt: skip
        element_loops.assemble(np.zeros(mesh.nodes.shape), np.zeros((count, 3)), True, self.elastic.elements, system)
        if inside.factorise(system.tangent) != DEFINITE:
            raise LinAlgError("the stiffness inside the body is not positive definite")
        super().__init__(mesh, inside, system)


Motion = Literal["x", "y", "turn"]
_POINTS, _WEIGHTS = GAUSS_4
_VALUES, _SLOPES = line(_POINTS)  # (q, 3)


@dataclass(frozen=True, eq=False)  # without slots, for cached properties
class LinearBody:
    """An elastic body whose skin may touch a flat rigid surface below it, along y = 0."""

    mesh: Mesh
    elastic: Elastic
    elimination: LinearElimination
    load: CondensedLoad  # its dead loads after forward elimination
    condensed: CondensedLinear
    prescribed: Array  # (nodes, 2) displacement of held nodes relative to the drive, 0 elsewhere [mm]

    @staticmethod
    def of(
        mesh: Mesh,
        materials: Sequence[Elasticity],
        loads: Array | None = None,
        prescribed: Array | None = None,
        free: Sequence[Motion] = (),
        *,
        checked: bool = False,
    ) -> "LinearBody":
        """Return the body of a `mesh` with `materials` by region under dead `loads` (nodes, 2) [N/mm].

        Held nodes move with the drive, and by `prescribed` (nodes, 2) [mm] relative to it. `free` names the rigid
        motions along which the surface alone balances the loads. Raises BodyError and MeshError, unless its input was
        `checked` before, and LinAlgError where a rigid motion is neither held nor free.
        """
        if not checked:
            validation.check_body(mesh, materials)
            validation.check_loads(mesh, loads, prescribed)
            validation.check_held(mesh, free)
        elimination = LinearElimination(mesh, materials)
        displacement = np.zeros(mesh.nodes.shape) if prescribed is None else np.array(prescribed, np.float64)
        force = np.zeros(mesh.nodes.shape) if loads is None else np.array(loads, np.float64)
        if prescribed is not None:
            force -= mesh.assemble(elimination.elastic.forces(mesh.local(displacement)))
        load = elimination.condense(force) if force.any() else elimination.no_load
        condensed = _condense_skin(mesh, elimination.stiffness, elimination.skin_load(load), free)
        if not checked and len(mesh.skin):
            _ = condensed.compliance  # raises where the body can move
        return LinearBody(mesh, elimination.elastic, elimination, load, condensed, displacement)

    def displacement(self, u: Array, only: Indices | None = None) -> Array:
        """Return the displacements (nodes, 2, ...) of all nodes for those of the skin `u` (k, 2, ...).

        With `only` (node numbers), other nodes may be left at 0.
        """
        skin = u.reshape(2 * len(self.mesh.skin), prod(u.shape[2:]))
        out = self.elimination.displacement(skin, self.load, only) + self.prescribed[:, :, None]
        return out.reshape(*self.mesh.nodes.shape, *u.shape[2:])

    @property
    def centre(self) -> Array:
        """Origins (e, 2) of the elements' pressure modes [mm]."""
        return self.elastic.centre

    def unit_displacements(self) -> Array:
        """Return the displacements (nodes, 2, 2 k) for a unit displacement of each of the skin's unknowns."""
        k = len(self.mesh.skin)
        return self.displacement(np.eye(2 * k).reshape(k, 2, 2 * k)) - self.displacement(np.zeros((k, 2, 1)))

    def linearise_about(self, displacement: Array) -> tuple[CondensedLinear, Callable[[Array], Array]]:
        """Return the body about a `displacement` (nodes, 2), and a function from skin steps (k, 2) to displacements.

        Its residual comes from the elements, so that a step from it removes the round-off of a state: one step of
        iterative refinement (Wilkinson 1963). For held bodies without dead loads.
        """
        inner = self.forces(displacement)
        inner[self.mesh.driven] = 0.0
        about, recover = self.with_loads(-inner)
        about.rest = self.mesh.nodes[self.mesh.skin] + displacement[self.mesh.skin]
        return about, lambda step: displacement + recover(step)

    def tangent(self, u: Array, pressure: Array) -> StaticCondensation:  # noqa: ARG002 - one for all states
        """Return the condensed stiffness."""
        return self.elimination

    def with_loads(self, loads: Array) -> tuple[CondensedLinear, Callable[[Array], Array]]:
        """Return the body under other dead `loads` (nodes, 2), and a function that recovers displacements.

        It maps those of the skin (k, 2) to those of all nodes (nodes, 2) [mm]; held nodes stay.
        """
        load = self.elimination.condense(loads)

        def recover(u: Array) -> Array:
            return self.elimination.displacement(u.reshape(-1, 1), load)[:, :, 0]

        return self.condensed.with_load(self.elimination.skin_load(load)), recover

    def recover_increments(self, skin: Array) -> Array:
        """Return the increments (nodes, 2, c) of all nodes by back substitution of the skin's (2 k, c)."""
        return self.displacement(skin.reshape(-1, 2, skin.shape[1]))

    def forces(self, displacement: Array) -> Array:
        """Return the internal forces (nodes, 2) at `displacement` (nodes, 2) [N/mm]."""
        return self.mesh.assemble(self.elastic.forces(self.mesh.local(displacement)))

    def internal_work(self, displacement: Array) -> float:
        """Return the work of the internal forces on `displacement` (nodes, 2), twice the stored energy [N]."""
        local = self.mesh.about_centre(displacement)
        return float(np.sum(local * self.elastic.forces(local)))

    def smallest_det(self, displacement: Array) -> float:
        """Return the smallest det F [-] at the corners of elements, where strains are largest."""
        return float(determinant(self._at_corners(displacement)).min())

    def stretches(self, displacement: Array) -> Array:
        """Return the smallest and largest in-plane stretch (2, p) at every corner of every element.

        They are the singular values of F = 1 + du/dX; the smallest is negative where det F is.
        """
        f = self._at_corners(displacement)
        det = determinant(f)
        total = np.sum(f * f, axis=(1, 2))
        plus, minus = np.sqrt(total + 2.0 * det), np.sqrt(np.maximum(total - 2.0 * det, 0.0))
        return np.stack([(plus - minus) / 2.0, (plus + minus) / 2.0])

    def _at_corners(self, displacement: Array) -> Array:
        """Return F transposed (p, 2, 2) at every corner of every element."""
        return (self._corners @ self.mesh.about_centre(displacement)).reshape(-1, 2, 2) + np.eye(2)

    @cached_property
    def _corners(self) -> Array:
        """The gradients (e, 8, 9) of shape functions, along x and y at each corner of each element."""
        slopes = Q2P1.shape(Q2P1.corners)[1]  # (4, 9, 2)
        gradient = slopes @ inverse(jacobians(self.mesh, Q2P1.corners)[0])
        return np.ascontiguousarray(np.swapaxes(gradient, 2, 3).reshape(-1, 8, 9))


class LinearPatches(Patches):
    """Averages over the endings of a body at small strain."""

    quantities = tuple(quantity.small for quantity in QUANTITIES)

    def average(self, displacement: Array) -> Array:
        """Return the SED averaged over each ending (r, ...) [MPa], from quadratic forms of the displacements."""
        element, patch, form = self._energy_forms
        local = self.elements.mesh.about_centre(displacement, element).reshape(len(element), 18, -1)
        energy = np.einsum("mic,mic->mc", local, form @ local)
        total, first = np.zeros((self.endings.count, energy.shape[1])), np.flatnonzero(np.diff(patch, prepend=-1))
        total[patch[first]] = np.add.reduceat(energy, first)
        return (total / self.endings.areas[:, None]).reshape(-1, *displacement.shape[2:])

    def gradient(self, displacement: Array) -> Array:
        """Return the gradient (nodes, 2) of the first ending's SED at `displacement` (nodes, 2) [MPa/mm]."""
        element, patch, form = self._energy_forms
        mesh, first = self.elements.mesh, patch == 0
        local = mesh.about_centre(displacement, element[first]).reshape(-1, 18, 1)
        every = np.zeros((len(mesh.elements), 18))
        every[element[first]] = 2.0 / self.endings.areas[0] * (form[first] @ local)[:, :, 0]
        return mesh.assemble(every)

    @cached_property
    def _energy_forms(self) -> tuple[Indices, Indices, Array]:
        """The pieces of endings within one element (m,): element, ending, and energy as a quadratic form (m, 18, 18).

        Each form takes the displacements of the element's nodes [N/mm per mm2].
        """
        probes, patch = self.endings.probes, self.endings.patch
        order = np.lexsort((probes.element, patch))
        element, patch = probes.element[order], patch[order]
        starts = (np.diff(element, prepend=-1) != 0) | (np.diff(patch, prepend=-1) != 0)
        part, first = np.cumsum(starts) - 1, np.flatnonzero(starts)
        place = np.arange(len(part)) - first[part]
        roots = np.zeros((len(first), int(place.max(initial=0)) + 1, 21))  # d/dx, d/dy of shape functions; 1, x, y
        sizes = np.sqrt(self.endings.weights[order])[:, None]
        roots[part, place, :18] = probes.gradient.reshape(-1, 18)[order] * sizes
        roots[part, place, 18:] = probes.modes[order] * sizes
        sums = np.swapaxes(roots, 1, 2) @ roots
        xx, yx, yy, element = sums[:, :9, :9], sums[:, 9:18, :9], sums[:, 9:18, 9:18], element[first]
        form = np.empty((len(first), 9, 2, 9, 2))  # of eps:eps
        form[:, :, 0, :, 0], form[:, :, 0, :, 1] = xx + yy / 2.0, yx / 2.0
        form[:, :, 1, :, 0], form[:, :, 1, :, 1] = np.swapaxes(yx, 1, 2) / 2.0, yy + xx / 2.0
        theta = np.swapaxes(self.elements.combination[element], 1, 2) @ self.elements.divergence[element]  # on 1, x, y
        volume = np.swapaxes(theta, 1, 2) @ sums[:, 18:, 18:] @ theta
        moduli = self.elements.elements
        shear, lame = moduli.shear[element, None, None], moduli.lame[element, None, None]
        # W = G eps:eps + lambda/2 theta^2
        return element, patch[first], shear * form.reshape(-1, 18, 18) + lame / 2.0 * volume


def _condense_skin(mesh: Mesh, stiffness: Array, load: Array, free: Sequence[Motion]) -> CondensedLinear:
    """Return the condensed body with a `stiffness` (2 k, 2 k) and dead `load` (2 k,) of its skin."""
    place = mesh.nodes[mesh.skin]
    motions = validation.rigid_motions(place)
    rigid = motions @ validation.unprevented_motions(mesh)
    skin = CondensedLinear(place, stiffness, load, skin_lengths(mesh), held_directions(mesh))
    skin.springs = np.linalg.qr(rigid)[0] if rigid.shape[1] else rigid
    skin.motions = motions[:, [validation.MOTIONS.index(name) for name in free]]
    return skin


def skin_lengths(mesh: Mesh) -> Array:
    """Return the tributary length (k,) [mm] of the skin's nodes: 1/6, 4/6, 1/6 of a straight edge."""
    return edge_load(mesh, mesh.skin, np.ones((len(mesh.skin), 1)))[mesh.skin, 0]


def edge_load(mesh: Mesh, chain: Indices, traction: Array) -> Array:
    """Return the nodal forces (nodes, c) of a traction (2 k + 1, c) [MPa] along a chain of edges (2 k + 1,).

    Raises BodyError unless the chain has whole edges and each node has one traction.
    """
    if len(chain) != len(traction) or (len(chain) and (len(chain) < 3 or len(chain) % 2 == 0)):
        raise validation.BodyError(
            f"the chain has {len(chain)} nodes and {len(traction)} tractions; name whole edges, from end by middle to "
            "end, and so on, and give a traction for each node"
        )
    out = np.zeros((len(mesh.nodes), traction.shape[1]))
    edges = np.arange(0, len(chain) - 2, 2)[:, None] + np.arange(3)
    tangent = _SLOPES @ mesh.nodes[chain[edges]]  # (e, q, 2)
    length = _WEIGHTS * np.hypot(tangent[..., 0], tangent[..., 1])
    local = _VALUES.T @ (length[:, :, None] * (_VALUES @ traction[edges]))
    np.add.at(out, chain[edges], local)
    return out
