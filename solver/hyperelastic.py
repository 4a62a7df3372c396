"""Finite-strain energy, stress and tangent of the tissues, a class each; the list of laws is at the foot.

Plane strain: F is (..., 2, 2) and F_zz = 1. W is energy per undeformed volume [MPa], P = dW/dF the nominal stress
(first Piola-Kirchhoff), and A = dP/dF. Every law here is W = shape(Q) + lambda/2 (ln J)^2 with
Q = tr C - 3 - 2 ln J >= 0, so that elements may replace ln J in the last term by a best fit of it.
"""

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Law(Protocol):
    """What an element asks of a law."""

    name: ClassVar[str]

    @property
    def shear(self) -> float:
        """Shear modulus of the undeformed tissue [MPa]."""
        ...

    @property
    def lame(self) -> float:
        """Lamé's first constant of the undeformed tissue [MPa]."""
        ...

    @property
    def stiffening(self) -> float:
        """Exponent b of exp(b Q) by which the shear modulus grows with strain, 0 where it stays [-]."""
        ...


@dataclass(frozen=True, slots=True)
class NeoHooke:
    """W = G/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2 (Simo and Pister 1984, Comput. Meth. Appl. Mech. Eng. 46, 201).

    P = G (F - F^-T) + lambda ln J F^-T. A dermis held at its sides and pressed to 0.8 of its height:

    >>> float(energy(NeoHooke(0.08, 0.48), np.diag([1.0, 0.8])).round(6))
    0.017315
    """

    name: ClassVar[str] = "neo-Hooke"
    E: float  # Young's modulus of the undeformed tissue [MPa]
    nu: float  # its Poisson's ratio [-]

    @property
    def shear(self) -> float:
        """G = E / (2 (1 + nu)) [MPa]."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def lame(self) -> float:
        """Lamé's first constant, lambda = E nu / ((1 + nu) (1 - 2 nu)) [MPa]."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))

    @property
    def stiffening(self) -> float:
        """No stiffening."""
        return 0.0


@dataclass(frozen=True, slots=True)
class Demiray:
    """W = G/(2 b) (exp(b (tr C - 3 - 2 ln J)) - 1) + lambda/2 (ln J)^2: skin that stiffens as its collagen straightens.

    The exponential in the first invariant is Demiray's (1972, J. Biomech. 5, 309, eq. 16), made compressible like the
    neo-Hookean law, which it becomes as b goes to 0. P = G exp(b Q) (F - F^-T) + lambda ln J F^-T.
    Simple shear 1 has Q = 1, so that b = 1 multiplies its energy G/2 by e - 1:

    >>> law = Demiray(0.08, 0.48, 1.0)
    >>> float((energy(law, np.array([[1.0, 1.0], [0.0, 1.0]])) / (law.shear / 2.0)).round(6))
    1.718282
    """

    name: ClassVar[str] = "Demiray"
    E: float  # Young's modulus of the undeformed tissue [MPa]
    nu: float  # its Poisson's ratio [-]
    stiffening: float  # b [-]

    @property
    def shear(self) -> float:
        """G = E / (2 (1 + nu)) [MPa]."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def lame(self) -> float:
        """Lamé's first constant, lambda = E nu / ((1 + nu) (1 - 2 nu)) [MPa]."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))


def _parts(F: Array) -> tuple[Array, Array, Array]:
    """Return J (...), F^-T (..., 2, 2) and Q (...)."""
    J = F[..., 0, 0] * F[..., 1, 1] - F[..., 0, 1] * F[..., 1, 0]
    adjugate = np.empty_like(F)
    adjugate[..., 0, 0], adjugate[..., 1, 1] = F[..., 1, 1], F[..., 0, 0]
    adjugate[..., 0, 1], adjugate[..., 1, 0] = -F[..., 1, 0], -F[..., 0, 1]
    Q = np.sum(F * F, axis=(-2, -1)) - 2.0 - 2.0 * np.log(J)
    return J, adjugate / J[..., None, None], Q


def energy(law: Law, F: Array) -> Array:
    """Return W (...) [MPa] at deformation gradients F (..., 2, 2); nan where det F is not positive."""
    J, _, Q = _parts(F)
    b = law.stiffening
    shape = (np.exp(b * Q) - 1.0) / b if b > 0.0 else Q
    return law.shear / 2.0 * shape + law.lame / 2.0 * np.log(J) ** 2


def stress(law: Law, F: Array) -> Array:
    """Return the nominal stress P (..., 2, 2) [MPa], tension positive; the Cauchy stress is P F^T / J.

    >>> F = np.diag([1.0, 0.8])
    >>> (stress(NeoHooke(0.08, 0.48), F) @ F.T / 0.8).round(6)[1, 1].item()  # sides held
    -0.193089
    """
    J, inverse, Q = _parts(F)
    shear = (law.shear * np.exp(law.stiffening * Q))[..., None, None]
    return shear * (F - inverse) + law.lame * np.log(J)[..., None, None] * inverse


def tangent(law: Law, F: Array) -> Array:
    """Return dP_aA/dF_bB (..., a, A, b, B) [MPa]."""
    J, inverse, Q = _parts(F)
    wide = (..., None, None, None, None)
    shear = (law.shear * np.exp(law.stiffening * Q))[wide]
    pressure = law.lame * np.log(J)[wide]
    excess = F - inverse
    unit = np.einsum("ab,AB->aAbB", np.eye(2), np.eye(2))
    crossed = np.einsum("...aB,...bA->...aAbB", inverse, inverse)  # minus the derivative of F^-T
    grown = np.einsum("...aA,...bB->...aAbB", excess, excess)
    squeezed = np.einsum("...aA,...bB->...aAbB", inverse, inverse)
    return shear * (unit + crossed + 2.0 * law.stiffening * grown) - pressure * crossed + law.lame * squeezed


LAWS = (NeoHooke, Demiray)
