"""Scales of choices and magnitude estimates, and all kinds of judgement on one latent scale.

Choices between two have Bradley and Terry's scale, and Thurstone's case V, with an advantage of the first. Both are
generalised linear models of the choice: the difference of two values plus the advantage of the first, through a
logistic or a normal distribution function (Bradley and Terry 1952, Biometrika 39, 324; Thurstone 1927, Psychol. Rev.
34, 273). They are fitted by maximum likelihood with Fisher scoring.

Magnitude estimates have the exponent of Stevens' law: log answer = level of the subject + exponent log magnitude (1957,
Psychol. Rev. 64, 153). Errors of the magnitude flatten an ordinary slope; Deming's slope (1943) allows for
both errors by the ratio of their variances.

The latent scale has Thurstone's unit, the standard deviation of the difference of two judgements: in case V two
surfaces z apart are judged correctly in Φ(z) of choices. A score, or the logarithm of an estimate, is such a judgement.
Without levels of subjects, single judgements scatter by s, and the unit is √2 s. Comparisons with a standard have their
unit from the just noticeable difference, which is 0.674.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np
from scipy import special

from drivers.arrays import Array
from sessions.statistics.correlations import LEAST_CASES, jackknife
from sessions.statistics.mixed_model import Term, mixed_model
from sessions.statistics.psychometric import QUARTILE, binomial_deviance
from sessions.statistics.scores import IntervalEstimate, by_key

Model = Literal["Bradley–Terry", "Thurstone V"]
MODELS: tuple[Model, ...] = ("Bradley–Terry", "Thurstone V")

_STEPS = 50  # of Fisher scoring, which takes five
_GOOD = 1e-10


@dataclass(frozen=True, slots=True)
class Choice:
    """One answer: which of two surfaces was chosen."""

    subject: str
    first: int  # index of the surface that was stroked first
    second: int
    first_chosen: bool


@dataclass(frozen=True, slots=True)
class PairedScale:
    """The scale of one set of choices. Without values `reason` says why."""

    model: Model
    choices: int  # all that were made
    subjects: int  # who made them
    # By index, with mean 0, in logits or z
    values: Mapping[int, IntervalEstimate] = field(default_factory=dict[int, IntervalEstimate])
    first: IntervalEstimate | None = None  # advantage of coming first, in the same unit
    deviance: float | None = None  # against a separate probability for every ordered pair
    freedom: int | None = None  # degrees of freedom of that deviance
    p: float | None = None  # of that deviance, by chi squared; approximate where pairs were met a few times
    reason: str = ""
    interval_reason: str = ""  # why the values have no intervals


@dataclass(frozen=True, slots=True)
class Consistence:
    """Agreement of one subject's choices with a single order of the surfaces (Kendall and Babington Smith 1940)."""

    triads: int  # circular ones: a before b before c before a
    most: int  # greatest possible number
    zeta: float  # 1 - triads / most: 1 is a perfect order


def paired_scale(choices: Sequence[Choice], model: Model = "Bradley–Terry") -> PairedScale:
    """Return the scale of choices, with jackknife intervals over subjects."""
    indices = sorted({index for choice in choices for index in (choice.first, choice.second)})
    subjects = sorted({choice.subject for choice in choices})
    none = PairedScale(model, len(choices), len(subjects))
    if len(indices) < 2:
        return replace(none, reason="there are no two surfaces to compare")
    counts = _counts(choices, indices, subjects)
    total = counts.sum(axis=0)
    if reason := _no_scale(total, indices):
        return replace(none, reason=reason)
    fitted = _fit(total, model)
    if fitted is None:
        return replace(none, reason="the likelihood has no finite maximum")
    without, reason = _without_each(counts, model, fitted)
    estimates = _estimates(fitted, without)
    deviance, freedom = _deviance(total, fitted, model)
    return replace(
        none,
        values=dict(zip(indices, estimates, strict=False)),
        first=estimates[-1],
        deviance=deviance,
        freedom=freedom,
        p=float(special.chdtrc(freedom, deviance)) if freedom > 0 else None,
        interval_reason=reason,
    )


