"""Records and commands of the stand-alone force/torque controller (manuals 9620-05-CTL and 9610-05-1001).

The manuals themselves were not available: layouts are those that four published drivers agree on. The meaning of error
digits other than 0 (good), and the exact text of the start-up banner, are not verified.
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
SETTINGS = (  # besides the output format
    b"CD R",  # resolved forces and torques
    b"CD U",  # no checksum: its algorithm is not verified
    b"CV 3F",  # all six axes
    b"SA 0",  # no moving average
    b"SM 1",  # sensor errors are monitored
    b"SZ",  # all biases removed: raw values stay raw
)
PROMPT = b">"
RETURN = b"\r"

ASCII_SIZE = 45  # bytes of a record: error digit, six integers of width 6 after a comma each, CR, LF
BINARY_SIZE = 13  # error byte, six integers Fx Fy Fz Tx Ty Tz

_BINARY = np.dtype([("error", "u1"), ("values", ">i2", 6)])
_WIDTH = 6  # characters of an integer in text
_ASCII_RECORD = re.compile(rb"([0-9])" + rb",( *-?[0-9]+)" * 6)
_MOST_ERROR = 9  # of an error byte, which is a digit
STATUS_BITS = StatusTable(
    tuple(StatusBit(0xFF, n, f"error digit {n}: saturated or sensor error", "saturated") for n in range(1, 10))
)
_ACKNOWLEDGED = b"\x06\r\n>"  # after the record of an answer to QR in binary
_NEAR = 4  # records judged together while values are steady
_STEADY = 160  # summed change of their values below which they are accepted [counts]
_WINDOW = 9 * BINARY_SIZE - 1  # bytes judged together otherwise: eight records at any offset
_DOUBT = 8  # records after a break that need confirmation
_AWAY = 450  # largest summed change of values for a record near a break [counts]
_BREAK = 6.0  # least gain of a break between records, see _best_shift


class AsciiDecoder:
    """Records as lines of text. A line of another form is a broken record."""

    def __init__(self) -> None:
        self.malformed = 0
        self._buffer = bytearray()
        self._damaged = 0  # broken records since the last good one

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
        """Count `size` bytes outside records as the least number of broken records."""
        count = -(-size // ASCII_SIZE)
        self.malformed += count
        self._damaged += count


class BinaryDecoder:
    """Decodes records without delimiters or checksum, whose position must be tracked with care.

    Of all divisions of the bytes into records, with few breaks, the one is chosen whose error bytes are digits and
    whose values best continue the last reading. A break means lost bytes: these and the adjacent records count as
    broken. This is no proof: in a trial at rest, 5 of 100 randomly torn records left a wrong reading. Changed bytes,
    or a loss of exactly one record's bytes, are invisible. On a line that loses bytes, text output is safer.
    """

    def __init__(self) -> None:
        """Expect the first record at the first byte."""
        self.malformed = 0
        self._buffer = bytearray()
        self._position = 0  # expected position of the next record in it
        self._doubt = 0  # next records after a break that count only if later ones agree
        self._skipped = 0  # bytes outside records since the last good one
        self._last: Indices | None = None  # values of the last good record

    def feed(self, data: bytes) -> Records:
        """Take bytes and return every record that can be judged, with three to eight more after it."""
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
        """Return the number of bytes before the next record; None while more bytes are needed."""
        window = bytes(self._buffer[self._position : self._position + _WINDOW])
        if len(window) < _NEAR * BINARY_SIZE:
            return None
        near = np.frombuffer(window, _BINARY, _NEAR)
        digits = int(near["error"].max()) <= _MOST_ERROR
        if digits and self._last is not None and int(np.abs(near["values"] - self._last).sum()) <= _STEADY:
            return 0
        return _best_shift(self._gains(window)) if len(window) == _WINDOW else None

    def _is_doubtful(self, values: Indices) -> bool:
        """Say whether a record after a break may be spliced from two: the first one, and any with distant values."""
        away = 0 if self._last is None else int(np.abs(values - self._last).sum())
        return self._doubt == _DOUBT or (self._doubt > 0 and away > _AWAY)

    def _gains(self, window: bytes) -> list[float]:
        """Return the gain of a record at each byte of `window` after the last good one; -inf where none is possible."""
        bytes_ = np.lib.stride_tricks.sliding_window_view(np.frombuffer(window, np.uint8), BINARY_SIZE)
        values = bytes_[:, 1::2].astype(np.int8) * np.int64(256) + bytes_[:, 2::2]
        away = np.abs(values - (values if self._last is None else self._last)).sum(axis=1)
        return np.where(bytes_[:, 0] <= _MOST_ERROR, _gain(away), -np.inf).tolist()


def _gain(away: ArrayLike) -> Array:
    """Return the gain of a record at a distance from the last good one [counts]: at least 3."""
    return 16.0 - np.log2(1.0 + np.asarray(away, np.float64) / 64.0)


def _best_shift(gains: list[float]) -> int:
    """Return the number of bytes to skip for the greatest sum of `gains` over consecutive records.

    Each skip between records costs _BREAK. A record always has a positive gain, so one in its place is never dropped
    for being unlike the others, except shortly before a break. The last one before a break is always dropped: its own
    end may be among the lost bytes.
    """
    size = len(gains)
    value = [0.0] * (size + BINARY_SIZE)  # greatest sum from a byte on
    skip_value = [0.0] * (size + 1)  # the same with that byte skipped
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
    """Say whether `answer` to QR contains a whole record of the expected form and ends with the prompt."""
    if binary:
        record = answer[: -len(_ACKNOWLEDGED)][-BINARY_SIZE:]
        return answer.endswith(_ACKNOWLEDGED) and len(record) == BINARY_SIZE and record[0] <= _MOST_ERROR
    return answer.rstrip().endswith(PROMPT) and any(_ascii_values(line) for line in answer.splitlines(keepends=True))


def _ascii_values(line: bytes) -> tuple[int, ...] | None:
    r"""Return error digit and six values of a line, or None where it is not a record.

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
