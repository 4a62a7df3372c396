"""SIGINT and SIGTERM, deferred until the program can stop safely."""

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType


class Interruptions:
    """Whether a signal has asked the program to stop."""

    pending = False
    _at_once = False

    def handle(self, _signal: int, _frame: FrameType | None) -> None:
        """Handle a signal."""
        self.pending = True
        if self._at_once:
            self._at_once = False  # once: a second signal must not interrupt the clean-up after the first
            raise KeyboardInterrupt

    @contextmanager
    def raise_at_once(self) -> Generator[None]:
        """Let a signal raise KeyboardInterrupt immediately inside, for work that can stop anywhere."""
        self._at_once = True
        try:
            yield
        finally:
            self._at_once = False


@contextmanager
def interruptions() -> Generator[Interruptions]:
    """Defer SIGINT and SIGTERM inside. Python delivers signals to the main thread only: other threads see none."""
    interruption = Interruptions()
    if threading.current_thread() is not threading.main_thread():
        yield interruption
        return
    handlers = {number: signal.signal(number, interruption.handle) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield interruption
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
