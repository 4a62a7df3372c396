# ruff: noqa: N803, N806 - the letters of the literature
"""Finite strain in plain NumPy: the judge of the compiled loops."""

from typing import cast

import numpy as np

from solver._kernels.contact_system import STEEP
from solver.arrays import Array, Flags, Indices
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


def _turned(H: Array) -> tuple[Array, Array]:
    """Return the transposed inverse of F = 1 + H and what F exceeds it by (e, 9, 2, 2), that to its own digits."""
    grown = (H[..., 0, 0] + H[..., 1, 1] + np.linalg.det(H))[..., None, None]
    across = np.stack([H[..., 1, 1], -H[..., 1, 0], -H[..., 0, 1], H[..., 0, 0]], axis=-1).reshape(H.shape)
    F = np.eye(2) + H
    return (np.eye(2) + across) / (1.0 + grown), (H - across + grown * F) / (1.0 + grown)


def _logarithm(body: FiniteBody, H: Array) -> tuple[Array, Array]:
    """Return ln J (e, 9) and its modes (e, 3) for F = 1 + H."""
    grown = H[..., 0, 0] + H[..., 1, 1] + (H[..., 0, 0] * H[..., 1, 1] - H[..., 0, 1] * H[..., 1, 0])
    log = _log1p(grown)
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
    return _stored(body, _gradient(body, u)).real


def _stored(body: FiniteBody, H: Array) -> complex:
    log, volume = _logarithm(body, H)
    grown = shape(body.elements.stiffening[:, None], _excess(H, log))
    return complex(
        np.sum(body.elements.weight * body.elements.shear[:, None] / 2.0 * grown)
        + np.sum(body.elements.lame / 2.0 * (volume**2).T)
    )


def forces(body: FiniteBody, u: Array) -> Array:
    """Return the internal forces (e, 18) of the elements, ordered x, y, x, y, ..."""
    H = _gradient(body, u)
    log, volume = _logarithm(body, H)
    inverse, exceeds = _turned(H)
    G = body.elements.shear[:, None] * slopes(body.elements.stiffening[:, None], _excess(H, log))[0]
    pressure = body.elements.lame[:, None] * (body.elements.modes @ volume[:, :, None])[:, :, 0]
    stress = body.elements.weight[:, :, None, None] * (
        G[:, :, None, None] * exceeds + pressure[:, :, None, None] * inverse
    )
    gradient = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1).reshape(len(H), 9, 9, 2)
    return (gradient @ np.swapaxes(stress, -1, -2)).sum(axis=1).reshape(len(H), 18)


def forces_and_tangents(body: FiniteBody, u: Array, pressure: Array) -> tuple[Array, Array]:
    """Return the internal forces (e, 18) and tangents (e, 18, 18) of the elements, ordered x, y, x, y, ...

    `pressure` (e, 3) is what the geometric part of the tangent sees; the forces follow from `u` alone.
    """
    H = _gradient(body, u)
    log, _ = _logarithm(body, H)
    inverse, exceeds = _turned(H)
    gradient = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1)
    w = body.elements.weight
    grown, growth = slopes(body.elements.stiffening[:, None], _excess(H, log))
    G = body.elements.shear[:, None] * grown
    spatial = np.einsum("eqaA,eqiA->eqia", inverse, gradient)  # gradients in the deformed body
    dilate = np.einsum("eq,eqm,eqia->emia", w, body.elements.modes, spatial)
    excess = np.einsum("eqaA,eqiA->eqia", exceeds, gradient)
    geometric = w * (G - np.einsum("eqm,em->eq", body.elements.modes, pressure))
    tangent = np.einsum("eq,eqiA,eqjA,ab->eiajb", w * G, gradient, gradient, np.eye(2))
    tangent += np.einsum("eq,eqja,eqib->eiajb", geometric, spatial, spatial)
    tangent += np.einsum("eq,eqia,eqjb->eiajb", 2.0 * growth * w * body.elements.shear[:, None], excess, excess)
    tangent += np.einsum("e,emia,emjb->eiajb", body.elements.lame, dilate, dilate)
    return forces(body, u), tangent.reshape(-1, 18, 18)


