"""Correlations with intervals, their differences, and partial correlations."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtr, stdtrit

from drivers.arrays import Array
from sessions.strokes.stroke import Meaning

CONFIDENCE = 0.95
TAILS = ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)  # probabilities of the ends of an interval
LEAST_CASES = 3  # of a jackknife
LEAST_OF_STEIGER = 4  # cases of Steiger's test
_EXACT_UP_TO = 7  # 7! = 5040 orders are enumerated

POWER = 0.8  # required to distinguish two correlations (Cohen 1988, p. 56)
_PERFECT = 1.0 - 1e-12  # Fisher's z is infinite at 1


@dataclass(frozen=True, slots=True)
class Relation:
    """The relation of y to x over n stimuli. A number is None where `reason` says why."""

    n: int  # stimuli
    pearson: float | None = None  # r
    low: float | None = None  # 95 % interval of pearson (Fisher's z)
    high: float | None = None  # its upper end
    spearman: float | None = None  # rho
    spearman_low: float | None = None  # 95 % interval of spearman (Fisher's z, its error by Bonett & Wright 2000)
    spearman_high: float | None = None  # its upper end
    spearman_p: float | None = None  # exact, two-sided: the share of orders whose rho is at least as far from 0
    slope: float | None = None  # least-squares line y = intercept + slope x [unit of y over that of x]
    intercept: float | None = None  # of that line [unit of y]
    without: tuple[tuple[int, float | None], ...] = ()  # (label, pearson over the others) for each stimulus left out
    reason: str | None = None


def relation(x: Sequence[float], y: Sequence[float], labels: Sequence[int]) -> Relation:
    """Return the relation of y to x; `labels` are the indices of the stimuli.

    Pearson's r with its 95 % interval by Fisher's z, which requires four points and |r| < 1; Spearman's rho with its
    exact p up to seven points; the least-squares line of y on x.
    """
    n = len(x)
    without = tuple((label, pearson([*x[:i], *x[i + 1 :]], [*y[:i], *y[i + 1 :]])) for i, label in enumerate(labels))
    r, rho = pearson(x, y), spearman(x, y)
    if r is None or rho is None:
        points = "1 point is" if n == 1 else f"{n} points are"
        reason = f"{points} too few for a correlation" if n < 3 else "one of the two does not vary"
        return Relation(n, without=without, reason=reason)
    slope, intercept = np.polyfit(x, y, 1)
    low, high = fisher_interval(r, n)
    reason = None if low is not None else f"no interval of r from {n} points" if n < 4 else "no interval of a perfect r"
    rho_interval = fisher_interval(rho, n, 1 + rho * rho / 2)  # Bonett & Wright 2000, Psychometrika 65:23, equation 4
    line = float(slope), float(intercept)
    return Relation(n, r, low, high, rho, *rho_interval, _exact_p(x, y, rho), *line, without, reason)


def slope_interval(line: Relation) -> tuple[float, float] | None:
    """Return the 95 % t interval of the slope (n - 2 degrees of freedom); None without a slope, or where r is 0 or ±1.

    Its standard error follows from r: (slope / r) sqrt((1 - r^2) / (n - 2)).
    """
    r, slope, n = line.pearson, line.slope, line.n
    if r is None or slope is None or not r or n < 3 or abs(r) > _PERFECT:
        return None
    half = t_quantile(n - 2) * abs(slope / r) * math.sqrt((1 - r * r) / (n - 2))
    return slope - half, slope + half


def t_quantile(dof: float) -> float:
    """Return the half-width of a 95 % t interval in standard errors; of the normal law where `dof` is inf.

    >>> round(t_quantile(9), 3), round(t_quantile(math.inf), 3)
    (2.262, 1.96)
    """
    return float(stdtrit(dof, (1 + CONFIDENCE) / 2))


def jackknife(estimate: ArrayLike, replicates: Array) -> tuple[Array, Array, Array]:
    """Return both ends of the 95 % interval of `estimate` (m,), and p (m,).

    `replicates` (k, m) are the estimates without each of the k cases. The mean of the pseudo-values follows Student's
    t with k - 1 degrees of freedom (Tukey; Miller 1974, Biometrika 61:1). Identical cases give nan.
    """
    cases = len(replicates)
    pseudo = cases * np.asarray(estimate, np.float64) - (cases - 1) * replicates
    mean, error = pseudo.mean(axis=0), pseudo.std(axis=0, ddof=1) / math.sqrt(cases)
    error = np.where(error > 1e-9 * np.abs(estimate), error, np.nan)
    half = t_quantile(cases - 1) * error
    return mean - half, mean + half, 2.0 * np.asarray(stdtr(cases - 1, -np.abs(mean) / error), np.float64)


def pearson(x: Sequence[float], y: Sequence[float]) -> float | None:
    """Return Pearson's r, None for fewer than three points or where one of the two does not vary."""
    if len(x) < 3 or not _varies(x) or not _varies(y):
        return None
    return float(np.clip(np.corrcoef(x, y)[0, 1], -1.0, 1.0))


