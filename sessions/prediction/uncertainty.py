"""Uncertainty of a prediction from that of its friction, and its values in other variants of the model.

The draws of the friction's bootstrap go through the solver. Derivatives from its converged tangent carry all of them. A
few solved draws show whether that suffices: those at both ends of the interval, and those at both ends of every
principal direction of the draws, since mu and tau_max are correlated. Where it does not suffice, the solver is run at
draws themselves. Each interval states its method. A trial driven by the measured force also includes the uncertainty of
that force.

Each variant is solved for all trials together on its own mesh, so differences between surfaces within a variant are
accurate; between variants each one's error estimate applies.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivers.arrays import Array, Indices
from sessions.prediction.options import PredictionOptions, tau_scale
from sessions.prediction.scenes import (
    Progress,
    derivatives_by,
    doubt_of,
    part_of,
    predict_scenes,
    scene_along,
    slides,
    with_loads,
)
from sessions.prediction.stored import (
    Alternative,
    Ends,
    SedInterval,
    SessionPrediction,
    TrialPrediction,
    Variant,
    known_error,
    settled_numbers,
    variants,
)
from sessions.strokes.bootstrap import FrictionDraws, friction_draws
from solver import Prediction, Scene
from solver.response.nearby import Nearby

DrawsOrReason = FrictionDraws | str  # draws of a trial's friction, or why there are none

_SAMPLES = 60  # draws to solve where derivatives do not suffice
MISS = 0.05  # largest miss of a solved draw by derivatives, relative to the interval's width [-]
_FLAT = 1e-5  # a miss below this share of the SED is negligible [-]
_QUANTILES = (0.025, 0.975)


def with_intervals(
    prediction: SessionPrediction, progress: Progress | None = None, *, both_ways: bool = True
) -> SessionPrediction:
    """Return a prediction with an interval of each of its SEDs, where its options request them.

    Each trial has one, and with `both_ways` also its opposite slide. Raises Cancelled where `progress` returns False.
    """
    if not prediction.options.intervals:
        return prediction
    rows = prediction.trials
    answers: list[Prediction | str] = [row.prediction or _reason(row, "sed") for row in rows]
    if both_ways:
        answers += [row.opposite or _reason(row, "opposite_sed") for row in rows]
    draws = (draws_of(prediction) * 2)[: len(answers)]
    intervals = iter(intervals_of(answers, draws, tau_scale(prediction.options), progress))
    with_own = [replace(row, interval=next(intervals)) for row in rows]
    trials = tuple(replace(row, opposite_interval=next(intervals, None)) for row in with_own)
    return replace(prediction, trials=trials)


def draws_of(prediction: SessionPrediction) -> list[DrawsOrReason]:
    """Return the draws of each trial's friction, one for each repeat, or why there are none."""
    draws: list[DrawsOrReason] = []
    strokes, bootstrap = prediction.analysis.strokes, prediction.analysis.bootstrap
    for row in prediction.trials:
        if row.stroke is None or row.mu is None or row.tau_max is None:
            draws.append(_reason(row, "sed"))
            continue
        friction = friction_draws(strokes[row.stroke], row.stroke, row.mu_rule, bootstrap)
        draws.append(friction or "the stroke is too short for an interval of its friction")
    return draws


def _reason(row: TrialPrediction, name: str) -> str:
    return row.reasons.get(name, "nothing was predicted")


def intervals_of(
    column: Sequence[Prediction | str], draws: Sequence[DrawsOrReason], scale: float, progress: Progress | None = None
) -> list[SedInterval]:
    """Return the interval of each settled SED of a column; a reason in the column becomes the interval's.

    `scale` is the factor of drawn tau_max for the model. Raises Cancelled.
    """
    taken_up = slides([answer for answer in column if not isinstance(answer, str)], progress)
    results = (
        answer if isinstance(answer, str) else _interval(answer, next(taken_up), friction, scale)
        for answer, friction in zip(column, draws, strict=True)
    )
    return [SedInterval(None, None, None, reason=each) if isinstance(each, str) else each for each in results]


