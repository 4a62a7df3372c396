"""Bodies of the published problems, as quadrilaterals in one mesh, with the stress inside and zones of their skin."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Indices
from solver.body import Probes
from solver.body.linear import LinearBody
from solver.contact import OPEN, SLIP, last_edge
from solver.equilibrium import Newton
from solver.mesh import Q2P1, Mesh, grid_mesh, local_coordinates, with_middles

_NONE: Indices = np.zeros(0, np.int64)


def grade(finest: float, growth: float, zone: float, end: float) -> Array:
    """Return lines from 0 to `end`, `finest` apart up to `zone` and increasingly far apart beyond."""
    steps = [0.0]
    while steps[-1] < end:
        steps.append(steps[-1] + max(finest, finest + growth * (steps[-1] - zone)))
    return np.array(steps) * end / steps[-1]


def mirror(lines: Array) -> Array:
    """Return the lines from 0 up and their mirror images below 0."""
    return np.concatenate([-lines[:0:-1], lines])


def join(grids: Sequence[Array]) -> Mesh:
    """Return the mesh of several grids of points (2 a + 1, 2 b + 1, 2), with nodes at one position merged.

    No node is held and none may touch.
    """
    clockwise = [g if _clockwise(g) else g[::-1] for g in grids]
    meshes = [grid_mesh(g, np.zeros(len(g[0]) // 2, np.int64), slice(0, 1), _NONE) for g in clockwise]
    nodes = np.concatenate([m.nodes for m in meshes])
    starts = np.cumsum([0, *(len(m.nodes) for m in meshes[:-1])])
    elements = np.concatenate([m.elements + s for m, s in zip(meshes, starts, strict=True)])
    _, first, place = np.unique(np.round(nodes, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    elements = place.ravel()[elements]
    return Mesh(nodes[first], elements, np.zeros(len(elements), np.int64), _NONE, _NONE)


def chain(on: NDArray[np.bool_], along: Array) -> Indices:
    """Return the nodes where `on` is true, sorted by `along`."""
    nodes = np.flatnonzero(on)
    return nodes[np.argsort(along[nodes])]


def ring(inner: float, outer: float, radial: int, around: int) -> tuple[Mesh, Indices]:
    """Return a free thick cylinder, and the nodes of its hole in order; its skin is one outer edge."""
    r = with_middles(np.geomspace(inner, outer, radial + 1))
    turn = np.linspace(-np.pi, np.pi, 2 * around + 1)
    mesh = join([np.stack([r * np.cos(turn)[:, None], r * np.sin(turn)[:, None]], axis=-1)])
    x, y = mesh.nodes.T
    radius = np.hypot(x, y)
    angle = np.asarray(np.round(np.arctan2(y, x), 9) % round(2 * np.pi, 9), np.float64)
    hole = chain(np.isclose(radius, inner), angle)
    outside = chain(np.isclose(radius, outer), angle)
    return replace(mesh, skin=outside[:3]), np.append(hole, hole[0])


def membrane(across: int, up: int) -> Mesh:
    """Return Cook's membrane (0,0) (48,44) (48,60) (0,44), its left edge held and its right edge as the skin."""
    x, part = with_middles(np.linspace(0, 48, across + 1)), with_middles(np.linspace(0, 1, up + 1))
    low, high = 44 * x / 48, 44 + 16 * x / 48
    points = np.empty((len(x), len(part), 2))
    points[..., 0] = x[:, None]
    points[..., 1] = high[:, None] + (low - high)[:, None] * part  # from the upper edge downwards
    mesh = join([points])
    left = np.flatnonzero(np.isclose(mesh.nodes[:, 0], 0.0))
    right = chain(np.isclose(mesh.nodes[:, 0], 48.0), mesh.nodes[:, 1])
    return replace(mesh, held=left, skin=right)


