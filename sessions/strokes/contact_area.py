"""The contact area by which a tangential force becomes a traction: fixed, or growing with the normal force.

Hertz: of a smooth elastic sphere on a plane the area grows as N^(2/3) (Johnson 1985, Contact Mechanics, section 4.2).
A finger is neither; the exponent and the force at which the area is the planned one are assumed unless somebody gives
them. No area is measured here.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HERTZ = 2.0 / 3.0
PLANNED_AT = 2.0  # normal force at which an area that grows is the planned one, where nobody said another [N]


@dataclass(frozen=True, slots=True)
class AreaLaw:
    """Contact area = planned area x (N / force)^exponent; `exponent` 0 is a fixed area."""

    law: Literal["fixed", "hertz", "power"] = "fixed"
    exponent: float = 0.0
    force: float = PLANNED_AT  # [N]

    def area(self, normal: Array, planned: float) -> Array:
        """Return the contact area (n,) [mm2] under a normal force (n,) [N], > 0; `planned` [mm2].

        >>> AreaLaw("power", 0.5, 1.0).area(np.array([1.0, 4.0]), 100.0)
        array([100., 200.])
        """
        return planned * (normal / self.force) ** self.exponent

    @property
    def sentence(self) -> str:
        """The law, for people, with what was assumed."""
        if self.law == "fixed":
            return "fixed, whatever the normal force"
        assumed = ", assumed" if self.force == PLANNED_AT else ", set"
        why = "Hertz, sphere on plane: Johnson 1985, section 4.2; assumed of a finger" if self.law == "hertz" else "set"
        return f"grows as N^{self.exponent:.3g} ({why}), and is the planned one at {self.force:g} N{assumed}"


FIXED = AreaLaw()
