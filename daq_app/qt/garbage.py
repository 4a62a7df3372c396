"""Collects Python's cycles between two events of Qt, never inside one of its calls.

Qt locks senders of signals while it asks Python for `disconnectNotify`. A widget that Python's own collector deletes at
that moment waits for the same lock in the same thread, and the window stands still for ever. In another thread than the
window's no widget may be deleted at all.
"""

import gc

from PySide6.QtCore import QObject, QTimer

INTERVAL = 1000  # between two looks [ms]: the window makes 50 to 900 objects in one, and Python collects after 700


class GarbageCollector(QTimer):
    """Python's collector as a timer of the window's thread: while it is active, nothing else collects."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.timeout.connect(collect_due)

    def begin(self) -> None:
        """Collect from now on, in place of Python."""
        gc.disable()
        self.start(INTERVAL)

    def end(self) -> None:
        """Leave it to Python again."""
        self.stop()
        gc.enable()


def collect_due() -> None:
    """Collect the oldest generation whose threshold is passed, as Python itself would."""
    for generation in (2, 1, 0):
        if gc.get_count()[generation] > gc.get_threshold()[generation]:
            gc.collect(generation)
            return
