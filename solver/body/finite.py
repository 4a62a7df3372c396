"""A body at finite strain: its elements, its tangent condensed to the skin, and probes of its energy."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import cast

import numpy as np

from solver._kernels import elements as element_loops
from solver._kernels.compiling import HELD_X, HELD_Y, bind_arguments
from solver.arrays import (
    Array,
    BodyState,
    ElementArrays,
    ElementSystem,
    Indices,
    Narrow,
    ProbeArrays,
    SymbolicFactorization,
    inverse,
)
from solver.body import Endings, Probes
from solver.body.validation import check_body, check_driven, check_laws
from solver.constitutive import Law, log1p, shape, slopes
from solver.linalg import Elimination, symbolic_factorization
from solver.mesh import Q2P1, Mesh, distinct, jacobians
from solver.quantities import QUANTITIES, LocalState
from solver.tolerances import IMAGINARY

VALUES, _SLOPES = Q2P1.shape(Q2P1.points)  # (9 points, 9 nodes), (9, 9, 2)


@dataclass(frozen=True, eq=False)  # without slots: memory for its tangent is set aside when first asked for
class FiniteBody:
    """Elements, their unknowns and the skin that may touch; e elements, n unknowns, k nodes of skin.

    The centre node of an element meets no other and is eliminated inside it; held nodes are fixed. What is left is
    numbered in the order of its elimination, the skin last.
    """

    mesh: Mesh
    elements: ElementArrays  # as loops take them; modes are orthonormal over the element
    centre: Array  # (e, 2) the modes are combinations of 1, x - centre, y - centre
    combination: Array  # (e, 3, 3) mode m = sum over l of combination[m, l] (1, x - centre, y - centre)[l]
    plan: SymbolicFactorization  # of the elimination
    held: Narrow  # (k,) whether a node of the skin is held: along x HELD_X, along y HELD_Y, both their sum
    middle: Narrow  # (k,) 1 at the middle of an edge of the skin, 0 at its ends

    @staticmethod
    def of(mesh: Mesh, laws: Sequence[Law], *, checked: bool = False) -> "FiniteBody":
        """Prepare `mesh`, whose regions are made of `laws`. The centre of an element is never held.

        Raises BodyError and MeshError, unless it was `checked` before.
        """
        if not checked:
            check_body(mesh, laws)
            check_laws(laws)
            check_driven(mesh)
        jacobian, det = jacobians(mesh, Q2P1.points)  # (e, q, 2, 2), (e, q)
        gradient, weight = _SLOPES @ inverse(jacobian), det * Q2P1.weights  # (e, q, 9, 2), (e, q)
        place = VALUES @ mesh.nodes[mesh.elements]
        centre = place.mean(axis=1)
        raw = np.concatenate([np.ones((*place.shape[:2], 1)), place - centre[:, None]], axis=2)
        mass = np.swapaxes(raw * weight[:, :, None], 1, 2) @ raw
        combination = np.asarray(np.linalg.inv(np.linalg.cholesky(mass)), np.float64)
        modes = raw @ np.swapaxes(combination, 1, 2)

        shear = np.array([law.shear for law in laws])[mesh.region]
        grad_x, grad_y = np.ascontiguousarray(gradient[..., 0]), np.ascontiguousarray(gradient[..., 1])
        stiff = (weight * shear[:, None])[:, :, None]
        laplace = np.swapaxes(stiff * grad_x, 1, 2) @ grad_x + np.swapaxes(stiff * grad_y, 1, 2) @ grad_y
        plan = symbolic_factorization(mesh)
        elements = ElementArrays(
            grad_x, grad_y, weight, np.ascontiguousarray(modes), laplace, shear,
            np.array([law.stiffening for law in laws])[mesh.region], np.array([law.lame for law in laws])[mesh.region],
            mesh.elements.astype(np.int32), plan.unknown.reshape(-1, 8, 2),
        )  # fmt: skip
        held = (mesh.driven[mesh.skin] @ np.array([HELD_X, HELD_Y])).astype(np.int32)
        return FiniteBody(
            mesh, elements, centre, combination, plan, held, (np.arange(len(mesh.skin)) % 2).astype(np.int32)
        )

    @property
    def condensed(self) -> "CondensedFinite":
        """Its tangent condensed to the skin."""
        return self._condensed

    @cached_property
    def _condensed(self) -> "CondensedFinite":
        return CondensedFinite(self)

    @property
    def size(self) -> int:
        """Number of unknowns after the centres are eliminated."""
        return self.plan.size

    @property
    def dofs(self) -> int:
        """Number of unknown displacements, centres included."""
        return self.plan.size + 2 * len(self.elements.nodes)

    def displacement(self, u: Array, only: Indices | None = None) -> Array:  # noqa: ARG002 - all nodes are there anyway
        """Do as `Body` says."""
        return u

    def following(self, skin: Array) -> Array:
        """Do as `Body` says, by the last tangent, the centres of elements with their other nodes."""
        inside = self.condensed.inside
        unknowns = np.stack([inside.back_substitute(one, still=True) for one in skin.T.copy()], axis=1)
        out = np.zeros((*self.mesh.nodes.shape, unknowns.shape[1]))
        outer = np.where((self.elements.unknown >= 0)[..., None], unknowns[self.elements.unknown], 0.0)  # (e, 8, 2, c)
        out[self.elements.nodes[:, :8]] = outer
        recovery = self.condensed.system.recovery_matrix[:, :, :16]
        out[self.elements.nodes[:, 8]] = -recovery @ outer.reshape(len(outer), 16, -1)
        return out

    def deformation(self, u: Array) -> Array:
        """Return F (e, 9, 2, 2) at the quadrature points for displacements `u` (nodes, 2)."""
        return np.eye(2) + self._gradient(u)

    def smallest_det(self, displacement: Array) -> float:
        """Do as `Body` says, of the quadrature points."""
        return float(np.linalg.det(self.deformation(displacement)).min())

    def pressure(self, u: Array) -> Array:
        """Return the modes (e, 3) of the pressure lambda ln J at `u`."""
        return self.elements.lame[:, None] * self._logarithm(self._gradient(u))[1]

    def energy(self, u: Array) -> float:
        """Return the energy stored in the body [N mm per mm]."""
        return self._stored(self._gradient(u)).real

    def energy_slope(self, u: Array, way: Array) -> float:
        """Return by how much the stored energy grows at `u` along `way` (nodes, 2) [N mm per mm].

        From the energy alone, by a step in imaginary direction (Squire and Trapp 1998, SIAM Rev. 40, 110), no stress
        asked.
        """
        H = self._gradient(u) + 1j * IMAGINARY * self._gradient(way)
        return self._stored(cast("Array", H)).imag / IMAGINARY

    def energy_growth(self, displacement: Array) -> float:
        """Do as `Body` says, from the energy alone."""
        return self.energy_slope(displacement, displacement)

    def forces(self, displacement: Array) -> Array:
        """Do as `Body` says."""
        H = self._gradient(displacement)
        log, volume = self._logarithm(H)
        inverse, exceeds = _turned(H)
        G = self.elements.shear[:, None] * slopes(self.elements.stiffening[:, None], _excess(H, log))[0]
        pressure = self.elements.lame[:, None] * (self.elements.modes @ volume[:, :, None])[:, :, 0]
        stress = self.elements.weight[:, :, None, None] * (
            G[:, :, None, None] * exceeds + pressure[:, :, None, None] * inverse
        )
        gradient = np.stack([self.elements.grad_x, self.elements.grad_y], axis=-1).reshape(len(H), 9, 9, 2)
        return self.mesh.assemble((gradient @ np.swapaxes(stress, -1, -2)).sum(axis=1))

    def _gradient(self, u: Array) -> Array:
        """Return F - 1 (e, 9, 2, 2) to its own digits, which stiff tissue multiplies."""
        local = u[self.elements.nodes]  # (e, 9, 2)
        return np.stack([self.elements.grad_x @ local, self.elements.grad_y @ local], axis=-1)

    def _logarithm(self, H: Array) -> tuple[Array, Array]:
        """Return ln J (e, 9) and its modes (e, 3) for F = 1 + H."""
        log = log1p(H[..., 0, 0] + H[..., 1, 1] + (H[..., 0, 0] * H[..., 1, 1] - H[..., 0, 1] * H[..., 1, 0]))
        return log, np.einsum("eq,eqm,eq->em", self.elements.weight, self.elements.modes, log)

    def _stored(self, H: Array) -> complex:
        log, volume = self._logarithm(H)
        grown = shape(self.elements.stiffening[:, None], _excess(H, log))
        shear = np.sum(self.elements.weight * self.elements.shear[:, None] / 2.0 * grown)
        return complex(shear + np.sum(self.elements.lame / 2.0 * (volume**2).T))


def _turned(H: Array) -> tuple[Array, Array]:
    """Return the transposed inverse of F = 1 + H and what F exceeds it by (e, 9, 2, 2), that to its own digits."""
    grown = (H[..., 0, 0] + H[..., 1, 1] + np.linalg.det(H))[..., None, None]
    across = np.stack([H[..., 1, 1], -H[..., 1, 0], -H[..., 0, 1], H[..., 0, 0]], axis=-1).reshape(H.shape)
    F = np.eye(2) + H
    return (np.eye(2) + across) / (1.0 + grown), (H - across + grown * F) / (1.0 + grown)


def _excess(H: Array, log: Array) -> Array:
    return 2.0 * (np.trace(H, axis1=-2, axis2=-1) - log) + np.sum(H * H, axis=(-2, -1))


class CondensedFinite:
    """A body at finite strain with the memory for its tangent."""

    equilibrium: Array | None  # displacements of the equilibrium that the tangent led to

    def __init__(self, body: FiniteBody) -> None:
        """Set memory aside for `body`."""
        count = len(body.elements.nodes)
        self.body, self.constant = body, False
        self.load = np.zeros(body.size)  # dead loads on the body, of `finite_states.loaded`
        self.all_forces = np.zeros(body.size)  # of all unknowns, less the dead loads
        self.inside = Elimination(body.plan)
        self.system = ElementSystem(
            np.zeros((count, 16, 16)), self.all_forces, np.zeros((count, 2, 17)), np.zeros((count, 3)),
            np.zeros((count, 3, 18)), np.zeros((count, 3)),
        )  # fmt: skip
        self.stiffness, self.force = self.inside.stiffness, self.inside.skin_force
        self.compliance, self.motions = np.zeros((0, 0)), np.zeros((0, 0))
        self.bulk = float((body.elements.lame / body.elements.shear).max())
        self.held, self.middle, self.fixed_length = body.held, body.middle, np.zeros(len(body.mesh.skin))
        elements = body.elements
        self._assemble = bind_arguments(element_loops.assemble, elements, self.system)
        self._forces = bind_arguments(element_loops.forces, elements, self.system)
        self._advance = bind_arguments(element_loops.advance, elements, self.system)
        self.equilibrium = None

    def undeformed(self) -> tuple[Array, Array]:
        """Return displacements (nodes, 2) and pressures (e, 3) of the body at rest."""
        return np.zeros(self.body.mesh.nodes.shape), np.zeros((len(self.body.elements.nodes), 3))

    def place(self, u: Array) -> Array:
        """Return where the skin's nodes are (k, 2) for displacements `u` (nodes, 2) [mm]."""
        skin = self.body.mesh.skin
        return self.body.mesh.nodes[skin] + u[skin]

    def linearise(self, u: Array, pressure: Array) -> bool:
        """Assemble and eliminate the tangent at a state; False where it is turned inside out or has no factors."""
        self.equilibrium = None
        if not self.assemble(u, pressure) > 0.0 or not self.inside.factorise(self.system.tangent):
            return False
        self._condense()
        return True

    def relinearise(self, u: Array) -> bool:
        """Condense the forces at a state with the factors that are there; False where it is turned inside out."""
        if not self.resist(u) > 0.0:
            return False
        self._condense()
        return True

    def _condense(self) -> None:
        self.all_forces -= self.load
        self.inside.condense(self.all_forces)

    def assemble(self, u: Array, pressure: Array) -> float:
        """Fill tangents and forces at a state and return the least det F."""
        return self._assemble(u, pressure)

    def resist(self, u: Array) -> float:
        """Fill the forces at a state for the tangent that is there and return the least det F."""
        return self._forces(u)

    def recover(self, u: Array, pressure: Array, step: Array, scale: float) -> tuple[Array, Array, float]:
        """Return a state after `scale` times the skin's `step` (2 k,), and the largest move of the full step [mm]."""
        after = BodyState(np.empty_like(u), np.empty_like(pressure))
        largest = self._advance(BodyState(u, pressure), self.inside.back_substitute(step), scale, after)
        return after.u, after.pressure, largest

    def stored(self, u: Array, reaction: Array) -> float:  # noqa: ARG002 - as every body is asked
        """Return the energy stored in the body at `u` (nodes, 2) [N mm per mm]."""
        return self.body.energy(u)

    def work(self, way: Sequence[Array], trapezoid: float) -> float:
        """Do as `CondensedBody` says, by Simpson's rule.

        The forces halfway are those of the elements at the mean displacement.
        """
        halfway = (self.body.energy_slope((one + other) / 2.0, other - one) for one, other in pairwise(way))
        return (trapezoid + 2.0 * sum(halfway)) / 3.0


