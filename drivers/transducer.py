"""The interface of all six-axis transducers, the meaning of their status bits, and their errors."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Literal, Protocol

import numpy as np

from drivers.arrays import Indices, Mask
from drivers.calibration import Calibration
from drivers.readings import ReadingBlock

Verdict = Literal["saturated", "doubtful", "note"]  # values invalid; values doubtful; values fine


@dataclass(frozen=True, slots=True)
class StatusBit:
    """One entry of a maker's table: the status has `value` in the bits of `mask`."""

    mask: int
    value: int
    words: str
    verdict: Verdict


def bit(number: int, words: str, verdict: Verdict) -> StatusBit:
    """Return the entry of one bit; 0 is the lowest."""
    return StatusBit(1 << number, 1 << number, words, verdict)


@dataclass(frozen=True, slots=True)
class StatusTable:
    """A maker's table of status bits, most serious first. A bit without an entry is doubtful.

    If only notes are listed, as in early recordings, faults are indistinguishable from values out of range: then such a
    bit makes the values invalid.
    """

    bits: tuple[StatusBit, ...] = ()
    summary: int = 0  # bit set with any other bit, without a meaning of its own then

    def entries(self, status: int) -> tuple[StatusBit, ...]:
        """Return the entries of a status; empty when the device is healthy."""
        entries = [entry for entry in self.bits if status & entry.mask == entry.value]
        unnamed = status & ~self.summary
        for entry in entries:
            unnamed &= ~entry.mask
        unknown = [number for number in range(63, -1, -1) if unnamed >> number & 1]
        verdict: Verdict = "doubtful" if any(entry.verdict != "note" for entry in self.bits) else "saturated"
        entries += [bit(number, f"unknown bit {number}", verdict) for number in unknown]
        if not entries and status & self.summary:
            entries.append(StatusBit(self.summary, self.summary, "unnamed error", verdict))
        return tuple(entries)

    def words(self, status: int) -> tuple[str, ...]:
        """Return the words of a status; empty when the device is healthy."""
        return tuple(entry.words for entry in self.entries(status))

    def verdict(self, status: int) -> Verdict | None:
        """Return the most serious verdict of a status on the values; None when the device is healthy."""
        verdicts = {entry.verdict for entry in self.entries(status)}
        return next((candidate for candidate in ("saturated", "doubtful", "note") if candidate in verdicts), None)

    def doubtful(self, status: Indices) -> Mask:
        """Mark each status (n,) that makes the reading's six values invalid or doubtful."""
        return self._mask(status, ("saturated", "doubtful"))

    def faulty(self, status: Indices) -> Mask:
        """Mark each status (n,) that shows a fault of the device, not values out of range."""
        return self._mask(status, ("doubtful",))

    def _mask(self, status: Indices, verdicts: tuple[Verdict, ...]) -> Mask:
        if not status.any():
            return np.zeros(len(status), np.bool_)
        values, inverse = np.unique(status, return_inverse=True)
        return np.array([self.verdict(int(value)) in verdicts for value in values], np.bool_)[inverse]

    @property
    def harmless(self) -> int:
        """Bits that do not affect a reading's six values."""
        return sum(entry.mask for entry in self.bits if entry.verdict == "note")


@dataclass(slots=True)
class StatusCount:
    """Counts readings by their status."""

    table: StatusTable
    verdicts: Counter[Verdict] = field(default_factory=Counter[Verdict])
    flagged: Counter[str] = field(default_factory=Counter[str])  # by the words of each entry

    def take(self, status: Indices) -> None:
        """Count readings with these statuses (n,)."""
        if not status.any():
            return
        for value, count in zip(*(column.tolist() for column in np.unique(status, return_counts=True)), strict=True):
            if (verdict := self.table.verdict(value)) is not None:
                self.verdicts[verdict] += count
            for text in self.table.words(value):
                self.flagged[text] += count


