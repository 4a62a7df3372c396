"""A box that a thread of its own serves until it is closed: its time and its end."""

import threading
from collections.abc import Callable

from drivers.clock import Clock
from simulators.faults import Faults


class ServedBox:
    """One box. Its time, and the bench's, begins when it is started."""

    def __init__(self, clock: Clock, faults: Faults | None) -> None:
        """Set up a box without any fault unless told."""
        self.clock = clock
        self.faults = faults or Faults()
        self.closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._origin_ns = 0

    def now(self) -> float:
        """Return the box's and the bench's time [s]: 0 when it was started."""
        return (self.clock.now_ns() - self._origin_ns) * 1e-9

    def serve(self, work: Callable[[], None], name: str) -> None:
        """Let time begin, and a thread work until `closing` is set."""
        self._origin_ns = self.clock.now_ns()
        self._thread = threading.Thread(target=work, name=f"simulated {name}")
        self._thread.start()

    def close(self) -> None:
        """Switch the box off. Harmless when repeated."""
        self.closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
