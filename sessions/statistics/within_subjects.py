"""Statistics within subjects, independent of their levels: intervals, correlations, agreement and differences."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from drivers.arrays import Array
from sessions.statistics.correlations import LEAST_CASES, jackknife, t_quantile
from sessions.statistics.scores import average, bounds, surface_means

Table = Mapping[str, Mapping[int, float]]  # subject -> the stimulus's index -> score, from `scores.score_matrix`


@dataclass(frozen=True, slots=True)
class WithinMean:
    """Mean of one stimulus with its within-subject interval."""

    index: int  # of the stimulus
    n: int  # subjects who scored every stimulus
    mean: float  # of the scores [points]
    low: float | None  # None where all subjects have equal differences between stimuli [points]
    high: float | None  # upper end of the interval [points]


@dataclass(frozen=True, slots=True)
class RepeatedCorrelation:
    """The relation of y to x within subjects, with the same slope for all (Bakdash & Marusich 2017)."""

    r: float  # the repeated-measures correlation
    low: float  # 95 % interval by Fisher's z, for `dof` degrees of freedom: for independent pairs
    high: float  # its upper end
    p: float  # two-sided, for independent pairs
    dof: int  # N - k - 1 for N pairs from k subjects, or k blocks of subjects
    subjects: int  # with at least two pairs: a single pair has no variation within its subject or block
    people: tuple[float, float] | None  # 95 % interval for other such subjects who meet the same stimuli
    people_p: float | None  # two-sided, as for `people`; both None for two or identical subjects, and for r = ±1


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of subjects on the order of the stimuli."""

    n: int  # subjects who scored every stimulus
    kendall_w: float  # 0 none, 1 the same order
    friedman_p: float  # of no difference between stimuli
    page_p: float  # of no rise with the index (Page's L, one-sided)


def _complete(table: Table) -> tuple[list[int], Array]:
    """Return the indices in order, and the scores (subjects, indices) of subjects who scored every stimulus."""
    indices = sorted({index for row in table.values() for index in row})
    rows = [[row[index] for index in indices] for row in table.values() if len(row) == len(indices)]
    return indices, np.array(rows).reshape(len(rows), len(indices))


def within_means(table: Table) -> tuple[WithinMean, ...]:
    """Return each stimulus' mean with the 95 % interval within subjects (Cousineau 2005, corrected by Morey 2008).

    Each subject's mean is replaced by the grand mean, and the variance multiplied by C / (C - 1) for C stimuli.
    These intervals are for comparing stimuli; they do not show the mean's uncertainty. Only subjects who scored
    every stimulus count. Empty for fewer than two of them or of stimuli.
    """
    indices, scores = _complete(table)
    n, stimuli = scores.shape
    if n < 2 or stimuli < 2:
        return ()
    means = scores.mean(axis=0).tolist()
    adjusted = scores - scores.mean(axis=1, keepdims=True) + scores.mean()
    deviation = adjusted.std(axis=0, ddof=1) * math.sqrt(stimuli / (stimuli - 1))
    half = t_quantile(n - 1) * deviation / math.sqrt(n)
    return tuple(
        WithinMean(index, n, mean, *((mean - margin, mean + margin) if margin > 1e-9 * abs(mean) else (None, None)))
        for index, mean, margin in zip(indices, means, half.tolist(), strict=True)
    )


def repeated_correlation(
    subjects: Sequence[str], x: Sequence[float], y: Sequence[float], blocks: Sequence[str] | None = None
) -> RepeatedCorrelation | None:
    """Return the repeated-measures correlation of pairs (N), each with its subject; None where it has no value.

    It is the correlation of x and y after subtracting each subject's means, or with `blocks` (N) those of each subject
    in each block, tested with N - k - 1 degrees of freedom for k means
    (Bland & Altman 1995; Bakdash & Marusich 2017, Front. Psychol. 8:456). That interval assumes independent pairs.
    Subjects who all meet the same stimuli share the nonlinearity of y in x, which is not random: `people` leaves out
    each subject with at least two pairs in turn (Tukey's jackknife of Fisher's z, t with one degree of freedom fewer
    than such subjects: Miller 1974, Biometrika 61:1). Neither holds for other stimuli, where these are few and shared.
    """
    codes = np.unique(np.array(subjects), return_inverse=True)[1]
    pairs = list(zip(subjects, blocks or [""] * len(codes), strict=True))
    numbers = {pair: number for number, pair in enumerate(dict.fromkeys(pairs))}
    levels = np.array([numbers[pair] for pair in pairs], np.int64)
    dof = len(codes) - len(numbers) - 1
    if dof < 2:
        return None
    columns = (np.array(values, np.float64) for values in (x, y))
    left_x, left_y = (column - (np.bincount(levels, column) / np.bincount(levels))[levels] for column in columns)
    size = math.sqrt(float(left_x @ left_x) * float(left_y @ left_y))
    if size <= 1e-12 * float(np.abs(x).max()) * float(np.abs(y).max()):
        return None
    r = float(np.clip(left_x @ left_y / size, -1.0, 1.0))
    has_pairs = np.bincount(codes) > np.bincount(codes[np.unique(levels, return_index=True)[1]])
    count = int(has_pairs.sum())
    if 1.0 - abs(r) < 1e-12:
        return RepeatedCorrelation(r, r, r, 0.0, dof, count, None, None)
    t = r * math.sqrt(dof / (1.0 - r * r))
    p = 2.0 * float(special.stdtr(dof, -abs(t)))
    products = np.array([left_x * left_y, left_x**2, left_y**2])
    xy, xx, yy = (np.bincount(codes, product).astype(np.float64)[has_pairs] for product in products)
    people, people_p = _jackknife(xy, xx, yy) or (None, None)
    half = t_quantile(math.inf) / math.sqrt(dof - 1)
    low, high = (math.tanh(math.atanh(r) + step) for step in (-half, half))
    return RepeatedCorrelation(r, low, high, p, dof, count, people, people_p)


