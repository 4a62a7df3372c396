"""Which readings of a block can be used: what was lost, froze, saturated, or came at uneven times."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drivers.readings import ReadingBlock
from drivers.transducer import StatusCount, StatusTable, TransducerInfo, flagged_words
from sessions.strokes.invalid_readings import (
    ConstantRun,
    at_the_same_value,
    constant_runs,
    repeated_readings,
    saturated_readings,
    spikes,
)
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.stroke import FlawName, Grade

if TYPE_CHECKING:
    from sessions.recording.reader import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_AXIS_NAMES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


@dataclass(frozen=True, slots=True)
class Gap:
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
    flaws: tuple[tuple[FlawName, str, Grade], ...]

    @property
    def refused(self) -> bool:
        """Say whether nothing of the block may be analysed."""
        return any(grade == "refused" for _, _, grade in self.flaws)


def signal_quality(block: ReadingBlock, info: TransducerInfo, settings: AnalysisSettings) -> SignalQuality:
    """Judge a block of at least two readings."""
    steps = np.diff(block.time)
    forward = steps[steps > 0.0]
    step = float(np.median(forward)) if len(forward) else np.nan
    beyond = saturated_readings(block, info)
    wild_axes = spikes(block.raw, settings.signal) & ~beyond[:, None]
    wild: Mask = np.asarray(wild_axes.any(axis=1), np.bool_)
    repeated = repeated_readings(block, settings.signal)
    stuck = constant_runs(block.time, block.raw, wild | beyond, settings.signal)
    frozen = repeated | at_the_same_value(block.raw, stuck, clipped=False)
    clipped = at_the_same_value(block.raw, stuck, clipped=True)
    saturated = beyond | clipped
    stalled = np.concatenate([[False], steps <= 0.0])
    good = ~(frozen | saturated | wild | stalled)
    long = (np.diff(block.sequence) == 1) & (steps > settings.signal.missing_step * step)
    # A few long steps are readings that a stream without numbers lost; as many as this are another rate.
    another = bool(long.mean() > settings.signal.uneven)
    widest = float(np.percentile(forward, 98)) if another else step
    broken = (np.diff(block.sequence) != 1) | (steps > settings.signal.missing_step * widest) | (steps <= 0.0)
    neighbours = steps[~broken]
    spread = np.ptp(np.percentile(neighbours, [2, 98])) if len(neighbours) else np.inf
    even = bool(not another and spread <= settings.signal.uneven * step)
    segments = _segments(good, broken)
    dead = tuple(
        name
        for name, column in zip(_AXIS_NAMES, block.raw[good].T, strict=True)
        if len(column) > settings.signal.frozen_readings and np.ptp(column) == 0.0
    )
    missing = np.diff(block.sequence) - 1
    lost = int(missing[missing > 0].sum())
    flaws = [
        *_loss_flaws(lost, len(block)),
        *_frozen_flaws(repeated, frozen, block.time, settings),
        *_fault_flaws(block, info.status),
        *_saturation_flaws(beyond & ~info.status.faulty(block.status), block.time),
        *_stuck_flaws(stuck, block.time),
        *_wild_flaws(wild_axes, block.time),
        *_dead_flaws(dead),
        *_time_flaws(step, even, int(stalled.sum())),
    ]
    return SignalQuality(
        1.0 / step if step > 0 else np.nan,
        even,
        good,
        saturated,
        tuple(_gap(a, b, block.time, frozen, saturated, wild) for a, b in pairwise(segments)),
        segments,
        dead,
        tuple(flaws),
    )


def _segments(good: Mask, broken: Mask) -> tuple[slice, ...]:
    """Return the stretches of good readings between which `broken` (n - 1,) marks no step."""
    starts = good & ~np.concatenate([[False], good[:-1] & ~broken])
    stops = good & ~np.concatenate([good[1:] & ~broken, [False]])
    return tuple(
        slice(int(start), int(stop) + 1)
        for start, stop in zip(np.flatnonzero(starts), np.flatnonzero(stops), strict=True)
    )


def _gap(before: slice, after: slice, time: Array, frozen: Mask, saturated: Mask, wild: Mask) -> Gap:
    hole = slice(before.stop, after.start)
    cause = FlawName.LOST_READINGS
    if frozen[hole].any():
        cause = FlawName.FROZEN
    elif saturated[hole].any():
        cause = FlawName.SATURATED
    elif wild[hole].any():
        cause = FlawName.WILD
    return Gap(float(time[before.stop - 1]), float(time[after.start]), cause)


_FlawParts = list[tuple[FlawName, str, Grade]]


def _loss_flaws(lost: int, arrived: int) -> _FlawParts:
    if not lost:
        return []
    share = 100 * lost / (lost + arrived)
    sentence = f"{lost} readings were lost ({share:.2g} %); nothing was filled in and no filter reaches across a gap."
    return [(FlawName.LOST_READINGS, sentence, "note")]


def _frozen_flaws(repeated: Mask, frozen: Mask, time: Array, settings: AnalysisSettings) -> _FlawParts:
    """Name readings that repeat all six numbers; from a share of frozen ones on, of any axis, refuse the rest too."""
    refused = float(frozen.mean()) >= settings.signal.frozen_refused
    flaws: _FlawParts = []
    if repeated.any():
        sentence = (
            f"{100 * float(repeated.mean()):.0f} % of the readings repeat the six numbers before them, first at "
            f"{time[repeated][0]:.2f} s: the sensor was frozen"
        )
        rest = ", and nothing is analysed." if refused else " there, and these readings are left out."
        flaws.append((FlawName.FROZEN, sentence + rest, "refused" if refused else "doubtful"))
    elif refused:
        share = 100 * float(frozen.mean())
        sentence = f"One axis or another was frozen in {share:.0f} % of the readings: nothing is analysed."
        flaws.append((FlawName.FROZEN, sentence, "refused"))
    return flaws


def _stuck_flaws(stuck: tuple[ConstantRun, ...], time: Array) -> _FlawParts:
    """Name each axis that was clipped or frozen by the first run that shows it."""
    flaws: _FlawParts = []
    for axis, clipped in dict.fromkeys((one.axis, one.clipped) for one in stuck):
        runs = [one for one in stuck if (one.axis, one.clipped) == (axis, clipped)]
        lasting = sum(float(time[one.last] - time[one.first]) for one in runs)
        sentence = (
            f"{_AXIS_NAMES[axis]} keeps one value bit for bit while other axes move, for {lasting:.2g} s in all, first "
            f"at {time[runs[0].first]:.2f} s, "
        )
        if clipped:
            sentence += (
                "and never goes beyond it: clipped. These readings are left out, and peaks that they may hide are not "
                "given."
            )
            flaws.append((FlawName.SATURATED, sentence, "doubtful"))
        else:
            sentence += "and moves before or after: frozen there. These readings are left out."
            flaws.append((FlawName.FROZEN, sentence, "doubtful"))
    return flaws


def _wild_flaws(wild: Mask, time: Array) -> _FlawParts:
    """Name the readings (n, 6) that stand far beyond all around them."""
    if not wild.any():
        return []
    at: Mask = np.asarray(wild.any(axis=1), np.bool_)
    axes = ", ".join(name for name, marked in zip(_AXIS_NAMES, wild.T, strict=True) if marked.any())
    count = int(at.sum())
    sentence = (
        f"{count} {'reading stands' if count == 1 else 'readings stand'} far beyond everything around on {axes}, first "
        f"at {time[at][0]:.3f} s: spikes, which are left out before filtering."
    )
    return [(FlawName.WILD, sentence, "doubtful")]


def _fault_flaws(block: ReadingBlock, table: StatusTable) -> _FlawParts:
    faulty = table.faulty(block.status)
    if not faulty.any():
        return []
    count = StatusCount(table)
    count.take(block.status[faulty])
    sentence = (
        f"{int(faulty.sum())} readings came while the device reported a fault, first at {block.time[faulty][0]:.2f} s: "
        f"{flagged_words(count.flagged)}; they are doubtful and left out."
    )
    return [(FlawName.DEVICE_FAULT, sentence, "doubtful")]


def _saturation_flaws(saturated: Mask, time: Array) -> _FlawParts:
    if not saturated.any():
        return []
    sentence = (
        f"{int(saturated.sum())} readings are saturated or marked invalid by the device, first at "
        f"{time[saturated][0]:.2f} s; they are left out, and a peak that they may hide is not given."
    )
    return [(FlawName.SATURATED, sentence, "doubtful")]


def _dead_flaws(dead: tuple[str, ...]) -> _FlawParts:
    if not dead:
        return []
    names = ", ".join(dead)
    if any(name.startswith("F") for name in dead):
        return [(FlawName.DEAD, f"{names} never changed: a dead sensor, and nothing is analysed.", "refused")]
    return [(FlawName.DEAD, f"{names} never changed: no centre of pressure, hence no speed.", "doubtful")]


def _time_flaws(step: float, even: bool, stalled: int) -> _FlawParts:
    if not step > 0.0:
        return [(FlawName.UNKNOWN_RATE, "The device's time does not advance: nothing can be timed.", "refused")]
    flaws: _FlawParts = []
    if stalled:
        sentence = f"At {stalled} readings the device's time did not advance; they are left out."
        flaws.append((FlawName.IRREGULAR_TIME, sentence, "doubtful"))
    if not even:
        sentence = f"The time steps are uneven about {1000 * step:.3g} ms: forces are not filtered."
        flaws.append((FlawName.IRREGULAR_TIME, sentence, "doubtful"))
    return flaws


def doubtful_readings(recording: "Recording") -> Iterator[str]:
    """Yield a sentence, the flaw's name first, for each cause that makes recorded readings doubtful."""
    if recording.info is None:
        return
    count = StatusCount(recording.info.status)
    for block in recording.blocks():
        count.take(block.status)
    words = flagged_words(count.flagged)
    if faulty := count.verdicts["doubtful"]:
        yield f"{FlawName.DEVICE_FAULT}: {faulty} readings are doubtful, the device reported a fault: {words}"
    if saturated := count.verdicts["saturated"]:
        yield f"{FlawName.SATURATED}: {saturated} readings are invalid, as the device reported: {words}"
    if unsure := sum(event.data.get("off_units", 0) for event in recording.events if event.kind == "losses"):
        yield (
            f"{FlawName.RECORDING}: the last {unsure} readings of a stream are doubtful, the device was found to "
            "count in other units; leave them out"
        )
