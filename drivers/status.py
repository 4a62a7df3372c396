"""What the bits of a reading's status mean, and what they say of its six values."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Verdict = Literal["saturated", "doubtful", "note"]  # values invalid; values not to be trusted; nothing against them


@dataclass(frozen=True, slots=True)
class StatusBit:
    """One entry of a maker's table: the status has `value` in the bits of `mask`."""

    mask: int
    value: int
    words: str
    verdict: Verdict


def bit(number: int, words: str, verdict: Verdict) -> StatusBit:
    """Return the entry of one bit, 0 being the lowest."""
    return StatusBit(1 << number, 1 << number, words, verdict)


@dataclass(frozen=True, slots=True)
class StatusTable:
    """A maker's table of status bits, the gravest first. A bit that is in no entry is doubtful.

    Where nothing but notes is listed, as in early recordings, a fault looks like values out of range: then
    such a bit makes the values invalid, whichever it is.
    """

    bits: tuple[StatusBit, ...] = ()
    summary: int = 0  # bit that is set beside any other, and says nothing beside another

    def entries(self, status: int) -> tuple[StatusBit, ...]:
        """Return what a status says; nothing when the device is healthy."""
        entries = [entry for entry in self.bits if status & entry.mask == entry.value]
        rest = status & ~self.summary
        for entry in entries:
            rest &= ~entry.mask
        unknown = [number for number in range(63, -1, -1) if rest >> number & 1]
        verdict: Verdict = "doubtful" if any(entry.verdict != "note" for entry in self.bits) else "saturated"
        entries += [bit(number, f"unknown bit {number}", verdict) for number in unknown]
        if not entries and status & self.summary:
            entries.append(StatusBit(self.summary, self.summary, "unnamed error", verdict))
        return tuple(entries)

    def words(self, status: int) -> tuple[str, ...]:
        """Return the words of a status; none when the device is healthy."""
        return tuple(entry.words for entry in self.entries(status))

    def verdict(self, status: int) -> Verdict | None:
        """Return what a status says of the values, the gravest of all that is set; None when the device is healthy."""
        verdicts = {entry.verdict for entry in self.entries(status)}
        return next((one for one in ("saturated", "doubtful", "note") if one in verdicts), None)

    def doubtful(self, status: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell of each status (n,) whether it speaks against the reading's six values."""
        return self._judged(status, ("saturated", "doubtful"))

    def faulty(self, status: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Tell of each status (n,) whether it speaks of a fault of the device, and not of values out of range."""
        return self._judged(status, ("doubtful",))

    def _judged(self, status: NDArray[np.int64], verdicts: tuple[Verdict, ...]) -> NDArray[np.bool_]:
        if not status.any():
            return np.zeros(len(status), np.bool_)
        kinds, which = np.unique(status, return_inverse=True)
        return np.array([self.verdict(int(kind)) in verdicts for kind in kinds], np.bool_)[which]

    @property
    def harmless(self) -> int:
        """Bits that say nothing against a reading's six values."""
        return sum(entry.mask for entry in self.bits if entry.verdict == "note")


@dataclass(slots=True)
class StatusCount:
    """Counts readings by what their status says."""

    table: StatusTable
    verdicts: Counter[Verdict] = field(default_factory=Counter[Verdict])
    flagged: Counter[str] = field(default_factory=Counter[str])  # by the words of each entry

    def take(self, status: NDArray[np.int64]) -> None:
        """Count readings of these statuses (n,)."""
        if not status.any():
            return
        for kind, count in zip(*(column.tolist() for column in np.unique(status, return_counts=True)), strict=True):
            if (verdict := self.table.verdict(kind)) is not None:
                self.verdicts[verdict] += count
            for words in self.table.words(kind):
                self.flagged[words] += count


def flagged_words(flagged: Mapping[str, int]) -> str:
    """Return what statuses said, the most frequent first.

    >>> flagged_words({"HTTP error": 2, "gauge excitation current too low": 200})
    'gauge excitation current too low (200), HTTP error (2)'
    """
    ordered = sorted(flagged.items(), key=lambda item: -item[1])
    return ", ".join(f"{words} ({count})" for words, count in ordered)
