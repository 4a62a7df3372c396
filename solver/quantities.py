"""Responses of the tissue at a receptor, and the local state they follow from: energies, strains and stresses.

At an ending, each response is averaged over the points of its patch. Strains along the skin are in the frame of the
undeformed skin; stretches are given less one. Stresses are Cauchy stresses, including the out-of-plane stress.
`QUANTITIES` lists the responses; the first is the published one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solver.arrays import Array
from solver.constitutive import log1p, shape, slopes

Stress = tuple[Array, Array, Array, Array]  # xx, yy, xy, zz of plane strain [MPa], tension positive


@dataclass(frozen=True, eq=False)  # without slots, for cached properties
class LocalState:
    """Deformation and moduli of n points, each in c states of the body. All arrays broadcast to (n, c).

    The displacement gradient is du_a/dx_b; small strain uses only its symmetric part. `tangent` is a unit vector along
    the undeformed skin above the point, towards the tip; its normal points into the tissue. Numbers may be complex, for
    complex-step derivatives.
    """

    xx: Array
    xy: Array
    yx: Array
    yy: Array
    dilatation: Array  # volume strain at small strain, ln J at finite: the element's best fit [-]
    shear: Array  # modulus [MPa]
    lame: Array  # Lamé's first constant [MPa]
    stiffening: Array  # Ogden's exponent [-]; at small strain unused
    tangent: tuple[Array, Array]

    @property
    def volume(self) -> Array:
        """J, the ratio of deformed to undeformed volume at the point [-]."""
        return 1.0 + self._volume_growth

    @cached_property
    def log_volume(self) -> Array:
        """Logarithm of J at the point, without cancellation [-]."""
        return log1p(self._volume_growth)

    @cached_property
    def excess(self) -> Array:
        """Tr C - 3 - 2 ln J at the point, without cancellation [-]."""
        squares = self.xx**2 + self.xy**2 + self.yx**2 + self.yy**2
        return 2.0 * (self.trace - self.log_volume) + squares

    @cached_property
    def _volume_growth(self) -> Array:
        return self.trace + self.xx * self.yy - self.xy * self.yx

    @property
    def trace(self) -> Array:
        """Trace of the displacement gradient: at small strain, the volume strain at the point [-]."""
        return self.xx + self.yy

    @property
    def engineering_shear(self) -> Array:
        """The engineering shear strain between x and y, at small strain [-]."""
        return self.xy + self.yx

    @cached_property
    def small_stress(self) -> Stress:
        """The stress sigma = 2 G eps + lambda theta 1 at small strain [MPa]."""
        bulk = self.lame * self.dilatation
        return (
            2.0 * self.shear * self.xx + bulk,
            2.0 * self.shear * self.yy + bulk,
            self.shear * self.engineering_shear,
            bulk,
        )

    @cached_property
    def finite_stress(self) -> Stress:
        """The Cauchy stress sigma = (G f (F F^T - 1) + lambda ln J 1) / J [MPa]."""
        J = self.volume
        shear = self.shear * slopes(self.stiffening, self.excess)[0] / J
        bulk = self.lame * self.dilatation / J
        return (
            shear * (2.0 * self.xx + self.xx**2 + self.xy**2) + bulk,
            shear * (2.0 * self.yy + self.yy**2 + self.yx**2) + bulk,
            shear * (self.xy + self.yx + self.xx * self.yx + self.xy * self.yy),
            bulk,
        )


@dataclass(frozen=True, slots=True)
class Quantity:
    """One response of the tissue at a point."""

    name: str  # key in files and options
    label: str  # name in tables and figures
    unit: str  # "MPa", or "-" for a strain
    meaning: str  # one phrase
    small: Callable[[LocalState], Array]
    finite: Callable[[LocalState], Array]
    signed: bool = True  # False: never below 0

    @property
    def shown_unit(self) -> tuple[str, float]:
        """Return the unit for display, and the factor from `unit` to it.

        >>> SED.shown_unit, SHEAR.shown_unit
        (('kPa', 1000.0), ('1', 1.0))
        """
        return ("kPa", 1e3) if self.unit == "MPa" else ("1", 1.0)


def _small_energy(local: LocalState) -> Array:
    """Return W = G eps:eps + lambda/2 theta^2 [MPa]."""
    squares = local.xx**2 + local.yy**2 + local.engineering_shear**2 / 2.0
    return local.shear * squares + local.lame / 2.0 * local.dilatation**2


def _finite_energy(local: LocalState) -> Array:
    """Return W of `solver.constitutive` [MPa]; ln J is the element's best fit."""
    return local.shear / 2.0 * shape(local.stiffening, local.excess) + local.lame / 2.0 * local.dilatation**2


def _small_volumetric(local: LocalState) -> Array:
    """Return K/2 theta^2 [MPa], K = lambda + 2 G/3; the term in G uses the volume strain at the point."""
    return local.lame / 2.0 * local.dilatation**2 + local.shear / 3.0 * local.trace**2


def _finite_volumetric(local: LocalState) -> Array:
    """Return W of the same change of volume with equal stretches in all three directions [MPa]."""
    dilated = 3.0 * np.expm1(2.0 / 3.0 * local.log_volume) - 2.0 * local.log_volume  # tr C - 3 - 2 ln J
    return local.shear / 2.0 * shape(local.stiffening, dilated) + local.lame / 2.0 * local.dilatation**2


