"""Contacts from the normal force, by one detector for live and recorded readings, and the strokes in them.

Strokes are cut at valleys of the force and where the finger reverses.
"""

from collections import deque
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, sqrt
from statistics import fmean, median
from typing import NamedTuple

import numpy as np

from drivers.arrays import Array
from sessions.strokes.forces import peaks
from sessions.strokes.settings import AnalysisSettings, BootstrapSettings, DetectorSettings

NORMAL_STEP = 1.4826 / sqrt(2)  # standard deviation of white noise over its median absolute step between neighbours


class ContactEvent(NamedTuple):
    """The finger has touched or left."""

    touches: bool
    time: float  # at which the force left the noise, or first fell below the lift threshold [s, device time]
    noticed: float  # reading at which this was certain [s, device time]


class ContactDetector:
    """Detect contact onset and lift from normal force and time, independently of how readings are split into blocks.

    Zero and noise are measured in the unloaded stretch before contact and follow a slow drift until the finger touches;
    without such a stretch nothing is detected. A force well below its zero renews this measurement.
    """

    def __init__(self, settings: DetectorSettings | None = None, noise: float | None = None) -> None:
        """Start without a zero, or with the `noise` [N] of a force that is zeroed already, which then stays fixed."""
        self._settings = settings or DetectorSettings()
        self._follows = noise is None
        # Finished bins; the newest may hold the first part of a touch.
        self._bins: deque[list[float]] = deque(maxlen=self._settings.baseline_parts + 1)
        self._bin: list[float] = []
        self._bin_start: float | None = None
        self._touching = False
        self._noise_exit: float | None = None  # first reading since the force was last within the noise
        self._above: float | None = None  # first reading of the present run above the onset threshold
        self._below: float | None = None  # first reading of the present run below the lift threshold
        self._pull_start: float | None = None  # first reading of the present run far below zero
        self._level, self._noise_band, self._threshold = 0.0, inf, inf  # without a zero there is no contact
        if noise is not None:
            self._take(0.0, noise)

    def feed(self, time: Array, normal_force: Array) -> tuple[ContactEvent, ...]:
        """Process readings, time (n,) [s] and normal force (n,) [N, pressing > 0, not zeroed]; return the events."""
        events = map(self._take_reading, time.tolist(), normal_force.tolist())
        return tuple(event for event in events if event is not None)

    def _take_reading(self, t: float, force: float) -> ContactEvent | None:
        excess = force - self._level
        if self._touching:
            return self._still_touching(t, excess)
        self._noise_exit = _since(self._noise_exit, t, holds=excess > self._noise_band)
        self._above = _since(self._above, t, holds=excess > self._threshold)
        if self._above is not None:
            return self._touch(self._above, t)
        if self._follows:
            self._notice_pull(t, excess)
            self._gather(t, force)
        return None

    def _touch(self, began: float, t: float) -> ContactEvent | None:
        """Return the onset once the force has exceeded the threshold for long enough."""
        if t - began < self._settings.onset_hold - _ROUNDING:
            return None
        onset = ContactEvent(touches=True, time=began if self._noise_exit is None else self._noise_exit, noticed=t)
        self._touching = True
        self._above = self._noise_exit = None
        return onset

    def _still_touching(self, t: float, excess: float) -> ContactEvent | None:
        self._below = _since(self._below, t, holds=excess < self._settings.lift_fraction * self._threshold)
        if self._below is None or t - self._below < self._settings.lift_hold - _ROUNDING:
            return None
        lift = ContactEvent(touches=False, time=self._below, noticed=t)
        self._touching = False
        self._below = None
        self._start_gathering()
        return lift

    def _notice_pull(self, t: float, excess: float) -> None:
        """Forget a zero that was taken in contact."""
        self._pull_start = _since(self._pull_start, t, holds=excess < -self._threshold)
        if self._pull_start is not None and t - self._pull_start >= self._settings.baseline / 2:
            self._pull_start, self._noise_band, self._threshold = None, inf, inf
            self._start_gathering()

    def _start_gathering(self) -> None:
        self._bins.clear()
        self._bin, self._bin_start = [], None

    def _gather(self, t: float, force: float) -> None:
        """Collect the latest readings in bins, and take zero and noise from them when they are quiet."""
        if self._bin_start is None:
            self._bin_start = t
        if t - self._bin_start >= self._settings.baseline / self._settings.baseline_parts - _ROUNDING:
            self._bins.append(self._bin)
            self._bin, self._bin_start = [], t
            if len(self._bins) == self._bins.maxlen:
                stretch = [reading for values in list(self._bins)[:-1] for reading in values]
                if is_quiet(stretch, self._settings):
                    self._take(fmean(stretch), _spread(stretch))
        self._bin.append(force)

    def _take(self, level: float, noise: float) -> None:
        self._level = level
        self._noise_band = self._settings.leave_noise * noise
        self._threshold = onset_threshold(noise, self._settings)


