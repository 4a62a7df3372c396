"""Energy and stress of the tissues, a class each; the list of materials is at the foot."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from solver.arrays import Array


def shear_modulus(E: float, nu: float) -> float:
    """Return G = E / (2 (1 + nu)) [MPa].

    >>> round(shear_modulus(0.08, 0.48), 8)
    0.02702703
    """
    return E / (2.0 * (1.0 + nu))


def lame_modulus(E: float, nu: float) -> float:
    """Return Lamé's first constant, lambda = E nu / ((1 + nu) (1 - 2 nu)) [MPa].

    >>> round(lame_modulus(0.08, 0.48), 8)
    0.64864865
    """
    return E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


class Elasticity(Protocol):
    """What elements ask of a material."""

    @property
    def shear(self) -> float:
        """Shear modulus of the undeformed tissue [MPa]."""
        ...

    @property
    def lame(self) -> float:
        """Lamé's first constant of the undeformed tissue [MPa]."""
        ...


@dataclass(frozen=True, slots=True)
class Isotropic:
    """An elastic tissue of two constants, those of its small strains."""

    E: float  # Young's modulus [MPa]
    nu: float  # Poisson's ratio [-]

    @property
    def shear(self) -> float:
        """Shear modulus [MPa]."""
        return shear_modulus(self.E, self.nu)

    @property
    def lame(self) -> float:
        """Lamé's first constant [MPa]."""
        return lame_modulus(self.E, self.nu)


@dataclass(frozen=True, slots=True)
class Hooke(Isotropic):
    """Isotropic linear elasticity at small strain, in plane strain."""

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


@dataclass(frozen=True, slots=True)
class Moduli:
    """The two moduli by which elements are integrated."""

    shear: float  # [MPa]
    lame: float  # Lamé's first constant [MPa]

    @property
    def engineering(self) -> tuple[float, float]:
        """Young's modulus [MPa] and Poisson's ratio.

        >>> [round(number, 6) for number in Moduli(Hooke(0.08, 0.48).shear, Hooke(0.08, 0.48).lame).engineering]
        [0.08, 0.48]
        """
        nu = self.lame / (2.0 * (self.lame + self.shear))
        return 2.0 * self.shear * (1.0 + nu), nu


@dataclass(frozen=True, slots=True)
class Prony:
    """Linear viscoelasticity at small strain: Hooke at once, whose shear modulus relaxes in terms (g, tau).

    G(t) = G (1 - sum g + sum g exp(-t/tau)), the bulk modulus staying as it is: a generalised Maxwell solid, as in Simo
    and Hughes (1998), Computational Inelasticity, sec. 10.2.
    """

    E: float  # Young's modulus at once [MPa]
    nu: float  # Poisson's ratio at once [-]
    terms: tuple[tuple[float, float], ...] = ()  # g [-] and tau [s] of each

    @property
    def instantaneous(self) -> Hooke:
        """The elastic solid that it is in a moment."""
        return Hooke(self.E, self.nu)

    @property
    def shear(self) -> float:
        """Shear modulus at once [MPa]."""
        return self.instantaneous.shear

    @property
    def lame(self) -> float:
        """Lamé's first constant at once [MPa]."""
        return self.instantaneous.lame

    @property
    def bulk(self) -> float:
        """Bulk modulus K = lambda + 2 G / 3 [MPa]."""
        return self.lame + 2.0 / 3.0 * self.shear

    @property
    def long_term(self) -> float:
        """Part of the shear modulus that never relaxes [-]."""
        return 1.0 - sum(g for g, _ in self.terms)

    @property
    def relaxed(self) -> Moduli:
        """The moduli in the end.

        >>> round(Prony(0.08, 0.48, ((0.3, 1.0),)).relaxed.shear / Prony(0.08, 0.48).shear, 6)
        0.7
        """
        return self._with(self.long_term)

    def within(self, step: float) -> Moduli:
        """Return the moduli that a strain has which grows evenly over `step` [s]: what of it is left at the end.

        After one relaxation time that is 0.7 + 0.3 (1 - 1/e):

        >>> round(Prony(0.08, 0.48, ((0.3, 1.0),)).within(1.0).shear / Prony(0.08, 0.48).shear, 6)
        0.889636
        """
        return self._with(self.long_term + sum(g * float(kept(np.asarray(step / tau))) for g, tau in self.terms))

    def _with(self, part: float) -> Moduli:
        shear = part * self.shear
        return Moduli(shear, self.bulk - 2.0 / 3.0 * shear)

    def energy(self, gradient: Array) -> Array:
        """Return the energy density (...) [MPa] stored at once, as `Hooke.energy`."""
        return self.instantaneous.energy(gradient)

    def stress(self, gradient: Array) -> Array:
        """Return the stress (..., 2, 2) [MPa] at once, as `Hooke.stress`."""
        return self.instantaneous.stress(gradient)


def kept(times: Array) -> Array:
    """Return what is left of a strain that grew evenly over so many relaxation times (> 0): (1 - exp(-x)) / x."""
    return -np.expm1(-times) / times


MATERIALS = (Hooke, Prony)
