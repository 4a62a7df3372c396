"""The clock of a session: real, paced, or simulated."""

import math
import threading
import time
from typing import Protocol

LONGEST_STEP = 0.1  # of a clock shared by all parts of a simulated bench, shorter than people's reaction times [s]


class Clock(Protocol):
    """A monotonic clock with a wait."""

    @property
    def factor(self) -> float:
        """Seconds of this clock in one real second [-]; 1 for a real clock, 0 where they are unrelated."""

    def now_ns(self) -> int:
        """Return the time [ns], never running backwards."""

    def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of this clock."""


class RealClock:
    """The machine's monotonic clock."""

    factor = 1.0

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        time.sleep(max(seconds, 0.0))


class PacedClock:
    """A clock that runs `factor` times as fast as the machine's, for simulated benches only."""

    def __init__(self, factor: float, longest_step: float = math.inf) -> None:
        """Start at the machine's monotonic time, then run `factor` (> 0) times as fast.

        Between two readings of it the clock advances by at most `longest_step` [s of this clock]. A machine that halts
        all users of the clock for an instant then halts their time too. Users of two clocks must not limit them.
        """
        self.factor = factor
        self._longest_ns = longest_step * 1e9
        self._machine_ns = self._now_ns = time.monotonic_ns()
        self._lock = threading.Lock()

    def now_ns(self) -> int:
        with self._lock:
            machine_ns = time.monotonic_ns()
            self._now_ns += int(min((machine_ns - self._machine_ns) * self.factor, self._longest_ns))
            self._machine_ns = machine_ns
            return self._now_ns

    def sleep(self, seconds: float) -> None:
        until = self.now_ns() + int(max(seconds, 0.0) * 1e9)
        while (remaining_ns := until - self.now_ns()) > 0:
            time.sleep(min(remaining_ns, self._longest_ns) * 1e-9 / self.factor)


def clock_at(factor: float, longest_step: float = math.inf) -> Clock:
    """Return the machine's clock, or one that runs `factor` times as fast: see `PacedClock`."""
    return RealClock() if factor == 1.0 else PacedClock(factor, longest_step)


class SimulatedClock:
    """A clock that only moves during waits, for simulated benches only: a session takes no longer than its work.

    Every reading of it takes a microsecond, so that no two events share an instant.
    """

    factor = 0.0

    def __init__(self, at_ns: int = 1_000_000_000) -> None:
        self.at_ns = at_ns  # the time; reading this attribute does not move it [ns]

    def now_ns(self) -> int:
        self.at_ns += 1000
        return self.at_ns

    def sleep(self, seconds: float) -> None:
        self.at_ns += int(max(seconds, 0.0) * 1e9)


class StillClock:
    """A clock that does not advance, for recorded data."""

    factor = 1.0

    def __init__(self, at_ns: int) -> None:
        self.at_ns = at_ns  # the time [ns]

    def now_ns(self) -> int:
        return self.at_ns

    def sleep(self, seconds: float) -> None:
        """Return without waiting."""
