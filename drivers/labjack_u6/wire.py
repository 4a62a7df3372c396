"""Bytes of the LabJack U6. Layout: LabJack, U6 User's Guide, section 5 (low-level function reference).

A packet is normal (short) or extended; an extended one carries a 16-bit sum over its data and an 8-bit sum over its
head. All numbers are little-endian. Six differential pairs, 0-1 to 10-11, read one gauge each at +-10 V.
"""

import struct
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.arrays import Array
from drivers.readings import Records
from drivers.transducer import DeviceFault, StatusBit, StatusTable, bit

_GAUGES = 6
SCANS = 4  # in a stream packet: whole scans, so that a lost packet does not shift the gauges
STREAM_PACKET = 14 + 2 * _GAUGES * SCANS  # bytes
HIGHEST_RATE = 8000  # scans a second; at its lowest resolution the converter makes 50 000 readings a second
_LIMIT = 10.0  # of a gauge's voltage [V]: beyond, and at the ends of the converter, it is saturated

STREAM_IS_OFF = 52  # answer to a stop when nothing streams
_DRAINING = 59  # error code of packets during recovery from an overflow: their scans are sound
_RECOVERED = 60  # error code of the packet that states how many scans an overflow cost
_DUMMY = 0xFFFF  # all six gauges of the scan that replaces the lost ones

START = bytes([0xA8, 0xA8])
STOP = bytes([0xB0, 0xB0])

_DIFFERENTIAL = 0x80
_ERRORS = {
    5: "function invalid",
    48: "a stream is active",
    49: "stream table invalid",
    50: "stream settings invalid",
    52: "no stream is active",
    54: "its buffer overflowed",
    55: "scans overlap: the rate is too high",
    56: "number of readings invalid",
    57: "gain invalid",
    58: "scan rate invalid",
    59: "recovering from an overflow",
    60: "recovered from an overflow",
    63: "recovery overflowed",
}


# Bit 8 + i of a status says that gauge i is at its limit; bits 0 to 7 are the error code of its packet.
STATUS_BITS = StatusTable(
    tuple(bit(8 + gauge, f"gauge {gauge} at its limit", "saturated") for gauge in range(_GAUGES))
    + tuple(StatusBit(0xFF, code, f"error {code}: {words}", "doubtful") for code, words in _ERRORS.items())
)


class Identity(NamedTuple):
    """Identity of a converter."""

    serial: int
    firmware: str
    pro: bool


class ScanClock(NamedTuple):
    """The converter's clock for a scan rate."""

    flags: int  # scan configuration byte
    interval: int  # ticks between two scans
    rate: float  # true rate [Hz]


@dataclass(frozen=True, slots=True)
class Constants:
    """Conversion of codes of the +-10 V range into volts (blocks 0 and 2 of the converter's memory)."""

    positive_slope: float  # [V]
    negative_slope: float  # [V], below zero
    centre: float  # code at 0 V

    def volts(self, codes: NDArray[np.uint16]) -> Array:
        """Return volts for codes of any shape.

        >>> nominal = Constants(3.1580578e-4, -3.158058e-4, 33523.0)
        >>> nominal.volts(np.array([0, 33523, 65535], np.uint16)).round(5).tolist()
        [-10.58676, 0.0, 10.10957]
        """
        above = codes.astype(np.float64) - self.centre
        return np.where(above < 0.0, -above * self.negative_slope, above * self.positive_slope)


def read_identity() -> bytes:
    """Return the request for the converter's identity (ConfigU6, writing nothing)."""
    return _extended_command(0x08, bytes(20))


def read_memory(block: int) -> bytes:
    """Return the request for four calibration constants."""
    return _extended_command(0x2D, bytes([0, block]))


def configure_stream(clock: ScanClock) -> bytes:
    """Return the request that configures scans of six differential gauges in turn at the clock's rate."""
    header = struct.pack("<6BH", _GAUGES, 1, _GAUGES * SCANS, 0, 0, clock.flags, clock.interval)
    return _extended_command(0x11, header + b"".join(bytes([2 * gauge, _DIFFERENTIAL]) for gauge in range(_GAUGES)))


def scan_clock(rate: float) -> ScanClock:
    """Return the clock nearest below a rate [Hz] from 3 to HIGHEST_RATE.

    >>> scan_clock(200), scan_clock(700).rate
    (ScanClock(flags=0, interval=20000, rate=200.0), 700.0350017500875)
    """
    if rate >= 732.43:
        flags, ticks = 0x08, 48_000_000.0
    elif rate >= 61.035:
        flags, ticks = 0x00, 4_000_000.0
    else:
        flags, ticks = 0x0A, 187_500.0
    interval = int(ticks / rate)
    return ScanClock(flags, interval, ticks / interval)


def parse_identity(answer: bytes) -> Identity:
    """Return the identity in an answer. Raises DeviceFault when the answer is invalid."""
    data = _data(answer, 0x08, 38)
    return Identity(int.from_bytes(data[9:13], "little"), f"{data[4]}.{data[3]:02d}", bool(data[31] & 0x08))


def parse_constants(positive: bytes, negative: bytes) -> Constants:
    """Return the constants in the answers for blocks 0 and 2. Raises DeviceFault when they are implausible."""
    slope, _, _, _ = _fixed_points(_data(positive, 0x2D, 40)[2:])
    negative_slope, centre, _, _ = _fixed_points(_data(negative, 0x2D, 40)[2:])
    # Within 5 % of the nominal values of the User's Guide: an unwritten memory gives zeros or ones.
    if not (abs(slope / 3.158e-4 - 1) < 0.05 and abs(negative_slope / -3.158e-4 - 1) < 0.05 and 3e4 < centre < 3.7e4):
        raise DeviceFault("the converter's memory holds no calibration constants; have LabJack restore them")
    return Constants(slope, negative_slope, centre)


