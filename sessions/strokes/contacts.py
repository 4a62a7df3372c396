"""Contacts from the normal force, by one detector for live and recorded readings, and the strokes in them.

Strokes are cut at valleys of the force and where the finger turns.
"""

from collections import deque
from dataclasses import dataclass, replace
from itertools import pairwise
from math import sqrt
from statistics import fmean, median
from typing import NamedTuple

import numpy as np

from drivers.arrays import Array
from sessions.strokes.forces import peaks
from sessions.strokes.settings import AnalysisSettings, DetectorSettings

NORMAL_STEP = 1.4826 / sqrt(2)  # standard deviation of white noise over the median absolute step between neighbours


@dataclass(frozen=True, slots=True)
class Baseline:
    """The normal force with nothing touching."""

    level: float  # mean [N]
    noise: float  # standard deviation about it [N]


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """The finger has touched or left."""

    time: float  # at which the force left the noise, or first fell below the lift threshold [s, device time]
    noticed: float  # reading at which this was certain [s, device time]


class Onset(ContactEvent):
    """The finger has touched."""


class Lift(ContactEvent):
    """The finger has left."""


class ContactDetector:
    """Tell contact onset and lift from normal force and time, however the readings were cut into blocks.

    Zero and noise are measured in the unloaded stretch before contact and follow a slow drift until the finger
    touches; without such a stretch nothing is detected. A force well below its zero shows that this must be renewed.
    """

    def __init__(self, settings: DetectorSettings | None = None, baseline: Baseline | None = None) -> None:
        """Start with nothing known, or with a baseline measured elsewhere, which then stays as given."""
        self._settings = settings or DetectorSettings()
        self._follows = baseline is None
        # Finished ones; the newest may hold a touch's first part.
        self._bins: deque[list[float]] = deque(maxlen=self._settings.baseline_parts + 1)
        self._bin: list[float] = []
        self._bin_start: float | None = None
        self._touching = False
        self._noise_exit: float | None = None  # first reading since the force was last within the noise
        self._above: float | None = None  # first reading of the present run above the onset threshold
        self._below: float | None = None  # first reading of the present run below the lift threshold
        self._pull_start: float | None = None  # first reading of the present run far below zero
        self._has_zero = False  # zero and noise are known
        self._level = self._noise_band = self._threshold = self._lift = 0.0
        if baseline is not None:
            self._take(baseline)

    def feed(self, time: Array, normal_force: Array) -> tuple[ContactEvent, ...]:
        """Take readings, time (n,) [s] and normal force (n,) [N, pressing > 0, not zeroed]; return what they tell."""
        events = (self._take_reading(t, force) for t, force in zip(time.tolist(), normal_force.tolist(), strict=True))
        return tuple(event for event in events if event is not None)

    def _take_reading(self, t: float, force: float) -> ContactEvent | None:
        if self._touching:
            return self._still_touching(t, force)
        if self._has_zero:
            above = force - self._level
            self._noise_exit = _since(self._noise_exit, t, on=above > self._noise_band)
            self._above = _since(self._above, t, on=above > self._threshold)
            if self._above is not None:
                return self._touch(self._above, t)
            if self._follows:
                self._notice_pull(t, above)
        if self._follows:
            self._gather(t, force)
        return None

    def _touch(self, began: float, t: float) -> ContactEvent | None:
        """Return the onset once the force has exceeded the threshold for long enough."""
        if t - began < self._settings.onset_hold - _ROUNDING:
            return None
        onset = Onset(began if self._noise_exit is None else self._noise_exit, t)
        self._touching = True
        self._above = self._noise_exit = None
        return onset

    def _still_touching(self, t: float, force: float) -> ContactEvent | None:
        self._below = _since(self._below, t, on=force - self._level < self._lift)
        if self._below is None or t - self._below < self._settings.lift_hold - _ROUNDING:
            return None
        lift = Lift(self._below, t)
        self._touching = False
        self._below = None
        self._start_gathering()
        return lift

    def _notice_pull(self, t: float, above: float) -> None:
        """Forget a zero that was taken in contact."""
        self._pull_start = _since(self._pull_start, t, on=above < -self._threshold)
        if self._pull_start is not None and t - self._pull_start >= self._settings.baseline / 2:
            self._pull_start, self._has_zero = None, False
            self._start_gathering()

    def _start_gathering(self) -> None:
        self._bins.clear()
        self._bin, self._bin_start = [], None

    def _gather(self, t: float, force: float) -> None:
        """Keep the readings of the last stretch in bins, and take zero and noise from them when they are quiet."""
        if self._bin_start is None:
            self._bin_start = t
        if t - self._bin_start >= self._settings.baseline / self._settings.baseline_parts - _ROUNDING:
            self._bins.append(self._bin)
            self._bin, self._bin_start = [], t
            if len(self._bins) == self._bins.maxlen:
                stretch = [reading for part in list(self._bins)[:-1] for reading in part]
                if is_quiet(stretch, self._settings):
                    self._take(Baseline(fmean(stretch), _spread(stretch)))
        self._bin.append(force)

    def _take(self, baseline: Baseline) -> None:
        self._has_zero = True
        self._level = baseline.level
        self._noise_band = self._settings.leave_noise * baseline.noise
        self._threshold = onset_threshold(baseline.noise, self._settings)
        self._lift = self._settings.lift_fraction * self._threshold


