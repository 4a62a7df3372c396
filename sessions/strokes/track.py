"""The filtered readings of one contact: forces, ratio, centre of pressure and its speed."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.contacts import Contact
from sessions.strokes.forces import Filter, centre_of_pressure, friction_ratio
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.span import Span, StrokeZero
from sessions.strokes.stroke import StrokeCurve

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The filtered readings of one contact; n of them. nan where a value means nothing."""

    time: Array  # (n,) [s]
    wrench: Array  # (n, 6) zeroed, face frame
    normal: Array  # (n,) [N]
    tangential: Array  # (n,) [N]
    ratio: Array  # (n,) T/N [-], nan below the force floor
    position: Array  # (n, 2) centre of pressure [mm], nan below the force floor
    speed: Array  # (n,) of the centre of pressure [mm/s]
    floor: float  # [N]
    rate: float  # [Hz]


def track_of(span: Span, contact: Contact, zero: StrokeZero, height: float, settings: AnalysisSettings) -> Track:
    """Return the readings of a contact, zeroed, with what follows from them."""
    part = slice(contact.start, contact.stop)
    wrench = span.smooth[part] - zero.level
    normal = -wrench[:, 2]
    peak = float(np.nanmax(normal, initial=0.0))
    floor = max(settings.ratio.force_floor, settings.ratio.force_floor_share * peak)
    tangential = np.hypot(wrench[:, 0], wrench[:, 1])
    ratio = friction_ratio(wrench, floor)
    position = np.where(np.isfinite(ratio)[:, None], centre_of_pressure(wrench, height), np.nan)
    if any(name.startswith("T") for name in span.quality.dead):
        position = np.full_like(position, np.nan)
    speed = _speed(span.time[part], position, span, settings)
    return Track(span.time[part], wrench, normal, tangential, ratio, position, speed, floor, span.rate)


def mean_vector(vectors: Array) -> Array:
    """Return the mean (k,) of vectors (n, k), leaving out nan."""
    return np.asarray(np.nanmean(vectors, axis=0), np.float64)


def _speed(time: Array, position: Array, span: Span, settings: AnalysisSettings) -> Array:
    """Return the speed (n,) [mm/s] of a position (n, 2) [mm], filtered within each unbroken stretch."""
    speed = np.full(len(time), np.nan)
    smoother = Filter(settings.filter.speed_cut_off, settings.filter.shortest_segment)
    finite = np.isfinite(position[:, 0]) & np.isfinite(position[:, 1])
    joined = finite[1:] & finite[:-1] & (np.diff(time) < settings.signal.missing_step / span.rate)
    starts = np.flatnonzero(finite & ~np.concatenate([[False], joined]))
    stops = np.flatnonzero(finite & ~np.concatenate([joined, [False]])) + 1
    for start, stop in zip(starts, stops, strict=True):
        if stop - start < 3:
            continue
        part = slice(int(start), int(stop))
        path = position[part]
        if span.quality.even and smoother.fits(span.rate):
            path = smoother.apply(path, span.rate, [slice(0, len(path))])
        velocity = np.gradient(path, time[part], axis=0)
        speed[part] = np.hypot(velocity[:, 0], velocity[:, 1])
    return speed


def unfiltered_forces(span: Span, part: slice, zero: StrokeZero) -> tuple[Array, Array]:
    """Return the tangential and the normal force (n,) [N] of a part, zeroed and unfiltered."""
    wrench = span.wrench[part] - zero.level
    return np.hypot(wrench[:, 0], wrench[:, 1]), -wrench[:, 2]


def noise_of_ratio(zero: StrokeZero, level: float, normal: float) -> float:
    """Return the standard deviation [-] of unfiltered T/N about `level` under a normal force [N]."""
    sideways = float(np.hypot(*zero.noise[:2])) / np.sqrt(2.0)
    return float(np.hypot(sideways, level * float(zero.noise[2]))) / normal


def curve_of(
    span: Span,
    contact: Contact,
    zero: StrokeZero,
    height: float,
    settings: AnalysisSettings,
    missed: float | None = None,
) -> StrokeCurve:
    """Return the stroke's course with some time around it.

    `missed` [N] is how far readings may miss the greatest force of a contact that sticks and slips, None of another.
    """
    first = int(np.searchsorted(span.time, float(span.time[contact.start]) - settings.contact.curve_before))
    last = int(np.searchsorted(span.time, float(span.time[contact.stop - 1]) + settings.contact.curve_after))
    track = track_of(span, Contact(first, last, None, None), zero, height, settings)
    force = track.wrench[:, :2]
    dragging, unfiltered = unfiltered_forces(span, slice(first, last), zero)
    columns = (track.time, track.normal, unfiltered, track.tangential, force, track.ratio, track.position, track.speed)
    sideways = float(np.sqrt((zero.filtered[:2] ** 2).mean()))
    curve = StrokeCurve(*columns, noise=(sideways, float(zero.filtered[2])), quiet=zero.lasts)
    if missed is None:
        return curve
    crest_noise = float(np.sqrt((zero.noise[:2] ** 2).mean()))
    return replace(curve, crests=dragging, crest_noise=crest_noise, crest_missed=missed)
