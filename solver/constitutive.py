"""Energy, stress and tangent of the tissues, a class each; the lists of materials and of laws are at the foot.

At small strain gradients are those of the displacement. At finite strain, in plane strain, F is (..., 2, 2) and
F_zz = 1. W is energy per undeformed volume [MPa], P = dW/dF the nominal stress (first Piola-Kirchhoff) and A = dP/dF.
Every law at finite strain is W = shape(Q) + lambda/2 (ln J)^2 with Q = tr C - 3 - 2 ln J >= 0, so that elements may
replace ln J in the last term by a best fit of it.
"""

from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, cast

import numpy as np

from solver.arrays import Array, determinant, inverse

PLAIN = 2.0  # Ogden's exponent of the neo-Hookean law
HUMAN_SKIN = 9.0  # and that of human skin (ascribed to Shergold and Fleck 2004; docs/scene-file.md)
NEAR = 0.04  # Q up to which the series serves: further on, nothing is lost by differences
TERMS = 14  # of it: enough up to an exponent of 20


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
    """An elastic tissue of two constants, those of its small strains.

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
class Prony(Isotropic):
    """Linear viscoelasticity at small strain: Hooke at once, whose shear modulus relaxes in terms (g, tau).

    G(t) = G (1 - sum g + sum g exp(-t/tau)), the bulk modulus staying as it is: a generalised Maxwell solid, as in Simo
    and Hughes (1998), Computational Inelasticity, sec. 10.2. Its two constants are those at once.
    """

    terms: tuple[tuple[float, float], ...] = ()  # g [-] and tau [s] of each

    @property
    def bulk(self) -> float:
        """Bulk modulus K = lambda + 2 G / 3 [MPa]."""
        return self.lame + 2.0 / 3.0 * self.shear

    @property
    def long_term(self) -> float:
        """Part of the shear modulus that never relaxes [-]."""
        return 1.0 - sum(g for g, _ in self.terms)

    @property
    def long_term_moduli(self) -> Moduli:
        """The moduli in the end.

        >>> round(Prony(0.08, 0.48, ((0.3, 1.0),)).long_term_moduli.shear / Prony(0.08, 0.48).shear, 6)
        0.7
        """
        return self._with(self.long_term)

    def within(self, step: float) -> Moduli:
        """Return the moduli that a strain has which grows evenly over `step` [s]: what of it is left at the end.

        After one relaxation time that is 0.7 + 0.3 (1 - 1/e):

        >>> round(Prony(0.08, 0.48, ((0.3, 1.0),)).within(1.0).shear / Prony(0.08, 0.48).shear, 6)
        0.889636
        """
        return self._with(self.long_term + sum(g * float(mean_decay(np.asarray(step / tau))) for g, tau in self.terms))

    def _with(self, part: float) -> Moduli:
        shear = part * self.shear
        return Moduli(shear, self.bulk - 2.0 / 3.0 * shear)


def mean_decay(times: Array) -> Array:
    """Return what is left of a strain that grew evenly over so many relaxation times (> 0): (1 - exp(-x)) / x."""
    return -np.expm1(-times) / times


class Law(Elasticity, Protocol):
    """What an element asks of a law at finite strain."""

    name: ClassVar[str]

    @property
    def stiffening(self) -> float:
        """Ogden's exponent, by which the shear modulus grows with strain; PLAIN where it stays [-]."""
        ...


@dataclass(frozen=True, slots=True)
class NeoHooke(Isotropic):
    """W = G/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2 (Simo and Pister 1984, Comput. Meth. Appl. Mech. Eng. 46, 201).

    P = G (F - F^-T) + lambda ln J F^-T.
    """

    name: ClassVar[str] = "neo-Hooke"

    @property
    def stiffening(self) -> float:
        """No stiffening."""
        return PLAIN


@dataclass(frozen=True, slots=True)
class Ogden(Isotropic):
    """W = 2 G/a^2 (l^a + l^-a - 2) + lambda/2 (ln J)^2, with l^2 + l^-2 - 2 = Q: skin, that stiffens as it is strained.

    Ogden's law of one term (1972, Proc. R. Soc. Lond. A 326, 565) in plane strain, where l and 1/l are the stretches as
    long as the volume stays; made compressible like the neo-Hookean law, which it is for a = 2. That human skin has
    a = 9 is ascribed to Shergold and Fleck (2004, Proc. R. Soc. Lond. A 460, 3037).
    P = G f(Q) (F - F^-T) + lambda ln J F^-T with f = 2/a sinh(a s)/sinh(2 s), l = exp(s). Pulled to twice its length,
    with a = 4: 2 G/16 (16 + 1/16 - 2):

    >>> float((shape(np.array(4.0), np.array(2.0**2 + 0.5**2 - 2.0)) / 2.0).round(6))
    1.757812
    """

    name: ClassVar[str] = "Ogden"
    stiffening: float = HUMAN_SKIN  # a [-]


