"""Datagrams of the networked force/torque box. Layout: maker's manual 9620-05-NET FT, chapter 10 and section 15.2."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_REQUEST = struct.Struct(">HHI")  # header, command, number of records (0: until stopped)
_HEADER = 0x1234

STOP = _REQUEST.pack(_HEADER, 0x0000, 0)
START = _REQUEST.pack(_HEADER, 0x0002, 0)  # one record a datagram, until stopped

RECORD = np.dtype(
    [
        ("number", ">u4"),  # 1 for the first record after each start, then one more each
        ("counter", ">u4"),  # ticks of the box's own sampling since power-up
        ("status", ">u4"),
        ("counts", ">i4", 6),  # Fx Fy Fz Tx Ty Tz
    ]
)
COUNTER_RATE = 7000.0  # ticks a second, good to 0.5 % [Hz]

SATURATED = 1 << 17  # the six values of this record are invalid
_SUMMARY = 1 << 31

_MEANING = {
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


@dataclass(frozen=True, slots=True, eq=False)
class Decoded:
    """What a batch of datagrams held: n records and some datagrams that are none."""

    records: NDArray[np.void]  # (n,) of RECORD
    origin: NDArray[np.intp]  # (n,) the datagram each came in
    malformed: int  # datagrams of a length that no record has


def decode(datagrams: Sequence[bytes]) -> Decoded:
    """Return the records of `datagrams`, one in each that has the length of a record. Raises nothing."""
    origin = [i for i, datagram in enumerate(datagrams) if len(datagram) == RECORD.itemsize]
    records = np.frombuffer(b"".join([datagrams[i] for i in origin]), RECORD)
    return Decoded(records, np.array(origin, np.intp), len(datagrams) - len(origin))


def status_words(status: int) -> tuple[str, ...]:
    """Return what the set bits of a status word mean, the gravest first; nothing when the box is healthy.

    >>> status_words(0x80020000)
    ('transducer saturated or converter error',)
    """
    words = tuple(_MEANING.get(bit, f"unknown bit {bit}") for bit in range(30, -1, -1) if status >> bit & 1)
    return words or (("unnamed error",) if status & _SUMMARY else ())
