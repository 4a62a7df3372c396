"""Detection of lost, repeated, late and frozen records from record numbers and the device's counter alone.

Record k of an undisturbed stream has number a + k and counter b + k·step, both modulo 2**32: it is on a line. A record
on the line is judged immediately. One off the line is held until the next. If the next continues the held one, the
stream itself has moved (a new start, a reboot, a changed rate, a frozen counter); if not, the held one was garbage and
must not move anything.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.arrays import Indices

WRAP = 2**32
_NEAR = 10_000  # greatest distance behind at which a rejected record counts as late; beyond, as garbage

Words = NDArray[np.uint32]  # as sent
Relation = Literal["same", "next", "frozen", "behind", "off"]


@dataclass(frozen=True, slots=True, eq=False)
class Accounting:
    """The verdict on a batch of records: k of them are kept."""

    positions: NDArray[np.intp]  # (k,) in the batch
    sequence: Indices  # (k,) their numbers, unwrapped; a missing number is a lost record
    counter: Indices  # (k,) the device's counter, unwrapped and never running backwards
    undecided: bool  # the batch's last record: it belongs at the head of the next batch


@dataclass(frozen=True, slots=True)
class _Record:
    """State of the stream at one record."""

    number: int  # as sent, 0 .. WRAP - 1
    counter: int
    received_ns: int

    def since(self, previous: "_Record") -> tuple[int, int]:
        """Return the differences of number and counter from an earlier record."""
        return _signed_difference(self.number - previous.number), _signed_difference(self.counter - previous.counter)


class SequenceAccount:
    """Judges the records of one stream in the order in which they arrived."""

    def __init__(self, step: int | None, counter_rate: float, first: int = 1) -> None:
        """Expect a first record with number `first`, and counters `step` apart (None: learned from the stream).

        `counter_rate` [Hz] converts host time into ticks, only to bridge a reboot: the device does not know its length.
        """
        self.step = step
        self.lost = 0
        self.repeated = 0
        self.late = 0
        self.garbage = 0
        self.frozen = 0
        self.restarted = 0
        self.changed = 0  # number of changes of the step
        self._counter_rate = counter_rate
        self._first = first
        self._last: _Record | None = None
        self._sequence = 0  # unwrapped number and counter of the last record kept
        self._counter = 0

    def take(self, numbers: Words, counters: Words, received_ns: Sequence[int], *, end: bool = False) -> Accounting:
        """Judge a batch of n records by their numbers (n,), counters (n,) and arrivals (n) [ns].

        With `end` no further batch will come, and nothing is held back.
        """
        if len(numbers) == 0:
            return Accounting(np.empty(0, np.intp), np.empty(0, np.int64), np.empty(0, np.int64), undecided=False)
        return self._on_the_line(numbers, counters, received_ns) or self._take_each(
            [_Record(*record) for record in zip(numbers.tolist(), counters.tolist(), received_ns, strict=True)], end
        )

    def _on_the_line(self, numbers: Words, counters: Words, received_ns: Sequence[int]) -> Accounting | None:
        """Return the verdict if every record is ahead on the line, with or without gaps, else None."""
        last = self._last
        if last is None or self.step is None:
            return None
        ahead = np.diff(numbers, prepend=np.uint32(last.number))  # unsigned, so it wraps as in the device
        ticks = np.diff(counters, prepend=np.uint32(last.counter))
        if np.any((ahead == 0) | (ahead >= WRAP // 2)) or np.any(ticks != ahead * np.uint32(self.step)):
            return None
        sequence = self._sequence + np.cumsum(ahead, dtype=np.int64)
        counter = self._counter + np.cumsum(ticks, dtype=np.int64)
        self.lost += int(sequence[-1]) - self._sequence - len(numbers)
        self._sequence, self._counter = int(sequence[-1]), int(counter[-1])
        self._last = _Record(int(numbers[-1]), int(counters[-1]), received_ns[-1])
        return Accounting(np.arange(len(numbers)), sequence, counter, undecided=False)

    def _take_each(self, records: list[_Record], end: bool) -> Accounting:
        positions: list[int] = []
        counts: list[tuple[int, int]] = []
        candidate: int | None = None

        def keep(position: int) -> None:
            positions.append(position)
            counts.append((self._sequence, self._counter))

        for position, record in enumerate(records):
            relation = "off" if self._last is None else self._relation(self._last, record)
            if relation == "off":
                if candidate is None:
                    candidate = position
                    continue
                relation = self._relation(records[candidate], record, learning=True)
                if relation == "off":
                    self._reject(records[candidate])
                    candidate = position
                    continue
                if relation in ("next", "frozen"):
                    self._adopt(records[candidate])
                    keep(candidate)
                    candidate = None
                    self._learn(record)
            elif candidate is not None:
                self._reject(records[candidate])
                candidate = None
            if self._move(record, relation):
                keep(position)
        if end and candidate is not None:
            self._reject(records[candidate])
            candidate = None
        table = np.array(counts, np.int64).reshape(-1, 2)
        return Accounting(np.array(positions, np.intp), table[:, 0], table[:, 1], undecided=candidate is not None)

    def _relation(self, previous: _Record, record: _Record, *, learning: bool = False) -> Relation:
        """Return the relation of a record to the previous one; when `learning`, the step may have any size."""
        ahead, ticks = record.since(previous)
        on_line = self.step is not None and ticks == _signed_difference(ahead * self.step)
        if ahead == 0:
            return "same" if ticks == 0 else "off"
        if ahead < 0:
            return "behind" if on_line or ticks == 0 else "off"
        if on_line or (learning and ahead == 1 and ticks > 0):
            return "next"
        return "frozen" if ticks == 0 else "off"

    def _move(self, record: _Record, relation: Relation) -> bool:
        """Count a record whose relation is clear; return whether it is kept."""
        if relation == "same":
            self.repeated += 1
        elif relation == "behind":
            self.late += 1
        else:
            assert self._last is not None
            self.frozen += relation == "frozen"
            self._advance(record, *record.since(self._last))
            return True
        return False

    def _learn(self, record: _Record) -> None:
        """Learn the step from the record right after the adopted one."""
        assert self._last is not None
        ahead, ticks = record.since(self._last)
        if ahead == 1 and ticks > 0:
            self.changed += self.step not in (None, ticks)
            self.step = ticks

    def _adopt(self, record: _Record) -> None:
        """Continue from a record off the line: the stream has moved there."""
        last = self._last
        if last is None:
            self._sequence = self._first - 1
            self._advance(record, max(_signed_difference(record.number - self._first), 0) + 1, record.counter)
            return
        ahead, ticks = record.since(last)
        step = self.step or 1
        # A device that rebooted shortly after power-up looks here like one that continued.
        if ticks <= 0:  # the counter restarted: only the host's clock shows how long the device was away
            self.restarted += 1
            away = (record.received_ns - last.received_ns) * 1e-9 * self._counter_rate
            ahead = max(round(away / step), 2)
            ticks = ahead * step
        elif ahead <= 0:  # the same device renumbers its records: its counter shows the missing records
            ahead = max(round(ticks / step), 1)
        self._advance(record, ahead, ticks)

    def _advance(self, record: _Record, ahead: int, ticks: int) -> None:
        """Move to `record`, `ahead` numbers and `ticks` further on."""
        self.lost += ahead - 1
        self._sequence += ahead
        self._counter += ticks
        self._last = record

    def _reject(self, record: _Record) -> None:
        """Count a record that no other continued."""
        ahead, _ = (0, 0) if self._last is None else record.since(self._last)
        if -_NEAR <= ahead < 0:
            self.late += 1
        else:
            self.garbage += 1


def _signed_difference(difference: int) -> int:
    """Return a difference modulo 2**32 as a signed number in [-2**31, 2**31).

    >>> _signed_difference(5 - (2**32 - 1)), _signed_difference(-3)
    (6, -3)
    """
    return (difference + WRAP // 2) % WRAP - WRAP // 2
