"""CSV written so that a spreadsheet takes text for text, and rows of files that somebody else wrote.

A spreadsheet runs a cell that begins with `=`, `+`, `-`, `@`, a tab or a carriage return (OWASP, "CSV injection").
Text that begins like a formula has an apostrophe before it; numbers stay as they are. `plain` gives back the text that
`harmless` was given, so that an export comes back whole.
"""

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO

from sessions.file_access import LARGEST_TABLE, read_limited, remedy

_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def harmless(cell: object) -> object:
    """Return a cell that no spreadsheet runs.

    >>> [harmless(cell) for cell in ("=1+1", "-1.5", -1.5, "K3", "'=1")]
    ["'=1+1", '-1.5', -1.5, 'K3', "''=1"]
    """
    return f"'{cell}" if isinstance(cell, str) and _begins_like_a_formula(cell) else cell


def plain(text: str) -> str:
    """Return the text that `harmless` was given.

    >>> plain("'=1+1"), plain("'tis")
    ('=1+1', "'tis")
    """
    return text[1:] if text.startswith("'") and _begins_like_a_formula(text) else text


def write_rows(file: TextIO, rows: Iterable[Sequence[Any]], delimiter: str = ",") -> None:
    """Write rows to an open file; None is an empty cell. Tables for spreadsheets, with commas, hold no formula."""
    if delimiter == ",":
        rows = ([harmless(cell) for cell in row] for row in rows)
    csv.writer(file, delimiter=delimiter, lineterminator="\n").writerows(rows)


def _begins_like_a_formula(text: str) -> bool:
    if not text.lstrip("'").startswith(_FORMULA):
        return False
    try:
        float(text)
    except ValueError:
        return True
    return False


COMMENT = "#"
_DELIMITERS = (",", ";", "\t")


class ImportRefused(Exception):
    """The file cannot be taken as a recording; one sentence names file, line and what to do."""


def content_of(path: Path) -> bytes:
    """Return what a CSV file holds. Raises ImportRefused where it cannot be read."""
    try:
        return read_limited(path, LARGEST_TABLE)
    except OSError as error:
        raise ImportRefused(f"{path} cannot be read ({error.strerror}); {remedy(error)}, a CSV file") from error


def records(path: Path, content: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of every row that is no comment; empty lines are allowed at the end alone."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ImportRefused(f"{path}: byte {error.start} is no UTF-8 text; save the file as CSV in UTF-8") from error
    lines = text.splitlines(keepends=True)
    first_line = next((line for line in lines if not line.startswith(COMMENT)), "")
    delimiter = next((mark for mark in _DELIMITERS if mark in first_line), ",")
    empty: int | None = None
    reader = csv.reader(iter(lines), delimiter=delimiter)
    try:
        for cells in reader:
            if cells and cells[0].startswith(COMMENT):
                continue
            if not any(cell.strip() for cell in cells):
                empty = empty or reader.line_num
                continue
            if empty is not None:
                raise ImportRefused(f"{path}, line {empty} is empty: remove it, or what follows it")
            yield reader.line_num, cells
    except csv.Error as error:
        raise ImportRefused(f"{path}, line {reader.line_num}: this is no CSV ({error}); save the file anew") from error


def cell_text(cell: str) -> str:
    """Return what a cell holds, on one line and not too long."""
    return " ".join(cell.split())[:40]


def number_in(cell: str) -> float | None:
    """Return a cell as a number (nan and infinities too), or None."""
    if "_" in cell:  # Python reads 1_000 as a number; a data file means none
        return None
    try:
        return float(cell)
    except ValueError:
        return None
