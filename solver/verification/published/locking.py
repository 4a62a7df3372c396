"""Thick cylinder (MacNeal and Harder 1985, Finite Elem. Anal. Des. 1, 3) and Cook's membrane: no locking at any nu."""

import numpy as np

from solver.arrays import Array, Indices
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import Hooke
from solver.mesh import Q2P1, Mesh
from solver.verification.published.bodies import distort, membrane, ring, stress

INNER, OUTER, YOUNG = 3.0, 9.0, 1000.0  # radii [mm] and modulus [MPa] of the cylinder, under an inner pressure of 1 MPa
_SHARE = INNER**2 / (OUTER**2 - INNER**2)
_POINTS = np.array([[0.31, -0.57], [-0.77, 0.11], [0.43, 0.83]])  # local points where stresses are compared


def widening(nu: float) -> float:
    """Return u(a) = (1 + nu)/E [(1 - 2 nu) A a + A b^2/a], A = p a^2/(b^2 - a^2) [mm].

    >>> round(widening(0.49), 9)
    0.005039925
    """
    return (1 + nu) / YOUNG * ((1 - 2 * nu) * _SHARE * INNER + _SHARE * OUTER**2 / INNER)


def hole_displacement(nu: float, radial: int, around: int) -> float:
    """Return the computed displacement of the hole, mean over corner nodes [mm]."""
    mesh, hole = ring(INNER, OUTER, radial, around)
    _, displacement, _ = _widen(mesh, hole, nu)
    return float(np.sum(displacement[hole] * mesh.nodes[hole], axis=1)[:-1:2].mean() / INNER)


def _widen(mesh: Mesh, hole: Indices, nu: float) -> tuple[LinearBody, Array, Array]:
    """Return the body, its displacements and its loads (nodes, 2) under the inner pressure."""
    loads = edge_load(mesh, hole, mesh.nodes[hole] / INNER)
    body = LinearBody.of(mesh, [Hooke(YOUNG, nu)], loads, free=("x", "y", "turn"))
    return body, body.displacement(body.condensed.free_displacement()), loads


def cylinder_errors(nu: float, radial: int) -> tuple[float, float, float]:
    """Return the errors of displacement, stress (both root mean squares) and energy on distorted elements.

    They are relative to the hole's widening, the inner pressure and the energy. The closed form of the stress is
    A (1 - b^2/r^2) along the radius and A (1 + b^2/r^2) across it, with A = p a^2/(b^2 - a^2).
    """
    mesh, hole = ring(INNER, OUTER, radial, 4 * radial)
    mesh = distort(mesh, 0.2, 5)
    body, displacement, loads = _widen(mesh, hole, nu)
    x, y = mesh.nodes.T
    growth = (1 + nu) / YOUNG * ((1 - 2 * nu) * _SHARE + _SHARE * OUTER**2 / (x * x + y * y))
    exact = growth[:, None] * mesh.nodes
    error = (displacement - exact).ravel()
    ones, zeros = np.ones_like(x), np.zeros_like(x)
    rigid = np.stack([np.stack(m, axis=1).ravel() for m in ((ones, zeros), (zeros, ones), (-y, x))], axis=1)
    motion = np.asarray(np.linalg.lstsq(rigid, error, rcond=None)[0], np.float64)
    error = np.asarray(error - rigid @ motion, np.float64)
    element = np.repeat(np.arange(len(mesh.elements)), len(_POINTS))
    local: Array = np.tile(_POINTS, (len(mesh.elements), 1))
    at = (Q2P1.shape(local)[0][:, None] @ mesh.nodes[mesh.elements[element]])[:, 0]
    r2 = np.sum(at * at, axis=1)[:, None, None]
    across: Array = np.eye(2) - 2 * at[:, :, None] * at[:, None] / r2  # +1 across the radius, -1 along it
    closed_form: Array = _SHARE * (np.eye(2) + across * (OUTER**2 / r2))
    misfit: Array = stress(body, displacement, element, local) - closed_form
    energy = 0.5 * float(np.sum(loads * displacement))
    true = 0.5 * 2 * np.pi * INNER * widening(nu)
    return (
        float(np.sqrt(np.mean(error**2))) / widening(nu),
        float(np.sqrt(np.mean(misfit**2))),
        abs(energy / true - 1),
    )


def cook(young: float, nu: float, force: float, count: int) -> tuple[float, float]:
    """Return the rise of the right edge of Cook's membrane at its middle and upper end [mm].

    `force` [N/mm] is distributed evenly over the right edge, and each side has `count` elements.
    """
    mesh = membrane(count, count)
    loads = edge_load(mesh, mesh.skin, np.tile([0.0, force / 16.0], (len(mesh.skin), 1)))
    rise = LinearBody.of(mesh, [Hooke(young, nu)], loads).condensed.free_displacement()[:, 1]
    return float(rise[len(rise) // 2]), float(rise[-1])