_ROUNDING = 1e-9  # times are sums of ticks [s]


def _since(start: float | None, t: float, *, holds: bool) -> float | None:
    """Return the start of the present run in which a condition holds, None where it fails at `t` [s]."""
    return None if not holds else t if start is None else start


def onset_threshold(noise: float, settings: DetectorSettings) -> float:
    """Return the normal force above zero that counts as contact [N], for a noise [N].

    >>> onset_threshold(0.004, DetectorSettings()), onset_threshold(0.1, DetectorSettings())
    (0.05, 0.5)
    """
    return max(settings.onset_noise * noise, settings.onset_floor)


def is_quiet(stretch: list[float], settings: DetectorSettings) -> bool:
    """Say whether a stretch of forces [N] spreads no more than noise.

    Noise is estimated from the median step between neighbours, which slow movement barely changes.
    """
    if len(stretch) < settings.baseline_readings:
        return False
    steps = [abs(next_force - force) for force, next_force in pairwise(stretch)]
    noise = NORMAL_STEP * median(steps)
    return _spread(stretch) <= max(settings.quiet_noise * noise, settings.quiet_floor)


def _spread(stretch: list[float]) -> float:
    mean = fmean(stretch)
    return sqrt(sum((reading - mean) ** 2 for reading in stretch) / (len(stretch) - 1))


def onset_draws(
    columns: tuple[Array, Array],
    onset: float,
    noise: float,
    zero: Array,
    settings: BootstrapSettings,
    draw: np.random.Generator,
) -> Array | None:
    """Return draws of the onset (repeats,) [s]; None where the force exceeds its noise before the onset.

    The detector's rule is repeated: a force that rises as steeply leaves its noise (`leave_noise`) between two
    readings, and fresh noise moves the reading that detects it. `columns` are time [s] and unfiltered N [N] (n,) from
    before the contact on, `noise` is the noise of N and `zero` the error of its zero (repeats,) [N].
    """
    time, force = columns
    fewest, detector = settings.onset_fewest, settings.detector
    index = int(np.searchsorted(time, onset))
    if index == 0 or len(time) < index + fewest or force[index - 1] > onset_threshold(noise, detector):
        return None
    rise = force[index:] < 2.0 * max(detector.leave_noise * noise, float(force[index]))
    rise_slice = slice(index - 1, index + max(fewest, int(np.argmin(rise)) + 1))
    step = float(np.median(np.diff(time[rise_slice])))
    # Skin stiffens under pressure: a force that curves upwards was less steep where it left the noise.
    bend, slope, _ = np.polyfit(time[rise_slice] - (onset - step / 2.0), force[rise_slice], 2).tolist()
    chord = float(np.polyfit(time[rise_slice], force[rise_slice], 1)[0])
    slope = max(slope if bend > 0.0 else chord, settings.onset_steep * chord)
    if slope <= 0.0:
        return None
    reach = min(settings.onset_reach * noise / slope, settings.onset_most * step / 2.0)
    offsets = np.arange(-reach, reach + step, step)
    # Readings of each repeat, relative to the crossing: the first is uniform within a step.
    times = offsets + step * draw.uniform(size=(len(zero), 1))  # (repeats, k)
    in_noise = slope * times + noise * draw.standard_normal(times.shape) <= 0.0
    last_in_noise = np.where(in_noise.any(axis=1), times.shape[1] - 1 - np.argmax(in_noise[:, ::-1], axis=1), -1)
    crossing = times[:, 0] + (last_in_noise + 1) * step  # the reading after the last within the noise
    return onset - crossing + zero / slope


@dataclass(frozen=True, slots=True)
class Contact:
    """Readings of one contact."""

    start: int  # position of the first reading
    stop: int  # position past the last
    onset: float | None  # [s, device time]; None where the recording begins in contact
    lift: float | None  # [s, device time]; None where it ends in contact
    valleys: tuple[int, ...] = ()  # readings of least force at its borders with neighbours, without a lift
    reversals: tuple[int, ...] = ()  # readings at which the finger reversed, at its beginning or end
    uncut: "Contact | None" = None  # the contact before reversals cut it


