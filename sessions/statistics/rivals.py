"""Correlations of scores with all quantities of the model, and with friction, forces and speed of the strokes."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from drivers.arrays import Array
from sessions.prediction import BY_NAME, SED
from sessions.statistics.correlations import (
    LEAST_CASES,
    Contrast,
    contrast,
    fisher_interval,
    jackknife,
    leave_one_out_error,
    partial_correlation,
    pearson,
    relation,
    required_cases,
    spearman,
)
from sessions.statistics.mixed_model import akaike_weights, crossed_aic
from sessions.statistics.scores import by_key, surface_means
from sessions.statistics.within_subjects import repeated_correlation
from sessions.strokes.stroke import Meaning

MODEL_SED = SED.label  # the published quantity, the default for comparisons
MODEL_MU = "µ of the model"
# Label, and name of the model's quantity at the receptor.
RESPONSES: Mapping[str, str] = {quantity.label: quantity.name for quantity in BY_NAME.values()}
# Label, and field of a stroke or trial.
STROKE_FIELDS: Mapping[str, str] = {
    MODEL_MU: "mu",
    "µ dynamic": "mu_dynamic",
    "µ static": "mu_static",
    "τ max": "tau_max",
    "T": "tangential_force",
    "N": "normal_force",
    "speed": "speed",
}
RIVAL_NAMES = (*RESPONSES, *STROKE_FIELDS)
_NO_LINE = "without one of the surfaces the others do not determine a line"


@dataclass(frozen=True, slots=True)
class Rival:
    """The correlation of one quantity with the scores. A number is None where `reasons` says why, by its name."""

    name: Annotated[str, Meaning("", "the quantity")]
    n: Annotated[int, Meaning("", "surfaces, or within subjects trials, with the quantity and a score")]
    r: Annotated[float | None, Meaning("", "its correlation with the scores")]
    low: Annotated[
        float | None,
        Meaning("", "lower end of its 95 % interval: Fisher's z; within subjects the jackknife over subjects"),
    ]
    high: Annotated[float | None, Meaning("", "upper end")]
    contrast: Contrast | None = None  # the model's r less this one
    partial: Annotated[float | None, Meaning("", "r given the µ of the model")] = None
    partial_low: Annotated[float | None, Meaning("", "lower end of its 95 % interval, as for r")] = None
    partial_high: Annotated[float | None, Meaning("", "upper end")] = None
    left_out_error: Annotated[
        float | None,
        Meaning("points", "root mean square error of a surface's scores by the line through the other surfaces"),
    ] = None
    weight: Annotated[float | None, Meaning("", "Akaike's, of a mixed model on the quantity; within subjects only")] = (
        None
    )
    same_order: Annotated[
        bool | None,
        Meaning("", "whether it orders surfaces as the model's quantity, or in reverse; none where it lacks one"),
    ] = None
    needed: Annotated[
        int | None, Meaning("", "surfaces that Steiger's test needs to distinguish both; none without a test of means")
    ] = None
    reasons: dict[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True, slots=True)
class RivalTrial:
    """One scored trial of a study, with the available quantities of its stroke."""

    subject: str
    index: int
    score: float
    values: Mapping[str, float]
    block: str = ""  # in which it was stroked: one depth and direction


def rivals_of_means(
    scores: Mapping[int, float], series: Mapping[str, Mapping[int, float]], model: str = MODEL_SED
) -> tuple[Rival, ...]:
    """Return the correlation of each quantity of the surfaces with mean scores; () without `model`.

    `scores` and each of `series`, named as in `RIVAL_NAMES`, are by index. All are compared to `model`, which is first.
    """
    if model not in series:
        return ()
    return tuple(_mean_rival(name, model, scores, series) for name in _model_first(model) if name in series)


def rivals_of_surfaces(trials: Sequence[RivalTrial], model: str = MODEL_SED) -> tuple[Rival, ...]:
    """Return `rivals_of_means` for means over subjects of trials that have the model's quantity."""
    model_trials = [trial for trial in trials if model in trial.values]

    def means(value: Callable[[RivalTrial], float | None]) -> Mapping[int, float]:
        numbers = [(trial.subject, trial.index, value(trial)) for trial in model_trials]
        return surface_means([(subject, index, x) for subject, index, x in numbers if x is not None]) or {}

    names = [name for name in RIVAL_NAMES if any(name in trial.values for trial in model_trials)]
    series = {name: means(lambda trial, name=name: trial.values.get(name)) for name in names}
    return rivals_of_means(means(lambda trial: trial.score), series, model)