def check_configuration(answer: bytes) -> None:
    """Raise DeviceFault unless the answer confirms a stream's settings."""
    _data(answer, 0x11, 8)


def normal_error(answer: bytes, command: int) -> int:
    """Return the error code of the answer to START (0xA9) or STOP (0xB1), 0 for none. Raises DeviceFault.

    >>> normal_error(bytes.fromhex("E5B13400"), 0xB1)
    52
    """
    if len(answer) != 4 or answer[1] != command or answer[0] != _sum8(answer[1:]):
        raise DeviceFault(f"the converter gave no answer that can be read to command {command - 1:#04x}")
    return answer[2]


def meaning(code: int) -> str:
    """Return an error code in words."""
    return _ERRORS.get(code, f"error {code}")


class StreamDecoder:
    """Cuts a stream's bytes into scans. `damaged` counts scans lost before each; never raises.

    The packet counter has 8 bits: a loss of 256 packets is invisible here and found by the numbering's clock.
    """

    def __init__(self, constants: Constants) -> None:
        self.malformed = 0  # scans in broken packets
        self._constants = constants
        self._bytes = bytearray()
        self._skipped = 0  # bytes outside packets
        self._next = 0  # packet counter expected
        self._lost = 0  # scans lost since the last one returned

    def feed(self, data: bytes) -> Records:
        """Take bytes and return every scan they complete: volts (n, 6), status (n,), scans lost before (n,)."""
        self._bytes += data
        scans: list[NDArray[np.uint16]] = []
        errors: list[int] = []
        damaged: list[int] = []
        for packet in self._packets():
            self._lost += SCANS * ((packet[10] - self._next) % 256)
            self._next = (packet[10] + 1) % 256
            for scan in np.frombuffer(packet, "<u2", _GAUGES * SCANS, 12).reshape(SCANS, _GAUGES):
                if packet[11] == _RECOVERED and np.all(scan == _DUMMY):
                    # The User's Guide: the number of lost scans includes this one.
                    self._lost += int.from_bytes(packet[6:8], "little")
                    continue
                scans.append(scan)
                errors.append(0 if packet[11] in (_DRAINING, _RECOVERED) else packet[11])
                damaged.append(self._lost)
                self._lost = 0
        codes = np.array(scans, np.uint16).reshape(-1, _GAUGES)
        volts = self._constants.volts(codes)
        full = (codes == 0) | (codes == 0xFFFF) | (np.abs(volts) >= _LIMIT)
        status = np.array(errors, np.int64) + (full * (1 << np.arange(8, 8 + _GAUGES))).sum(axis=1)
        return Records(volts, status, np.array(damaged, np.int64))

    def _packets(self) -> list[bytes]:
        """Take whole sound packets off the front; other bytes are skipped."""
        packets: list[bytes] = []
        prefix = bytes([0xF9, 4 + _GAUGES * SCANS, 0xC0])
        while True:
            position = self._bytes.find(prefix, 1)
            self._skip(position - 1 if position > 0 else max(len(self._bytes) - len(prefix), 0))
            if position < 0 or len(self._bytes) < STREAM_PACKET:
                return packets
            packet = bytes(self._bytes[:STREAM_PACKET])
            if not _is_sound(packet):
                self._skip(1)
                continue
            self._skipped = 0
            packets.append(packet)
            del self._bytes[:STREAM_PACKET]

    def _skip(self, count: int) -> None:
        """Drop bytes outside packets; each begun packet length of them counts as one packet's scans."""
        previous, self._skipped = self._skipped, self._skipped + count
        self.malformed += SCANS * (-(-self._skipped // STREAM_PACKET) - -(-previous // STREAM_PACKET))
        del self._bytes[:count]


def _data(answer: bytes, command: int, length: int) -> bytes:
    """Return the data of an extended answer from its error code on. Raises DeviceFault if it is invalid or refuses."""
    if answer[:2] == b"\xb8\xb8":
        raise DeviceFault("the converter found a request garbled; check the USB cable")
    if len(answer) != length or answer[3] != command or not _is_sound(answer):
        raise DeviceFault("the converter's answer cannot be read; check the USB cable")
    if answer[6]:
        raise DeviceFault(f"the converter refuses: {meaning(answer[6])}")
    return answer[6:]


def _fixed_points(data: bytes) -> tuple[float, ...]:
    """Return four numbers of 32.32 bits, signed."""
    return tuple(value / 2**32 for value in struct.unpack("<4q", data))


def _extended_command(command: int, data: bytes) -> bytes:
    header = struct.pack("<3BH", 0xF8, len(data) // 2, command, sum(data) & 0xFFFF)
    return bytes([_sum8(header)]) + header + data


def _is_sound(packet: bytes) -> bool:
    """Say whether both sums of an extended packet are right."""
    return packet[0] == _sum8(packet[1:6]) and packet[4:6] == (sum(packet[6:]) & 0xFFFF).to_bytes(2, "little")


def _sum8(data: bytes) -> int:
    """Return the sum of bytes with every carry added back in.

    >>> hex(_sum8(bytes.fromhex("F80A080000")))
    '0xb'
    """
    total = sum(data)
    while total > 0xFF:
        total = (total & 0xFF) + (total >> 8)
    return total
