"""What else follows the scores beside a model's quantity: its others, and friction, forces and speed of the strokes."""

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sessions.prediction import BY_NAME, SED
from sessions.statistics.correlations import (
    CONFIDENCE,
    Contrast,
    cases_needed,
    contrast,
    fisher_interval,
    left_out_error,
    partial_correlation,
    pearson,
    relation,
    spearman,
)
from sessions.statistics.mixed_model import Array, akaike_weights, crossed_deviance
from sessions.statistics.scores import surface_means
from sessions.statistics.within_subjects import repeated_correlation

MODEL = SED.label  # the published quantity, to which the others are compared where no other is named
MODEL_MU = "µ of the model"
# Name for people, and that of the model's quantities at the receptor.
RESPONSES: Mapping[str, str] = {one.label: one.name for one in BY_NAME.values()}
# Name for people, and the field of a stroke or trial that holds it.
FIELDS: Mapping[str, str] = {
    MODEL_MU: "mu",
    "µ dynamic": "mu_dynamic",
    "µ static": "mu_static",
    "τ max": "tau_max",
    "T": "tangential_force",
    "N": "normal_force",
    "speed": "speed",
}
NAMES = (*RESPONSES, *FIELDS)
_RESAMPLES = 10_000
_NO_LINE = "without one of the surfaces the others do not determine a line"
_LEAST_SUBJECTS = 3  # of a bootstrap over subjects, and of the jackknife beside it


@dataclass(frozen=True, slots=True)
class Rival:
    """How one quantity goes with the scores, beside the model's. None where `reasons` says why under the field."""

    name: str
    n: int  # surfaces, or within subjects trials, that have it and a score
    r: float | None
    low: float | None  # 95 % interval: Fisher's z; within subjects the jackknife's over subjects
    high: float | None
    contrast: Contrast | None = None  # the model's r less this one
    partial: float | None = None  # r given the µ that the model got
    partial_low: float | None = None  # 95 % interval: Fisher's z; within subjects bootstrap over subjects
    partial_high: float | None = None
    # Of a surface's scores by the line through the others, root mean square [points]
    left_out_error: float | None = None
    weight: float | None = None  # Akaike's, of the mixed model with subjects and surfaces crossed
    same_order: bool | None = None  # orders the surfaces as the model's quantity does, or wholly the other way round
    needed: int | None = None  # surfaces with which Steiger's test would tell the two correlations of means apart
    reasons: dict[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True, slots=True)
class RivalTrial:
    """One scored trial of a study, with those quantities of its stroke that there are."""

    subject: str
    index: int
    score: float
    values: Mapping[str, float]


def rivals_of_means(
    scores: Mapping[int, float], series: Mapping[str, Mapping[int, float]], model: str = MODEL
) -> tuple[Rival, ...]:
    """Return how each quantity of the surfaces goes with their mean scores; () where there is no `model`.

    `scores` and each of `series` go by a surface's index; the quantities' names are those of `NAMES`. All are compared
    to `model`, which comes first.
    """
    if model not in series:
        return ()
    return tuple(_of_means(name, model, scores, series) for name in _ordered(model) if name in series)


def rivals_of_surfaces(trials: Sequence[RivalTrial], model: str = MODEL) -> tuple[Rival, ...]:
    """Return `rivals_of_means` of means over subjects, of the trials that have the model's quantity."""
    counted = [trial for trial in trials if model in trial.values]
    names = [name for name in NAMES if any(name in trial.values for trial in counted)]
    return rivals_of_means(*_means(counted, names), model)


def rivals_within(trials: Sequence[RivalTrial], model: str = MODEL) -> tuple[Rival, ...]:
    """Return how each quantity goes with the scores within subjects; () where no trial has `model`.

    Differences and partial correlations have percentile intervals of a bootstrap over subjects: those of other people
    on these very surfaces. What a larger number of surfaces would tell stands on the means over subjects.
    """
    counted = [trial for trial in trials if model in trial.values]
    names = [name for name in _ordered(model) if any(name in trial.values for trial in counted)]
    if not counted:
        return ()
    deviances = {name: _deviance(name, counted) for name in names}
    whole = {name: value for name, value in deviances.items() if not isinstance(value, str)}
    weights = dict(zip(whole, akaike_weights(list(whole.values())), strict=True)) if whole else {}
    rivals: list[Rival] = []
    for name in names:
        deviance = deviances[name]
        rival = replace(_within(name, model, counted), weight=weights.get(name))
        rivals.append(_because(rival, "weight", deviance if isinstance(deviance, str) else None))
    return tuple(rivals)


def _ordered(model: str) -> tuple[str, ...]:
    return (model, *(name for name in NAMES if name != model))


