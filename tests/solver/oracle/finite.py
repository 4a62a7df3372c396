# ruff: noqa: N803, N806 - the letters of the literature
"""Finite strain in plain NumPy: the judge of the compiled loops."""

from typing import cast

import numpy as np

from solver._kernels.contact_system import SHEAR_LIMITED_MU
from solver.arrays import Array, Indices
from solver.body.finite import FiniteBody
from solver.constitutive import shape, slopes
from solver.contact import OPEN, SHEAR_LIMITED, SLIP, STICK, FrictionLaw
from tests.solver.oracle.laws import frictionless

IMAGINARY = 1e-30  # step whose square is nothing [-]


def deformation(body: FiniteBody, u: Array) -> Array:
    """Return F (e, 9, 2, 2) at the quadrature points for displacements `u` (nodes, 2)."""
    return np.eye(2) + _gradient(body, u)


def _gradient(body: FiniteBody, u: Array) -> Array:
    """Return F - 1 (e, 9, 2, 2) to its own digits, which stiff tissue multiplies."""
    local = u[body.elements.nodes]  # (e, 9, 2)
    return np.stack([body.elements.grad_x @ local, body.elements.grad_y @ local], axis=-1)


def _inverse_transpose(H: Array) -> tuple[Array, Array]:
    """Return the transposed inverse of F = 1 + H and what F exceeds it by (e, 9, 2, 2), that to its own digits."""
    volume_strain = (H[..., 0, 0] + H[..., 1, 1] + np.linalg.det(H))[..., None, None]
    adjugate = np.stack([H[..., 1, 1], -H[..., 1, 0], -H[..., 0, 1], H[..., 0, 0]], axis=-1).reshape(H.shape)
    F = np.eye(2) + H
    return (np.eye(2) + adjugate) / (1.0 + volume_strain), (H - adjugate + volume_strain * F) / (1.0 + volume_strain)


def _logarithm(body: FiniteBody, H: Array) -> tuple[Array, Array]:
    """Return ln J (e, 9) and its modes (e, 3) for F = 1 + H."""
    volume_strain = H[..., 0, 0] + H[..., 1, 1] + (H[..., 0, 0] * H[..., 1, 1] - H[..., 0, 1] * H[..., 1, 0])
    log = _log1p(volume_strain)
    return log, np.einsum("eq,eqm,eq->em", body.elements.weight, body.elements.modes, log)


def _log1p(x: Array) -> Array:
    """Return ln(1 + x), of complex numbers for steps as small as IMAGINARY: NumPy's own loses a small x's digits."""
    log = np.log1p(x.real)
    return cast("Array", log + 1j * (x.imag / (1.0 + x.real))) if np.iscomplexobj(x) else log


def _excess(H: Array, log: Array) -> Array:
    return 2.0 * (np.trace(H, axis1=-2, axis2=-1) - log) + np.sum(H * H, axis=(-2, -1))


def pressure(body: FiniteBody, u: Array) -> Array:
    """Return the modes (e, 3) of the pressure lambda ln J at `u`."""
    return body.elements.lame[:, None] * _logarithm(body, _gradient(body, u))[1]


def energy(body: FiniteBody, u: Array) -> float:
    """Return the energy stored in the body [N mm per mm]."""
    return _elastic_energy(body, _gradient(body, u)).real


def _elastic_energy(body: FiniteBody, H: Array) -> complex:
    log, volume = _logarithm(body, H)
    stretch_energy = shape(body.elements.stiffening[:, None], _excess(H, log))
    return complex(
        np.sum(body.elements.weight * body.elements.shear[:, None] / 2.0 * stretch_energy)
        + np.sum(body.elements.lame / 2.0 * (volume**2).T)
    )


def forces(body: FiniteBody, u: Array) -> Array:
    """Return the internal forces (e, 18) of the elements, ordered x, y, x, y, ..."""
    H = _gradient(body, u)
    log, volume = _logarithm(body, H)
    inverse, difference = _inverse_transpose(H)
    G = body.elements.shear[:, None] * slopes(body.elements.stiffening[:, None], _excess(H, log))[0]
    pressure = body.elements.lame[:, None] * (body.elements.modes @ volume[:, :, None])[:, :, 0]
    stress = body.elements.weight[:, :, None, None] * (
        G[:, :, None, None] * difference + pressure[:, :, None, None] * inverse
    )
    gradient = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1).reshape(len(H), 9, 9, 2)
    return (gradient @ np.swapaxes(stress, -1, -2)).sum(axis=1).reshape(len(H), 18)