def rivals_within(trials: Sequence[RivalTrial], model: str = MODEL_SED) -> tuple[Rival, ...]:
    """Return the correlation of each quantity with scores within subjects; () where no trial has `model`.

    Differences and partial correlations have jackknife intervals over subjects, valid for other subjects on these
    surfaces. The number of surfaces that a test needs is given for means over subjects only.
    """
    model_trials = [trial for trial in trials if model in trial.values]
    names = [name for name in _model_first(model) if any(name in trial.values for trial in model_trials)]
    if not model_trials:
        return ()
    criteria = {name: _akaike(name, model_trials) for name in names}
    comparable = {name: value for name, value in criteria.items() if not isinstance(value, str)}
    weights = dict(zip(comparable, akaike_weights(list(comparable.values())), strict=True)) if comparable else {}
    return tuple(
        _because(
            replace(_within(name, model, model_trials), weight=weights.get(name)),
            weight=criterion if isinstance(criterion, str) else None,
        )
        for name, criterion in criteria.items()
    )


def _model_first(model: str) -> tuple[str, ...]:
    return (model, *(name for name in RIVAL_NAMES if name != model))


def _mean_rival(name: str, model: str, scores: Mapping[int, float], series: Mapping[str, Mapping[int, float]]) -> Rival:
    quantities = [name, model, *([MODEL_MU] if MODEL_MU in series else [])]
    shared = [index for index in scores if index in series[name]]
    x, y = [series[name][i] for i in shared], [scores[i] for i in shared]
    fit, error = relation(x, y, shared), leave_one_out_error(x, y)
    rival = Rival(name, len(shared), fit.pearson, fit.low, fit.high, left_out_error=error)
    rival = _because(rival, r=fit.reason, left_out_error=_NO_LINE if error is None else None)
    indices = [i for i in scores if all(i in series[quantity] for quantity in quantities)]
    score = [scores[i] for i in indices]
    values = {quantity: [series[quantity][i] for i in indices] for quantity in quantities}
    if name != model:
        rival = _compare(rival, values[model], values[name], score)
        if len(indices) < sum(i in series[model] for i in scores):
            rival = replace(rival, same_order=None)
    if MODEL_MU not in quantities or name == MODEL_MU:
        return _because(rival, partial="µ itself is given")
    xy, xz, yz = pearson(values[name], score), pearson(values[name], values[MODEL_MU]), pearson(score, values[MODEL_MU])
    partial = math.nan if xy is None or xz is None or yz is None else float(partial_correlation(xy, xz, yz))
    if math.isnan(partial):
        return _because(rival, partial="µ determines it, one of them does not vary, or there are too few surfaces")
    low, high = fisher_interval(partial, len(indices) - 1)
    return replace(rival, partial=partial, partial_low=low, partial_high=high)


def _compare(rival: Rival, model: Sequence[float], values: Sequence[float], score: Sequence[float]) -> Rival:
    """Return the rival with its difference from the model's quantity, over the surfaces that have both."""
    first, second, mutual = pearson(model, score), pearson(values, score), pearson(model, values)
    rho = spearman(model, values)
    if first is None or second is None or mutual is None or rho is None:
        return _because(rival, contrast="too few surfaces have both, or one of them does not vary")
    rival = replace(
        rival,
        contrast=contrast(first, second, mutual, len(score)),
        same_order=abs(rho) > 1 - 1e-12,
    )
    if rival.contrast is not None:
        signed = math.copysign(1.0, first * second) * mutual
        rival = replace(rival, needed=required_cases(abs(first), abs(second), signed))
    return _because(rival, contrast=None if rival.contrast else "no test from these few surfaces, or of a perfect r")


def _within(name: str, model: str, trials: Sequence[RivalTrial]) -> Rival:
    quantities = [*dict.fromkeys((name, model, MODEL_MU))]
    rival_trials = [trial for trial in trials if name in trial.values]
    x, y = [trial.values[name] for trial in rival_trials], [trial.score for trial in rival_trials]
    within = repeated_correlation([trial.subject for trial in rival_trials], x, y)
    error = _leave_surface_out_error(rival_trials, name)
    low, high = (within.people if within is not None else None) or (None, None)
    rival = Rival(name, len(rival_trials), None if within is None else within.r, low, high, left_out_error=error)
    no_r = "too few trials within subjects, or no variation" if within is None else None
    rival = _because(rival, r=no_r, left_out_error=_NO_LINE if error is None else None)
    complete = [trial for trial in rival_trials if all(quantity in trial.values for quantity in quantities)]
    covariances = _covariances(complete, quantities)
    if covariances is None:
        reason = f"it takes {LEAST_CASES} subjects with two trials or more that have all of them"
        return _because(rival, partial=reason, contrast=None if name == model else reason)
    if name != model:
        rival_r, model_r = (_correlations(covariances, 0, column) for column in (1, 2))
        differences = np.sign(model_r[0]) * model_r - np.sign(rival_r[0]) * rival_r
        if math.isfinite(differences[0]):
            low, high, p = _finite_or_none(*jackknife(differences[0], differences[1:]))
            rival = replace(rival, contrast=Contrast(len(complete), float(differences[0]), low, high, None, p))
        else:
            rival = _because(rival, contrast="one of them does not vary within subjects")
    if name == MODEL_MU:
        return _because(rival, partial="µ itself is given")
    mu = quantities.index(MODEL_MU) + 1
    partials = partial_correlation(*(_correlations(covariances, *pair) for pair in ((0, 1), (0, mu), (1, mu))))
    if not math.isfinite(partials[0]):
        return _because(rival, partial="µ determines it, or one of them does not vary")
    with np.errstate(divide="ignore", invalid="ignore"):  # a perfect one has no z
        z = np.arctanh(partials)
        low, high = _finite_or_none(*np.tanh(jackknife(z[0], z[1:])[:2]))
    return replace(rival, partial=float(partials[0]), partial_low=low, partial_high=high)