def _of_means(name: str, model: str, scores: Mapping[int, float], series: Mapping[str, Mapping[int, float]]) -> Rival:
    used = [name, model, *([MODEL_MU] if MODEL_MU in series else [])]
    own = [index for index in scores if index in series[name]]
    x, y = [series[name][i] for i in own], [scores[i] for i in own]
    related = relation(x, y, own)
    rival = Rival(name, len(own), related.pearson, related.low, related.high, left_out_error=left_out_error(x, y))
    rival = _because(rival, "r", related.reason)
    rival = _because(rival, "left_out_error", None if rival.left_out_error is not None else _NO_LINE)
    shared = [i for i in scores if all(i in series[one] for one in used)]
    score = [scores[i] for i in shared]
    values = {one: [series[one][i] for i in shared] for one in used}
    if name != model:
        rival = _compared(rival, values[model], values[name], score)
    if MODEL_MU not in used or name == MODEL_MU:
        return _because(rival, "partial", "µ itself is given")
    xy, xz, yz = pearson(values[name], score), pearson(values[name], values[MODEL_MU]), pearson(score, values[MODEL_MU])
    partial = None if xy is None or xz is None or yz is None else partial_correlation(xy, xz, yz)
    if partial is None:
        return _because(rival, "partial", "µ determines it, or there are too few surfaces")
    low, high = fisher_interval(partial, len(shared) - 1)
    return replace(rival, partial=partial, partial_low=low, partial_high=high)


def _compared(rival: Rival, model: Sequence[float], other: Sequence[float], score: Sequence[float]) -> Rival:
    """Return the rival with its difference from the model's quantity, over the surfaces that have both."""
    first, second, mutual = pearson(model, score), pearson(other, score), pearson(model, other)
    rho = spearman(model, other)
    if first is None or second is None or mutual is None or rho is None:
        return _because(rival, "contrast", "too few surfaces have both, or one of them does not vary")
    turned = math.copysign(1.0, first * second)
    rival = replace(
        rival,
        contrast=contrast(first, second, mutual, len(score)),
        same_order=abs(rho) > 1 - 1e-12,
        needed=cases_needed(abs(first), abs(second), turned * mutual),
    )
    why = None if rival.contrast else "no test from these few surfaces, or of a perfect r"
    return _because(rival, "contrast", why)


def _within(name: str, model: str, trials: Sequence[RivalTrial]) -> Rival:
    used = [*dict.fromkeys((name, model, MODEL_MU))]
    mine = [trial for trial in trials if name in trial.values]
    x, y = [trial.values[name] for trial in mine], [trial.score for trial in mine]
    subjects = [trial.subject for trial in mine]
    related = repeated_correlation(subjects, x, y)
    low, high = (related.people if related is not None else None) or (None, None)
    error = _left_out_surface(mine, name)
    rival = Rival(name, len(mine), None if related is None else related.r, low, high, left_out_error=error)
    rival = _because(rival, "r", None if related is not None else "too few trials within subjects, or no variation")
    rival = _because(rival, "left_out_error", None if error is not None else _NO_LINE)
    shared = [trial for trial in mine if all(one in trial.values for one in used)]
    drawn = _resampled(shared, used)
    few = f"it takes {_LEAST_SUBJECTS} subjects with trials that have all of them"
    if drawn is None:
        return _because(_because(rival, "partial", few), "contrast", None if name == model else few)
    here, again = drawn
    if name != model:
        rival = _bootstrapped(rival, here, again, len(shared))
    if name == MODEL_MU:
        return _because(rival, "partial", "µ itself is given")
    control, column = used.index(MODEL_MU) + 1, 1
    partial = _partials(here[None], column, control)
    if not np.isfinite(partial).all():
        return _because(rival, "partial", "µ determines it")
    ends = _percentiles(_partials(again, column, control))
    return replace(rival, partial=float(partial[0]), partial_low=ends[0], partial_high=ends[1])


def _bootstrapped(rival: Rival, here: Array, again: Array, n: int) -> Rival:
    """Return the rival with its difference from the model's quantity, from covariances: score, rival, model, µ."""
    signs = np.sign([_correlations(here[None], 0, column)[0] for column in (2, 1)])

    def steps(covariances: Array) -> Array:
        return signs[0] * _correlations(covariances, 0, 2) - signs[1] * _correlations(covariances, 0, 1)

    step = float(steps(here[None])[0])
    if not math.isfinite(step):
        return _because(rival, "contrast", "one of them does not vary within subjects")
    return replace(rival, contrast=Contrast(n, step, *_percentiles(steps(again)), None, None))