def log1p(x: Array) -> Array:
    """Return ln(1 + x), of complex numbers for the smallest imaginary parts: NumPy's own loses a small x's digits."""
    log = np.log1p(x.real)
    return cast("Array", log + 1j * (x.imag / (1.0 + x.real))) if np.iscomplexobj(x) else log


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
        return 1.0 + self._volume_growth

    @property
    def log_volume(self) -> Array:
        """Logarithm of the volume to the digits of the strains [-]."""
        return log1p(self._volume_growth)

    @property
    def excess(self) -> Array:
        """Tr C - 3 - 2 ln J at the place itself, to the digits of the strains [-]."""
        squares = self.xx**2 + self.xy**2 + self.yx**2 + self.yy**2
        return 2.0 * (self.trace - self.log_volume) + squares

    @property
    def _volume_growth(self) -> Array:
        return self.trace + self.xx * self.yy - self.xy * self.yx

    @property
    def trace(self) -> Array:
        """Trace of the gradient: the volume strain at the place itself, at small strain [-]."""
        return self.xx + self.yy

    @property
    def engineering_shear(self) -> Array:
        """The engineering shear strain between x and y, at small strain [-]."""
        return self.xy + self.yx


def shape(exponent: Array, Q: Array) -> Array:
    """Return W by G/2 (...) of Ogden's exponents, without the term of ln J: 16/a^2 sinh^2(a s/2), Q = 4 sinh^2 s."""
    some = np.where(np.real(Q) > 0.0, Q, 0.0 * Q)
    if np.all(exponent == PLAIN):
        return some
    return 16.0 / exponent**2 * np.sinh(exponent / 2.0 * np.arcsinh(np.sqrt(some) / 2.0)) ** 2