def consistence(choices: Sequence[Choice]) -> Mapping[str, Consistence]:
    """Return the circular triads of each subject who compared every pair; a repeated pair counts by its majority.

    A subject with a tied pair is left out.
    """
    results: dict[str, Consistence] = {}
    pairs = ((c.subject, (c.first, c.second) if c.first_chosen else (c.second, c.first)) for c in choices)
    for subject, answers in sorted(by_key(pairs).items()):
        won = Counter(answers)  # by (chosen surface, other surface)
        indices = sorted({index for pair in won for index in pair})
        leads = {pair: won[pair] - won[pair[::-1]] for pair in combinations(indices, 2)}
        if len(indices) < 3 or not all(leads.values()):
            continue
        wins = Counter(pair[0] if lead > 0 else pair[1] for pair, lead in leads.items())
        n = len(indices)
        triads = math.comb(n, 3) - sum(math.comb(wins[index], 2) for index in indices)
        most = (n**3 - (n if n % 2 else 4 * n)) // 24
        results[subject] = Consistence(triads, most, 1.0 - triads / most)
    return results


def _counts(choices: Sequence[Choice], indices: Sequence[int], subjects: Sequence[str]) -> Array:
    """Return how often each subject met each ordered pair, and chose the first (s, 2, n, n)."""
    counts = np.zeros((len(subjects), 2, len(indices), len(indices)))
    for choice in choices:
        cell = counts[subjects.index(choice.subject), :, indices.index(choice.first), indices.index(choice.second)]
        cell += (1.0, choice.first_chosen)
    return counts


def _no_scale(counts: Array, indices: Sequence[int]) -> str:
    """Return why values are not finite, "" where they are (Ford 1957, Am. Math. Mon. 64(8), 28)."""
    from scipy.sparse.csgraph import connected_components  # slow to load and not needed to open a session

    meetings, wins = counts
    beaten = wins + (meetings - wins).T  # [a, b]: how often a was chosen over b
    groups, label = connected_components(beaten > 0, directed=True, connection="strong")
    if groups > 1:
        unbeaten = next(group for group in range(groups) if not (beaten[label != group][:, label == group] > 0).any())
        names = ", ".join(str(index) for index, group in zip(indices, label, strict=True) if group == unbeaten)
        return f"no other surface was ever preferred to {names}, so their distance has no bound"
    if np.linalg.matrix_rank(_design(len(indices))[meetings > 0]) < len(indices):
        return "preference and order cannot be separated: some pairs must be presented in both orders"
    return ""


def _design(count: int) -> Array:
    """Return the design (n, n, n) of differences of values, the last value 0, and of the first's advantage."""
    unit = np.concatenate([np.eye(count)[:, : count - 1], np.zeros((count, 1))], axis=1)
    differences = unit[:, None, :] - unit[None, :, :]
    differences[:, :, -1] = 1.0
    return differences


def _chances(eta: Array, model: Model) -> tuple[Array, Array]:
    """Return the probability that the first is chosen, and its derivative."""
    if model == "Bradley–Terry":
        chance = np.asarray(special.expit(eta), np.float64)
        return chance, chance * (1.0 - chance)
    return np.asarray(special.ndtr(eta), np.float64), np.exp(-(eta**2) / 2.0) / math.sqrt(2.0 * math.pi)


def _fit(counts: Array, model: Model, start: Array | None = None) -> Array | None:
    """Return the centred values and the first's advantage (n + 1,); None without a finite maximum."""
    meetings, wins = counts
    pairs = meetings > 0
    x, n, y = _design(len(meetings))[pairs], meetings[pairs], wins[pairs]
    beta = np.zeros(x.shape[1])
    if start is not None:
        beta = np.append(start[:-2] - start[-2], start[-1])
    for _ in range(_STEPS):
        chance, slope = _chances(x @ beta, model)
        spread = np.maximum(chance * (1.0 - chance), np.finfo(float).tiny)
        weight = n * slope**2 / spread
        information, gradient = x.T @ (weight[:, None] * x), x.T @ ((y - n * chance) * slope / spread)
        try:
            step = np.asarray(np.linalg.solve(information, gradient), np.float64)
        except np.linalg.LinAlgError:
            return None
        beta = beta + step
        if not np.isfinite(beta).all() or np.abs(beta).max() > 30.0:
            return None
        if np.abs(step).max() < _GOOD:
            values = np.append(beta[:-1], 0.0)
            return np.append(values - values.mean(), beta[-1])
    return None


