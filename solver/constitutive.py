"""Energy, stress and tangent of the tissues' laws, one class each; `MATERIALS` and `LAWS` at the end list them.

At small strain, gradients are displacement gradients. At finite strain, F is (..., 2, 2) with F_zz = 1 (plane
strain). W is energy per undeformed volume [MPa], P = dW/dF the nominal stress (first Piola-Kirchhoff) and A = dP/dF.
Every law at finite strain is W = G/2 shape(Q) + lambda/2 (ln J)^2 with Q = tr C - 3 - 2 ln J >= 0. Elements may
therefore replace ln J in the last term by its best fit.
"""

from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, cast

import numpy as np

from solver.arrays import NEO_HOOKEAN, Array, determinant, inverse

HUMAN_SKIN = 9.0  # Ogden's exponent of human skin (ascribed to Shergold and Fleck 2004; docs/scene-file.md)
_NEAR = 0.04  # Q up to which the series is used: above, the closed form loses no digits
TERMS = 14  # terms of the series, enough for exponents up to 20


class Elasticity(Protocol):
    """Elastic constants of a material that elements need."""

    @property
    def shear(self) -> float:
        """Shear modulus of the undeformed tissue [MPa]."""

    @property
    def lame(self) -> float:
        """Lamé's first constant of the undeformed tissue [MPa]."""


@dataclass(frozen=True, slots=True)
class Isotropic:
    """An isotropic elastic tissue, given by its two small-strain constants.

    >>> round(Isotropic(0.08, 0.48).shear, 8), round(Isotropic(0.08, 0.48).lame, 8)
    (0.02702703, 0.64864865)
    """

    E: float  # Young's modulus [MPa]
    nu: float  # Poisson's ratio [-]

    @property
    def shear(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)) [MPa]."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def lame(self) -> float:
        """Lamé's first constant, lambda = E nu / ((1 + nu) (1 - 2 nu)) [MPa]."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))


@dataclass(frozen=True, slots=True)
class Hooke(Isotropic):
    """Isotropic elasticity: W = G eps:eps + lambda/2 (tr eps)^2, sigma = 2 G eps + lambda tr(eps) 1 with eps_zz = 0."""


@dataclass(frozen=True, slots=True)
class Moduli:
    """The two moduli in the integrals of an element."""

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
class Prony(Isotropic):
    """Linear viscoelasticity at small strain: Hooke's law whose shear modulus relaxes in terms (g, tau).

    G(t) = G (1 - sum g + sum g exp(-t/tau)), and the bulk modulus does not relax: a generalised Maxwell solid, as in
    Simo and Hughes (1998), Computational Inelasticity, sec. 10.2. E and nu are the instantaneous constants.
    """

    terms: tuple[tuple[float, float], ...] = ()  # g [-] and tau [s] of each

    @property
    def bulk(self) -> float:
        """Bulk modulus K = lambda + 2 G / 3 [MPa]."""
        return self.lame + 2.0 / 3.0 * self.shear

    @property
    def long_term(self) -> float:
        """Long-term part of the shear modulus [-]."""
        return 1.0 - sum(g for g, _ in self.terms)

    @property
    def long_term_moduli(self) -> Moduli:
        """The long-term moduli.

        >>> round(Prony(0.08, 0.48, ((0.3, 1.0),)).long_term_moduli.shear / Prony(0.08, 0.48).shear, 6)
        0.7
        """
        return self._with(self.long_term)

    def within(self, step: float) -> Moduli:
        """Return the secant moduli at the end of a `step` [s] in which strain grows linearly from zero.

        After one relaxation time the shear modulus is 0.7 + 0.3 (1 - 1/e) of the instantaneous one:

        >>> round(Prony(0.08, 0.48, ((0.3, 1.0),)).within(1.0).shear / Prony(0.08, 0.48).shear, 6)
        0.889636
        """
        return self._with(self.long_term + sum(g * float(mean_decay(np.asarray(step / tau))) for g, tau in self.terms))

    def _with(self, part: float) -> Moduli:
        shear = part * self.shear
        return Moduli(shear, self.bulk - 2.0 / 3.0 * shear)


def mean_decay(times: Array) -> Array:
    """Return the unrelaxed part of a strain that grew linearly for `times` > 0 relaxation times: (1 - exp(-x)) / x."""
    return -np.expm1(-times) / times


class Law(Elasticity, Protocol):
    """Properties of a finite-strain law that elements need."""

    name: ClassVar[str]

    @property
    def stiffening(self) -> float:
        """Ogden's exponent, by which the shear modulus grows with strain; NEO_HOOKEAN for a constant modulus [-]."""


