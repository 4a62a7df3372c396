"""A state carried from one mesh of a finger to another, where Newton starts a few iterations from its end."""

from dataclasses import dataclass

import numpy as np

from solver._kernels import skin as skin_loops
from solver._kernels.compiling import SLIP, STICK
from solver.arrays import Array, Flags, Indices
from solver.body.finite import VALUES, FiniteBody
from solver.element import Q2P1
from solver.equilibrium.newton import EquilibriumState
from solver.mesh.mesher import FingerMesh, with_middles


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
        skin = finger.skin_arcs
        lengths = np.empty(len(skin))
        skin_loops.tributary(skin, body.middle, lengths)
        points = VALUES @ finger.mesh.nodes[finger.mesh.elements]
        return Places(body, arcs, heights, _inner(arcs[::2]), _inner(heights[::2]), points, skin, lengths)


@dataclass(frozen=True, slots=True, eq=False)
class MeshTransfer:
    """The way from one mesh to another of the same finger: what depends on where their lines lie, made once."""

    old: Places
    new: Places
    along: Indices  # (2 a + 1,) first of the three old lines that a new line takes its values from
    along_parts: Array  # (2 a + 1, 3) its part of each
    across: Indices  # (2 b + 1,) the same of rows
    across_parts: Array  # (2 b + 1, 3)
    station: Indices  # (a, 3) old elements along the skin that hold the new quadrature points
    layer: Indices  # (b, 3) and across it
    forces: Array  # (k, old k) the new skin's forces by the old skin's: by length they are linear between its nodes
    nearest: Indices  # (k,) old node of the skin
    driven: Flags  # (nodes, 2) which components of the new nodes are held

    @staticmethod
    def of(old: Places, new: Places) -> "MeshTransfer":
        """Find for each place of the `new` mesh where it lies in the `old` one."""
        along, across = _interpolation(old.arcs, new.arcs), _interpolation(old.heights, new.heights)
        station = _piece(old.arcs[::2], new.inner_arcs)
        layer = _piece(old.heights[::2], new.inner_heights)
        onto = np.stack([np.interp(new.skin, old.skin, one, 0.0, 0.0) for one in np.eye(len(old.skin))], axis=1)
        forces = new.lengths[:, None] * onto / old.lengths
        nearest = np.abs(new.skin[:, None] - old.skin).argmin(axis=1)
        return MeshTransfer(old, new, *along, *across, station, layer, forces, nearest, new.body.mesh.driven)

    def carried(self, shape: EquilibriumState) -> EquilibriumState:
        """Return `shape`, found on the old mesh, as a start on the new one."""
        return self.touched(shape, *self.fields(shape.u, shape.pressure))

    def touched(self, shape: EquilibriumState, u: Array, pressure: Array) -> EquilibriumState:
        """Return a start on the new mesh of `u` (nodes, 2) and `pressure` (e, 3), touching where `shape` does."""
        state, sense = shape.state[self.nearest], shape.sense[self.nearest]
        state[state == STICK] = SLIP
        return EquilibriumState(u, pressure, state, sense, self.forces @ shape.reaction, shape.load, shape.iterations)

    def fields(self, u: Array, pressure: Array) -> tuple[Array, Array]:
        """Return displacements `u` [mm] and modes of `pressure` of the old mesh on the new one, (nodes, 2) and (e, 3).

        Displacements are interpolated by the elements' own functions in arc position and height, so a mesh carries its
        state to itself unchanged. Pressures are those of the elements they come from: what interpolated displacements
        change in volume, small as it is, a stiff body would answer strongly.
        """
        old, new, three = self.old.body, self.new.body, np.arange(3)
        grid = u.reshape(len(self.old.arcs), len(self.old.heights), 2)
        lines = np.einsum("ln,lnrc->lrc", self.along_parts, grid[self.along[:, None] + three])
        u_new = np.einsum("rn,lrnc->lrc", self.across_parts, lines[:, self.across[:, None] + three]).reshape(-1, 2)
        layers = (len(self.old.heights) - 1) // 2
        host = (layers * self.station[:, None, :, None] + self.layer[None, :, None, :]).reshape(-1, 9)
        slopes = np.einsum("em,emc->ec", pressure, old.combination)[host]  # (e, 9, 3) by 1, x, y
        away = self.new.points - old.centre[host]
        field = slopes[..., 0] + slopes[..., 1] * away[..., 0] + slopes[..., 2] * away[..., 1]
        pressure_new = np.einsum("eq,eq,eqm->em", new.weight, field, new.modes)
        u_new[self.driven] = 0.0
        return u_new, pressure_new


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


def _interpolation(nodes: Array, points: Array) -> tuple[Indices, Array]:
    """Return which three of `nodes` (n,) of quadratic lines values at `points` (p,) come from, first (p,) and parts."""
    ends = nodes[::2]
    piece = _piece(ends, points)
    local = 2.0 * (points - ends[piece]) / (ends[piece + 1] - ends[piece]) - 1.0
    parts = [local * (local - 1.0) / 2.0, 1.0 - local * local, local * (local + 1.0) / 2.0]
    return 2 * piece, np.stack(parts, axis=1)
