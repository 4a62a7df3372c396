"""From raw readings to the wrench the finger exerts on the stimulus."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """What turns six raw numbers of one transducer into newtons and newton millimetres."""

    serial: str  # the transducer's serial number, as the device or its file states it
    raw_unit: str  # "counts", "V", or "N, N mm" for readings that came as a wrench
    matrix: Array  # (6, 6): wrench [N, N mm] = matrix @ (raw - bias)
    rated: Array  # (6,) rated range of each axis [N, N mm]; nan where nobody stated it
    source: str  # where the numbers came from, for people

    def wrench(self, raw: Array, bias: Array) -> Array:
        """Return the wrench (n, 6) [N, N mm] of raw readings (n, 6), with bias (6,) in raw units.

        >>> cal = Calibration("FT1", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.full(6, np.nan), "by hand")
        >>> cal.wrench(np.array([[1e6, 0, -2e6, 0, 500, 0]]), np.array([0, 0, -1e6, 0, 0, 0]))
        array([[ 1. ,  0. , -1. ,  0. ,  0.5,  0. ]])
        """
        return (raw - bias) @ self.matrix.T
