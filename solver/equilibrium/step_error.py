"""How many load steps a course takes, and by how much its end may be off for not taking more.

A press with friction, or a drag that friction carries, depends on its way: where in a step a point comes to touch is
where it is held from then on. The error falls with the number of steps, and is nearly the same on every mesh, so that
it is measured on a coarse one: by how much half as many steps change the end. A settled slide has none.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np

from solver.arrays import Array
from solver.quantities import NAMES

HALF = 0.5
MOST = 16  # times the usual steps, at most
USUAL = 0.003  # tolerance that steps are chosen for where none is asked for
SHARE = 0.3  # part of a tolerance that the error of the steps may take
FROM_HALF = 1.2  # of what half as many steps change
_OF_SED = 4e-4
# of each number, since two courses can agree by chance; quantities at the ending as the SED there
LEAST = np.array([_OF_SED, 1e-4, 4e-3, 1e-4, 3e-3, 5e-4, *[_OF_SED] * (1 + len(NAMES))])


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """The steps of one course. Numbers are those of `all_numbers` (c,)."""

    times: int  # the usual ones
    whole: Array  # (c,) the numbers after the usual steps, on a coarse mesh
    change: Array  # (c,) of them from half the usual steps on

    @staticmethod
    def of(whole: Array, half: Array, tolerance: float | None) -> "Steps":
        """Return the fewest that a tolerance asks for.

        `whole` (c,) and `half` (c,) are the numbers after the usual steps and after half of them, on a coarse mesh.
        """
        once = Steps(1, whole, whole - half)
        off = float(once.error(whole)[0] / max(abs(float(whole[0])), np.finfo(float).tiny))
        return Steps(min(max(1, ceil(off / (SHARE * (tolerance or USUAL)))), MOST), whole, once.change)

    def error(self, numbers: Array) -> Array:
        """Return by how much `numbers` (c,) may be off for not taking more steps (c,)."""
        return (FROM_HALF * np.abs(self.change) + LEAST * np.abs(numbers)) / self.times

    def taken(self, whole: Array) -> Array:
        """Return what the numbers (c,) after the usual steps, `whole`, would be after these."""
        return whole + (1.0 - 1.0 / self.times) * self.change
