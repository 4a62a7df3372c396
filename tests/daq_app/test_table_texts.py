"""Tables of a report as a terminal shows them, from tables that are made up."""

from daq_app.cli import report_tables
from sessions.report.tables import Cell, Column, Group, Table


def made_up(caption, *notes):
    """Return a table of one column, a row for each note."""
    rows = tuple((Cell("–", note, mark=mark),) for mark, note in notes)
    return Table("t", caption, (Column("SED", "kPa"),), (Group("", rows),), notes)


def test_a_note_stands_once_below_the_first_table_that_needs_it_and_has_one_mark_in_all_tables(monkeypatch):
    first = made_up("First.", ("", "No interval."), ("a", "too light"), ("b", "too short"))
    second = made_up("Second.", ("", "No interval."), ("a", "too short"), ("b", "inside out"))
    monkeypatch.setattr(report_tables, "tables", lambda _: {"one": [first], "two": [second]})
    texts = report_tables.table_texts(None, "one", "two")
    assert [text.split("\n") for text in texts] == [
        ["", "First.", "SED [kPa]", "–", "– a", "– b", "No interval.", "a: too light", "b: too short"],
        ["", "Second.", "SED [kPa]", "–", "– b", "– c", "c: inside out"],
    ]
