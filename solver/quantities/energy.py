"""Strain-energy density and its parts: by change of volume, and by change of shape."""

import numpy as np

from solver.arrays import Array
from solver.constitutive.hyperelastic import shape
from solver.quantities.local_state import LocalState, Quantity


def _small(at: LocalState) -> Array:
    """Return W = G eps:eps + lambda/2 theta^2 [MPa]."""
    squares = at.xx**2 + at.yy**2 + at.engineering_shear**2 / 2.0
    return at.shear * squares + at.lame / 2.0 * at.dilatation**2


def _finite(at: LocalState) -> Array:
    """Return W of `solver.constitutive.hyperelastic` [MPa], ln J being the element's best fit of it."""
    return at.shear / 2.0 * shape(at.stiffening, at.excess) + at.lame / 2.0 * at.dilatation**2


def _small_volumetric(at: LocalState) -> Array:
    """Return K/2 theta^2, K = lambda + 2 G/3; the part of it that G makes is of the volume strain at the place."""
    return at.lame / 2.0 * at.dilatation**2 + at.shear / 3.0 * at.trace**2


def _finite_volumetric(at: LocalState) -> Array:
    """Return W of the same change of volume, alike in all three directions."""
    dilated = 3.0 * np.expm1(2.0 / 3.0 * at.log_volume) - 2.0 * at.log_volume  # tr C - 3 - 2 ln J
    return at.shear / 2.0 * shape(at.stiffening, dilated) + at.lame / 2.0 * at.dilatation**2


SED = Quantity("sed", "SED", "MPa", "strain-energy density", _small, _finite)
VOLUMETRIC = Quantity(
    "sed_volumetric",
    "SED of volume",
    "MPa",
    "strain-energy density of the same change of volume, alike in all directions",
    _small_volumetric,
    _finite_volumetric,
)
DEVIATORIC = Quantity(
    "sed_deviatoric",
    "SED of shape",
    "MPa",
    "strain-energy density less that of the change of volume",
    lambda at: _small(at) - _small_volumetric(at),
    lambda at: _finite(at) - _finite_volumetric(at),
)
QUANTITIES = (SED, DEVIATORIC, VOLUMETRIC)