@dataclass(frozen=True, slots=True)
class NeoHooke(Isotropic):
    """W = G/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2 (Simo and Pister 1984, Comput. Meth. Appl. Mech. Eng. 46, 201).

    P = G (F - F^-T) + lambda ln J F^-T.
    """

    name: ClassVar[str] = "neo-Hooke"

    @property
    def stiffening(self) -> float:
        """The exponent of a constant shear modulus."""
        return NEO_HOOKEAN


@dataclass(frozen=True, slots=True)
class Ogden(Isotropic):
    """W = 2 G/a^2 (l^a + l^-a - 2) + lambda/2 (ln J)^2, with l^2 + l^-2 - 2 = Q: skin, which stiffens with strain.

    Ogden's law of one term (1972, Proc. R. Soc. Lond. A 326, 565) in plane strain, where l and 1/l are the stretches at
    constant volume. It is made compressible like the neo-Hookean law, which is the case a = 2. For human skin, a = 9 is
    ascribed to Shergold and Fleck (2004, Proc. R. Soc. Lond. A 460, 3037). P = G f(Q) (F - F^-T) + lambda ln J F^-T
    with f = 2/a sinh(a s)/sinh(2 s), l = exp(s). At a stretch of 2 with a = 4, W is 2 G/16 (16 + 1/16 - 2):

    >>> float((shape(np.array(4.0), np.array(2.0**2 + 0.5**2 - 2.0)) / 2.0).round(6))
    1.757812
    """

    name: ClassVar[str] = "Ogden"
    stiffening: float = HUMAN_SKIN  # a [-]


def log1p(x: Array) -> Array:
    """Return ln(1 + x); `np.log1p` loses digits of a small complex x. Imaginary parts must be infinitesimal."""
    log = np.log1p(x.real)
    return cast("Array", log + 1j * (x.imag / (1.0 + x.real))) if np.iscomplexobj(x) else log


def shape(exponent: Array, Q: Array) -> Array:
    """Return W / (G/2) (...), without the term of ln J, for Ogden's exponents: 16/a^2 sinh^2(a s/2), Q = 4 sinh^2 s."""
    positive = np.where(np.real(Q) > 0.0, Q, 0.0 * Q)
    if np.all(exponent == NEO_HOOKEAN):
        return positive
    return 16.0 / exponent**2 * np.sinh(exponent / 2.0 * np.arcsinh(np.sqrt(positive) / 2.0)) ** 2


def slopes(exponent: Array, Q: Array) -> tuple[Array, Array]:
    """Return f = dW/dQ / (G/2), the growth factor of the shear modulus, and df/dQ (...).

    f is Gauss's series 2F1(1 + a/2, 1 - a/2; 3/2; -Q/4); its first terms are used where Q is small.

    >>> [float(number) for number in slopes(np.array(4.0), np.array(0.01))]  # 1 + Q/2
    [1.005, 0.5]
    """
    a, x = exponent, -Q / 4.0
    value, slope, term = np.ones_like(x), np.zeros_like(x), np.ones_like(x)
    for n in range(TERMS):
        factor = (1.0 + a / 2.0 + n) * (1.0 - a / 2.0 + n) / ((1.5 + n) * (n + 1.0))
        slope = slope - (n + 1.0) / 4.0 * factor * term
        term = term * factor * x
        value = value + term
    far = np.real(Q) > _NEAR
    s = np.arcsinh(np.sqrt(np.where(far, Q, 1.0)) / 2.0)
    sinh_a, sinh_2 = np.sinh(a * s), np.sinh(2.0 * s)
    factor_far = 2.0 / a * sinh_a / sinh_2
    slope_far = (2.0 * np.cosh(a * s) - 2.0 * factor_far * np.cosh(2.0 * s)) / (4.0 * sinh_2**2)
    return np.where(far, factor_far, value), np.where(far, slope_far, slope)


