"""Converts the recorder's live messages to plot data and to the readings of a take; reports the transducer's load."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import groupby
from math import nan

import numpy as np
from msgspec import structs

from daq_app.recorder.messages import Live, Report
from daq_app.window.live_trace import LiveTrace, with_gaps
from daq_app.wording import tr_noop
from drivers.arrays import Array, Indices, Mask
from drivers.calibration import LIMITS, WARNING
from drivers.calibration_file import AXES
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Frame
from sessions.strokes.forces import centre_of_pressure, in_face_frame
from sessions.strokes.settings import RatioSettings

LOADS = (*AXES, tr_noop("combined"))
_FLOOR = RatioSettings().force_floor  # ratio, speed and centre of pressure are meaningless below this normal force [N]
LAG = 0.1  # the speed is the displacement of the centre of pressure over this time [s] ...
SMOOTH = 0.05  # ... between two means over this time [s]
ARRAYS = ("sequence", "time", "received_ns", "wrench", "status")  # of live readings
_LONGEST_TAKE = 90.0  # longest stretch of a take's readings kept for judging [s]


@dataclass(frozen=True, slots=True)
class Load:
    """Greatest shares of the rated range (1: rated load); nan without a range and before the first reading."""

    shares: tuple[float, ...] = (nan,) * 7  # of LOADS, by `drivers.calibration.loads`

    @property
    def overloads(self) -> tuple[str, ...]:
        """Return the names of the loads beyond their rating."""
        loads = zip(LOADS, self.shares, LIMITS, strict=True)
        return tuple(name for name, share, limit in loads if share > limit)

    @property
    def near_limits(self) -> tuple[str, ...]:
        """Return the names of the loads near or beyond their rating."""
        return tuple(name for name, share in zip(LOADS, self.shares, strict=True) if share > WARNING)


def merge_live(reports: Iterable[Report]) -> Iterator[Report]:
    """Yield reports in order, with successive readings merged, so that a late window catches up quickly."""

    def stream_and_zero(report: Report) -> tuple[int, object] | None:
        """Return the properties that merged readings must share; None for other reports."""
        return (report.stream, report.zero) if isinstance(report, Live) else None

    for key, group in groupby(reports, key=stream_and_zero):
        if key is None:
            yield from group
            continue
        lives = [report for report in group if isinstance(report, Live)]
        yield lives[0] if len(lives) == 1 else _join(lives)


def _join(lives: list[Live]) -> Live:
    arrays = {name: np.concatenate([getattr(live, name) for live in lives]) for name in ARRAYS}
    return structs.replace(lives[0], **arrays, left_out=sum(live.left_out for live in lives))


class LiveFeed:
    """The displayed data of the current stream. One per window."""

    def __init__(self) -> None:
        self.trace = LiveTrace(1000.0)
        self._info: TransducerInfo | None = None
        self._stream: int | None = None
        self._take: deque[Live] = deque()
        self._tail = _Tail()
        self._sequence: int | None = None  # of the newest reading

    def device(self, info: TransducerInfo | None) -> None:
        """Restart with another transducer, or none."""
        self._info = info
        self._stream = None
        self._take.clear()
        self.trace = LiveTrace(1000.0 if info is None else info.rate)

    def take_begins(self) -> None:
        """Begin to keep readings for a new take."""
        self._take.clear()

    def add(self, live: Live, frame: Frame) -> None:
        """Take readings."""
        if self._info is None or not len(live.time):
            return
        if live.stream != self._stream:
            self._stream = live.stream
            self._take.clear()
            self._tail = _Tail()
            self._sequence = None
            self.trace.clear()
        previous = live.sequence[0] - 1 if self._sequence is None else self._sequence
        gaps = np.flatnonzero(np.diff(live.sequence, prepend=previous) > 1)  # readings are missing before these
        time, values = with_gaps(live.time, self._channels(live, frame), gaps)
        self._sequence = int(live.sequence[-1])
        self._take.append(live)
        while len(self._take) > 1 and live.time[-1] - self._take[0].time[-1] > _LONGEST_TAKE:
            self._take.popleft()
        self.trace.add(time, values)

    def take(self) -> ReadingBlock:
        """Return the readings of the current take as wrenches [N, N mm]."""
        if not self._take:
            return ReadingBlock.empty()
        take = _join(list(self._take))
        sequence, wrench = take.sequence, take.wrench
        return ReadingBlock(sequence, sequence, take.status, take.time, take.received_ns, raw=wrench)

    def _channels(self, live: Live, frame: Frame) -> Array:
        """Return the plotted `CHANNELS` (channels, n); nan for a meaningless value."""
        wrench = in_face_frame(live.wrench, frame)
        normal = -wrench[:, 2]
        tangential = np.hypot(wrench[:, 0], wrench[:, 1])
        pressed = (normal >= _FLOOR) & (live.status == 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(pressed, tangential / normal, np.nan)
        position = np.where(pressed[:, None], centre_of_pressure(wrench, frame.height), np.nan)
        self._tail, speed = self._tail.advance(live.time, position)
        values = np.vstack([wrench.T, normal, tangential, ratio, speed, position.T])
        return np.where(live.status == 0, values, np.nan)


@dataclass(frozen=True, slots=True)
class _Tail:
    """The latest positions of the centre of pressure, from which the speed at the next reading is computed."""

    time: Array = field(default_factory=lambda: np.empty(0))  # (k,)
    position: Array = field(default_factory=lambda: np.empty((0, 2)))  # (k, 2)

    def advance(self, time: Array, position: Array) -> tuple["_Tail", Array]:
        """Return the next tail and the speed (n,) [mm/s] at each of n further readings."""
        times = np.concatenate([self.time, time])
        positions = np.concatenate([self.position, position])
        origin = times[0]  # keeps sums of times exact
        rows = np.column_stack([np.nan_to_num(positions), times - origin])
        total = np.vstack([np.zeros((1, 3)), np.cumsum(rows, axis=0)])
        bad = np.concatenate([[0], np.cumsum(np.isnan(positions[:, 0]))])
        stops = np.arange(len(self.time), len(times)) + 1
        recent = np.searchsorted(times, time - SMOOTH)
        old_end = np.searchsorted(times, time - LAG)
        old_start = np.searchsorted(times, time - LAG - SMOOTH)
        latest, known_now = _mean(total, bad, recent, stops)
        earlier, known_then = _mean(total, bad, old_start, old_end)
        step = latest - earlier
        with np.errstate(divide="ignore", invalid="ignore"):
            speed = np.hypot(step[:, 0], step[:, 1]) / step[:, 2]
        keep = times > (time[-1] - LAG - 2 * SMOOTH)
        return _Tail(times[keep], positions[keep]), np.where(known_now & known_then, speed, np.nan)


def _mean(total: Array, bad: Indices, starts: Indices, stops: Indices) -> tuple[Array, Mask]:
    """Return means (n, 3) of position and time from `starts` to `stops`, and which contain no unknown reading."""
    count = stops - starts
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (total[stops] - total[starts]) / count[:, None]
    return mean, (count > 0) & (bad[stops] == bad[starts])