def _jackknife(xy: Array, xx: Array, yy: Array) -> tuple[tuple[float, float], float] | None:
    """Return the jackknife interval of r, and its p, from each subject's sums (k).

    None for two subjects, identical subjects, or where r is ±1 without one of them.
    """
    others_xy, size = xy.sum() - xy, np.sqrt((xx.sum() - xx) * (yy.sum() - yy))
    if len(xy) < LEAST_CASES or not (np.abs(others_xy) < (1.0 - 1e-12) * size).all():
        return None
    z = math.atanh(float(xy.sum()) / math.sqrt(float(xx.sum()) * float(yy.sum())))
    low, high, p = map(float, jackknife(z, np.arctanh(others_xy / size)))
    return None if math.isnan(p) else ((math.tanh(low), math.tanh(high)), p)


def agreement(table: Table) -> Agreement | None:
    """Return subjects' agreement on the order; None for fewer than two subjects or three stimuli, or all ties."""
    scores = _complete(table)[1].round(9)  # means of repeats that tie differ by round-off
    n, stimuli = scores.shape
    if n < 2 or stimuli < 3 or np.all(np.ptp(scores, axis=1) == 0):
        return None
    from scipy import stats  # slow to load, which would delay the window

    friedman = stats.friedmanchisquare(*scores.T)
    page = stats.page_trend_test(scores)
    kendall_w = float(friedman.statistic) / (n * (stimuli - 1))
    return Agreement(n, kendall_w, float(friedman.pvalue), float(page.pvalue))


@dataclass(frozen=True, slots=True)
class Difference:
    """Mean difference of the scores of two stimuli, within subjects."""

    low_index: int  # of one stimulus
    high_index: int  # of the other
    n: int  # subjects who scored both
    mean: float  # score of `high_index` less that of `low_index` [points]
    low: float  # 95 % t interval [points]
    high: float  # its upper end [points]
    p: float  # paired t test, two-sided
    p_holm: float  # adjusted for the number of pairs (Holm 1979, Scand. J. Stat. 6:65)


def differences(table: Table) -> tuple[Difference, ...]:
    """Return the difference of each pair of stimuli, over at least three subjects who scored both."""
    rows: list[Difference] = []
    for lower, higher in itertools.combinations(sorted({index for row in table.values() for index in row}), 2):
        step = average([round(row[higher] - row[lower], 9) for row in table.values() if {lower, higher} <= row.keys()])
        if step is not None and step.n > 2 and step.sd and (ends := bounds(step.low, step.high)) is not None:
            p = 2.0 * float(special.stdtr(step.n - 1, -abs(step.mean) * math.sqrt(step.n) / step.sd))
            rows.append(Difference(lower, higher, step.n, step.mean, *ends, p, p))
    adjusted = holm([row.p for row in rows])
    return tuple(replace(row, p_holm=p) for row, p in zip(rows, adjusted, strict=True))


def holm(ps: Sequence[float]) -> tuple[float, ...]:
    """Return p values adjusted for multiple tests (Holm 1979, Scand. J. Stat. 6:65)."""
    order = np.argsort(ps, kind="stable")
    multiples = np.arange(len(ps), 0, -1) * np.array(ps, np.float64)[order]
    return tuple(np.maximum.accumulate(np.minimum(multiples, 1.0))[np.argsort(order)].tolist())


def z_scores(table: Table) -> dict[str, dict[int, float]]:
    """Return each subject's z-scores, which remove differences in the use of the scale.

    A subject whose scores do not vary is left out: it gave no order. So is one who did not score every stimulus: its
    mean and spread are those of a part of the scale.
    """
    rows: dict[str, dict[int, float]] = {}
    stimuli = len({index for row in table.values() for index in row})
    for subject, row in table.items():
        values = np.array(list(row.values()))
        if len(values) == stimuli > 1 and float(np.ptp(values)) > 1e-12 * float(np.abs(values).max()):
            mean, spread = float(values.mean()), float(values.std(ddof=1))
            rows[subject] = {index: (score - mean) / spread for index, score in row.items()}
    return rows


def equal_moduli(logs: Table) -> dict[str, dict[int, float]]:
    """Return logarithms of free-modulus estimates, shifted so that all subjects have the same level.

    With a free modulus each subject chooses a unit (Stevens 1957, Psychol. Rev. 64:153). A subject's level is its mean
    difference from the means of its surfaces (`surface_means`), so one who missed a surface keeps its unit.
    """
    means = surface_means([(subject, index, value) for subject, row in logs.items() for index, value in row.items()])
    if means is None:  # no subjects connect the surfaces
        grand = float(np.mean([np.mean(list(row.values())) for row in logs.values()])) if logs else 0.0
        means = dict.fromkeys((index for row in logs.values() for index in row), grand)
    shifted: dict[str, dict[int, float]] = {}
    for subject, row in logs.items():
        level = float(np.mean([value - means[index] for index, value in row.items()]))
        shifted[subject] = {index: value - level for index, value in row.items()}
    return shifted
