"""Energy and stress of the tissues, a class each; the list of materials is at the foot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Hooke:
    """Isotropic linear elasticity at small strain, in plane strain."""

    E: float  # Young's modulus [MPa]
    nu: float  # Poisson's ratio [-]

    @property
    def shear(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)) [MPa].

        >>> round(Hooke(0.08, 0.48).shear, 8)
        0.02702703
        """
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def lame(self) -> float:
        """Lamé's first constant lambda = E nu / ((1 + nu) (1 - 2 nu)) [MPa].

        >>> round(Hooke(0.08, 0.48).lame, 8)
        0.64864865
        """
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))

    def energy(self, gradient: Array) -> Array:
        """Return the strain-energy density (...) [MPa] for displacement gradients (..., 2, 2).

        W = G eps:eps + lambda/2 (tr eps)^2, with eps_zz = 0. Simple shear 0.1 of a dermis stores G 0.1^2 / 2:

        >>> float(Hooke(0.08, 0.48).energy(np.array([[0.0, 0.1], [0.0, 0.0]])).round(9))
        0.000135135
        """
        strain = (gradient + np.swapaxes(gradient, -1, -2)) / 2.0
        trace = np.trace(strain, axis1=-2, axis2=-1)
        return self.shear * np.sum(strain * strain, axis=(-2, -1)) + self.lame / 2.0 * trace**2

    def stress(self, gradient: Array) -> Array:
        """Return the in-plane stress (..., 2, 2) [MPa], sigma = 2 G eps + lambda tr(eps) 1, tension positive."""
        strain = (gradient + np.swapaxes(gradient, -1, -2)) / 2.0
        trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
        return 2.0 * self.shear * strain + self.lame * trace * np.eye(2)


MATERIALS = (Hooke,)
