"""Strains: principal ones, and those along the skin, in the frame of the skin at rest. Stretches are given less one."""

import numpy as np

from solver.arrays import Array
from solver.quantities.local_state import LocalState, Quantity


def _small_radius(at: LocalState) -> Array:
    """Return the radius of Mohr's circle of strains [-]."""
    return np.sqrt((at.xx - at.yy) ** 2 + at.engineering_shear**2) / 2.0


def _finite_sum(at: LocalState) -> Array:
    """Return the sum of the principal stretches in the plane [-]."""
    return np.sqrt((2.0 + at.xx + at.yy) ** 2 + (at.xy - at.yx) ** 2)


def _finite_difference(at: LocalState) -> Array:
    """Return the difference of the principal stretches in the plane [-]."""
    return np.sqrt((at.xx - at.yy) ** 2 + at.engineering_shear**2)


def _small_along(at: LocalState) -> Array:
    x, y = at.tangent
    return x * x * at.xx + y * y * at.yy + x * y * at.engineering_shear


def _small_shear_along(at: LocalState) -> Array:
    x, y = at.tangent
    return _size((x * x - y * y) * at.engineering_shear + 2.0 * x * y * (at.yy - at.xx))


def _lines(at: LocalState) -> tuple[Array, Array, Array, Array]:
    """Return F t and F n, x and y of each, for the skin's tangent t and normal n."""
    x, y = at.tangent
    return (
        x + at.xx * x + at.xy * y,
        y + at.yx * x + at.yy * y,
        -y - at.xx * y + at.xy * x,
        x - at.yx * y + at.yy * x,
    )


def _finite_along(at: LocalState) -> Array:
    x, y, _, _ = _lines(at)
    return np.sqrt(x * x + y * y) - 1.0


def _finite_shear_along(at: LocalState) -> Array:
    x, y, across, up = _lines(at)
    return _size((x * across + y * up) / at.volume)


def _size(number: Array) -> Array:
    """Return the size of real numbers; that of complex ones keeps their small imaginary parts' slope."""
    return np.sqrt(number * number)


GREATEST = Quantity(
    "principal_strain_greatest",
    "greatest principal strain",
    "-",
    "greatest principal stretch in the plane, less one",
    lambda at: at.trace / 2.0 + _small_radius(at),
    lambda at: (_finite_sum(at) + _finite_difference(at)) / 2.0 - 1.0,
)
LEAST = Quantity(
    "principal_strain_least",
    "least principal strain",
    "-",
    "least principal stretch in the plane, less one",
    lambda at: at.trace / 2.0 - _small_radius(at),
    lambda at: (_finite_sum(at) - _finite_difference(at)) / 2.0 - 1.0,
)
SHEAR = Quantity(
    "shear_greatest",
    "greatest shear",
    "-",
    "difference of the principal stretches in the plane: the greatest engineering shear at small strain",
    lambda at: 2.0 * _small_radius(at),
    _finite_difference,
)
SHEAR_ALONG = Quantity(
    "shear_along_skin",
    "shear along the skin",
    "-",
    "size of the tangent of the angle by which skin's tangent and normal leave their right angle",
    _small_shear_along,
    _finite_shear_along,
)
STRETCH_ALONG = Quantity(
    "stretch_along_skin",
    "stretch along the skin",
    "-",
    "stretch of a line along the skin at rest, less one",
    _small_along,
    _finite_along,
)
QUANTITIES = (GREATEST, LEAST, SHEAR, SHEAR_ALONG, STRETCH_ALONG)