_ROUNDING = 1e-9  # times are sums of ticks [s]


def _since(began: float | None, t: float, *, on: bool) -> float | None:
    """Return since when something has been so without a break, None where it is not so at `t` [s]."""
    return None if not on else t if began is None else began


def onset_threshold(noise: float, settings: DetectorSettings) -> float:
    """Return the normal force above zero that counts as contact [N], for a noise [N].

    >>> onset_threshold(0.004, DetectorSettings()), onset_threshold(0.1, DetectorSettings())
    (0.05, 0.5)
    """
    return max(settings.onset_noise * noise, settings.onset_floor)


def is_quiet(stretch: list[float], settings: DetectorSettings) -> bool:
    """Say whether a stretch of forces [N] spreads no more than noise does.

    Noise is estimated from the median step between neighbours, which a slow movement hardly changes.
    """
    if len(stretch) < settings.baseline_readings:
        return False
    steps = [abs(b - a) for a, b in pairwise(stretch)]
    noise = NORMAL_STEP * median(steps)
    return _spread(stretch) <= max(settings.quiet_noise * noise, settings.quiet_floor)


def _spread(stretch: list[float]) -> float:
    mean = fmean(stretch)
    return sqrt(sum((reading - mean) ** 2 for reading in stretch) / (len(stretch) - 1))


@dataclass(frozen=True, slots=True)
class Contact:
    """Readings during which something touches."""

    start: int  # position of the first reading
    stop: int  # position past the last
    onset: float | None  # [s, device time]; None where the recording begins in contact
    lift: float | None  # [s, device time]; None where it ends in contact
    valleys: tuple[int, ...] = ()  # readings of least force that tell it from neighbours it was not lifted from
    reversals: tuple[int, ...] = ()  # readings at which the finger turned, where that is its beginning or end
    uncut: tuple[int, int] | None = None  # first reading and past the last of the contact that turns cut it out of


def find_contacts(time: Array, normal: Array, baseline: Baseline, settings: AnalysisSettings) -> tuple[Contact, ...]:
    """Return the contacts in readings, time (n,) [s] and normal force (n,) [N, not zeroed], for a known zero."""
    if not len(time):
        return ()
    events = ContactDetector(settings.detector, baseline).feed(time, normal)
    onsets = [event.time for event in events if isinstance(event, Onset)]
    lifts: list[float | None] = [event.time for event in events if isinstance(event, Lift)]
    pieces: list[Contact] = []
    for onset, lift in zip(onsets, lifts + [None] * (len(onsets) - len(lifts)), strict=True):
        start = int(np.searchsorted(time, onset))
        stop = len(time) if lift is None else int(np.searchsorted(time, lift))
        pieces.append(Contact(start, stop, None if start == 0 else onset, lift))
    return tuple(pieces)


