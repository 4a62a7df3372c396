"""Tables of a report of a session or a study: cells, columns and notes."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import TypeVar

from sessions.report.contents import Report
from sessions.report.wording import NONE, between, capital, caption, finer

Finding = TypeVar("Finding")
CAPTION_WORDS = 60  # most words of a caption; the rest becomes a note under the table
TOO_SHORT = "the stroke has too few readings"  # for an interval
NOT_ASKED = "none was asked for (--intervals)"  # likewise
_UNMARKED = f"no interval: {NOT_ASKED}"  # the note of nearly every cell: it stands once below the table


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell: its text, an explanatory note, and the interval under its number."""

    text: str
    note: str = ""
    interval: str = ""
    mark: str = ""  # of the note, given by `table`


@dataclass(frozen=True, slots=True)
class Column:
    """The head of a column."""

    name: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Group:
    """Rows under one heading, "" for none."""

    name: str
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True, slots=True)
class Table:
    """One table with its caption and notes."""

    name: str  # its anchor on the page
    caption: str
    columns: tuple[Column, ...]
    groups: tuple[Group, ...]
    notes: tuple[tuple[str, str], ...]  # mark, sentence


Format = Callable[[float], str]  # a number as text
Row = tuple[Cell | str | int, ...]  # a text or a whole number becomes a cell
Rows = tuple[str, Iterable[Row]]  # the heading of a group, and its rows


def number_cell(value: float | None, as_text: Format, reason: str | None) -> Cell:
    """Return a number, or a dash with its reason."""
    return Cell(NONE, reason or "not determined") if value is None else Cell(as_text(value))


def estimate_cell(
    value: float | None,
    as_text: Format,
    reason: str | None,
    interval: tuple[float, float] | None,
    without: str | None = None,
    *,
    of_limits: Format | None = None,
    unit: float = 1.0,
) -> Cell:
    """Return a number over its interval, or with the note `without` on why it has none; or a dash with its reason.

    `of_limits` formats an end of the interval where `as_text` adds more than a number; `unit` as for `wording.between`.
    """
    if value is None:
        return number_cell(None, as_text, reason)
    if interval is None:
        return Cell(as_text(value), f"no interval: {without or 'not computed'}")
    number = as_text if of_limits else finer(*interval, as_text, unit)
    return Cell(number(value), interval=between(*interval, of_limits or as_text, unit))


def range_cell(low: float | None, high: float | None, as_text: Format, reason: str | None = None) -> Cell:
    """Return an interval as a separate cell, or a dash with the reason."""
    return Cell(NONE, reason or "") if low is None or high is None else Cell(f"{as_text(low)} to {as_text(high)}")


def table(name: str, caption_name: str, columns: str, groups: Iterable[Rows], **values: object) -> Table | None:
    """Return a table without empty groups, notes marked in reading order; None where no group has rows.

    `columns` are its headings with their units, as in "index | SED [kPa]"; `values` fill placeholders of its caption.
    """
    marks: dict[str, str] = {}  # by the note

    def with_mark(content: Cell | str | int) -> Cell:
        cell = content if isinstance(content, Cell) else Cell(str(content))
        letter = "" if cell.note in ("", _UNMARKED) else note_mark(sum(map(bool, marks.values())))
        return replace(cell, mark=marks.setdefault(cell.note, letter)) if cell.note else cell

    cells = ((name, tuple(tuple(map(with_mark, row)) for row in rows)) for name, rows in groups)
    non_empty = tuple(Group(name, rows) for name, rows in cells if rows)
    if not non_empty:
        return None
    short_caption, further = _shorten(caption(caption_name, **values))
    headings = (heading.strip().removesuffix("]").partition(" [") for heading in columns.split("|"))
    notes = (*further, *((mark, note if mark else f"{capital(note)}.") for note, mark in marks.items()))
    return Table(name, short_caption, tuple(Column(heading, unit) for heading, _, unit in headings), non_empty, notes)


def note_mark(n: int) -> str:
    """Return the mark of note `n` from 0: a to z, then aa, ab and so on."""
    return (chr(ord("a") + n // 26 - 1) if n >= 26 else "") + chr(ord("a") + n % 26)


def _shorten(caption_text: str) -> tuple[str, tuple[tuple[str, str], ...]]:
    """Return a caption of at most `CAPTION_WORDS` words, and the sentences beyond as a note without a mark.

    A sentence that names the model always stays in the caption.
    """
    if len(caption_text.split()) <= CAPTION_WORDS:
        return caption_text, ()
    sentences = re.split(r"(?<=[.;]) (?=\S)", caption_text)
    main = {0, *(n for n, sentence in enumerate(sentences) if "Model" in sentence)}
    for n in range(1, len(sentences)):
        if n not in main and sum(len(sentences[i].split()) for i in (*main, n)) > CAPTION_WORDS:
            break
        main.add(n)
    rest = " ".join(sentence for n, sentence in enumerate(sentences) if n not in main)
    return " ".join(sentences[n] for n in sorted(main)), (("", rest),)


def sections_of(sections: Mapping[str, Iterable[Table | None]]) -> dict[str, tuple[Table, ...]]:
    """Return the tables of each section that have rows."""
    return {name: tuple(table for table in tables if table is not None) for name, tables in sections.items()}


def split_off_appendix(
    sections: Mapping[str, tuple[Table, ...]], body: Set[str]
) -> tuple[dict[str, tuple[Table, ...]], tuple[Table, ...]]:
    """Return the sections with the tables named in `body`, and the other tables, for the appendix."""
    main = {section: tuple(table for table in tables if table.name in body) for section, tables in sections.items()}
    return main, tuple(table for tables in sections.values() for table in tables if table.name not in body)


def group_by_experiment(
    report: Report, findings: Sequence[Finding], experiment: Callable[[Finding], str], row: Callable[[Finding], Row]
) -> list[Rows]:
    """Return the rows of all findings under the names of their experiments, in their own order without experiments."""
    names = [e.name for e in report.experiments] or list(dict.fromkeys(map(experiment, findings)))
    groups: list[Rows] = [(name, [row(f) for f in findings if experiment(f) == name]) for name in names]
    return [*groups, ("", [row(f) for f in findings if experiment(f) not in names])]