def spearman(x: Sequence[float], y: Sequence[float]) -> float | None:
    """Return Spearman's rho, None for fewer than three points or where one of the two does not vary."""
    return None if pearson(x, y) is None else float(np.corrcoef(_ranks(x), _ranks(y))[0, 1])


def fisher_interval(r: float, n: int, inflation: float = 1.0) -> tuple[float | None, float | None]:
    """Return the 95 % interval of a correlation by Fisher's z, its variance times `inflation`.

    None for fewer than four points, or for a perfect correlation of either sign.
    """
    if n < 4 or abs(r) > _PERFECT:
        return None, None
    half = t_quantile(math.inf) * math.sqrt(inflation / (n - 3))
    return math.tanh(math.atanh(r) - half), math.tanh(math.atanh(r) + half)


def share_interval(share: float, cases: int) -> tuple[float, float]:
    """Return the 95 % interval of a share of cases (Wilson 1927, J. Am. Stat. Assoc. 22:209, by the score test).

    >>> [round(end, 3) for end in share_interval(4 / 13, 13)]
    [0.127, 0.576]
    """
    square = t_quantile(math.inf) ** 2 / cases
    middle = (share + square / 2) / (1 + square)
    half = math.sqrt(square * (share * (1 - share) + square / 4)) / (1 + square)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def _varies(values: Sequence[float]) -> bool:
    """Say whether values differ by more than round-off."""
    return float(np.ptp(values)) > 1e-12 * float(np.max(np.abs(values)))


