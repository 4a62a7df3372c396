"""Relaxation at finite strain: what tissue holds beyond its relaxed law, in terms that fade (g, tau).

Each term is a network whose strands let go and join again unstrained (Green and Tobolsky 1946, J. Chem. Phys. 14, 80;
as a law of solids Linder, Tkachuk and Miehe 2011, J. Mech. Phys. Solids 59, 2134). A is the inverse metric in which it
would be unstrained. It follows the body's own, and what stress is left is of the shape alone, as in Simo (1987, Comput.
Meth. Appl. Mech. Eng. 60, 153): with B = (C J^-2/3)^-1,

    dA/dt = (B - A)/tau,    W = g G/2 (tr(A B^-1) - 3 - ln det A),    S = g G J^-2/3 (A - (A:C)/3 C^-1).

Nothing is gained ever: what is lost is g G/(2 tau) times the sum of a + 1/a - 2 over the eigenvalues a of A B^-1. After
a sudden strain S falls as exp(-t/tau), and at small strain this is the generalised Maxwell solid of `Prony`.
Within a step B grows evenly, for which the recursion is exact (as in `equilibrium.relaxation`), and all terms pull by
one tensor T = sum g G A', A' being A without what it takes from the B at the end, which has no stress: a step is
elastic with W = 1/2 J^-2/3 T:C. Tensors are (..., 4): xx, yy, xy, zz, the two others zero; plane strain, F_zz = 1.
"""

from dataclasses import dataclass, replace

import numpy as np

from solver.arrays import Array, determinant, inverse
from solver.constitutive import kept


def unstrained(F: Array) -> Array:
    """Return B (..., 4) for deformation gradients F (..., 2, 2).

    >>> unstrained(np.array([[1.0, 0.5], [0.0, 1.0]])).tolist()  # simple shear
    [1.25, 1.0, -0.5, 1.0]
    """
    J = determinant(F)
    xx = F[..., 0, 0] ** 2 + F[..., 1, 0] ** 2
    yy = F[..., 0, 1] ** 2 + F[..., 1, 1] ** 2
    xy = F[..., 0, 0] * F[..., 0, 1] + F[..., 1, 0] * F[..., 1, 1]
    scale = J ** (2.0 / 3.0)
    return np.stack([scale * yy / J**2, scale * xx / J**2, -scale * xy / J**2, scale + 0.0 * J], axis=-1)


def turned(F: Array, T: Array) -> tuple[Array, Array, Array, Array]:
    """Return J (...), F^-T (..., 2, 2), F T (..., 2, 2) and T:C (...)."""
    pulled = F @ np.stack([T[..., [0, 2]], T[..., [2, 1]]], axis=-2)
    return determinant(F), inverse(np.swapaxes(F, -2, -1)), pulled, np.sum(pulled * F, axis=(-2, -1)) + T[..., 3]


def stress(T: Array, F: Array) -> Array:
    """Return the nominal stress (..., 2, 2) [MPa], J^-2/3 (F T - T:C/3 F^-T).

    A term of 1 MPa, just sheared by 0.5: its true shear stress is 0.5 MPa.

    >>> F = np.array([[1.0, 0.5], [0.0, 1.0]])
    >>> (stress(np.array([1.0, 1.0, 0.0, 1.0]), F) @ F.T).round(6)[0, 1].item()
    0.5
    """
    J, inverse, pulled, whole = turned(F, T)
    return (J ** (-2.0 / 3.0))[..., None, None] * (pulled - (whole / 3.0)[..., None, None] * inverse)


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """What p points remember; m terms at most in any of them."""

    shear: Array  # (p, m) g G [MPa]
    tau: Array  # (p, m) [s]
    metric: Array  # (p, m, 4) A of each term
    before: Array  # (p, 4) B at the last instant

    @staticmethod
    def at_rest(shear: Array, tau: Array) -> "Past":
        """Return points that were never strained."""
        one = np.array([1.0, 1.0, 0.0, 1.0])
        return Past(shear, tau, np.broadcast_to(one, (*shear.shape, 4)), np.broadcast_to(one, (len(shear), 4)))

    def _faded(self, step: float) -> Array:
        """Return A' (p, m, 4) at the end of a `step` [s]."""
        ages = step / self.tau
        left, grown = np.exp(-ages), kept(ages)
        return left[..., None] * self.metric + (grown - left)[..., None] * self.before[:, None]

    def over(self, step: float) -> Array:
        """Return T (p, 4) [MPa] of a `step` [s]."""
        return np.sum(self.shear[..., None] * self._faded(step), axis=1)

    def after(self, F: Array, step: float) -> "Past":
        """Return the past at the end of a `step` [s] that led to the deformation gradients F (p, 2, 2)."""
        now = unstrained(F)
        metric = self._faded(step) + (1.0 - kept(step / self.tau))[..., None] * now[:, None]
        return replace(self, metric=metric, before=now)

    def energy(self) -> Array:
        """Return the energy density (p,) [MPa] that the terms store now."""
        A, B = self.metric, self.before[:, None]
        det = B[..., 0] * B[..., 1] - B[..., 2] ** 2
        trace = (A[..., 0] * B[..., 1] + A[..., 1] * B[..., 0] - 2.0 * A[..., 2] * B[..., 2]) / det
        trace = trace + A[..., 3] / B[..., 3]
        volume = np.log((A[..., 0] * A[..., 1] - A[..., 2] ** 2) * A[..., 3])
        return np.sum(self.shear / 2.0 * (trace - 3.0 - volume), axis=1)