def forces_and_tangents(body: FiniteBody, u: Array, pressure: Array) -> tuple[Array, Array]:
    """Return the internal forces (e, 18) and tangents (e, 18, 18) of the elements, ordered x, y, x, y, ...

    `pressure` (e, 3) is what the geometric part of the tangent sees; the forces follow from `u` alone.
    """
    H = _gradient(body, u)
    log, _ = _logarithm(body, H)
    inverse, difference = _inverse_transpose(H)
    gradient = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1)
    w = body.elements.weight
    slope, curvature = slopes(body.elements.stiffening[:, None], _excess(H, log))
    G = body.elements.shear[:, None] * slope
    spatial = np.einsum("eqaA,eqiA->eqia", inverse, gradient)  # gradients in the deformed body
    dilate = np.einsum("eq,eqm,eqia->emia", w, body.elements.modes, spatial)
    excess = np.einsum("eqaA,eqiA->eqia", difference, gradient)
    geometric = w * (G - np.einsum("eqm,em->eq", body.elements.modes, pressure))
    tangent = np.einsum("eq,eqiA,eqjA,ab->eiajb", w * G, gradient, gradient, np.eye(2))
    tangent += np.einsum("eq,eqja,eqib->eiajb", geometric, spatial, spatial)
    tangent += np.einsum("eq,eqia,eqjb->eiajb", 2.0 * curvature * w * body.elements.shear[:, None], excess, excess)
    tangent += np.einsum("e,emia,emjb->eiajb", body.elements.lame, dilate, dilate)
    return forces(body, u), tangent.reshape(-1, 18, 18)


def condense_centres(body: FiniteBody, u: Array, pressure: Array) -> tuple[Array, Array]:
    """Return the forces (e, 16) and tangents (e, 16, 16) of the elements' outer nodes, their centres being free."""
    force, tangent = forces_and_tangents(body, u, pressure)
    compliance = np.linalg.inv(tangent[:, 16:, 16:])
    coupling = tangent[:, :16, 16:] @ compliance
    force = force[:, :16] - (coupling @ force[:, 16:, None])[:, :, 0]
    return force, tangent[:, :16, :16] - coupling @ tangent[:, 16:, :16]


def system(body: FiniteBody, u: Array, pressure: Array) -> tuple[Array, Array]:
    """Return the internal forces (n,) and the tangent (n, n) with the elements' centres eliminated."""
    force, tangent = condense_centres(body, u, pressure)
    all_forces, stiffness = np.zeros(body.size + 1), np.zeros((body.size + 1, body.size + 1))
    unknown = body.elements.unknown.reshape(-1, 16)  # fixed unknowns, -1, go to the last place and are cut off
    np.add.at(all_forces, unknown, force)
    np.add.at(stiffness, (unknown[:, :, None], unknown[:, None, :]), tangent)
    return all_forces[:-1], stiffness[:-1, :-1]


def condense_to_skin(force: Array, tangent: Array, skin: int) -> tuple[Array, Array]:
    """Return forces (m,) and stiffness (m, m) of the last `skin` = m unknowns, the others being free to move."""
    inner = len(force) - skin
    coupling = np.concatenate([tangent[:inner, inner:], force[:inner, None]], axis=1)
    follow: Array = np.linalg.solve(tangent[:inner, :inner], coupling).astype(np.float64)
    reduction = tangent[inner:, :inner] @ follow
    return force[inner:] - reduction[:, -1], tangent[inner:, inner:] - reduction[:, :-1]


def tributary(x: Array) -> Array:
    """Return the length of skin each node stands for (k,): Simpson's rule on edges of three nodes."""
    out = np.zeros(len(x))
    slopes = np.array([[-1.5, 2.0, -0.5], [-0.5, 0.0, 0.5], [0.5, -2.0, 1.5]])
    for start in range(0, len(x) - 2, 2):
        out[start : start + 3] += np.array([1.0, 4.0, 1.0]) / 3.0 * (slopes @ x[start : start + 3])
    return out


def update_contact_states(
    state: Indices,
    sense: Indices,
    reaction: Array,
    above: Array,
    slip: Array,
    length: Array,
    law: FrictionLaw,
    direction: int,
) -> tuple[Indices, Indices]:
    """Return states and senses (k,) as `solver.contact` asks for them, for the forces and places of a solution.

    Arguments as those of the loop `contradictions`.
    """
    slack, small = 1e-12 * np.abs(reaction[:, 1]).max(initial=0.0), 1e-13 * np.abs(above).max(initial=0.0)
    drag, push = reaction.T
    length = np.maximum(length, 0.0)  # skin that hangs over has no limit
    is_open, stuck, slips = state == OPEN, state == STICK, state >= SLIP
    coulomb, bound, limit = law.mu * np.maximum(push, 0.0), law.bound(length), law.limit(push, length)
    at_bound = (bound < coulomb - slack) | ((state == SHEAR_LIMITED) & (bound <= coulomb + slack))
    new_state, new_sense = np.where(at_bound, SHEAR_LIMITED, SLIP), sense.copy()
    if direction == 0:
        over = np.abs(drag) > limit + slack
        new_sense = np.where(stuck & over & (push >= -slack), np.where(drag > 0.0, 1, -1), sense)
        new_state = np.where(stuck, np.where(over, np.where(bound < coulomb, SHEAR_LIMITED, SLIP), STICK), new_state)
        new_state = np.where(slips & (slip * sense > small) & (limit > 0.0), STICK, new_state)
        entering = SLIP if frictionless(law) else STICK
    else:
        new_sense = np.where(is_open | (push < -slack), sense, direction)
        entering = SHEAR_LIMITED if law.mu > SHEAR_LIMITED_MU and law.tau_max < np.inf else SLIP
        new_sense = np.where(is_open & (above < -small), direction, new_sense)
    new_state = np.where(push < -slack, OPEN, new_state)
    new_state = np.where(is_open, np.where(above < -small, entering, OPEN), new_state)
    return new_state, new_sense
