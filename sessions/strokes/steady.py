"""The steady part of a stroke: its window, the mean and its interval there, and the speed of the centre of pressure."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.settings import AnalysisSettings

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Places = NDArray[np.int64]

_EDGES = 121  # windows begin and end on a grid of so many instants
FEWEST = 5  # readings in a window
_HELD = 0.95  # share of a window's readings that must have a ratio
_QUARTERS = 4
_FEWEST_BLOCKS = 4  # of which a standard error is told
_ALIKE = 0.8  # most that neighbours may be alike: more cannot be told from so few
_LEAST_FREE = 2.0  # degrees of freedom, likewise
_MANY_FREE = 1e6  # Student's t is normal to seven digits from there on


def steady_window(ratio: Array, rate: float, whole: int, settings: AnalysisSettings) -> slice | None:
    """Return the stretch over which T/N is steady, by the rule the settings name, or None.

    `ratio` (n,) [-] is nan where the finger does not slide or T/N means nothing; `whole` is how many readings the
    stroke has. Steady: the standard deviation is below 10 % of the mean and no quarter's mean lies more than 5 % from
    it (settings), beyond what the scatter of few readings explains. Of the steady stretches half as long as the slide
    that of least variance is taken as it is ("least variance"), or widened to the longest steady stretch that holds it
    ("widened"). "middle half" and "whole slide" ask for no steadiness.
    """
    shortest = max(settings.steady_share * whole, settings.steady_shortest * rate, FEWEST)
    first, last, variance, steady = _stretches(ratio, shortest, settings)
    if not len(first):
        return None
    length = last - first
    if settings.steady_rule in ("middle half", "whole slide"):
        most = int(np.argmax(length))
        sliding = first[most] + np.flatnonzero(np.isfinite(ratio[first[most] : last[most]]))
        aside = len(sliding) // 4 if settings.steady_rule == "middle half" else 0
        return slice(int(sliding[aside]), int(sliding[-1 - aside]) + 1)
    if not steady.any():
        return None
    best = _least(length, variance, steady, max(settings.steady_seed * np.isfinite(ratio).sum(), shortest), len(ratio))
    if settings.steady_rule == "least variance":
        return slice(int(first[best]), int(last[best]))
    around = np.flatnonzero(steady & (first <= first[best]) & (last >= last[best]))
    best = around[np.lexsort((variance[around], -length[around]))[0]]
    return _trimmed(ratio, slice(int(first[best]), int(last[best])), settings)


def _stretches(ratio: Array, shortest: float, settings: AnalysisSettings) -> tuple[Places, Places, Array, Mask]:
    """Return where each sliding stretch of a grid begins and ends, the variance of T/N in it, and if it is steady."""
    edges = np.unique(np.linspace(0, len(ratio), _EDGES).round().astype(int))
    held = np.isfinite(ratio)
    value = np.where(held, ratio, 0.0)
    count, total, squares = (np.concatenate([[0.0], np.cumsum(each)]) for each in (held, value, value**2))
    first, last = (edges[index] for index in np.triu_indices(len(edges), 1))
    long_enough = last - first >= shortest
    first, last = first[long_enough], last[long_enough]
    n = count[last] - count[first]
    full = n >= _HELD * (last - first)
    first, last, n = first[full], last[full], n[full]
    mean = (total[last] - total[first]) / n
    variance = np.maximum((squares[last] - squares[first]) / n - mean**2, 0.0)
    allowed = settings.steady_trend * mean + 2.0 * np.sqrt(_QUARTERS * variance / n) * (n < _QUARTERS * FEWEST)
    steady = np.sqrt(variance) < settings.steady_spread * mean
    for quarter in range(_QUARTERS):
        a = first + (last - first) * quarter // _QUARTERS
        b = first + (last - first) * (quarter + 1) // _QUARTERS
        here = (total[b] - total[a]) / np.maximum(count[b] - count[a], 1.0)
        steady &= np.abs(here - mean) <= allowed
    return first, last, variance, steady


def _least(length: Places, variance: Array, steady: Mask, wanted: float, readings: int) -> int:
    """Return which steady stretch of the wanted length varies least; of the longest, where all are shorter."""
    enough = length[steady & (length >= wanted)]
    least = int(enough.min()) if len(enough) else int(length[steady].max())
    alike = np.flatnonzero(steady & (length >= least) & (length <= least + readings / (_EDGES - 1)))
    return int(alike[np.argmin(variance[alike])])


def _trimmed(ratio: Array, window: slice, settings: AnalysisSettings) -> slice:
    """Return the window without ends that lie off its median: a quarter's mean hides the end of a ramp."""
    part = ratio[window]
    level = float(np.nanmedian(part))
    scatter = 1.4826 * float(np.nanmedian(np.abs(part - level)))
    with np.errstate(invalid="ignore"):
        inside = np.flatnonzero(np.abs(part - level) <= max(settings.steady_trend * level, 2.0 * scatter))
    return slice(window.start + int(inside[0]), window.start + int(inside[-1]) + 1)


