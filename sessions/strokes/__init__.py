"""From readings to strokes, their friction and their flaws."""

from sessions.strokes.analysis import Analysis, analyse
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.stroke import Flaw, FlawName, FrictionParameters, Stroke, StrokeCurve
from sessions.strokes.trial_analysis import ZERO_SETTING, ZERO_STATED

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
