"""Datagrams and commands of the networked force/torque box, and of the Ethernet Axia where it differs.

Layouts: maker's manuals 9620-05-NET FT (chapters 10 and 11, section 15.2) and 9610-05-Ethernet Axia (chapter 10).
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_REQUEST = struct.Struct(">HHI")  # header, command, number of records (0: until stopped)
_HEADER = 0x1234

STOP = _REQUEST.pack(_HEADER, 0x0000, 0)
START = _REQUEST.pack(_HEADER, 0x0002, 0)  # one record a datagram, until stopped
START_BUFFERED = _REQUEST.pack(_HEADER, 0x0003, 0)  # as many records a datagram as the box is set to

READ_WRENCH = bytes(20)  # commands of the TCP port
SET_BIAS = bytes(19) + b"\x01"  # what is felt now reads as zero from then on
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

SUMMARY = 1 << 31  # some bit is an error

_NET_FT = {
    30: "processor or memory fault",
    29: "digital board fault",
    28: "analogue board fault",
    27: "serial link communication error",
    26: "program memory verification error",
    25: "halted by configuration errors",
    24: "settings failed validation",
    23: "configuration does not fit the calibration",
    22: "network communication error",
    21: "CAN error",
    20: "RDT communication error",
    19: "EtherNet/IP error",
    18: "DeviceNet error",
    17: "transducer saturated or converter error",
    16: "monitor condition latched",  # a threshold the user set was crossed: no fault by itself
    14: "watchdog timeout",
    13: "stack check failed",
    12: "serial EEPROM error",
    11: "serial flash error",
    10: "analogue board watchdog timeout",
    9: "gauge excitation current too high",
    8: "gauge excitation current too low",
    7: "artificial analogue ground out of range",
    6: "analogue supply too high",
    5: "analogue supply too low",
    4: "serial link data unavailable",
    3: "reference voltage error",
    2: "internal temperature error",
    1: "HTTP error",
}


_AXIA = {
    30: "force or torque out of range",
    29: "calibration checksum error",
    28: "simulated error",
    27: "gauge out of range",
    16: "monitor condition latched",
    7: "calibration not accessible",
    5: "other error",
    3: "busy",
    2: "broken gauge",
    1: "supply outside 12 to 32 V",
    0: "temperature outside -5 to 70 °C",
}


@dataclass(frozen=True, slots=True)
class Family:
    """What differs between the boxes that speak this wire."""

    name: str
    invalid: int  # status bits that make the six values of a record invalid
    harmless: int  # status bits that say nothing against the six values
    meaning: Mapping[int, str]  # of each status bit

    def words(self, status: int) -> tuple[str, ...]:
        """Return what the set bits of a status word mean, the gravest first; nothing when the box is healthy.

        >>> NET_FT.words(0x80020000)
        ('transducer saturated or converter error',)
        """
        bits = [bit for bit in range(30, -1, -1) if status >> bit & 1]
        words = tuple(self.meaning.get(bit, f"unknown bit {bit}") for bit in bits)
        return words or (("unnamed error",) if status & SUMMARY else ())


# Whether the summary bit comes with a latched condition is not agreed on: both forms are taken to mean no harm.
NET_FT = Family("Net F/T", 1 << 17, 1 << 16, _NET_FT)
AXIA = Family("Ethernet Axia", 1 << 30 | 1 << 27 | 1 << 2, 1 << 28 | 1 << 16 | 1 << 3, _AXIA)


@dataclass(frozen=True, slots=True, eq=False)
class Decoded:
    """What a batch of datagrams held: n records and some datagrams that are none."""

    records: NDArray[np.void]  # (n,) of RECORD
    origin: NDArray[np.intp]  # (n,) the datagram each came in
    malformed: int  # datagrams of a length that no record has


def decode(datagrams: Sequence[bytes]) -> Decoded:
    """Return the records of `datagrams`, one or several whole ones in each. Raises nothing."""
    size = RECORD.itemsize
    counts = [0 if len(datagram) % size else len(datagram) // size for datagram in datagrams]
    records = np.frombuffer(b"".join([d for d, count in zip(datagrams, counts, strict=True) if count]), RECORD)
    return Decoded(records, np.repeat(np.arange(len(counts)), counts), counts.count(0))


def parse_wrench(answer: bytes) -> tuple[int, ...] | None:
    """Return the six 16-bit counts that answer READ_WRENCH, SET_BIAS or RESET_LATCH; None where it is no answer."""
    if len(answer) != _WRENCH.size or answer[:2] != _HEADER.to_bytes(2, "big"):
        return None
    return _WRENCH.unpack(answer)[2:]


def is_latched(answer: bytes) -> bool:
    """Tell whether the status that comes with such an answer, its upper half, says that a condition is latched.

    >>> is_latched(bytes.fromhex("1234 8001" + "0000" * 6)), is_latched(bytes.fromhex("1234 0000" + "0000" * 6))
    (True, False)
    """
    return len(answer) == _WRENCH.size and bool(_WRENCH.unpack(answer)[1] & 1)


@dataclass(frozen=True, slots=True)
class Units:
    """How the TCP port counts."""

    force: int  # code of the unit
    torque: int
    counts_per_force: int
    counts_per_torque: int
    scales: tuple[int, ...]  # full counts in one of the six 16-bit counts


def parse_units(answer: bytes) -> Units | None:
    """Return what answers READ_UNITS, None where it is no answer.

    >>> parse_units(bytes.fromhex("1234 02 03 000F4240 000F4240 05DC 05DC 05DC 000A 000A 000A"))
    Units(force=2, torque=3, counts_per_force=1000000, counts_per_torque=1000000, scales=(1500, 1500, 1500, 10, 10, 10))
    """
    if len(answer) != _UNITS.size or answer[:2] != _HEADER.to_bytes(2, "big"):
        return None
    _, force, torque, per_force, per_torque, *scales = _UNITS.unpack(answer)
    return Units(force, torque, per_force, per_torque, tuple(scales))
