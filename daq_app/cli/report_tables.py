"""A report's tables as text for a terminal."""

from daq_app.console import table
from sessions.report.contents import Report
from sessions.report.tables import Table, note_mark
from sessions.report.tables.session import tables


def table_texts(report: Report, *sections: str) -> list[str]:
    """Return the tables of some sections of a report as text, each note under the first table that needs it."""
    by_section = tables(report)
    marks: dict[str, str] = {}
    return [_as_text(section_table, marks) for name in sections for section_table in by_section[name]]


def _as_text(report_table: Table, marks: dict[str, str]) -> str:
    """Return a table with its caption, each number above its interval, and the notes that are not in `marks`.

    `marks` holds the mark of each note of the tables before, by its sentence; those of this table are added.
    """
    header = [f"{one.name} [{one.unit}]" if one.unit.strip("1") else one.name for one in report_table.columns]
    notes: list[str] = []
    for mark, sentence in report_table.notes:
        if sentence not in marks:
            marks[sentence] = note_mark(sum(map(bool, marks.values()))) if mark else ""
            notes.append(f"{marks[sentence]}: {sentence}".removeprefix(": "))
    rows: list[list[str]] = []
    headings: list[tuple[int, str]] = []  # before which row each group begins
    for group in report_table.groups:
        headings += [(len(rows), group.name)] if group.name else []
        for cells in group.rows:
            rows.append([f"{cell.text} {marks.get(cell.note, '')}".rstrip() for cell in cells])
            rows += [[cell.interval for cell in cells]] if any(cell.interval for cell in cells) else []
    first, *lines = table(rows, header=header).split("\n")
    for index, name in reversed(headings):
        lines.insert(index, f"{name}:")
    return "\n".join(("", report_table.caption, first, *lines, *notes))
