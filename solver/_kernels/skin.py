"""Stretch and self-intersection of the deformed skin."""

import numpy as np

from solver._kernels.compiling import OPEN, compile_loop, subroutine
from solver.arrays import Array, Flags, Indices, Narrow

SQUEEZED = 0.85  # stretch on at least one side below which a jump of the tangent counts as a kink


@compile_loop
def measure_compression(
    nodes: Array, u: Array, outline: Indices, loose: Flags, state: Narrow, first: int
) -> tuple[float, int, float, float]:
    """Return the fields of `SkinCompression` for the elements where `loose` (a,) is true.

    `nodes` (n, 2) are undeformed positions and `u` (n, 2) displacements. `outline` (2 a + 1,) lists the skin's nodes in
    order. Those from number `first` on may touch; `state` (k,) holds their contact states.
    """
    least, place, lowest, kink = np.inf, 0, np.inf, 0.0
    before_x, before_y = np.nan, np.nan  # tangent at the end of the previous element
    for j in range(loose.shape[0]):
        if not loose[j]:
            before_x, before_y = np.nan, np.nan
            continue
        a, b, c = outline[2 * j], outline[2 * j + 1], outline[2 * j + 2]
        px, py = nodes[b, 0] - nodes[a, 0], nodes[b, 1] - nodes[a, 1]
        qx, qy = nodes[c, 0] - nodes[b, 0], nodes[c, 1] - nodes[b, 1]
        dx, dy = px + u[b, 0] - u[a, 0], py + u[b, 1] - u[a, 1]
        ex, ey = qx + u[c, 0] - u[b, 0], qy + u[c, 1] - u[b, 1]
        one = np.sqrt((dx * dx + dy * dy) / (px * px + py * py))
        other = np.sqrt((ex * ex + ey * ey) / (qx * qx + qy * qy))
        if min(one, other) < least:
            least, place = min(one, other), j
        size = np.hypot(3.0 * px - qx, 3.0 * py - qy)
        x, y = (3.0 * dx - ex) / size, (3.0 * dy - ey) / size
        node = 2 * j - first
        touches = 0 <= node < state.shape[0] and state[node] != OPEN
        if min(np.hypot(x, y), np.hypot(before_x, before_y)) < SQUEEZED and not touches:
            kink = max(kink, np.hypot(x - before_x, y - before_y))
        size = np.hypot(3.0 * qx - px, 3.0 * qy - py)
        before_x, before_y = (3.0 * ex - dx) / size, (3.0 * ey - dy) / size
        lowest = min(lowest, np.hypot(x, y), np.hypot(before_x, before_y))
    return least, place, min(lowest, least), kink


@compile_loop
def crosses(nodes: Array, u: Array, outline: Indices) -> bool:
    """Return whether the deformed skin intersects itself; neighbouring segments that share a node do not count."""
    count = outline.shape[0]
    x, y = np.empty(count), np.empty(count)
    for i in range(count):
        x[i], y[i] = nodes[outline[i], 0] + u[outline[i], 0], nodes[outline[i], 1] + u[outline[i], 1]
    for i in range(count - 3):
        dx, dy = x[i + 1] - x[i], y[i + 1] - y[i]
        before = dx * (y[i + 2] - y[i]) - dy * (x[i + 2] - x[i])
        for j in range(i + 2, count - 1):
            side = dx * (y[j + 1] - y[i]) - dy * (x[j + 1] - x[i])
            if before * side < 0.0:  # segment j has its ends on both sides of the line through segment i
                ex, ey = x[j + 1] - x[j], y[j + 1] - y[j]
                one = ex * (y[i] - y[j]) - ey * (x[i] - x[j])
                other = ex * (y[i + 1] - y[j]) - ey * (x[i + 1] - x[j])
                if one * other < 0.0 and _overlap(x, i, j) and _overlap(y, i, j):
                    return True
            before = side
    return False


@subroutine
def _overlap(at: Array, i: int, j: int) -> bool:
    """Return whether the segments that start at points `i` and `j` overlap along one axis.

    Segments of one straight line do not; on which side of each other they lie is decided by round-off alone.
    """
    return max(at[i], at[i + 1]) >= min(at[j], at[j + 1]) and max(at[j], at[j + 1]) >= min(at[i], at[i + 1])
