"""The same trials predicted side by side: both readings of tau_max, both kinds of strain, by depth and by force.

Each way is solved for all trials together on a mesh of its own, so that the surfaces' differences within a way are
accurate; between ways they are as good as each one's error estimate.
"""

from dataclasses import replace

from sessions.alternative import Alternative, Way, ways
from sessions.prediction import Prediction, Progress, SessionPrediction, TrialPrediction, scene_along, solved


def with_alternatives(prediction: SessionPrediction, progress: Progress | None = None) -> SessionPrediction:
    """Return a prediction with every trial predicted along the ways that its options ask for (`beside`) as well.

    Raises Cancelled where `progress`, told the part done, returns False.
    """
    asked = tuple(ways(prediction.options.beside))
    along = [
        _along(prediction, way, _part(progress, number / len(asked), (number + 1) / len(asked)))
        for number, way in enumerate(asked)
    ]
    trials = tuple(
        replace(row, alternatives=tuple(found[number] for found in along))
        for number, row in enumerate(prediction.trials)
    )
    return replace(prediction, trials=trials)


def _along(prediction: SessionPrediction, way: Way, progress: Progress | None) -> tuple[Alternative, ...]:
    """Return what each trial gives along one way."""
    usual = (prediction.options.kinematics, prediction.options.tau_reading)
    if (way.kinematics, way.tau_reading, way.driven) == (*usual, "depth"):
        return tuple(_as_predicted(row, way) for row in prediction.trials)
    scenes = [scene_along(row, way, prediction.options) for row in prediction.trials]
    answers = iter(solved([scene for scene in scenes if not isinstance(scene, str)], progress))
    return tuple(
        _none(row, way, scene)
        if isinstance(scene, str)
        else _alternative(row, way, scene.friction.tau_max, next(answers))
        for row, scene in zip(prediction.trials, scenes, strict=True)
    )


def _as_predicted(row: TrialPrediction, way: Way) -> Alternative:
    if row.prediction is None:
        return _none(row, way, row.reasons.get("sed", ""))
    return _alternative(row, way, row.tau_max, row.prediction)


def _alternative(row: TrialPrediction, way: Way, tau_max: float | None, found: Prediction | str) -> Alternative:
    if isinstance(found, str):
        return replace(_none(row, way, found), tau_max=tau_max)
    width = found.scene.width
    return Alternative(
        way,
        tau_max,
        found.indentation,
        found.sed_ending,
        found.error_estimate,
        found.normal_force * width,
        found.tangential_force * width,
    )


def _none(row: TrialPrediction, way: Way, reason: str) -> Alternative:
    depth = None if way.driven == "force" else row.indentation
    return Alternative(way, None, depth, None, None, None, None, reason)


def _part(progress: Progress | None, low: float, high: float) -> Progress | None:
    return None if progress is None else lambda done: progress(low + (high - low) * done)
