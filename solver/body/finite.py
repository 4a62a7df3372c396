"""A body at finite strain: energy and forces of its elements, its condensed tangent, and its receptor endings."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Self, cast

import numpy as np

from solver._kernels import bind_arguments
from solver._kernels import elements as element_loops
from solver._kernels.multifrontal import DEFINITE, UNSOLVABLE
from solver.arrays import Array, BodyState, ElementSystem, Indices, Narrow, SymbolicFactorization
from solver.body import MeshElements, Patches, held_directions, integrate_elements
from solver.body.validation import check_body, check_driven, check_laws
from solver.constitutive import Elasticity, log1p, shape, slopes
from solver.linalg import Elimination, StaticCondensation, symbolic_factorization
from solver.mesh import Mesh, distinct
from solver.quantities import QUANTITIES

IMAGINARY = 1e-30  # step of a complex derivative, whose square underflows [-]


@dataclass(frozen=True, eq=False)  # without slots, for cached properties
class FiniteBody(MeshElements):
    """A body at finite strain with e elements, n unknowns and k nodes of skin.

    Unknowns are numbered in the order of their elimination, the skin's last.
    """

    plan: SymbolicFactorization  # of the elimination
    held: Narrow  # (k,) directions in which a node of the skin is held: 0, HELD_X, HELD_Y or their sum
    middle: Narrow  # (k,) 1 at the middle of an edge of the skin, 0 at its ends

    @classmethod
    def of(cls, mesh: Mesh, materials: Sequence[Elasticity], *, checked: bool = False) -> Self:
        """Return the body of a `mesh` with `materials` by region. The centre of an element is never held.

        Raises BodyError and MeshError, unless its input was `checked` before.
        """
        if not checked:
            check_body(mesh, materials)
            check_laws(materials)
            check_driven(mesh)
        plan = symbolic_factorization(mesh)
        middle = (np.arange(len(mesh.skin)) % 2).astype(np.int32)
        return cls(*integrate_elements(mesh, materials, plan.unknown), plan, held_directions(mesh), middle)

    @cached_property
    def condensed(self) -> "CondensedFinite":
        """The body's tangent, condensed to the skin."""
        return CondensedFinite(self)

    @property
    def size(self) -> int:
        """Number of unknowns after the centres are eliminated."""
        return self.plan.size

    def displacement(self, u: Array, only: Indices | None = None) -> Array:  # noqa: ARG002 - `u` has all nodes
        """Return `u`, the displacements (nodes, 2, ...) of all nodes."""
        return u

    def recover_increments(self, skin: Array) -> Array:
        """Return the increments (nodes, 2, c) of all nodes for the skin's (2 k, c), with the last tangent."""
        tangent = StaticCondensation(self.mesh, self.condensed.inside, self.condensed.system)
        return tangent.displacement(skin, tangent.no_load)

    def tangent(self, u: Array, pressure: Array) -> StaticCondensation:
        """Return the tangent at a state, condensed to the skin; after an equilibrium, its last iteration's."""
        if self.condensed.equilibrium is not u:
            self.condensed.linearise(u, pressure)
        return StaticCondensation(self.mesh, self.condensed.inside, self.condensed.system)

    def deformation(self, u: Array) -> Array:
        """Return F (e, 9, 2, 2) at the quadrature points for displacements `u` (nodes, 2)."""
        return np.eye(2) + self.gradient(u)

    def smallest_det(self, displacement: Array) -> float:
        """Return the smallest det F at the quadrature points [-]; not positive where tissue is inside out."""
        return float(np.linalg.det(self.deformation(displacement)).min())

    def pressure(self, u: Array) -> Array:
        """Return the modes (e, 3) of the pressure lambda ln J at `u`."""
        return self.elements.lame[:, None] * self._volume(self.gradient(u))[1]

    def energy(self, u: Array) -> float:
        """Return the energy stored in the body [N mm per mm]."""
        return self._energy(self.gradient(u)).real

    def energy_slope(self, u: Array, direction: Array) -> float:
        """Return the derivative of the stored energy at `u` along a `direction` (nodes, 2) [N mm per mm].

        It is a complex-step derivative of the energy, independent of the stresses (Squire and Trapp 1998, SIAM Rev. 40,
        110).
        """
        H = self.gradient(cast("Array", u + 1j * IMAGINARY * direction))
        return self._energy(H).imag / IMAGINARY

    def internal_work(self, displacement: Array) -> float:
        """Return the derivative of the stored energy as in `Body`, independently of the stresses [N]."""
        return self.energy_slope(displacement, displacement)

    def forces(self, displacement: Array) -> Array:
        """Return the internal forces (nodes, 2) at `displacement` (nodes, 2) [N/mm]."""
        H = self.gradient(displacement)
        log, volume = self._volume(H)
        inverse, exceeds = _inverse_and_excess(H)
        G = self.elements.shear[:, None] * slopes(self.elements.stiffening[:, None], _excess(H, log))[0]
        pressure = self.elements.lame[:, None] * (self.elements.modes @ volume[:, :, None])[:, :, 0]
        stress = self.elements.weight[:, :, None, None] * (
            G[:, :, None, None] * exceeds + pressure[:, :, None, None] * inverse
        )
        gradient = np.stack([self.elements.grad_x, self.elements.grad_y], axis=-1)
        return self.mesh.assemble((gradient @ np.swapaxes(stress, -1, -2)).sum(axis=1))

    def gradient(self, u: Array) -> Array:
        """Return F - 1 (e, 9, 2, 2), which keeps digits that F would lose."""
        local = self.mesh.local(u)
        return np.stack([self.elements.grad_x @ local, self.elements.grad_y @ local], axis=-1)

    def volume_modes(self, element: Indices, local: Array) -> Array:
        """Return the least-squares modes (m, 3, ...) of ln J, as `MeshElements` defines them."""
        slopes = np.stack([self.elements.grad_x[element], self.elements.grad_y[element]])
        gradient = slopes @ local.reshape(len(element), 9, -1)  # (2, m, q, 2 c)
        x, y = np.moveaxis(gradient.reshape(2, len(element), -1, 2, local[0, 0, 0].size), 3, 1)
        log = _logarithm(x[0], y[0], x[1], y[1])
        return (self.weighted_modes[element] @ log).reshape(len(element), 3, *local.shape[3:])

    def _volume(self, H: Array) -> tuple[Array, Array]:
        """Return ln J (e, 9) and its modes (e, 3) for F = 1 + H."""
        log = _logarithm(H[..., 0, 0], H[..., 0, 1], H[..., 1, 0], H[..., 1, 1])
        return log, (self.weighted_modes @ log[..., None])[..., 0]

    def _energy(self, H: Array) -> complex:
        log, volume = self._volume(H)
        growth = shape(self.elements.stiffening[:, None], _excess(H, log))
        shear = np.sum(self.elements.weight * self.elements.shear[:, None] / 2.0 * growth)
        return complex(shear + np.sum(self.elements.lame / 2.0 * (volume**2).T))


