"""The deformed skin in plain NumPy: whether it crosses itself, and how far it is squeezed."""

import numpy as np

from solver._kernels.skin import SQUEEZED
from solver.arrays import Array, Flags
from solver.contact import SkinCompression


def crosses_itself(outline: Array) -> bool:
    """Return whether a polyline (n, 2) meets itself other than at the points that join its pieces.

    In a straight line each point lies on either side of each piece, by rounding: only pieces that overlap along x and
    y can meet.

    >>> bool(crosses_itself(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, -1.0]])))
    True
    >>> bool(crosses_itself(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 0.5]])))
    False
    """
    start, along = outline[:-1], np.diff(outline, axis=0)
    # on which side of each piece (rows) each point (columns) lies: the cross product of two differences
    side = along[:, :1] * outline[:, 1] - along[:, 1:] * outline[:, 0]
    side -= (along[:, 0] * start[:, 1] - along[:, 1] * start[:, 0])[:, None]
    opposite = side[:, :-1] * side[:, 1:] < 0.0
    low, high = np.minimum(start, outline[1:]), np.maximum(start, outline[1:])
    overlap = (high[:, None] >= low).all(axis=2)
    crossing = opposite & opposite.T & overlap & overlap.T
    return bool(np.triu(crossing, 2).any())


def measure_compression(before: Array, after: Array, loose: Flags, touching: Flags) -> SkinCompression:
    """Return how far polylines of elements with three nodes each, (2 a + 1, 2), are squeezed where `loose` (a,).

    Some of the nodes are `touching` (2 a + 1,).
    """
    start = [np.diff(points, axis=0)[::2] for points in (before, after)]
    end = [np.diff(points, axis=0)[1::2] for points in (before, after)]
    pieces = np.stack([_lengths(after) / _lengths(before) for before, after in (start, end)], axis=1)
    sizes = [_lengths(3.0 * start[0] - end[0]), _lengths(3.0 * end[0] - start[0])]
    first, last = (
        (3.0 * a - b) / size[:, None] for a, b, size in zip((start[1], end[1]), (end[1], start[1]), sizes, strict=True)
    )
    pieces[~loose] = np.inf
    joints = loose[1:] & loose[:-1] & ~touching[2:-2:2]
    joints &= np.minimum(_lengths(first[1:]), _lengths(last[:-1])) < SQUEEZED
    jumps = _lengths(first[1:] - last[:-1])[joints]
    lowest = min(float(_lengths(side)[loose].min(initial=np.inf)) for side in (first, last))
    least, place = float(pieces.min()), int(pieces.min(axis=1).argmin())
    return SkinCompression(least, place, min(lowest, least), float(jumps.max(initial=0.0)))


def _lengths(steps: Array) -> Array:
    return np.hypot(steps[:, 0], steps[:, 1])
