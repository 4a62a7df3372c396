"""What every six-axis transducer can do, whatever its wire, and how it fails."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Protocol

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.status import StatusTable


class SetupError(Exception):
    """Our request was wrong or cannot be met: the address, a setting, a port already in use."""


class DeviceFault(Exception):
    """The device itself reports a fault; the message carries its status."""


class LinkLost(Exception):
    """Nothing arrives any more, or nothing ever answered."""


@dataclass(frozen=True, slots=True)
class TransducerInfo:
    """Who the transducer is and how it is set, as read back from it."""

    uri: str  # the address it was opened with
    driver: str  # name in the catalogue, e.g. "net-ft"
    model: str  # product name as the device gives it
    serial: str  # serial number of the calibration in force
    simulated: bool
    rate: float  # readings a second as set and read back [Hz]; nan where unknown
    counter_rate: float  # ticks a second of the device's own counter [Hz]; nan where it has none
    calibration: Calibration
    settings: Mapping[str, str] = field(default_factory=dict[str, str])  # each setting as read back: filter, bias
    status: StatusTable = field(default_factory=StatusTable)  # what the bits of a reading's status mean


@dataclass(frozen=True, slots=True)
class Health:
    """Running totals since start. A record that arrived is in one of received, repeated, late, malformed."""

    received: int = 0
    lost: int = 0  # sequence numbers that never arrived (a late one that is dropped stays lost)
    repeated: int = 0
    late: int = 0
    malformed: int = 0
    stalled: int = 0  # records whose device counter did not move (they are kept, and counted here too)
    restarted: int = 0  # times the device began to count anew
    saturated: int = 0  # readings whose status says the six values are invalid, as when out of range
    doubtful: int = 0  # other readings whose status speaks against their values: the device has a fault
    noted: int = 0  # other readings whose status says something, and nothing against their values
    flagged: Mapping[str, int] = field(default_factory=dict[str, int])  # readings by what their status says, in words
    off_units: int = 0  # readings since the units were last confirmed, when they were found to be others
    off_rate: int = 0  # times the rate was found to be another than the one set, or than before
    rate_words: str = ""  # what was found of it last
    lag_ms: float = 0.0  # age of the newest reading when it was handed over [ms of the session's clock]


COUNTS = tuple(one.name for one in fields(Health) if one.type is int and one.name != "received")  # of what went wrong


class Transducer(Protocol):
    """A transducer that was opened. Use: start, read as often as wanted, stop; then close."""

    @property
    def info(self) -> TransducerInfo:
        """Identity, calibration and settings; fixed from opening on."""
        ...

    @property
    def health(self) -> Health:
        """Totals so far."""
        ...

    def start(self) -> None:
        """Begin streaming. Raises LinkLost when the device never answers."""
        ...

    def read(self, timeout: float) -> ReadingBlock:
        """Return all readings not yet handed over, waiting up to `timeout` seconds [session clock] for the first.

        Returns an empty block when none came in time. Raises LinkLost when the stream has ended for good.
        """
        ...

    def stop(self) -> None:
        """End streaming; what had arrived can still be read. Harmless when repeated."""
        ...

    def close(self) -> None:
        """Stop, and give back every port and thread. Harmless when repeated."""
        ...
