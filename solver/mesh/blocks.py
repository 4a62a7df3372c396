"""Bodies other than the finger: blocks, flat or round below, for problems whose answer is known."""

import numpy as np

from solver.arrays import Array
from solver.mesh.grid import grid_mesh
from solver.mesh.mesh import Mesh


def block(x_lines: Array, y_lines: Array, radius: float = np.inf, *, held: bool = True) -> Mesh:
    """Return a block on the surface, with lines between elements at `x_lines` and `y_lines` (from 0 up) [mm].

    Its underside is flat, or a circle of `radius` [mm] that touches the surface at x = 0; it may touch everywhere. Its
    top is held, or with `held` False nothing is.
    """
    x, y = _with_middles(x_lines), _with_middles(y_lines)[::-1]
    bottom = 0.0 * x if np.isinf(radius) else radius - np.sqrt(radius**2 - x**2)
    part = y / y[0]
    points = np.empty((len(x), len(y), 2))
    points[..., 0] = x[:, None]
    points[..., 1] = bottom[:, None] * (1.0 - part) + y[0] * part
    top = np.arange(len(x)) * len(y)
    return grid_mesh(points, np.zeros(len(y) // 2, np.int64), slice(0, len(x)), top if held else top[:0])


def _with_middles(lines: Array) -> Array:
    out = np.empty(2 * len(lines) - 1)
    out[::2], out[1::2] = lines, (lines[1:] + lines[:-1]) / 2.0
    return out
