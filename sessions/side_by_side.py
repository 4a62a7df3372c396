"""The same trials predicted side by side: both readings of tau_max, both kinds of strain, by depth and by force.

Each variant is solved for all trials together on a mesh of its own, so that the surfaces' differences within one are
accurate; between two they are as good as each one's error estimate.
"""

from dataclasses import replace

from sessions.alternative import Alternative, Variant, variants
from sessions.prediction import (
    Prediction,
    Progress,
    SessionPrediction,
    TrialPrediction,
    scene_along,
    solved,
    traction_reached,
)


def with_alternatives(prediction: SessionPrediction, progress: Progress | None = None) -> SessionPrediction:
    """Return a prediction with every trial predicted in the variants that its options ask for (`beside`) as well.

    Raises Cancelled where `progress`, told the part done, returns False.
    """
    asked = tuple(variants(prediction.options.beside))
    along = [
        _along(prediction, variant, _part(progress, number / len(asked), (number + 1) / len(asked)))
        for number, variant in enumerate(asked)
    ]
    trials = tuple(
        replace(row, alternatives=tuple(found[number] for found in along))
        for number, row in enumerate(prediction.trials)
    )
    return replace(prediction, trials=trials)


def _along(prediction: SessionPrediction, variant: Variant, progress: Progress | None) -> tuple[Alternative, ...]:
    """Return what each trial gives in one variant."""
    usual = (prediction.options.kinematics, prediction.options.tau_reading)
    if (variant.kinematics, variant.tau_reading, variant.driven) == (*usual, "depth"):
        return tuple(_as_predicted(row, variant) for row in prediction.trials)
    scenes = [scene_along(row, variant, prediction.options) for row in prediction.trials]
    answers = iter(solved([scene for scene in scenes if not isinstance(scene, str)], progress))
    return tuple(
        _none(row, variant, scene)
        if isinstance(scene, str)
        else _alternative(row, variant, scene.friction.tau_max, next(answers))
        for row, scene in zip(prediction.trials, scenes, strict=True)
    )


def _as_predicted(row: TrialPrediction, variant: Variant) -> Alternative:
    if row.prediction is None:
        return _none(row, variant, row.reasons.get("sed", ""))
    return _alternative(row, variant, row.tau_max, row.prediction)


def _alternative(row: TrialPrediction, variant: Variant, tau_max: float | None, found: Prediction | str) -> Alternative:
    if isinstance(found, str):
        return replace(_none(row, variant, found), tau_max=tau_max)
    width = found.scene.width
    return Alternative(
        variant,
        tau_max,
        found.indentation,
        found.sed_ending,
        found.error_estimate,
        found.normal_force * width,
        found.tangential_force * width,
        traction=traction_reached(found),
    )


def _none(row: TrialPrediction, variant: Variant, reason: str) -> Alternative:
    depth = None if variant.driven == "force" else row.indentation
    return Alternative(variant, None, depth, None, None, None, None, reason)


def _part(progress: Progress | None, low: float, high: float) -> Progress | None:
    return None if progress is None else lambda done: progress(low + (high - low) * done)
