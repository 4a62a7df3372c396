"""How much of its rated range a transducer is loaded to: each axis, and forces and torques together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq_app.wording import tr_noop
from drivers.calibration import ALARM, ALARM_COMBINED, WARNING, loads

Array = NDArray[np.float64]

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


@dataclass(frozen=True, slots=True)
class Load:
    """Shares of the rated range, the greatest of some readings; 1 is the rated load. nan where no range is stated."""

    axes: tuple[float, ...] = (0.0,) * 6
    combined: float = 0.0  # see `drivers.calibration`

    def latched(self, other: "Load") -> "Load":
        """Return the greater of each share.

        >>> Load((0.1, 0.0, 0.9, 0.0, 0.0, 0.0), 0.9).latched(Load((0.2,) * 6, 0.4)).axes
        (0.2, 0.2, 0.9, 0.2, 0.2, 0.2)
        """
        pairs = zip(self.axes, other.axes, strict=True)
        return Load(tuple(float(np.fmax(a, b)) for a, b in pairs), float(np.fmax(self.combined, other.combined)))

    @property
    def over(self) -> tuple[str, ...]:
        """Return the names of what is beyond its rated load."""
        over = tuple(name for name, share in zip(AXES, self.axes, strict=True) if share > ALARM)
        return (*over, tr_noop("combined")) if self.combined > ALARM_COMBINED else over

    @property
    def near(self) -> tuple[str, ...]:
        """Return the names of what is near its rated load, or beyond it."""
        named = zip((*AXES, "combined"), (*self.axes, self.combined), strict=True)
        return tuple(name for name, share in named if share > WARNING)


def load_of(wrench: Array, rated: Array) -> Load:
    """Return the greatest load within readings (n, 6) [N, N mm] of a transducer with rated ranges (6,) [N, N mm].

    `wrench` is as felt: what strains the transducer includes its zero.
    """
    if not len(wrench):
        return Load()
    greatest = loads(wrench, rated).max(axis=0)
    return Load(tuple(greatest[:6].tolist()), float(greatest[6]))