def _resampled(trials: Sequence[RivalTrial], names: Sequence[str]) -> tuple[Array, Array] | None:
    """Return the covariances within subjects of score and quantities, and those of subjects drawn anew.

    Each subject's products are summed once; a draw is then a sum over the subjects drawn. None of too few subjects.
    """
    subjects = list(dict.fromkeys(trial.subject for trial in trials))
    if len(subjects) < _LEAST_SUBJECTS:
        return None
    columns = np.array([[trial.score, *(trial.values[name] for name in names)] for trial in trials])
    columns = columns / np.abs(columns).max(axis=0, initial=1e-300)
    whose = np.array([subjects.index(trial.subject) for trial in trials])
    products: list[Array] = []
    for code in range(len(subjects)):
        own = columns[whose == code]
        own = own - own.mean(axis=0)
        products.append(own.T @ own)
    draw = np.random.default_rng(0).multinomial(len(subjects), np.full(len(subjects), 1 / len(subjects)), _RESAMPLES)
    return np.sum(products, axis=0), np.tensordot(draw.astype(np.float64), np.array(products), axes=1)


def _correlations(covariances: Array, first: int, second: int) -> Array:
    """Return the correlation of two columns in each of many covariances (b, c, c); nan where one does not vary."""
    size = covariances[:, first, first] * covariances[:, second, second]
    return np.where(size > 0.0, covariances[:, first, second], np.nan) / np.sqrt(np.where(size > 0.0, size, 1.0))


def _partials(covariances: Array, column: int, control: int) -> Array:
    """Return the correlation of score and a column given another in each of many covariances; nan where none is."""
    xy, xz, yz = (_correlations(covariances, *pair) for pair in ((0, column), (0, control), (column, control)))
    left = (1 - xz * xz) * (1 - yz * yz)
    return np.where(left > 1e-12, xy - xz * yz, np.nan) / np.sqrt(np.where(left > 1e-12, left, 1.0))


def _percentiles(values: Array) -> tuple[float, float]:
    low, high = np.nanquantile(values, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return float(low), float(high)


def _left_out_surface(trials: Sequence[RivalTrial], name: str) -> float | None:
    """Return the error of the scores of each surface by subjects' levels and one slope, both fitted to the others."""
    errors: list[float] = []
    for index in dict.fromkeys(trial.index for trial in trials):
        kept = [trial for trial in trials if trial.index != index]
        own: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
        for t in kept:
            own[t.subject].append((t.values[name], t.score))
        level = {subject: [float(np.mean(one)) for one in zip(*pairs, strict=True)] for subject, pairs in own.items()}
        steps = [(t.values[name] - level[t.subject][0], t.score - level[t.subject][1]) for t in kept]
        size = sum(x * x for x, _ in steps)
        if size <= 1e-24 * max((t.values[name] ** 2 for t in kept), default=1.0):
            return None
        slope = sum(x * y for x, y in steps) / size
        for trial in trials:
            if trial.index == index and trial.subject in level:
                x, y = level[trial.subject]
                errors.append(trial.score - y - slope * (trial.values[name] - x))
    return math.sqrt(float(np.mean(np.square(errors)))) if errors else None


def _deviance(name: str, trials: Sequence[RivalTrial]) -> float | str:
    """Return the deviance of the mixed model on a quantity, or why it has none that compares."""
    missing = sum(name not in trial.values for trial in trials)
    if missing:
        return f"{missing} of {len(trials)} trials have no such number, and AIC compares models of the same scores"
    subjects, surfaces = [trial.subject for trial in trials], [trial.index for trial in trials]
    if min(len(set(subjects)), len(set(surfaces))) < 2 or len(trials) < 6:
        return "too few subjects, surfaces or trials for a model of five parameters"
    x, y = [trial.values[name] for trial in trials], [trial.score for trial in trials]
    deviance = crossed_deviance(subjects, surfaces, y, x)
    return "it does not vary, or the scores leave nothing to tell an error from" if deviance is None else deviance


def _means(
    trials: Sequence[RivalTrial], names: Sequence[str]
) -> tuple[Mapping[int, float], Mapping[str, Mapping[int, float]]]:
    """Return the means over subjects of scores and of quantities, by surface."""

    def means(value: Callable[[RivalTrial], float | None]) -> Mapping[int, float]:
        points = [(t.subject, t.index, v) for t in trials if (v := value(t)) is not None]
        return surface_means(points) or {}

    return means(lambda t: t.score), {name: means(lambda t, name=name: t.values.get(name)) for name in names}


def _because(rival: Rival, what: str, why: str | None) -> Rival:
    return rival if why is None else replace(rival, reasons={**rival.reasons, what: why})