@dataclass(frozen=True, slots=True, eq=False)
class FinitePatches:
    """Endings of a body at finite strain: p places inside elements, averaged with weights over r patches."""

    body: FiniteBody
    places: ProbeArrays  # of its elements, as loops take them
    endings: Endings  # the same probes, element by element

    @staticmethod
    def of(body: FiniteBody, endings: Endings) -> "FinitePatches":
        """Carry the probes of `endings` over to `body`, element by element."""
        order, at = np.argsort(endings.probes.element, kind="stable"), endings.probes
        at = Probes(at.element[order], at.gradient[order], at.modes[order])
        places = ProbeArrays(
            at.element.astype(np.int32), np.ascontiguousarray(at.gradient[..., 0]),
            np.ascontiguousarray(at.gradient[..., 1]), (body.combination[at.element] @ at.modes[:, :, None])[:, :, 0],
        )  # fmt: skip
        weights, patch = endings.weights[order], endings.patch[order]
        return FinitePatches(body, places, Endings(at, weights, patch, endings.count, endings.tangent[order]))

    def nodes(self) -> Indices:
        """Do as `Patches` says."""
        return distinct(self.body.mesh.elements[distinct(self.places.element)])

    def energy(self, displacement: Array) -> Array:
        """Return the SED (p, ...) [MPa] for displacements (nodes, 2, ...), ln J being each element's best fit of it."""
        if displacement.ndim > 2:
            every = [self.energy(np.ascontiguousarray(one)) for one in np.moveaxis(displacement, -1, 0)]
            return np.stack(every, axis=-1)
        out = np.empty(len(self.places.element))
        element_loops.energies(displacement, self.body.elements, self.places, out)
        return out

    def deformation(self, displacement: Array) -> Array:
        """Return F (p, 2, 2) for displacements (nodes, 2)."""
        local = displacement[self.body.elements.nodes[self.places.element]]
        gradient = np.stack([self.places.grad_x, self.places.grad_y], axis=-1)
        return np.eye(2) + np.einsum("pia,piA->paA", local, gradient)

    def average(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        return self.endings.means(self.energy(displacement))

    def responses(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        state = self.state(displacement)
        return np.stack([self.endings.means(quantity.finite(state)) for quantity in QUANTITIES])

    def state(self, displacement: Array) -> LocalState:
        """Return what is known of the places for displacements (nodes, 2, ...): arrays (p, ...)."""
        body = self.body
        wide = (slice(None), *([None] * (displacement.ndim - 2)))
        held, place = np.unique(self.places.element, return_inverse=True)
        local = displacement[body.elements.nodes[held]]  # (e, 9, 2, ...)
        log = _log_volume(body.elements.grad_x[held], body.elements.grad_y[held], local)
        fit = np.einsum("eq,eqm,eq...->em...", body.elements.weight[held], body.elements.modes[held], log)[place]
        gradient = [
            np.einsum("pi,pi...->p...", grad, local[place]) for grad in (self.places.grad_x, self.places.grad_y)
        ]
        return LocalState(
            xx=gradient[0][:, 0],
            xy=gradient[1][:, 0],
            yx=gradient[0][:, 1],
            yy=gradient[1][:, 1],
            dilatation=np.einsum("pm,pm...->p...", self.places.modes, fit),
            shear=body.elements.shear[self.places.element][wide],
            lame=body.elements.lame[self.places.element][wide],
            stiffening=body.elements.stiffening[self.places.element][wide],
            tangent=(self.endings.tangent[:, 0][wide], self.endings.tangent[:, 1][wide]),
        )


def _log_volume(grad_x: Array, grad_y: Array, local: Array) -> Array:
    """Return ln J (e, q, ...) at the quadrature points of elements for displacements of their nodes (e, 9, 2, ...)."""
    along_x, along_y = (np.einsum("eqi,eia...->aeq...", grad, local) for grad in (grad_x, grad_y))
    return log1p(along_x[0] + along_y[1] + along_x[0] * along_y[1] - along_x[1] * along_y[0])