def _covariances(trials: Sequence[RivalTrial], names: Sequence[str]) -> Array | None:
    """Return covariances within subjects of score and quantities (1 + k, c, c): with all k subjects, then without each.

    A subject with a single trial does not vary and is left out. None with too few subjects.
    """
    rows = by_key((trial.subject, [trial.score, *(trial.values[name] for name in names)]) for trial in trials)
    columns = [np.array(table) for table in rows.values() if len(table) > 1]
    if len(columns) < LEAST_CASES:
        return None
    scale = np.abs(np.concatenate(columns)).max(axis=0, initial=1e-300)
    deviations = [table / scale - (table / scale).mean(axis=0) for table in columns]
    without_noise = [table * (np.abs(table) > 1e-12) for table in deviations]  # of round-off
    products = np.array([table.T @ table for table in without_noise])
    total = products.sum(axis=0, keepdims=True)
    return np.concatenate([total, total - products])


def _correlations(covariances: Array, first: int, second: int) -> Array:
    """Return the correlation of two columns in each of many covariances (k, c, c); nan where one does not vary."""
    size = covariances[:, first, first] * covariances[:, second, second]
    return np.where(size > 0.0, covariances[:, first, second], np.nan) / np.sqrt(np.where(size > 0.0, size, 1.0))


def _finite_or_none(*numbers: Array) -> list[float | None]:
    """Return numbers, None for each that is not finite."""
    return [float(number) if math.isfinite(number) else None for number in numbers]


def _leave_surface_out_error(trials: Sequence[RivalTrial], name: str) -> float | None:
    """Return the error of predicted scores of each surface, by levels and one slope fitted to the other surfaces."""
    subjects, members = np.unique([trial.subject for trial in trials], return_inverse=True)
    surfaces = np.array([trial.index for trial in trials])
    x, y = np.array([trial.values[name] for trial in trials]), np.array([trial.score for trial in trials])
    errors: list[float] = []
    for surface in np.unique(surfaces):
        training = surfaces != surface
        count = np.bincount(members[training], minlength=len(subjects))
        sums = (np.bincount(members[training], variable[training], len(subjects)) for variable in (x, y))
        level_x, level_y = (total / np.maximum(count, 1) for total in sums)
        off_x, off_y = x - level_x[members], y - level_y[members]
        size = float(off_x[training] @ off_x[training])
        if size <= 1e-24 * float(np.max(x[training] ** 2, initial=1e-300)):
            return None
        slope = float(off_x[training] @ off_y[training]) / size
        errors += (off_y - slope * off_x)[~training & (count[members] > 0)].tolist()
    return math.sqrt(float(np.mean(np.square(errors)))) if errors else None


def _akaike(name: str, trials: Sequence[RivalTrial]) -> float | str:
    """Return Akaike's criterion of the mixed model on a quantity, or why it has no comparable one."""
    lack = sum(name not in trial.values for trial in trials)
    if lack:
        return f"{lack} of {len(trials)} trials have no such number, and AIC compares models of the same scores"
    subjects, surfaces = [trial.subject for trial in trials], [trial.index for trial in trials]
    if len(set(subjects)) < 2 or len(set(surfaces)) < 3 or len(trials) < 7:
        return "it takes two subjects, three surfaces and seven trials"
    x, y = [trial.values[name] for trial in trials], [trial.score for trial in trials]
    conditions = [f"{trial.index} {trial.block}" for trial in trials]
    criterion = crossed_aic(subjects, surfaces, conditions, y, x)
    return "it does not vary, or no residuals remain to estimate an error" if criterion is None else criterion


def _because(rival: Rival, **reasons: str | None) -> Rival:
    """Return the rival with reasons for missing numbers, by the name of the field."""
    return replace(rival, reasons=rival.reasons | {name: text for name, text in reasons.items() if text is not None})
