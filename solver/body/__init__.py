"""Interfaces of a body and of its static condensation to the skin, its elements, and averages over its endings."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple, Protocol, Self

import numpy as np
from numpy.linalg import LinAlgError

from solver._kernels import HELD_X, HELD_Y
from solver.arrays import NEO_HOOKEAN, Array, ElementArrays, Indices, Narrow, inverse
from solver.constitutive import Elasticity
from solver.linalg import StaticCondensation
from solver.mesh import Q2P1, Mesh, distinct, integrals
from solver.quantities import LocalState

MAX_CONDITION = 1e14  # product of the largest entries of stiffness and compliance: beyond, a body is loose [-]


class CondensedBody(Protocol):
    """A body linearised at a state and condensed to the k nodes of its skin."""

    constant: bool  # whether all states share one stiffness, so that one linear solve is exact
    bulk: float  # largest ratio of first Lamé constant to shear modulus [-]
    length_scale: float  # relative to which displacements are small or large [mm]
    held: Narrow  # (k,) directions in which a node is held: 0, HELD_X, HELD_Y or their sum
    middle: Narrow  # (k,) 1 at the middle of an edge whose length follows the deformed skin, else 0
    fixed_length: Array  # (k,) tributary length of each node, where the deformation does not change it [mm]
    stiffness: Array  # (2 k, 2 k) x, y of one node, x, y of the next [N/mm per mm]
    definite: bool  # whether the last tangent is positive definite with the skin held
    equilibrium: Array | None  # displacements of the last equilibrium, where its tangent is still in memory
    load: Array  # (2 k,) dead loads condensed to the skin, or (n,) those of all unknowns [N/mm]
    force: Array  # (2 k,) condensed internal forces less the dead loads [N/mm]

    @property
    def compliance(self) -> Array:
        """The inverse of the stiffness, bordered by `motions` (2 k + m, 2 k + m) [mm per N/mm]; (0, 0) if unknown."""

    @property
    def motions(self) -> Array:
        """Rigid motions (2 k, m) along which the surface alone balances the loads."""

    def undeformed(self) -> tuple[Array, Array]:
        """Return the displacements and pressures of the undeformed body."""

    def skin_positions(self, u: Array) -> Array:
        """Return the positions of the skin's nodes (k, 2) at displacements `u` [mm]."""

    def linearise(self, u: Array, pressure: Array | None) -> bool:
        """Set `stiffness` and `force` at a state; return False where the state is inside out or singular.

        Without `pressure`, the last stiffness is kept.
        """

    def recover(self, u: Array, pressure: Array, step: Array, scale: float) -> tuple[Array, Array, float]:
        """Return a state after `scale` times the skin's `step` (2 k,), and the largest move of the full step [mm]."""

    def stored_energy(self, u: Array, reaction: Array) -> float:
        """Return the energy stored at displacements `u`, held by surface forces `reaction` (k, 2) [N mm per mm]."""

    def work(self, path: Sequence[Array], trapezoid: float) -> float:
        """Return the work of the skin's forces along a path [N mm per mm]; `trapezoid` is its trapezoidal sum."""


class Body(Protocol):
    """A body of n nodes; displacements are relative to the bone, or to the support that drives the body [mm]."""

    @property
    def mesh(self) -> Mesh:
        """Its mesh."""

    @property
    def condensed(self) -> CondensedBody:
        """The body condensed to its skin."""

    @property
    def centre(self) -> Array:
        """Origins (e, 2) of the elements' pressure modes [mm]."""

    def displacement(self, u: Array, only: Indices | None = None) -> Array:
        """Return the displacements (n, 2, ...) of all nodes for one state `u` or several.

        With `only` (node numbers), other nodes may be left at 0.
        """

    def tangent(self, u: Array, pressure: Array) -> StaticCondensation:
        """Return the tangent at a state, condensed to the skin."""

    def recover_increments(self, skin: Array) -> Array:
        """Return the increments (n, 2, c) of all nodes by back substitution of the skin's (2 k, c)."""

    def forces(self, displacement: Array) -> Array:
        """Return the internal forces (n, 2) at `displacement` (n, 2) [N/mm]."""

    def internal_work(self, displacement: Array) -> float:
        """Return the derivative of the stored energy with respect to a factor on `displacement` (n, 2), at 1 [N]."""

    def smallest_det(self, displacement: Array) -> float:
        """Return the smallest det F [-] at `displacement` (n, 2); not positive where tissue is inside out."""


