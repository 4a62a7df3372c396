"""Readings that cannot be used: spikes, frozen or clipped axes, repeats of a frozen sensor, saturation."""

from typing import NamedTuple

import numpy as np

from drivers.arrays import Array, Indices, Mask
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.strokes.contacts import NORMAL_STEP
from sessions.strokes.settings import SignalSettings


def spikes(raw: Array, settings: SignalSettings) -> Mask:
    """Mark the wild readings of each axis (n, k): beyond all neighbours by far more than these differ themselves."""
    marks = np.zeros(raw.shape, np.bool_)
    for axis in range(raw.shape[1]):
        column = raw[:, axis]
        steps = np.abs(np.diff(column))
        changes = steps[steps > 0.0]
        if not len(changes):
            continue
        noise = NORMAL_STEP * float(np.median(steps))
        floor = max(settings.wild_noise * noise, settings.wild_coarse * float(changes.min()))
        candidates = [
            (start, width)
            for width in range(1, settings.wild_widest + 1)
            for start in _candidates(np.diff(column), width, floor, settings).tolist()
        ]
        suspect = np.zeros(len(column), np.bool_)  # these may be wild: none of them says what is usual around another
        for start, width in candidates:
            suspect[start : start + width] = True
        for start, width in candidates:
            if not marks[start : start + width, axis].any() and _stands_out(column, suspect, start, width, settings):
                marks[start : start + width, axis] = True
    return marks


def _candidates(steps: Array, width: int, floor: float, settings: SignalSettings) -> Indices:
    """Return where `width` readings begin that steps of more than `floor` enter and leave, away from both ends."""
    jump, return_jump = steps[:-width], steps[width:]
    starts = np.flatnonzero((np.minimum(np.abs(jump), np.abs(return_jump)) > floor) & (jump * return_jump < 0.0)) + 1
    return starts[(starts >= settings.wild_neighbours) & (starts + width + settings.wild_neighbours <= len(steps) + 1)]


def _stands_out(column: Array, suspect: Mask, start: int, width: int, settings: SignalSettings) -> bool:
    """Say whether readings stand out by far more than any step around them between readings that are not `suspect`."""
    around, stop = settings.wild_around, start + width
    stretches = (slice(max(start - around, 0), start), slice(stop, stop + around))
    earlier, later = (column[stretch][~suspect[stretch]] for stretch in stretches)
    usual = np.abs(np.concatenate([np.diff(earlier), np.diff(later)]))
    if len(usual) < settings.wild_fewest or min(len(earlier), len(later)) < settings.wild_neighbours:
        return False
    neighbours = np.concatenate([earlier[-settings.wild_neighbours :], later[: settings.wild_neighbours]])
    inside = column[start:stop]
    height = max(float(inside.min() - neighbours.max()), float(neighbours.min() - inside.max()))
    return height > settings.wild_steps * float(usual.max())


class ConstantRun(NamedTuple):
    """A run of one axis at one value while the other axes move."""

    axis: int
    clipped: bool  # at its own least or greatest value; else frozen
    first: int  # reading
    last: int
    value: float  # raw


def constant_runs(time: Array, raw: Array, skip: Mask, settings: SignalSettings) -> tuple[ConstantRun, ...]:
    """Return the runs of one value on single axes of raw (n, k) at `time` (n,) [s].

    A run counts where it is long against the runs that its axis shows elsewhere, so that coarse steps are no fault.
    Readings to `skip` (n,) are no axis' greatest or least value.
    """
    return tuple(run for axis in range(raw.shape[1]) for run in _axis_runs(axis, time, raw, skip, settings))


def constant_readings(raw: Array, runs: tuple[ConstantRun, ...], *, clipped: bool) -> Mask:
    """Mark the readings (n,) of frozen runs; or, `clipped`, all those at a value at which an axis was clipped."""
    marks = np.zeros(len(raw), np.bool_)
    for run in runs:
        if clipped and run.clipped:
            marks |= raw[:, run.axis] == run.value
        elif not clipped and not run.clipped:
            marks[run.first + 1 : run.last + 1] = True
    return marks


def _axis_runs(axis: int, time: Array, raw: Array, skip: Mask, settings: SignalSettings) -> list[ConstantRun]:
    column = raw[:, axis]
    firsts = np.flatnonzero(np.concatenate([[True], np.diff(column) != 0.0]))
    lasts = np.concatenate([firsts[1:], [len(column)]]) - 1
    lengths = lasts - firsts + 1
    durations = time[lasts] - time[firsts]
    # Times are sums of ticks, so a run as long as the limit may seem a little shorter.
    candidates = np.flatnonzero((lengths >= settings.flat_readings) & (durations > settings.flat_top - 1e-9))
    if not len(candidates) or len(firsts) == 1:
        return []
    sound = column[~skip]
    extremes = (float(sound.min()), float(sound.max())) if len(sound) else ()
    results: list[ConstantRun] = []
    for value in np.unique(column[firsts[candidates]]).tolist():
        runs = candidates[column[firsts[candidates]] == value]
        spans = [(int(firsts[run]), int(lasts[run])) for run in runs]
        others_live = np.array([_others_move(axis, time, raw, span, settings) for span in spans])
        live_runs = runs[others_live]
        if durations[live_runs].sum() <= durations[runs].sum() / 2.0:  # what the axis reads where nothing presses
            continue
        for run in live_runs.tolist():
            clipped = value in extremes
            frozen = lengths[run] > settings.frozen_readings and durations[run] >= settings.frozen_shortest
            elsewhere = lengths[~np.isin(column[firsts], extremes)] if clipped else lengths[2 * lengths < lengths[run]]
            is_long = lengths[run] > settings.long_run * (_usual_length(elsewhere) - 1.0)
            if (clipped or frozen) and is_long and _jumps(column, int(firsts[run]), int(lasts[run]), settings):
                results.append(ConstantRun(axis, clipped, int(firsts[run]), int(lasts[run]), value))
    return results


