"""Faults of a box and on the way from it, by a timetable and a seed."""

import heapq
from collections.abc import Iterable, Sequence
from typing import Annotated, Literal, get_args

import msgspec
import numpy as np

from drivers.arrays import Array, Mask
from simulators.bench import Bench

Kind = Literal[
    "lose", "repeat", "reorder", "corrupt", "shorten", "delay", "stall", "saturate", "status", "units", "drift",
    "miscalibrate", "slow", "steal", "reboot", "unplug",
]  # fmt: skip
FAULT_KINDS: tuple[Kind, ...] = get_args(Kind)
FOREVER = 1e7  # [s]
_ON_THE_WAY = FAULT_KINDS[:6]

Time = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]  # in a timetable file [s]


class Fault(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One kind of fault during a stretch of the box's time. `docs/how-to/simulate-a-box.md` describes each kind.

    The first six of `FAULT_KINDS` affect datagrams on the way, the others the box itself.
    """

    kind: Kind
    start: Time = msgspec.field(name="from")
    stop: Time = msgspec.field(name="to")
    share: float = 1.0  # share of the datagrams in the stretch, or size of the box's error [-]
    delay: float = 0.05  # of a delayed datagram [s]
    status: int = 0  # bits to set

    def __post_init__(self) -> None:
        if self.kind not in FAULT_KINDS:
            raise ValueError(f"fault kind {self.kind!r} is unknown; there are {', '.join(FAULT_KINDS)}")
        if not (0.0 <= self.start < self.stop and 0.0 < self.share <= 1.0 and self.delay > 0.0):
            raise ValueError(f"fault {self.kind!r} needs 0 <= from < to, 0 < share <= 1 and a delay above 0")
        if (self.kind == "status") != (0 < self.status < 2**32):
            raise ValueError("fault 'status' needs status, the bits to be set, from 1 to 4294967295; no other has it")
        if self.kind == "slow" and self.share > 0.9:
            raise ValueError("fault 'slow' needs share <= 0.9; a clock that stands still is a 'stall'")


class Faults:
    """The timetable of one box. The same seed affects the same datagrams in the same way."""

    def __init__(self, timetable: Iterable[Fault] = (), *, seed: int = 0, repeat: float = 0.0) -> None:
        """Repeat the timetable every `repeat` seconds, if above 0."""
        self._timetable = tuple(timetable)
        self._seed = seed
        self._repeat = repeat
        self._clock = _device_clock(self._timetable, repeat)
        self._swap: bytes | None = None
        self._delays: list[tuple[float, bytes]] = []  # departures [s] and bytes of delayed datagrams

    def put(self, *timetable: Fault) -> None:
        """Replace the timetable by these faults. A device that is `slow` stays so."""
        slow = tuple(fault for fault in self._timetable if fault.kind == "slow")
        self._timetable = (*slow, *timetable)
        self._clock = _device_clock(self._timetable, self._repeat)

    def active(self, kind: Kind, time: float) -> bool:
        """Say whether a fault of the box itself is active at `time` [s]."""
        return self._active_fault(kind, time) is not None

    def status(self, time: float) -> int:
        """Return the additional status bits of the box at `time` [s]."""
        fault = self._active_fault("status", time)
        return 0 if fault is None else fault.status

    def count_factor(self, time: float) -> float:
        """Return the factor of the box's counts per unit at `time` [s], relative to the start."""
        fault = self._active_fault("units", time)
        return 1.0 if fault is None else fault.share

    def device_time(self, times: Array) -> Array:
        """Return the time of the device's own clock (n,) [s] at `times` (n,) [s]."""
        return times if self._clock is None else _through(times, *self._clock)

    def instants(self, ages: Array) -> Array:
        """Return the times (n,) [s] at which the device's own clock reaches `ages` (n,) [s]."""
        return ages if self._clock is None else _through(ages, *reversed(self._clock))

    def during(self, kind: Kind, times: Array) -> Mask:
        """Mark the `times` (n,) [s] at which a fault of the box itself is active."""
        return np.array([self.active(kind, time) for time in times.tolist()], np.bool_)

    def due(self, start: float, now: float, rate: float, previous: int, most: int = 2**31) -> tuple[Array, int]:
        """Return the due times (n,) [s], up to `now`, of the next records of a stream since `start`, and their total.

        `previous` records were sent before, and count in the total. The device's own clock gives `rate` records a
        second. Of more than `most` in one call the first are omitted: a real line would have sent them while the
        computer was busy.
        """
        since, age = self.device_time(np.array([start, now])).tolist()
        total = max(int((age - since) * rate), previous)
        return self.instants(since + np.arange(max(previous, total - most), total) / rate), total

    def sensed_wrench(self, bench: Bench, times: Array) -> Array:
        """Return the wrench (n, 6) measured by a drifting or wrongly calibrated device at `times` (n,) [s]."""
        wrench = bench.wrench(times)
        local = times % self._repeat if self._repeat > 0.0 else times
        for fault in self._timetable:
            if fault.kind == "drift":
                fraction = np.clip((local - fault.start) / (fault.stop - fault.start), 0.0, 1.0)
                wrench = wrench + fault.share * fraction[:, None] * np.array(bench.settings.rated)
            elif fault.kind == "miscalibrate":
                during = (local >= fault.start) & (local < fault.stop)
                wrench = wrench * np.where(during, 1.0 + fault.share, 1.0)[:, None]
        return wrench

    def route(self, now: float, datagrams: Iterable[tuple[float, bytes]]) -> list[bytes]:
        """Return the departures by `now` [s] of `datagrams`, each with its time [s], and of earlier delayed ones."""
        if not self._timetable and not self._delays and self._swap is None:  # as most boxes, all the time
            return [datagram for _, datagram in datagrams]
        departures: list[bytes] = []
        for time, datagram in datagrams:
            departures += self._overdue(time)
            hurt = self._hurt(time, datagram)
            departures += [] if self.active("unplug", time) else hurt
        return departures + self._overdue(now)

    def _overdue(self, time: float) -> list[bytes]:
        datagrams: list[bytes] = []
        while self._delays and self._delays[0][0] <= time:
            leaves, datagram = heapq.heappop(self._delays)
            datagrams += [] if self.active("unplug", leaves) else [datagram]
        return datagrams

    def _hurt(self, time: float, datagram: bytes) -> list[bytes]:
        """Return the datagrams that replace one datagram, in order of departure."""
        datagrams = [datagram]
        for kind in _ON_THE_WAY:
            fault = self._active_fault(kind, time)
            if fault is None:
                continue
            draw = np.random.default_rng([self._seed, round(time * 1e6), FAULT_KINDS.index(kind)])
            if draw.uniform() < fault.share:
                datagrams = self._carry_out(fault, time, datagram, draw)
                break
        if datagrams and self._swap is not None:
            datagrams.append(self._swap)
            self._swap = None
        return datagrams

    def _carry_out(self, fault: Fault, time: float, datagram: bytes, draw: np.random.Generator) -> list[bytes]:
        match fault.kind:
            case "repeat":
                return [datagram, datagram]
            case "reorder" if self._swap is None:
                self._swap = datagram
                return []
            case "corrupt":
                return [draw.bytes(len(datagram))]
            case "shorten":
                return [datagram[: int(draw.integers(0, len(datagram)))]]
            case "delay":
                heapq.heappush(self._delays, (time + fault.delay, datagram))
                return []
            case "lose":
                return []
            case _:
                return [datagram]

    def _active_fault(self, kind: Kind, time: float) -> Fault | None:
        local = time % self._repeat if self._repeat > 0.0 else time
        for fault in self._timetable:  # a generator would take most of the box's time: a dozen calls for each record
            if fault.kind == kind and fault.start <= local < fault.stop:
                return fault
        return None


def _device_clock(timetable: Sequence[Fault], repeat: float) -> tuple[Array, Array] | None:
    """Return knots of time and of the device's own clock [s] over one cycle of the timetable; None where they agree."""
    slow = [fault for fault in timetable if fault.kind == "slow"]
    if not slow:
        return None
    last = repeat or FOREVER
    times = np.unique([0.0, last, *(edge for fault in slow for edge in (fault.start, fault.stop) if edge < last)])
    middles = (times[:-1] + times[1:]) / 2.0
    speed = np.ones(len(middles))
    for fault in slow:
        speed[(middles >= fault.start) & (middles < fault.stop)] = 1.0 - fault.share
    return times, np.concatenate([[0.0], np.cumsum(speed * np.diff(times))])


def _through(values: Array, nodes: Array, sought: Array) -> Array:
    """Interpolate `sought` over `nodes` at `values` (n,), periodically continued beyond the last node."""
    rounds = np.floor(values / nodes[-1])
    within = np.array(np.interp(values - rounds * nodes[-1], nodes, sought), np.float64)
    return within + rounds * float(sought[-1])
