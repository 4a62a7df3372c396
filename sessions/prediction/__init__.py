"""From the friction of a session's strokes to the model's predictions: the only access to the solver.

Each trial becomes a scene: its measured friction, its block's indentation, its direction and speed, and one finger.
"""

from sessions.prediction.options import BY_NAME, Kinematics, PredictionOptions, finger_in, with_own_finger
from sessions.prediction.scenes import Progress, part_of, predict
from sessions.prediction.stored import SessionPrediction, TrialPrediction
from solver import Friction, Prediction, Scene
from solver.prediction import History, Response, Skin
from solver.quantities import QUANTITIES, SED, Quantity
from solver.response.fields import Fields
from solver.response.nearby import Nearby

__all__ = [
    "BY_NAME",
    "QUANTITIES",
    "SED",
    "Fields",
    "Friction",
    "History",
    "Kinematics",
    "Nearby",
    "Prediction",
    "PredictionOptions",
    "Progress",
    "Quantity",
    "Response",
    "Scene",
    "SessionPrediction",
    "Skin",
    "TrialPrediction",
    "finger_in",
    "part_of",
    "predict",
    "with_own_finger",
]
