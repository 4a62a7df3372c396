"""Which readings of a block can be used: what was lost, froze, saturated, or came at uneven times."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drivers.arrays import Array, Mask
from drivers.calibration_file import AXES
from drivers.readings import ReadingBlock
from drivers.transducer import StatusCount, StatusTable, TransducerInfo, flagged_words
from sessions.recording import Recording
from sessions.strokes import invalid_readings as invalid
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.stroke import Flaw, FlawName, significant


class Gap(NamedTuple):
    """Where readings are missing or cannot be used."""

    start: float  # last sound reading before it [s, device time]
    stop: float  # first one after it
    cause: FlawName


@dataclass(frozen=True, slots=True, eq=False)
class SignalQuality:
    """What a block's readings are worth; n of them."""

    rate: float  # readings a second, from the median time step [Hz]
    even: bool  # the time steps are equal
    good: Mask  # (n,) readings that can be used
    saturated: Mask  # (n,)
    gaps: tuple[Gap, ...]
    segments: tuple[slice, ...]  # stretches of good readings without a gap
    dead: tuple[str, ...]  # axes that never moved
    flaws: tuple[Flaw, ...]


def signal_quality(block: ReadingBlock, info: TransducerInfo, settings: AnalysisSettings) -> SignalQuality:
    """Judge a block of at least two readings."""
    steps = np.diff(block.time)
    forward_steps = steps[steps > 0.0]
    step = float(np.median(forward_steps)) if len(forward_steps) else np.nan
    out_of_range = invalid.saturated_readings(block, info)
    wild_axes = invalid.spikes(block.raw, settings.signal) & ~out_of_range[:, None]
    wild: Mask = np.asarray(wild_axes.any(axis=1), np.bool_)
    repeats = invalid.repeated_readings(block, settings.signal)
    constant = invalid.constant_runs(block.time, block.raw, wild | out_of_range, settings.signal)
    frozen = repeats | invalid.constant_readings(block.raw, constant, clipped=False)
    saturated = out_of_range | invalid.constant_readings(block.raw, constant, clipped=True)
    stalls = np.concatenate([[False], steps <= 0.0])
    good = ~(frozen | saturated | wild | stalls)
    long_steps = (np.diff(block.sequence) == 1) & (steps > settings.signal.missing_step * step)
    # A few long steps are readings that a stream without numbers lost; as many as this are another rate.
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
    """Yield what is wrong with readings (n,) as a whole; from a share of frozen ones on all are refused."""
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


def _axis_flaws(
    constant: tuple[invalid.ConstantRun, ...], wild: Mask, dead: tuple[str, ...], time: Array
) -> Iterator[Flaw]:
    """Yield which axes stuck, by the first run that shows it, had wild readings (n, 6), or never moved."""
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
        spikes = wild.any(axis=1)
        axes = ", ".join(name for name, mask in zip(AXES, wild.T, strict=True) if mask.any())
        phrase = "reading stands" if spikes.sum() == 1 else "readings stand"
        sentence = (
            f"{spikes.sum()} {phrase} far beyond everything around on {axes}, first at {time[spikes][0]:.3f} s: "
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