def _logarithm(xx: Array, xy: Array, yx: Array, yy: Array) -> Array:
    """Return ln J of a displacement gradient."""
    return log1p(xx + yy + (xx * yy - xy * yx))


def _inverse_and_excess(H: Array) -> tuple[Array, Array]:
    """Return F^-T and F - F^-T (e, 9, 2, 2) for F = 1 + H, the difference without cancellation."""
    growth = (H[..., 0, 0] + H[..., 1, 1] + np.linalg.det(H))[..., None, None]
    across = np.stack([H[..., 1, 1], -H[..., 1, 0], -H[..., 0, 1], H[..., 0, 0]], axis=-1).reshape(H.shape)
    F = np.eye(2) + H
    return (np.eye(2) + across) / (1.0 + growth), (H - across + growth * F) / (1.0 + growth)


def _excess(H: Array, log: Array) -> Array:
    return 2.0 * (np.trace(H, axis1=-2, axis2=-1) - log) + np.sum(H * H, axis=(-2, -1))


class CondensedFinite:
    """The tangent of a body at finite strain, condensed to its skin."""

    equilibrium: Array | None  # displacements of the equilibrium that the tangent led to

    def __init__(self, body: FiniteBody, *, relaxes: bool = False) -> None:
        """Allocate memory for `body`, and for the overstress of tissues where it `relaxes`."""
        count = len(body.elements.nodes)
        self.body, self.constant, self.length_scale = body, False, body.mesh.length_scale
        self.definite = True
        self.load = np.zeros(body.size)  # dead loads on all unknowns
        self.all_forces = np.zeros(body.size)  # internal forces of all unknowns, less the dead loads
        self.inside = Elimination(body.plan)
        self.system = ElementSystem(
            np.zeros((count, 16, 16)), self.all_forces, np.zeros((count, 2, 17)), np.zeros((count, 3)),
            np.zeros((count, 3, 18)), np.zeros((count, 3)), np.zeros((count * relaxes, 18)),
            np.zeros((count * relaxes, 18, 18)),
        )  # fmt: skip
        self.stiffness, self.force = self.inside.stiffness, self.all_forces[body.size - len(self.inside.stiffness) :]
        self._no_pressure = np.zeros((count, 3))
        self.compliance, self.motions = np.zeros((0, 0)), np.zeros((0, 0))
        self.bulk = float((body.elements.lame / body.elements.shear).max())
        self.held, self.middle, self.fixed_length = body.held, body.middle, np.zeros(len(body.mesh.skin))
        elements = body.elements
        self._assemble = bind_arguments(element_loops.assemble, elements, self.system)
        self._advance = bind_arguments(element_loops.advance, elements, self.system)
        self.equilibrium = None

    def undeformed(self) -> tuple[Array, Array]:
        """Return zero displacements (nodes, 2) and pressures (e, 3)."""
        return np.zeros(self.body.mesh.nodes.shape), np.zeros((len(self.body.elements.nodes), 3))

    def skin_positions(self, u: Array) -> Array:
        """Return the positions of the skin's nodes (k, 2) at displacements `u` (nodes, 2) [mm]."""
        skin = self.body.mesh.skin
        return self.body.mesh.nodes[skin] + u[skin]

    def linearise(self, u: Array, pressure: Array | None) -> bool:
        """Condense the tangent and the forces at a state; return False where it is inside out or singular.

        Without `pressure`, the last tangent and its factors are kept.
        """
        if pressure is not None:
            self.equilibrium = None
        if not self.assemble(u, pressure) > 0.0:
            return False
        if pressure is not None:
            result = self.inside.factorise(self.system.tangent)
            self.definite = result == DEFINITE
            if result == UNSOLVABLE:
                return False
        self.all_forces -= self.load
        self.inside.condense(self.all_forces)
        return True

    def assemble(self, u: Array, pressure: Array | None) -> float:
        """Fill tangents and forces at a state, without `pressure` the forces alone; return the smallest det F."""
        return self._assemble(u, self._no_pressure if pressure is None else pressure, pressure is not None)

    def recover(self, u: Array, pressure: Array, step: Array, scale: float) -> tuple[Array, Array, float]:
        """Return a state after `scale` times the skin's `step` (2 k,), and the largest move of the full step [mm]."""
        after = BodyState(np.empty_like(u), np.empty_like(pressure))
        inner = self.inside.back_substitute(self.all_forces, step)
        largest = self._advance(BodyState(u, pressure), inner, scale, after)
        return after.u, after.pressure, largest

    def stored_energy(self, u: Array, reaction: Array) -> float:  # noqa: ARG002 - part of the protocol
        """Return the energy stored in the body at `u` (nodes, 2) [N mm per mm]."""
        return self.body.energy(u)

    def work(self, path: Sequence[Array], trapezoid: float) -> float:
        """Return the work by Simpson's rule, with the internal forces at the mean displacements [N mm per mm]."""
        halfway = (self.body.energy_slope((before + after) / 2.0, after - before) for before, after in pairwise(path))
        return (trapezoid + 2.0 * sum(halfway)) / 3.0


