"""Mesh: nodes, nine-node quadrilaterals, regions, the skin that may touch and the nodes that are driven."""

from dataclasses import dataclass, field, fields
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Flags, Indices

Numbers = TypeVar("Numbers", bound=np.generic)
_NONE: Indices = np.empty(0, np.int64)


def distinct(numbers: NDArray[Numbers]) -> NDArray[Numbers]:
    """Return the different numbers among these, in order.

    >>> distinct(np.array([3, 1, 3]))
    array([1, 3])
    """
    # for a few numbers several times as fast as np.unique, which imports masked arrays
    ordered = np.sort(numbers, axis=None)
    new = np.ones(len(ordered), bool)
    new[1:] = ordered[1:] != ordered[:-1]
    return ordered[new]


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A body as arrays, read-only. Nodes of an element: corners, then mid-sides, then centre.

    Corners run counter-clockwise, mid-side k lies between corners k and k+1:

        3 - 6 - 2
        7   8   5
        0 - 4 - 1
    """

    nodes: Array  # (n, 2) undeformed positions [mm]
    elements: Indices  # (e, 9)
    region: Indices  # (e,) number of the material of each element
    skin: Indices  # (2 k + 1,) nodes that may touch, along k edges: end, middle, end, middle, ... end
    held: Indices  # (h,) nodes that are driven as a whole, in both directions
    held_x: Indices = field(default_factory=lambda: _NONE)  # nodes that are driven along x alone, and roll along y
    held_y: Indices = field(default_factory=lambda: _NONE)  # the same along y: rollers, and planes of symmetry

    def __post_init__(self) -> None:
        """Make the arrays read-only, and lengths and whole numbers those that loops take; others are left as they are.

        Those others are refused where a body is made of them (`solver.body.validation`).
        """
        for f in fields(self):
            given = np.asarray(getattr(self, f.name))
            kinds, taken = ("fiu", np.float64) if f.name == "nodes" else ("iu", np.int64)
            if given.dtype.kind in kinds or not given.size:
                given = np.ascontiguousarray(given, taken)
            view = given.view()
            view.flags.writeable = False
            object.__setattr__(self, f.name, view)

    @property
    def fixed(self) -> Indices:
        """Return the numbers of the unknowns that are held, in order: x of node n is 2 n, y is 2 n + 1."""
        both = np.concatenate([self.held, self.held_x]), np.concatenate([self.held, self.held_y])
        return distinct(np.concatenate([2 * both[0], 2 * both[1] + 1]))

    @property
    def driven(self) -> Flags:
        """Return which components of which nodes are held, (n, 2)."""
        out = np.zeros(2 * len(self.nodes), bool)
        out[self.fixed] = True
        return out.reshape(-1, 2)
