"""Blocks with a stiff part and with flat elements, for the hard cases."""

from dataclasses import replace

import numpy as np

from solver.arrays import Array
from solver.mesh import Mesh, block

STIFF_LAYERS = 2


def two_parts() -> tuple[Mesh, Mesh]:
    """Return a soft block (region 0) below a plate (region 1), and the block alone, held where the plate begins."""
    x, soft = np.linspace(-4, 4, 17), np.linspace(0, 2, 9)
    lines: Array = np.concatenate([soft, np.array([2.5, 3.0])])
    whole = block(x, lines, radius=8.0)
    layers = len(soft) + 1
    region = np.zeros(len(whole.elements), np.int64)
    region.reshape(-1, layers)[:, :STIFF_LAYERS] = 1  # elements of a column are numbered from its top down
    column = 2 * layers + 1
    kept = np.arange(len(whole.nodes)).reshape(-1, column)[:, 2 * STIFF_LAYERS :]
    number = np.full(len(whole.nodes), -1)
    number[kept.ravel()] = np.arange(kept.size)
    elements = number[whole.elements[region == 0]]
    alone = Mesh(whole.nodes[kept.ravel()], elements, region[region == 0], number[whole.skin], number[kept[:, 0]])
    return replace(whole, region=region), alone


def slabs() -> tuple[Mesh, Mesh]:
    """Return one block twice, its lowest elements nearly square, and fifty times longer than high."""
    x: Array = np.linspace(-5, 5, 41)
    fine: Array = np.linspace(0, 1, 26)
    flat: Array = np.concatenate([np.linspace(0, 0.015, 4), fine[1:]])
    return block(x, np.linspace(0, 1, 9), radius=40.0), block(x, flat, radius=40.0)