@dataclass(frozen=True, slots=True)
class Mean:
    """A mean over a window."""

    value: float
    sd: float  # standard deviation of the readings
    readings: int
    interval: tuple[float, float] | None  # t interval from block means; None where there are too few blocks


def mean_of(values: Array, rate: float, common: float, settings: AnalysisSettings) -> Mean:
    """Return the mean of values (n,), leaving out nan, with an interval that allows for neighbours being alike.

    `common` is the standard uncertainty that all values share.
    """
    held = values[np.isfinite(values)]
    mean = float(held.mean())
    blocks = block_means(values[:, None], rate, settings)[:, 0]
    interval = None
    if len(blocks) >= _FEWEST_BLOCKS:
        from scipy.special import stdtrit  # slow to load, and neither window nor recorder has need of it

        further, free = strays(blocks)
        error = further * float(blocks.std(ddof=1)) / len(blocks) ** 0.5
        whole = float(np.hypot(error, common))
        # Only the blocks' part has few degrees of freedom (Welch 1947 and Satterthwaite 1946, as in JCGM 100, G.4.1).
        free *= (whole / error) ** 4 if error > 0.0 else np.inf
        half = float(stdtrit(min(free, _MANY_FREE), 0.5 + settings.confidence / 2) * whole)
        interval = (mean - half, mean + half)
    return Mean(mean, float(held.std(ddof=1)), len(held), interval)


def strays(blocks: Array) -> tuple[float, float]:
    """Return how much further than that of independent blocks (k,) their mean strays, and its degrees of freedom.

    Neighbours that are alike count for fewer: of a first-order autoregression n (1 - r) / (1 + r) are independent
    (Bayley and Hammersley 1946, Suppl. J. R. Stat. Soc. 8:184). Found in n blocks about their own mean, r comes out too
    small by (1 + 4 r) / n (Marriott and Pope 1954, Biometrika 41:390; Kendall 1954, 41:403), which is put right here.
    """
    n = len(blocks)
    off = blocks - blocks.mean()
    squares = float(off @ off)
    found = 0.0 if squares == 0.0 else float(off[1:] @ off[:-1]) / squares
    alike = min(max((found + 1.0 / n) / (1.0 - 4.0 / n), 0.0), _ALIKE) if n > 4 else _ALIKE
    further = ((1.0 + alike) / (1.0 - alike)) ** 0.5
    return further, max(n / further**2 - 1.0, _LEAST_FREE)


@dataclass(frozen=True, slots=True)
class Movement:
    """Straight movement over a window."""

    along: tuple[float, float]  # velocity along x and y [mm/s]
    speed: float  # [mm/s]
    error: float  # standard error of the speed [mm/s]
    explained: float  # share of the movement's variance that the straight line explains [-]


def movement(time: Array, position: Array, rate: float, settings: AnalysisSettings) -> Movement | None:
    """Return the regression of position (n, 2) [mm] on time (n,) [s] over block means; None where there are too few."""
    blocks = block_means(np.column_stack([time, position]), rate, settings)
    if len(blocks) < _FEWEST_BLOCKS:
        return None
    t = blocks[:, 0] - blocks[:, 0].mean()
    moved = blocks[:, 1:] - blocks[:, 1:].mean(axis=0)
    spread = float(t @ t)
    slope = t @ moved / spread
    rest = moved - t[:, None] * slope
    speed = float(np.hypot(*slope))
    # Scatter along the path is what makes the speed uncertain.
    direction = slope / speed if speed > 0.0 else np.array([1.0, 0.0])
    error = float(np.sqrt(((rest @ direction) ** 2).sum() / (len(blocks) - 2) / spread))
    variance = float((moved**2).sum())
    explained = 1.0 - float((rest**2).sum()) / variance if variance > 0.0 else 0.0
    return Movement((float(slope[0]), float(slope[1])), speed, error, explained)


def displacement(position: Array) -> float:
    """Return how far position (n, 2) [mm] lies apart between the first and the last fifth of its readings.

    nan where it is not known.
    """
    held = position[np.isfinite(position).all(axis=1)]
    fifth = max(1, len(held) // 5)
    if len(held) < 2 * fifth:
        return float("nan")
    return float(np.hypot(*(held[-fifth:].mean(axis=0) - held[:fifth].mean(axis=0))))


def block_means(values: Array, rate: float, settings: AnalysisSettings) -> Array:
    """Return the means (k, m) of values (n, m) over whole blocks, leaving out readings with nan."""
    held = values[np.isfinite(values).all(axis=1)]
    length = max(1, round(settings.block * rate))
    whole = len(held) // length
    return held[: whole * length].reshape(whole, length, values.shape[1]).mean(axis=1)
