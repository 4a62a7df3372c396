"""Whether a deformed outline crosses itself, and how far its skin is squeezed."""

import numpy as np

from solver.mesh import Array


def crosses_itself(outline: Array) -> bool:
    """Return whether a polyline (n, 2) meets itself other than at the points that join its pieces.

    >>> bool(crosses_itself(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, -1.0]])))
    True
    >>> bool(crosses_itself(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 0.5]])))
    False
    """
    start, along = outline[:-1], np.diff(outline, axis=0)
    # on which side of each piece (rows) each point (columns) lies: the cross product of two differences
    side = along[:, :1] * outline[:, 1] - along[:, 1:] * outline[:, 0]
    side -= (along[:, 0] * start[:, 1] - along[:, 1] * start[:, 0])[:, None]
    apart = side[:, :-1] * side[:, 1:] < 0.0
    crossing = apart & apart.T
    return bool(crossing.any()) and bool(np.triu(crossing, 2).any())


def least_stretch(before: Array, after: Array) -> float:
    """Return the least ratio of a piece's deformed to its undeformed length, for polylines (n, 2).

    A neo-Hookean half-space in plane strain wrinkles at 0.544 (Biot 1963, Appl. Sci. Res. A 12, 168).
    """
    steps = [np.diff(points, axis=0) for points in (before, after)]
    return float((np.hypot(steps[1][:, 0], steps[1][:, 1]) / np.hypot(steps[0][:, 0], steps[0][:, 1])).min())