def find_contacts(time: Array, normal: Array, noise: float, settings: AnalysisSettings) -> tuple[Contact, ...]:
    """Return the contacts in readings, time (n,) [s] and zeroed normal force (n,) [N] of a `noise` [N]."""
    if not len(time):
        return ()
    events = ContactDetector(settings.detector, noise).feed(time, normal)
    onsets = [event.time for event in events if event.touches]
    lifts = [event.time for event in events if not event.touches]
    pieces: list[Contact] = []
    for onset, lift in zip(onsets, [*lifts, None], strict=False):  # the last may have no lift
        start = int(np.searchsorted(time, onset))
        stop = len(time) if lift is None else int(np.searchsorted(time, lift))
        pieces.append(Contact(start, stop, None if start == 0 else onset, lift))
    return tuple(pieces)


def split_at_valleys(contact: Contact, time: Array, normal: Array, settings: AnalysisSettings) -> tuple[Contact, ...]:
    """Return the strokes of a contact: N between two falls far below both peaks.

    `normal` (n,) [N] of all readings is zeroed and filtered. nan counts as no force next to a gap that may hide a lift,
    and is bridged elsewhere, as in stretches too short for the filter.
    """
    inside = slice(contact.start, contact.stop)
    force = np.maximum(_bridge_gaps(time[inside], normal[inside], settings.contact.longest_gap), 0.0)
    with_ends = np.concatenate([[0.0], force, [0.0]])
    positions, prominences = peaks(with_ends)
    crests = positions[prominences >= (1.0 - settings.contact.valley) * with_ends[positions]] - 1
    crests = crests[force[crests] >= settings.contact.light_share * force.max(initial=0.0)]
    # Between peaks of exactly equal height the prominence shows no valley.
    valleys = [
        contact.start + lowest
        for first, second in pairwise(crests)
        for lowest in [int(first + np.argmin(force[first:second]))]
        if force[lowest] < settings.contact.valley * min(force[first], force[second])
    ]
    if not valleys:
        return (contact,)
    bounds = [contact.start, *valleys, contact.stop]
    return tuple(_piece(contact, start, stop, time, normal, settings) for start, stop in pairwise(bounds))


def _bridge_gaps(time: Array, force: Array, longest: float) -> Array:
    """Return forces (n,) [N] with nan interpolated linearly; 0 where that would cross a gap over `longest` [s]."""
    finite = np.flatnonzero(np.isfinite(force))
    if not len(finite):
        return np.zeros_like(force)
    gaps = np.concatenate([[0], np.cumsum(np.diff(time) > longest)])  # before each reading
    numbers = np.arange(len(force))
    following = finite[np.minimum(np.searchsorted(finite, numbers), len(finite) - 1)]
    preceding = finite[np.maximum(np.searchsorted(finite, numbers, "right") - 1, 0)]
    return np.where(gaps[following] == gaps[preceding], np.interp(numbers, finite, force[finite]), np.nan_to_num(force))


def _piece(contact: Contact, start: int, stop: int, time: Array, normal: Array, settings: AnalysisSettings) -> Contact:
    """Return the stroke between two borders, cut back at a valley to a share of its peak."""
    valleys = tuple(border for border in (start, stop) if border not in (contact.start, contact.stop))
    force = np.nan_to_num(normal[start:stop])
    pressed = np.flatnonzero(force >= settings.contact.valley * force.max())
    start += int(pressed[0]) if start != contact.start else 0
    stop -= len(force) - 1 - int(pressed[-1]) if stop != contact.stop else 0
    return replace(_part(contact, start, stop, time), valleys=valleys)


def _part(contact: Contact, start: int, stop: int, time: Array) -> Contact:
    """Return a part of a contact, with onset and lift at its ends where these are cuts."""
    onset = contact.onset if start == contact.start else float(time[start])
    lift = contact.lift if stop == contact.stop else float(time[stop])
    return replace(contact, start=start, stop=stop, onset=onset, lift=lift)


