"""A state carried from a coarse mesh of a finger to a finer one, where Newton starts a few iterations from its end."""

import numpy as np

from solver import kernels
from solver.elements import Q2P1, line
from solver.finite_body import VALUES, FiniteBody
from solver.mesh import Array
from solver.mesher import FingerMesh, with_middles
from solver.newton import Shape


def carried(shape: Shape, coarse: FingerMesh, coarse_body: FiniteBody, fine: FingerMesh, body: FiniteBody) -> Shape:
    """Return `shape`, found on `coarse`, as a start on `body`, made of `fine`, a mesh of the same finger.

    Displacements are interpolated by the elements' own functions in arc position and height over the bone, so a mesh
    carries its state to itself unchanged. The states of skin nodes follow from interpolated pressures.
    """
    along = _interpolation(with_middles(coarse.arcs), with_middles(fine.arcs))
    across = _interpolation(_heights(coarse), _heights(fine))
    grid = shape.u.reshape(along.shape[1], across.shape[1], 2)
    lines = (along @ grid.reshape(len(grid), -1)).reshape(len(along), -1, 2)
    u = (across @ lines).reshape(-1, 2)
    u[body.mesh.held] = 0.0

    skins = [np.searchsorted(mesh.whole, mesh.mesh.skin) for mesh in (coarse, fine)]
    places = [with_middles(mesh.arcs)[skin] for mesh, skin in zip((coarse, fine), skins, strict=True)]
    lengths = [np.empty(len(place)) for place in places]
    for place, length in zip(places, lengths, strict=True):
        kernels.tributary(place, (np.arange(len(place)) % 2).astype(np.int32), length)
    traction = np.where(shape.touching[:, None], shape.reaction / lengths[0][:, None], 0.0)
    reaction = np.stack([np.interp(places[1], places[0], traction[:, a], 0.0, 0.0) for a in (0, 1)], axis=1)
    nearest = np.abs(places[1][:, None] - places[0]).argmin(axis=1)
    touching = np.interp(places[1], places[0], shape.touching.astype(float)) > 0.5
    state = np.where(touching, np.maximum(shape.state[nearest], kernels.SLIP), kernels.OPEN)
    return Shape(
        u,
        _pressure(shape.pressure, coarse, coarse_body, fine, body),
        state.astype(np.int32),
        shape.sense[nearest].copy(),
        reaction * lengths[1][:, None],
        shape.pull,
        shape.iterations,
    )


def _pressure(
    pressure: Array, coarse: FingerMesh, coarse_body: FiniteBody, fine: FingerMesh, body: FiniteBody
) -> Array:
    """Return the pressure modes (e, 3) of `body` that fit the field of `pressure` on `coarse_body` best.

    Carried displacements would not do: what they change in volume, small as it is, a stiff body answers strongly.
    """
    arcs, heights = _gauss(fine.arcs), _gauss(_heights(fine)[::2])
    station = np.clip(np.searchsorted(coarse.arcs, arcs) - 1, 0, len(coarse.arcs) - 2)  # (a, 3)
    lines = _heights(coarse)[::2]
    layer = np.clip(np.searchsorted(lines, heights) - 1, 0, len(lines) - 2)  # (b, 3)
    host = (station[:, None, :, None] * (len(lines) - 1) + layer[None, :, None, :]).reshape(-1, 9)
    place = VALUES @ body.mesh.nodes[body.mesh.elements] - coarse_body.centre[host]  # (e, q, 2)
    slope = (pressure[:, None] @ coarse_body.combination)[:, 0][host]  # (e, q, 3)
    field = slope[..., 0] + slope[..., 1] * place[..., 0] + slope[..., 2] * place[..., 1]
    return ((body.weight * field)[:, None] @ body.modes)[:, 0]


def _gauss(lines: Array) -> Array:
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


def _interpolation(nodes: Array, points: Array) -> Array:
    """Return the matrix (p, n) that takes values at `nodes` (n,) of quadratic lines to `points` (p,)."""
    ends = nodes[::2]
    piece = np.clip(np.searchsorted(ends, points, side="right") - 1, 0, len(ends) - 2)
    local = 2.0 * (points - ends[piece]) / (ends[piece + 1] - ends[piece]) - 1.0
    out = np.zeros((len(points), len(nodes)))
    np.put_along_axis(out, 2 * piece[:, None] + np.arange(3), line(local)[0], axis=1)
    return out
