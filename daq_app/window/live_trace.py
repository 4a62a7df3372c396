"""The last minute of readings, reduced to columns of pixels for drawing; scale and ticks of a plot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq_app.wording import step_above
from drivers.arrays import Array, Indices

CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz", "N", "T", "mu", "speed", "x", "y")
_LONGEST = 60.0  # longest trace [s]
_GAP = 5.0  # time step, relative to the usual one, that counts as a gap even without lost readings [-]
SCALE_MARGIN = 0.05  # margin drawn beyond the scale, relative to it [-]
SHRINK = 0.25  # used share below which a scale shrinks [-] ...
_PATIENCE = 20.0  # ... after this time [s]


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Plot data of one stretch of time: the least and the greatest value in each of k columns of pixels.

    `time` (2 k,) [s] holds each column's instant twice, `values` (channels, 2 k) its least and greatest in the order
    in which the curve passes them. A column without readings has nan, so that a gap stays a gap.
    """

    time: Array
    values: Array


class LiveTrace:
    """A ring buffer of readings, for display only."""

    def __init__(self, rate: float, channels: int = len(CHANNELS), gap: float | None = None) -> None:
        """Keep `_LONGEST` seconds of readings at `rate` [Hz]; a time step above `gap` [s] is a gap."""
        self.rate = rate if np.isfinite(rate) and rate > 0 else 1000.0
        self._gap = _GAP / self.rate if gap is None else gap
        self._capacity = int(self.rate * _LONGEST * 1.05) + 16
        self._time = np.full(2 * self._capacity, np.nan)
        self._values = np.full((channels, 2 * self._capacity), np.nan, np.float32)
        self._stop = 0  # one after the newest; the buffer is written from left to right and shifted when full
        self._start = 0
        self._full = False  # whether readings were dropped for newer ones
        self._columns = self._no_columns()

    def add(self, time: Array, values: Array) -> None:
        """Take readings: time (n,) [s, device time, rising] and values (channels, n)."""
        n = len(time)
        self._full |= self._stop - self._start + n > self._capacity
        if n > self._capacity:
            time, values, n = time[-self._capacity :], values[:, -self._capacity :], self._capacity
        if self._stop + n > len(self._time):
            kept_count = min(self._stop - self._start, self._capacity - n)
            source = slice(self._stop - kept_count, self._stop)
            self._time[:kept_count] = self._time[source].copy()
            self._values[:, :kept_count] = self._values[:, source].copy()
            self._start, self._stop = 0, kept_count
        self._time[self._stop : self._stop + n] = time
        self._values[:, self._stop : self._stop + n] = values
        self._stop += n
        self._start = max(self._start, self._stop - self._capacity)

    @property
    def newest(self) -> float | None:
        """Return the time of the newest reading [s]; None before the first."""
        return float(self._time[self._stop - 1]) if self._stop > self._start else None

    def holds(self, first: float) -> bool:
        """Say whether all readings since `first` [s] are still held."""
        return not self._full or float(self._time[self._start]) <= first

    def clear(self) -> None:
        """Forget every reading, as at a new connection."""
        self._start = self._stop = 0
        self._full = False
        self._columns = self._no_columns()

    def between(self, first: float, last: float, every: int = 1) -> tuple[Array, Array]:
        """Return time (n,) [s] and values (channels, n) from `first` to `last` [s]: each `every`, and the newest."""
        start, stop = self._positions(first, last)
        rows = slice(start + (stop - start - 1) % every if stop > start else start, stop, every)
        return self._time[rows], self._values[:, rows].astype(np.float64)

    def columns(self, first: float, last: float, count: int) -> Columns:
        """Return about `count` columns of the readings from `first` to `last` [s]; few readings one by one.

        Columns are at integer multiples of their width from time 0, so that a moving plot does not shimmer. Only
        columns that are new since the last call are computed: a frame's cost does not depend on the stretch.
        """
        start, stop = self._positions(first, last)
        if stop - start <= 2 * count:
            time, values = self._time[start:stop].copy(), self._values[:, start:stop].astype(np.float64)
            return Columns(*with_gaps(time, values, np.flatnonzero(np.diff(time) > self._gap) + 1))
        width = (last - first) / count
        if self._columns.width != width or self._columns.first > first:
            self._columns = self._no_columns(width, first)
        begin, _ = self._positions(self._columns.open_from, last)
        self._columns = self._columns.advance(self._time[begin:stop], self._values[:, begin:stop], first)
        return self._columns.envelope(self._gap)

    def _no_columns(self, width: float = 0.0, first: float = 0.0) -> "_Columns":
        return _Columns(width, first, np.empty(0, np.int64), np.empty((len(self._values), 0), np.float32))

    def _positions(self, first: float, last: float) -> tuple[int, int]:
        times = self._time[self._start : self._stop]
        start, stop = np.searchsorted(times, [first, last], side="left")
        return self._start + int(start), self._start + int(stop)