def _interval(prediction: Prediction, slide: Nearby | None, friction: DrawsOrReason, scale: float) -> SedInterval | str:
    """Return the interval of a settled SED, or the reason for its absence."""
    if slide is None:
        return "the state found depends on the way to it"
    loads = _loads(prediction.scene, friction, scale)
    if isinstance(loads, str):
        return loads
    names, draws, means = loads
    derivatives, width = derivatives_by(slide, prediction.scene), prediction.scene.finger.width

    def carry(number: str, value: float) -> Array:
        return value + (draws - means) @ [derivatives[number][name] for name in names]

    linear = carry("sed", prediction.sed_ending)
    low, high = _bounds(linear)
    sed = derivatives["sed"]
    slopes = sed["mu"], sed["tau_max"], sed["force"] if "force" in names else None
    interval = SedInterval(
        low,
        high,
        "derivatives",
        *slopes,
        normal_force=_bounds(carry("normal_force", prediction.normal_force * width)),
        tangential_force=_bounds(carry("tangential_force", prediction.tangential_force * width)),
        indentation=_bounds(carry("indentation", prediction.indentation)),
    )

    def solve_draws(positions: Indices) -> Array:
        loads = (dict(zip(names, draw, strict=True)) for draw in draws[positions].tolist())
        seds = slide.seds([prediction.scene, *(with_loads(prediction.scene, draw) for draw in loads)])[:, 0]
        return prediction.sed_ending + (seds[1:] - seds[0])

    extremes = _extremes(linear, draws)
    errors = np.abs(solve_draws(extremes) - linear[extremes])  # nan, hence no pass, where one has no settled state
    if bool((errors <= max(MISS * (high - low), _FLAT * prediction.sed_ending)).all()):
        return interval
    # Each represents an equal share of all draws, by the middle one in the order of the linear estimate.
    middles = ((np.arange(_SAMPLES) + 0.5) / _SAMPLES * len(linear)).astype(np.int64)
    seds = solve_draws(np.argsort(linear, kind="stable")[middles])
    failed = int(np.isnan(seds).sum())
    if failed:
        reason = (
            f"{failed} of {_SAMPLES} draws of the friction have no settled state, or lie too near the limit to tell"
        )
        return replace(interval, low=None, high=None, method="sampling", reason=reason)
    low, high = np.quantile(seds, _QUANTILES, method="hazen").tolist()  # each represents the middle of its share
    return replace(interval, low=low, high=high, method="sampling")


def _bounds(draws: Array) -> Ends:
    low, high = np.quantile(draws, _QUANTILES).tolist()
    return low, high


def _loads(scene: Scene, friction: DrawsOrReason, scale: float) -> tuple[tuple[str, ...], Array, Array] | str:
    """Return the names of the drawn loads (p,), the draws (repeats, p) and the scene's values (p,)."""
    if isinstance(friction, str):
        return friction
    names, columns = ["mu", "tau_max"], [np.maximum(friction.mu, 0.0), friction.tau_max * scale]
    means = [scene.friction.mu, scene.friction.tau_max or 0.0]
    if scene.loading.normal_force is not None:
        if friction.normal_force is None:
            return "the stroke is too short for an interval of its normal force"
        names.append("force")
        columns.append(friction.normal_force)
        means.append(scene.loading.normal_force)
    return tuple(names), np.stack(columns, axis=1), np.array(means)


def _extremes(linear: Array, draws: Array) -> Indices:
    """Return the draws at both ends of the linear interval, and of each principal direction of draws (repeats, p).

    The directions are the principal components of the draws, each load scaled by its spread: for correlated loads these
    are corners within reach of the draws.

    >>> _extremes(np.arange(5.0), np.array([[0.0, 0.0], [1.0, 1.1], [2.0, 1.9], [3.0, 3.0], [4.0, 4.2]])).tolist()
    [0, 2, 4]
    """
    spread = draws.std(axis=0)
    units = (draws - draws.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)
    axes = np.linalg.svd(units, full_matrices=False)[2]
    ranks = [round(quantile * (len(draws) - 1)) for quantile in _QUANTILES]
    return np.unique([np.argsort(values, kind="stable")[ranks] for values in (linear, *(units @ axes.T).T)])


def with_alternatives(prediction: SessionPrediction, progress: Progress | None = None) -> SessionPrediction:
    """Return a prediction with every trial also predicted in the variants of its options (`variants`).

    With `intervals` in the options, each variant at small strain has its own interval, and with `variant_intervals`
    each at finite strain. Raises Cancelled where `progress`, called with the part done, returns False.
    """
    all_variants, options = tuple(variants(prediction.options.variants)), prediction.options
    draws = draws_of(prediction) if all_variants and options.intervals else None
    count = len(all_variants)
    columns: list[tuple[Alternative, ...]] = []
    for n, variant in enumerate(all_variants):
        variant_draws = draws if variant.kinematics == "small" or options.variant_intervals else None
        columns.append(_alternatives(prediction, variant, variant_draws, part_of(progress, n / count, (n + 1) / count)))
    trials = tuple(
        _with_depth(replace(row, alternatives=tuple(answers[number] for answers in columns)), options)
        for number, row in enumerate(prediction.trials)
    )
    return replace(prediction, trials=trials)


