"""How much of a write-ahead log holds whole commits, and how much of its tail was torn.

Layout: the SQLite documentation, "WAL-mode File Format".
SQLite leaves a torn tail out without a word; a recording names it.
"""

import errno
import os
import struct
from dataclasses import dataclass
from typing import BinaryIO

HEADER = struct.Struct(">8I")  # magic, version, page size, checkpoint number, two salts, two check sums
FRAME = struct.Struct(">6I")  # page number, pages after a commit (else 0), two salts, two check sums
BIG_ENDIAN_SUMS = 0x377F0683
LITTLE_ENDIAN_SUMS = 0x377F0682
PAGE_SIZES = frozenset(2**power for power in range(9, 17))  # that SQLite knows [bytes]
_HOLE = (0, 0, 0, 0, 0, 0)  # a frame where nothing was ever written


@dataclass(frozen=True, slots=True)
class LogTail:
    """What a write-ahead log holds."""

    commits: int  # whole commits not yet folded into the file
    torn_bytes: int  # bytes after the last whole commit that were written in this run of the log


def log_tail(log: BinaryIO) -> LogTail:
    """Follow the frames of a write-ahead log as SQLite's recovery does, a frame in memory at a time."""
    size = log.seek(0, os.SEEK_END)
    head = _read(log, 0, HEADER.size)
    if len(head) < HEADER.size:
        return LogTail(0, size)
    magic, _, page_size, _, salt_1, salt_2, sum_1, sum_2 = HEADER.unpack(head)
    order = ">" if magic == BIG_ENDIAN_SUMS else "<"
    sums = _sums(head[:-8], order, (0, 0))
    if magic not in (BIG_ENDIAN_SUMS, LITTLE_ENDIAN_SUMS) or sums != (sum_1, sum_2) or page_size not in PAGE_SIZES:
        return LogTail(0, size)
    commits, position, end = 0, HEADER.size, HEADER.size
    mislabelled = None
    while position + FRAME.size + page_size <= size:
        frame = _read(log, position, FRAME.size + page_size)
        _, pages, *salts, frame_1, frame_2 = FRAME.unpack_from(frame)
        sums = _sums(frame[:8], order, sums)
        sums = _sums(frame[FRAME.size :], order, sums)
        if sums != (frame_1, frame_2):
            break
        if salts != [salt_1, salt_2]:  # the sums, which leave salts out, go on: damaged, and not of an earlier run
            mislabelled = position
            break
        position += FRAME.size + page_size
        if pages:
            commits, end = commits + 1, position
    return LogTail(commits, _of_this_run(log, end, page_size, (salt_1, salt_2), mislabelled) - end)


def _of_this_run(log: BinaryIO, start: int, page_size: int, salts: tuple[int, int], mislabelled: int | None) -> int:
    """Return where the last frame carrying `salts` ends, or the one that does not and should, from `start` on.

    Frames after it were left over from an earlier run of the log: those of one run lie together, at its head.
    """
    size = log.seek(0, os.SEEK_END)
    step = FRAME.size + page_size
    position = end = start
    while position + FRAME.size <= size:
        frame = FRAME.unpack(_read(log, position, FRAME.size))
        if frame == _HOLE and position != mislabelled:
            position = max(position + step, start + (_next_data(log, position) - start) // step * step)
            continue
        position += step
        if position - step == mislabelled or frame[2:4] == salts:
            end = position
    return min(end, size) if end < position else size


def _read(log: BinaryIO, position: int, count: int) -> bytes:
    log.seek(position)
    return log.read(count)


def _next_data(log: BinaryIO, position: int) -> int:
    """Return where the file holds data again at or after `position`, where the system can tell holes from data."""
    try:
        return os.lseek(log.fileno(), position, os.SEEK_DATA)
    except (OSError, AttributeError) as none:  # no data up to the end; or no system that tells
        ended = isinstance(none, OSError) and none.errno == errno.ENXIO
        return log.seek(0, os.SEEK_END) if ended else position


def _sums(data: bytes, order: str, sums: tuple[int, int]) -> tuple[int, int]:
    """Continue the log's running check sums over `data`, whose length is a multiple of 8."""
    first, second = sums
    for a, b in struct.iter_unpack(order + "2I", data):
        first = (first + a + second) & 0xFFFFFFFF
        second = (second + b + first) & 0xFFFFFFFF
    return first, second
