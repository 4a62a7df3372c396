"""The transducer's zero: unloaded stretches, what they read, and how far they moved from before contact to after."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.onset import NORMAL_STEP, onset_threshold
from sessions.strokes.settings import AnalysisSettings

Array = NDArray[np.float64]

_FORCES = slice(0, 3)
_TORQUES = slice(3, 5)  # about x and y: those that tell the centre of pressure


@dataclass(frozen=True, slots=True, eq=False)
class Zero:
    """What the transducer reads with nothing touching."""

    start: float  # of the stretch it was taken from [s, device time]
    stop: float
    level: Array  # (6,) face frame [N, N mm]
    noise: Array  # (6,) standard deviations [N, N mm]
    error: Array  # (6,) standard errors of `level` [N, N mm]

    @property
    def when(self) -> str:
        """The stretch, for people."""
        return f"{self.start:.3f} to {self.stop:.3f} s"


@dataclass(frozen=True, slots=True, eq=False)
class QuietWindows:
    """Windows in which no force moves more than its noise and the normal force is low; k of them, in order."""

    time: Array  # (n,) of all readings [s]
    wrench: Array  # (n, 6) of all readings, face frame, not zeroed [N, N mm]
    bounds: NDArray[np.int64]  # (k, 2) first and past-last reading

    def before(self, instant: float, longest: float) -> Zero | None:
        """Return the zero of the last quiet windows that end by `instant` [s], over at most `longest` [s]."""
        ended = self.bounds[self.time[self.bounds[:, 1] - 1] < instant]
        return self._over(ended[::-1], longest) if len(ended) else None

    def after(self, instant: float, longest: float) -> Zero | None:
        """Return the zero of the first quiet windows that start after `instant` [s], over at most `longest` [s]."""
        started = self.bounds[self.time[self.bounds[:, 0]] > instant]
        return self._over(started, longest) if len(started) else None

    def _over(self, windows: NDArray[np.int64], longest: float) -> Zero:
        start, stop = windows[0]
        for first, last in windows[1:]:
            low, high = min(start, first), max(stop, last)
            touching = first <= stop and last >= start
            if not touching or self.time[high - 1] - self.time[low] > longest:
                break
            start, stop = low, high
        stretch = self.wrench[start:stop]
        noise = stretch.std(axis=0, ddof=1)
        times = float(self.time[start]), float(self.time[stop - 1])
        return Zero(*times, stretch.mean(axis=0), noise, noise / len(stretch) ** 0.5)


def quiet_windows(time: Array, wrench: Array, rate: float, settings: AnalysisSettings) -> QuietWindows:
    """Return where a wrench (n, 6) [N, N mm; face frame] at `time` (n,) [s] is unloaded."""
    length = max(settings.detector.baseline_readings, round(settings.detector.baseline * rate))
    bounds = _quiet(time, wrench, length, rate, settings)
    return QuietWindows(time, wrench, bounds)


def _quiet(time: Array, wrench: Array, length: int, rate: float, settings: AnalysisSettings) -> NDArray[np.int64]:
    """Return the bounds (k, 2) of the quiet, unloaded windows of so many readings."""
    if len(wrench) < length:
        return np.empty((0, 2), np.int64)
    starts = np.arange(0, len(wrench) - length + 1, max(1, length // settings.zero.quiet_hops))
    spread, noise = _spread(wrench[:, _FORCES], starts, length)
    low, high = np.percentile(-wrench[:, 2], [0.5, 99.5])
    floor = max(settings.detector.quiet_floor, settings.zero.quiet_share * float(high - low))
    quiet = (spread <= np.maximum(settings.detector.quiet_noise * noise, floor)).all(axis=1)
    # A finger that slides with a steady force moves the centre of pressure, and with it the torques alone.
    turned, shaking = _spread(wrench[:, _TORQUES], starts, length)
    still = settings.zero.quiet_moves * float(high - low)
    quiet &= (turned <= np.maximum(settings.detector.quiet_noise * shaking, still)).all(axis=1)
    level = np.lib.stride_tricks.sliding_window_view(-wrench[:, 2], length)[starts].mean(axis=1)
    threshold = onset_threshold(float(np.median(noise[:, 2])), settings.detector)
    unloaded = level - low <= max(settings.zero.unloaded_share * (high - low), threshold)
    unbroken = time[starts + length - 1] - time[starts] <= settings.zero.quiet_gap * length / rate
    unloaded_starts = starts[quiet & unloaded & unbroken]
    return np.column_stack([unloaded_starts, unloaded_starts + length]).astype(np.int64)


def _spread(axes: Array, starts: NDArray[np.int64], length: int) -> tuple[Array, Array]:
    """Return the standard deviations (k, m) of axes (n, m) in windows from `starts` (k,), and their noise (k, m).

    Noise is estimated from the median step, which slow movement hardly changes.
    """
    windows = np.lib.stride_tricks.sliding_window_view(axes, length, axis=0)[starts]  # (k, m, length)
    noise = NORMAL_STEP * np.median(np.abs(np.diff(windows, axis=2)), axis=2)
    return windows.std(axis=2, ddof=1), noise
