"""Records and commands of the stand-alone force/torque controller (manuals 9620-05-CTL and 9610-05-1001).

The manuals themselves were not at hand: layouts are those that four published drivers agree on. What the error
digits mean beyond 0 (good), and the exact text of the start-up banner, is not verified.
"""

import re

import numpy as np
from numpy.typing import ArrayLike

from drivers.arrays import Array, Indices
from drivers.readings import Records
from drivers.transducer import StatusBit, StatusTable

WARM_START = b"\x17"  # ^W
ASCII_OUTPUT = b"CD A"
BINARY_OUTPUT = b"CD B"
ONE_RECORD = b"QR"
STREAM = b"QS"  # until any CR
SETTINGS = (  # beside the output format
    b"CD R",  # resolved forces and torques
    b"CD U",  # no checksum: its algorithm is not verified
    b"CV 3F",  # all six axes
    b"SA 0",  # no moving average
    b"SM 1",  # sensor errors are monitored
    b"SZ",  # every bias dropped: raw stays raw
)
PROMPT = b">"
RETURN = b"\r"

ASCII_SIZE = 45  # bytes of a record: error digit, six integers of width 6 after a comma each, CR, LF
BINARY_SIZE = 13  # error byte, six integers Fx Fy Fz Tx Ty Tz

_BINARY = np.dtype([("error", "u1"), ("values", ">i2", 6)])
_WIDTH = 6  # characters of an integer in text
_ASCII_RECORD = re.compile(rb"([0-9])" + rb",( *-?[0-9]+)" * 6)
_MOST_ERROR = 9  # of an error byte: it stands for one digit
STATUS_BITS = StatusTable(
    tuple(StatusBit(0xFF, n, f"error digit {n}: saturated or sensor error", "saturated") for n in range(1, 10))
)
_ACKNOWLEDGED = b"\x06\r\n>"  # after the record of an answer to QR in binary
_NEAR = 4  # records that are looked at together where all is steady
_STEADY = 160  # summed change of their values below which no further proof is asked [counts]
_WINDOW = 9 * BINARY_SIZE - 1  # bytes that are looked at otherwise: eight records in any place
_DOUBT = 8  # records behind a break that must prove themselves
_AWAY = 450  # summed change of values that is too much for a record near a break [counts]
_BREAK = 6.0  # what a break between records must gain at the least, see _best_shift


