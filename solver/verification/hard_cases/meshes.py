"""Bad meshes, and blocks with a stiff part, for the hard cases."""

import math
from dataclasses import replace

import numpy as np

from solver.arrays import Array, Indices
from solver.element import Q2P1
from solver.mesh import Mesh
from solver.mesh.blocks import block


def jittered(mesh: Mesh, outline: Indices, by: float, seed: int) -> Mesh:
    """Return the mesh with inner corners of elements moved by up to `by` of their shortest edge.

    Corners on the outline, on layers and held ones stay, so that the body stays the same; mid-nodes follow.
    """
    rng = np.random.default_rng(seed)
    nodes, corners = mesh.nodes, mesh.elements[:, :4]
    following = np.roll(corners, -1, axis=1)
    length = np.linalg.norm(nodes[corners] - nodes[following], axis=2)
    shortest = np.full(len(nodes), np.inf)
    np.minimum.at(shortest, corners.ravel(), length.ravel())
    np.minimum.at(shortest, following.ravel(), length.ravel())
    met = np.bincount(corners.ravel(), minlength=len(nodes))
    least = np.full(len(nodes), len(nodes))
    most = np.zeros(len(nodes), np.int64)
    for corner in range(4):
        np.minimum.at(least, corners[:, corner], mesh.region)
        np.maximum.at(most, corners[:, corner], mesh.region)
    free = (met == 4) & (least == most)
    free[mesh.held] = False
    free[outline] = False
    moved = np.zeros(nodes.shape)
    moved[free] = rng.uniform(-1, 1, (int(free.sum()), 2)) * by / math.sqrt(2) * shortest[free, None]
    while True:
        nodes = mesh.nodes + moved
        for side in range(4):
            ends = moved[corners[:, side]] + moved[following[:, side]]
            middle = mesh.elements[:, 4 + side]
            nodes[middle] = mesh.nodes[middle] + ends / 2
        nodes[mesh.elements[:, 8]] = mesh.nodes[mesh.elements[:, 8]] + moved[corners].sum(axis=1) / 4
        jacobian = np.swapaxes(nodes[mesh.elements], 1, 2)[:, None] @ Q2P1.shape(Q2P1.corners)[1]
        det = np.linalg.det(jacobian)
        folded = det.min(axis=1) < 0.02 * det.max(axis=1)
        if not folded.any():
            return replace(mesh, nodes=nodes)
        moved[np.unique(corners[folded])] *= 0.8  # the mesh was skew there already


STIFF_LAYERS = 2


def two_parts() -> tuple[Mesh, Mesh]:
    """Return a soft block (region 0) with a plate above it (region 1), and the block alone, held where it begins."""
    x, soft = np.linspace(-4, 4, 17), np.linspace(0, 2, 9)
    lines: Array = np.concatenate([soft, np.array([2.5, 3.0])])
    whole = block(x, lines, radius=8.0)
    layers = len(soft) + 1
    region = np.zeros(len(whole.elements), np.int64)
    region.reshape(-1, layers)[:, :STIFF_LAYERS] = 1  # the elements of a column run from its top down
    column = 2 * layers + 1
    kept = np.arange(len(whole.nodes)).reshape(-1, column)[:, 2 * STIFF_LAYERS :]
    number = np.full(len(whole.nodes), -1)
    number[kept.ravel()] = np.arange(kept.size)
    alone = Mesh(
        whole.nodes[kept.ravel()],
        number[whole.elements[region == 0]],
        region[region == 0],
        number[whole.skin],
        number[kept[:, 0]],
    )
    return replace(whole, region=region), alone


def slabs() -> tuple[Mesh, Mesh]:
    """Return one block twice, its lowest elements squarish and fifty times longer than high."""
    x: Array = np.linspace(-5, 5, 41)
    fine: Array = np.linspace(0, 1, 26)
    flat: Array = np.concatenate([np.linspace(0, 0.015, 4), fine[1:]])
    return block(x, np.linspace(0, 1, 9), radius=40.0), block(x, flat, radius=40.0)
