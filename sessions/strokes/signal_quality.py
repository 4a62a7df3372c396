"""Usable readings of a block: losses, frozen and clipped sensors, repeats, spikes, uneven time steps."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drivers.arrays import Array, Indices, Mask
from drivers.calibration_file import AXES
from drivers.readings import ReadingBlock
from drivers.transducer import StatusCount, StatusTable, TransducerInfo, flagged_words
from sessions.recording import Recording
from sessions.strokes.contacts import NORMAL_STEP
from sessions.strokes.settings import AnalysisSettings, SignalSettings
from sessions.strokes.stroke import Flaw, FlawName, significant


class Gap(NamedTuple):
    """A stretch of missing or unusable readings."""

    start: float  # last sound reading before it [s, device time]
    stop: float  # first one after it
    cause: FlawName


class ConstantRun(NamedTuple):
    """A run of one axis at one value while the other axes move."""

    axis: int
    clipped: bool  # at the axis' least or greatest value; else frozen
    first: int  # reading
    last: int
    value: float  # raw


@dataclass(frozen=True, slots=True, eq=False)
class SignalQuality:
    """Quality of the n readings of a block."""

    rate: float  # readings a second, from the median time step [Hz]
    even: bool  # the time steps are equal
    good: Mask  # (n,) readings that can be used
    saturated: Mask  # (n,)
    gaps: tuple[Gap, ...]
    segments: tuple[slice, ...]  # stretches of good readings without a gap
    dead: tuple[str, ...]  # axes that never changed
    flaws: tuple[Flaw, ...]


def signal_quality(block: ReadingBlock, info: TransducerInfo, settings: AnalysisSettings) -> SignalQuality:
    """Return the signal quality of a block of at least two readings."""
    steps = np.diff(block.time)
    forward_steps = steps[steps > 0.0]
    step = float(np.median(forward_steps)) if len(forward_steps) else np.nan
    out_of_range = saturated_readings(block, info)
    wild_axes = spikes(block.raw, settings.signal) & ~out_of_range[:, None]
    wild: Mask = np.asarray(wild_axes.any(axis=1), np.bool_)
    repeats = repeated_readings(block, settings.signal)
    constant = constant_runs(block.time, block.raw, wild | out_of_range, settings.signal)
    frozen = repeats | constant_readings(block.raw, constant, clipped=False)
    saturated = out_of_range | constant_readings(block.raw, constant, clipped=True)
    stalls = np.concatenate([[False], steps <= 0.0])
    good = ~(frozen | saturated | wild | stalls)
    long_steps = (np.diff(block.sequence) == 1) & (steps > settings.signal.missing_step * step)
    # A few long steps are losses of a stream without record numbers; more of them are another rate.
    other_rate = bool(long_steps.mean() > settings.signal.uneven)
    widest = float(np.percentile(forward_steps, 98)) if other_rate else step
    breaks = (np.diff(block.sequence) != 1) | (steps > settings.signal.missing_step * widest) | (steps <= 0.0)
    neighbours = steps[~breaks]
    spread = np.ptp(np.percentile(neighbours, [2, 98])) if len(neighbours) else np.inf
    even = bool(not other_rate and spread <= settings.signal.uneven * step)
    stretches = segments(good, breaks)
    dead = tuple(
        name
        for name, column in zip(AXES, block.raw[good].T, strict=True)
        if len(column) > settings.signal.frozen_readings and np.ptp(column) == 0.0
    )
    gaps = np.diff(block.sequence) - 1
    losses = int(gaps[gaps > 0].sum())
    flaws = (
        *_reading_flaws(block, losses, repeats, frozen, out_of_range, info.status, settings.signal.frozen_refused),
        *_axis_flaws(constant, wild_axes, dead, block.time),
        *_time_flaws(step, even, int(stalls.sum())),
    )
    return SignalQuality(
        1.0 / step if step > 0 else np.nan,
        even,
        good,
        saturated,
        tuple(_gap(*pair, block.time, frozen, saturated, wild) for pair in pairwise(stretches)),
        stretches,
        dead,
        flaws,
    )


def segments(good: Mask, breaks: Mask) -> tuple[slice, ...]:
    """Return the stretches of good readings (n,) within which `breaks` (n - 1,) marks no step."""
    joints = good[1:] & good[:-1] & ~breaks
    starts = np.flatnonzero(good & ~np.concatenate([[False], joints]))
    stops = np.flatnonzero(good & ~np.concatenate([joints, [False]])) + 1
    return tuple(slice(start, stop) for start, stop in zip(starts.tolist(), stops.tolist(), strict=True))


def _gap(previous: slice, following: slice, time: Array, frozen: Mask, saturated: Mask, wild: Mask) -> Gap:
    between = slice(previous.stop, following.start)
    marks = ((frozen, FlawName.FROZEN), (saturated, FlawName.SATURATED), (wild, FlawName.WILD))
    cause = next((name for mask, name in marks if mask[between].any()), FlawName.LOST_READINGS)
    return Gap(float(time[previous.stop - 1]), float(time[following.start]), cause)


def _reading_flaws(
    block: ReadingBlock, losses: int, repeats: Mask, frozen: Mask, saturated: Mask, table: StatusTable, refusal: float
) -> Iterator[Flaw]:
    """Yield the flaws of readings (n,) as a whole; above a share of frozen ones all are refused."""
    if losses:
        share = 100 * losses / (losses + len(block))
        sentence = (
            f"{losses} readings were lost ({share:.2g} %); nothing was filled in and no filter reaches across a gap."
        )
        yield Flaw(FlawName.LOST_READINGS, sentence, "note")
    refused = float(frozen.mean()) >= refusal
    if repeats.any():
        sentence = (
            f"{100 * float(repeats.mean()):.0f} % of the readings repeat the six numbers before them, first at "
            f"{block.time[repeats][0]:.2f} s: the sensor was frozen"
        )
        consequence = ", and nothing is analysed." if refused else " there, and these readings are left out."
        yield Flaw(FlawName.FROZEN, sentence + consequence, "refused" if refused else "doubtful")
    elif refused:
        share = 100 * float(frozen.mean())
        sentence = f"One axis or another was frozen in {share:.0f} % of the readings: nothing is analysed."
        yield Flaw(FlawName.FROZEN, sentence, "refused")
    faulty = table.faulty(block.status)
    if faulty.any():
        count = StatusCount(table)
        count.take(block.status[faulty])
        sentence = (
            f"{int(faulty.sum())} readings came while the device reported a fault, first at "
            f"{block.time[faulty][0]:.2f} s: {flagged_words(count.flagged)}; they are doubtful and left out."
        )
        yield Flaw(FlawName.DEVICE_FAULT, sentence, "doubtful")
    saturated = saturated & ~faulty
    if saturated.any():
        sentence = (
            f"{int(saturated.sum())} readings are saturated or marked invalid by the device, first at "
            f"{block.time[saturated][0]:.2f} s; they are left out, and a peak that they may hide is not given."
        )
        yield Flaw(FlawName.SATURATED, sentence, "doubtful")


def _axis_flaws(constant: tuple[ConstantRun, ...], wild: Mask, dead: tuple[str, ...], time: Array) -> Iterator[Flaw]:
    """Yield flaws of axes that were frozen or clipped, had wild readings (n, 6), or never changed."""
    for axis, clipped in dict.fromkeys((run.axis, run.clipped) for run in constant):
        runs = [run for run in constant if (run.axis, run.clipped) == (axis, clipped)]
        duration = sum(float(time[run.last] - time[run.first]) for run in runs)
        detail = (
            "never goes beyond it: clipped. These readings are left out, and peaks that they may hide are not given."
            if clipped
            else "moves before or after: frozen there. These readings are left out."
        )
        sentence = (
            f"{AXES[axis]} keeps one value bit for bit while other axes move, for {significant(duration, 2)} s "
            f"in all, first at {time[runs[0].first]:.2f} s, and {detail}"
        )
        yield Flaw(FlawName.SATURATED if clipped else FlawName.FROZEN, sentence, "doubtful")
    if wild.any():
        any_axis = wild.any(axis=1)
        axes = ", ".join(name for name, mask in zip(AXES, wild.T, strict=True) if mask.any())
        phrase = "reading stands" if any_axis.sum() == 1 else "readings stand"
        sentence = (
            f"{any_axis.sum()} {phrase} far beyond everything around on {axes}, first at {time[any_axis][0]:.3f} s: "
            "spikes, which are left out before filtering."
        )
        yield Flaw(FlawName.WILD, sentence, "doubtful")
    if dead:
        force = any(name.startswith("F") for name in dead)
        cost = "a dead sensor, and nothing is analysed" if force else "no centre of pressure, hence no speed"
        yield Flaw(FlawName.DEAD, f"{', '.join(dead)} never changed: {cost}.", "refused" if force else "doubtful")


def _time_flaws(step: float, even: bool, stall_count: int) -> Iterator[Flaw]:
    if not step > 0.0:
        yield Flaw(FlawName.UNKNOWN_RATE, "The device's time does not advance: nothing can be timed.", "refused")
        return
    if stall_count:
        sentence = f"At {stall_count} readings the device's time did not advance; they are left out."
        yield Flaw(FlawName.IRREGULAR_TIME, sentence, "doubtful")
    if not even:
        sentence = f"The time steps are uneven about {1000 * step:.3g} ms: forces are not filtered."
        yield Flaw(FlawName.IRREGULAR_TIME, sentence, "doubtful")


def doubtful_readings(recording: Recording) -> Iterator[str]:
    """Yield a sentence, the flaw's name first, for each cause that makes recorded readings doubtful."""
    if recording.info is None:
        return
    count = StatusCount(recording.info.status)
    for block in recording.blocks():
        count.take(block.status)
    causes = flagged_words(count.flagged)
    if faulty := count.verdicts["doubtful"]:
        yield f"{FlawName.DEVICE_FAULT}: {faulty} readings are doubtful, the device reported a fault: {causes}"
    if saturated := count.verdicts["saturated"]:
        yield f"{FlawName.SATURATED}: {saturated} readings are invalid, as the device reported: {causes}"
    if unsure := sum(event.data.get("off_units", 0) for event in recording.events if event.kind == "losses"):
        yield (
            f"{FlawName.RECORDING}: the last {unsure} readings of a stream are doubtful, the device was found to "
            "count in other units; leave them out"
        )


