"""Whether a device keeps to its rate: what it has counted, held against the computer's clock."""

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise

WINDOW = 1.0  # of the records that arrive within, the one that waited least is taken [real s]
COARSE, FINE = (1, 0.1), (3, 0.02)  # over so many windows, twice running, the rate is off by more than this [-]


class RateWatch:
    """Watches one stream. Records reach the computer late, and never early: so of each window one is looked at."""

    def __init__(self, rate: float, factor: float, silence: float, vague: float = 0.0) -> None:
        """Expect `rate` counts a second [Hz] of a session clock that runs `factor` times real time.

        Across more than `silence` [s] without a record nothing is compared: something may have been lost in it.
        `rate` was only measured for a moment where it is `vague`, by up to that share [-]: what is found first is it.
        """
        self.rate = rate  # as found last [Hz]
        self.changes = 0  # of the rate, so far
        self.nominal = rate  # as set [Hz]
        self._vague = vague
        self._window = WINDOW * factor
        self._silence = silence
        self._points: deque[tuple[int, float]] = deque(maxlen=2 * FINE[0] + 1)  # count and arrival, one a window
        self._best: tuple[float, int, float] | None = None  # in this window: lateness, count, arrival
        self._ends = 0.0  # of this window
        self._last = 0.0  # arrival

    def take(self, count: int, received_ns: int) -> bool:
        """Take how far the device has counted by something that arrived; tell whether its rate is found to be another.

        `count` rises with what was lost on the way, where that is known.
        """
        now = received_ns * 1e-9
        if self._best is None or now - self._last > self._silence:
            self._begin(count, now)
            return False
        self._last = now
        late = now - count / self.rate
        if now < self._ends:
            if late < self._best[0]:
                self._best = late, count, now
            return False
        self._points.append(self._best[1:])
        self._best, self._ends = (late, count, now), now + self._window
        return self._judged()

    def begin_anew(self) -> None:
        """Forget what has come: what comes next does not go on from it."""
        self._best = None

    def _begin(self, count: int, now: float) -> None:
        self._points.clear()
        self._best, self._ends, self._last = (now - count / self.rate, count, now), now + self._window, now

    def _judged(self) -> bool:
        """Compare two stretches, one after the other, with the rate believed."""
        for windows, most in (COARSE, FINE):
            if len(self._points) <= 2 * windows:
                continue
            first, middle, last = (self._points[i] for i in (-1 - 2 * windows, -1 - windows, -1))
            before, after = (_rate(*pair) / self.rate - 1.0 for pair in ((first, middle), (middle, last)))
            if min(abs(before), abs(after)) > most and before * after > 0.0 and abs(after - before) < 0.5 * abs(after):
                self._points.clear()
                self._find(_rate(first, last), most)
                return True
            if windows == FINE[0]:
                self._vague = 0.0  # it is as it was measured
        return False

    def _find(self, rate: float, most: float) -> None:
        """Take another rate for true."""
        if abs(rate / self.nominal - 1.0) < self._vague:
            self.rate = self.nominal = rate
        else:
            self.rate = self.nominal if abs(rate / self.nominal - 1.0) < most else rate
            self.changes += 1
        self._vague = 0.0


def rate_of_least_late(came: Sequence[tuple[int, int]]) -> float:
    """Return the steady rate [Hz] at which these counts can have come [ns], each late but never early; nan of one.

    That of the line below all arrivals that is highest in their middle (Moon, Skelly and Towsley 1999, Proc. INFOCOM,
    227): as long as two of them came in time, one on either side, it is exact. At 100 Hz, the first 7 ms late and
    the last 30:

    >>> rate_of_least_late([(0, 7_000_000), (1, 10_000_000), (2, 20_000_000), (3, 30_000_000), (4, 70_000_000)])
    100.0
    """
    if len(came) < 2:
        return math.nan
    below: list[tuple[int, int]] = []  # corners of the lower hull
    for count, at in came:
        while len(below) > 1 and _turns_down(below[-2], below[-1], (count, at)):
            below.pop()
        below.append((count, at))
    middle = (came[0][0] + came[-1][0]) / 2.0
    first, last = next(side for side in pairwise(below) if side[1][0] >= middle)
    return (last[0] - first[0]) / (last[1] - first[1]) * 1e9 if last[1] > first[1] else math.nan


def _turns_down(first: tuple[int, int], middle: tuple[int, int], last: tuple[int, int]) -> bool:
    """Tell whether the middle point lies on or above the line between the others."""
    return (middle[1] - first[1]) * (last[0] - first[0]) >= (last[1] - first[1]) * (middle[0] - first[0])


def rate_words(what: str, rate: float, nominal: float) -> str:
    """Return what is the matter with a rate, or that it no longer is.

    >>> rate_words("readings come", 147.5, 295.0), rate_words("readings come", 295.0, 295.0)
    ('readings come at 147.5 Hz, not at 295 Hz', 'readings come at 295 Hz again')
    """
    return (
        f"{what} at {nominal:.6g} Hz again" if rate == nominal else f"{what} at {rate:.4g} Hz, not at {nominal:.6g} Hz"
    )


def _rate(first: tuple[int, float], last: tuple[int, float]) -> float:
    return (last[0] - first[0]) / (last[1] - first[1])
