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
    start, end = outline[:-1], outline[1:]

    def side(origin: Array, to: Array, point: Array) -> Array:
        """Return on which side of each line (rows) each point (columns) lies."""
        along = (to - origin)[:, None]
        off = point[None] - origin[:, None]
        return along[..., 0] * off[..., 1] - along[..., 1] * off[..., 0]

    apart = (side(start, end, start) * side(start, end, end)) < 0.0
    crossing = apart & apart.T
    return bool(np.triu(crossing, 2).any())


def least_stretch(before: Array, after: Array) -> float:
    """Return the least ratio of a piece's deformed to its undeformed length, for polylines (n, 2).

    A neo-Hookean half-space in plane strain wrinkles at 0.544 (Biot 1963, Appl. Sci. Res. A 12, 168).
    """
    lengths = [np.linalg.norm(np.diff(points, axis=0), axis=1) for points in (before, after)]
    return float((lengths[1] / lengths[0]).min())
