"""Numbers and times of scans that a converter times by its own clock."""

import numpy as np
from numpy.typing import NDArray

from drivers.clock_recovery import GAP, Paced
from drivers.rate import RateWatch


class ScanCount:
    """Numbers and times of scans by the converter's own clock: scan k is at k / rate.

    The host's clock only tells how long the converter was away, and whether a counter that tells of losses went round
    unseen.
    """

    def __init__(self, rate: float, factor: float = 1.0, *, wrap: int = 0) -> None:
        """Expect `rate` scans in a second [Hz] of the session's clock; losses are known up to multiples of `wrap`.

        The session's clock runs `factor` times real time.
        """
        self.lost = 0
        self.watch = RateWatch(rate, factor, GAP * factor + 10.0 / rate)
        self._rate = rate
        self._wrap = wrap
        self._sequence = 0
        self._behind: float | None = None  # arrival minus time of the last scan before [s]

    def take(self, damaged: NDArray[np.int64], received_ns: int) -> Paced:
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
        return Paced(sequence, (sequence - 1) / self._rate)

    def release(self) -> Paced:
        """Place what was kept back: nothing ever is."""
        return _NONE

    def bridge(self, received_ns: int) -> None:
        """Let the stream, begun anew, go on at `received_ns` behind a gap of at least one scan."""
        self.watch.begin_anew()
        if self._behind is not None:
            away = self._arrival_minus_time(self._sequence, received_ns) - self._behind
            missing = max(round(away * self._rate) - 1, 1)
            self._sequence += missing
            self.lost += missing

    def _arrival_minus_time(self, sequence: int, received_ns: int) -> float:
        return received_ns * 1e-9 - (sequence - 1) / self._rate


_NONE = Paced(np.empty(0, np.int64), np.empty(0))
