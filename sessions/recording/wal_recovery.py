"""How much of a write-ahead log holds whole commits, and how much of its tail was torn.

Layout: the SQLite documentation, "WAL-mode File Format".
SQLite leaves a torn tail out without a word; a recording names it.
"""

import struct
from dataclasses import dataclass

HEADER = struct.Struct(">8I")  # magic, version, page size, checkpoint number, two salts, two check sums
FRAME = struct.Struct(">6I")  # page number, pages after a commit (else 0), two salts, two check sums
BIG_ENDIAN_SUMS = 0x377F0683
LITTLE_ENDIAN_SUMS = 0x377F0682


@dataclass(frozen=True, slots=True)
class LogTail:
    """What a write-ahead log holds."""

    commits: int  # whole commits not yet folded into the file
    torn_bytes: int  # bytes after the last whole commit that were written in this run of the log


def log_tail(log: bytes) -> LogTail:
    """Follow the frames of a write-ahead log as SQLite's recovery does."""
    if len(log) < HEADER.size:
        return LogTail(0, len(log))
    magic, _, page_size, _, salt_1, salt_2, sum_1, sum_2 = HEADER.unpack_from(log)
    order = ">" if magic == BIG_ENDIAN_SUMS else "<"
    sums = _sums(log[: HEADER.size - 8], order, (0, 0))
    if magic not in (BIG_ENDIAN_SUMS, LITTLE_ENDIAN_SUMS) or sums != (sum_1, sum_2):
        return LogTail(0, len(log))
    commits, position, end = 0, HEADER.size, HEADER.size
    mislabelled = None
    while position + FRAME.size + page_size <= len(log):
        _, pages, *salts, frame_1, frame_2 = FRAME.unpack_from(log, position)
        sums = _sums(log[position : position + 8], order, sums)
        sums = _sums(log[position + FRAME.size : position + FRAME.size + page_size], order, sums)
        if sums != (frame_1, frame_2):
            break
        if salts != [salt_1, salt_2]:  # the sums, which leave salts out, go on: damaged, and not of an earlier run
            mislabelled = position
            break
        position += FRAME.size + page_size
        if pages:
            commits, end = commits + 1, position
    return LogTail(commits, _of_this_run(log, end, page_size, (salt_1, salt_2), mislabelled) - end)


def _of_this_run(log: bytes, start: int, page_size: int, salts: tuple[int, int], mislabelled: int | None) -> int:
    """Return where the last frame carrying `salts` ends, or the one that does not and should, from `start` on.

    Frames after it were left over from an earlier run of the log: those of one run lie together, at its head.
    """
    position = end = start
    while position + FRAME.size <= len(log):
        this_run = position == mislabelled or FRAME.unpack_from(log, position)[2:4] == salts
        position += FRAME.size + page_size
        if this_run:
            end = position
    return end if end < position else len(log)


def _sums(data: bytes, order: str, sums: tuple[int, int]) -> tuple[int, int]:
    """Continue the log's running check sums over `data`, whose length is a multiple of 8."""
    first, second = sums
    for a, b in struct.iter_unpack(order + "2I", data):
        first = (first + a + second) & 0xFFFFFFFF
        second = (second + b + first) & 0xFFFFFFFF
    return first, second
