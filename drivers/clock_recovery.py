"""Numbers, times and the rate of records without any of them, from their order and arrival."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from drivers.arrays import Array, Indices

WINDOW = 1.0  # the least delayed record of each window is used [real s]
_COARSE, _FINE = (1, 0.1), (3, 0.02)  # windows, and the error of the rate over them that counts, twice in a row [-]


class RateWatch:
    """Watches one stream. Records may arrive late, never early, so the least late one of each window counts."""

    def __init__(self, rate: float, factor: float, silence: float, vague: float = 0.0) -> None:
        """Expect `rate` counts a second [Hz] of a session clock that runs `factor` times real time.

        Rates are not compared across more than `silence` [s] without a record, in which records may be lost. A `vague`
        rate is a rough measurement, off by up to that share [-]: the first precise rate replaces it.
        """
        self.rate = rate  # latest one [Hz]
        self.changes = 0  # of the rate, so far
        self.nominal = rate  # as set [Hz]
        self._vague = vague
        self._window = WINDOW * factor
        self._silence = silence
        self._points: deque[tuple[int, float]] = deque(maxlen=2 * _FINE[0] + 1)  # count and arrival, one a window
        self._best: tuple[float, int, float] | None = None  # in this window: lateness, count, arrival
        self._window_end = 0.0  # of this window
        self._last = 0.0  # arrival

    def take(self, count: int, received_ns: int) -> bool:
        """Take the device's count at an arrival, lost records included; say whether its rate has changed."""
        now = received_ns * 1e-9
        if self._best is None or now - self._last > self._silence:
            self._points.clear()
            self._best, self._window_end, self._last = (now - count / self.rate, count, now), now + self._window, now
            return False
        self._last = now
        late = now - count / self.rate
        if now < self._window_end:
            if late < self._best[0]:
                self._best = late, count, now
            return False
        self._points.append(self._best[1:])
        self._best, self._window_end = (late, count, now), now + self._window
        return self._rate_changed()

    def begin_anew(self) -> None:
        """Forget earlier records: later ones do not continue them."""
        self._best = None

    def _rate_changed(self) -> bool:
        """Say whether two successive stretches agree on another rate, and adopt it."""
        for windows, most in (_COARSE, _FINE):
            if len(self._points) <= 2 * windows:
                continue
            first, middle, last = (self._points[i] for i in (-1 - 2 * windows, -1 - windows, -1))
            early, late = (_rate(*pair) / self.rate - 1.0 for pair in ((first, middle), (middle, last)))
            if min(abs(early), abs(late)) > most and early * late > 0.0 and abs(late - early) < 0.5 * abs(late):
                self._points.clear()
                self._find(_rate(first, last), most)
                return True
            if windows == _FINE[0]:
                self._vague = 0.0  # the measured rate is confirmed
        return False

    def _find(self, rate: float, most: float) -> None:
        if abs(rate / self.nominal - 1.0) < self._vague:
            self.rate = self.nominal = rate
        else:
            self.rate = self.nominal if abs(rate / self.nominal - 1.0) < most else rate
            self.changes += 1
        self._vague = 0.0


def rate_of_least_late(arrivals: Sequence[tuple[int, int]]) -> float:
    """Return the steady rate [Hz] of counts with arrivals [ns] that may be late but never early; nan for a single one.

    It is the slope of the line below all arrivals that is highest at their middle (Moon, Skelly and Towsley 1999, Proc.
    INFOCOM, 227): exact if two arrivals were in time, one on either side. At 100 Hz, the first 7 ms late and the last
    30:

    >>> rate_of_least_late([(0, 7_000_000), (1, 10_000_000), (2, 20_000_000), (3, 30_000_000), (4, 70_000_000)])
    100.0
    """
    if len(arrivals) < 2:
        return math.nan
    below: list[tuple[int, int]] = []  # corners of the lower hull
    for count, arrival_ns in arrivals:
        while len(below) > 1 and _turns_down(below[-2], below[-1], (count, arrival_ns)):
            below.pop()
        below.append((count, arrival_ns))
    middle = (arrivals[0][0] + arrivals[-1][0]) / 2.0
    first, last = next(side for side in pairwise(below) if side[1][0] >= middle)
    return (last[0] - first[0]) / (last[1] - first[1]) * 1e9 if last[1] > first[1] else math.nan


