"""Modbus frames, calibration registers and stream packets of the RS-485 transducer (manual 9620-05-Digital FT, ch. 8).

The manual itself was not available: layouts are those of a published driver that cites it. Codes of units in a
calibration are assumed to be those of the networked box; that is not verified either.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.arrays import Indices, Mask
from drivers.calibration import Calibration
from drivers.notation import FORCE, TORQUE
from drivers.readings import Records
from drivers.transducer import SetupError, StatusTable, bit

ADDRESS = 10
READ, WRITE, START_STREAM, UNLOCK = 0x03, 0x10, 0x46, 0x6A  # function codes
START_KEY, UNLOCK_KEY, LOCK_KEY = 0x55, 0xAA, 0x18
MOST_REGISTERS = 64  # in one request

GAINS_AND_OFFSETS = 0x0000  # in force: six gains, then six offsets
STATUS = 0x001D
CALIBRATIONS = 16
CALIBRATION_SIZE = 133  # registers
_FIRST_CALIBRATION, _CALIBRATION_STEP = 0x00E3, 192

JAM = bytes(72)  # sent into a stream to end it; reportedly at least 14 bytes are needed; their value is not verified

STREAM_RATE = 7000.0  # packets a second, good to 0.5 % [Hz]
PACKET_SIZE = 13
STATUS_FLAG = 0x80  # in a packet: the status word is not 0
GAUGE_AT_END = 0x100  # added to the status here: a gauge is at the end of its range, so all six values are invalid

_EXCEPTION = 0x80
_REASONS = {1: "illegal function", 2: "illegal address", 3: "illegal value", 4: "device failure"}
_MEANING = {  # of the status word
    0: "watchdog reset",
    1: "excitation too high",
    2: "excitation too low",
    3: "artificial ground out of range",
    4: "supply too high",
    5: "supply too low",
    7: "EEPROM error",
    8: "invalid configuration",
    9: "gauge supply current too high",
    10: "gauge supply current too low",
    11: "thermistor too high",
    12: "thermistor too low",
    13: "converter reading out of range",
}
_WORD_AT = 16  # a flagged reading has the status word of the stream's start from this bit on
STATUS_BITS = StatusTable(
    (
        bit(8, "a gauge at the end of its range", "saturated"),
        *(bit(_WORD_AT + number, words, "doubtful") for number, words in _MEANING.items()),
        bit(7, "error flag: the status word is not 0", "doubtful"),
    )
)
_FORCE = dict(enumerate(map(FORCE.get, ("lb", "N", "klb", "kN", "kg", "g")), 1))  # by code
_TORQUE = dict(enumerate(map(TORQUE.get, ("lbin", "lbft", "Nm", "Nmm", "kgcm", "kNm")), 1))
_ORDER = (0, 3, 1, 4, 2, 5)  # of the gauges: positions of G0 to G5 in a packet
_CALIBRATION = struct.Struct(">8s32s4s20s36fBB6fii6H6H")
_PROOF = 6  # sound packets in a row that confirm a new position


@dataclass(frozen=True, slots=True)
class StoredCalibration:
    """One of the calibrations stored in the transducer."""

    calibration: Calibration  # raw unit: counts of the six gauges
    part_number: str
    calibrated: str  # when, as stored
    gains_and_offsets: bytes  # of the gauges, as registers; to be applied with this calibration


def crc16(data: bytes) -> int:
    """Return the checksum of a Modbus RTU frame (Modbus over serial line 1.02, section 6.2.2).

    >>> hex(crc16(bytes.fromhex("0A 46 55")))
    '0x9da3'
    """
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def request(function: int, data: bytes) -> bytes:
    """Return the frame that asks for `function`."""
    return _with_crc(bytes([ADDRESS, function]) + data)


def read_registers(first: int, count: int) -> bytes:
    """Return the request for `count` registers from `first`."""
    return request(READ, struct.pack(">HH", first, count))


def write_registers(first: int, registers: bytes) -> bytes:
    """Return the request to write `registers`, two bytes each, from `first`."""
    return request(WRITE, struct.pack(">HHB", first, len(registers) // 2, len(registers)) + registers)


def answer_in(response: bytes, request: bytes) -> bytes | str | None:
    """Return the data of the answer to `request`, anywhere in `response`; None while it is missing.

    For a read these are the registers' bytes, else the bytes after the function code. A text gives the reason where the
    transducer understood and refuses. Raises nothing.
    """
    function = request[1]
    size, prefix = 5, bytes([ADDRESS, function])
    if function == READ:
        size, prefix = 5 + 2 * request[5], bytes([ADDRESS, READ, 2 * request[5]])
    elif function == WRITE:
        size, prefix = 8, request[:6]
    for frame in _frames(response, prefix, size):
        if frame != request:  # an adapter may echo the request
            return frame[3:-2] if function == READ else frame[2:-2]
    for frame in _frames(response, bytes([ADDRESS, function | _EXCEPTION]), 5):
        return _REASONS.get(frame[2], f"exception {frame[2]}")
    return None


def calibration_address(number: int) -> int:
    """Return the first register of calibration `number`, 1 to 16."""
    return _FIRST_CALIBRATION + _CALIBRATION_STEP * (number - 1)


def parse_calibration(registers: bytes) -> StoredCalibration:
    """Parse the registers of a calibration. Raises SetupError, half a sentence, where they are invalid."""
    serial, part_field, _, day, *numbers = _CALIBRATION.unpack(registers)
    basic = np.array(numbers[:36], np.float64).reshape(6, 6)
    force, torque = _FORCE.get(numbers[36]), _TORQUE.get(numbers[37])
    ratings = np.array(numbers[38:44], np.float64)
    counts = numbers[44:46]
    name = _text(serial)
    if not name:
        raise SetupError("holds no serial number: it is empty; choose another one")
    if force is None or torque is None:
        raise SetupError(f"gives units as codes {numbers[36]} and {numbers[37]}, which are unknown here")
    units = np.repeat([force, torque], 3)
    with np.errstate(all="ignore"):
        matrix = basic * (units / np.repeat(np.maximum(counts, 0), 3))[:, None]
        sound = bool(np.all(np.isfinite(matrix))) and np.linalg.matrix_rank(matrix) == 6
    if not sound:
        raise SetupError("holds a matrix that does not tell forces and torques apart; have the transducer calibrated")
    rated = np.where(np.isfinite(ratings) & (ratings > 0.0), ratings, np.nan) * units
    day_text, part_text = _text(day), _text(part_field)
    source = f"registers of the transducer: {part_text}, calibrated {day_text or 'on a day not stated'}"
    calibration = Calibration(name, "counts", matrix, rated, source)
    return StoredCalibration(calibration, part_text, day_text, registers[2 * 121 :])


def status_words(status: int) -> tuple[str, ...]:
    """Return the meanings of the set bits of the status word.

    >>> status_words(0b100010)
    ('excitation too high', 'supply too low')
    """
    return tuple(_MEANING.get(number, f"unknown bit {number}") for number in range(16) if status >> number & 1)


class StreamDecoder:
    """Decodes packets without delimiters: their position is found and tracked by their checksums.

    A seven-bit checksum lets one wrong position in 128 pass. So a position is first accepted only when several packets
    in a row are sound, and later a packet is a reading only when the next one is sound too. Where a multiple of 13
    bytes is lost inside packets, one splice in 128 still passes as a reading.
    """

    def __init__(self, word: int = 0) -> None:
        """Start in search. `word` is the status word last read before the stream."""
        self.malformed = 0
        self._flagged = STATUS_FLAG | word << _WORD_AT
        self._buffer = b""
        self._in_step = False
        self._skipped = 0  # bytes since the last sound packet

    def feed(self, data: bytes) -> Records:
        self._buffer += data
        batches: list[NDArray[np.uint8]] = []
        damaged: list[Indices] = []
        while (count := len(self._buffer) // PACKET_SIZE) >= (least := 2 if self._in_step else _PROOF):
            packets = np.frombuffer(self._buffer, np.uint8, count * PACKET_SIZE).reshape(count, PACKET_SIZE)
            sound = _sound(packets)
            good = count if sound.all() else int(np.argmin(sound))
            if good < least:
                self._in_step = False
                self._skip()
                continue
            first = 1 if self._skipped else 0  # the first after a break may be spliced from two
            loss = -(-self._skipped // PACKET_SIZE) + first
            self.malformed += loss
            self._skipped = 0
            batches.append(packets[first : good - 1])
            damaged.append(np.concatenate([[loss], np.zeros(good - 2 - first, np.int64)]))
            self._buffer = self._buffer[(good - 1) * PACKET_SIZE :]
            self._in_step = True
        if not batches:
            return Records.of([], [], [])
        packets = np.concatenate(batches)
        gauges = np.ascontiguousarray(packets[:, :12]).view(">i2")[:, _ORDER].astype(np.float64)
        at_end = np.any(np.abs(gauges + 0.5) >= 32767.0, axis=1)
        status = np.where(packets[:, 12] & STATUS_FLAG, self._flagged, 0) + np.where(at_end, GAUGE_AT_END, 0)
        return Records(gauges, status.astype(np.int64), np.concatenate(damaged))

    def _skip(self) -> None:
        """Drop bytes up to the next position of a possibly sound packet in the buffer."""
        data = np.frombuffer(self._buffer, np.uint8)
        windows = np.lib.stride_tricks.sliding_window_view(data[1:], PACKET_SIZE)
        sound = _sound(windows)
        skip = 1 + int(np.argmax(sound)) if sound.any() else 1 + len(windows)
        self._skipped += skip
        self._buffer = self._buffer[skip:]


def _sound(packets: NDArray[np.uint8]) -> Mask:
    """Mark the packets (n, 13) whose checksum is right."""
    return packets[:, :12].sum(axis=1, dtype=np.uint32) & 0x7F == packets[:, 12] & 0x7F


def _with_crc(frame: bytes) -> bytes:
    return frame + struct.pack("<H", crc16(frame))


def _frames(response: bytes, prefix: bytes, size: int) -> Iterator[bytes]:
    """Yield the sound frames of `size` bytes in `response` that begin with `prefix`."""
    position = response.find(prefix)
    while 0 <= position <= len(response) - size:
        frame = response[position : position + size]
        if _with_crc(frame[:-2]) == frame:
            yield frame
        position = response.find(prefix, position + 1)


def _text(field: bytes) -> str:
    """Return stored text without padding and unprintable characters."""
    plain = field.split(b"\0")[0].decode("ascii", "replace")
    return "".join(character for character in plain if character.isprintable() and character != "\ufffd").strip()
