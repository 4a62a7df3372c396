"""The readings of one trial, or of a recording without trials, made ready: sound ones only, in the face frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from sessions.plan.plan import Frame
from sessions.strokes.contacts import Contact
from sessions.strokes.flaws import FlawName
from sessions.strokes.forces import Filter, in_face_frame, level
from sessions.strokes.onset import NORMAL_STEP
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.signal_quality import SignalQuality
from sessions.strokes.zero import QuietWindows, Zero, quiet_windows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """n sound readings; bad ones are left out."""

    time: Array  # (n,) [s, device time]
    wrench: Array  # (n, 6) face frame, as felt, not zeroed [N, N mm]
    smooth: Array  # (n, 6) the same, filtered; nan in stretches too short for the filter
    rate: float  # [Hz]
    filtered: str  # what the filter did
    windows: QuietWindows
    quality: SignalQuality
    saturated_at: Array  # times of readings left out because they were saturated [s]
    torque_step: float  # least step of a torque [N mm]; 0 where it is too fine to matter


def span_of(
    block: ReadingBlock, sound: SignalQuality, calibration: Calibration, frame: Frame, settings: AnalysisSettings
) -> Span:
    """Return the sound readings of a block."""
    good = sound.good
    time = block.time[good]
    wrench = level(in_face_frame(calibration.wrench(block.raw[good], np.zeros(6)), frame), settings.tilt)
    place = np.concatenate([[0], np.cumsum(good)])
    segments = [slice(int(place[s.start]), int(place[s.stop])) for s in sound.segments]
    smoother = Filter(settings.filter.cut_off, settings.filter.shortest_segment)
    if not sound.even:
        smooth, filtered = wrench, "not filtered: the time steps are uneven"
    elif not smoother.fits(sound.rate):
        smooth, filtered = wrench, f"not filtered: {sound.rate:.3g} readings a second are too few for it"
    else:
        smooth, filtered = smoother.apply(wrench, sound.rate, segments), smoother.sentence
    return Span(
        time,
        wrench,
        smooth,
        sound.rate,
        filtered,
        quiet_windows(time, wrench, sound.rate, settings),
        sound,
        block.time[sound.saturated],
        _least_step(wrench[:, 3:]),
    )


def _least_step(torques: Array) -> float:
    """Return the least step between different readings of a torque, if steps are few enough to be seen."""
    largest = 0.0
    for column in torques.T:
        levels = np.unique(column)
        if 1 < len(levels) < len(column) / 2:  # most values come more than once: the steps are the sensor's own
            largest = max(largest, float(np.median(np.diff(levels))))
    return largest


@dataclass(frozen=True, slots=True, eq=False)
class StrokeZero:
    """The zero that a stroke is measured from."""

    level: Array  # (6,) face frame [N, N mm]
    noise: Array  # (6,) [N, N mm]
    filtered: Array  # (3,) noise of the filtered forces [N]
    lasts: float  # what the noise was told from [s]
    error: Array  # (6,) standard uncertainty of the level during the stroke [N, N mm]
    origin: str  # where it came from, for people
    drift: Array | None  # (6,) after minus before; None where one of the two was not seen
    unsure: tuple[float, float]  # how far unloaded forces near the stroke lie from it: sideways, along the normal [N]
    flaw: FlawName | None


def zero_for(span: Span, contact: Contact, idle: Mask, settings: AnalysisSettings) -> StrokeZero | None:
    """Return the zero for a stroke from the unloaded stretches around it; None where there is none.

    `idle` (n,) marks the readings in which nothing presses.
    """
    onset, lift = contact.onset, contact.lift
    before = None if onset is None else span.windows.before(onset, settings.zero.zero_stretch)
    after = None if lift is None else span.windows.after(lift, settings.zero.zero_stretch)
    if before is not None and after is not None:
        # Taken to be half-way; it may lie anywhere between the two, hence a rectangular distribution's deviation. What
        # noise alone makes of the difference is no drift.
        drift = after.level - before.level
        level = before.level + drift / 2.0
        noise = before.error**2 + after.error**2
        error = np.sqrt(noise / 4.0 + np.maximum(drift**2 - noise, 0.0) / 12.0)
        origin = f"half-way from unloaded before contact, {before.when}, to after it, {after.when}"
        unsure = _unsure(span, contact, idle, level, drift, settings)
        return StrokeZero(level, before.noise, *_filtered(span, before), error, origin, drift, unsure, None)
    if before is not None:
        origin = f"unloaded before contact, {before.when}"
        unsure = _unsure(span, contact, idle, before.level, None, settings)
        return StrokeZero(
            before.level, before.noise, *_filtered(span, before), before.error, origin, None, unsure, None
        )
    if after is not None:
        origin = f"unloaded after contact, {after.when}"
        unsure = _unsure(span, contact, idle, after.level, None, settings)
        return StrokeZero(
            after.level,
            after.noise,
            *_filtered(span, after),
            after.error,
            origin,
            None,
            unsure,
            FlawName.ZERO_AFTER_CONTACT,
        )
    return None


def _filtered(span: Span, zero: Zero) -> tuple[Array, float]:
    """Return the noise (3,) of filtered forces [N] where nothing pressed, and how long that was seen [s]."""
    part = (span.time >= zero.start) & (span.time <= zero.stop)
    return np.nanstd(span.smooth[part, :3], axis=0), zero.stop - zero.start


def _unsure(
    span: Span, contact: Contact, idle: Mask, level: Array, drift: Array | None, settings: AnalysisSettings
) -> tuple[float, float]:
    """Return how far from a zero the forces lie near a contact where nothing presses, and in the valleys beside it."""
    first, last = span.time[contact.start], span.time[contact.stop - 1]
    near = idle & (span.time >= first - settings.zero.near) & (span.time <= last + settings.zero.near)
    near[list(contact.valleys)] = True
    away = span.smooth[near, :3] - level[:3]
    away = away[np.isfinite(away).all(axis=1)]
    offsets = [(float(np.hypot(*drift[:2])), abs(float(drift[2])))] if drift is not None else []
    if len(away):
        sideways = np.hypot(away[:, 0], away[:, 1])
        offsets.append((float(np.percentile(sideways, 90)), float(np.percentile(np.abs(away[:, 2]), 90))))
    return max((s for s, _ in offsets), default=0.0), max((n for _, n in offsets), default=0.0)


def recorded_zero(span: Span, *, stated: bool) -> StrokeZero:
    """Return the recording's own zero, which counts only where somebody stated that nothing touched when it was set."""
    steps = np.abs(np.diff(span.wrench, axis=0))
    noise = NORMAL_STEP * np.median(steps, axis=0) if len(steps) else np.zeros(6)
    origin = "as recorded, stated to be true" if stated else "as recorded, unknown"
    flaw = None if stated else FlawName.NO_UNLOADED_STRETCH
    return StrokeZero(np.zeros(6), noise, noise[:3], 0.0, np.zeros(6), origin, None, (0.0, 0.0), flaw)
