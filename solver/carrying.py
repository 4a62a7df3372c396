"""A state carried from one mesh of a finger to another, where Newton starts a few iterations from its end."""

from dataclasses import dataclass

import numpy as np

from solver import kernels
from solver.elements import Q2P1
from solver.finite_body import VALUES, FiniteBody
from solver.mesh import Array, Indices
from solver.mesher import FingerMesh, with_middles
from solver.newton import Shape


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where a mesh of a finger has its nodes and quadrature points: arc positions [mm], and heights over the bone.

    Heights are 0 on the bone, 1 between fat and skin, 2 on the outside.
    """

    body: FiniteBody
    arcs: Array  # (2 a + 1,) of the nodes along the skin
    heights: Array  # (2 b + 1,) of the nodes across the tissue
    inner_arcs: Array  # (a, 3) of the quadrature points
    inner_heights: Array  # (b, 3)
    points: Array  # (e, 9, 2) quadrature points [mm]
    skin: Array  # (k,) arc positions of the skin that may touch
    lengths: Array  # (k,) skin that each stands for, along the arc [mm]

    @staticmethod
    def of(finger: FingerMesh, body: FiniteBody) -> "Places":
        """Return the places of a mesh."""
        arcs, heights = with_middles(finger.arcs), _heights(finger)
        skin = arcs[np.searchsorted(finger.whole, finger.mesh.skin)]
        lengths = np.empty(len(skin))
        kernels.tributary(skin, body.middle, lengths)
        points = VALUES @ finger.mesh.nodes[finger.mesh.elements]
        return Places(body, arcs, heights, _inner(arcs[::2]), _inner(heights[::2]), points, skin, lengths)


def carried(shape: Shape, old: Places, new: Places) -> Shape:
    """Return `shape`, found on the mesh of `old`, as a start on that of `new`, a mesh of the same finger.

    The states of skin nodes follow from interpolated pressures.
    """
    u, pressure = carried_fields(shape, old, new)
    traction = np.where(shape.touching[:, None], shape.reaction / old.lengths[:, None], 0.0)
    reaction = np.stack([np.interp(new.skin, old.skin, traction[:, a], 0.0, 0.0) for a in (0, 1)], axis=1)
    nearest = np.abs(new.skin[:, None] - old.skin).argmin(axis=1)
    touching = np.interp(new.skin, old.skin, shape.touching.astype(float)) > 0.5
    state = np.where(touching, np.maximum(shape.state[nearest], kernels.SLIP), kernels.OPEN).astype(np.int32)
    sense = shape.sense[nearest].copy()
    return Shape(u, pressure, state, sense, reaction * new.lengths[:, None], shape.pull, shape.iterations)


def carried_fields(shape: Shape, old: Places, new: Places) -> tuple[Array, Array]:
    """Return displacements (nodes, 2) [mm] and pressure modes (e, 3) of `shape` on the mesh of `new`.

    Displacements are interpolated by the elements' own functions in arc position and height, so a mesh carries its
    state to itself unchanged. Pressures are those of the elements they come from: what interpolated displacements
    change in volume, small as it is, a stiff body would answer strongly.
    """
    along, across = _interpolation(old.arcs, new.arcs), _interpolation(old.heights, new.heights)
    grid = shape.u.reshape(len(old.arcs), len(old.heights), 2)
    lines = (along @ grid.reshape(len(grid), -1)).reshape(len(along), -1, 2)
    u = (across @ lines).reshape(-1, 2)
    u[new.body.mesh.held] = 0.0

    station = _piece(old.arcs[::2], new.inner_arcs)  # (a, 3)
    layer = _piece(old.heights[::2], new.inner_heights)  # (b, 3)
    host = (station[:, None, :, None] * (len(old.heights) // 2) + layer[None, :, None, :]).reshape(-1, 9)
    # each element's pressure is c + cx x + cy y
    slopes = (shape.pressure[:, None] @ old.body.combination)[:, 0]
    start = slopes[:, 0] - slopes[:, 1] * old.body.centre[:, 0] - slopes[:, 2] * old.body.centre[:, 1]
    field = start[host] + slopes[host, 1] * new.points[..., 0] + slopes[host, 2] * new.points[..., 1]
    return u, ((new.body.weight * field)[:, None] @ new.body.modes)[:, 0]


def _inner(lines: Array) -> Array:
    """Return the three quadrature points (n, 3) between each two of `lines` (n + 1,)."""
    return lines[:-1, None] + np.diff(lines)[:, None] * (1.0 + Q2P1.points[:3, 0]) / 2.0


def _heights(finger: FingerMesh) -> Array:
    """Return where the nodes of a column lie: 0 on the bone, 1 between fat and skin, 2 on the outside."""
    wide = 2 * (finger.fat + len(finger.depths) - 1) + 1
    fat = finger.mesh.nodes[: 2 * finger.fat + 1]
    way = np.linalg.norm(fat - fat[0], axis=1)
    outer = 2.0 - with_middles(finger.depths) / finger.depths[0]
    out = np.concatenate([way / way[-1], outer[1:]])
    assert len(out) == wide
    return out


def _piece(ends: Array, points: Array) -> Indices:
    """Return which gap between `ends` (n + 1,) each of `points` lies in."""
    return np.searchsorted(ends[1:-1], points, side="right")


def _interpolation(nodes: Array, points: Array) -> Array:
    """Return the matrix (p, n) that takes values at `nodes` (n,) of quadratic lines to `points` (p,)."""
    ends = nodes[::2]
    piece = _piece(ends, points)
    local = 2.0 * (points - ends[piece]) / (ends[piece + 1] - ends[piece]) - 1.0
    out = np.zeros((len(points), len(nodes)))
    row, first = np.arange(len(points)), 2 * piece
    out[row, first] = local * (local - 1.0) / 2.0
    out[row, first + 1] = 1.0 - local * local
    out[row, first + 2] = local * (local + 1.0) / 2.0
    return out
