"""The rows of a CSV file that somebody else wrote: numbers, or one sentence that names the line."""

import csv
from collections.abc import Iterator
from pathlib import Path

COMMENT = "#"
_DELIMITERS = (",", ";", "\t")


class ImportRefused(Exception):
    """The file cannot be taken as a recording; one sentence names file, line and what to do."""


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