def _parts(F: Array) -> tuple[Array, Array, Array]:
    """Return J (...), F^-T (..., 2, 2) and Q (...)."""
    J = determinant(F)
    return J, inverse(np.swapaxes(F, -2, -1)), np.sum(F * F, axis=(-2, -1)) - 2.0 - 2.0 * np.log(J)


def stress(law: Law, F: Array) -> Array:
    """Return the nominal stress P (..., 2, 2) [MPa], tension positive; the Cauchy stress is P F^T / J.

    >>> F = np.diag([1.0, 0.8])
    >>> (stress(NeoHooke(0.08, 0.48), F) @ F.T / 0.8).round(6)[1, 1].item()  # sides held
    -0.193089
    """
    J, inverse, Q = _parts(F)
    shear = (law.shear * slopes(np.array(law.stiffening), Q)[0])[..., None, None]
    return shear * (F - inverse) + law.lame * np.log(J)[..., None, None] * inverse


def tangent(law: Law, F: Array) -> Array:
    """Return dP_aA/dF_bB (..., a, A, b, B) [MPa]."""
    J, inverse, Q = _parts(F)
    wide = (..., None, None, None, None)
    factor, slope = slopes(np.array(law.stiffening), Q)
    shear, shear_slope = (law.shear * factor)[wide], (2.0 * law.shear * slope)[wide]
    pressure = law.lame * np.log(J)[wide]
    excess = F - inverse
    unit = np.einsum("ab,AB->aAbB", np.eye(2), np.eye(2))
    inverse_slope = np.einsum("...aB,...bA->...aAbB", inverse, inverse)  # minus the derivative of F^-T
    excess_dyad = np.einsum("...aA,...bB->...aAbB", excess, excess)
    dyad = np.einsum("...aA,...bB->...aAbB", inverse, inverse)
    return shear * (unit + inverse_slope) + shear_slope * excess_dyad - pressure * inverse_slope + law.lame * dyad


def inverse_metric(F: Array) -> Array:
    """Return B = (C J^-2/3)^-1 (..., 4) for deformation gradients F (..., 2, 2).

    >>> inverse_metric(np.array([[1.0, 0.5], [0.0, 1.0]])).tolist()  # simple shear
    [1.25, 1.0, -0.5, 1.0]
    """
    J = determinant(F)
    xx = F[..., 0, 0] ** 2 + F[..., 1, 0] ** 2
    yy = F[..., 0, 1] ** 2 + F[..., 1, 1] ** 2
    xy = F[..., 0, 0] * F[..., 0, 1] + F[..., 1, 0] * F[..., 1, 1]
    scale = J ** (2.0 / 3.0)
    return np.stack([scale * yy / J**2, scale * xx / J**2, -scale * xy / J**2, scale + 0.0 * J], axis=-1)


