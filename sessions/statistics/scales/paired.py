"""A scale from choices between two: Bradley and Terry's, and Thurstone's case V, with an advantage of the first.

Both are generalised linear models of who was chosen: the difference of two values, and what coming first adds, go
through a logistic or a normal distribution function (Bradley and Terry 1952, Biometrika 39, 324; Thurstone 1927,
Psychol. Rev. 34, 273). Fitted by maximum likelihood, with Fisher's scoring.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.sparse import csgraph

from sessions.statistics.scores import IntervalEstimate

Array = NDArray[np.float64]
Model = Literal["Bradley–Terry", "Thurstone V"]
MODELS: tuple[Model, ...] = ("Bradley–Terry", "Thurstone V")

RESAMPLES = 1000
MOST_LOST = 0.025  # share of draws without a finite scale beyond which an end of an interval may be one of them
LEAST_SUBJECTS = 3  # of a bootstrap over subjects
_STEPS = 50  # of Fisher's scoring, which takes five
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
    """The scale of one set of choices. There are no values where `reason` says why."""

    model: Model
    choices: int
    subjects: int
    values: Mapping[int, IntervalEstimate] = field(
        default_factory=dict[int, IntervalEstimate]
    )  # by index, with mean 0, in logits or z
    first: IntervalEstimate | None = None  # what coming first adds, in the same unit
    deviance: float | None = None  # against a model with a chance of its own for every ordered pair
    freedom: int | None = None  # degrees of freedom of that deviance
    p: float | None = None  # of so large a deviance, by chi squared; too small where pairs were met a few times
    reason: str = ""
    interval_reason: str = ""  # why the values have no intervals


@dataclass(frozen=True, slots=True)
class Consistence:
    """How far one subject's choices agree with one order of the surfaces (Kendall and Babington Smith 1940)."""

    triads: int  # circular ones: a before b before c before a
    most: int  # that there could be
    zeta: float  # 1 less their ratio: 1 is an order, 0 as many circles as there can be


def paired_scale(choices: Sequence[Choice], model: Model = "Bradley–Terry", seed: int = 0) -> PairedScale:
    """Return the scale of choices, with intervals by a bootstrap over subjects."""
    indices = sorted({index for one in choices for index in (one.first, one.second)})
    subjects = sorted({one.subject for one in choices})
    none = PairedScale(model, len(choices), len(subjects))
    if len(indices) < 2:
        return replace(none, reason="there are no two surfaces to compare")
    counts = _counts(choices, indices, subjects)
    whole = counts.sum(axis=0)
    unbounded = _unbounded(whole, indices)
    if unbounded:
        return replace(none, reason=unbounded)
    fitted = _fit(whole, model)
    if fitted is None:
        return replace(none, reason="the likelihood has no finite maximum")
    draws, why = _bootstrap(counts, model, fitted, seed)
    ends = [_estimate(value, draws[:, n] if why == "" else None) for n, value in enumerate(fitted.tolist())]
    deviance, freedom = _deviance(whole, fitted, model)
    return replace(
        none,
        values=dict(zip(indices, ends, strict=False)),
        first=ends[-1],
        deviance=deviance,
        freedom=freedom,
        p=float(special.chdtrc(freedom, deviance)) if freedom > 0 else None,
        interval_reason=why,
    )


def consistence(choices: Sequence[Choice]) -> Mapping[str, Consistence]:
    """Return the circular triads of each subject who compared every pair; a pair met often counts by its majority.

    A pair chosen equally often both ways leaves its subject out, for it has no direction.
    """
    out: dict[str, Consistence] = {}
    for subject in sorted({one.subject for one in choices}):
        won: Counter[tuple[int, int]] = Counter()
        for one in choices:
            if one.subject == subject:
                won[(one.first, one.second) if one.first_chosen else (one.second, one.first)] += 1
        indices = sorted({index for pair in won for index in pair})
        leads = {(a, b): won[a, b] - won[b, a] for a, b in combinations(indices, 2)}
        if len(indices) < 3 or not all(leads.values()):
            continue
        wins = Counter(a if lead > 0 else b for (a, b), lead in leads.items())
        n = len(indices)
        circles = math.comb(n, 3) - sum(math.comb(wins[index], 2) for index in indices)
        most = (n**3 - n) // 24 if n % 2 else (n**3 - 4 * n) // 24
        out[subject] = Consistence(circles, most, 1.0 - circles / most)
    return out


def _counts(choices: Sequence[Choice], indices: Sequence[int], subjects: Sequence[str]) -> Array:
    """Return how often each subject met each ordered pair, and chose its first (s, 2, n, n)."""
    out = np.zeros((len(subjects), 2, len(indices), len(indices)))
    for one in choices:
        place = subjects.index(one.subject), indices.index(one.first), indices.index(one.second)
        out[place[0], 0, place[1], place[2]] += 1.0
        out[place[0], 1, place[1], place[2]] += one.first_chosen
    return out