class FinitePatches(Patches):
    """Averages over the endings of a body at finite strain, with the volume modes of ln J."""

    quantities = tuple(quantity.finite for quantity in QUANTITIES)

    def deformation(self, displacement: Array) -> Array:
        """Return F (p, 2, 2) for displacements (nodes, 2)."""
        return np.eye(2) + self.endings.probes.displacement_gradient(self.elements.mesh, displacement)

    def gradient(self, displacement: Array) -> Array:
        """Return the gradient (nodes, 2) of the first ending's SED at `displacement` (nodes, 2) [MPa/mm]."""
        body, first = self.elements, self.endings.patch == 0
        of, element, slopes_at = body.elements, self.endings.probes.element[first], self.endings.probes.gradient[first]
        weight, modes = self.endings.weights[first] / self.endings.areas[0], body.modes_at(self.endings.probes)[first]
        forces = np.zeros((len(body.mesh.elements), 9, 2))
        H = np.swapaxes(slopes_at @ body.mesh.local(displacement, element), 1, 2)  # at the probes
        log = _logarithm(H[:, 0, 0], H[:, 0, 1], H[:, 1, 0], H[:, 1, 1])
        shear = weight * of.shear[element] * slopes(of.stiffening[element], _excess(H, log))[0]
        stress = shear[:, None, None] * _inverse_and_excess(H)[1]
        np.add.at(forces, element, np.swapaxes(stress @ slopes_at, 1, 2))
        hosts = distinct(element)
        number, gradient = np.searchsorted(hosts, element), np.stack([of.grad_x[hosts], of.grad_y[hosts]], axis=-1)
        H = np.swapaxes(gradient, 2, 3) @ body.mesh.local(displacement, hosts)[:, None]  # (m, q, 2, 2) transposed
        log = _logarithm(H[..., 0, 0], H[..., 1, 0], H[..., 0, 1], H[..., 1, 1])
        fit, pressure = (body.weighted_modes[hosts] @ log[..., None])[number, :, 0], np.zeros((len(hosts), 3))
        np.add.at(pressure, number, (weight * of.lame[element] * np.sum(modes * fit, axis=1))[:, None] * modes)
        by_point = (pressure[:, None] @ body.weighted_modes[hosts])[:, 0, :, None, None]  # (m, q, 1, 1)
        forces[hosts] += np.sum(by_point * (gradient @ _inverse_and_excess(H)[0]), axis=1)
        return body.mesh.assemble(forces.reshape(-1, 18))