def mound(x_lines: Array, y_lines: Array, radius: float, zone: float) -> Mesh:
    """Return a block with an underside of x^2 / (2 radius), the parabola of Hertz's theory; its top is held.

    It may touch where |x| is below `zone`.
    """
    x, y = with_middles(x_lines), with_middles(y_lines)[::-1]
    part = y / y[0]
    points = np.empty((len(x), len(y), 2))
    points[..., 0] = x[:, None]
    points[..., 1] = (x**2 / (2 * radius))[:, None] * (1 - part) + y[0] * part
    corners = np.flatnonzero(np.abs(x_lines) < zone)
    skin = slice(2 * int(corners[0]), 2 * int(corners[-1]) + 1)
    return grid_mesh(points, np.zeros(len(y_lines) - 1, np.int64), skin, np.arange(len(x)) * len(y))


def disc(radius: float, finest: float, zone: float) -> Mesh:
    """Return a whole cylinder on the surface, with a fine mesh below and above; its skin is the lower quarter."""
    fine = mirror(grade(finest, 0.3, zone, radius * np.pi / 4)) / radius  # angles from the lowest point
    coarse = np.linspace(-np.pi / 4, np.pi / 4, 13)
    out = 1 - grade(finest, 0.3, 0.0, 0.45 * radius)[::-1] / radius  # radii relative to the outer one
    half = 0.4 * radius

    def quarter(angles: Array, turn: float) -> Array:
        angle = with_middles(angles)
        square = half * np.stack([np.tan(angle), -np.ones_like(angle)], axis=-1)
        circle = radius * np.stack([np.sin(angle), -np.cos(angle)], axis=-1)
        level = (with_middles(out) - out[0]) / (1 - out[0])
        points = square[:, None] + (circle - square)[:, None] * level[:, None]
        c, s = np.cos(turn), np.sin(turn)
        return points[::-1] @ np.array([[c, s], [-s, c]])

    x, y = half * np.tan(with_middles(fine)), half * np.tan(with_middles(coarse))
    core = np.stack(np.meshgrid(x, y[::-1], indexing="ij"), axis=-1)
    quarters = [quarter(fine if n % 2 == 0 else coarse, n * np.pi / 2) for n in range(4)]
    mesh = join([core, *quarters])
    nodes = mesh.nodes + np.array([0.0, radius])
    on = np.isclose(np.hypot(*mesh.nodes.T), radius)
    low = on & (mesh.nodes[:, 1] < -radius * np.cos(np.pi / 4) + 1e-9)
    return replace(mesh, nodes=nodes, skin=chain(low, nodes[:, 0]))


def _clockwise(grid: Array) -> bool:
    first, second = grid[1, 0] - grid[0, 0], grid[0, 1] - grid[0, 0]
    return bool(first[0] * second[1] - first[1] * second[0] < 0)


def distort(mesh: Mesh, by: float, seed: int, still: Indices | None = None) -> Mesh:
    """Return the mesh with inner corners of elements moved at random by up to `by` of their shortest edge.

    Corners on the boundary, between layers, held, on the skin or in `still` stay, so that the body does not change.
    Other nodes follow the corners. Corners that would fold an element move less.
    """
    corners, middles = mesh.elements[:, :4], mesh.elements[:, 4:8]
    sides = np.stack([corners, np.roll(corners, -1, axis=1)])  # two ends of every side
    length = np.linalg.norm(mesh.nodes[sides[0]] - mesh.nodes[sides[1]], axis=2)
    shortest = np.full(len(mesh.nodes), np.inf)
    least, most = np.full(len(mesh.nodes), len(mesh.nodes)), np.full(len(mesh.nodes), -1)  # region
    for ends in sides:
        np.minimum.at(shortest, ends, length)
        np.minimum.at(least, ends, mesh.region[:, None])
        np.maximum.at(most, ends, mesh.region[:, None])
    free = least == most
    once = np.bincount(middles.ravel(), minlength=len(free))[middles] == 1  # sides of the boundary
    free[sides[:, once]] = free[mesh.held] = free[mesh.skin] = False
    free[[] if still is None else still] = False
    shift = np.zeros(mesh.nodes.shape)
    rng = np.random.default_rng(seed)
    shift[free] = rng.uniform(-1, 1, (int(free.sum()), 2)) * by / np.sqrt(2) * shortest[free, None]
    while True:
        nodes = mesh.nodes + shift
        nodes[middles] = mesh.nodes[middles] + shift[sides].sum(axis=0) / 2
        nodes[mesh.elements[:, 8]] = mesh.nodes[mesh.elements[:, 8]] + shift[corners].sum(axis=1) / 4
        det = np.linalg.det(np.swapaxes(nodes[mesh.elements], 1, 2)[:, None] @ Q2P1.shape(Q2P1.corners)[1])
        folds = det.min(axis=1) < 0.02 * det.max(axis=1)
        if not folds.any():
            return replace(mesh, nodes=nodes)
        shift[np.unique(corners[folds])] *= 0.8