def _with_depth(row: TrialPrediction, options: PredictionOptions) -> TrialPrediction:
    """Return a row with the matching depth of its own solve under the measured force, where there is one.

    The depth of `predict` is from a coarse mesh; the report gives one value only.
    """
    driven = Variant(options.kinematics, options.tau_reading, "force")
    by_force = (alternative for alternative in row.alternatives if alternative.variant == driven)
    driven_row = next((alternative for alternative in by_force if alternative.sed is not None), None)
    if driven_row is None:
        return row
    reasons = {name: reason for name, reason in row.reasons.items() if name != "matching_depth"}
    return replace(
        row,
        matching_depth=driven_row.indentation,
        matching_depth_error=driven_row.indentation_error,
        matching_depth_interval=None if driven_row.interval is None else driven_row.interval.indentation,
        reasons=reasons,
    )


def _alternatives(
    prediction: SessionPrediction, variant: Variant, draws: Sequence[DrawsOrReason] | None, progress: Progress | None
) -> tuple[Alternative, ...]:
    """Return each trial's result in one variant, with intervals where draws of its friction are given."""
    rows, options = prediction.trials, prediction.options
    trial_answers = _present_answers(prediction, variant)
    answers = trial_answers or _solve_variant(prediction, variant, part_of(progress, 0.0, 0.8))
    alternatives = [_alternative(row, variant, *answer) for row, answer in zip(rows, answers, strict=True)]
    if draws is not None:
        present = [row.interval if variant.driven == "depth" else row.opposite_interval for row in rows]
        if trial_answers is not None and None not in present:  # already the intervals of the trials themselves
            intervals: Sequence[SedInterval | None] = present
        else:
            scale = tau_scale(replace(options, tau_reading=variant.tau_reading))
            intervals = intervals_of([answer for _, answer in answers], draws, scale, part_of(progress, 0.8, 1.0))
        pairs = zip(alternatives, intervals, strict=True)
        alternatives = [replace(alternative, interval=interval) for alternative, interval in pairs]
    return tuple(alternatives)


# For each trial the tau_max [MPa] of the model, and its result
_Answers = list[tuple[float | None, Prediction | str]]


def _present_answers(prediction: SessionPrediction, variant: Variant) -> _Answers | None:
    """Return answers already in the prediction: at the planned depth, for either slide; else None."""
    options = prediction.options
    agrees = (variant.kinematics, variant.tau_reading) == (options.kinematics, options.tau_reading)
    if agrees and variant.driven == "depth":
        return [(row.tau_max, row.prediction or row.reasons.get("sed", "")) for row in prediction.trials]
    if agrees and variant.driven == "other way":
        return [(row.tau_max, row.opposite or row.reasons.get("opposite_sed", "")) for row in prediction.trials]
    return None


def _solve_variant(prediction: SessionPrediction, variant: Variant, progress: Progress | None) -> _Answers:
    scenes = [scene_along(row, variant, prediction.options) for row in prediction.trials]
    answers = iter(predict_scenes([scene for scene in scenes if not isinstance(scene, str)], progress))
    return [
        (None, scene) if isinstance(scene, str) else (scene.friction.tau_max, _without_doubt(next(answers)))
        for scene in scenes
    ]


def _without_doubt(answer: Prediction | str) -> Prediction | str:
    """Return the answer of a variant, or why no finger can be in it: at the planned depth alone such numbers stay."""
    return answer if isinstance(answer, str) else doubt_of(answer) or answer


def _alternative(
    row: TrialPrediction, variant: Variant, tau_max: float | None, answer: Prediction | str
) -> Alternative:
    if isinstance(answer, str):
        depth = None if variant.driven == "force" else row.indentation
        return Alternative(variant, tau_max, depth, None, None, None, None, answer)
    return Alternative(
        variant,
        tau_max,
        answer.indentation,
        **settled_numbers(answer),
        traction=float(abs(answer.skin.traction).max()),  # any greater tau_max has the same solution
        indentation_error=known_error(answer, answer.indentation_error),
        doubt=doubt_of(answer),
    )
