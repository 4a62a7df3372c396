"""Runs Python's garbage collection between two Qt events, never inside a Qt call.

Qt locks senders of signals while it calls Python's `disconnectNotify`. A widget that Python's own collector deletes at
that moment waits for the same lock in the same thread, and the window hangs forever. No other thread than the
window's may delete a widget.
"""

import gc

from PySide6.QtCore import QObject, QTimer

INTERVAL = 1000  # between two checks [ms]: the window creates 50 to 900 objects in one, and Python collects after 700


class GarbageCollector(QTimer):
    """A timer in the window's thread that replaces Python's automatic collection while it is active."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.timeout.connect(collect_due)

    def begin(self) -> None:
        """Take over collection from Python."""
        gc.disable()
        self.start(INTERVAL)

    def end(self) -> None:
        """Return collection to Python."""
        self.stop()
        gc.enable()


def collect_due() -> None:
    """Collect the oldest generation beyond its threshold, as Python itself would."""
    for generation in (2, 1, 0):
        if gc.get_count()[generation] > gc.get_threshold()[generation]:
            gc.collect(generation)
            return
