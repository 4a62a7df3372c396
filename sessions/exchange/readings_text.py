"""Readings as rows of text and back: every number survives to the last bit."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from sessions.exchange.column_meanings import AXES
from sessions.exchange.session_tables import Column

PART = 16_384  # rows at once
MISSING = "n/a"
RAW = tuple(f"raw_{axis}" for axis in range(1, 7))
_EXACT = np.dtype(
    [("sequence", "i8"), ("counter", "i8"), ("status", "i8"), ("time", "f8"), ("received", "i8")]
    + [(name, "f8") for name in RAW]
)
STORED = _EXACT.names or ()  # what a reading is; the wrench is made from it


def columns(calibration: Calibration) -> tuple[Column, ...]:
    """Return what the columns of a row are, without values."""
    raw_units = [unit for _, unit in AXES] if calibration.raw_unit == "N, N mm" else [calibration.raw_unit] * 6
    meanings = [
        ("sequence", "", "record number given by the device; missing numbers are readings that never arrived"),
        ("counter", "", "ticks of the device's clock"),
        ("status", "", "status word as the device sent it; 0 is healthy"),
        ("time", "s", "device clock, 0 at the first reading"),
        ("received", "ns", "session clock when the reading arrived"),
        *((name, unit, "as the device sent it") for name, unit in zip(RAW, raw_units, strict=True)),
        *((axis, unit, "the finger's wrench on the stimulus: matrix · raw, nothing subtracted") for axis, unit in AXES),
    ]
    return tuple(Column(name, unit, meaning, ()) for name, unit, meaning in meanings)


def rows(block: ReadingBlock, calibration: Calibration) -> Iterator[tuple[Any, ...]]:
    """Yield the row of each reading, in the order of `columns`."""
    with np.errstate(invalid="ignore", over="ignore"):  # what the device sent is written, whatever it is
        wrench = calibration.wrench(block.raw, np.zeros(6))
    singles = (block.sequence, block.counter, block.status, block.time, block.received_ns)
    return zip(*(single.tolist() for single in singles), *block.raw.T.tolist(), *wrench.T.tolist(), strict=True)


def read_rows(lines: Iterable[str], names: Sequence[str], delimiter: str) -> Iterator[ReadingBlock]:
    """Yield the readings in rows whose columns are called `names` (units at their end are no part of them).

    Rows without a sequence number are places of readings that never arrived, and left out; n/a elsewhere is a NaN.
    Raises ValueError.
    """
    places = [_place(name, names) for name in STORED]
    arrived = (line.replace(MISSING, "nan") for line in lines if not line.startswith(MISSING))
    while part := list(islice(arrived, PART)):
        # usecols picks the columns in the order given, whatever their order in the file.
        table: Any = np.atleast_1d(np.loadtxt(part, _EXACT, delimiter=delimiter, usecols=places, comments=None))
        raw = np.column_stack([table[name] for name in RAW])
        sequence, counter, status, time, received = (np.ascontiguousarray(table[name]) for name in STORED[:5])
        yield ReadingBlock(sequence, counter, status, time, received, raw)


def _place(name: str, names: Sequence[str]) -> int:
    for place, heading in enumerate(names):
        if heading == name or heading.startswith(f"{name}_"):
            return place
    raise ValueError(f"there is no column {name}")
