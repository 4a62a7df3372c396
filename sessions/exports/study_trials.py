"""The table of every trial of a study: each number with its source, and why one is missing."""

from collections.abc import Iterable

from sessions.exports.report_tables.cells import Cell, Column, Group, Notes, Table
from sessions.exports.wording import digits, places, sed, significant, tau
from sessions.pooling.pooled import StudyFindings
from sessions.pooling.visit import TrialRow, Visit

MOST = 400  # rows on the page; a larger study has them in its file alone


def trials_table(study: StudyFindings) -> Table | None:
    """Return every trial with what was scored, measured and predicted; None where they are too many for a page."""
    if sum(len(visit.rows) for visit in study.visits) > MOST:
        return None
    notes = Notes()
    columns = (
        Column("trial"),
        Column("index"),
        Column("score", "0–100"),
        Column("µ"),
        Column("95 % interval"),
        Column("τ max", "kPa"),
        Column("N", "N"),
        Column("speed", "mm/s"),
        Column("SED", "kPa"),
        Column("error", "%"),
        Column("flaws"),
    )
    groups = tuple(
        Group(f"{visit.session}, {descriptor}", tuple(_rows(visit, descriptor, notes)))
        for visit in study.visits
        for descriptor in dict.fromkeys(row.descriptor for row in visit.rows)
    )
    caption = (
        "Every trial, from which all numbers above come. µ: what the model got, with its bootstrap interval; τ max, "
        "normal force N and speed of the stroke; SED with the error estimated from its mesh. A dash says why."
    )
    return Table("table-trials", caption, columns, groups, notes.listed())


def _rows(visit: Visit, descriptor: str, notes: Notes) -> Iterable[tuple[Cell, ...]]:
    for row in visit.rows:
        if row.descriptor == descriptor:
            yield _row(row, notes)


def _row(row: TrialRow, notes: Notes) -> tuple[Cell, ...]:
    given = row.score if row.score is not None else row.estimate
    why = row.why or "withheld: the flaws say why"
    interval = None if row.mu_low is None or row.mu_high is None else (row.mu_low, row.mu_high)
    return (
        Cell(str(row.trial)),
        Cell(str(row.index)),
        notes.number(given, places(1), f"no score: {row.outcome}"),
        notes.number(row.mu, places(3), why),
        notes.number(None, str, why) if interval is None else Cell(" to ".join(digits(end, 3) for end in interval)),
        notes.number(row.tau_max, tau, why),
        notes.number(row.normal_force, places(2), why),
        notes.number(row.speed, places(1), why),
        notes.number(row.sed, sed, why),
        notes.number(row.error_estimate, lambda v: significant(100 * v, 2), why),
        Cell(", ".join(flaw.replace("_", " ") for flaw in row.flaws) or "none"),
    )
