"""How much of its rated range a transducer carries, axis by axis and combined."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Level = Literal["fine", "warning", "alarm"]

WARNING = 0.8  # of a range [-]
ALARM = 1.0  # of the range of one axis
ALARM_COMBINED = 1.05  # of two taken together: where the Ethernet Axia's manual calls a reading out of range


def loads(wrench: Array, rated: Array) -> Array:
    """Return |Fx .. Tz| over their ranges and the combined load, shape (n, 7) [-], for a wrench (n, 6) [N, N mm].

    Forces across strain the same beams as the torque about z, and the force along z those that the torques across do:
    the combined load is the greater of |Fxy| + |Tz| and |Fz| + |Txy|, each over its range (maker's manual of the
    Ethernet Axia, status bit 30). nan where a range `rated` (6,) is unknown.

    >>> loads(np.array([[18.0, 0.0, -9.0, 0.0, 0.0, 250.0]]), np.array([36.0, 36.0, 36.0, 500.0, 500.0, 500.0]))
    array([[0.5 , 0.  , 0.25, 0.  , 0.  , 0.5 , 1.  ]])
    """
    fx, fy, fz, tx, ty, tz = parts = np.abs(wrench / rated).T
    combined = np.maximum(np.hypot(fx, fy) + tz, fz + np.hypot(tx, ty))
    return np.column_stack([*parts, combined])


def level(greatest: Array) -> Level:
    """Return how grave the greatest loads (7,) are; nan counts as nothing.

    >>> level(np.array([0.5, 0.1, 0.81, 0.0, 0.0, 0.0, 0.9])), level(np.array([0.9] * 6 + [1.06]))
    ('warning', 'alarm')
    """
    over = np.nan_to_num(greatest) / np.array([ALARM] * 6 + [ALARM_COMBINED])
    return "alarm" if np.any(over > 1.0) else "warning" if np.any(np.nan_to_num(greatest) > WARNING) else "fine"
