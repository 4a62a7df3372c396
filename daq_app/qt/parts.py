"""How labels, buttons and panels of the window are made, so that all of them look and are named alike."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLabel, QPushButton, QVBoxLayout, QWidget

from daq_app.qt.tokens import GRID


def label(text: str = "", role: str = "value", *, wrap: bool = False) -> QLabel:
    """Return a label; `role` is one of the style sheet's."""
    made = QLabel(text)
    made.setProperty("role", role)
    made.setWordWrap(wrap)
    made.setTextFormat(Qt.TextFormat.PlainText)
    return made


def button(text: str, name: str, does: Callable[[], object], role: str = "") -> QPushButton:
    """Return a button that says `name` to screen readers."""
    made = QPushButton(text)
    made.setAccessibleName(name)
    if role:
        made.setProperty("role", role)
    made.setAutoDefault(False)
    made.clicked.connect(lambda: does())
    return made


def panel(name: str) -> tuple[QFrame, QVBoxLayout]:
    """Return a framed panel with a name for screen readers, and its layout."""
    frame = QFrame()
    frame.setProperty("role", "panel")
    frame.setAccessibleName(name)
    layout = QVBoxLayout(frame)
    layout.setContentsMargins(2 * GRID, int(1.5 * GRID), 2 * GRID, int(1.5 * GRID))
    layout.setSpacing(GRID)
    return frame, layout


def regrade(widget: QWidget, grade: str) -> None:
    """Give a widget another grade of the style sheet."""
    if widget.property("grade") != grade:
        widget.setProperty("grade", grade)
        widget.style().unpolish(widget)
        widget.style().polish(widget)
        for child in widget.findChildren(QWidget):
            child.style().unpolish(child)
            child.style().polish(child)


def say(widget: QLabel, text: str) -> None:
    """Show a text, only where it is another one: nothing is laid out anew for nothing."""
    if widget.text() != text:
        widget.setText(text)