def _without_each(counts: Array, model: Model, start: Array) -> tuple[Array, str]:
    """Return the fits without each subject (s, n + 1), and why they give no interval, "" where they do."""
    if len(counts) < LEAST_CASES:
        return np.zeros((0, 0)), f"an interval over subjects needs {LEAST_CASES} of them"
    indices, totals = range(counts.shape[2]), counts.sum(axis=0) - counts
    fits = [None if _no_scale(total, indices) else _fit(total, model, start) for total in totals]
    scales = [fit for fit in fits if fit is not None]
    if len(scales) < len(fits):
        return np.zeros((0, 0)), "without one of the subjects the others have no finite scale"
    return np.array(scales), ""


def _estimates(estimates: Array, replicates: Array) -> list[IntervalEstimate]:
    """Return `estimates` (m,) with jackknife intervals, from estimates without each of k >= 0 subjects (k, m)."""
    low, high, _ = jackknife(estimates, replicates) if len(replicates) else np.full((3, len(estimates)), np.nan)
    columns = zip(estimates.tolist(), low.tolist(), high.tolist(), strict=True)
    return [IntervalEstimate(value, *(pair if math.isfinite(pair[0]) else (None, None))) for value, *pair in columns]


def _deviance(counts: Array, fitted: Array, model: Model) -> tuple[float, int]:
    """Return the deviance of a fit from separate probabilities for ordered pairs, and its degrees of freedom."""
    meetings, wins = counts
    eta = fitted[:-1, None] - fitted[None, :-1] + fitted[-1]
    pairs = meetings > 0
    deviance = binomial_deviance(wins[pairs], meetings[pairs], _chances(eta, model)[0][pairs])
    return deviance, int(pairs.sum()) - len(fitted) + 1


NAME = "log magnitude"


@dataclass(frozen=True, slots=True)
class Exponent:
    """Stevens' exponent, by two methods. None where `reason` says why."""

    subjects: int  # who gave them
    trials: int  # with an estimate and a µ
    plain: Term | None  # slope of the mixed model, with exact magnitudes [-]
    # Deming's slope through the surfaces, and its 95 % interval; None for identical subjects
    deming: tuple[float, float | None, float | None] | None = None
    error_ratio: float | None = None  # error variance of a surface's log answer over that of its log magnitude [-]
    reason: str = ""


def stevens_exponent(
    subjects: Sequence[str], surfaces: Sequence[int], answers: Sequence[float], magnitudes: Sequence[float]
) -> Exponent:
    """Return the exponent of answers (n,) on magnitudes (n,), both above 0, in trials of subjects and surfaces (n,).

    The interval of Deming's slope is from the jackknife over subjects. The caller leaves out values not above 0.
    """
    y, x = np.log(np.asarray(answers, np.float64)), np.log(np.asarray(magnitudes, np.float64))
    result = Exponent(len(set(subjects)), len(y), None)
    if result.subjects < LEAST_CASES or len(set(surfaces)) < LEAST_CASES:
        return replace(result, reason=f"it takes {LEAST_CASES} subjects and {LEAST_CASES} surfaces")
    model = mixed_model(subjects, y.tolist(), {NAME: x.tolist()})
    reason = model if isinstance(model, str) else ""
    result = replace(result, plain=None if isinstance(model, str) else model.term(NAME), reason=reason)
    cells = _cells(subjects, surfaces, y, x)
    if cells is None:
        return replace(result, reason=reason or "some subject missed a surface")
    estimate = _deming(cells)
    if estimate is None:
        return replace(result, reason=reason or "magnitudes or answers do not vary over surfaces")
    slope, ratio = estimate
    without = [_deming(np.delete(cells, n, axis=0)) for n in range(len(cells))]
    slopes = [replicate[0] for replicate in without if replicate is not None]
    if len(slopes) < len(cells):
        return replace(result, reason=reason or "without one of the subjects nothing varies")
    (deming,) = _estimates(np.array([slope]), np.array(slopes)[:, None])
    error_ratio = ratio if math.isfinite(ratio) else None
    return replace(result, deming=(slope, deming.low, deming.high), error_ratio=error_ratio)


