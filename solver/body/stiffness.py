"""Small-strain stiffness of all elements at once, with the pressure condensed, and what follows from displacements."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solver.element import Q2P1
from solver.mesh import Array, Indices, Mesh

_VALUES, _GRADIENTS = Q2P1.shape(Q2P1.points)  # (9 points, 9 nodes), (9, 9, 2)
_ALONG, _UP = np.ascontiguousarray(_GRADIENTS[..., 0].T), np.ascontiguousarray(_GRADIENTS[..., 1].T)  # (9 nodes, 9)


class Isotropic(Protocol):
    """What elements ask of a material at small strain."""

    @property
    def shear(self) -> float:
        """Shear modulus [MPa]."""
        ...

    @property
    def lame(self) -> float:
        """Lamé's first constant [MPa]."""
        ...


class Centred(Protocol):
    """Elements with the places that their pressure modes are counted from."""

    @property
    def centre(self) -> Array:
        """Where they are, (e, 2) [mm]."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Elastic:
    """Elements made of Hooke materials: e of them, displacements ordered x, y, x, y, ... within each."""

    stiffness: Array  # (e, 18, 18) [N/mm per mm]
    dilatation: Array  # (e, 3, 18): displacements to the volume strain's modes 1, x - xc, y - yc
    centre: Array  # (e, 2) xc, yc of the modes [mm]
    shear: Array  # (e,) [MPa]
    lame: Array  # (e,) [MPa]

    @staticmethod
    def of(mesh: Mesh, materials: Sequence[Isotropic]) -> "Elastic":
        """Integrate the stiffness of every element with 3 x 3 Gauss points; `materials` by region.

        K = integral of 2 G eps:eps + lambda theta^2, where theta is the best fit of the volume strain by 1, x, y. That
        is the mixed form with pressure lambda theta, its three pressure modes eliminated (exact for Hooke).
        """
        corners = mesh.nodes[mesh.elements]  # (e, 9, 2)
        count = len(corners)
        x, y = np.ascontiguousarray(corners[..., 0]), np.ascontiguousarray(corners[..., 1])
        x_xi, x_eta, y_xi, y_eta = x @ _ALONG, x @ _UP, y @ _ALONG, y @ _UP  # (e, q)
        det = x_xi * y_eta - x_eta * y_xi
        weight = det * Q2P1.weights
        by_x = (y_eta / det)[:, :, None] * _ALONG.T  # (e, q, 9) dN/dx
        by_x -= (y_xi / det)[:, :, None] * _UP.T
        by_y = (x_xi / det)[:, :, None] * _UP.T
        by_y -= (x_eta / det)[:, :, None] * _ALONG.T

        shear = np.array([m.shear for m in materials])[mesh.region]
        lame = np.array([m.lame for m in materials])[mesh.region]
        place = _VALUES @ corners  # (e, q, 2)
        centre = place.mean(axis=1)
        modes = np.ones((count, 9, 3))
        modes[:, :, 1:] = place - centre[:, None]
        loaded = np.swapaxes(modes * weight[:, :, None], 1, 2)  # (e, 3, q)
        moments = np.empty((count, 3, 9, 2))  # integral of mode times divergence
        moments[..., 0], moments[..., 1] = loaded @ by_x, loaded @ by_y
        moments = moments.reshape(count, 3, 18)
        dilatation = np.linalg.inv(loaded @ modes) @ moments
        stiff: Array = np.swapaxes(lame[:, None, None] * moments, 1, 2) @ dilatation

        # K_ia,jb gets G (delta_ab grad N_i . grad N_j + dN_i/db dN_j/da), one pair of directions after the other
        blocks = stiff.reshape(count, 9, 2, 9, 2)
        weight *= shear[:, None]
        along = np.swapaxes(by_x * weight[:, :, None], 1, 2)
        xx, xy = along @ by_x, along @ by_y
        yy = np.swapaxes(by_y * weight[:, :, None], 1, 2) @ by_y
        both = xx + yy
        blocks[:, :, 0, :, 0] += both + xx
        blocks[:, :, 1, :, 1] += both + yy
        blocks[:, :, 0, :, 1] += np.swapaxes(xy, 1, 2)
        blocks[:, :, 1, :, 0] += xy
        return Elastic(stiff, dilatation, centre, shear, lame)


@dataclass(frozen=True, slots=True, eq=False)
class Probes:
    """Places inside elements where the strain energy is wanted; p of them."""

    element: Indices  # (p,)
    gradient: Array  # (p, 9, 2) of the shape functions there [1/mm]
    modes: Array  # (p, 3) volume-strain modes there

    @staticmethod
    def at(mesh: Mesh, elements: Centred, element: Indices, local: Array) -> "Probes":
        """Place probes at `local` (p, 2) coordinates of `element` (p,)."""
        values, slopes = Q2P1.shape(local)
        corners = mesh.nodes[mesh.elements[element]]
        jacobian = np.swapaxes(corners, 1, 2) @ slopes
        place = (values[:, None] @ corners)[:, 0] - elements.centre[element]
        modes = np.concatenate([np.ones((len(element), 1)), place], axis=1)
        return Probes(element, slopes @ np.linalg.inv(jacobian), modes)

    def displacement_gradient(self, mesh: Mesh, displacement: Array) -> Array:
        """Return du_a/dx_b (p, 2, 2, ...) for displacements (nodes, 2, ...)."""
        moved = displacement[mesh.elements[self.element]]  # (p, 9, 2, ...)
        moved = moved - moved[:, 8:]  # what moves an element as a whole would drown small strains in round-off
        slopes = np.swapaxes(self.gradient, 1, 2) @ moved.reshape(len(moved), 9, -1)
        return np.swapaxes(slopes.reshape(len(moved), 2, *moved.shape[2:]), 1, 2)

    def volume_strain(self, mesh: Mesh, elastic: Elastic, displacement: Array) -> Array:
        """Return the elements' best fit of the volume strain (p, ...) for displacements (nodes, 2, ...)."""
        moved = displacement[mesh.elements[self.element]]  # (p, 9, 2, ...)
        moved = moved - moved[:, 8:]
        flat = moved.reshape(len(self.element), 18, *moved.shape[3:])
        row = self.modes[:, None] @ elastic.dilatation[self.element]  # (p, 1, 18)
        return (row @ flat.reshape(len(flat), 18, -1)).reshape(len(flat), *flat.shape[2:])

    def energy(self, mesh: Mesh, elastic: Elastic, displacement: Array) -> Array:
        """Return the SED (p, ...) [MPa] for displacements (nodes, 2, ...): G eps:eps + lambda/2 theta^2."""
        strain = self.displacement_gradient(mesh, displacement)
        strain = (strain + np.swapaxes(strain, 1, 2)) / 2.0
        theta = self.volume_strain(mesh, elastic, displacement)
        wide = (slice(None), *([None] * (theta.ndim - 1)))
        shear, lame = elastic.shear[self.element][wide], elastic.lame[self.element][wide]
        return shear * np.sum(strain * strain, axis=(1, 2)) + lame / 2.0 * theta**2


def local_coordinates(corners: Array, points: Array, start: Array) -> Array:
    """Return the local coordinates (p, 2) of `points` (p, 2) in elements with nodes `corners` (p, 9, 2), by Newton."""
    local: NDArray[np.float64] = start.copy()
    for _ in range(8):
        values, slopes = Q2P1.shape(local)
        missing = points - (values[:, None] @ corners)[:, 0]
        jacobian = np.swapaxes(corners, 1, 2) @ slopes
        step = np.linalg.solve(jacobian, missing[..., None])[..., 0]
        local += step
        if np.abs(step).max(initial=0.0) < 1e-13:
            break
    return local
