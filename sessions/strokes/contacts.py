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

    `normal` (n,) [N] is zeroed and filtered, of all readings; nan counts as no force.
    """
    force = np.maximum(np.nan_to_num(normal[contact.start : contact.stop]), 0.0)
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
