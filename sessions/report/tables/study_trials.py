"""The table of every trial of a study: each number with its source, and why one is missing."""

from collections.abc import Callable, Iterable

from sessions.prediction.sed_interval import Ends
from sessions.report.predictions import model_in_short
from sessions.report.tables.cells import Cell, Group, Notes, Row, Table, table
from sessions.report.wording import places, sed, significant, tau
from sessions.statistics.pooling.exclusions import decided
from sessions.statistics.pooling.findings import StudyFindings
from sessions.statistics.pooling.visit import TrialRow, Visit

_FEW = "too few readings"
MOST = 400  # rows on the page; of a larger study they are in the table beside it, and in the page as a file


def trials_table(study: StudyFindings) -> Table | None:
    """Return every trial with what was scored, measured and predicted; None where they are too many for a page."""
    if sum(len(visit.rows) for visit in study.visits) > MOST:
        return None
    notes = Notes()
    columns = (
        "trial | index | score [0–100] | µ [1] | τ max [kPa] | N [N] | speed [mm/s] | SED [kPa] | "
        "estimated error [%] | flaws"
    )
    groups = tuple(
        Group(
            f"{visit.session}, {descriptor}{_left_out(study, visit, descriptor)}",
            tuple(_rows(visit, descriptor, notes)),
        )
        for visit in study.visits
        for descriptor in dict.fromkeys(row.descriptor for row in visit.rows)
    )
    known = dict.fromkeys(visit.calibration for visit in study.visits if visit.calibration)
    calibrations = f" (calibration: {'; '.join(known)})" if known else ""
    model = model_in_short(study.options.prediction, study.options.area)
    caption = (
        "Every trial, from which all numbers above come. µ: what the model got; τ max, normal force N and speed of the "
        f"stroke, each over its 95 % interval by block bootstrap{calibrations}. SED: at "
        f"{model}, over what the uncertainty of friction makes of it; error: that estimated from its "
        "mesh. A dash says why. Means, correlations and models above take each number as it "
        "stands: their own intervals come from how subjects and trials differ, which holds these errors too."
    )
    return table("table-trials", caption, columns, groups, notes)


def _left_out(study: StudyFindings, visit: Visit, descriptor: str) -> str:
    if visit.session in dict(study.copies):
        return " (a copy: counts nothing)"
    return "" if decided(study.excluded, visit.subject, descriptor) is None else " (left out of every number above)"


def _rows(visit: Visit, descriptor: str, notes: Notes) -> Iterable[Row]:
    for row in visit.rows:
        if row.descriptor == descriptor:
            yield _row(row, notes)


def _row(row: TrialRow, notes: Notes) -> Row:
    answer = row.score if row.score is not None else row.estimate
    why = row.why or "withheld: the flaws say why"

    def ends(low: float | None, high: float | None) -> Ends | None:
        return None if low is None or high is None else (low, high)

    def estimate(name: str, shown: Callable[[float], str], unit: float = 1.0, without: str = _FEW) -> Cell:
        interval = ends(getattr(row, f"{name}_low"), getattr(row, f"{name}_high"))
        return notes.estimate(getattr(row, name), shown, why, interval, without, unit=unit)

    return (
        Cell(str(row.trial)),
        Cell(str(row.index)),
        notes.number(answer, places(1), f"no score: {row.outcome}"),
        estimate("mu", places(3)),
        estimate("tau_max", tau, 1e3),
        estimate("normal_force", places(2)),
        estimate("speed", places(1)),
        estimate("sed", sed, 1e3, row.sed_interval),
        notes.number(row.error_estimate, lambda v: significant(100 * v, 2), why),
        Cell(", ".join(flaw.replace("_", " ") for flaw in row.flaws) or "none"),
    )
