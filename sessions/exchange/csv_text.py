"""CSV whose text cells a spreadsheet takes for text: one that begins like a formula has an apostrophe before it.

A spreadsheet runs a cell that begins with `=`, `+`, `-`, `@`, a tab or a carriage return (OWASP, "CSV injection").
Numbers stay as they are. `plain` gives back the text that `harmless` was given, so that an export comes back whole.
"""

import csv
from collections.abc import Iterable, Sequence
from typing import Any, TextIO

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
