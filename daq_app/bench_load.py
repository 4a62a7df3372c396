"""How much of its rated range a transducer is loaded to: each axis, and forces and torques together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
FULL = 1.0  # share of the rated range at which a load is an overload


@dataclass(frozen=True, slots=True)
class Load:
    """Shares of the rated range, the greatest of some readings; 1 is the rated load. nan where no range is stated."""

    axes: tuple[float, ...] = (0.0,) * 6
    combined: float = 0.0  # see `load_of`

    def latched(self, other: "Load") -> "Load":
        """Return the greater of each share.

        >>> Load((0.1, 0.0, 0.9, 0.0, 0.0, 0.0), 0.9).latched(Load((0.2,) * 6, 0.4)).axes
        (0.2, 0.2, 0.9, 0.2, 0.2, 0.2)
        """
        pairs = zip(self.axes, other.axes, strict=True)
        return Load(tuple(float(np.fmax(a, b)) for a, b in pairs), float(np.fmax(self.combined, other.combined)))

    @property
    def over(self) -> tuple[str, ...]:
        """Return the names of what is at or beyond its rated load."""
        named = zip((*AXES, "combined"), (*self.axes, self.combined), strict=True)
        return tuple(name for name, share in named if share >= FULL)


def load_of(wrench: Array, rated: Array) -> Load:
    """Return the greatest load within readings (n, 6) [N, N mm] of a transducer with rated ranges (6,) [N, N mm].

    `wrench` is as felt: what strains the transducer includes its zero. The combined load is the greater of the sums
    Fxy + Tz and Fz + Txy of rated shares, as the maker of the Axia sensors states its own overload (status bit 30).
    """
    if not len(wrench):
        return Load()
    share = np.abs(wrench) / rated
    fxy = np.hypot(share[:, 0], share[:, 1])
    txy = np.hypot(share[:, 3], share[:, 4])
    combined = np.fmax(fxy + share[:, 5], share[:, 2] + txy)
    return Load(tuple(share.max(axis=0).tolist()), float(combined.max()))