class CondensedLinear:
    """A body at small strain condensed to its skin; a state's u (k, 2) [mm] are the skin's displacements."""

    def __init__(self, rest: Array, stiffness: Array, load: Array, length: Array, held: Narrow) -> None:
        """Store the undeformed positions `rest` (k, 2) [mm], the tributary `length` (k,) [mm] and the `held` (k,).

        `stiffness` (2 k, 2 k) and the condensed dead `load` (2 k,) list x, y of one node after the other.
        """
        self.constant, self.definite, self.bulk = True, True, 0.0
        self.length_scale = float(np.ptp(rest, axis=0).max()) if len(rest) else 0.0  # the extent of the skin
        self.rest, self.stiffness, self.load = rest, stiffness, load
        self.fixed_length, self.held, self.middle = length, held, np.zeros(len(rest), np.int32)
        self.motions = np.zeros((2 * len(rest), 0))  # rigid motions that the surface alone balances
        self.springs = self.motions  # an orthonormal basis of all rigid motions that no support prevents
        self.force = -load
        self.equilibrium: Array | None = None

    @cached_property
    def compliance(self) -> Array:
        """The bordered inverse of `CondensedBody`, 0 for held unknowns. Raises LinAlgError for a singular stiffness."""
        free, count = np.flatnonzero(self.stiffness.diagonal() > 0.0), self.motions.shape[1]
        # Rigid motions store no energy, so a spring on each makes the matrix invertible. The springs stay unloaded,
        # because the surface's forces balance the loads along every motion.
        spring = self.stiffness.trace() / max(len(free), 1)
        inside = (self.stiffness + spring * self.springs @ self.springs.T)[np.ix_(free, free)]
        inverse = np.asarray(np.linalg.inv(inside), np.float64)
        if not np.abs(inside).max(initial=0.0) * np.abs(inverse).max(initial=0.0) < MAX_CONDITION:
            raise LinAlgError("the body is neither held nor balanced")
        size = len(self.stiffness)
        out = np.zeros((size + count, size + count))
        out[:size, size:], out[size:, :size] = self.motions, self.motions.T
        out[np.ix_(free, free)] = (inverse + inverse.T) / 2.0
        return out

    def with_load(self, load: Array) -> "CondensedLinear":
        """Return the same body under another dead `load` (2 k,) [N/mm]."""
        _ = self.compliance  # which both share
        body = copy(self)
        body.load, body.force = load, -load
        return body

    def undeformed(self) -> tuple[Array, Array]:
        """Return zero displacements (k, 2) of the skin, and no pressures."""
        return np.zeros(self.rest.shape), np.zeros((0, 3))

    def free_displacement(self) -> Array:
        """Return the displacements (k, 2) under the dead loads alone, without free rigid motions."""
        return self.displacement_under(np.zeros(self.rest.shape))

    def displacement_under(self, reaction: Array) -> Array:
        """Return the displacements (k, 2) under the dead loads and forces `reaction` (k, 2) of the surface."""
        size = len(self.load)
        return (self.compliance[:size, :size] @ (self.load + reaction.ravel())).reshape(-1, 2)

    def stored_energy(self, u: Array, reaction: Array) -> float:  # noqa: ARG002 - `u` of relaxing tissues may differ
        """Return the energy stored once the body is relaxed under forces `reaction` (k, 2) [N mm per mm]."""
        return 0.5 * float(np.sum(reaction * self.displacement_under(reaction)))

    def work(self, path: Sequence[Array], trapezoid: float) -> float:  # noqa: ARG002 - part of the protocol
        """Return `trapezoid`: forces grow in proportion to displacements, so that the rule is exact."""
        return trapezoid

    def skin_positions(self, u: Array) -> Array:
        """Return the positions of the skin's nodes (k, 2) at displacements `u` (k, 2) [mm]."""
        return self.rest + u

    def linearise(self, u: Array, pressure: Array | None) -> bool:  # noqa: ARG002 - part of the protocol
        """Set `force` at a state; the stiffness is constant."""
        self.force = self.stiffness @ u.ravel() - self.load if u.any() else -self.load
        return True

    def recover(self, u: Array, pressure: Array, step: Array, scale: float) -> tuple[Array, Array, float]:
        """Return a state after `scale` times the skin's `step` (2 k,), and the largest move of the full step [mm]."""
        return u + scale * step.reshape(u.shape), pressure, float(np.abs(step).max(initial=0.0))


