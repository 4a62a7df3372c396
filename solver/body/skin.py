"""Compression, creases and self-intersection of the deformed skin, a polyline through its nodes."""

from typing import NamedTuple

import numpy as np

from solver.arrays import Array, Flags, Indices

KINK_STRETCH = 0.85  # stretch to one side of a joint below which a jump of the tangent counts as a kink


class SkinCompression(NamedTuple):
    """Largest compression of the skin, and whether the skin has a crease.

    A neo-Hookean half-space in plane strain wrinkles at a stretch of 0.544 (Biot 1963, Appl. Sci. Res. A 12, 168).
    """

    least_chord: float  # least ratio of deformed to undeformed length, over halves of elements' sides
    element: int  # with the least ratio
    least_stretch: float  # least stretch, at the ends of elements too: more accurate where elements are large
    kink: float  # largest jump of the tangent between elements, relative to undeformed length: large at a crease.
    # Only open, compressed skin counts: the mesh causes jumps where it touches, or is stretched at an edge of contact.

    @staticmethod
    def of(nodes: Array, u: Array, away_from_held: Flags, touching: Flags) -> "SkinCompression":
        """Return the compression of the sides of a elements, where `away_from_held` (a,) is true.

        `nodes` (2 a + 1, 2) are undeformed positions, `u` (2 a + 1, 2) displacements [mm]. `touching` (2 a + 1,) flags
        the nodes in contact.
        """
        if not away_from_held.any():
            return SkinCompression(np.inf, 0, np.inf, 0.0)
        steps = np.diff(np.stack([nodes, nodes + u]), axis=1).reshape(2, -1, 2, 2)  # by element and half
        steps = steps[:, away_from_held]
        lengths = _length(steps)
        ratio = lengths[1] / lengths[0]
        tangents = 3.0 * steps - steps[:, :, ::-1]  # at both ends
        tangent = tangents[1] / _length(tangents[0])[..., None]
        stretch = _length(tangent)
        elements = np.flatnonzero(away_from_held)
        joints = (np.diff(elements) == 1) & ~touching[2 * elements[1:]]
        joints &= np.minimum(stretch[1:, 0], stretch[:-1, 1]) < KINK_STRETCH
        jumps = _length(tangent[1:, 0] - tangent[:-1, 1])[joints]
        worst = int(ratio.min(axis=1).argmin())
        least = float(ratio[worst].min())
        lowest = min(float(stretch.min()), least)
        return SkinCompression(least, int(elements[worst]), lowest, float(jumps.max(initial=0.0)))


def _length(vectors: Array) -> Array:
    return np.hypot(vectors[..., 0], vectors[..., 1])


def crosses_itself(line: Array) -> bool:
    """Return whether a polyline (n, 2) meets itself other than at the points that join its pieces.

    In a straight line round-off decides on which side of each piece a point lies. So only pieces that overlap along x
    and y can meet.

    >>> crosses_itself(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, -1.0]]))
    True
    >>> crosses_itself(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 0.5]]))
    False
    """
    start, end = line[:-1], line[1:]
    overlap = np.tri(len(start), k=-2, dtype=bool)  # pairs that are no neighbours
    for low, high in zip(np.minimum(start, end).T, np.maximum(start, end).T, strict=True):
        overlap &= (high[:, None] >= low) & (high >= low[:, None])
    piece, partner = np.nonzero(overlap)
    return bool(np.any(_intersects(start, end, piece, partner) & _intersects(start, end, partner, piece)))


def _intersects(start: Array, end: Array, piece: Indices, partner: Indices) -> Flags:
    """Return whether the line through each `piece` (p,) has the ends of its `partner` (p,) on both sides."""
    along, first, last = (end - start)[piece], start[partner] - start[piece], end[partner] - start[piece]
    sides = [along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0] for to in (first, last)]
    return np.asarray(sides[0] * sides[1] < 0.0)
