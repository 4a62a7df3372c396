"""What is known of a place in the tissue, from which every quantity at a receptor follows."""

from collections.abc import Callable
from dataclasses import dataclass

from solver.arrays import Array
from solver.constitutive.hyperelastic import log1p


@dataclass(frozen=True, slots=True, eq=False)
class LocalState:
    """Deformation and moduli of n places, in c states of the body each. All arrays broadcast to (n, c).

    The displacement gradient is du_a/dx_b; at small strain its symmetric part alone. `tangent` is the direction of the
    undeformed skin above the place, towards the tip: a unit vector in the plane. Its normal points into the tissue.
    Numbers may be complex, for derivatives by complex steps.
    """

    xx: Array
    xy: Array
    yx: Array
    yy: Array
    dilatation: Array  # volume strain at small strain, ln J at finite: each element's best fit of it [-]
    shear: Array  # modulus [MPa]
    lame: Array  # Lamé's first constant [MPa]
    stiffening: Array  # Ogden's exponent [-]; at small strain unused
    tangent: tuple[Array, Array]

    @property
    def volume(self) -> Array:
        """J: volume by undeformed volume at the place itself [-]."""
        return 1.0 + self._grown

    @property
    def log_volume(self) -> Array:
        """Logarithm of the volume to the digits of the strains [-]."""
        return log1p(self._grown)

    @property
    def excess(self) -> Array:
        """Tr C - 3 - 2 ln J at the place itself, to the digits of the strains [-]."""
        squares = self.xx**2 + self.xy**2 + self.yx**2 + self.yy**2
        return 2.0 * (self.trace - self.log_volume) + squares

    @property
    def _grown(self) -> Array:
        return self.trace + self.xx * self.yy - self.xy * self.yx

    @property
    def trace(self) -> Array:
        """Trace of the gradient: the volume strain at the place itself, at small strain [-]."""
        return self.xx + self.yy

    @property
    def engineering_shear(self) -> Array:
        """The engineering shear strain between x and y, at small strain [-]."""
        return self.xy + self.yx


@dataclass(frozen=True, slots=True)
class Quantity:
    """One response of the tissue at a place."""

    name: str  # key in files and options
    label: str  # for people
    unit: str  # "MPa", or "-" for a strain
    meaning: str  # in a sentence
    small: Callable[[LocalState], Array]
    finite: Callable[[LocalState], Array]
