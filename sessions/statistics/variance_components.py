"""How much subjects differ: standard deviations of their levels and slopes, and of what is left, with intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from sessions.statistics.scores import CONFIDENCE, sd_interval


@dataclass(frozen=True, slots=True)
class Spread:
    """A standard deviation with its 95 % interval; 0 where subjects differ no more than what is left makes them."""

    sd: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Spreads:
    """What differs between subjects, and from trial to trial within each."""

    level: Spread  # of the subjects' levels, at the mean of the covariate [unit of y]
    slope: Spread | None  # of their slopes on the covariate [unit of y over unit of x]; None where none was asked for
    left: Spread  # of y about each subject's own line: the noise of single trials
    subjects: int
    dof: int  # of what is left


def spreads(
    subjects: Sequence[str], y: Sequence[float], common: Sequence[Sequence[float]], x: Sequence[float] | None = None
) -> Spreads | None:
    """Return the spreads of y (n): each subject has its own level, with `x` (n) its own slope, all share `common`.

    `common` holds covariates (n each) whose slopes are one for all. Fitted by least squares; a subject's coefficients
    then vary between subjects by their own variance and by that of their error, which is taken away. Intervals: chi
    squared for what is left; for the others that of a difference of two mean squares (modified large sample: Ting,
    Burdick, Graybill, Jeyaratnam & Lu 1990, J. Stat. Comput. Simul. 35:135), with unweighted coefficients where
    subjects have unlike trials (Thomas & Hultquist 1978, Ann. Stat. 6:582). Subjects with too few trials for a line of
    their own do not count. None for fewer than three subjects, or where covariates determine each other.
    """
    own = 1 if x is None else 2
    codes, whole = np.unique(np.array(subjects), return_inverse=True)
    trials = np.bincount(whole, minlength=len(codes))
    kept = trials[whole] > own
    used = np.unique(whole[kept])
    k = len(used)
    if k < 3:
        return None
    who = (whole[kept][:, None] == used[None, :]).astype(np.float64)  # (n, k)
    lines = who
    if x is not None:
        along = np.array(x, np.float64)[kept]
        lines = np.hstack([who, who * (along - along.mean())[:, None]])
    shared = np.array(common, np.float64).reshape(len(common), len(y))[:, kept].T
    design = np.hstack([lines, shared])
    scale = np.abs(design).max(axis=0)
    if not scale.all():
        return None
    design /= scale
    values = np.array(y, np.float64)[kept]
    dof = len(values) - design.shape[1]
    if dof < 1 or np.linalg.matrix_rank(design) < design.shape[1]:
        return None
    orthogonal, triangular = np.linalg.qr(design)
    inverse = np.linalg.inv(triangular)
    fitted = inverse @ (orthogonal.T @ values)
    left = values - design @ fitted
    square = float(left @ left) / dof
    coefficients, errors = fitted / scale, (inverse @ inverse.T) / np.outer(scale, scale)

    def between(first: int) -> Spread:
        part = slice(first, first + k)
        error = errors[part, part]
        share = float(np.trace(error) - error.mean(axis=0).sum()) / (k - 1)  # of `square` in the mean square
        return difference_of_squares(float(coefficients[part].var(ddof=1)), k - 1, share * square, dof)

    sd = math.sqrt(square)
    return Spreads(between(0), None if x is None else between(k), Spread(sd, *sd_interval(sd, dof + 1)), k, dof)


def difference_of_squares(first: float, n: int, second: float, m: int) -> Spread:
    """Return the root of `first` (n degrees of freedom) less `second` (m), two independent mean squares.

    Its lower end is 0 exactly where an F test does not tell the two apart.
    """
    tail = (1 - CONFIDENCE) / 2
    difference = first - second

    def over(q: float, dof: int) -> float:
        return dof / float(special.chdtri(dof, 1 - q))

    f, g, h = float(special.fdtri(n, m, 1 - tail)), 1 - over(1 - tail, n), over(tail, m) - 1
    covered = ((f - 1) ** 2 - (g * f) ** 2 - h * h) / f
    low = difference - math.sqrt(max((g * first) ** 2 + (h * second) ** 2 + covered * first * second, 0.0))
    f, g, h = float(special.fdtri(n, m, tail)), over(tail, n) - 1, 1 - over(1 - tail, m)
    covered = ((1 - f) ** 2 - (g * f) ** 2 - h * h) / f
    high = difference + math.sqrt(max((g * first) ** 2 + (h * second) ** 2 + covered * first * second, 0.0))
    sd, least, greatest = (math.sqrt(max(square, 0.0)) for square in (difference, low, high))
    return Spread(sd, least, greatest)
