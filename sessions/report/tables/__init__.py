"""The tables of a report: cells as text, and for every number that is missing the reason."""

from sessions.prediction import BY_NAME
from sessions.report.contents import Report
from sessions.report.tables.cells import Cell, Column, Group, Table, sections_of
from sessions.report.tables.predictions import (
    afferent_table,
    beside_forces_table,
    beside_table,
    direction_table,
    force_table,
    prediction_table,
)
from sessions.report.tables.rivals import responses_table, rivals_table
from sessions.report.tables.scales import compared_with_standard, psychometric_table
from sessions.report.tables.scores import answer_tables, paths_table, relation_table, score_table
from sessions.report.tables.strokes import course_table, planted_table, stroke_table

__all__ = ["Cell", "Column", "Group", "Table", "tables"]


def tables(report: Report) -> dict[str, tuple[Table, ...]]:
    """Return the tables a report has numbers for, by section, in their order."""
    compared = [(e.name, e.rivals) for e in report.experiments]
    quantity = BY_NAME[report.response].label
    sections = {
        "relation": (relation_table(report),),
        "strokes": (stroke_table(report), course_table(report)),
        "predictions": (
            prediction_table(report),
            force_table(report),
            direction_table(report),
            beside_table(report),
            beside_forces_table(report),
        ),
        "rivals": (rivals_table(compared, quantity, report.model), responses_table(compared, quantity, report.model)),
        "scores": (score_table(report), *answer_tables(report), psychometric_table(compared_with_standard(report))),
        "afferent": (afferent_table(report),),
        "paths": (paths_table((e.name, e.paths) for e in report.experiments),),
        "planted": (planted_table(report),),
    }
    return sections_of(sections)
