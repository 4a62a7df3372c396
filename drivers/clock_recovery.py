"""Numbers and times for records that carry neither: from the order they came in, their rate, and when they arrived.

Records follow each other at a steady rate that is known within a few per cent. Their times advance at that rate, and
are led by the session's clock: slowly, so that the system's handing over of bytes in lumps does not shake them. A
loss that left broken bytes behind is counted from those. A loss that left nothing behind shows as a pause that no
lump of records makes up for; one shorter than GAP looks like a lump and stays unnoticed in the numbers,
while the times recover within seconds. A device that changes its rate by more than a few per cent is found out within
seconds too (`drivers.rate`), and followed; what was taken for lost until then stays named as lost.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.rate import RateWatch

GAP = 0.1  # shortest loss without a trace that is noticed [real s]
_SETTLE = 0.05  # how long after a pause its lump may still be arriving [real s]
_STEADY = 0.3  # records come as fast as they are made where their lateness changes by less of the time passed [-]
_LONGEST = 1.0  # that records are kept back while they come faster or slower [real s]
_LEAD = 1.0  # how fast times and rate follow the session's clock [rad/s]
_SPREAD = 0.05  # how far the true rate may lie from the stated one [-]


@dataclass(frozen=True, slots=True, eq=False)
class Paced:
    """Where n records lie."""

    sequence: NDArray[np.int64]  # (n,) from 1; a missing number is a lost or broken record
    time: NDArray[np.float64]  # (n,) [s] from 0, strictly rising


class ClockRecovery:
    """Paces one stream. Records after a pause are kept back until it is clear whether any were lost."""

    def __init__(self, rate: float, factor: float = 1.0) -> None:
        """Expect `rate` records in a second [Hz] of a session clock that runs `factor` times real time."""
        self.lost = 0  # numbers that no record has
        self._period: float = 1.0 / rate
        self._period_of_times = self._period
        self._limit = GAP * factor + 3.0 * self._period
        self._settle = _SETTLE * factor + self._period
        self._longest = _LONGEST * factor + self._period
        self.watch = RateWatch(rate, factor, self._limit, vague=2.0 * _SPREAD)
        self._count = 0  # records that came, broken ones too
        self._sequence = 0
        self._time = 0.0
        self._zero_ns: int | None = None  # when the session clock stood at time 0
        self._held_damaged: list[NDArray[np.int64]] = []
        self._held_since_ns = 0
        self._held_until_ns = 0
        self._looked_ns, self._held_late = 0, 0.0  # how late they were when that was last looked at [s]

    def take(self, damaged: NDArray[np.int64], received_ns: int) -> Paced:
        """Place n records that arrived together, broken ones counted before each (n,), and any kept back before."""
        if len(damaged) == 0:
            return _NONE
        self._count += len(damaged) + int(damaged.sum())
        if self.watch.take(self._count, received_ns):
            self._period_of_times = self._period = 1.0 / self.watch.rate
        if self._zero_ns is None:
            damaged = np.concatenate([[0], damaged[1:]])  # what was before the first record is not of this stream
            self._time = -self._period
            self._zero_ns = received_ns - round((damaged.sum() + len(damaged) - 1) * self._period * 1e9)
        if not self._held_damaged:
            if self._lateness(damaged, received_ns) <= self._limit:
                return self._placed(damaged, received_ns)
            self._held_since_ns = self._looked_ns = received_ns
            self._held_late = self._lateness(damaged, received_ns)
        self._held_damaged.append(damaged)
        self._held_until_ns = received_ns
        passed = (received_ns - self._looked_ns) * 1e-9
        if passed < self._settle:
            return _NONE
        late, before = self._lateness(np.concatenate(self._held_damaged), received_ns), self._held_late
        self._looked_ns, self._held_late = received_ns, late
        steady = abs(late - before) < _STEADY * passed
        if late < 0.5 * self._limit or steady or received_ns - self._held_since_ns > self._longest * 1e9:
            return self.release()
        return _NONE

    def release(self) -> Paced:
        """Place what was kept back, as at the end of the stream."""
        if not self._held_damaged:
            return _NONE
        damaged = np.concatenate(self._held_damaged)
        self._held_damaged = []
        late = self._lateness(damaged, self._held_until_ns)
        if late > 0.5 * self._limit:
            missing = round(late / self._period)
            self._sequence += missing
            self._time += missing * self._period
            self.lost += missing
        return self._placed(damaged, self._held_until_ns)

    def bridge(self, received_ns: int) -> None:
        """Let the stream, begun anew, go on at `received_ns` behind a gap of at least one record."""
        if self._zero_ns is None:
            return
        self.watch.begin_anew()
        away = (received_ns - self._zero_ns) * 1e-9 - self._time
        missing = max(round(away / self._period) - 1, 1)
        self._sequence += missing
        self._time += missing * self._period
        self.lost += missing

    def _lateness(self, damaged: NDArray[np.int64], received_ns: int) -> float:
        """Return how much later than at a steady rate the last of these records came [s]."""
        assert self._zero_ns is not None
        steady = self._time + (int(damaged.sum()) + len(damaged)) * self._period
        return (received_ns - self._zero_ns) * 1e-9 - steady

    def _placed(self, damaged: NDArray[np.int64], received_ns: int) -> Paced:
        """Place records whose numbers follow on, and let the clock lead."""
        slots = np.cumsum(damaged + 1)
        count = int(slots[-1])
        late = max(-self._limit, min(self._limit, self._lateness(damaged, received_ns)))
        span = count * self._period
        share = min(_LEAD * span, 0.5)
        step = (span + max(-0.3 * span, min(0.3 * span, 2.0 * share * late))) / count
        sequence = self._sequence + slots
        time: NDArray[np.float64] = self._time + slots * np.float64(step)
        if self._sequence == 0:
            time -= time[0]
        self._sequence, self._time = int(sequence[-1]), float(time[-1])
        self.lost += int(damaged.sum())
        change = 1.0 + max(-0.002, min(0.002, _LEAD * share * late))
        longest, shortest = self._period_of_times * (1.0 + _SPREAD), self._period_of_times * (1.0 - _SPREAD)
        self._period = max(shortest, min(longest, self._period * change))
        return Paced(sequence, time)


_NONE = Paced(np.empty(0, np.int64), np.empty(0))
