"""Single axes that stay at one value, bit for bit, while others move: clipped or frozen, whatever the rated range."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.settings import AnalysisSettings

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FEWEST = 4  # readings of a flat top
_AROUND = 0.15  # over so long the other axes must move [s]: where nothing presses they only make noise
_JUMP = 3.5  # least steps
_MOVES = 3.0  # moving: the spread is so many times the noise, told from steps between neighbours [-]
_NORMAL_STEP = 1.4826 / np.sqrt(2.0)  # standard deviation of white noise over the median step between neighbours


@dataclass(frozen=True, slots=True)
class Stuck:
    """One axis at one value; the other axes move meanwhile."""

    axis: int
    clipped: bool  # at its own least or greatest value; else frozen
    first: int  # reading
    last: int
    value: float  # raw


def stuck_axes(time: Array, raw: Array, ignored: Mask, settings: AnalysisSettings) -> tuple[Stuck, ...]:
    """Return the runs of one value on single axes of raw (n, k) at `time` (n,) [s].

    A run counts where it is long against the runs that its axis shows elsewhere, so that coarse steps are no fault.
    Readings `ignored` (n,) are no axis' greatest or least value.
    """
    return tuple(found for axis in range(raw.shape[1]) for found in _of_axis(axis, time, raw, ignored, settings))


def at_the_same_value(raw: Array, found: tuple[Stuck, ...], *, clipped: bool) -> Mask:
    """Mark the readings (n,) of frozen runs; or, `clipped`, all those at a value at which an axis was clipped."""
    marked = np.zeros(len(raw), np.bool_)
    for one in found:
        if one.clipped != clipped:
            continue
        if clipped:
            marked |= raw[:, one.axis] == one.value
        else:
            marked[one.first + 1 : one.last + 1] = True
    return marked


def _of_axis(axis: int, time: Array, raw: Array, ignored: Mask, settings: AnalysisSettings) -> list[Stuck]:
    column = raw[:, axis]
    firsts = np.flatnonzero(np.concatenate([[True], np.diff(column) != 0.0]))
    lasts = np.concatenate([firsts[1:], [len(column)]]) - 1
    lengths = lasts - firsts + 1
    lasting = time[lasts] - time[firsts]
    # Times are sums of ticks, so a run as long as the limit may seem a little shorter.
    candidates = np.flatnonzero((lengths >= _FEWEST) & (lasting > settings.flat_top - 1e-9))
    if not len(candidates) or len(firsts) == 1:
        return []
    sound = column[~ignored]
    ends = (float(sound.min()), float(sound.max())) if len(sound) else ()
    found: list[Stuck] = []
    for value in np.unique(column[firsts[candidates]]).tolist():
        runs = candidates[column[firsts[candidates]] == value]
        moving = np.array([_others_move(axis, time, raw, int(firsts[at]), int(lasts[at])) for at in runs])
        if lasting[runs[moving]].sum() <= lasting[runs].sum() / 2.0:  # what the axis reads where nothing presses
            continue
        for at in runs[moving].tolist():
            clipped = value in ends
            frozen = lengths[at] > settings.frozen_readings and lasting[at] >= settings.frozen_shortest
            elsewhere = lengths[~np.isin(column[firsts], ends)] if clipped else lengths[2 * lengths < lengths[at]]
            long = lengths[at] > settings.long_run * (_usual(elsewhere) - 1.0)
            if (clipped or frozen) and long and _jumps(column, int(firsts[at]), int(lasts[at])):
                found.append(Stuck(axis, clipped, int(firsts[at]), int(lasts[at]), value))
    return found


def _usual(lengths: NDArray[np.int64]) -> float:
    """Return the length of run that nine tenths of all readings do not exceed; without readings none is unusual."""
    if not len(lengths):
        return np.inf
    ordered = np.sort(lengths)
    return float(ordered[np.searchsorted(np.cumsum(ordered), 0.9 * ordered.sum())])


def _jumps(column: Array, first: int, last: int) -> bool:
    """Say whether a run begins or ends by more than a few of its axis' least steps: a slow turn does neither."""
    steps = np.abs(np.diff(column))
    least = float(steps[steps > 0.0].min())
    ends = [float(steps[at]) for at in (first - 1, last) if 0 <= at < len(steps)]
    return max(ends, default=0.0) > _JUMP * least


def _others_move(axis: int, time: Array, raw: Array, first: int, last: int) -> bool:
    """Say whether other axes live during a run, and some of them moves by more than its noise around it."""
    others = np.delete(raw, axis, axis=1)
    alive = (np.diff(others[first : last + 1], axis=0) != 0.0).any(axis=1)
    if alive.mean() < 0.5:
        return False
    lacking = max(0.0, _AROUND - (time[last] - time[first])) / 2.0
    window = others[(time >= time[first] - lacking) & (time <= time[last] + lacking)]
    steps = np.abs(np.diff(window, axis=0))
    noise = _NORMAL_STEP * np.median(steps, axis=0)
    least = np.array([float(each[each > 0.0].min(initial=np.inf)) for each in steps.T])
    return bool((window.std(axis=0) > np.maximum(_MOVES * noise, least)).any())
