"""Tables and cells as all tables of a study's page have them."""

from collections.abc import Iterable

from sessions.report.predictions import model_in_short as model_of
from sessions.report.tables.cells import Cell, Column, Group, Notes, Table
from sessions.report.wording import NONE, correlation, digits, significant
from sessions.statistics.pooling.findings import StudyFindings


def study_table(
    name: str,
    caption: str,
    columns: Iterable[str | Column],
    groups: Iterable[tuple[str, tuple[tuple[Cell, ...], ...]]],
    notes: Notes | None = None,
) -> Table:
    """Return a table of groups (heading, rows), empty ones left out."""
    kept = tuple(Group(head, rows) for head, rows in groups if rows)
    heads = tuple(column if isinstance(column, Column) else Column(column) for column in columns)
    return Table(name, caption, heads, kept, () if notes is None else notes.listed())


def interval(low: float | None, high: float | None, decimals: int) -> Cell:
    """Return the cell of an interval, a dash where there is none."""
    return Cell(NONE if low is None or high is None else f"{digits(low, decimals)} to {digits(high, decimals)}")


def correlations(low: float | None, high: float | None) -> Cell:
    """Return the cell of a correlation's interval, a dash where there is none."""
    return Cell(NONE if low is None or high is None else f"{correlation(low)} to {correlation(high)}")


def between(low: float, high: float) -> str:
    """Return an interval with three significant figures.

    >>> between(0.0321, 1.5)
    '0.0321 to 1.50'
    """
    return f"{significant(low, 3)} to {significant(high, 3)}"


def p_value(p: float) -> str:
    """Return a p value as people write it.

    >>> p_value(0.0321), p_value(1e-9)
    ('0.032', '< 0.001')
    """
    return "< 0.001" if p < 0.001 else digits(p, 3)


def model_in_short(study: StudyFindings) -> str:
    """Return which solver model the SEDs are of."""
    return model_of(study.options.prediction, study.options.area)
