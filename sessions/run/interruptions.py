"""Ctrl-C and a request to terminate, taken as a wish that is answered at a safe moment."""

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType


class Interruptions:
    """Whether somebody wants the program to stop."""

    has_come = False
    _at_once = False

    def hear(self, _signal: int, _frame: FrameType | None) -> None:
        """Be the signal handler."""
        self.has_come = True
        if self._at_once:
            self._at_once = False  # once: a second signal must not break the clearing up after the first
            raise KeyboardInterrupt

    @contextmanager
    def raise_at_once(self) -> Generator[None]:
        """Let a signal raise KeyboardInterrupt at once inside; for work that leaves nothing half written."""
        self._at_once = True
        try:
            yield
        finally:
            self._at_once = False


@contextmanager
def interruptions() -> Generator[Interruptions]:
    """Listen while inside. Signals reach the main thread only: elsewhere nothing is ever heard."""
    listening = Interruptions()
    if threading.current_thread() is not threading.main_thread():
        yield listening
        return
    before = {number: signal.signal(number, listening.hear) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield listening
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
