"""From the friction of a session's strokes to what the model predicts: the only door to the solver.

Each trial becomes a scene: its measured friction, its block's indentation, its direction and speed, and one finger.
"""

from sessions.prediction.options import BY_NAME, PredictionOptions, finger_in, shown_unit, tau_scale, with_own_finger
from sessions.prediction.predicting import Way, predict
from sessions.prediction.scenes import DEFAULT_SPEED, SLIDES, scene_along, scenes_of, with_loads
from sessions.prediction.solving import (
    Progress,
    derivatives_by,
    doubt_of,
    part_of,
    seds_at,
    settled,
    slides,
    solved,
    traction_reached,
)
from sessions.prediction.stored import SessionPrediction, TrialPrediction
from solver import Friction, Prediction, Scene
from solver.prediction import Response
from solver.quantities import QUANTITIES, SED, Quantity
from solver.response.nearby import Nearby

__all__ = [
    "BY_NAME",
    "DEFAULT_SPEED",
    "QUANTITIES",
    "SED",
    "SLIDES",
    "Friction",
    "Nearby",
    "Prediction",
    "PredictionOptions",
    "Progress",
    "Quantity",
    "Response",
    "Scene",
    "SessionPrediction",
    "TrialPrediction",
    "Way",
    "derivatives_by",
    "doubt_of",
    "finger_in",
    "part_of",
    "predict",
    "scene_along",
    "scenes_of",
    "seds_at",
    "settled",
    "shown_unit",
    "slides",
    "solved",
    "tau_scale",
    "traction_reached",
    "with_loads",
    "with_own_finger",
]
