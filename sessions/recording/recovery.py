"""Recovery of a live file with a torn log after a crash, and of one whose name is gone.

SQLite silently drops a torn tail of its write-ahead log; a recording reports it. Layout of the log: the SQLite
documentation, "WAL-mode File Format".
"""

import errno
import itertools
import os
import sqlite3
import struct
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from sessions.file_access import remedy, sync_folder
from sessions.recording.log import LoggedEvent
from sessions.recording.schema import LIVE_FILE, RecordingError, event_row

_HEADER = struct.Struct(">8I")  # magic, version, page size, checkpoint number, two salts, two check sums
_FRAME = struct.Struct(">6I")  # page number, pages after a commit (else 0), two salts, two check sums
BIG_ENDIAN_SUMS = 0x377F0683
LITTLE_ENDIAN_SUMS = 0x377F0682
PAGE_SIZES = frozenset(2**power for power in range(9, 17))  # that SQLite knows [bytes]
_SHARED_BYTES = (510, 0x40000002)  # how many, and from where: SQLite's SHARED_SIZE and SHARED_FIRST (os.h)
# How long a recorder whose client is gone waits for the finger to lift [s, session clock]. A stroke takes less, and its
# take is discarded if it had no answer.
LIFT_PATIENCE = 10.0
_HOLE = (0, 0, 0, 0, 0, 0)  # a frame where nothing was ever written


@dataclass(frozen=True, slots=True)
class LogTail:
    """Content of a write-ahead log."""

    commits: int  # whole commits not yet folded into the file
    torn_bytes: int  # bytes after the last whole commit written in the current run of the log


def log_tail(log: BinaryIO) -> LogTail:
    """Follow the frames of a write-ahead log as SQLite's recovery does, a frame in memory at a time."""
    size = log.seek(0, os.SEEK_END)
    header = _read(log, 0, _HEADER.size)
    if len(header) < _HEADER.size:
        return LogTail(0, size)
    magic, _, page_size, _, salt_1, salt_2, sum_1, sum_2 = _HEADER.unpack(header)
    order = ">" if magic == BIG_ENDIAN_SUMS else "<"
    sums = _sums(header[:-8], order, (0, 0))
    if magic not in (BIG_ENDIAN_SUMS, LITTLE_ENDIAN_SUMS) or sums != (sum_1, sum_2) or page_size not in PAGE_SIZES:
        return LogTail(0, size)
    commits, position, commit_end = 0, _HEADER.size, _HEADER.size
    suspect = None
    while position + _FRAME.size + page_size <= size:
        frame = _read(log, position, _FRAME.size + page_size)
        _, pages, *salts, frame_1, frame_2 = _FRAME.unpack_from(frame)
        sums = _sums(frame[:8], order, sums)
        sums = _sums(frame[_FRAME.size :], order, sums)
        if sums != (frame_1, frame_2):
            break
        if salts != [salt_1, salt_2]:  # its sums, which exclude salts, continue: damaged, not from an earlier run
            suspect = position
            break
        position += _FRAME.size + page_size
        if pages:
            commits, commit_end = commits + 1, position
    return LogTail(commits, _of_this_run(log, commit_end, page_size, (salt_1, salt_2), suspect) - commit_end)


