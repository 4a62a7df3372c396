"""Prepared readings of one trial, its unloaded stretches, and the readings of one contact with its zero."""

from dataclasses import dataclass, replace

import numpy as np

from drivers.arrays import Array, Indices, Mask
from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from sessions.plan.plan import Frame
from sessions.strokes.contacts import NORMAL_STEP, Contact, onset_threshold
from sessions.strokes.forces import Filter, centre_of_pressure, friction_ratio, in_face_frame, level
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.signal_quality import SignalQuality, segments
from sessions.strokes.stroke import FlawName, StrokeCurve


@dataclass(frozen=True, slots=True, eq=False)
class Zero:
    """The transducer's wrench with nothing touching."""

    start: float  # of the stretch it was taken from [s, device time]
    stop: float
    level: Array  # (6,) face frame [N, N mm]
    noise: Array  # (6,) standard deviations [N, N mm]
    error: Array  # (6,) standard errors of `level` [N, N mm]

    @property
    def period(self) -> str:
        """The stretch of time, for people."""
        return f"{self.start:.3f} to {self.stop:.3f} s"


def _quiet_windows(time: Array, wrench: Array, rate: float, settings: AnalysisSettings) -> Indices:
    """Return first and past-last reading of each unloaded window (k, 2) of a wrench (n, 6) at `time` (n,) [s].

    In these no force moves more than its noise, and the normal force is low.
    """
    length = max(settings.detector.baseline_readings, round(settings.detector.baseline * rate))
    if len(wrench) < length:
        return np.empty((0, 2), np.int64)
    starts = np.arange(0, len(wrench) - length + 1, max(1, length // settings.zero.quiet_hops))
    spread, noise = _spread(wrench[:, :3], starts, length)
    low, high = np.percentile(-wrench[:, 2], [0.5, 99.5])
    floor = max(settings.detector.quiet_floor, settings.zero.quiet_share * float(high - low))
    quiet = (spread <= np.maximum(settings.detector.quiet_noise * noise, floor)).all(axis=1)
    # A finger that slides with a steady force changes the torques alone, by the centre of pressure.
    torque_spread, torque_noise = _spread(wrench[:, 3:5], starts, length)
    torque_limit = settings.zero.quiet_moves * float(high - low)
    quiet &= (torque_spread <= np.maximum(settings.detector.quiet_noise * torque_noise, torque_limit)).all(axis=1)
    level = np.lib.stride_tricks.sliding_window_view(-wrench[:, 2], length)[starts].mean(axis=1)
    threshold = onset_threshold(float(np.median(noise[:, 2])), settings.detector)
    unloaded = level - low <= max(settings.zero.unloaded_share * (high - low), threshold)
    unbroken = time[starts + length - 1] - time[starts] <= settings.zero.quiet_gap * length / rate
    firsts = starts[quiet & unloaded & unbroken]
    return np.column_stack([firsts, firsts + length]).astype(np.int64)


def _spread(axes: Array, starts: Indices, length: int) -> tuple[Array, Array]:
    """Return the standard deviations (k, m) of axes (n, m) in windows from `starts` (k,), and their noise (k, m).

    Noise is estimated from the median step, which slow movement barely changes.
    """
    windows = np.lib.stride_tricks.sliding_window_view(axes, length, axis=0)[starts]  # (k, m, length)
    noise = NORMAL_STEP * np.median(np.abs(np.diff(windows, axis=2)), axis=2)
    return windows.std(axis=2, ddof=1), noise


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """n sound readings; bad ones are left out."""

    time: Array  # (n,) [s, device time]
    wrench: Array  # (n, 6) face frame, as measured, not zeroed [N, N mm]
    smooth: Array  # (n, 6) the same, filtered; nan in stretches too short for the filter
    rate: float  # [Hz]
    filtered: str  # description of the filter
    quiet: Indices  # (k, 2) first and past-last reading of each unloaded window, in order
    quality: SignalQuality
    saturation_times: Array  # times of readings left out because they were saturated [s]
    torque_step: float  # least step of a torque [N mm]; 0 where it is negligible
    frame: Frame  # of the face, in which the wrench is
    settings: AnalysisSettings


def span_of(
    block: ReadingBlock, sound: SignalQuality, calibration: Calibration, frame: Frame, settings: AnalysisSettings
) -> Span:
    """Return the sound readings of a block."""
    good = sound.good
    time = block.time[good]
    wrench = level(in_face_frame(calibration.wrench(block.raw[good], np.zeros(6)), frame), settings.tilt)
    positions = np.concatenate([[0], np.cumsum(good)])
    segments = [slice(int(positions[segment.start]), int(positions[segment.stop])) for segment in sound.segments]
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
        _quiet_windows(time, wrench, sound.rate, settings),
        sound,
        block.time[sound.saturated],
        _least_step(wrench[:, 3:]),
        frame,
        settings,
    )


def _least_step(torques: Array) -> float:
    """Return the least step between different readings of a torque, 0 where the steps are too fine to see."""
    # Where most values repeat, the steps are those of the sensor.
    levels = (column for column in map(np.unique, torques.T) if 1 < len(column) < len(torques) / 2)
    return max((float(np.median(np.diff(column))) for column in levels), default=0.0)


def zero_before(span: Span, instant: float) -> Zero | None:
    """Return the zero of the last unloaded windows that end by `instant` [s]; None without any."""
    return _zero_of(span, span.quiet[span.time[span.quiet[:, 1] - 1] < instant][::-1])


def zero_after(span: Span, instant: float) -> Zero | None:
    """Return the zero of the first unloaded windows that start after `instant` [s]; None without any."""
    return _zero_of(span, span.quiet[span.time[span.quiet[:, 0]] > instant])


def _zero_of(span: Span, windows: Indices) -> Zero | None:
    """Return the zero over the first of the windows (k, 2) and those that overlap, up to the longest stretch."""
    if not len(windows):
        return None
    start, stop = windows[0]
    for next_start, next_stop in windows[1:]:
        low, high = min(start, next_start), max(stop, next_stop)
        overlap = next_start <= stop and next_stop >= start
        if not overlap or span.time[high - 1] - span.time[low] > span.settings.zero.zero_stretch:
            break
        start, stop = low, high
    stretch = span.wrench[start:stop]
    noise = stretch.std(axis=0, ddof=1)
    times = float(span.time[start]), float(span.time[stop - 1])
    return Zero(*times, stretch.mean(axis=0), noise, noise / len(stretch) ** 0.5)


@dataclass(frozen=True, slots=True, eq=False)
class StrokeZero:
    """The zero of a stroke."""

    level: Array  # (6,) face frame [N, N mm]
    noise: Array  # (6,) [N, N mm]
    filtered: Array  # (3,) noise of the filtered forces [N]
    lasts: float  # duration of the stretch that gave the noise [s]
    error: Array  # (6,) standard uncertainty of the level during the stroke [N, N mm]
    origin: str = ""  # its source, for people
    drift: Array | None = None  # (6,) after minus before; None where one of them is missing
    unsure: tuple[float, float] = (0.0, 0.0)  # deviation of nearby unloaded forces: sideways, along the normal [N]
    flaw: FlawName | None = None


def zero_for(span: Span, contact: Contact, idle: Mask) -> StrokeZero | None:
    """Return a stroke's zero from unloaded stretches around it, if any; `idle` (n,) marks unloaded readings."""
    earlier = None if contact.onset is None else zero_before(span, contact.onset)
    following = None if contact.lift is None else zero_after(span, contact.lift)
    zero = earlier or following
    if zero is None:
        return None
    level, error, drift, flaw = zero.level, zero.error, None, None
    if earlier is not None and following is not None:
        # The zero is taken half-way; it is uniformly distributed between the two, hence a rectangular distribution's
        # deviation. A difference within the noise is no drift.
        drift = following.level - earlier.level
        level = earlier.level + drift / 2.0
        noise = earlier.error**2 + following.error**2
        error = np.sqrt(noise / 4.0 + np.maximum(drift**2 - noise, 0.0) / 12.0)
        origin = f"half-way from unloaded before contact, {earlier.period}, to after it, {following.period}"
    elif earlier is not None:
        origin = f"unloaded before contact, {earlier.period}"
    else:
        origin, flaw = f"unloaded after contact, {zero.period}", FlawName.ZERO_AFTER_CONTACT
    unsure = _unsure(span, contact, idle, level, drift)
    unloaded = span.smooth[(span.time >= zero.start) & (span.time <= zero.stop), :3]
    unloaded = unloaded[np.isfinite(unloaded).all(axis=1)]
    filtered = unloaded.std(axis=0) if len(unloaded) > 1 else zero.noise[:3]
    return StrokeZero(level, zero.noise, filtered, zero.stop - zero.start, error, origin, drift, unsure, flaw)


def _unsure(span: Span, contact: Contact, idle: Mask, level: Array, drift: Array | None) -> tuple[float, float]:
    """Return the deviation from zero of unloaded forces near a contact, and of forces in valleys at its ends."""
    first, last, margin = span.time[contact.start], span.time[contact.stop - 1], span.settings.zero.near
    nearby = idle & (span.time >= first - margin) & (span.time <= last + margin)
    nearby[list(contact.valleys)] = True
    forces = span.smooth[nearby, :3] - level[:3]
    forces = forces[np.isfinite(forces).all(axis=1)]
    sideways, normal = (0.0, 0.0) if drift is None else (float(np.hypot(*drift[:2])), abs(float(drift[2])))
    if len(forces):
        sideways = max(sideways, float(np.percentile(np.hypot(forces[:, 0], forces[:, 1]), 90)))
        normal = max(normal, float(np.percentile(np.abs(forces[:, 2]), 90)))
    return sideways, normal


def recorded_zero(span: Span, *, is_stated: bool) -> StrokeZero:
    """Return the recording's own zero; flawed unless somebody stated that nothing touched when it was set."""
    steps = np.abs(np.diff(span.wrench, axis=0))
    noise = NORMAL_STEP * np.median(steps, axis=0) if len(steps) else np.zeros(6)
    origin = "as recorded, stated to be true" if is_stated else "as recorded, unknown"
    flaw = None if is_stated else FlawName.NO_UNLOADED_STRETCH
    return StrokeZero(np.zeros(6), noise, noise[:3], 0.0, np.zeros(6), origin, flaw=flaw)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The filtered readings of one contact; n of them. nan where a value is undefined."""

    time: Array  # (n,) [s]
    wrench: Array  # (n, 6) zeroed, face frame
    normal: Array  # (n,) [N]
    tangential: Array  # (n,) [N]
    ratio: Array  # (n,) T/N [-], nan below the force floor
    position: Array  # (n, 2) centre of pressure [mm], nan below the force floor
    speed: Array  # (n,) of the centre of pressure [mm/s]
    floor: float  # [N]
    rate: float  # [Hz]
    settings: AnalysisSettings


def track_of(span: Span, contact: Contact, zero: StrokeZero) -> Track:
    """Return the zeroed readings of a contact, with the quantities derived from them."""
    stretch = slice(contact.start, contact.stop)
    wrench = span.smooth[stretch] - zero.level
    normal = -wrench[:, 2]
    peak = float(np.nanmax(normal, initial=0.0))
    limits = span.settings.ratio
    floor = max(limits.force_floor, limits.force_floor_share * peak)
    tangential = np.hypot(wrench[:, 0], wrench[:, 1])
    ratio = friction_ratio(wrench, floor)
    position = np.where(np.isfinite(ratio)[:, None], centre_of_pressure(wrench, span.frame.height), np.nan)
    if any(name.startswith("T") for name in span.quality.dead):
        position = np.full_like(position, np.nan)
    speed = _speed(span.time[stretch], position, span)
    columns = (span.time[stretch], wrench, normal, tangential, ratio, position, speed)
    return Track(*columns, floor, span.rate, span.settings)


def _speed(time: Array, position: Array, span: Span) -> Array:
    """Return the speed (n,) [mm/s] of a position (n, 2) [mm], filtered within each unbroken stretch."""
    speed = np.full(len(time), np.nan)
    limits = span.settings
    smoother = Filter(limits.filter.speed_cut_off, limits.filter.shortest_segment)
    breaks = ~(np.diff(time) < limits.signal.missing_step / span.rate)
    stretches = segments(np.isfinite(position[:, 0]) & np.isfinite(position[:, 1]), breaks)
    if span.quality.even and smoother.fits(span.rate):
        position = smoother.apply(position, span.rate, list(stretches))
    for stretch in stretches:
        if stretch.stop - stretch.start > 2:
            velocity = np.gradient(position[stretch], time[stretch], axis=0)
            speed[stretch] = np.hypot(velocity[:, 0], velocity[:, 1])
    return speed


def unfiltered_forces(span: Span, stretch: slice, zero: StrokeZero) -> tuple[Array, Array]:
    """Return the tangential and the normal force (n,) [N] of a stretch, zeroed and unfiltered."""
    wrench = span.wrench[stretch] - zero.level
    return np.hypot(wrench[:, 0], wrench[:, 1]), -wrench[:, 2]


def noise_of_ratio(zero: StrokeZero, level: float, normal: float) -> float:
    """Return the standard deviation [-] of unfiltered T/N about `level` under a normal force [N]."""
    sideways = float(np.hypot(*zero.noise[:2])) / np.sqrt(2.0)
    return float(np.hypot(sideways, level * float(zero.noise[2]))) / normal


def curve_of(span: Span, contact: Contact, zero: StrokeZero, crest_gap: float | None = None) -> StrokeCurve:
    """Return the stroke's curve with some time around it.

    `crest_gap` [N] is how far readings may miss the peak force in stick-slip, None without it.
    """
    around = span.settings.contact
    start = int(np.searchsorted(span.time, float(span.time[contact.start]) - around.curve_before))
    stop = int(np.searchsorted(span.time, float(span.time[contact.stop - 1]) + around.curve_after))
    track = track_of(span, Contact(start, stop, None, None), zero)
    force = track.wrench[:, :2]
    drag, unfiltered = unfiltered_forces(span, slice(start, stop), zero)
    columns = (track.time, track.normal, unfiltered, track.tangential, force, track.ratio, track.position, track.speed)
    sideways = float(np.sqrt((zero.filtered[:2] ** 2).mean()))
    curve = StrokeCurve(*columns, noise=(sideways, float(zero.filtered[2])), quiet=zero.lasts)
    if crest_gap is None:
        return curve
    crest_noise = float(np.sqrt((zero.noise[:2] ** 2).mean()))
    return replace(curve, crests=drag, crest_noise=crest_noise, crest_gap=crest_gap)
