"""CSV safe for spreadsheets, rows of foreign files, readings as rows, and the log of a stage.

A spreadsheet runs a cell that begins with `=`, `+`, `-`, `@`, a tab or a carriage return (OWASP, "CSV injection"). Text
that begins like a formula is prefixed with an apostrophe; numbers are unchanged. `plain` reverses `harmless`, so that
an export can be imported unchanged.
"""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from sessions.exchange.session_tables import WRENCH, Column
from sessions.file_access import LARGEST_TABLE, name_failure, read_within_limit
from sessions.prediction.press_curves import DisplacementLog

_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def harmless(cell: object) -> object:
    """Return a cell that no spreadsheet runs as a formula.

    >>> [harmless(cell) for cell in ("=1+1", "-1.5", -1.5, "K3", "'=1")]
    ["'=1+1", '-1.5', -1.5, 'K3', "''=1"]
    """
    return f"'{cell}" if isinstance(cell, str) and _begins_like_a_formula(cell) else cell


def plain(text: str) -> str:
    """Return the original text of a cell made by `harmless`.

    >>> plain("'=1+1"), plain("'tis")
    ('=1+1', "'tis")
    """
    return text[1:] if text.startswith("'") and _begins_like_a_formula(text) else text


def write_rows(file: TextIO, rows: Iterable[Sequence[Any]], delimiter: str = ",") -> None:
    """Write rows to an open file; None is an empty cell. Tables with commas, for spreadsheets, hold no formula."""
    if delimiter == ",":
        rows = ([harmless(cell) for cell in row] for row in rows)
    csv.writer(file, delimiter=delimiter, lineterminator="\n").writerows(rows)


def _begins_like_a_formula(text: str) -> bool:
    return text.lstrip("'").startswith(_FORMULA) and number_in(text) is None


COMMENT = "#"
_DELIMITERS = (",", ";", "\t")


class ImportRefused(Exception):
    """The file cannot be imported; one sentence names file, line and remedy."""


def content_of(path: Path) -> bytes:
    """Return the bytes of a CSV file. Raises ImportRefused where it cannot be read."""
    with name_failure(ImportRefused, f"{path} cannot be read"):
        return read_within_limit(path, LARGEST_TABLE)