def without_centres(body: FiniteBody, u: Array, pressure: Array) -> tuple[Array, Array]:
    """Return the forces (e, 16) and tangents (e, 16, 16) of the elements' outer nodes, their centres being free."""
    force, tangent = forces_and_tangents(body, u, pressure)
    inside = np.linalg.inv(tangent[:, 16:, 16:])
    across = tangent[:, :16, 16:] @ inside
    force = force[:, :16] - (across @ force[:, 16:, None])[:, :, 0]
    return force, tangent[:, :16, :16] - across @ tangent[:, 16:, :16]


def system(body: FiniteBody, u: Array, pressure: Array) -> tuple[Array, Array]:
    """Return the internal forces (n,) and the tangent (n, n) with the elements' centres eliminated."""
    force, tangent = without_centres(body, u, pressure)
    out, whole = np.zeros(body.size + 1), np.zeros((body.size + 1, body.size + 1))
    at = body.elements.unknown.reshape(-1, 16)  # fixed unknowns, -1, go to the last place and are cut off
    np.add.at(out, at, force)
    np.add.at(whole, (at[:, :, None], at[:, None, :]), tangent)
    return out[:-1], whole[:-1, :-1]


def reduced(force: Array, tangent: Array, skin: int) -> tuple[Array, Array]:
    """Return forces (m,) and stiffness (m, m) of the last `skin` = m unknowns, the others being free to move."""
    inside = len(force) - skin
    both = np.concatenate([tangent[:inside, inside:], force[:inside, None]], axis=1)
    follow: Array = np.linalg.solve(tangent[:inside, :inside], both).astype(np.float64)
    left = tangent[inside:, :inside] @ follow
    return force[inside:] - left[:, -1], tangent[inside:, inside:] - left[:, :-1]


def tributary(x: Array) -> Array:
    """Return the length of skin each node stands for (k,): Simpson's rule on edges of three nodes."""
    out = np.zeros(len(x))
    slopes = np.array([[-1.5, 2.0, -0.5], [-0.5, 0.0, 0.5], [0.5, -2.0, 1.5]])
    for start in range(0, len(x) - 2, 2):
        out[start : start + 3] += np.array([1.0, 4.0, 1.0]) / 3.0 * (slopes @ x[start : start + 3])
    return out


def rubbed(x: Array, touching: Flags, mu: float) -> Array:
    """Return the length of skin on which a bound acts that each node stands for (k,).

    Where friction is steep, without edges whose middle does not touch, but for nodes beside no other.
    """
    if mu <= STEEP:
        return tributary(x)
    out = np.zeros(len(x))
    beside = np.r_[False, touching, False]
    alone = ~beside[:-2] & ~beside[2:]
    alone[1::2] = True
    for start in range(0, len(x) - 2, 2):
        edge = slice(start, start + 3)
        out[edge] += np.where(touching[start + 1] | alone[edge], tributary(x[edge]), 0.0)
    return out


def restated(
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
    was_open, stuck, slips = state == OPEN, state == STICK, state >= SLIP
    coulomb, bound, most = law.mu * np.maximum(push, 0.0), law.bound(length), law.limit(push, length)
    at_bound = (bound < coulomb - slack) | ((state == SHEAR_LIMITED) & (bound <= coulomb + slack))
    now, turned = np.where(at_bound, SHEAR_LIMITED, SLIP), sense.copy()
    if direction == 0:
        over = np.abs(drag) > most + slack
        turned = np.where(stuck & over & (push >= -slack), np.where(drag > 0.0, 1, -1), sense)
        now = np.where(stuck, np.where(over, np.where(bound < coulomb, SHEAR_LIMITED, SLIP), STICK), now)
        now = np.where(slips & (slip * sense > small) & (most > 0.0), STICK, now)
        entering = SLIP if frictionless(law) else STICK
    else:
        turned = np.where(was_open | (push < -slack), sense, direction)
        entering = SHEAR_LIMITED if law.mu > STEEP and law.tau_max < np.inf else SLIP
        turned = np.where(was_open & (above < -small), direction, turned)
    now = np.where(push < -slack, OPEN, now)
    now = np.where(was_open, np.where(above < -small, entering, OPEN), now)
    return now, turned
