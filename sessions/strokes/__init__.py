"""From readings to strokes, their friction, and what is wrong with them."""

from sessions.strokes.analysis import ZERO_SETTING, ZERO_STATED, Analysis, analyse
from sessions.strokes.flaws import Flaw, FlawName
from sessions.strokes.friction import FrictionParameters
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.stroke import Stroke, StrokeCurve

__all__ = [
    "ZERO_SETTING",
    "ZERO_STATED",
    "Analysis",
    "AnalysisSettings",
    "Flaw",
    "FlawName",
    "FrictionParameters",
    "Stroke",
    "StrokeCurve",
    "analyse",
]