def _usual_length(lengths: Indices) -> float:
    """Return the length of run that nine tenths of all readings do not exceed; without readings none is unusual."""
    if not len(lengths):
        return np.inf
    ascending = np.sort(lengths)
    return float(ascending[np.searchsorted(np.cumsum(ascending), 0.9 * ascending.sum())])


def _jumps(column: Array, start: int, stop: int, settings: SignalSettings) -> bool:
    """Say whether a run begins or ends by more than a few of its axis' least steps: a slow turn does neither."""
    steps = np.abs(np.diff(column))
    least_step = float(steps[steps > 0.0].min())
    edges = [float(steps[step]) for step in (start - 1, stop) if 0 <= step < len(steps)]
    return max(edges, default=0.0) > settings.flat_jump * least_step


def _others_move(axis: int, time: Array, raw: Array, run: tuple[int, int], settings: SignalSettings) -> bool:
    """Say whether other axes live during a run, and some of them moves by more than its noise around it."""
    start, stop = run
    other_axes = np.delete(raw, axis, axis=1)
    alive = (np.diff(other_axes[start : stop + 1], axis=0) != 0.0).any(axis=1)
    if alive.mean() < 0.5:
        return False
    margin = max(0.0, settings.flat_around - (time[stop] - time[start])) / 2.0
    window = other_axes[(time >= time[start] - margin) & (time <= time[stop] + margin)]
    steps = np.abs(np.diff(window, axis=0))
    noise = NORMAL_STEP * np.median(steps, axis=0)
    least = np.array([float(column[column > 0.0].min(initial=np.inf)) for column in steps.T])
    return bool((window.std(axis=0) > np.maximum(settings.flat_moves * noise, least)).any())


def repeated_readings(block: ReadingBlock, settings: SignalSettings) -> Mask:
    """Mark every repeat of the same six numbers in a run that neither noise nor a rest in coarse steps explains."""
    jumps = _coarse_jumps(block.raw, settings)
    repeats = np.concatenate([[False], (np.diff(block.raw, axis=0) == 0.0).all(axis=1), [False]])
    edges = np.flatnonzero(np.diff(repeats.astype(np.int8)))
    frozen = np.zeros(len(block), np.bool_)
    rests: list[int] = []
    for start, stop in edges.reshape(-1, 2).tolist():  # repeats of the reading at `start`
        duration = block.time[stop] - block.time[start]
        if stop - start >= settings.frozen_readings and duration >= settings.frozen_shortest:
            jumped = not len(jumps) or bool(jumps[max(start - 1, 0) : start].any() or jumps[stop : stop + 1].any())
            at_end = stop == len(block) - 1
            displaced = np.abs(block.raw[rests] - block.raw[start]) > settings.frozen_off * np.ptp(block.raw, axis=0)
            # Where some axis lies far from where it lay in each rest before it is pressed, or was.
            frozen[start + 1 : stop + 1] = jumped or (at_end and bool(rests) and bool(displaced.any(axis=1).all()))
            rests += [] if frozen[stop] else [start]
    return frozen


def _coarse_jumps(raw: Array, settings: SignalSettings) -> Mask:
    """Mark the steps (n - 1,) that no axis in coarse steps makes by itself; empty where the steps are fine.

    Steps are coarse where an axis that changes does so by its least step or little more: at rest such a sensor repeats
    all six numbers, and leaves them step by step, where a frozen one that lives again jumps.
    """
    steps = np.abs(np.diff(raw, axis=0))
    changes = [column[column > 0.0] for column in steps.T]
    non_empty = [column for column in changes if len(column)]
    if not non_empty or any(np.median(column) > settings.coarse_steps * column.min() for column in non_empty):
        return np.zeros(0, np.bool_)
    usual = np.array([float(np.percentile(column, 95)) if len(column) else np.inf for column in changes])
    return np.asarray((steps > settings.coarse_jump * usual).any(axis=1), np.bool_)


def saturated_readings(block: ReadingBlock, info: TransducerInfo) -> Mask:
    """Mark readings the device called invalid, and those outside the rated range, where one is stated."""
    calibration = info.calibration
    wrench = calibration.in_own_frame(calibration.wrench(block.raw, np.zeros(6)))
    return info.status.doubtful(block.status) | (np.abs(wrench) > calibration.rated).any(axis=1)