def overstress(T: Array, F: Array) -> Array:
    """Return the nominal stress (..., 2, 2) [MPa], J^-2/3 (F T - T:C/3 F^-T).

    For a term of 1 MPa, suddenly sheared by 0.5, the true shear stress is 0.5 MPa:

    >>> F = np.array([[1.0, 0.5], [0.0, 1.0]])
    >>> (overstress(np.array([1.0, 1.0, 0.0, 1.0]), F) @ F.T).round(6)[0, 1].item()
    0.5
    """
    product = F @ np.stack([T[..., [0, 2]], T[..., [2, 1]]], axis=-2)
    pressure = (np.sum(product * F, axis=(-2, -1)) + T[..., 3])[..., None, None] / 3.0  # T:C/3
    scale = (determinant(F) ** (-2.0 / 3.0))[..., None, None]
    return scale * (product - pressure * inverse(np.swapaxes(F, -2, -1)))


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """Strain history of p points, which gives the overstress of relaxing tissue; at most m terms at each.

    Each term (g, tau) is a network whose strands detach and reattach unstrained (Green and Tobolsky 1946, J. Chem.
    Phys. 14, 80; as a law of solids Linder, Tkachuk and Miehe 2011, J. Mech. Phys. Solids 59, 2134). A is the inverse
    metric in which the network would be unstrained. It relaxes towards the body's, B = (C J^-2/3)^-1. The stress is
    isochoric, as in Simo (1987, Comput. Meth. Appl. Mech. Eng. 60, 153):

        dA/dt = (B - A)/tau,    W = g G/2 (tr(A B^-1) - 3 - ln det A),    S = g G J^-2/3 (A - (A:C)/3 C^-1).

    Energy is only dissipated, at a rate of g G/(2 tau) times the sum of a + 1/a - 2 over the eigenvalues a of A B^-1.
    After a sudden strain S decays as exp(-t/tau); at small strain this is the generalised Maxwell solid of `Prony`.
    Within a step B changes linearly, for which the recursion is exact (as in `equilibrium.relaxation`). All terms act
    as one tensor T = sum g G A', where A' is A without the share of B at the end, which carries no stress. A step is
    thus elastic with W = 1/2 J^-2/3 T:C. Tensors are (..., 4): xx, yy, xy, zz, the other two zero; plane strain.
    """

    shear: Array  # (p, m) g G [MPa]
    tau: Array  # (p, m) [s]
    metric: Array  # (p, m, 4) A of each term
    previous: Array  # (p, 4) B at the last instant

    @staticmethod
    def at_rest(shear: Array, tau: Array) -> "Past":
        """Return the history of points that were never strained."""
        unit = np.array([1.0, 1.0, 0.0, 1.0])
        return Past(shear, tau, np.broadcast_to(unit, (*shear.shape, 4)), np.broadcast_to(unit, (len(shear), 4)))

    def _decay(self, step: float) -> Array:
        """Return A' (p, m, 4) at the end of a `step` [s]."""
        ages = step / self.tau
        decay, mean = np.exp(-ages), mean_decay(ages)
        return decay[..., None] * self.metric + (mean - decay)[..., None] * self.previous[:, None]

    def over(self, step: float) -> Array:
        """Return T (p, 4) [MPa] for a `step` [s]."""
        return np.sum(self.shear[..., None] * self._decay(step), axis=1)

    def after(self, F: Array, step: float) -> "Past":
        """Return the history after a `step` [s] that ends at the deformation gradients F (p, 2, 2)."""
        B = inverse_metric(F)
        metric = self._decay(step) + (1.0 - mean_decay(step / self.tau))[..., None] * B[:, None]
        return replace(self, metric=metric, previous=B)

    def energy(self) -> Array:
        """Return the energy density (p,) [MPa] stored in the terms."""
        A, B = self.metric, self.previous[:, None]
        det = B[..., 0] * B[..., 1] - B[..., 2] ** 2
        trace = (A[..., 0] * B[..., 1] + A[..., 1] * B[..., 0] - 2.0 * A[..., 2] * B[..., 2]) / det
        trace = trace + A[..., 3] / B[..., 3]
        volume = np.log((A[..., 0] * A[..., 1] - A[..., 2] ** 2) * A[..., 3])
        return np.sum(self.shear / 2.0 * (trace - 3.0 - volume), axis=1)


MATERIALS = (Hooke, Prony)
LAWS = (NeoHooke, Ogden)