def _of_this_run(log: BinaryIO, start: int, page_size: int, salts: tuple[int, int], suspect: int | None) -> int:
    """Return the end of the last frame from `start` on with `salts`, or with damaged ones at `suspect`.

    Later frames belong to an earlier run of the log: the current run's frames are contiguous from the head.
    """
    size = log.seek(0, os.SEEK_END)
    step = _FRAME.size + page_size
    position = run_end = start
    while position + _FRAME.size <= size:
        frame = _FRAME.unpack(_read(log, position, _FRAME.size))
        if frame == _HOLE and position != suspect:
            position = max(position + step, start + (_next_data(log, position) - start) // step * step)
            continue
        position += step
        if position - step == suspect or frame[2:4] == salts:
            run_end = position
    return min(run_end, size) if run_end < position else size


def _read(log: BinaryIO, position: int, count: int) -> bytes:
    log.seek(position)
    return log.read(count)


def _next_data(log: BinaryIO, position: int) -> int:
    """Return the position of the next data at or after `position`, where the system reports holes."""
    try:
        return os.lseek(log.fileno(), position, os.SEEK_DATA)
    except (OSError, AttributeError) as none:  # no data up to the end; or the system does not say
        at_end = isinstance(none, OSError) and none.errno == errno.ENXIO
        return log.seek(0, os.SEEK_END) if at_end else position


def _sums(data: bytes, order: str, sums: tuple[int, int]) -> tuple[int, int]:
    """Continue the log's running check sums over `data`, whose length is a multiple of 8."""
    sum_1, sum_2 = sums
    for even_word, odd_word in struct.iter_unpack(order + "2I", data):
        sum_1 = (sum_1 + even_word + sum_2) & 0xFFFFFFFF
        sum_2 = (sum_2 + odd_word + sum_1) & 0xFFFFFFFF
    return sum_1, sum_2


def torn_log(path: Path) -> Iterator[str]:
    """Yield a sentence on what a crash tore off the end of the live file's write-ahead log."""
    try:
        with path.with_name(f"{path.name}-wal").open("rb", buffering=0) as file:
            size = log_tail(file).torn_bytes
    except FileNotFoundError:  # the session has ended
        return
    if size:
        yield (
            f"the last {size} bytes of the write-ahead log hold no whole commit and are left out:"
            " they had not been acknowledged, or were damaged since"
        )


Identity = tuple[int, int] | None  # device and inode, as `os.stat` returns them; None where there is no such file
FILE_SUFFIXES = ("", "-wal")  # the live file, and its log, which holds the newest commits


def identities(path: Path) -> tuple[Identity, ...]:
    """Return the identities of the files at the names of a live file and of its write-ahead log."""
    return tuple(_identity(path.with_name(path.name + side)) for side in FILE_SUFFIXES)


def rescue(source: sqlite3.Connection, path: Path) -> Path:
    """Copy an open live file, whose name may be gone, into a new folder, and return the path of the copy.

    SQLite reads through its open file handles, so names that are gone or belong to other files do not matter. The
    folder is created next to that of `path`, in the user's home or in the system's temporary folder, the first that
    works. Raises RecordingError if all fail.
    """
    reasons: list[str] = []
    for folder in _new_folders(path.absolute().parent):
        copy = folder / path.name
        try:
            folder.mkdir(parents=True)
            with closing(sqlite3.connect(copy, isolation_level=None)) as target:
                source.backup(target)
            for parent in (folder, folder.parent):
                sync_folder(parent)
        except (OSError, sqlite3.Error) as error:
            reasons.append(f"{folder}: {error}")
            with suppress(OSError):
                copy.unlink(missing_ok=True)
                folder.rmdir()
        else:
            return copy
    raise RecordingError(
        f"{path} was removed, renamed or replaced, and what it held could be written nowhere else "
        f"({'; '.join(reasons)}); the session has ended: look for the folder under another name or in the trash"
    )


def _identity(path: Path) -> Identity:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def _new_folders(session: Path) -> Iterator[Path]:
    """Yield a new folder's path in each place, the best place first."""
    for parent in (session.parent, Path.home(), Path(tempfile.gettempdir())):
        numbers = itertools.chain([""], (f"-{number}" for number in itertools.count(2)))
        names = (parent / f"{session.name}-rescued{number}" for number in numbers)
        yield next(folder for folder in names if not folder.exists())


def is_in_use(live: Path) -> bool:
    """Say whether another program has a live file open, as its recorder does; False where the system does not say.

    As long as SQLite has a file with a write-ahead log open, it shares a lock on these bytes. Raises OSError.
    """
    if os.name != "posix":
        return False
    import fcntl

    with live.open("rb+") as file:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, *_SHARED_BYTES)
        except (BlockingIOError, PermissionError):
            return True
    return False


def fold_log(folder: Path, events: Sequence[LoggedEvent]) -> None:
    """Fold a log left by a crash into the live file, which holds `events`. Raises RecordingError while it is in use.

    Folding discards a torn tail, so an event that reports it is added.
    """
    live = folder / LIVE_FILE
    if not live.with_name(f"{live.name}-wal").exists():
        return
    time_ns, readings = (events[-1].time_ns, events[-1].readings) if events else (0, 0)
    try:
        with closing(sqlite3.connect(live, timeout=0.5, isolation_level=None)) as connection:
            connection.execute("PRAGMA locking_mode=EXCLUSIVE")  # nobody else has the file open from here on
            connection.execute("BEGIN IMMEDIATE")
            (number,) = connection.execute("SELECT coalesce(max(rowid), 0) FROM events").fetchone()
            for i, sentence in enumerate(torn_log(live), 1):
                event = LoggedEvent(number + i, time_ns, "log_torn", None, readings, {"sentence": sentence})
                connection.execute("INSERT INTO events VALUES (?,?,?,?,?,?,?)", event_row(event))
            connection.execute("COMMIT")
            connection.execute("PRAGMA journal_mode=DELETE")
            with suppress(OSError):  # the crashed program's index of the log; this connection had its own
                live.with_name(f"{live.name}-shm").unlink(missing_ok=True)
    except sqlite3.Error as error:
        code = error.sqlite_errorcode & 0xFF  # the low byte
        if code not in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
            raise RecordingError(f"{live} cannot take its log in ({error}); {remedy(error)}") from error
        raise RecordingError(
            f"{live} is in use: end the program that still writes it, or reads it; a recorder whose window or terminal"
            f" is gone ends as soon as the finger is lifted, after {LIFT_PATIENCE:g} s at most: then try again"
        ) from error