def locate(mesh: Mesh, points: Array) -> tuple[Indices, Array]:
    """Return the element that contains each of the `points` (p, 2), and the point's local coordinates there."""
    centres = mesh.nodes[mesh.elements[:, 8]]
    near = np.argsort(np.sum((points[:, None] - centres) ** 2, axis=2), axis=1)[:, :24]
    corners = mesh.nodes[mesh.elements[near.ravel()]]
    local = local_coordinates(corners, np.repeat(points, near.shape[1], axis=0), np.zeros((near.size, 2)))
    outside = np.abs(local).max(axis=1).reshape(near.shape)
    best = np.argmin(np.where(np.isfinite(outside), outside, np.inf), axis=1)
    rows = np.arange(len(points))
    return near[rows, best], local.reshape(*near.shape, 2)[rows, best]


def stress(body: LinearBody, displacement: Array, element: Indices, local: Array) -> Array:
    """Return the in-plane stress (p, 2, 2) [MPa] at `local` coordinates (p, 2) of `element` (p,)."""
    mesh, elastic = body.mesh, body.elastic
    probes = Probes.at(mesh, elastic.centre, element, local)
    strain = probes.displacement_gradient(mesh, displacement)
    at = elastic.state(elastic.probe_data(probes), displacement)
    pressure = (at.lame * at.dilatation)[:, None, None] * np.eye(2)
    return at.shear[:, None, None] * (strain + np.swapaxes(strain, 1, 2)) + pressure


def touching_within(newton: Newton, half_width: float) -> Indices:
    """Return initial states: nodes with |x| below `half_width` slip, all others are open."""
    return np.where(np.abs(newton.skin_x) < half_width, SLIP, OPEN)


def half_width(x: Array, force: Array, inside: NDArray[np.bool_]) -> float:
    """Return the half-width of the zone of nodes `inside` (k,), at whose ends `force` (k,) falls like a contact force.

    Returns nan where the zone is too short.
    """
    high, low = last_edge(x, force, inside), last_edge(-x[::-1], force[::-1], inside[::-1])
    return float("nan") if high is None or low is None else (high + low) / 2.0


def half_above(x: Array, value: Array) -> float:
    """Return the half-width of the zone of `value` (k,) above 0, interpolated between nodes; 0 without such a zone.

    >>> half_above(np.array([-2.0, -1.0, 0.0, 1.0, 2.0]), np.array([-1.0, -0.5, 0.5, -1.5, -2.0]))
    0.375
    """
    above = np.flatnonzero(value > 0.0)
    if not len(above):
        return 0.0
    first, last = int(above[0]), int(above[-1])
    low = np.interp(0.0, value[first - 1 : first + 1], x[first - 1 : first + 1])
    high = np.interp(0.0, value[last : last + 2][::-1], x[last : last + 2][::-1])
    return float(high - low) / 2.0