def split_at_valleys(contact: Contact, time: Array, normal: Array, settings: AnalysisSettings) -> tuple[Contact, ...]:
    """Return the strokes of a contact: two are separated where the zeroed N between them falls far below both peaks.

    `normal` (n,) [N] is zeroed and filtered, of all readings. nan is
    no force beside a gap that may hide a lift, and no valley elsewhere, as in stretches too short for the filter.
    """
    inside = slice(contact.start, contact.stop)
    force = np.maximum(_bridge_gaps(time[inside], normal[inside], settings.contact.longest_gap), 0.0)
    with_ends = np.concatenate([[0.0], force, [0.0]])
    places, prominences = peaks(with_ends)
    tops = places[prominences >= (1.0 - settings.contact.valley) * with_ends[places]] - 1
    tops = tops[force[tops] >= settings.contact.light_share * force.max(initial=0.0)]
    between = [(a, b, int(a + np.argmin(force[a:b]))) for a, b in pairwise(tops)]
    # Peaks of exactly the same height stand out of everything but one another.
    deep = settings.contact.valley
    valleys = [contact.start + at for a, b, at in between if force[at] < deep * min(force[a], force[b])]
    if not valleys:
        return (contact,)
    bounds = [contact.start, *valleys, contact.stop]
    return tuple(_piece(contact, start, stop, time, normal, settings) for start, stop in pairwise(bounds))


def _bridge_gaps(time: Array, force: Array, longest: float) -> Array:
    """Return forces (n,) [N] with straight lines in place of nan; 0 where a line would cross a gap of `longest` [s]."""
    finite = np.flatnonzero(np.isfinite(force))
    if not len(finite):
        return np.zeros_like(force)
    gaps = np.concatenate([[0], np.cumsum(np.diff(time) > longest)])  # before each reading
    number = np.arange(len(force))
    after = finite[np.minimum(np.searchsorted(finite, number), len(finite) - 1)]
    before = finite[np.maximum(np.searchsorted(finite, number, "right") - 1, 0)]
    return np.where(gaps[after] == gaps[before], np.interp(number, finite, force[finite]), np.nan_to_num(force))


def _piece(contact: Contact, start: int, stop: int, time: Array, normal: Array, settings: AnalysisSettings) -> Contact:
    """Return the stroke between two borders; where a border is a valley it is cut back to a share of its peak."""
    valleys = tuple(border for border in (start, stop) if border not in (contact.start, contact.stop))
    force = np.nan_to_num(normal[start:stop])
    high = np.flatnonzero(force >= settings.contact.valley * force.max())
    onset, lift = contact.onset, contact.lift
    if start != contact.start:
        start += int(high[0])
        onset = float(time[start])
    if stop != contact.stop:
        stop -= len(force) - 1 - int(high[-1])
        lift = float(time[stop])
    return Contact(start, stop, onset, lift, valleys)


class _DragRun(NamedTuple):
    """Readings in which the drag points one way, or turns slowly."""

    first: int
    last: int
    push: Array  # sum of the drag over its blocks (2,) [N]
    blocks: int

    @property
    def drag(self) -> float:
        """Its mean [N]."""
        return float(np.hypot(*self.push)) / self.blocks