def _turns_down(first: tuple[int, int], middle: tuple[int, int], last: tuple[int, int]) -> bool:
    """Say whether the middle point is on or above the line between the others."""
    return (middle[1] - first[1]) * (last[0] - first[0]) >= (last[1] - first[1]) * (middle[0] - first[0])


def rate_words(subject: str, rate: float, nominal: float) -> str:
    """Return a clause on a wrong rate, or on its return to normal.

    >>> rate_words("readings come", 147.5, 295.0), rate_words("readings come", 295.0, 295.0)
    ('readings come at 147.5 Hz, not at 295 Hz', 'readings come at 295 Hz again')
    """
    text = f"{nominal:.6g} Hz again" if rate == nominal else f"{rate:.4g} Hz, not at {nominal:.6g} Hz"
    return f"{subject} at {text}"


def _rate(first: tuple[int, float], last: tuple[int, float]) -> float:
    return (last[0] - first[0]) / (last[1] - first[1])


GAP = 0.1  # shortest loss without a trace that is noticed [real s]
_SETTLE = 0.05  # time after a pause in which delayed records may still arrive [real s]
_STEADY = 0.3  # records arrive at their own rate where their lateness changes by less than this share of the time [-]
_LONGEST = 1.0  # longest time that records are held back while their rate varies [real s]
_LEAD = 1.0  # bandwidth with which times and rate follow the session's clock [rad/s]
SPREAD = 0.05  # largest relative difference of the true rate from the stated or measured one [-]


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Numbers and times of n records."""

    sequence: Indices  # (n,) from 1; a missing number is a lost or broken record
    time: Array  # (n,) [s] from 0, strictly rising


class ClockRecovery:
    """Numbers and times for records without either. After a pause records are held back until losses are clear.

    Records follow each other at a steady rate, known within a few per cent. Their times advance at that rate and slowly
    follow the session's clock, so that bytes delivered in lumps do not shake them. A loss with broken bytes is counted
    from those. A loss without broken bytes appears as a pause that the next records do not make up for. Below GAP the
    numbers do not show it, but times recover within seconds. A changed rate is followed (`RateWatch`); losses counted
    before that remain.
    """

    def __init__(self, rate: float, factor: float = 1.0) -> None:
        """Expect `rate` records in a second [Hz] of a session clock that runs `factor` times real time."""
        self.lost = 0  # numbers that no record has
        self._period: float = 1.0 / rate
        self._limit = GAP * factor + 3.0 * self._period
        self._settle = _SETTLE * factor + self._period
        self._longest = _LONGEST * factor + self._period
        self.watch = RateWatch(rate, factor, self._limit, vague=2.0 * SPREAD)
        self._count = 0  # records that came, broken ones too
        self._sequence = 0
        self._time = 0.0
        self._zero_ns: int | None = None  # session clock at time 0
        self._held_damaged: list[Indices] = []
        self._held_since_ns = 0
        self._held_until_ns = 0
        self._looked_ns, self._held_late = 0, 0.0  # their lateness at the last check [s]

    def take(self, damaged: Indices, received_ns: int) -> Placement:
        """Place n records that arrived together, with broken ones before each (n,), and earlier held-back records."""
        if len(damaged) == 0:
            return _NONE
        self._count += len(damaged) + int(damaged.sum())
        if self.watch.take(self._count, received_ns):
            self._period = 1.0 / self.watch.rate
        if self._zero_ns is None:
            damaged = np.concatenate([[0], damaged[1:]])  # bytes before the first record are not of this stream
            self._time = -self._period
            self._zero_ns = received_ns - round((damaged.sum() + len(damaged) - 1) * self._period * 1e9)
        if not self._held_damaged:
            if self._lateness(damaged, received_ns) <= self._limit:
                return self._place(damaged, received_ns)
            self._held_since_ns = self._looked_ns = received_ns
            self._held_late = self._lateness(damaged, received_ns)
        self._held_damaged.append(damaged)
        self._held_until_ns = received_ns
        elapsed_s = (received_ns - self._looked_ns) * 1e-9
        if elapsed_s < self._settle:
            return _NONE
        late, previous_late = self._lateness(np.concatenate(self._held_damaged), received_ns), self._held_late
        self._looked_ns, self._held_late = received_ns, late
        steady = abs(late - previous_late) < _STEADY * elapsed_s
        if late < 0.5 * self._limit or steady or received_ns - self._held_since_ns > self._longest * 1e9:
            return self.release()
        return _NONE

    def release(self) -> Placement:
        """Place records held back, as at the end of the stream."""
        if not self._held_damaged:
            return _NONE
        damaged = np.concatenate(self._held_damaged)
        self._held_damaged = []
        late = self._lateness(damaged, self._held_until_ns)
        if late > 0.5 * self._limit:
            gap = round(late / self._period)
            self._sequence += gap
            self._time += gap * self._period
            self.lost += gap
        return self._place(damaged, self._held_until_ns)

    def bridge(self, received_ns: int) -> None:
        """Continue the restarted stream at `received_ns`, after a gap of at least one record."""
        if self._zero_ns is None:
            return
        self.watch.begin_anew()
        away = (received_ns - self._zero_ns) * 1e-9 - self._time
        gap = max(round(away / self._period) - 1, 1)
        self._sequence += gap
        self._time += gap * self._period
        self.lost += gap

    def _lateness(self, damaged: Indices, received_ns: int) -> float:
        """Return the delay of the last of these records relative to a steady rate [s]."""
        assert self._zero_ns is not None
        steady = self._time + (int(damaged.sum()) + len(damaged)) * self._period
        return (received_ns - self._zero_ns) * 1e-9 - steady

    def _place(self, damaged: Indices, received_ns: int) -> Placement:
        """Place records that continue the numbers, and let times follow the session clock."""
        slots = np.cumsum(damaged + 1)
        count = int(slots[-1])
        late = max(-self._limit, min(self._limit, self._lateness(damaged, received_ns)))
        span = count * self._period
        share = min(_LEAD * span, 0.5)
        step = (span + max(-0.3 * span, min(0.3 * span, 2.0 * share * late))) / count
        sequence = self._sequence + slots
        time: Array = self._time + slots * np.float64(step)
        if self._sequence == 0:
            time -= time[0]
        self._sequence, self._time = int(sequence[-1]), float(time[-1])
        self.lost += int(damaged.sum())
        change = 1.0 + max(-0.002, min(0.002, _LEAD * share * late))
        usual = 1.0 / self.watch.rate
        self._period = max(usual * (1.0 - SPREAD), min(usual * (1.0 + SPREAD), self._period * change))
        return Placement(sequence, time)


_NONE = Placement(np.empty(0, np.int64), np.empty(0))


class ScanCount:
    """Numbers and times of scans by the converter's own clock: scan k is at k / rate.

    The host's clock only shows how long the converter was away, and whether a counter of losses wrapped unnoticed.
    """

    def __init__(self, rate: float, factor: float = 1.0, *, wrap: int = 0) -> None:
        """Expect `rate` scans a second [Hz] of a clock `factor` times real time; loss counts are modulo `wrap`."""
        self.lost = 0
        self.watch = RateWatch(rate, factor, GAP * factor + 10.0 / rate)
        self._rate = rate
        self._wrap = wrap
        self._sequence = 0
        self._behind: float | None = None  # arrival minus time of the previous scan [s]

    def take(self, damaged: Indices, received_ns: int) -> Placement:
        """Place n scans that arrived together, with those lost before each (n,)."""
        if not len(damaged):
            return _NONE
        sequence = self._sequence + np.cumsum(damaged + 1)
        behind = self._arrival_minus_time(int(sequence[-1]), received_ns)
        if self._wrap and self._behind is not None and damaged.any():
            rounds = max(round((behind - self._behind) * self._rate / self._wrap), 0)
            sequence += np.where(np.arange(len(damaged)) >= int(np.argmax(damaged > 0)), rounds * self._wrap, 0)
            behind -= rounds * self._wrap / self._rate
        self._behind = behind
        self.lost += int(sequence[-1]) - self._sequence - len(damaged)
        self._sequence = int(sequence[-1])
        self.watch.take(self._sequence, received_ns)
        return Placement(sequence, (sequence - 1) / self._rate)

    def release(self) -> Placement:
        """Return nothing: no scan is held back."""
        return _NONE

    def bridge(self, received_ns: int) -> None:
        """Continue the restarted stream at `received_ns`, after a gap of at least one scan."""
        self.watch.begin_anew()
        if self._behind is not None:
            away = self._arrival_minus_time(self._sequence, received_ns) - self._behind
            gap = max(round(away * self._rate) - 1, 1)
            self._sequence += gap
            self.lost += gap

    def _arrival_minus_time(self, sequence: int, received_ns: int) -> float:
        return received_ns * 1e-9 - (sequence - 1) / self._rate
