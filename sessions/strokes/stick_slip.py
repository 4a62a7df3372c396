"""Whether a contact sticks and slips while the finger moves, and what friction follows the normal force by.

Where it does, T/N climbs slowly and drops at once, again and again. Noise and hum climb as suddenly as they drop.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.settings import AnalysisSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StickSlip:
    """A contact that sticks and slips."""

    frequency: float  # of the slips [Hz]
    missed: float  # how far T/N climbs from one reading to the next: readings may miss a crest by it [-]


def stick_slip(time: Array, ratio: Array, noise: float, settings: AnalysisSettings) -> StickSlip | None:
    """Return how a contact sticks and slips, by unfiltered T/N (n,) [-] at `time` (n,) [s]; None where it does not.

    `noise` is the standard deviation of T/N [-].
    """
    limits = settings.ratio
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    lag = max(1, round(limits.slip_within / step)) if step > 0.0 else len(time)
    if len(time) <= lag + 1:
        return None
    change = ratio[lag:] - ratio[:-lag]
    sudden = max(limits.slip_share * float(np.nanmedian(ratio)), limits.slip_noise * np.sqrt(2.0) * noise)
    with np.errstate(invalid="ignore"):
        drops = _beginnings(change < -sudden)
        # A slow climb grows by up to a third of a drop in the same time, so half of one is sudden.
        depth = -float(np.median(np.fmin.reduceat(change, drops))) if len(drops) else 0.0
        climbs = _beginnings(change > max(sudden, 0.5 * depth))
    if len(drops) < limits.slips_fewest or len(climbs) > limits.slips_upwards * len(drops):
        return None
    steps = np.diff(ratio)
    climb = float(np.nanmedian(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    return StickSlip(float((len(drops) - 1) / (time[drops[-1]] - time[drops[0]])), climb)


def _beginnings(marked: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return where each run of marked readings begins."""
    return np.flatnonzero(marked & ~np.concatenate([[False], marked[:-1]]))


def power_of_normal_force(normal: Array, ratio: Array, length: int, settings: AnalysisSettings) -> float:
    """Return by what power T/N (n,) [-] may follow N (n,) [N]: the steepest fall to `law_steepest` readings allow.

    Means of `length` readings are fitted, and two standard errors are allowed. Never above 0.
    """
    steepest = settings.ratio.law_steepest
    with np.errstate(invalid="ignore"):
        valid = np.isfinite(ratio) & (ratio > 0.0) & (normal > 0.0)
    blocks = np.count_nonzero(valid) // length
    if blocks < settings.ratio.law_fewest:
        return steepest
    means = np.column_stack([np.log(normal[valid]), np.log(ratio[valid])])[: blocks * length]
    x, y = means.reshape(blocks, length, 2).mean(axis=1).T
    x, y = x - x.mean(), y - y.mean()
    spread = float(x @ x)
    if spread <= 0.0:
        return steepest
    slope = float(x @ y) / spread
    error = float(np.sqrt(((y - slope * x) ** 2).sum() / (blocks - 2) / spread))
    return min(0.0, float(np.clip(steepest, slope - 2.0 * error, slope + 2.0 * error)))
