"""Restricted maximum likelihood of a linear model in which each subject has some coefficients of its own.

The criterion is written in the factor of the subjects' covariance relative to what is left, as by Bates, Maechler,
Bolker & Walker 2015 (J. Stat. Softw. 67:1, equation 41): fixed effects and scale are solved for, and a covariance that
does not have full rank is no edge of it. Its gradient is exact, so that the maximum is found to the last few bits.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, optimize

Array = np.ndarray[Any, np.dtype[np.float64]]

_STARTS = ((1.0, 1.0), (0.3, 0.3), (3.0, 0.3), (0.3, 3.0), (3.0, 3.0))  # spreads relative to what is left
_SINGULAR = 1e-4  # of the factor's diagonal, as lme4 has it
_NOTHING = 1e-9  # of the factor: it enters by its square, which is then below round-off
_POLISH = 6  # steps of Newton's method, after which nothing moves


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What maximises the restricted likelihood; p fixed effects, q of them different between subjects."""

    estimates: Array  # (p,)
    errors: Array  # (p,) standard errors
    among: Array  # (q, q) covariance of the subjects' own coefficients
    within: float  # standard deviation of what is left
    criterion: float  # half the deviance, without its constant; the smaller the likelier
    singular: bool  # `among` has not full rank


def restricted_fit(y: Array, columns: Array, subjects: Sequence[str] | Array, own: int) -> Fit:
    """Return the fit of y (n) by `columns` (n, p) of full rank, whose first `own` also differ between subjects (n).

    Columns should be of about one size.
    """
    sums = _Sums.of(y, columns, subjects, own)
    free = np.tril_indices(own)
    tried = [optimize.minimize(sums.criterion, _start(one, own)[free], jac=True, method="BFGS") for one in _STARTS]
    best: Array = min(tried, key=lambda one: float(one.fun)).x
    return sums.fit(_polished(sums, best))


def _start(spread: tuple[float, float], own: int) -> Array:
    return np.diag(spread[:own])


def _polished(sums: "_Sums", at: Array) -> Array:
    """Return where the gradient vanishes to round-off, by Newton's method from a point close by."""
    value, slope = sums.criterion(at)
    for _ in range(_POLISH):
        step = 1e-6 * np.maximum(np.abs(at), 1e-2)
        curve = np.array(
            [(sums.criterion(at + e)[1] - sums.criterion(at - e)[1]) / (2 * e.sum()) for e in np.diag(step)]
        )
        # Where subjects' levels do not differ the factor may turn without changing the covariance: no step that way.
        new = at - np.linalg.lstsq(0.5 * (curve + curve.T), slope, rcond=1e-7)[0]
        new_value, new_slope = sums.criterion(new)
        if not new_value <= value + 1e-9 * abs(value) or float(np.abs(new_slope).max()) >= float(np.abs(slope).max()):
            break
        at, value, slope = new, new_value, new_slope
    return np.where(np.abs(at) < _NOTHING, 0.0, at)


@dataclass(frozen=True, slots=True, eq=False)
class _Sums:
    """All that the criterion needs of the data: sums over each subject's trials (k subjects), y as the last column."""

    n: int
    total: Array  # (p + 1, p + 1)
    among: Array  # (k, q, q)
    across: Array  # (k, q, p + 1)
    offset: Array  # (p,) least squares, taken from y first so that nothing cancels

    @staticmethod
    def of(y: Array, columns: Array, subjects: Sequence[str] | Array, own: int) -> "_Sums":
        offset = np.asarray(np.linalg.lstsq(columns, y, rcond=None)[0], np.float64)
        all_of = np.column_stack([columns, y - columns @ offset])
        codes = np.unique(np.array(subjects), return_inverse=True)[1]
        each = [all_of[codes == code] for code in range(int(codes.max()) + 1)]
        across = np.array([rows[:, :own].T @ rows for rows in each])
        return _Sums(len(y), all_of.T @ all_of, across[:, :, :own], across, offset)

    def _reduced(self, at: Array) -> tuple[Array, Array, Array, float]:
        """Return the factor (q, q), columns weighted by the inverse covariance, and half the log of its determinant."""
        q = self.among.shape[1]
        factor = np.zeros((q, q))
        factor[np.tril_indices(q)] = at
        inner = np.eye(q) + factor.T @ self.among @ factor
        shrink = factor @ np.linalg.solve(inner, np.broadcast_to(factor.T, inner.shape))  # (k, q, q)
        across: Array = self.across - self.among @ shrink @ self.across
        total: Array = self.total - np.sum(np.swapaxes(self.across, 1, 2) @ shrink @ self.across, axis=0)
        return factor, total, across, 0.5 * float(np.linalg.slogdet(inner)[1].sum())

    def criterion(self, at: Array) -> tuple[float, Array]:
        """Return half the restricted deviance, and its gradient by the factor's lower triangle."""
        factor, total, across, spread = self._reduced(at)
        q, p = len(factor), len(self.offset)
        root: Array = linalg.cholesky(total[:p, :p], lower=True)
        beta: Array = linalg.cho_solve((root, True), total[:p, p])
        left = float(total[p, p] - total[:p, p] @ beta)
        dof = self.n - p
        value = spread + float(np.log(np.diag(root)).sum()) + 0.5 * dof * math.log(left)
        fixed, own = across[:, :, :p], across[:, :, p] - across[:, :, :p] @ beta
        half: Array = linalg.solve_triangular(root, fixed.transpose(2, 0, 1).reshape(p, -1), lower=True)
        half = half.reshape(p, -1, q)
        kept = across[:, :, :q].sum(axis=0) - np.einsum("pki,pkj->ij", half, half)
        by = 0.5 * kept - 0.5 * dof / left * (own.T @ own)
        return value, (2.0 * by @ factor)[np.tril_indices(q)]

    def fit(self, at: Array) -> Fit:
        """Return what the factor says."""
        factor, total, _, _ = self._reduced(at)
        p = len(self.offset)
        inverse = np.linalg.inv(total[:p, :p])
        beta = inverse @ total[:p, p]
        square = float(total[p, p] - total[:p, p] @ beta) / (self.n - p)
        return Fit(
            estimates=self.offset + beta,
            errors=np.sqrt(square * np.diag(inverse)),
            among=square * factor @ factor.T,
            within=math.sqrt(square),
            criterion=self.criterion(at)[0],
            singular=bool(np.abs(np.diag(factor)).min() < _SINGULAR),
        )


def fits_exactly(design: Array, y: Array) -> bool:
    """Say whether columns (n, k) leave nothing of y (n) but round-off."""
    left = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
    return float(np.abs(left).max()) <= 1e-9 * (1.0 + float(np.abs(y).max()))
