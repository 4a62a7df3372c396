"""The skin in contact: where contact ends, and how far skin is squeezed.

Contact ends between two nodes, known to about a tenth of an element from how the pressure falls.

Near its edge pressure falls like the square root of the distance. The force beyond a line between elements then has its
centre at 2/5 of the way from there to the edge.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.mesh.mesher import FingerMesh, with_middles

FEWEST = 5  # touching nodes for which the force can tell


def edges(arcs: Array, force: Array, touching: NDArray[np.bool_]) -> tuple[float, float] | None:
    """Return the arc positions [mm] where contact ends; None where it is too short to tell.

    `force` (k,) [N/mm] are the normal forces on the nodes that may touch, which lie at `arcs` (k,).
    """
    high, low = last_edge(arcs, force, touching), last_edge(-arcs[::-1], force[::-1], touching[::-1])
    return None if high is None or low is None or high <= -low else (-low, high)


def width(arcs: Array, x: Array, force: Array, touching: NDArray[np.bool_]) -> float:
    """Return the distance along the surface from where contact begins to where it ends [mm], 0 where nothing touches.

    `x` (k,) are the deformed positions along the surface [mm]. Where contact is too short to tell its edges, a touching
    node stands for half the way to its open neighbours.
    """
    ends = edges(arcs, force, touching)
    if ends is not None:
        low, high = np.interp(ends, arcs, x)
        return float(high - low)
    on = np.flatnonzero(touching)
    if not len(on):
        return 0.0
    first, last = int(on[0]), int(on[-1])
    low = (x[first] + x[max(first - 1, 0)]) / 2.0
    high = (x[last] + x[min(last + 1, len(x) - 1)]) / 2.0
    return float(high - low)


def arcs_of(geometry: FingerMesh) -> Array:
    """Return the arc positions (k,) of the nodes that may touch [mm]."""
    return with_middles(geometry.arcs)[np.searchsorted(geometry.whole, geometry.mesh.skin)]


def last_edge(arcs: Array, force: Array, touching: NDArray[np.bool_]) -> float | None:
    """Return where contact ends towards the last of the nodes at `arcs` (k,) [mm]; None where it is too short to tell.

    `force` (k,) is what falls to nothing there like the square root of the distance; nodes alternate between ends and
    middles of edges, an end first.
    """
    on = [number for number, touches in enumerate(touching.tolist()) if touches]  # few numbers: quicker one by one
    if len(on) < FEWEST:
        return None
    last = on[-1]
    line = last - 2 if last % 2 == 0 else last - 1  # the last line with contact on both sides
    place, pressed = arcs.tolist(), force[line : last + 1].tolist()
    gaps = place[line] - place[line - 2], place[line + 2] - place[line]
    pressed[0] *= gaps[1] / (gaps[0] + gaps[1])  # the part of the line's own force that stems from beyond
    moment = sum(one * (at - place[line]) for one, at in zip(pressed, place[line : last + 1], strict=True))
    least = place[last] - 0.35 * (place[last] - place[last - 1])
    return min(max(place[line] + 2.5 * moment / sum(pressed), least), place[min(last + 1, len(place) - 1)])


class SkinCompression(NamedTuple):
    """How far the skin is squeezed where it is, and whether it has a crease.

    A neo-Hookean half-space in plane strain wrinkles at a stretch of 0.544 (Biot 1963, Appl. Sci. Res. A 12, 168).
    """

    least: float  # ratio of deformed to undeformed length of a half of an element's side
    place: int  # the element that it belongs to
    lowest: float  # stretch, at the ends of elements too: nearer the truth where elements are large
    kink: float  # largest jump of the tangent, by undeformed length, from one element to the next: a crease has one.
    # Where skin touches or is drawn out at an edge of contact, jumps are the mesh's: open, squeezed skin is asked.
