"""A report's tables as text for a terminal."""

from daq_app.console import table
from sessions.report.contents import Report
from sessions.report.tables import Table
from sessions.report.tables.session import tables


def table_texts(report: Report, *sections: str) -> list[str]:
    """Return the tables of some sections of a report as text."""
    by_section = tables(report)
    return [_as_text(section_table) for name in sections for section_table in by_section[name]]


def _as_text(report_table: Table) -> str:
    """Return a table with its caption, each number above its interval, and the notes of its marks."""
    header = [f"{one.name} [{one.unit}]" if one.unit.strip("1") else one.name for one in report_table.columns]
    rows: list[list[str]] = []
    headings: list[tuple[int, str]] = []  # before which row each group begins
    for group in report_table.groups:
        headings += [(len(rows), group.name)] if group.name else []
        for cells in group.rows:
            rows.append([f"{cell.text} {cell.mark}".rstrip() for cell in cells])
            rows += [[cell.interval for cell in cells]] if any(cell.interval for cell in cells) else []
    first, *lines = table(rows, header=header).split("\n")
    for index, name in reversed(headings):
        lines.insert(index, f"{name}:")
    notes = (f"{mark}: {sentence}".removeprefix(": ") for mark, sentence in report_table.notes)
    return "\n".join(("", report_table.caption, first, *lines, *notes))
