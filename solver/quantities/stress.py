"""Stresses: pressure and von Mises stress of the Cauchy stress, that across the plane included."""

import numpy as np

from solver.arrays import Array
from solver.constitutive.hyperelastic import slopes
from solver.quantities.local_state import LocalState, Quantity

Stress = tuple[Array, Array, Array, Array]  # xx, yy, xy, zz [MPa], tension positive


def _small(at: LocalState) -> Stress:
    """Return sigma = 2 G eps + lambda theta 1 of plane strain."""
    bulk = at.lame * at.dilatation
    return (
        2.0 * at.shear * at.xx + bulk,
        2.0 * at.shear * at.yy + bulk,
        at.shear * at.engineering_shear,
        bulk,
    )


def _finite(at: LocalState) -> Stress:
    """Return sigma = (G f (F F^T - 1) + lambda ln J 1) / J of plane strain."""
    J = at.volume
    shear = at.shear * slopes(at.stiffening, at.excess)[0] / J
    bulk = at.lame * at.dilatation / J
    return (
        shear * (2.0 * at.xx + at.xx**2 + at.xy**2) + bulk,
        shear * (2.0 * at.yy + at.yy**2 + at.yx**2) + bulk,
        shear * (at.xy + at.yx + at.xx * at.yx + at.xy * at.yy),
        bulk,
    )


def _pressure(stress: Stress) -> Array:
    xx, yy, _, zz = stress
    return -(xx + yy + zz) / 3.0


def _von_mises(stress: Stress) -> Array:
    xx, yy, xy, zz = stress
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2.0 + 3.0 * xy**2)


def _principal(stress: Stress) -> tuple[Array, Array]:
    """Return the greatest and the least of the three principal stresses [MPa]."""
    xx, yy, xy, zz = stress
    middle, radius = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
    return np.maximum(middle + radius, zz), np.minimum(middle - radius, zz)


PRESSURE = Quantity(
    "pressure",
    "pressure",
    "MPa",
    "mean of the three normal stresses, compression positive",
    lambda at: _pressure(_small(at)),
    lambda at: _pressure(_finite(at)),
)
VON_MISES = Quantity(
    "von_mises",
    "von Mises stress",
    "MPa",
    "von Mises stress",
    lambda at: _von_mises(_small(at)),
    lambda at: _von_mises(_finite(at)),
)
GREATEST = Quantity(
    "principal_stress_greatest",
    "greatest principal stress",
    "MPa",
    "greatest of the three principal stresses, tension positive",
    lambda at: _principal(_small(at))[0],
    lambda at: _principal(_finite(at))[0],
)
LEAST = Quantity(
    "principal_stress_least",
    "least principal stress",
    "MPa",
    "least of the three principal stresses, tension positive",
    lambda at: _principal(_small(at))[1],
    lambda at: _principal(_finite(at))[1],
)
QUANTITIES = (PRESSURE, VON_MISES)
