"""A decision before it is recorded: what stands in its place now, and what it would do."""

from dataclasses import replace

from sessions.recording import Recording
from sessions.strokes.analysis import Analysis, analyse
from sessions.strokes.decisions import Decision, DecisionError, Decisions, Value
from sessions.strokes.flaws import FlawName
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.stroke import Stroke


def with_present(analysis: Analysis, decision: Decision) -> Decision:
    """Return a decision with what stands in its place now. Raises DecisionError where there is no such stroke."""
    if decision.undoes is not None:
        return decision
    if decision.what == "tilt":
        return replace(decision, old=analysis.settings.tilt)
    strokes = [stroke for stroke in analysis.strokes if stroke.trial == decision.trial]
    if decision.stroke is None:
        position = next((one.stroke for one in analysis.friction if one.trial == decision.trial), None)
        return replace(decision, old=None if position is None else analysis.strokes[position].number)
    for stroke in strokes:
        if stroke.number == decision.stroke:
            return replace(decision, old=_stands(stroke, decision.what))
    there = f"it has {len(strokes)}" if strokes else "none was found in it"
    raise DecisionError(f"there is no {decision.of}: {there}")


def preview(recording: Recording, decision: Decision, before: Decisions, now: Analysis) -> Analysis:
    """Return the analysis as it would be with a decision more; `now` is that without it.

    Raises DecisionError where the decision cannot be, or would change nothing.
    """
    after = analyse(
        recording,
        AnalysisSettings(area=now.settings.area, gain_error=now.settings.gain_error),
        before.with_line(decision),
    )
    before_sentences = {flaw.sentence for flaw in now.flaws}
    for flaw in after.flaws:
        if flaw.name is FlawName.DECISION and flaw.sentence not in before_sentences and decision.undoes is None:
            raise DecisionError(flaw.sentence)
    return after


def _stands(stroke: Stroke, what: str) -> Value:
    if what == "stick":
        return None if stroke.onset is None or stroke.break_away is None else (stroke.onset, stroke.break_away)
    return getattr(stroke, what)