def spikes(raw: Array, settings: SignalSettings) -> Mask:
    """Mark the wild readings of each axis (n, k): far beyond all neighbours, relative to their own differences."""
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
        suspect = np.zeros(len(column), np.bool_)  # possibly wild readings do not count as usual neighbours
        for start, width in candidates:
            suspect[start : start + width] = True
        for start, width in candidates:
            if not marks[start : start + width, axis].any() and _stands_out(column, suspect, start, width, settings):
                marks[start : start + width, axis] = True
    return marks


def _candidates(steps: Array, width: int, floor: float, settings: SignalSettings) -> Indices:
    """Return starts of `width` readings entered and left by steps over `floor`, away from both ends."""
    jump, return_jump = steps[:-width], steps[width:]
    starts = np.flatnonzero((np.minimum(np.abs(jump), np.abs(return_jump)) > floor) & (jump * return_jump < 0.0)) + 1
    return starts[(starts >= settings.wild_neighbours) & (starts + width + settings.wild_neighbours <= len(steps) + 1)]


def _stands_out(column: Array, suspect: Mask, start: int, width: int, settings: SignalSettings) -> bool:
    """Say whether readings differ from both sides by far more than the steps around them, `suspect` ones left out."""
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


def constant_runs(time: Array, raw: Array, skip: Mask, settings: SignalSettings) -> tuple[ConstantRun, ...]:
    """Return the runs of one value on single axes of raw (n, k) at `time` (n,) [s].

    A run counts if it is long relative to other runs of its axis, so that coarse steps are no fault. Readings to `skip`
    (n,) do not count as an axis' greatest or least value.
    """
    return tuple(run for axis in range(raw.shape[1]) for run in _axis_runs(axis, time, raw, skip, settings))