@dataclass(frozen=True, slots=True, eq=False)
class Probes:
    """Points inside elements at which strains are evaluated; p of them."""

    element: Indices  # (p,)
    gradient: Array  # (p, 2, 9) of the shape functions, along x and y [1/mm]
    modes: Array  # (p, 3) the functions 1, x, y about the element's centre

    @staticmethod
    def at(mesh: Mesh, centre: Array, element: Indices, local: Array) -> "Probes":
        """Return probes at `local` coordinates (p, 2) of `element` (p,); modes are about `centre` (e, 2)."""
        values, slopes = Q2P1.shape(local)
        corners, slopes = mesh.local(mesh.nodes, element), np.ascontiguousarray(np.swapaxes(slopes, 1, 2))
        place = (values[:, None] @ corners)[:, 0] - centre.take(element, axis=0)
        modes = np.concatenate([np.ones((len(element), 1)), place], axis=1)
        return Probes(element, inverse(slopes @ corners) @ slopes, modes)

    def displacement_gradient(self, mesh: Mesh, displacement: Array) -> Array:
        """Return du_a/dx_b (p, 2, 2, ...) for displacements (nodes, 2, ...)."""
        return self.gradient_of(mesh.about_centre(displacement, self.element))

    def gradient_of(self, local: Array) -> Array:
        """Return du_a/dx_b (p, 2, 2, ...) for the displacements (p, 9, 2, ...) of the nodes of each probe's element."""
        slopes = self.gradient @ local.reshape(len(local), 9, -1)
        return np.swapaxes(slopes.reshape(len(local), 2, *local.shape[2:]), 1, 2)


@dataclass(frozen=True, eq=False)  # without slots, for cached properties
class Endings:
    """Quadrature points of r receptor endings (patches of tissue): p points in all."""

    probes: Probes
    weights: Array  # (p,) areas [mm2]
    patch: Indices  # (p,) number of the ending to which each probe belongs, ascending
    count: int
    tangent: Array  # (p, 2) direction of the undeformed skin above each probe, towards the tip

    @cached_property
    def areas(self) -> Array:
        """Area of each ending (r,) [mm2]; nan for one that lies outside the skin."""
        area = np.bincount(self.patch, self.weights, self.count)
        return np.where(area > 0.0, area, np.nan)

    def means(self, values: Array) -> Array:
        """Return the averages (r, ...) of values (p, ...) over each ending; nan for one outside the skin."""
        wide = (slice(None), *([None] * (values.ndim - 1)))
        first = np.flatnonzero(np.diff(self.patch, prepend=-1))
        out = np.full((self.count, *values.shape[1:]), np.nan, values.dtype)
        out[self.patch[first]] = np.add.reduceat(values * self.weights[wide], first, axis=0)
        return out / self.areas[wide]


class ProbeData(NamedTuple):
    """Probes with the constant data of their elements."""

    probes: "Probes"
    hosts: Indices  # (m,) elements that hold probes
    number: Indices  # (p,) index in `hosts` of the element that holds each probe
    modes: Array  # (p, 3) orthonormal volume modes at the probes
    constants: Array  # (5, p) shear modulus, first Lamé constant, stiffening exponent, tangent of the skin x, y


