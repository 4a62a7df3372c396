"""The scale of a live plot: it stays until the data leave it, and then steps; and the numbers there is room for."""

from dataclasses import dataclass

import numpy as np

STEPS = (1.0, 2.0, 5.0)
MARGIN = 0.05  # data may go beyond the scale by this share of it: so much is drawn [-]
SHRINK = 0.25  # a scale of which no more than this share is used ...
PATIENCE = 20.0  # ... for so long is taken back [s]


@dataclass(frozen=True, slots=True)
class PlotScale:
    """From `low` to `high`; both 0, or a step: 1, 2 or 5 times a power of ten."""

    low: float
    high: float
    least: float  # the smallest span that is shown [unit of the data]
    used: float = 0.0  # when the scale was last needed [s]

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
        if not (least <= greatest):  # nothing is known
            return self
        margin = MARGIN * (self.high - self.low)
        if greatest > self.high + margin or least < self.low - margin:
            low = self.low if least >= self.low - margin else -_step(-least)
            high = self.high if greatest <= self.high + margin else _step(greatest)
            return PlotScale(low, high, self.least, now)
        wide = self.high - self.low > self.least
        if not wide or greatest > SHRINK * self.high or least < SHRINK * self.low:
            return PlotScale(self.low, self.high, self.least, now)
        if now - self.used < PATIENCE:
            return self
        low = 0.0 if self.low == 0.0 else -max(_step(-least), self.least / 2)
        return PlotScale(low, max(_step(greatest), self.least if low == 0.0 else self.least / 2), self.least, now)


def ticks(low: float, high: float, room: float) -> tuple[float, ...]:
    """Return the values from `low` to `high` that get a number, where `room` lines of text find room along the axis.

    >>> ticks(-5.0, 5.0, 8.0), ticks(-5.0, 5.0, 3.0), ticks(-5.0, 5.0, 1.2), ticks(-0.5, 5.0, 6.0)
    ((-5.0, -2.5, 0.0, 2.5, 5.0), (-5.0, 0.0, 5.0), (-5.0, 5.0), (0.0, 2.5, 5.0))
    """
    taken: list[float] = []
    for value in (high, 0.0, low, high / 2, low / 2):  # the more informative first
        apart = min((abs(value - other) for other in taken), default=np.inf)
        if low <= value <= high and apart * room >= high - low:
            taken.append(value)
    return tuple(sorted(taken))


def times(seconds: float, room: float) -> tuple[float, ...]:
    """Return the instants [s] before now that get a number, where `room` of them find room along the axis.

    >>> times(10.0, 12.0), times(60.0, 4.5)
    ((-10.0, -8.0, -6.0, -4.0, -2.0, 0.0), (-60.0, -40.0, -20.0, 0.0))
    """
    steps = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
    step = next((step for step in steps if seconds / step + 1.0 <= min(room, 8.0)), seconds)
    return tuple(-step * n + 0.0 for n in range(int(seconds / step + 1e-9), -1, -1))


def _step(value: float) -> float:
    """Return the smallest step that is not below a value; 0 for none.

    >>> _step(0.3), _step(5.1), _step(-2.0)
    (0.5, 10.0, 0.0)
    """
    if value <= 0.0:
        return 0.0
    power = 10.0
    while power > value:
        power /= 10.0
    while True:
        for step in STEPS:
            if step * power >= value * (1 - 1e-9):
                return float(f"{step * power:.6g}")
        power *= 10.0