def constant_readings(raw: Array, runs: tuple[ConstantRun, ...], *, clipped: bool) -> Mask:
    """Mark the readings (n,) of frozen runs; or, if `clipped`, all readings at a value where an axis was clipped."""
    marks = np.zeros(len(raw), np.bool_)
    for run in runs:
        if run.clipped is clipped:
            marks[raw[:, run.axis] == run.value if clipped else slice(run.first + 1, run.last + 1)] = True
    return marks


def _axis_runs(axis: int, time: Array, raw: Array, skip: Mask, settings: SignalSettings) -> list[ConstantRun]:
    column = raw[:, axis]
    firsts = np.flatnonzero(np.concatenate([[True], np.diff(column) != 0.0]))
    lasts = np.concatenate([firsts[1:], [len(column)]]) - 1
    lengths = lasts - firsts + 1
    durations = time[lasts] - time[firsts]
    # Times are sums of ticks, so a run at the limit may seem slightly shorter.
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
        if durations[live_runs].sum() <= durations[runs].sum() / 2.0:  # the axis' unloaded value
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
    """Return the run length below which nine tenths of all readings lie; infinity without readings."""
    if not len(lengths):
        return np.inf
    ascending = np.sort(lengths)
    return float(ascending[np.searchsorted(np.cumsum(ascending), 0.9 * ascending.sum())])


