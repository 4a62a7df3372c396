"""Texts of any length in an HDF5 file: their bytes one after the other, and where each ends.

HDF5 keeps no check sum over its own strings of variable length, and strings of fixed length each take the room of the
longest. Bytes in chunks have check sums, take the room of the texts, and need the memory of one text.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportAttributeAccessIssue=false, reportIndexIssue=false
# h5py brings no types; what leaves this file is bytes.

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np

CHUNK_BYTES = 32_768  # as a chunk of the readings' columns has
END = "_end"  # of the name of the data set that holds where each text ends


@dataclass(frozen=True, slots=True, eq=False)
class TextColumn:
    """A column of ASCII texts, made when it is asked for: all of them at once may be more than memory holds."""

    name: str
    texts: Callable[[], Iterable[str]]
    note: str


def write_texts(file: h5py.File, column: TextColumn) -> tuple[h5py.Dataset, h5py.Dataset]:
    """Write a column, and return its two data sets: uint8 bytes, int64 ends."""
    data_set = file.create_dataset(
        column.name, (0,), np.uint8, maxshape=(None,), chunks=(CHUNK_BYTES,), fletcher32=True
    )
    waiting, ends, end = bytearray(), list[int](), 0
    for text in column.texts():
        waiting += text.encode("ascii")
        end += len(text)
        ends.append(end)
        if len(waiting) >= CHUNK_BYTES:
            _append(data_set, waiting)
    _append(data_set, waiting)
    protected = {"chunks": (len(ends),), "fletcher32": True} if ends else {}
    return data_set, file.create_dataset(column.name + END, data=np.array(ends, "<i8"), **protected)


def read_texts(file: h5py.File, name: str) -> Iterator[bytes]:
    """Yield the texts of a column, those of fixed length that files of version 1 hold too. Raises OSError, KeyError."""
    column: Any = file[name]
    if column.dtype.kind == "S":
        rows = max(CHUNK_BYTES // column.dtype.itemsize, 1)
        for start in range(0, len(column), rows):
            yield from column[start : start + rows].tolist()
        return
    begin = 0
    for end in file[name + END][...].tolist():
        yield column[begin:end].tobytes()
        begin = end


def _append(data_set: h5py.Dataset, waiting: bytearray) -> None:
    length = len(data_set)
    data_set.resize(length + len(waiting), axis=0)
    if waiting:
        data_set[length:] = np.frombuffer(bytes(waiting), np.uint8)
        waiting.clear()