def split_at_reversals(
    contact: Contact, time: Array, wrench: Array, unsure: float, settings: AnalysisSettings
) -> tuple[Contact, ...]:
    """Return the strokes of a contact, cut where the drag turns to the other side and stays there.

    `wrench` (n, 6) [N, N mm] of all readings at `time` (n,) [s] is zeroed, in the face frame and filtered; its zero may
    be `unsure` [N] sideways. The drag has turned where it points more than a right angle off the way it had just before
    (hysteresis: with T/N beyond a share of its median, T beyond twice what the zero leaves open, for about as long as
    the shortest stroke and a share of the longest way, and no light touch beside the others). A drag that turns slowly,
    as in circles, is not cut.
    """
    part = wrench[contact.start : contact.stop]
    ways = _drag_runs(part, time[contact.start : contact.stop], unsure, settings)
    reversals = [contact.start + _reversal(part, one, other) for one, other in pairwise(ways)]
    if not reversals:
        return (contact,)
    bounds = [contact.start, *reversals, contact.stop]
    return tuple(
        replace(
            contact,
            start=start,
            stop=stop,
            onset=contact.onset if start == contact.start else float(time[start]),
            lift=contact.lift if stop == contact.stop else float(time[stop]),
            reversals=tuple(turn for turn in reversals if turn in (start, stop)),
            uncut=(contact.start, contact.stop),
        )
        for start, stop in pairwise(bounds)
    )


def _drag_runs(wrench: Array, time: Array, unsure: float, settings: AnalysisSettings) -> list[_DragRun]:
    """Return the ways of the drag in a wrench (n, 6); those that are too short or too weak are left out."""
    rule, normal = settings.contact, -wrench[:, 2]
    floor = max(settings.ratio.force_floor, settings.ratio.force_floor_share * float(np.nanmax(normal, initial=0.0)))
    at = np.flatnonzero(normal >= floor)
    if len(at) < 2:
        return []
    block_number = np.floor((time[at] - time[at[0]]) / rule.turn_block)
    firsts = np.flatnonzero(np.diff(block_number, prepend=-1.0))
    counts = np.diff(np.append(firsts, len(at)))
    force, load = (np.add.reduceat(column[at], firsts, axis=0).T / counts for column in (wrench[:, :2], normal))
    drag = np.hypot(*force)
    if unsure > settings.zero.drift_refused * float(np.median(drag)):  # the drag gives no number
        return []
    least = rule.turn_share * float(np.median(drag / load)) * load
    strong = np.flatnonzero((drag >= least) & (drag > rule.turn_unsure * unsure))
    lasts = at[np.append(firsts[1:], len(at)) - 1]
    runs: list[list[int]] = []  # of blocks
    for block in strong.tolist():
        if runs and float(force[:, runs[-1][-rule.turn_recent :]].sum(axis=1) @ force[:, block]) >= 0.0:
            runs[-1].append(block)
        else:
            runs.append([block])
    ends = [(int(at[firsts[run[0]]]), int(lasts[run[-1]])) for run in runs]
    every_run = [_DragRun(*two, force[:, run].sum(axis=1), len(run)) for two, run in zip(ends, runs, strict=True)]
    greatest = max((way.drag for way in every_run), default=0.0)
    longest = max((float(time[way.last] - time[way.first]) for way in every_run), default=0.0)
    shortest = max(rule.shortest_stroke - rule.turn_block, rule.turn_shortest * longest)
    ways: list[_DragRun] = []
    dropped = False  # since the last way
    for way in every_run:
        short = bool(time[way.last] - time[way.first] < shortest or way.drag < rule.light_share * greatest)
        if not short and ways and dropped and float(ways[-1].push @ way.push) >= 0.0:
            ways[-1] = _DragRun(ways[-1].first, way.last, ways[-1].push + way.push, ways[-1].blocks + way.blocks)
        elif not short:
            ways.append(way)
        dropped = short
    return ways


def _reversal(wrench: Array, one: _DragRun, other: _DragRun) -> int:
    """Return the reading of a wrench (n, 6) from which on the drag points the `other` way."""
    across = other.push / np.hypot(*other.push) - one.push / np.hypot(*one.push)
    between = wrench[one.first : other.last + 1, :2] @ across
    until = between[: other.first - one.first + 1]
    return one.first + int(np.flatnonzero(until < 0.0)[-1]) + 1
