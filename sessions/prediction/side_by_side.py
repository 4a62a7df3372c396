"""The same trials predicted side by side: both readings of tau_max, both kinds of strain, by depth and by force.

Each variant is solved for all trials together on a mesh of its own, so that the surfaces' differences within one are
accurate; between two they are as good as each one's error estimate.
"""

from collections.abc import Sequence
from dataclasses import replace

from sessions.prediction.options import PredictionOptions, tau_scale
from sessions.prediction.scenes import scene_along
from sessions.prediction.solving import Progress, doubt_of, part_of, solved, traction_reached
from sessions.prediction.stored import (
    Alternative,
    SedInterval,
    SessionPrediction,
    TrialPrediction,
    Variant,
    known_error,
    variants,
)
from sessions.prediction.uncertainty import Drawn, draws_of, intervals_of
from sessions.strokes import Analysis
from solver import Prediction


def with_alternatives(
    prediction: SessionPrediction, progress: Progress | None = None, analysis: Analysis | None = None
) -> SessionPrediction:
    """Return a prediction with every trial predicted in the variants that its options ask for (`variants`) as well.

    Where the options ask for `intervals`, each at small strain has its own, and each at finite strain where they ask
    for `variant_intervals`; `analysis` is what the friction came from.
    Raises Cancelled where `progress`, called with the part done, returns False.
    """
    kinds, options = tuple(variants(prediction.options.variants)), prediction.options
    drawn = draws_of(analysis, prediction) if kinds and analysis is not None and options.intervals else None

    def drawn_of(variant: Variant) -> Sequence[Drawn] | None:
        return drawn if variant.kinematics == "small" or options.variant_intervals else None

    count = len(kinds)
    along = [
        _along(prediction, variant, drawn_of(variant), part_of(progress, n / count, (n + 1) / count))
        for n, variant in enumerate(kinds)
    ]
    trials = tuple(
        _with_depth(replace(row, alternatives=tuple(one[number] for one in along)), options)
        for number, row in enumerate(prediction.trials)
    )
    return replace(prediction, trials=trials)


def _with_depth(row: TrialPrediction, options: PredictionOptions) -> TrialPrediction:
    """Return a row whose matching depth is that of its own solve under the measured force, where there is one.

    The depth of `predict` is of a rough mesh; one question has one answer.
    """
    driven = Variant(options.kinematics, options.tau_reading, "force")
    driven_row = next((one for one in row.alternatives if one.variant == driven and one.sed is not None), None)
    if driven_row is None:
        return row
    reasons = {name: why for name, why in row.reasons.items() if name != "matching_depth"}
    return replace(
        row,
        matching_depth=driven_row.indentation,
        matching_depth_error=driven_row.indentation_error,
        matching_depth_interval=None if driven_row.interval is None else driven_row.interval.indentation,
        reasons=reasons,
    )


def _along(
    prediction: SessionPrediction, variant: Variant, drawn: Sequence[Drawn] | None, progress: Progress | None
) -> tuple[Alternative, ...]:
    """Return what each trial gives in one variant, with intervals where draws of its friction are given."""
    rows, options = prediction.trials, prediction.options
    known = _known(prediction, variant)
    answers = known or _solved(prediction, variant, part_of(progress, 0.0, 0.8))
    out = [_alternative(row, variant, tau_max, one) for row, (tau_max, one) in zip(rows, answers, strict=True)]
    if drawn is not None:
        before = [row.interval if variant.driven == "depth" else row.opposite_interval for row in rows]
        if known is not None and None not in before:  # they are those of the trials themselves
            intervals: Sequence[SedInterval | None] = before
        else:
            scale = tau_scale(replace(options, tau_reading=variant.tau_reading))
            intervals = intervals_of([one for _, one in answers], drawn, scale, part_of(progress, 0.8, 1.0))
        out = [replace(one, interval=interval) for one, interval in zip(out, intervals, strict=True)]
    return tuple(out)


_Answers = list[
    tuple[float | None, Prediction | str]
]  # for each trial the tau_max [MPa] that the model got, and what of it


def _known(prediction: SessionPrediction, variant: Variant) -> _Answers | None:
    """Return what was predicted anyway: at the planned depth, slid either way."""
    options = prediction.options
    if (variant.kinematics, variant.tau_reading) != (options.kinematics, options.tau_reading):
        return None
    if variant.driven == "depth":
        return [(row.tau_max, row.prediction or row.reasons.get("sed", "")) for row in prediction.trials]
    if variant.driven == "other way":
        return [(row.tau_max, row.opposite or row.reasons.get("opposite_sed", "")) for row in prediction.trials]
    return None


def _solved(prediction: SessionPrediction, variant: Variant, progress: Progress | None) -> _Answers:
    """Return the same of a variant that is solved now."""
    scenes = [scene_along(row, variant, prediction.options) for row in prediction.trials]
    answers = iter(solved([scene for scene in scenes if not isinstance(scene, str)], progress))
    return [(None, scene) if isinstance(scene, str) else (scene.friction.tau_max, next(answers)) for scene in scenes]


def _alternative(
    row: TrialPrediction, variant: Variant, tau_max: float | None, answer: Prediction | str
) -> Alternative:
    if isinstance(answer, str):
        return replace(_none(row, variant, answer), tau_max=tau_max)
    width = answer.scene.finger.width
    return Alternative(
        variant,
        tau_max,
        answer.indentation,
        answer.sed_ending,
        known_error(answer, answer.error_estimate),
        answer.normal_force * width,
        answer.tangential_force * width,
        traction=traction_reached(answer),
        normal_force_error=known_error(answer, answer.normal_force_error),
        tangential_force_error=known_error(answer, answer.tangential_force_error),
        indentation_error=known_error(answer, answer.indentation_error),
        doubt=doubt_of(answer),
    )


def _none(row: TrialPrediction, variant: Variant, reason: str) -> Alternative:
    depth = None if variant.driven == "force" else row.indentation
    return Alternative(variant, None, depth, None, None, None, None, reason)
