"""Datagrams and commands of the networked force/torque box, and of the Ethernet Axia where it differs.

Layouts: maker's manuals 9620-05-NET FT (chapters 10 and 11, section 15.2) and 9610-05-Ethernet Axia (chapter 10).
"""

import itertools
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.transducer import StatusTable, bit

_REQUEST = struct.Struct(">HHI")  # header, command, number of records (0: until stopped)
_HEADER = 0x1234

STOP = _REQUEST.pack(_HEADER, 0x0000, 0)
START = _REQUEST.pack(_HEADER, 0x0002, 0)  # one record in a datagram, until stopped
START_BUFFERED = _REQUEST.pack(_HEADER, 0x0003, 0)  # as many records in a datagram as set in the box

READ_WRENCH = bytes(20)  # commands of the TCP port
SET_BIAS = bytes(19) + b"\x01"  # the present load becomes zero
RESET_LATCH = bytes(19) + b"\x02"  # of the monitor condition
READ_UNITS = b"\x01" + bytes(19)
_WRENCH = struct.Struct(">HH6h")
_UNITS = struct.Struct(">HBBII6H")

RECORD = np.dtype(
    [
        ("number", ">u4"),  # 1 for the first record after each start, then one more each
        ("counter", ">u4"),  # ticks of the box's own sampling since power-up
        ("status", ">u4"),
        ("counts", ">i4", 6),  # Fx Fy Fz Tx Ty Tz
    ]
)
COUNTER_RATE = 7000.0  # ticks a second, good to 0.5 % [Hz]

_SUMMARY = 1 << 31  # set with any error bit

# A monitor condition is latched when a threshold set by the user is crossed. Sources disagree whether the summary bit
# accompanies it: both forms are a note. Everything else is doubtful, as in the most careful published client.
_NET_FT = (
    bit(30, "processor or memory fault", "doubtful"),
    bit(29, "digital board fault", "doubtful"),
    bit(28, "analogue board fault", "doubtful"),
    bit(27, "serial link communication error", "doubtful"),
    bit(26, "program memory verification error", "doubtful"),
    bit(25, "halted by configuration errors", "doubtful"),
    bit(24, "settings failed validation", "doubtful"),
    bit(23, "configuration does not fit the calibration", "doubtful"),
    bit(22, "network communication error", "doubtful"),
    bit(21, "CAN error", "doubtful"),
    bit(20, "RDT communication error", "doubtful"),
    bit(19, "EtherNet/IP error", "doubtful"),
    bit(18, "DeviceNet error", "doubtful"),
    bit(17, "transducer saturated or converter error", "saturated"),
    bit(16, "monitor condition latched", "note"),
    bit(14, "watchdog timeout", "doubtful"),
    bit(13, "stack check failed", "doubtful"),
    bit(12, "serial EEPROM error", "doubtful"),
    bit(11, "serial flash error", "doubtful"),
    bit(10, "analogue board watchdog timeout", "doubtful"),
    bit(9, "gauge excitation current too high", "doubtful"),
    bit(8, "gauge excitation current too low", "doubtful"),
    bit(7, "artificial analogue ground out of range", "doubtful"),
    bit(6, "analogue supply too high", "doubtful"),
    bit(5, "analogue supply too low", "doubtful"),
    bit(4, "serial link data unavailable", "doubtful"),
    bit(3, "reference voltage error", "doubtful"),
    bit(2, "internal temperature error", "doubtful"),
    bit(1, "HTTP error", "doubtful"),
)
_AXIA = (
    bit(30, "force or torque out of range", "saturated"),
    bit(29, "calibration checksum error", "doubtful"),
    bit(28, "simulated error", "note"),
    bit(27, "gauge out of range", "saturated"),
    bit(16, "monitor condition latched", "note"),
    bit(7, "calibration not accessible", "doubtful"),
    bit(5, "other error", "doubtful"),
    bit(3, "busy", "note"),
    bit(2, "broken gauge", "doubtful"),
    bit(1, "supply outside 12 to 32 V", "doubtful"),
    bit(0, "temperature outside -5 to 70 °C", "doubtful"),
)


NET_FT, AXIA = StatusTable(_NET_FT, _SUMMARY), StatusTable(_AXIA, _SUMMARY)  # the boxes with this protocol


@dataclass(frozen=True, slots=True, eq=False)
class DecodedBatch:
    """A decoded batch of datagrams: n records, and the number of malformed datagrams."""

    records: NDArray[np.void]  # (n,) of RECORD
    origin: NDArray[np.intp]  # (n,) datagram of each record
    malformed: int  # datagrams of a wrong length


def decode(datagrams: Sequence[bytes]) -> DecodedBatch:
    """Return the records of `datagrams`, one or more whole records in each. Raises nothing."""
    size = RECORD.itemsize
    counts = [0 if len(datagram) % size else len(datagram) // size for datagram in datagrams]
    records = np.frombuffer(b"".join(itertools.compress(datagrams, counts)), RECORD)
    return DecodedBatch(records, np.repeat(np.arange(len(counts)), counts), counts.count(0))


def parse_wrench(answer: bytes) -> tuple[int, ...] | None:
    """Return the six 16-bit counts in an answer to READ_WRENCH, SET_BIAS or RESET_LATCH; None if it is invalid."""
    if len(answer) != _WRENCH.size or answer[:2] != _HEADER.to_bytes(2, "big"):
        return None
    return _WRENCH.unpack(answer)[2:]


def is_latched(answer: bytes) -> bool:
    """Say whether the status in such an answer, an upper half, shows a latched condition.

    >>> is_latched(bytes.fromhex("1234 8001" + "0000" * 6)), is_latched(bytes.fromhex("1234 0000" + "0000" * 6))
    (True, False)
    """
    return len(answer) == _WRENCH.size and bool(_WRENCH.unpack(answer)[1] & 1)


@dataclass(frozen=True, slots=True)
class Units:
    """Units of the TCP port."""

    counts_per_force: int
    counts_per_torque: int
    scales: tuple[int, ...]  # full counts in one 16-bit count of each axis


def parse_units(answer: bytes) -> Units | None:
    """Return the units in an answer to READ_UNITS, None if it is invalid.

    >>> parse_units(bytes.fromhex("1234 02 03 000F4240 000F4240 05DC 05DC 05DC 000A 000A 000A"))
    Units(counts_per_force=1000000, counts_per_torque=1000000, scales=(1500, 1500, 1500, 10, 10, 10))
    """
    if len(answer) != _UNITS.size or answer[:2] != _HEADER.to_bytes(2, "big"):
        return None
    _, _, _, per_force, per_torque, *scales = _UNITS.unpack(answer)
    return Units(per_force, per_torque, tuple(scales))
