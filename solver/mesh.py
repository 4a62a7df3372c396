"""Mesh: nodes, nine-node quadrilaterals, regions, the skin that may touch and the nodes that are driven."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


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
    held: Indices  # (h,) nodes that are driven as a whole

    def __post_init__(self) -> None:
        """Make the arrays read-only views."""
        for f in fields(self):
            view = getattr(self, f.name).view()
            view.flags.writeable = False
            object.__setattr__(self, f.name, view)
