"""Live display of a streaming transducer: its readings as a wrench, its health, its overloads."""

import time
from collections import deque
from collections.abc import Callable
from typing import cast

import numpy as np

from daq_app.recorder.device_history import remember_overload
from daq_app.recorder.messages import HealthReport, Live, Report, Six
from drivers.arrays import Array
from drivers.calibration import LIMITS, loads
from drivers.readings import ReadingBlock
from drivers.transducer import Health, TransducerInfo

LIVE_EVERY = 1 / 60  # least time between two messages of readings [real s]
HEALTH_EVERY = 0.1  # between two of health [real s]
RATE_OVER = 1.0  # averaging time of the rate [real s]
_UNLOADED: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Display:
    """Gathers the stream and sends it periodically. It does not affect the recording."""

    def __init__(self, send: Callable[[Report], None], factor: float) -> None:
        """Send through `send`; the clock runs `factor` times as fast as real."""
        self._send = send
        self._factor = factor
        self._info: TransducerInfo | None = None
        self._stream = 0
        self._blocks: list[ReadingBlock] = []
        self._zero: Six = _UNLOADED
        self._load = self._peak = np.zeros(7)
        self._overload_told = False
        self._saturated = 0  # since somebody acknowledged
        self._counted = 0  # of those, in the totals of this stream
        self._arrivals: deque[tuple[float, int]] = deque()  # real time [s] and readings, over the last second
        self._live_due = self._health_due = 0.0
        self._newest_time = 0.0  # when the newest reading came, or the stream began [real s]

    def device(self, info: TransducerInfo | None) -> None:
        """Show this transducer from now on, or none. Zero and peaks stay: it may be the same one as before."""
        self._flush()
        self._info = info
        self._load = np.zeros(7)
        self._counted = 0
        self._health_due = 0.0
        self._newest_time = time.monotonic()

    def forget(self) -> None:
        """Forget the zero and the greatest loads: another transducer will be shown."""
        self.set_zero(_UNLOADED)
        self.acknowledge()

    def stream_began(self) -> None:
        """Begin a new stream, whose time and numbers restart."""
        self._flush()
        self._stream += 1
        self._newest_time = time.monotonic()
        self._arrivals.clear()
        self._counted = 0

    def set_zero(self, mean: Six) -> None:
        """Subtract this zero from now on [raw units]."""
        self._flush()
        self._zero = mean

    def acknowledge(self) -> None:
        """Forget the greatest loads."""
        self._peak = np.zeros(7)
        self._overload_told = False
        self._saturated = 0
        self._health_due = 0.0

    def take(self, block: ReadingBlock) -> None:
        """Take readings of the current stream."""
        if len(block) and self._info is not None:
            self._blocks.append(block)
            self._newest_time = time.monotonic()
            self._arrivals.append((self._newest_time, len(block)))

    def look(self, health: Health, *, streaming: bool = True) -> None:
        """Send the messages that are due; without `streaming`, missing readings count as no silence."""
        now = time.monotonic()
        if now >= self._live_due:
            self._live_due = now + LIVE_EVERY
            self._flush()
        if now >= self._health_due:
            self._health_due = now + HEALTH_EVERY
            self._tell_health(health, now, now - self._newest_time if streaming and self._info is not None else 0.0)

    def _flush(self) -> None:
        info, block = self._info, ReadingBlock.concatenate(self._blocks)
        self._blocks = []
        if info is None or not len(block):
            return
        calibration = info.calibration
        wrench = calibration.wrench(block.raw, np.zeros(6))
        load = loads(calibration.in_own_frame(wrench), calibration.rated).max(axis=0)
        self._load, self._peak = np.fmax(self._load, load), np.fmax(self._peak, load)
        if np.any(self._peak > LIMITS) and not self._overload_told:
            self._overload_told = True
            remember_overload(info, tuple(self._peak.tolist()))
        net_wrench = wrench - calibration.wrench(np.array([self._zero]), np.zeros(6))
        doubtful = np.where(info.status.doubtful(block.status), block.status, 0)
        times = block.sequence, block.time, block.received_ns
        self._send(Live(self._stream, *times, net_wrench, doubtful, self._zero))

    def _tell_health(self, health: Health, now: float, silence: float) -> None:
        while self._arrivals and now - self._arrivals[0][0] > RATE_OVER:
            self._arrivals.popleft()
        span = now - self._arrivals[0][0] if self._arrivals else 0.0
        # The first readings of the span came before it began.
        count = sum(readings for _, readings in self._arrivals) - (self._arrivals[0][1] if self._arrivals else 0)
        previous, self._counted = self._counted, health.saturated + health.doubtful
        self._saturated += self._counted - previous
        rated = np.full(6, np.nan) if self._info is None else self._info.calibration.rated
        unknown = np.isnan(np.append(rated, rated.sum()))
        load, peak = np.where(unknown, np.nan, self._load), np.where(unknown, np.nan, self._peak)
        rate = count / span / self._factor if span > 0.2 * RATE_OVER else 0.0
        self._send(HealthReport(health, rate, tuple(load.tolist()), tuple(peak.tolist()), self._saturated, silence))
        self._load = np.zeros(7)


def six(values: Array) -> Six:
    """Return an array (6,) as a tuple of floats."""
    return cast("Six", tuple(float(value) for value in values))