def _unbounded(counts: Array, indices: Sequence[int]) -> str:
    """Return why the values would be without bound, "" where they are finite (Ford 1957, Am. Math. Mon. 64(8), 28)."""
    met, chosen = counts
    beaten = chosen + (met - chosen).T  # [a, b]: how often a was chosen and b was not
    groups, label = csgraph.connected_components(beaten > 0, directed=True, connection="strong")
    if groups > 1:
        above = next(group for group in range(groups) if not (beaten[label != group][:, label == group] > 0).any())
        names = ", ".join(str(index) for index, group in zip(indices, label, strict=True) if group == above)
        return f"no other surface was ever preferred to {names}, so their distance has no bound"
    return ""


def _design(count: int) -> Array:
    """Return what makes differences (n, n, n) of n - 1 values, the last 0, and the first's advantage."""
    unit = np.concatenate([np.eye(count)[:, : count - 1], np.zeros((count, 1))], axis=1)
    out = unit[:, None, :] - unit[None, :, :]
    out[:, :, -1] = 1.0
    return out


def _chances(eta: Array, model: Model) -> tuple[Array, Array]:
    """Return the chance that the first is chosen, and its slope."""
    if model == "Bradley–Terry":
        chance = np.asarray(special.expit(eta), np.float64)
        return chance, chance * (1.0 - chance)
    return np.asarray(special.ndtr(eta), np.float64), np.exp(-(eta**2) / 2.0) / math.sqrt(2.0 * math.pi)


def _fit(counts: Array, model: Model, begin: Array | None = None) -> Array | None:
    """Return the values about their mean and then the first's advantage (n + 1,); None without a finite maximum."""
    met, chosen = counts
    design = _design(len(met))
    compared = met > 0
    x, n, y = design[compared], met[compared], chosen[compared]
    beta = np.zeros(x.shape[1])
    if begin is not None:
        beta = np.append(begin[:-2] - begin[-2], begin[-1])
    for _ in range(_STEPS):
        chance, slope = _chances(x @ beta, model)
        spread = np.maximum(chance * (1.0 - chance), np.finfo(float).tiny)
        weight = n * slope**2 / spread
        try:
            step = np.asarray(
                np.linalg.solve(x.T @ (weight[:, None] * x), x.T @ ((y - n * chance) * slope / spread)), np.float64
            )
        except np.linalg.LinAlgError:
            return None
        beta = beta + step
        if not np.isfinite(beta).all() or np.abs(beta).max() > 30.0:
            return None
        if np.abs(step).max() < _GOOD:
            values = np.append(beta[:-1], 0.0)
            return np.append(values - values.mean(), beta[-1])
    return None


def _bootstrap(counts: Array, model: Model, begin: Array, seed: int) -> tuple[Array, str]:
    """Return what fits to subjects drawn anew give (b, n + 1), and why that makes no interval, "" where it does."""
    subjects = len(counts)
    if subjects < LEAST_SUBJECTS:
        return np.zeros((0, 0)), f"an interval over subjects takes {LEAST_SUBJECTS} of them"
    drawn = np.random.default_rng(seed).multinomial(subjects, np.full(subjects, 1.0 / subjects), RESAMPLES)
    totals = np.tensordot(drawn.astype(np.float64), counts, axes=1)
    indices = range(counts.shape[2])
    fits = [None if _unbounded(total, indices) else _fit(total, model, begin) for total in totals]
    scales = [fit for fit in fits if fit is not None]
    lost = RESAMPLES - len(scales)
    if lost > MOST_LOST * RESAMPLES:
        return np.zeros((0, 0)), f"{lost} of {RESAMPLES} draws of subjects have no finite scale"
    return np.array(scales), ""


def _estimate(value: float, draws: Array | None) -> IntervalEstimate:
    return IntervalEstimate(value, *([None, None] if draws is None else np.quantile(draws, [0.025, 0.975]).tolist()))


def _deviance(counts: Array, fitted: Array, model: Model) -> tuple[float, int]:
    """Return the deviance of a fit from a chance of its own for every ordered pair, and its degrees of freedom."""
    met, chosen = counts
    eta = fitted[:-1, None] - fitted[None, :-1] + fitted[-1]
    compared = met > 0
    chance = _chances(eta, model)[0][compared]
    n, y = met[compared], chosen[compared]
    terms = _x_log(y, n * chance) + _x_log(n - y, n * (1.0 - chance))
    return float(2.0 * terms.sum()), int(compared.sum()) - len(fitted) + 1


def _x_log(count: Array, expected: Array) -> Array:
    """Return count times the logarithm of count by expected, 0 where nothing was counted."""
    return count * np.log(np.where(count > 0.0, count / expected, 1.0))