def _jumps(column: Array, start: int, stop: int, settings: SignalSettings) -> bool:
    """Say whether a run begins or ends with a jump of several least steps, unlike a slow reversal."""
    steps = np.abs(np.diff(column))
    least_step = float(steps[steps > 0.0].min())
    edges = [float(steps[step]) for step in (start - 1, stop) if 0 <= step < len(steps)]
    return max(edges, default=0.0) > settings.flat_jump * least_step


def _others_move(axis: int, time: Array, raw: Array, run: tuple[int, int], settings: SignalSettings) -> bool:
    """Say whether other axes change during a run, and one of them moves by more than its noise around it."""
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
            # A value far from every earlier rest on some axis is under load.
            frozen[start + 1 : stop + 1] = jumped or (at_end and bool(rests) and bool(displaced.any(axis=1).all()))
            rests += [] if frozen[stop] else [start]
    return frozen


def _coarse_jumps(raw: Array, settings: SignalSettings) -> Mask:
    """Mark the steps (n - 1,) that are jumps on a coarsely quantised axis; empty where steps are fine.

    Steps are coarse where an axis changes mostly by its least step or little more: at rest such a sensor repeats all
    six numbers and leaves them step by step, whereas a frozen sensor that recovers jumps.
    """
    steps = np.abs(np.diff(raw, axis=0))
    changes = [column[column > 0.0] for column in steps.T]
    non_empty = [column for column in changes if len(column)]
    if not non_empty or any(np.median(column) > settings.coarse_steps * column.min() for column in non_empty):
        return np.zeros(0, np.bool_)
    usual = np.array([float(np.percentile(column, 95)) if len(column) else np.inf for column in changes])
    return np.asarray((steps > settings.coarse_jump * usual).any(axis=1), np.bool_)


def saturated_readings(block: ReadingBlock, info: TransducerInfo) -> Mask:
    """Mark readings that the device reported as invalid, and those outside a stated rated range."""
    calibration = info.calibration
    wrench = calibration.in_own_frame(calibration.wrench(block.raw, np.zeros(6)))
    return info.status.doubtful(block.status) | (np.abs(wrench) > calibration.rated).any(axis=1)