class _DragRun(NamedTuple):
    """Consecutive readings in which the drag keeps its direction, or turns slowly."""

    first: int
    last: int
    push: Array  # sum of the drag over its blocks (2,) [N]
    blocks: int

    @property
    def drag(self) -> float:
        """Mean drag [N]."""
        return float(np.hypot(*self.push)) / self.blocks


def split_at_reversals(
    contact: Contact, time: Array, wrench: Array, unsure: float, settings: AnalysisSettings
) -> tuple[Contact, ...]:
    """Return the strokes of a contact, cut where the drag reverses and stays reversed.

    `wrench` (n, 6) [N, N mm] of all readings at `time` (n,) [s] is zeroed, in the face frame and filtered; its zero may
    be `unsure` [N] sideways. The drag has reversed where it points more than a right angle off its direction just
    before. Hysteresis: T/N exceeds a share of its median, T exceeds twice the zero's uncertainty, for about the
    shortest stroke and a share of the longest run, and without light touches. A drag that turns slowly, as in circles,
    is not cut.
    """
    stretch = wrench[contact.start : contact.stop]
    runs = _drag_runs(stretch, time[contact.start : contact.stop], unsure, settings)
    reversals = [contact.start + _reversal(stretch, run, following) for run, following in pairwise(runs)]
    if not reversals:
        return (contact,)
    pieces = (_part(contact, *ends, time) for ends in pairwise([contact.start, *reversals, contact.stop]))
    return tuple(
        replace(piece, reversals=tuple(n for n in reversals if n in (piece.start, piece.stop)), uncut=contact)
        for piece in pieces
    )


def _drag_runs(wrench: Array, time: Array, unsure: float, settings: AnalysisSettings) -> list[_DragRun]:
    """Return the runs of the drag in a wrench (n, 6), without short and weak ones."""
    rule, normal = settings.contact, -wrench[:, 2]
    floor = max(settings.ratio.force_floor, settings.ratio.force_floor_share * float(np.nanmax(normal, initial=0.0)))
    pressed = np.flatnonzero(normal >= floor)
    if len(pressed) < 2:
        return []
    block_number = np.floor((time[pressed] - time[pressed[0]]) / rule.turn_block)
    firsts = np.flatnonzero(np.diff(block_number, prepend=-1.0))
    counts = np.diff(np.append(firsts, len(pressed)))
    force, load = (np.add.reduceat(column[pressed], firsts, axis=0).T / counts for column in (wrench[:, :2], normal))
    drag = np.hypot(*force)
    if unsure > settings.zero.drift_refused * float(np.median(drag)):  # the drag is too uncertain
        return []
    least_drag = rule.turn_share * float(np.median(drag / load)) * load
    strong = np.flatnonzero((drag >= least_drag) & (drag > rule.turn_unsure * unsure))
    runs: list[list[int]] = []  # of blocks
    for block in strong.tolist():
        if runs and float(force[:, runs[-1][-rule.turn_recent :]].sum(axis=1) @ force[:, block]) >= 0.0:
            runs[-1].append(block)
        else:
            runs.append([block])
    begins, ends = pressed[firsts].tolist(), pressed[np.append(firsts[1:], len(pressed)) - 1].tolist()
    every_run = [_DragRun(begins[run[0]], ends[run[-1]], force[:, run].sum(axis=1), len(run)) for run in runs]
    greatest = max((run.drag for run in every_run), default=0.0)
    longest = max((float(time[run.last] - time[run.first]) for run in every_run), default=0.0)
    shortest = max(rule.shortest_stroke - rule.turn_block, rule.turn_shortest * longest)
    long_runs: list[_DragRun] = []
    dropped = False  # since the last kept run
    for run in every_run:
        is_short = bool(time[run.last] - time[run.first] < shortest or run.drag < rule.light_share * greatest)
        if not is_short and long_runs and dropped and float(long_runs[-1].push @ run.push) >= 0.0:
            first, _, push, blocks = long_runs.pop()
            long_runs.append(_DragRun(first, run.last, push + run.push, blocks + run.blocks))
        elif not is_short:
            long_runs.append(run)
        dropped = is_short
    return long_runs


def _reversal(wrench: Array, run: _DragRun, following: _DragRun) -> int:
    """Return the first reading of a wrench (n, 6) from which the drag points as in the `following` run."""
    change = following.push / np.hypot(*following.push) - run.push / np.hypot(*run.push)
    before_next = wrench[run.first : following.first + 1, :2] @ change
    return run.first + int(np.flatnonzero(before_next < 0.0)[-1]) + 1