SED = Quantity("sed", "SED", "MPa", "strain-energy density", _small_energy, _finite_energy, signed=False)
VOLUMETRIC = Quantity(
    "sed_volumetric", "SED of volume", "MPa",
    "strain-energy density of the same change of volume, alike in all directions",
    _small_volumetric, _finite_volumetric, signed=False,
)  # fmt: skip
DEVIATORIC = Quantity(
    "sed_deviatoric", "SED of shape", "MPa", "strain-energy density less that of the change of volume",
    lambda local: _small_energy(local) - _small_volumetric(local),
    lambda local: _finite_energy(local) - _finite_volumetric(local),
    signed=False,
)  # fmt: skip


def _small_radius(local: LocalState) -> Array:
    """Return the radius of Mohr's circle of strains [-]."""
    return np.sqrt((local.xx - local.yy) ** 2 + local.engineering_shear**2) / 2.0


def _finite_sum(local: LocalState) -> Array:
    """Return the sum of the principal stretches in the plane [-]."""
    return np.sqrt((2.0 + local.xx + local.yy) ** 2 + (local.xy - local.yx) ** 2)


def _finite_difference(local: LocalState) -> Array:
    """Return the difference of the principal stretches in the plane [-]."""
    return np.sqrt((local.xx - local.yy) ** 2 + local.engineering_shear**2)


def _small_along(local: LocalState) -> Array:
    x, y = local.tangent
    return x * x * local.xx + y * y * local.yy + x * y * local.engineering_shear


def _small_shear_along(local: LocalState) -> Array:
    x, y = local.tangent
    return _size((x * x - y * y) * local.engineering_shear + 2.0 * x * y * (local.yy - local.xx))


def _lines(local: LocalState) -> tuple[Array, Array, Array, Array]:
    """Return F t and F n, x and y of each, for the skin's tangent t and normal n."""
    x, y = local.tangent
    return (
        x + local.xx * x + local.xy * y,
        y + local.yx * x + local.yy * y,
        -y - local.xx * y + local.xy * x,
        x - local.yx * y + local.yy * x,
    )


def _finite_along(local: LocalState) -> Array:
    x, y, _, _ = _lines(local)
    return np.sqrt(x * x + y * y) - 1.0


def _finite_shear_along(local: LocalState) -> Array:
    x, y, across, up = _lines(local)
    return _size((x * across + y * up) / local.volume)


def _size(number: Array) -> Array:
    """Return the absolute value, in a form that complex-step derivatives pass through."""
    return np.sqrt(number * number)


GREATEST_STRAIN = Quantity(
    "principal_strain_greatest", "greatest principal strain", "-", "greatest principal stretch in the plane, less one",
    lambda local: local.trace / 2.0 + _small_radius(local),
    lambda local: (_finite_sum(local) + _finite_difference(local)) / 2.0 - 1.0,
)  # fmt: skip
LEAST_STRAIN = Quantity(
    "principal_strain_least", "least principal strain", "-", "least principal stretch in the plane, less one",
    lambda local: local.trace / 2.0 - _small_radius(local),
    lambda local: (_finite_sum(local) - _finite_difference(local)) / 2.0 - 1.0,
)  # fmt: skip
SHEAR = Quantity(
    "shear_greatest", "greatest shear", "-",
    "difference of the principal stretches in the plane: the greatest engineering shear at small strain",
    lambda local: 2.0 * _small_radius(local), _finite_difference, signed=False,
)  # fmt: skip
SHEAR_ALONG = Quantity(
    "shear_along_skin", "shear along the skin", "-",
    "size of the tangent of the angle by which skin's tangent and normal leave their right angle",
    _small_shear_along, _finite_shear_along, signed=False,
)  # fmt: skip
STRETCH_ALONG = Quantity(
    "stretch_along_skin", "stretch along the skin", "-", "stretch of a line along the skin at rest, less one",
    _small_along, _finite_along,
)  # fmt: skip


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


def _stress_quantity(
    name: str, label: str, meaning: str, invariant: Callable[[Stress], Array], *, signed: bool = True
) -> Quantity:
    """Return the quantity that is an `invariant` of the stress [MPa]."""
    return Quantity(
        name,
        label,
        "MPa",
        meaning,
        lambda local: invariant(local.small_stress),
        lambda local: invariant(local.finite_stress),
        signed,
    )


PRESSURE = _stress_quantity(
    "pressure", "pressure", "mean of the three normal stresses, compression positive", _pressure
)
VON_MISES = _stress_quantity("von_mises", "von Mises stress", "von Mises stress", _von_mises, signed=False)
GREATEST_STRESS = _stress_quantity(
    "principal_stress_greatest",
    "greatest principal stress",
    "greatest of the three principal stresses, tension positive",
    lambda stress: _principal(stress)[0],
)
LEAST_STRESS = _stress_quantity(
    "principal_stress_least",
    "least principal stress",
    "least of the three principal stresses, tension positive",
    lambda stress: _principal(stress)[1],
)

QUANTITIES = (
    SED, DEVIATORIC, VOLUMETRIC, GREATEST_STRAIN, LEAST_STRAIN, SHEAR, SHEAR_ALONG, STRETCH_ALONG, PRESSURE, VON_MISES,
)  # fmt: skip
NAMES: tuple[str, ...] = tuple(quantity.name for quantity in QUANTITIES)
# Quantities in pictures of the tissue. Principal stresses are only shown: no receptor is said to respond to them.
FIELDS = (SED, GREATEST_STRAIN, LEAST_STRAIN, GREATEST_STRESS, LEAST_STRESS, VON_MISES, PRESSURE)
