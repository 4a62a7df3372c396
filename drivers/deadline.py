"""A link to a device, and the limit on waiting: every wait ends by a deadline or at a stop."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from drivers.transducer import LinkLost


class Link(Protocol):
    """A way to one device."""

    def send(self, data: bytes) -> None:
        """Send `data`. Raises LinkLost when the link is lost for good."""

    def receive(self, timeout: float) -> bytes | None:
        """Return the next bytes, or None when nothing arrived within `timeout` real seconds."""

    def close(self) -> None:
        """Release the port. Harmless when repeated."""


# All in real seconds.
CONNECTING = 4.5  # from opening a device to its first reading, so that opening and closing end within 5 s
FIRST_READING = 1.5  # reserved of these for starting the stream: a device of 1 Hz needs one
ENDING = 0.2  # for ending a stream
TICK = 0.03  # longest single wait, and so the longest delay of a stop


class Stopped(Exception):
    """A stop was requested during a wait."""


class Deadline:
    """A limit on a whole wait, which arriving data do not extend."""

    def __init__(self, seconds: float, stopping: threading.Event | None = None) -> None:
        """End in `seconds` real seconds, or as soon as `stopping` is set."""
        self._began = time.monotonic()
        self._seconds = seconds
        self._stopping = stopping

    @staticmethod
    def for_opening() -> "Deadline":
        """Return the limit on opening a device."""
        return Deadline(CONNECTING - FIRST_READING)

    @property
    def spent(self) -> float:
        """Real seconds since the limit was set."""
        return time.monotonic() - self._began

    @property
    def remaining(self) -> float:
        """Return the time that remains [real s], not below 0. Raises Stopped."""
        if self._stopping is not None and self._stopping.is_set():
            raise Stopped
        return max(self._seconds - self.spent, 0.0)

    def within(self, seconds: float) -> "Deadline":
        """Return a limit on a part of the wait: `seconds`, but not later than this one."""
        return Deadline(min(seconds, self.remaining), self._stopping)

    def check(self) -> None:
        """Raise LinkLost when the time is over, Stopped at a stop."""
        if self.remaining <= 0.0:
            raise LinkLost(f"it was not ready within {self._seconds:.2g} s; check its power, the cable and the address")

    def bound(self, link: Link) -> "_BoundLink":
        """Return the link, whose use ends by this deadline."""
        return _BoundLink(link, self)


Connect = Callable[[Deadline], Link]  # opens a link within a limit


@dataclass(eq=False)
class _BoundLink:
    """A link that raises LinkLost once a deadline is over, and Stopped at a stop."""

    link: Link
    deadline: Deadline

    def send(self, data: bytes) -> None:
        self.deadline.check()
        self.link.send(data)

    def receive(self, timeout: float) -> bytes | None:
        until = time.monotonic() + timeout
        while True:
            self.deadline.check()
            remaining_s = until - time.monotonic()
            data = self.link.receive(max(min(remaining_s, TICK, self.deadline.remaining), 0.0))
            if data is not None or remaining_s <= TICK:
                return data

    def close(self) -> None:
        self.link.close()
