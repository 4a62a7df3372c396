"""Deformation, pressure, energy and forces of a body at finite strain, for what is asked once of an answer."""

from typing import cast

import numpy as np

from solver.arrays import Array
from solver.body.finite import FiniteBody
from solver.constitutive.hyperelastic import log1p, shape, slopes

IMAGINARY = 1e-30  # step whose square is nothing [-]


def deformation(body: FiniteBody, u: Array) -> Array:
    """Return F (e, 9, 2, 2) at the quadrature points for displacements `u` (nodes, 2)."""
    return np.eye(2) + _gradient(body, u)


def _gradient(body: FiniteBody, u: Array) -> Array:
    """Return F - 1 (e, 9, 2, 2) to its own digits, which stiff tissue multiplies."""
    local = u[body.nodes]  # (e, 9, 2)
    return np.stack([body.grad_x @ local, body.grad_y @ local], axis=-1)


def _turned(H: Array) -> tuple[Array, Array]:
    """Return the transposed inverse of F = 1 + H and what F exceeds it by (e, 9, 2, 2), that to its own digits."""
    grown = (H[..., 0, 0] + H[..., 1, 1] + np.linalg.det(H))[..., None, None]
    across = np.stack([H[..., 1, 1], -H[..., 1, 0], -H[..., 0, 1], H[..., 0, 0]], axis=-1).reshape(H.shape)
    F = np.eye(2) + H
    return (np.eye(2) + across) / (1.0 + grown), (H - across + grown * F) / (1.0 + grown)


def _logarithm(body: FiniteBody, H: Array) -> tuple[Array, Array]:
    """Return ln J (e, 9) and its modes (e, 3) for F = 1 + H."""
    grown = H[..., 0, 0] + H[..., 1, 1] + (H[..., 0, 0] * H[..., 1, 1] - H[..., 0, 1] * H[..., 1, 0])
    log = log1p(grown)
    return log, np.einsum("eq,eqm,eq->em", body.weight, body.modes, log)


def _excess(H: Array, log: Array) -> Array:
    return 2.0 * (np.trace(H, axis1=-2, axis2=-1) - log) + np.sum(H * H, axis=(-2, -1))


def pressure(body: FiniteBody, u: Array) -> Array:
    """Return the modes (e, 3) of the pressure lambda ln J at `u`."""
    return body.lame[:, None] * _logarithm(body, _gradient(body, u))[1]


def energy(body: FiniteBody, u: Array) -> float:
    """Return the energy stored in the body [N mm per mm]."""
    return _stored(body, _gradient(body, u)).real


def energy_slope(body: FiniteBody, u: Array, way: Array) -> float:
    """Return by how much the stored energy grows at `u` along `way` (nodes, 2) [N mm per mm].

    From the energy alone, by a step in imaginary direction (Squire and Trapp 1998, SIAM Rev. 40, 110), no stress asked.
    """
    H = _gradient(body, u) + 1j * IMAGINARY * _gradient(body, way)
    return _stored(body, cast("Array", H)).imag / IMAGINARY


def _stored(body: FiniteBody, H: Array) -> complex:
    log, volume = _logarithm(body, H)
    grown = shape(body.stiffening[:, None], _excess(H, log))
    return complex(np.sum(body.weight * body.shear[:, None] / 2.0 * grown) + np.sum(body.lame / 2.0 * (volume**2).T))


def element_forces(body: FiniteBody, u: Array) -> Array:
    """Return the internal forces (e, 18) of the elements, ordered x, y, x, y, ..."""
    H = _gradient(body, u)
    log, volume = _logarithm(body, H)
    inverse, exceeds = _turned(H)
    G = body.shear[:, None] * slopes(body.stiffening[:, None], _excess(H, log))[0]
    pressure = body.lame[:, None] * (body.modes @ volume[:, :, None])[:, :, 0]
    stress = body.weight[:, :, None, None] * (G[:, :, None, None] * exceeds + pressure[:, :, None, None] * inverse)
    gradient = np.stack([body.grad_x, body.grad_y], axis=-1).reshape(len(H), 9, 9, 2)
    return (gradient @ np.swapaxes(stress, -1, -2)).sum(axis=1).reshape(len(H), 18)
