"""The clock everything in a session is timed by: real, or told to run faster than real."""

import time
from typing import Protocol


class Clock(Protocol):
    """A monotonic clock that can be waited on."""

    @property
    def factor(self) -> float:
        """Told seconds that pass in one real second [-]; 1 for a real clock, 0 where the two are not related."""
        ...

    def now_ns(self) -> int:
        """Return the time [ns], never running backwards."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait for so many seconds of this clock."""
        ...


class RealClock:
    """The machine's monotonic clock."""

    factor = 1.0

    def now_ns(self) -> int:
        """Return the machine's monotonic time [ns]."""
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        """Wait for `seconds`."""
        time.sleep(max(seconds, 0.0))


class PacedClock:
    """A clock that runs `factor` times as fast as the machine's, for simulated benches only."""

    def __init__(self, factor: float) -> None:
        """Start at the machine's monotonic time, then run `factor` (> 0) times as fast."""
        self.factor = factor
        self._origin_ns = time.monotonic_ns()

    def now_ns(self) -> int:
        """Return the told time [ns]."""
        return self._origin_ns + int((time.monotonic_ns() - self._origin_ns) * self.factor)

    def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of told time."""
        time.sleep(max(seconds, 0.0) / self.factor)


class ToldClock:
    """A clock that moves when it is waited on, for simulated benches only: a session takes no longer than its work.

    Every look takes a microsecond, so that no two events share an instant.
    """

    factor = 0.0

    def __init__(self) -> None:
        """Start at one second."""
        self._now_ns = 1_000_000_000

    def now_ns(self) -> int:
        """Return the told time [ns]."""
        self._now_ns += 1000
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        """Let `seconds` of told time pass at once."""
        self._now_ns += int(max(seconds, 0.0) * 1e9)


class StillClock:
    """A clock that stands, for what is read back and happens no more."""

    factor = 1.0

    def __init__(self, at_ns: int) -> None:
        """Stand at `at_ns` [ns]."""
        self._at_ns = at_ns

    def now_ns(self) -> int:
        """Return where it stands [ns]."""
        return self._at_ns

    def sleep(self, seconds: float) -> None:
        """Pass no time: there is nothing to wait for."""
