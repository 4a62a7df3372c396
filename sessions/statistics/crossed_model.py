"""Likelihood of a line through scores whose subjects and surfaces, crossed, each have a level of their own."""

from collections.abc import Sequence
from itertools import product

import numpy as np
from scipy import linalg, optimize

from sessions.statistics.reml import Array, fits_exactly

_WIDEST = 1e3  # spread relative to what is left: scores have three figures, and a step of the search may not go beyond
_TO_ROUND_OFF = 1e-9  # gradient of the deviance: an error of a spread enters the deviance squared
_STARTS = (0.1, 1.0)  # spreads relative to what is left; the criterion is smooth, and the best of four is kept


def crossed_deviance(
    subjects: Sequence[str], surfaces: Sequence[int], y: Sequence[float], x: Sequence[float]
) -> float | None:
    """Return -2 log likelihood of y (n) as intercept + slope x + level of the subject + level of the surface + error.

    By maximum likelihood, profiled over slope and error (Bates, Maechler, Bolker & Walker 2015, J. Stat. Softw. 67:1,
    equation 34). Models of the same scores with different x have as many parameters: their AICs differ as their
    deviances do. None where x does not vary, or where the fixed terms leave nothing to tell an error from.
    """
    values, along = np.asarray(y, np.float64), np.asarray(x, np.float64)
    along = along - along.mean()
    if float(np.abs(along).max()) <= 1e-12 * float(np.abs(x).max()):
        return None
    columns = np.column_stack([np.ones(len(values)), along / np.abs(along).max(), values - values.mean()])
    groups = [np.unique(np.asarray(one), return_inverse=True)[1] for one in (subjects, surfaces)]
    levels = [np.eye(int(codes.max()) + 1)[codes] for codes in groups]
    random = np.hstack(levels)
    if fits_exactly(np.hstack([random, columns[:, 1:2]]), columns[:, 2]):
        return None
    whose = np.repeat([0, 1], [one.shape[1] for one in levels])
    inner, across, total = random.T @ random, random.T @ columns, columns.T @ columns
    n = len(values)

    def deviance(spread: Array) -> tuple[float, Array]:
        """Return the deviance at two relative spreads, and its derivatives by them."""
        scale = spread[whose]
        root = linalg.cholesky(np.eye(len(scale)) + scale[:, None] * inner * scale, lower=True)
        half = linalg.solve_triangular(root, scale[:, None] * across, lower=True)
        wide = linalg.solve_triangular(root, scale[:, None] * inner, lower=True)
        left = total - half.T @ half
        fixed = np.linalg.solve(left[:2, :2], left[:2, 2])
        rest = float(left[2, 2] - left[:2, 2] @ fixed)
        residual = (across - wide.T @ half) @ np.append(-fixed, 1.0)  # Z' V^-1 of what the fixed terms leave
        slope = np.diag(inner) - (wide**2).sum(axis=0) - n / rest * residual**2
        value = 2.0 * float(np.log(np.diag(root)).sum()) + n * (1.0 + float(np.log(2.0 * np.pi * rest / n)))
        return value, 2.0 * spread * np.bincount(whose, slope)

    fits = [
        optimize.minimize(
            deviance,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, _WIDEST)] * 2,
            options={"ftol": 0.0, "gtol": _TO_ROUND_OFF},
        )
        for start in product(_STARTS, _STARTS)
    ]
    return min(float(one.fun) for one in fits)


def akaike_weights(deviances: Sequence[float]) -> tuple[float, ...]:
    """Return the weights of models with equally many parameters (Wagenmakers & Farrell 2004, Psychon. Bull. Rev. 11).

    >>> tuple(round(weight, 3) for weight in akaike_weights([204.0, 202.0, 206.0]))
    (0.245, 0.665, 0.09)
    """
    shares = np.exp(-0.5 * (np.asarray(deviances, np.float64) - min(deviances)))
    return tuple((shares / shares.sum()).tolist())