def records(path: Path, content: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of every row that is not a comment; empty lines are allowed only at the end."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ImportRefused(f"{path}: byte {error.start} is no UTF-8 text; save the file as CSV in UTF-8") from error
    lines = list(io.StringIO(text, newline=""))
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
        raise ImportRefused(f"{path}, line {reader.line_num}: this is no CSV ({error}); save the file again") from error


def cell_text(cell: str) -> str:
    """Return a cell's text on one line, shortened."""
    return " ".join(cell.split())[:40]


def number_in(cell: str) -> float | None:
    """Return a cell as a number (nan and infinities too), or None."""
    if "_" in cell:  # Python reads 1_000 as a number, but in a data file it is text
        return None
    try:
        return float(cell)
    except ValueError:
        return None


def mend_row(*cells: str) -> str:
    """Return the remedy where cells of a row hold no numbers. A comma may separate thousands or a fraction."""
    commas = any(re.fullmatch(r"[+-]?\d+,\d+", cell.strip()) for cell in cells)
    return "save the file with decimal points" if commas else "correct or remove the row"


_PART = 16_384  # rows in one read
NOT_AVAILABLE = "n/a"
RAW = tuple(f"raw_{axis}" for axis in range(1, 7))
_EXACT = np.dtype(
    [("sequence", "i8"), ("counter", "i8"), ("status", "i8"), ("time", "f8"), ("received", "i8")]
    + [(name, "f8") for name in RAW]
)
STORED = _EXACT.names or ()  # the columns of a reading; the wrench is computed from them


def columns(calibration: Calibration) -> tuple[Column, ...]:
    """Return the columns of a row, without values."""
    raw_units = [unit for _, unit in WRENCH] if calibration.raw_unit == "N, N mm" else [calibration.raw_unit] * 6
    meanings = [
        ("sequence", "", "record number given by the device; missing numbers are readings that never arrived"),
        ("counter", "", "ticks of the device's clock"),
        ("status", "", "status word as the device sent it; 0 is healthy"),
        ("time", "s", "device clock, 0 at the first reading"),
        ("received", "ns", "session clock when the reading arrived"),
        *((name, unit, "as the device sent it") for name, unit in zip(RAW, raw_units, strict=True)),
        *(
            (axis, unit, "the finger's wrench on the stimulus: matrix · raw, nothing subtracted")
            for axis, unit in WRENCH
        ),
    ]
    return tuple(Column(name, unit, meaning, ()) for name, unit, meaning in meanings)


def rows(block: ReadingBlock, calibration: Calibration) -> Iterator[tuple[Any, ...]]:
    """Yield the row of each reading, in the order of `columns`."""
    with np.errstate(invalid="ignore", over="ignore"):  # any value of the device is written
        wrench = calibration.wrench(block.raw, np.zeros(6))
    columns = (block.sequence, block.counter, block.status, block.time, block.received_ns)
    return zip(*(column.tolist() for column in columns), *block.raw.T.tolist(), *wrench.T.tolist(), strict=True)


def read_rows(lines: Iterable[str], names: Sequence[str], delimiter: str) -> Iterator[ReadingBlock]:
    """Yield the readings in rows with columns `names` (which may end with a unit).

    Rows without a sequence number, for missing readings, are left out; n/a is read as NaN. Raises ValueError.
    """
    positions = [_place(name, names) for name in STORED]
    present = (line.replace(NOT_AVAILABLE, "nan") for line in lines if not line.startswith(NOT_AVAILABLE))
    while chunk := list(islice(present, _PART)):
        # usecols returns columns in the given order, independent of the file's.
        table: Any = np.atleast_1d(np.loadtxt(chunk, _EXACT, delimiter=delimiter, usecols=positions, comments=None))
        raw = np.column_stack([table[name] for name in RAW])
        sequence, counter, status, time, received = (np.ascontiguousarray(table[name]) for name in STORED[:5])
        yield ReadingBlock(sequence, counter, status, time, received, raw)


def _place(name: str, names: Sequence[str]) -> int:
    for position, heading in enumerate(names):
        if heading == name or heading.startswith(f"{name}_"):
            return position
    raise ValueError(f"there is no column {name}")


_DISPLACEMENT = "displacement_mm"
_WIDTH = "contact_width_mm"
CLOCKS = ("time_s", "received_ns", "sequence")  # named as in `readings.csv` of an export


def displacement_log(path: Path) -> DisplacementLog:
    """Return a stage's log from a CSV file with a header; other columns are ignored. Raises ImportRefused."""
    rows = records(path, content_of(path))
    _, header = next(rows, (0, [""]))
    names = [cell.strip() for cell in header]
    clock = next((name for name in CLOCKS if name in names), None)
    if clock is None or _DISPLACEMENT not in names:
        raise ImportRefused(
            f"{path} needs a header with {_DISPLACEMENT} and one of {', '.join(CLOCKS)}, as readings.csv of an export "
            f"calls them; it has {', '.join(map(cell_text, names)) or 'none'}"
        )
    positions = [names.index(name) if name in names else None for name in (clock, _DISPLACEMENT, _WIDTH)]
    values: list[tuple[float, float, float]] = []
    for line, cells in rows:
        time, displacement, width = (_number(cells, position) for position in positions)
        if not np.isfinite([time, displacement]).all():
            problem = f"{clock} or {_DISPLACEMENT} is no number; {mend_row(*cells)}"
            raise ImportRefused(f"{path}, line {line}: {problem}")
        if values and time <= values[-1][0]:
            raise ImportRefused(f"{path}, line {line}: {clock} does not grow; correct or remove the row")
        if width <= 0.0:
            raise ImportRefused(f"{path}, line {line}: {_WIDTH} is not above 0; leave the cell empty without a contact")
        values.append((time, displacement, width))
    if len(values) < 2:
        raise ImportRefused(f"{path} holds {len(values)} rows: give a log with at least 2")
    return DisplacementLog(clock, *np.array(values).T)


def _number(cells: Sequence[str], position: int | None) -> float:
    number = number_in(cells[position]) if position is not None and position < len(cells) else None
    return np.nan if number is None else number