def slopes(exponent: Array, Q: Array) -> tuple[Array, Array]:
    """Return f = dW/dQ by G/2, by which the shear modulus has grown, and df/dQ (...).

    f is Gauss's series 2F1(1 + a/2, 1 - a/2; 3/2; -Q/4), of which the first terms serve where Q is small.

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
    far = np.real(Q) > NEAR
    s = np.arcsinh(np.sqrt(np.where(far, Q, 1.0)) / 2.0)
    one, two = np.sinh(a * s), np.sinh(2.0 * s)
    wide = 2.0 / a * one / two
    bend = (2.0 * np.cosh(a * s) - 2.0 * wide * np.cosh(2.0 * s)) / (4.0 * two**2)
    return np.where(far, wide, value), np.where(far, bend, slope)


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
    grown, growth = slopes(np.array(law.stiffening), Q)
    shear, more = (law.shear * grown)[wide], (2.0 * law.shear * growth)[wide]
    pressure = law.lame * np.log(J)[wide]
    excess = F - inverse
    unit = np.einsum("ab,AB->aAbB", np.eye(2), np.eye(2))
    crossed = np.einsum("...aB,...bA->...aAbB", inverse, inverse)  # minus the derivative of F^-T
    stretched = np.einsum("...aA,...bB->...aAbB", excess, excess)
    squeezed = np.einsum("...aA,...bB->...aAbB", inverse, inverse)
    return shear * (unit + crossed) + more * stretched - pressure * crossed + law.lame * squeezed


def inverse_metric(F: Array) -> Array:
    """Return B (..., 4) for deformation gradients F (..., 2, 2).

    >>> inverse_metric(np.array([[1.0, 0.5], [0.0, 1.0]])).tolist()  # simple shear
    [1.25, 1.0, -0.5, 1.0]
    """
    J = determinant(F)
    xx = F[..., 0, 0] ** 2 + F[..., 1, 0] ** 2
    yy = F[..., 0, 1] ** 2 + F[..., 1, 1] ** 2
    xy = F[..., 0, 0] * F[..., 0, 1] + F[..., 1, 0] * F[..., 1, 1]
    scale = J ** (2.0 / 3.0)
    return np.stack([scale * yy / J**2, scale * xx / J**2, -scale * xy / J**2, scale + 0.0 * J], axis=-1)


def stress_parts(F: Array, T: Array) -> tuple[Array, Array, Array, Array]:
    """Return J (...), F^-T (..., 2, 2), F T (..., 2, 2) and T:C (...)."""
    pulled = F @ np.stack([T[..., [0, 2]], T[..., [2, 1]]], axis=-2)
    return determinant(F), inverse(np.swapaxes(F, -2, -1)), pulled, np.sum(pulled * F, axis=(-2, -1)) + T[..., 3]


def overstress(T: Array, F: Array) -> Array:
    """Return the nominal stress (..., 2, 2) [MPa], J^-2/3 (F T - T:C/3 F^-T).

    A term of 1 MPa, just sheared by 0.5: its true shear stress is 0.5 MPa.

    >>> F = np.array([[1.0, 0.5], [0.0, 1.0]])
    >>> (overstress(np.array([1.0, 1.0, 0.0, 1.0]), F) @ F.T).round(6)[0, 1].item()
    0.5
    """
    J, inverse, pulled, whole = stress_parts(F, T)
    return (J ** (-2.0 / 3.0))[..., None, None] * (pulled - (whole / 3.0)[..., None, None] * inverse)


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """What p points remember of their strain: the overstress of relaxing tissue; m terms at most in any of them.

    Each term (g, tau) is a network whose strands let go and join again unstrained (Green and Tobolsky 1946, J. Chem.
    Phys. 14, 80; as a law of solids Linder, Tkachuk and Miehe 2011, J. Mech. Phys. Solids 59, 2134). A is the inverse
    metric in which it would be unstrained. It follows the body's own, and what stress is left is of the shape alone, as
    in Simo (1987, Comput. Meth. Appl. Mech. Eng. 60, 153): with B = (C J^-2/3)^-1,

        dA/dt = (B - A)/tau,    W = g G/2 (tr(A B^-1) - 3 - ln det A),    S = g G J^-2/3 (A - (A:C)/3 C^-1).

    Nothing is gained ever: what is lost is g G/(2 tau) times the sum of a + 1/a - 2 over the eigenvalues a of A B^-1.
    After a sudden strain S falls as exp(-t/tau), and at small strain this is the generalised Maxwell solid of `Prony`.
    Within a step B grows evenly, for which the recursion is exact (as in `equilibrium.relaxation`), and all terms pull
    by one tensor T = sum g G A', A' being A without what it takes from the B at the end, which has no stress: a step is
    elastic with W = 1/2 J^-2/3 T:C. Tensors are (..., 4): xx, yy, xy, zz, the two others zero; plane strain, F_zz = 1.
    """

    shear: Array  # (p, m) g G [MPa]
    tau: Array  # (p, m) [s]
    metric: Array  # (p, m, 4) A of each term
    before: Array  # (p, 4) B at the last instant

    @staticmethod
    def at_rest(shear: Array, tau: Array) -> "Past":
        """Return points that were never strained."""
        one = np.array([1.0, 1.0, 0.0, 1.0])
        return Past(shear, tau, np.broadcast_to(one, (*shear.shape, 4)), np.broadcast_to(one, (len(shear), 4)))

    def _decay(self, step: float) -> Array:
        """Return A' (p, m, 4) at the end of a `step` [s]."""
        ages = step / self.tau
        left, grown = np.exp(-ages), mean_decay(ages)
        return left[..., None] * self.metric + (grown - left)[..., None] * self.before[:, None]

    def over(self, step: float) -> Array:
        """Return T (p, 4) [MPa] of a `step` [s]."""
        return np.sum(self.shear[..., None] * self._decay(step), axis=1)

    def after(self, F: Array, step: float) -> "Past":
        """Return the past at the end of a `step` [s] that led to the deformation gradients F (p, 2, 2)."""
        now = inverse_metric(F)
        metric = self._decay(step) + (1.0 - mean_decay(step / self.tau))[..., None] * now[:, None]
        return replace(self, metric=metric, before=now)

    def energy(self) -> Array:
        """Return the energy density (p,) [MPa] that the terms store now."""
        A, B = self.metric, self.before[:, None]
        det = B[..., 0] * B[..., 1] - B[..., 2] ** 2
        trace = (A[..., 0] * B[..., 1] + A[..., 1] * B[..., 0] - 2.0 * A[..., 2] * B[..., 2]) / det
        trace = trace + A[..., 3] / B[..., 3]
        volume = np.log((A[..., 0] * A[..., 1] - A[..., 2] ** 2) * A[..., 3])
        return np.sum(self.shear / 2.0 * (trace - 3.0 - volume), axis=1)


MATERIALS = (Hooke, Prony)
LAWS = (NeoHooke, Ogden)