def _ranks(values: Sequence[float]) -> Array:
    """Return ranks from 1; values equal within round-off share their mean rank.

    >>> _ranks([3.0, 1.0, 3.0])
    array([2.5, 1. , 2.5])
    """
    relative = np.asarray(values, np.float64) / (float(np.max(np.abs(values))) or 1.0)
    _, groups, counts = np.unique(relative.round(12), return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[groups]


def _exact_p(x: Sequence[float], y: Sequence[float], rho: float) -> float | None:
    """Return the share of all orders of y whose |rho| is at least |rho|; None for more than seven points."""
    n = len(x)
    if n > _EXACT_UP_TO:
        return None
    rank_x, rank_y = _ranks(x) - (n + 1) / 2, _ranks(y) - (n + 1) / 2
    orders = rank_y[np.array(list(itertools.permutations(range(n))))]  # (n!, n)
    rhos = orders @ rank_x / math.sqrt(float(rank_x @ rank_x) * float(rank_y @ rank_y))
    return float(np.mean(np.abs(rhos) >= abs(rho) - 1e-12))


@dataclass(frozen=True, slots=True)
class Contrast:
    """The difference of two correlations with scores, each variable signed so that its r is positive."""

    n: int  # cases that have all three; within subjects, trials
    difference: Annotated[float, Meaning("", "r of the model's quantity less r of this one, both made positive")]
    low: Annotated[float | None, Meaning("", "lower end of its 95 % interval")]
    high: Annotated[float | None, Meaning("", "upper end")]
    z: Annotated[float | None, Meaning("", "Steiger's; none where the interval is the jackknife's")]
    p: Annotated[float | None, Meaning("", "of no difference, two-sided; none for identical cases")]


def steiger_z(first: float, second: float, mutual: float, n: int) -> float | None:
    """Return Steiger's Z of two correlations with one variable; `mutual` is the correlation of the other two.

    Steiger 1980 (Psychol. Bull. 87:245), equation 14 with pooled correlations. None for fewer than four cases, a
    perfect correlation, or two variables equal up to scale.
    """
    error = _pooled_variance(first, second, mutual)
    if n < LEAST_OF_STEIGER or error is None:
        return None
    return (math.atanh(first) - math.atanh(second)) * math.sqrt((n - 3) / error)


def required_cases(first: float, second: float, mutual: float) -> int | None:
    """Return the number of cases for Steiger's test to distinguish these correlations at p < 0.05 with `POWER`.

    None where no number suffices: the correlations are equal, or the test has no value.
    """
    error = _pooled_variance(first, second, mutual)
    if error is None or abs(first - second) < 1e-9:
        return None
    step = math.atanh(first) - math.atanh(second)
    return 3 + math.ceil(error * ((t_quantile(math.inf) + float(ndtri(POWER))) / step) ** 2)


def contrast(first: float, second: float, mutual: float, n: int) -> Contrast | None:
    """Return the difference of two correlations with Zou's interval (2007, Psychol. Methods 12:399) and Steiger's Z.

    Correlations, and cases of None, are those of `steiger_z`; a negative one changes sign with its variable.
    """
    first, second, mutual = abs(first), abs(second), math.copysign(1.0, first * second) * mutual
    z = steiger_z(first, second, mutual, n)
    if z is None:
        return None
    half = t_quantile(math.inf) / math.sqrt(n - 3)
    first_low, second_low = (math.tanh(math.atanh(r) - half) for r in (first, second))
    first_high, second_high = (math.tanh(math.atanh(r) + half) for r in (first, second))
    covariance = _covariance(first, second, mutual) / ((1 - first**2) * (1 - second**2))
    difference = first - second

    def margin(of_first: float, of_second: float) -> float:
        return math.sqrt(max(of_first**2 + of_second**2 - 2 * covariance * of_first * of_second, 0.0))

    low = difference - margin(first - first_low, second_high - second)
    high = difference + margin(first_high - first, second - second_low)
    return Contrast(n, difference, low, high, z, math.erfc(abs(z) / math.sqrt(2.0)))


def partial_correlation(xy: ArrayLike, xz: ArrayLike, yz: ArrayLike) -> Array:
    """Return correlations of x and y given z, from their three correlations; nan where z determines one of them."""
    xy, xz, yz = (np.asarray(r, np.float64) for r in (xy, xz, yz))
    product = (1 - xz * xz) * (1 - yz * yz)
    partial = np.where(product > 1e-12, xy - xz * yz, np.nan) / np.sqrt(np.where(product > 1e-12, product, 1.0))
    return np.clip(partial, -1.0, 1.0)


def leave_one_out_error(x: Sequence[float], y: Sequence[float]) -> float | None:
    """Return the root mean square error of each y predicted by the least-squares line of the others [unit of y].

    An error is the residual over 1 - leverage (Allen 1974, Technometrics 16:125). None where no line is determined.
    """
    if len(x) < 3:
        return None
    deviations = np.asarray(x, np.float64) - float(np.mean(x))
    sum_of_squares = float(deviations @ deviations)
    if sum_of_squares <= 1e-24 * float(np.max(np.abs(x))) ** 2:
        return None
    residual_share = 1.0 - 1.0 / len(x) - deviations**2 / sum_of_squares
    if float(residual_share.min()) < 1e-9:
        return None
    values = np.asarray(y, np.float64) - float(np.mean(y))
    errors = (values - deviations * float(deviations @ values) / sum_of_squares) / residual_share
    return float(np.sqrt(np.mean(errors**2)))


def _pooled_variance(first: float, second: float, mutual: float) -> float | None:
    """Return n - 3 times the variance of the difference of two Fisher's z; None where it is undefined."""
    if max(abs(first), abs(second), abs(mutual)) > _PERFECT:
        return None
    pooled = (first + second) / 2
    variance = 2 - 2 * _covariance(pooled, pooled, mutual) / (1 - pooled**2) ** 2
    return variance if variance > 0.0 else None


def _covariance(first: float, second: float, mutual: float) -> float:
    """Return n times the covariance of two correlations with one variable (Steiger 1980, equation 3)."""
    unexplained = 1 - first**2 - second**2
    return mutual * unexplained - first * second * (unexplained - mutual**2) / 2
