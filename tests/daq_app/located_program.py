"""The program as it is started, which tells a test where something is: a name in, "x y title of its window" out."""

import sys

from daq_app.qt import start


def where(name):
    """Return the middle of a part that can be used [pixels], by how its name for screen readers begins; "" for none."""
    from PySide6.QtWidgets import QApplication, QWidget

    for window in QApplication.topLevelWidgets():
        for part in window.findChildren(QWidget):
            if part.isVisible() and part.isEnabled() and part.accessibleName().startswith(name):
                middle = part.mapToGlobal(part.rect().center())
                return f"{middle.x()} {middle.y()} {window.windowTitle()}"
    return ""


def answer():
    sys.stdout.write(f"{where(sys.stdin.readline().strip())}\n")
    sys.stdout.flush()


def main():
    from PySide6.QtCore import QSocketNotifier

    open_usual = start.open_window

    def open_answering(*arguments, **options):
        window = open_usual(*arguments, **options)
        window.notifier = QSocketNotifier(sys.stdin.fileno(), QSocketNotifier.Type.Read, window)
        window.notifier.activated.connect(answer)
        return window

    start.open_window = open_answering
    sys.exit(start.window([]))


if __name__ == "__main__":
    main()