def _cells(subjects: Sequence[str], surfaces: Sequence[int], y: Array, x: Array) -> Array | None:
    """Return log answers and magnitudes (s, k, 2), without each subject's mean; None where a cell is empty."""
    answers = by_key(zip(zip(subjects, surfaces, strict=True), zip(y.tolist(), x.tolist(), strict=True), strict=True))
    people, indices = sorted(set(subjects)), sorted(set(surfaces))
    if len(answers) < len(people) * len(indices):
        return None
    cells = np.array([[np.mean(answers[subject, index], axis=0) for index in indices] for subject in people])
    return cells - cells.mean(axis=1, keepdims=True)


def _deming(cells: Array) -> tuple[float, float] | None:
    """Return Deming's slope through surfaces' means, and the ratio of error variances; None where nothing varies.

    Errors are the differences between subjects on a surface, without their levels.
    """
    means = cells.mean(axis=0)
    errors = cells - means
    error_y, error_x = np.sum(errors**2, axis=(0, 1)).tolist()
    (yy, xy), (_, xx) = (means.T @ means).tolist()
    if not (error_x > 0.0 and xy != 0.0):
        return (xy / xx, math.inf) if xx > 0.0 and error_x == 0.0 else None
    ratio = error_y / error_x
    excess = yy - ratio * xx
    root = math.hypot(excess, 2.0 * math.sqrt(ratio) * xy)
    return (excess + root) / (2.0 * xy) if excess > 0.0 else 2.0 * ratio * xy / (root - excess), ratio


Judgement = Literal["scores", "estimates", "choices", "comparisons"]
JUDGEMENTS: tuple[Judgement, ...] = ("scores", "estimates", "choices", "comparisons")


def latent_judgements(points: Sequence[tuple[str, int, float]]) -> Mapping[int, IntervalEstimate]:
    """Return the latent value of each surface, with mean 0, from subject, index and score or log estimate.

    Intervals are from the jackknife over subjects. Subjects who missed a surface that another judged do not count.
    Empty for fewer than three other subjects, fewer than two surfaces, or without residuals, which give the unit.
    """
    by_subject = by_key((subject, (index, value)) for subject, index, value in points)
    indices = sorted({index for _, index, _ in points})
    complete = [[row[i] for i in indices] for row in map(by_key, by_subject.values()) if len(row) == len(indices)]
    if len(complete) < LEAST_CASES or len(indices) < 2:
        return {}
    means = np.array([[np.mean(cell) for cell in row] for row in complete])
    table = (
        means - means.mean(axis=1, keepdims=True),
        np.array([[float(len(cell)) for cell in row] for row in complete]),
        np.array([sum(float(np.var(cell)) * len(cell) for cell in row) for row in complete]),
    )
    values = _latent_values(*table)
    without = np.array([_latent_values(*(np.delete(part, n, axis=0) for part in table)) for n in range(len(complete))])
    if not np.isfinite([values, *without]).all():
        return {}
    return dict(zip(indices, _estimates(values, without), strict=True))


def _latent_values(cells: Array, counts: Array, within: Array) -> Array:
    """Return surfaces' means over subjects divided by √2 times the scatter (k,); nan without scatter.

    `cells` (s, k) are means of repeats without each subject's mean; `counts` (s, k) are the repeats, and
    `within` (s,) is their sum of squares about the means.
    """
    means = cells.mean(axis=0)
    squares = float((counts * (cells - means) ** 2).sum() + within.sum())
    unit = math.sqrt(2.0 * squares / (float(counts.sum()) - sum(cells.shape) + 1.0))
    return means / unit if unit > 1e-9 * float(np.abs(means).max()) else np.full_like(means, np.nan)


def latent_comparisons(mu: Mapping[int, float], log_jnd: tuple[float, float, float]) -> Mapping[int, IntervalEstimate]:
    """Return the latent value of each surface, with mean 0, from its µ and the logarithms of the JND and its ends.

    The JND is a difference of log µ. Intervals are from the JND alone: µ is taken as exact.
    """
    logs = {index: math.log(value) for index, value in mu.items()}
    middle = sum(logs.values()) / max(len(logs), 1)
    value, *bounds = (QUARTILE / math.exp(log_value) for log_value in log_jnd)
    estimates: dict[int, IntervalEstimate] = {}
    for index, log_mu in logs.items():
        low, high = sorted((log_mu - middle) * bound for bound in bounds)
        estimates[index] = IntervalEstimate((log_mu - middle) * value, low, high)
    return estimates
