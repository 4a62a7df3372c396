"""What the trials of a study answer otherwise than on a line: choices between two, and magnitude estimates."""

from collections.abc import Sequence

from sessions.statistics.pooling.visit import TrialRow, Visit
from sessions.statistics.scales.paired import Choice
from sessions.statistics.scales.stevens import Exponent, stevens_exponent


def choices(trials: Sequence[tuple[Visit, TrialRow]]) -> list[Choice]:
    """Return every choice between the surface of a trial and the one stroked just before it."""
    return [
        Choice(visit.subject, row.before, row.index, row.choice == "first")
        for visit, row in trials
        if row.choice is not None and row.before is not None
    ]


def exponent(trials: Sequence[tuple[Visit, TrialRow]]) -> Exponent | None:
    """Return Stevens' exponent of magnitude estimates by the µ of the same strokes; None where nobody gave any."""
    if all(row.estimate is None for _, row in trials):
        return None
    held = [
        (visit.subject, row.index, row.estimate, row.mu)
        for visit, row in trials
        if row.estimate is not None and row.estimate > 0.0 and row.mu is not None and row.mu > 0.0
    ]
    if not held:
        return Exponent(0, 0, None, reason="no trial has both an estimate above 0 and a µ of its own stroke")
    subjects, surfaces, answers, mu = zip(*held, strict=True)
    return stevens_exponent(subjects, surfaces, answers, mu)
