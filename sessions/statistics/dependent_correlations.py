"""Correlations of one variable with two others, measured on the same cases: compared, and given a third variable."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sessions.statistics.scores import t_quantile

POWER = 0.8  # with which a study should tell two correlations apart (Cohen 1988, p. 56)
_PERFECT = 1.0 - 1e-12  # Fisher's z has no value at 1


@dataclass(frozen=True, slots=True)
class Contrast:
    """How much more closely one variable follows the scores than a rival, each turned so that its r is positive."""

    n: int  # cases that have all three; within subjects, trials
    difference: float  # of the two correlations
    low: float | None  # its 95 % interval
    high: float | None
    z: float | None  # Steiger's; None where the interval comes from a bootstrap
    p: float | None  # two-sided

    def differs(self, alpha: float) -> bool:
        """Say whether the two correlations differ: by p where there is one, else by the interval."""
        if self.p is not None:
            return self.p < alpha
        return self.low is not None and self.high is not None and not self.low <= 0.0 <= self.high


def steiger_z(first: float, second: float, mutual: float, n: int) -> float | None:
    """Return Steiger's Z of two correlations with one variable; `mutual` is that of the other two with each other.

    Steiger 1980 (Psychol. Bull. 87:245), equation 14 with pooled correlations. None for fewer than four cases, a
    perfect correlation, or two variables that are the same but for scale.
    """
    error = _pooled_variance(first, second, mutual)
    if n < 4 or error is None:
        return None
    return (math.atanh(first) - math.atanh(second)) * math.sqrt((n - 3) / error)


def cases_needed(first: float, second: float, mutual: float) -> int | None:
    """Return how many cases give Steiger's test at p < 0.05 its `POWER` where the correlations are these.

    None where no number of cases would: the correlations are equal, or the test has no value.
    """
    from scipy.special import ndtri

    error = _pooled_variance(first, second, mutual)
    if error is None or abs(first - second) < 1e-9:
        return None
    step = math.atanh(first) - math.atanh(second)
    return 3 + math.ceil(error * ((t_quantile(math.inf) + float(ndtri(POWER))) / step) ** 2)


def contrast(first: float, second: float, mutual: float, n: int) -> Contrast | None:
    """Return the difference of two correlations with Zou's interval (2007, Psychol. Methods 12:399) and Steiger's Z.

    Correlations as for `steiger_z`, which says when there is none; a negative one is turned round with its variable.
    """
    turned = math.copysign(1.0, first) * math.copysign(1.0, second)
    first, second, mutual = abs(first), abs(second), turned * mutual
    z = steiger_z(first, second, mutual, n)
    if z is None:
        return None
    half = t_quantile(math.inf) / math.sqrt(n - 3)
    (a, b), (c, d) = ((math.tanh(math.atanh(r) - half), math.tanh(math.atanh(r) + half)) for r in (first, second))
    shared = _covariance(first, second, mutual) / ((1 - first**2) * (1 - second**2))
    difference = first - second
    low = difference - math.sqrt((first - a) ** 2 + (d - second) ** 2 - 2 * shared * (first - a) * (d - second))
    high = difference + math.sqrt((b - first) ** 2 + (second - c) ** 2 - 2 * shared * (b - first) * (second - c))
    return Contrast(n, difference, low, high, z, math.erfc(abs(z) / math.sqrt(2.0)))


def partial_correlation(xy: float, xz: float, yz: float) -> float | None:
    """Return the correlation of x and y given z, from their three correlations; None where z determines one of them."""
    left = (1 - xz * xz) * (1 - yz * yz)
    return None if left < 1e-12 else float(np.clip((xy - xz * yz) / math.sqrt(left), -1.0, 1.0))


def left_out_error(x: Sequence[float], y: Sequence[float]) -> float | None:
    """Return the root mean square error of each y by the least-squares line on x through the others [unit of y].

    The residual over 1 less its leverage (Allen 1974, Technometrics 16:125). None where the others fix no line.
    """
    if len(x) < 3:
        return None
    centred = np.asarray(x, np.float64) - float(np.mean(x))
    size = float(centred @ centred)
    if size <= 1e-24 * float(np.max(np.abs(x))) ** 2:
        return None
    own = 1.0 - 1.0 / len(x) - centred**2 / size
    if float(own.min()) < 1e-9:
        return None
    values = np.asarray(y, np.float64) - float(np.mean(y))
    errors = (values - centred * float(centred @ values) / size) / own
    return float(np.sqrt(np.mean(errors**2)))


def _pooled_variance(first: float, second: float, mutual: float) -> float | None:
    """Return n - 3 times the variance of the difference of two Fisher's z; None where there is no such difference."""
    if max(abs(first), abs(second), abs(mutual)) > _PERFECT:
        return None
    pooled = (first + second) / 2
    variance = 2 - 2 * _covariance(pooled, pooled, mutual) / (1 - pooled**2) ** 2
    return variance if variance > 0.0 else None


def _covariance(first: float, second: float, mutual: float) -> float:
    """Return n times the covariance of two correlations with one variable (Steiger 1980, equation 3)."""
    rest = 1 - first**2 - second**2
    return mutual * rest - first * second * (rest - mutual**2) / 2
