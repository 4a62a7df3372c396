"""Single wild readings: one or two that stand far beyond everything around them, such as a glitch on a wire makes."""

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.settings import AnalysisSettings

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_WIDEST = 2  # readings; a force that lasts longer may be a touch
_BESIDE = 2  # readings on each side that a wild one stands out of
_AROUND = 20  # readings on each side whose steps tell what is usual there
_FEWEST = 8  # such steps; fewer tell nothing
_LEAST_STEPS = 4.0  # of a coarse axis
_NORMAL_STEP = 1.4826 / np.sqrt(2.0)  # standard deviation of white noise over the median step between neighbours


def wild_readings(raw: Array, settings: AnalysisSettings) -> Mask:
    """Mark the wild readings of each axis (n, k): beyond all neighbours by far more than these differ themselves."""
    marked = np.zeros(raw.shape, np.bool_)
    for axis in range(raw.shape[1]):
        column = raw[:, axis]
        steps = np.abs(np.diff(column))
        moving = steps[steps > 0.0]
        if not len(moving):
            continue
        floor = max(settings.wild_noise * _NORMAL_STEP * float(np.median(steps)), _LEAST_STEPS * float(moving.min()))
        found = [(at, w) for w in range(1, _WIDEST + 1) for at in _candidates(np.diff(column), w, floor).tolist()]
        alike = np.zeros(len(column), np.bool_)  # these may be wild: none of them says what is usual around another
        for at, width in found:
            alike[at : at + width] = True
        for at, width in found:
            if not marked[at : at + width, axis].any() and _wild(column, alike, at, width, settings):
                marked[at : at + width, axis] = True
    return marked


def _candidates(steps: Array, width: int, floor: float) -> NDArray[np.int64]:
    """Return where `width` readings begin that more than `floor` leads to and back from, with neighbours beside."""
    there, back = steps[:-width], steps[width:]
    found = np.flatnonzero((np.minimum(np.abs(there), np.abs(back)) > floor) & (there * back < 0.0)) + 1
    return found[(found >= _BESIDE) & (found + width + _BESIDE <= len(steps) + 1)]


def _wild(column: Array, alike: Mask, at: int, width: int, settings: AnalysisSettings) -> bool:
    """Say whether readings stand out by far more than any step around them between readings that are not `alike`."""
    before = _sound(column, alike, range(at - 1, max(-1, at - 1 - _AROUND), -1))
    after = _sound(column, alike, range(at + width, min(len(column), at + width + _AROUND)))
    usual = np.abs(np.concatenate([np.diff(before), np.diff(after)]))
    if len(usual) < _FEWEST or min(len(before), len(after)) < _BESIDE:
        return False
    beside = np.concatenate([before[:_BESIDE], after[:_BESIDE]])
    inside = column[at : at + width]
    height = max(float(inside.min() - beside.max()), float(beside.min() - inside.max()))
    return height > settings.wild_steps * float(usual.max())


def _sound(column: Array, alike: Mask, places: range) -> Array:
    """Return the readings at places, in their order, without those that are `alike`."""
    held = np.array(places, np.int64)
    return column[held[~alike[held]]]
