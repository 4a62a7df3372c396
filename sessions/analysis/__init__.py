"""From readings to strokes, their friction, and what is wrong with them."""

from sessions.analysis.analysis import ZERO_SETTING, ZERO_STATED, Analysis, analyse
from sessions.analysis.flaws import Flaw, FlawName
from sessions.analysis.friction import FrictionParameters
from sessions.analysis.settings import AnalysisSettings
from sessions.analysis.stroke import Stroke, StrokeCurve

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
