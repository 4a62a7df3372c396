# ruff: noqa: N803, N806 - F, J, Q and T are the literature's own
"""Energies, stresses and tangents of laws in plain NumPy that the program does not need: they judge its elements."""

import numpy as np

from solver.arrays import Array
from solver.contact import SHEAR_LIMITED, SLIP


def hooke_energy(law, gradient):
    """Return W = G eps:eps + lambda/2 (tr eps)^2 (...) [MPa] for displacement gradients (..., 2, 2), eps_zz = 0."""
    strain = (gradient + np.swapaxes(gradient, -1, -2)) / 2.0
    return (
        law.shear * np.sum(strain * strain, axis=(-2, -1)) + law.lame / 2.0 * np.trace(strain, axis1=-2, axis2=-1) ** 2
    )


def energy(law, F):
    """Return W (...) [MPa] of a law of finite strain at deformation gradients F (..., 2, 2); nan where det F <= 0."""
    J = F[..., 0, 0] * F[..., 1, 1] - F[..., 0, 1] * F[..., 1, 0]
    Q = np.sum(F * F, axis=(-2, -1)) - 2.0 - 2.0 * np.log(J)
    stretch = np.exp(np.arccosh(1.0 + np.maximum(Q, 0.0) / 2.0) / 2.0)  # the larger one, the other being its inverse
    power = stretch**law.stiffening
    return 2.0 * law.shear / law.stiffening**2 * (power + 1.0 / power - 2.0) + law.lame / 2.0 * np.log(J) ** 2


def overstress_energy(T: Array, F: Array) -> Array:
    """Return 1/2 J^-2/3 T:C (...) [MPa], of which `overstress` is the derivative within a step."""
    return 0.5 * np.linalg.det(F) ** (-2.0 / 3.0) * _contraction(T, F)


def _contraction(T: Array, F: Array) -> Array:
    """Return T:C (...), with C_zz = 1."""
    C = np.swapaxes(F, -1, -2) @ F
    return T[..., 0] * C[..., 0, 0] + T[..., 1] * C[..., 1, 1] + 2.0 * T[..., 2] * C[..., 0, 1] + T[..., 3]


def overstress_tangent(T: Array, F: Array) -> Array:
    """Return dP_aA/dF_bB (..., a, A, b, B) [MPa] within a step."""
    J, inverse, contraction = np.linalg.det(F), np.swapaxes(np.linalg.inv(F), -1, -2), _contraction(T, F)
    expanded = (..., None, None, None, None)
    plane = np.stack([T[..., [0, 2]], T[..., [2, 1]]], axis=-2)
    product = F @ plane
    outer = np.einsum("...aA,...bB->...aAbB", product, inverse)
    tangent = np.einsum("ab,...AB->...aAbB", np.eye(2), plane)
    tangent = tangent - 2.0 / 3.0 * (outer + np.einsum("...aA,...bB->...aAbB", inverse, product))
    tangent += 2.0 / 9.0 * contraction[expanded] * np.einsum("...aA,...bB->...aAbB", inverse, inverse)
    tangent += contraction[expanded] / 3.0 * np.einsum("...aB,...bA->...aAbB", inverse, inverse)
    return (J ** (-2.0 / 3.0))[expanded] * tangent


def friction_slopes(law, state, sense):
    """Return how friction forces grow with the normal force (n,) [-] and with the skin's length (n,) [MPa].

    Of points in `state` (n,), with friction forces along `sense` (n,), +1 along +x. Open points bear no force, and that
    of sticking ones is unknown.
    """
    return np.where(state == SLIP, sense * law.mu, 0.0), np.where(state == SHEAR_LIMITED, sense * law.tau_max, 0.0)


def frictionless(law):
    """Return whether no tangential force is possible."""
    return law.mu == 0.0 or law.tau_max == 0.0