@dataclass(frozen=True, eq=False)
class MeshElements:
    """The e elements of a mesh with their integrals at q = 9 quadrature points each.

    Held nodes are fixed. A centre node belongs to one element and is eliminated inside it.
    """

    mesh: Mesh
    elements: ElementArrays  # arguments of the kernels; modes are orthonormal over the element
    centre: Array  # (e, 2) origins of the modes, combinations of 1, x - centre, y - centre [mm]
    combination: Array  # (e, 3, 3) mode m = sum over l of combination[m, l] (1, x - centre, y - centre)[l]

    @classmethod
    def of(cls, mesh: Mesh, materials: Sequence[Elasticity]) -> Self:
        """Integrate the elements of `mesh` with `materials` by region. Raises MeshError for a folded element."""
        return cls(*integrate_elements(mesh, materials, np.full((len(mesh.elements), 16), -1, np.int32)))

    def probe_data(self, probes: "Probes", tangent: Array | None = None) -> "ProbeData":
        """Return `ProbeData` of probes; `tangent` (p, 2) is the skin's direction, by default along x."""
        of, element, hosts = self.elements, probes.element, distinct(probes.element)
        along = np.tile([1.0, 0.0], (len(element), 1)) if tangent is None else tangent
        constants = np.stack([of.shear[element], of.lame[element], of.stiffening[element], *along.T])
        return ProbeData(probes, hosts, np.searchsorted(hosts, element), self.modes_at(probes), constants)

    def state(self, data: "ProbeData", displacement: Array) -> LocalState:
        """Return strains and moduli at the probes of `data`, arrays (p, ...), for displacements (nodes, 2, ...)."""
        hosts, wide = data.hosts, (slice(None), slice(None), *([None] * (displacement.ndim - 2)))
        local = self.mesh.about_centre(displacement, hosts)
        gradient = data.probes.gradient_of(local.take(data.number, axis=0))
        fit = self.volume_modes(hosts, local)[data.number]
        dilatation = np.sum(data.modes[wide] * fit, axis=1)
        shear, lame, stiffening, x, y = data.constants[wide]
        return LocalState(
            gradient[:, 0, 0], gradient[:, 0, 1], gradient[:, 1, 0], gradient[:, 1, 1],
            dilatation, shear, lame, stiffening, (x, y),
        )  # fmt: skip

    def volume_modes(self, element: Indices, local: Array) -> Array:
        """Return the least-squares modes (m, 3, ...) of the volume strain of elements, ln J at finite strain.

        `local` (m, 9, 2, ...) are the displacements of their nodes.
        """
        modes = self.divergence[element] @ local.reshape(len(element), 18, -1)
        return modes.reshape(len(element), 3, *local.shape[3:])

    @cached_property
    def weighted_modes(self) -> Array:
        """Matrices (e, 3, q) from values at the quadrature points to their least-squares volume modes."""
        return np.swapaxes(self.elements.weight[:, :, None] * self.elements.modes, 1, 2)

    @cached_property
    def divergence(self) -> Array:
        """Matrices (e, 3, 18) from nodal displacements x, y, x, y, ... to the volume modes of the small strain."""
        by_axis = [self.weighted_modes @ slope for slope in (self.elements.grad_x, self.elements.grad_y)]
        return np.stack(by_axis, axis=-1).reshape(-1, 3, 18)

    def modes_at(self, probes: "Probes") -> Array:
        """Return the orthonormal volume modes (p, 3) at probes."""
        return (self.combination[probes.element] @ probes.modes[:, :, None])[:, :, 0]


def integrate_elements(
    mesh: Mesh, materials: Sequence[Elasticity], unknown: Narrow
) -> tuple[Mesh, ElementArrays, Array, Array]:
    """Return the fields of `MeshElements`; `unknown` (e, 16) numbers the outer nodes' unknowns, -1 where fixed.

    Raises MeshError where an element is folded.
    """
    shear, lame, stiffening = (
        np.array(numbers, np.float64)[mesh.region]
        for numbers in zip(*((m.shear, m.lame, getattr(m, "stiffening", NEO_HOOKEAN)) for m in materials), strict=True)
    )
    grad_x, grad_y, weight, modes, laplace, centre, combination = integrals(mesh)
    elements = ElementArrays(
        grad_x, grad_y, weight, modes, laplace, shear, stiffening, lame, mesh.elements.astype(np.int32),
        unknown.reshape(-1, 8, 2),
    )  # fmt: skip
    return mesh, elements, centre, combination


def held_directions(mesh: Mesh) -> Narrow:
    """Return the directions in which each node of the skin is held (k,): 0, HELD_X, HELD_Y or their sum."""
    return (mesh.driven[mesh.skin] @ np.array([HELD_X, HELD_Y])).astype(np.int32)


@dataclass(frozen=True, eq=False)  # without slots, for cached properties
class Patches:
    """Averages of quantities over r endings of a body."""

    elements: MeshElements
    endings: Endings
    quantities: ClassVar[tuple[Callable[[LocalState], Array], ...]]  # of the kinematics, SED first

    def nodes(self) -> Indices:
        """Return the numbers of the nodes of all elements that hold probes."""
        return distinct(self.elements.mesh.elements[distinct(self.endings.probes.element)])

    def state(self, displacement: Array) -> LocalState:
        """Return strains and moduli at the probes, arrays (p, ...), for displacements (nodes, 2, ...)."""
        return self.elements.state(self._probe_data, displacement)

    @cached_property
    def _probe_data(self) -> "ProbeData":
        return self.elements.probe_data(self.endings.probes, self.endings.tangent)

    def energy(self, displacement: Array) -> Array:
        """Return the SED at the probes (p, ...) [MPa] for displacements (nodes, 2, ...)."""
        return self.quantities[0](self.state(displacement))

    def average(self, displacement: Array) -> Array:
        """Return the SED averaged over each ending (r, ...) [MPa] for displacements (nodes, 2, ...)."""
        return self.endings.means(self.energy(displacement))

    def responses(self, displacement: Array) -> Array:
        """Return the averages of every quantity (q, r, ...) for real or complex displacements (nodes, 2, ...)."""
        state = self.state(displacement)
        return np.stack([self.endings.means(quantity(state)) for quantity in self.quantities])
