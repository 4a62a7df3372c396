"""From raw readings to the finger's wrench on the stimulus, and the load of a transducer relative to its range."""

from dataclasses import dataclass, replace

import numpy as np

from drivers.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Conversion of one transducer's six raw values into newtons and newton millimetres."""

    serial: str  # the transducer's serial number, from the device or its file
    raw_unit: str  # "counts", "V", or "N, N mm" for readings that came as a wrench
    matrix: Array  # (6, 6): wrench [N, N mm] = matrix @ (raw - bias), the tool transform included
    rated: Array  # (6,) rated range of each axis of the transducer's own frame [N, N mm]; nan where unknown
    source: str  # source of the numbers, for people
    tool: tuple[float, ...] = ()  # (6,) the user's tool transform: dx dy dz [mm], rx ry rz [degrees]; empty: none

    def wrench(self, raw: Array, bias: Array) -> Array:
        """Return the wrench (n, 6) [N, N mm] of raw readings (n, 6), with bias (6,) in raw units.

        >>> cal = Calibration("FT1", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.full(6, np.nan), "by hand")
        >>> cal.wrench(np.array([[1e6, 0, -2e6, 0, 500, 0]]), np.array([0, 0, -1e6, 0, 0, 0]))
        array([[ 1. ,  0. , -1. ,  0. ,  0.5,  0. ]])
        """
        return (raw - bias) @ self.matrix.T

    def in_own_frame(self, wrench: Array) -> Array:
        """Return a wrench (n, 6) [N, N mm] about the transducer's own origin and axes, to which `rated` applies."""
        if not self.tool:
            return wrench
        back = np.linalg.inv(_tool_matrix(self.tool)).astype(np.float64)
        return wrench @ back.T

    def with_tool(self, tool: tuple[float, ...]) -> "Calibration":
        """Return the calibration with a tool transform (6,) [mm, degrees] after the transducer's own.

        An origin moved 5 mm towards the transducer: 1 N along y then adds -5 N mm about x.

        >>> cal = Calibration("FT1", "N, N mm", np.eye(6), np.full(6, np.nan), "by hand")
        >>> cal.with_tool((0.0, 0.0, -5.0, 0.0, 0.0, 0.0)).matrix[3].tolist()
        [0.0, -5.0, 0.0, 1.0, 0.0, 0.0]
        """
        description = "tool transform {:g} {:g} {:g} mm, {:g} {:g} {:g} degrees".format(*tool)
        matrix = _tool_matrix(tool) @ self.matrix
        return replace(self, matrix=matrix, tool=tool, source=f"{self.source}; {description}, as the address says")


def wrench_transform(displacement: Array, rotation: Array) -> Array:
    """Return the matrix (6, 6) that takes a wrench [N, N mm] to a frame with a `displacement` (3,) [mm] and `rotation`.

    The `rotation` (3,) [rad] is about x, then y, then z, as in the maker's DAQ F/T C library (ftrt.c, version 1.0.2).

    >>> wrench_transform(np.array([0.0, 0.0, 4.0]), np.zeros(3))[3:, :3] + 0.0
    array([[ 0.,  4.,  0.],
           [-4.,  0.,  0.],
           [ 0.,  0.,  0.]])
    """
    (sx, sy, sz), (cx, cy, cz) = np.sin(rotation), np.cos(rotation)
    turn = np.array(
        [
            [cy * cz, sx * sy * cz + cx * sz, sx * sz - cx * sy * cz],
            [-cy * sz, -sx * sy * sz + cx * cz, sx * cz + cx * sy * sz],
            [sy, -sx * cy, cx * cy],
        ]
    )
    dx, dy, dz = displacement
    lever = np.array([[0.0, dz, -dy], [-dz, 0.0, dx], [dy, -dx, 0.0]])
    return np.block([[turn, np.zeros((3, 3))], [turn @ lever, turn]])


def _tool_matrix(tool: tuple[float, ...]) -> Array:
    return wrench_transform(np.array(tool[:3]), np.radians(tool[3:]))


WARNING = 0.8  # of a range [-]
# Loads of single axes, and the combined load, at which the Ethernet Axia's manual calls a reading out of range.
LIMITS = (1.0,) * 6 + (1.05,)


def loads(wrench: Array, rated: Array) -> Array:
    """Return the sizes of a wrench (n, 6) [N, N mm] relative to its ranges, and the combined load (n, 7) [-].

    Lateral forces strain the same beams as the torque about z, and the force along z the same as lateral torques: the
    combined load is the greater of Fxy + Tz and Fz + Txy, magnitudes over their ranges (maker's manual of the Ethernet
    Axia, status bit 30). nan where a range `rated` (6,) is unknown.

    >>> loads(np.array([[18.0, 0.0, -9.0, 0.0, 0.0, 250.0]]), np.array([36.0, 36.0, 36.0, 500.0, 500.0, 500.0]))
    array([[0.5 , 0.  , 0.25, 0.  , 0.  , 0.5 , 1.  ]])
    """
    fx, fy, fz, tx, ty, tz = shares = np.abs(wrench / rated).T
    sums = np.maximum(np.hypot(fx, fy) + tz, fz + np.hypot(tx, ty))
    return np.column_stack([*shares, sums])
