"""The deformed skin as a line: how far it is squeezed, and whether it crosses itself. `solver.crossing` in NumPy."""

import numpy as np

from solver.kernels.compiling import Array, Wide, compiled


@compiled
def squeezed(nodes: Array, u: Array, outline: Wide) -> float:
    """Return the least ratio of deformed to undeformed length of the pieces between the nodes of `outline` (o,).

    `nodes` (n, 2) undeformed, `u` (n, 2) displacements.
    """
    least = np.inf
    for i in range(outline.shape[0] - 1):
        a, b = outline[i], outline[i + 1]
        x, y = nodes[b, 0] - nodes[a, 0], nodes[b, 1] - nodes[a, 1]
        moved_x, moved_y = x + u[b, 0] - u[a, 0], y + u[b, 1] - u[a, 1]
        least = min(least, np.sqrt((moved_x * moved_x + moved_y * moved_y) / (x * x + y * y)))
    return least


@compiled
def crosses(nodes: Array, u: Array, outline: Wide) -> bool:
    """Return whether the deformed line meets itself other than at the nodes that join its pieces."""
    count = outline.shape[0]
    x, y = np.empty(count), np.empty(count)
    for i in range(count):
        x[i], y[i] = nodes[outline[i], 0] + u[outline[i], 0], nodes[outline[i], 1] + u[outline[i], 1]
    for i in range(count - 3):
        dx, dy = x[i + 1] - x[i], y[i + 1] - y[i]
        before = dx * (y[i + 2] - y[i]) - dy * (x[i + 2] - x[i])
        for j in range(i + 2, count - 1):
            side = dx * (y[j + 1] - y[i]) - dy * (x[j + 1] - x[i])
            if before * side < 0.0:  # the ends of piece j lie on both sides of the line of piece i
                ex, ey = x[j + 1] - x[j], y[j + 1] - y[j]
                one = ex * (y[i] - y[j]) - ey * (x[i] - x[j])
                other = ex * (y[i + 1] - y[j]) - ey * (x[i + 1] - x[j])
                if one * other < 0.0:
                    return True
            before = side
    return False