def flagged_words(flagged: Mapping[str, int]) -> str:
    """Return the words of statuses with their counts, most frequent first.

    >>> flagged_words({"HTTP error": 2, "gauge excitation current too low": 200})
    'gauge excitation current too low (200), HTTP error (2)'
    """
    by_count = sorted(flagged.items(), key=lambda item: -item[1])
    return ", ".join(f"{text} ({count})" for text, count in by_count)


class SetupError(Exception):
    """The request is wrong or impossible: the address, a setting, a port already in use."""


class DeviceFault(Exception):
    """The device itself reports a fault; the message carries its status."""


class LinkLost(Exception):
    """Nothing arrives any more, or nothing ever answered."""


@dataclass(frozen=True, slots=True)
class TransducerInfo:
    """Identity and settings of a transducer, as read back from it."""

    uri: str  # the address it was opened with
    driver: str  # name in the catalogue, e.g. "net-ft"
    model: str  # product name stated by the device
    serial: str  # serial number of the active calibration
    simulated: bool
    rate: float  # readings a second as set and read back [Hz]; nan where unknown
    counter_rate: float  # ticks a second of the device's own counter [Hz]; nan where it has none
    calibration: Calibration
    settings: Mapping[str, str] = field(default_factory=dict[str, str])  # each setting as read back: filter, bias
    status: StatusTable = field(default_factory=StatusTable)  # meanings of the status bits of readings


@dataclass(frozen=True, slots=True)
class Health:
    """Running totals since start. A record that arrived is in one of received, repeated, late, malformed."""

    received: int = 0
    lost: int = 0  # missing sequence numbers (a late record, which is dropped, stays lost)
    repeated: int = 0
    late: int = 0
    malformed: int = 0
    stalled: int = 0  # records with an unchanged device counter (kept, and counted as received too)
    restarted: int = 0  # times the device's counter restarted
    saturated: int = 0  # readings with a status that makes the six values invalid, as out of range
    doubtful: int = 0  # other readings with a status that makes their values doubtful: a device fault
    noted: int = 0  # other readings with a status that does not affect their values
    flagged: Mapping[str, int] = field(default_factory=dict[str, int])  # readings by the words of their status
    off_units: int = 0  # readings since the last confirmation of the units, when these turned out changed
    off_rate: int = 0  # times the rate differed from the set one, or from the one before
    rate_words: str = ""  # latest finding about it
    lag_ms: float = 0.0  # age of the newest reading when it was handed over [ms of the session's clock]


COUNTS = tuple(count.name for count in fields(Health) if count.type is int and count.name != "received")  # of flaws


class Transducer(Protocol):
    """An open transducer. Use: start, read any number of times, stop; then close."""

    @property
    def info(self) -> TransducerInfo:
        """Identity, calibration and settings; fixed at opening."""

    @property
    def health(self) -> Health:
        """Totals so far."""

    def start(self) -> None:
        """Begin streaming. Raises LinkLost when the device never answers."""

    def read(self, timeout: float) -> ReadingBlock:
        """Return all readings not yet handed over, waiting up to `timeout` seconds [session clock] for the first.

        Returns an empty block when none arrived in time. Raises LinkLost when the stream has ended for good.
        """

    def stop(self) -> None:
        """End streaming; readings that arrived can still be read. Harmless when repeated."""

    def close(self) -> None:
        """Stop, and release every port and thread. Harmless when repeated."""


class WrappedTransducer:
    """A transducer that delegates to another one, optionally with a different `info`."""

    def __init__(self, inner: Transducer, info: TransducerInfo | None = None) -> None:
        self._inner = inner
        self.info = info or inner.info

    @property
    def health(self) -> Health:
        return self._inner.health

    def start(self) -> None:
        self._inner.start()

    def read(self, timeout: float) -> ReadingBlock:
        return self._inner.read(timeout)

    def stop(self) -> None:
        self._inner.stop()

    def close(self) -> None:
        self._inner.close()
