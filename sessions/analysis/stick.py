"""Where the stick phase ends, the break-away: the change point at which T/N stops climbing.

Pushed against a surface that holds it, a finger's T/N climbs in about a straight line until the contact slips and then
stays: a line and a level that meet, fitted by least squares for every instant at which they may meet (Hinkley 1969,
Biometrika 56:495, two-phase regression).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.analysis.settings import AnalysisSettings

Array = NDArray[np.float64]

_CANDIDATES = 41  # instants at which line and level may meet; then as many about the best of them, twice
_FEWEST = 5  # readings of the climb, and of the level


class Climb(NamedTuple):
    """A line that climbs to a level and stays there."""

    meets: float  # instant at which line and level meet [s]
    slope: float  # of the line [1/s]
    level: float  # [-]
    left: float  # sum of squares that the fit leaves

    def at(self, time: Array) -> Array:
        """Return T/N (n,) [-] as fitted at `time` (n,) [s]."""
        return self.level - self.slope * np.maximum(self.meets - time, 0.0)


def break_away(time: Array, ratio: Array, settings: AnalysisSettings) -> float | None:
    """Return the instant [s] at which T/N (n,) [-] stops climbing; None where it does not climb first.

    `time` (n,) [s] reaches from the contact to the end of the steady window; nan of the ratio is left out. A climb
    counts where it explains most of what a level alone leaves, and rises by a share of the level (`stick_rise`).
    """
    held = np.isfinite(ratio)
    t, y = time[held], ratio[held]
    fit = climb(t, y)
    if fit is None:
        return None
    climbs = fit.slope > 0.0 and fit.slope * (fit.meets - float(t[0])) >= settings.stick_rise * fit.level
    return fit.meets if climbs and fit.left <= settings.stick_left * float(((y - y.mean()) ** 2).sum()) else None


def climb(t: Array, y: Array) -> Climb | None:
    """Return the climb and level that fit T/N `y` (n,) [-] at `t` (n,) [s] best; None of too few readings."""
    if len(t) < 2 * _FEWEST + 1:
        return None
    first, last = float(t[_FEWEST]), float(t[-_FEWEST - 1])
    step = (last - first) / (_CANDIDATES - 1)
    fit = _best(t, y, first, last)
    for _ in range(2):
        fit = _best(t, y, max(fit.meets - step, first), min(fit.meets + step, last))
        step *= 2.0 / (_CANDIDATES - 1)
    return fit


def _best(t: Array, y: Array, first: float, last: float) -> Climb:
    """Return the best fit whose line and level meet between two instants, at one of some of them."""
    meets = np.linspace(first, last, _CANDIDATES)
    slope, level, left = _fits(t, y, meets)
    best = int(np.argmin(left))
    return Climb(float(meets[best]), float(slope[best]), float(level[best]), float(left[best]))


def _fits(t: Array, y: Array, meets: Array) -> tuple[Array, Array, Array]:
    """Return slope, level and squares left (k,) of y = level - slope * max(meets - t, 0) for each meeting (k,)."""
    short = np.maximum(meets[:, None] - t, 0.0)  # (k, n) how long before they meet
    mean = short.mean(axis=1)
    from_mean = short - mean[:, None]
    spread = (from_mean**2).sum(axis=1)
    slope = -(from_mean @ (y - y.mean())) / spread
    left = ((y - y.mean()) ** 2).sum() - slope**2 * spread
    return slope, y.mean() + slope * mean, left
