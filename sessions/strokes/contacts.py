"""Contacts of a recording, and the strokes in them."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sessions.strokes.filters import peaks
from sessions.strokes.onset import Baseline, ContactDetector, Lift, Onset
from sessions.strokes.settings import AnalysisSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Contact:
    """Readings during which something touches."""

    start: int  # position of the first reading
    stop: int  # position past the last
    onset: float | None  # [s, device time]; None where the recording begins in contact
    lift: float | None  # [s, device time]; None where it ends in contact
    valleys: tuple[int, ...] = ()  # readings of least force that tell it from neighbours it was not lifted from
    turns: tuple[int, ...] = ()  # readings at which the finger turned, where that is its beginning or end
    around: tuple[int, int] | None = None  # first reading and past the last of the contact that turns cut it out of


def contacts(time: Array, normal: Array, baseline: Baseline, settings: AnalysisSettings) -> tuple[Contact, ...]:
    """Return the contacts in readings, time (n,) [s] and normal force (n,) [N, not zeroed], for a known zero."""
    if not len(time):
        return ()
    detector = ContactDetector(settings.detector, baseline)
    events = detector.feed(time, normal)
    onsets = [event.time for event in events if isinstance(event, Onset)]
    lifts: list[float | None] = [event.time for event in events if isinstance(event, Lift)]
    found: list[Contact] = []
    for onset, lift in zip(onsets, lifts + [None] * (len(onsets) - len(lifts)), strict=True):
        start = int(np.searchsorted(time, onset))
        stop = len(time) if lift is None else int(np.searchsorted(time, lift))
        found.append(Contact(start, stop, None if start == 0 else onset, lift))
    return tuple(found)


def split_at_valleys(contact: Contact, time: Array, normal: Array, settings: AnalysisSettings) -> tuple[Contact, ...]:
    """Return the strokes of a contact: two are told apart where the zeroed N between them falls far below both peaks.

    `normal` (n,) [N] is zeroed and filtered, of all readings. nan is
    no force beside a gap that may hide a lift, and no valley elsewhere, as in stretches too short for the filter.
    """
    inside = slice(contact.start, contact.stop)
    force = np.maximum(_bridged(time[inside], normal[inside], settings.longest_gap), 0.0)
    padded = np.concatenate([[0.0], force, [0.0]])
    places, prominences = peaks(padded)
    standing = places[prominences >= (1.0 - settings.valley) * padded[places]] - 1
    standing = standing[force[standing] >= settings.light_share * force.max(initial=0.0)]
    between = [(a, b, int(a + np.argmin(force[a:b]))) for a, b in pairwise(standing)]
    # Peaks of exactly the same height stand out of everything but one another.
    valleys = [contact.start + at for a, b, at in between if force[at] < settings.valley * min(force[a], force[b])]
    if not valleys:
        return (contact,)
    bounds = [contact.start, *valleys, contact.stop]
    return tuple(_piece(contact, bounds[i], bounds[i + 1], time, normal, settings) for i in range(len(bounds) - 1))


def _bridged(time: Array, force: Array, longest: float) -> Array:
    """Return forces (n,) [N] with straight lines in place of nan; 0 where a line would cross a gap of `longest` [s]."""
    held = np.flatnonzero(np.isfinite(force))
    if not len(held):
        return np.zeros_like(force)
    gaps = np.concatenate([[0], np.cumsum(np.diff(time) > longest)])  # before each reading
    number = np.arange(len(force))
    after = held[np.minimum(np.searchsorted(held, number), len(held) - 1)]
    before = held[np.maximum(np.searchsorted(held, number, "right") - 1, 0)]
    return np.where(gaps[after] == gaps[before], np.interp(number, held, force[held]), np.nan_to_num(force))


def _piece(contact: Contact, start: int, stop: int, time: Array, normal: Array, settings: AnalysisSettings) -> Contact:
    """Return the stroke between two borders; where a border is a valley it is cut back to a share of its peak."""
    valleys = tuple(border for border in (start, stop) if border not in (contact.start, contact.stop))
    force = np.nan_to_num(normal[start:stop])
    pressed = np.flatnonzero(force >= settings.valley * force.max())
    onset, lift = contact.onset, contact.lift
    if start != contact.start:
        start += int(pressed[0])
        onset = float(time[start])
    if stop != contact.stop:
        stop -= len(force) - 1 - int(pressed[-1])
        lift = float(time[stop])
    return Contact(start, stop, onset, lift, valleys)