class AsciiDecoder:
    """Records as lines of text. A line of any other form is a broken record."""

    def __init__(self) -> None:
        self.malformed = 0
        self._buffer = bytearray()
        self._damaged = 0  # records broken since the last good one

    def feed(self, data: bytes) -> Records:
        self._buffer += data
        raw: list[tuple[int, ...]] = []
        status: list[int] = []
        damaged: list[int] = []
        *lines, remainder = self._buffer.split(b"\n")
        for line in lines:
            values = _ascii_values(bytes(line) + b"\n")
            if values is None:
                self._spoil(len(line) + 1)
                continue
            status.append(values[0])
            raw.append(values[1:])
            damaged.append(self._damaged)
            self._damaged = 0
        while len(remainder) > 2 * ASCII_SIZE:  # garbage without any line end
            del remainder[:ASCII_SIZE]
            self._spoil(ASCII_SIZE)
        self._buffer = remainder
        return Records.of(raw, status, damaged)

    def _spoil(self, size: int) -> None:
        """Count `size` bytes that are no record as the records they were at the least."""
        count = -(-size // ASCII_SIZE)
        self.malformed += count
        self._damaged += count


class BinaryDecoder:
    """Records as bytes without any mark or checksum, so that their place must be kept with care.

    Among all ways to cut the bytes into records, with few breaks, the one is believed whose error bytes are digits
    and whose values go on best from the last reading. Where that breaks, bytes were lost: they and the records next
    to them are broken. This is not proof: of records torn at random, 5 in 100 left a wrong reading behind in a trial
    at rest, and changed bytes, or a loss of exactly as many bytes as a record has, cannot be seen at all. The format
    has no means; on a line that loses bytes, text output is the safer one.
    """

    def __init__(self) -> None:
        """Expect the first record to begin with the first byte."""
        self.malformed = 0
        self._buffer = bytearray()
        self._position = 0  # where the next record is expected in it
        self._doubt = 0  # next records that, close behind a break, count only once later ones agree
        self._skipped = 0  # bytes since the last good record that belong to none
        self._last: Indices | None = None  # values of the last good record

    def feed(self, data: bytes) -> Records:
        """Take what arrived and return every record that can be judged: one that three to eight more follow."""
        self._buffer += data
        records: list[tuple[int, ...]] = []
        status: list[int] = []
        damaged: list[int] = []
        self._position = 0
        while (shift := self._shift()) is not None:
            record = np.frombuffer(bytes(self._buffer[self._position : self._position + BINARY_SIZE]), _BINARY)
            values = record["values"][0].astype(np.int64)
            if not shift and self._is_doubtful(values):
                shift = BINARY_SIZE
                self._doubt -= 1
            elif shift:
                self._doubt = _DOUBT
            if shift:
                self._skipped += shift
                self._position += shift
                continue
            self._doubt = max(self._doubt - 1, 0)
            self._last = values
            loss = -(-self._skipped // BINARY_SIZE)
            self.malformed += loss
            self._skipped = 0
            records.append(tuple(values.tolist()))
            status.append(int(record["error"][0]))
            damaged.append(loss)
            self._position += BINARY_SIZE
        del self._buffer[: self._position]
        return Records.of(records, status, damaged)

    def _shift(self) -> int | None:
        """Return how many bytes at the head belong to no record; None while more bytes must come to tell."""
        window = bytes(self._buffer[self._position : self._position + _WINDOW])
        if len(window) < _NEAR * BINARY_SIZE:
            return None
        near = np.frombuffer(window, _BINARY, _NEAR)
        digits = int(near["error"].max()) <= _MOST_ERROR
        if digits and self._last is not None and int(np.abs(near["values"] - self._last).sum()) <= _STEADY:
            return 0
        return _best_shift(self._gains(window)) if len(window) == _WINDOW else None

    def _is_doubtful(self, values: Indices) -> bool:
        """Tell whether a record behind a break may be pieced together from two: the first, and what is too far off."""
        away = 0 if self._last is None else int(np.abs(values - self._last).sum())
        return self._doubt == _DOUBT or (self._doubt > 0 and away > _AWAY)

    def _gains(self, window: bytes) -> list[float]:
        """Return how well a record at each byte of `window` goes on from the last good one; -inf where none is."""
        bytes_ = np.lib.stride_tricks.sliding_window_view(np.frombuffer(window, np.uint8), BINARY_SIZE)
        values = bytes_[:, 1::2].astype(np.int8) * np.int64(256) + bytes_[:, 2::2]
        away = np.abs(values - (values if self._last is None else self._last)).sum(axis=1)
        return np.where(bytes_[:, 0] <= _MOST_ERROR, _gain(away), -np.inf).tolist()


def _gain(away: ArrayLike) -> Array:
    """Return what a record is worth that lies so far from the last good one [counts]: 3 at the very least."""
    return 16.0 - np.log2(1.0 + np.asarray(away, np.float64) / 64.0)


def _best_shift(gains: list[float]) -> int:
    """Return how many bytes to skip for the greatest sum of `gains` over records that follow each other.

    Whenever bytes are skipped between records, _BREAK is taken off. A record always gains more than nothing, so that
    one in its place is never thrown away for being unlike the others. But shortly before a break it is, and the last
    one before it in any case: its own end may be among the bytes that were lost.
    """
    size = len(gains)
    value = [0.0] * (size + BINARY_SIZE)  # the best that can be made of all from a byte on
    skip_value = [0.0] * (size + 1)  # the same, with that byte skipped
    for i in range(size - 1, -1, -1):
        skip_value[i] = max(skip_value[i + 1], gains[i + 1] + value[i + 1 + BINARY_SIZE] if i + 1 < size else 0.0)
        value[i] = max(gains[i] + value[i + BINARY_SIZE], skip_value[i] - _BREAK)

    def breaks(position: int) -> bool:
        return gains[position] + value[position + BINARY_SIZE] < skip_value[position] - _BREAK

    if not breaks(0):
        stop = next((position for position in range(BINARY_SIZE, size, BINARY_SIZE) if breaks(position)), size)
        doubtful = stop == BINARY_SIZE or (stop < size and gains[0] < _gain(_AWAY))
        return BINARY_SIZE if doubtful else 0
    shift = 1
    while shift < BINARY_SIZE and gains[shift] + value[shift + BINARY_SIZE] < skip_value[shift - 1]:
        shift += 1
    return shift


def answered_record(answer: bytes, *, binary: bool) -> bool:
    """Tell whether `answer` to QR holds one whole record of the expected form and ends with the prompt."""
    if binary:
        record = answer[: -len(_ACKNOWLEDGED)][-BINARY_SIZE:]
        return answer.endswith(_ACKNOWLEDGED) and len(record) == BINARY_SIZE and record[0] <= _MOST_ERROR
    return answer.rstrip().endswith(PROMPT) and any(_ascii_values(line) for line in answer.splitlines(keepends=True))


def _ascii_values(line: bytes) -> tuple[int, ...] | None:
    r"""Return error digit and six values of a line, or None where it is no record.

    >>> _ascii_values(b"0,  -102,   -99,  -225,   -20,    39,   -39\r\n")
    (0, -102, -99, -225, -20, 39, -39)
    """
    if len(line) != ASCII_SIZE or not line.endswith(b"\r\n"):
        return None
    match = _ASCII_RECORD.fullmatch(line[:-2])
    if match is None or any(len(group) != _WIDTH for group in match.groups()[1:]):
        return None
    values = tuple(int(group) for group in match.groups())
    return values if all(-32768 <= value <= 32767 for value in values) else None