@dataclass(frozen=True, slots=True, eq=False)
class _Columns:
    """Columns computed so far; the newest is open, since it may get more readings."""

    width: float  # of a column [s]
    first: float  # start of their stretch [s]
    numbers: Indices  # (k,) time / width
    pairs: NDArray[np.float32]  # (c, 2 k)

    @property
    def open_from(self) -> float:
        """Return the time from which readings are needed [s]."""
        return float(self.numbers[-1]) * self.width if len(self.numbers) else self.first

    def advance(self, time: Array, values: NDArray[np.float32], first: float) -> "_Columns":
        """Return the columns with the readings since `open_from`, without those before `first` [s]."""
        column = np.floor(time / self.width).astype(np.int64)
        starts = np.flatnonzero(np.diff(column, prepend=-1) > 0)
        keep = slice(int(np.searchsorted(self.numbers, first // self.width)), max(len(self.numbers) - 1, 0))
        earlier = self.pairs[:, 2 * keep.start : 2 * keep.stop] if keep.stop > keep.start else self.pairs[:, :0]
        numbers = np.concatenate([self.numbers[keep], column[starts]])
        return _Columns(self.width, first, numbers, np.hstack([earlier, _pairs(values, starts)]))

    def envelope(self, gap: float) -> Columns:
        """Return the least and the greatest value of each column, with gaps where readings are missing."""
        behind = np.flatnonzero(np.diff(self.numbers) > 1 + gap / self.width)
        times = np.repeat((self.numbers.astype(np.float64) + 0.5) * self.width, 2)
        return Columns(*with_gaps(times, self.pairs.astype(np.float64), 2 * (behind + 1)))


def _pairs(values: NDArray[np.float32], starts: Indices) -> NDArray[np.float32]:
    """Return least and greatest of each group that begins at `starts`, in the order in which the curve passes them."""
    pairs = np.empty((len(values), 2 * len(starts)), np.float32)
    if not len(starts):
        return pairs
    least = np.fmin.reduceat(values, starts, axis=1)
    greatest = np.fmax.reduceat(values, starts, axis=1)
    stops = np.append(starts[1:], values.shape[1]) - 1
    rising = values[:, stops] >= values[:, starts]
    pairs[:, 0::2] = np.where(rising, least, greatest)
    pairs[:, 1::2] = np.where(rising, greatest, least)
    return pairs


def with_gaps(time: Array, values: Array, gaps: Indices) -> tuple[Array, Array]:
    """Return times (n,) and values (channels, n) with nan inserted before the positions `gaps`, to break the line."""
    if not len(gaps):
        return time, values
    times: Array = np.insert(time, gaps, time[gaps])
    return times, np.insert(values, gaps, np.nan, axis=1)


@dataclass(frozen=True, slots=True)
class PlotScale:
    """A plot's range from `low` to `high`, each 0 or a step: 1, 2 or 5 times a power of ten."""

    low: float
    high: float
    least: float  # the smallest span shown [unit of the data]
    last_use: float = 0.0  # when the scale was last needed [s]

    def following(self, least: float, greatest: float, now: float) -> "PlotScale":
        """Return the scale after data from `least` to `greatest` were shown at `now` [s].

        >>> scale = PlotScale(0.0, 5.0, 5.0)
        >>> scale.following(0.0, 4.9, 0.0).high, scale.following(0.0, 5.3, 0.0).high
        (5.0, 10.0)
        >>> scale.following(-0.01, 4.0, 0.0).low, scale.following(-0.4, 4.0, 0.0).low
        (0.0, -0.5)
        >>> PlotScale(0.0, 20.0, 5.0).following(0.0, 1.0, 30.0).high
        5.0
        """
        if not (-np.inf < least <= greatest < np.inf):  # nan: no data
            return self
        margin = SCALE_MARGIN * (self.high - self.low)
        if greatest > self.high + margin or least < self.low - margin:
            low = self.low if least >= self.low - margin else -step_above(-least)
            high = self.high if greatest <= self.high + margin else step_above(greatest)
            return PlotScale(low, high, self.least, now)
        wide = self.high - self.low > self.least
        if not wide or greatest > SHRINK * self.high or least < SHRINK * self.low:
            return PlotScale(self.low, self.high, self.least, now)
        if now - self.last_use < _PATIENCE:
            return self
        low = 0.0 if self.low == 0.0 else -max(step_above(-least), self.least / 2)
        return PlotScale(low, max(step_above(greatest), self.least if low == 0.0 else self.least / 2), self.least, now)


def ticks(low: float, high: float, room: float) -> tuple[float, ...]:
    """Return the values from `low` to `high` that get a label, if `room` lines of text fit along the axis.

    >>> ticks(-5.0, 5.0, 8.0), ticks(-5.0, 5.0, 3.0), ticks(-5.0, 5.0, 1.2), ticks(-0.5, 5.0, 6.0)
    ((-5.0, -2.5, 0.0, 2.5, 5.0), (-5.0, 0.0, 5.0), (-5.0, 5.0), (0.0, 2.5, 5.0))
    """
    values: list[float] = []
    for value in (high, 0.0, low, high / 2, low / 2):  # the more informative first
        apart = min((abs(value - placed_value) for placed_value in values), default=np.inf)
        if low <= value <= high and apart * room >= high - low:
            values.append(value)
    return tuple(sorted(values))


def times(seconds: float, room: float) -> tuple[float, ...]:
    """Return the times [s] relative to now that get a label, if `room` of them fit along the axis.

    >>> times(10.0, 12.0), times(60.0, 4.5)
    ((-10.0, -8.0, -6.0, -4.0, -2.0, 0.0), (-60.0, -40.0, -20.0, 0.0))
    """
    steps = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
    step = next((step for step in steps if seconds / step + 1.0 <= min(room, 8.0)), seconds)
    return tuple(-step * n + 0.0 for n in range(int(seconds / step + 1e-9), -1, -1))
