"""Read files of a bounded size, make new ones that follow no link, and say what mends a file that failed."""

import errno
import gzip
import os
import re
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

LARGEST_TEXT = 4 * 2**20  # of a file that people write [bytes]: the longest built-in protocol is a thousandth of it
LARGEST_TABLE = 512 * 2**20  # of a CSV file [bytes]: an hour of readings at 2 kHz with seven columns
LARGEST_DOCUMENT = 256 * 2**20  # of a file that programs write [bytes]: a session of an hour makes a tenth of it

LONGEST_LINE = 2**24  # of a table [characters]: an answer with 100 000 positions takes a quarter
MOST_PACKED = 300  # how many times a packed table may grow [-]: readings grow tenfold, nothing packed a thousandfold
# What opening or reading a database raises; the second where the name of a damaged table is no text.
DATABASE_FAILURES = (sqlite3.Error, UnicodeDecodeError, OSError)

_FULL = "free space on the disk"
_DENIED = "permit reading and writing there"
_FAILING = "check the disk and its cable"
_BUSY = "end the program that uses it"
_DAMAGED = "restore it from a copy"
_TOO_LARGE = "give the file that was meant"
_MISSING = "restore it from a copy, or give another name"
_OTHER = "check its name, its disk and who may use it"
_BY_ERRNO = {
    errno.ENOSPC: _FULL,
    errno.EDQUOT: _FULL,
    errno.EACCES: _DENIED,
    errno.EPERM: _DENIED,
    errno.EROFS: _DENIED,
    errno.EIO: _FAILING,
    errno.EBUSY: _BUSY,
    errno.EFBIG: _TOO_LARGE,
    errno.ENOENT: _MISSING,
}
_BY_SQLITE = {
    sqlite3.SQLITE_FULL: _FULL,
    sqlite3.SQLITE_PERM: _DENIED,
    sqlite3.SQLITE_READONLY: _DENIED,
    sqlite3.SQLITE_AUTH: _DENIED,
    sqlite3.SQLITE_IOERR: _FAILING,
    sqlite3.SQLITE_BUSY: _BUSY,
    sqlite3.SQLITE_LOCKED: _BUSY,
    sqlite3.SQLITE_CANTOPEN: _OTHER,
}


def read_limited(path: Path, most: int = LARGEST_DOCUMENT) -> bytes:
    """Return the bytes of a file, which may be a pipe. Raises OSError, also where there are more than `most`."""
    with path.open("rb") as file:
        if os.fstat(file.fileno()).st_size <= most and len(content := file.read(most + 1)) <= most:
            return content
    raise OSError(errno.EFBIG, f"it holds more than {most / 2**20:.0f} MB", str(path))


def open_new(path: Path) -> BinaryIO:
    """Open a file that is made anew for writing; what had its name, a link too, is removed and not followed."""
    path.unlink(missing_ok=True)
    return path.open("xb")


def packed_lines(path: Path) -> Iterator[str]:
    """Yield the lines of a table packed by gzip. Raises ValueError where it grows as no readings do, OSError."""
    size, most = 0, MOST_PACKED * path.stat().st_size + LARGEST_TEXT
    with gzip.open(path, "rt", encoding="utf-8") as file:
        while line := file.readline(LONGEST_LINE):
            size += len(line)
            if len(line) == LONGEST_LINE or size > most:
                raise ValueError(f"{path.name} unpacks to more than readings can")
            yield line


def bounded(connection: sqlite3.Connection) -> sqlite3.Connection:
    """Return a connection whose values are of a bounded size, and whose texts come even where they are no UTF-8."""
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_DOCUMENT)
    connection.text_factory = _text
    return connection


def _text(content: bytes) -> str:
    """Return a text that no check sum fits where its bytes are damaged, instead of failing with its whole table."""
    return content.decode(errors="surrogateescape")


def remedy(error: Exception) -> str:
    """Say what mends a file that could not be read or written.

    >>> remedy(OSError(errno.EIO, "")), remedy(PermissionError(errno.EACCES, ""))
    ('check the disk and its cable', 'permit reading and writing there')
    """
    if isinstance(error, (sqlite3.Error, UnicodeDecodeError)):
        code: int | None = getattr(error, "sqlite_errorcode", None)  # none where Python itself found the fault
        return _DAMAGED if code is None else _BY_SQLITE.get(code & 0xFF, _DAMAGED)  # the low byte is the kind
    number: int | None = getattr(error, "errno", None)
    if number is None and (match := re.search(r"errno = (\d+)", str(error))):  # as HDF5 tells it
        number = int(match.group(1))
    return _BY_ERRNO.get(number or 0, _OTHER)
