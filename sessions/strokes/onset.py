"""Contact onset and lift from the normal force: one detector for live and for recorded readings."""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NORMAL_STEP = 1.4826 / sqrt(2)  # standard deviation of white noise over the median absolute step between neighbours


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """What counts as touching; forces are above the measured zero."""

    onset_floor: float = 0.05  # a contact exceeds this [N] ...
    onset_noise: float = 5.0  # ... and so many standard deviations of the noise [-] ...
    onset_hold: float = 0.010  # ... for so long [s]
    leave_noise: float = 3.0  # its onset is walked back to where the force left so many standard deviations [-]
    lift_fraction: float = 0.6  # lifted below this fraction of the onset threshold [-] ...
    lift_hold: float = 0.020  # ... for so long [s]
    baseline: float = 0.3  # unloaded stretch that gives zero and noise [s]
    baseline_readings: int = 12  # and the fewest readings it may have
    baseline_parts: int = 6  # in which it is renewed
    quiet_noise: float = 2.0  # it is unloaded when its spread stays within so many times the noise [-] ...
    quiet_floor: float = 0.02  # ... or within this, for readings that were smoothed before they came [N]


@dataclass(frozen=True, slots=True)
class Baseline:
    """The normal force with nothing touching."""

    level: float  # mean [N]
    noise: float  # standard deviation about it [N]


@dataclass(frozen=True, slots=True)
class Onset:
    """The finger has touched."""

    time: float  # instant the force left the noise [s, device time]
    noticed: float  # reading at which this was certain [s, device time]


@dataclass(frozen=True, slots=True)
class Lift:
    """The finger has left."""

    time: float  # first instant below the lift threshold [s, device time]
    noticed: float  # reading at which this was certain [s, device time]


ContactEvent = Onset | Lift


class ContactDetector:
    """Tell contact onset and lift from normal force and time, however the readings were cut into blocks.

    Zero and noise are measured in the unloaded stretch before contact and follow a slow drift until the finger
    touches. Without an unloaded stretch nothing is detected. A force that falls well below its zero shows that the zero
    was taken in contact: it is then measured anew.
    """

    def __init__(self, settings: DetectorSettings | None = None, baseline: Baseline | None = None) -> None:
        """Start with nothing known, or with a baseline measured elsewhere, which then stays as given."""
        self._settings = settings or DetectorSettings()
        self._follows = baseline is None
        # Finished ones; the newest may hold a touch's first part.
        self._bins: deque[list[float]] = deque(maxlen=self._settings.baseline_parts + 1)
        self._bin: list[float] = []
        self._bin_start: float | None = None
        self._touching = False
        self._left: float | None = None  # first reading since the force was last within the noise
        self._above: float | None = None  # first reading of the present run above the onset threshold
        self._below: float | None = None  # first reading of the present run below the lift threshold
        self._pulling: float | None = None  # first reading of the present run far below zero
        self._baseline: Baseline | None = None
        self._level = self._noise_band = self._threshold = self._lift = 0.0
        if baseline is not None:
            self._take(baseline)

    @property
    def baseline(self) -> Baseline | None:
        """Zero and noise in force; None until an unloaded stretch was seen."""
        return self._baseline

    @property
    def touching(self) -> bool:
        """True between an onset and its lift."""
        return self._touching

    def feed(self, time: Array, normal_force: Array) -> tuple[ContactEvent, ...]:
        """Take readings, time (n,) [s] and normal force (n,) [N, pressing > 0, not zeroed]; return what they tell."""
        events = (self._take_reading(t, force) for t, force in zip(time.tolist(), normal_force.tolist(), strict=True))
        return tuple(event for event in events if event is not None)

    def _take_reading(self, t: float, force: float) -> ContactEvent | None:
        if self._baseline is None:
            self._gather(t, force)
            return None
        return self._still_touching(t, force) if self._touching else self._not_touching(t, force)

    def _not_touching(self, t: float, force: float) -> ContactEvent | None:
        above = force - self._level
        if above <= self._noise_band:
            self._left = None
        elif self._left is None:
            self._left = t
        if above <= self._threshold:
            self._above = None
            self._notice_pull(t, above)
            if self._follows:
                self._gather(t, force)
            return None
        if self._above is None:
            self._above = t
        if t - self._above < self._settings.onset_hold - _ROUNDING:
            return None
        onset = Onset(self._above if self._left is None else self._left, t)
        self._touching = True
        self._above = self._below = self._left = None
        return onset

    def _still_touching(self, t: float, force: float) -> ContactEvent | None:
        above = force - self._level
        if above >= self._lift:
            self._below = None
            return None
        if self._below is None:
            self._below = t
        if t - self._below < self._settings.lift_hold - _ROUNDING:
            return None
        lift = Lift(self._below, t)
        self._touching = False
        self._below = None
        self._start_gathering()
        return lift

    def _notice_pull(self, t: float, above: float) -> None:
        """Forget a zero that was taken in contact."""
        if above >= -self._threshold or not self._follows:
            self._pulling = None
        elif self._pulling is None:
            self._pulling = t
        elif t - self._pulling >= self._settings.baseline / 2:
            self._pulling = self._baseline = None
            self._start_gathering()

    def _start_gathering(self) -> None:
        self._bins.clear()
        self._bin, self._bin_start = [], None

    def _gather(self, t: float, force: float) -> None:
        """Keep the readings of the last stretch in bins, and take zero and noise from them when they are quiet."""
        if self._bin_start is None:
            self._bin_start = t
        if t - self._bin_start >= self._settings.baseline / self._settings.baseline_parts - _ROUNDING:
            self._bins.append(self._bin)
            self._bin, self._bin_start = [], t
            if len(self._bins) == self._bins.maxlen:
                stretch = [reading for finished in list(self._bins)[:-1] for reading in finished]
                if is_quiet(stretch, self._settings):
                    self._take(Baseline(fmean(stretch), _spread(stretch)))
        self._bin.append(force)

    def _take(self, baseline: Baseline) -> None:
        self._baseline = baseline
        self._level = baseline.level
        self._noise_band = self._settings.leave_noise * baseline.noise
        self._threshold = onset_threshold(baseline.noise, self._settings)
        self._lift = self._settings.lift_fraction * self._threshold


_ROUNDING = 1e-9  # times are sums of ticks [s]


def onset_threshold(noise: float, settings: DetectorSettings) -> float:
    """Return the normal force above zero that counts as contact [N], for a noise [N].

    >>> onset_threshold(0.004, DetectorSettings()), onset_threshold(0.1, DetectorSettings())
    (0.05, 0.5)
    """
    return max(settings.onset_noise * noise, settings.onset_floor)


def is_quiet(stretch: list[float], settings: DetectorSettings) -> bool:
    """Say whether a stretch of forces [N] spreads no more than noise does.

    Noise is estimated from the median step between neighbours, which a slow movement hardly changes.
    """
    if len(stretch) < settings.baseline_readings:
        return False
    steps = [abs(b - a) for a, b in pairwise(stretch)]
    noise = NORMAL_STEP * median(steps)
    return _spread(stretch) <= max(settings.quiet_noise * noise, settings.quiet_floor)


def _spread(stretch: list[float]) -> float:
    """Return the standard deviation."""
    mean = fmean(stretch)
    return sqrt(sum((reading - mean) ** 2 for reading in stretch) / (len(stretch) - 1))
