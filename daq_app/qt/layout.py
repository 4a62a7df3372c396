"""Rows, columns, stacks and scroll areas of the window's parts."""

from typing import TypeVar

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QLayout, QScrollArea, QStackedWidget, QVBoxLayout, QWidget

Margins = int | tuple[int, int, int, int]  # around a layout: left, top, right, bottom [px]
B = TypeVar("B", bound=QBoxLayout)
Part = QWidget | QLayout | int | tuple[QWidget | QLayout, int]  # with its stretch; a number is an empty stretch


def fill(layout: B, *parts: Part) -> B:
    """Append parts to a layout and return it."""
    for item in parts:
        content, stretch = item if isinstance(item, tuple) else (item, 0)
        if isinstance(content, QWidget):
            layout.addWidget(content, stretch)
        elif isinstance(content, QLayout):
            layout.addLayout(content, stretch)
        else:
            layout.addStretch(content)
    return layout


def hbox(*parts: Part, on: QWidget | None = None, margins: Margins = 0, spacing: int | None = None) -> QHBoxLayout:
    """Return a row of parts, as the layout of a widget or within another layout."""
    return _arrange(QHBoxLayout(), parts, on, margins, spacing)


def vbox(*parts: Part, on: QWidget | None = None, margins: Margins = 0, spacing: int | None = None) -> QVBoxLayout:
    """Return a column of parts, as the layout of a widget or within another layout."""
    return _arrange(QVBoxLayout(), parts, on, margins, spacing)


def _arrange(layout: B, parts: tuple[Part, ...], on: QWidget | None, margins: Margins, spacing: int | None) -> B:
    layout.setContentsMargins(*(margins if isinstance(margins, tuple) else (margins,) * 4))
    if spacing is not None:
        layout.setSpacing(spacing)
    if on is not None:
        on.setLayout(layout)
    return fill(layout, *parts)


def set_horizontal(layout: QBoxLayout, horizontal: bool) -> None:
    """Arrange the parts of a layout in a row, or in a column."""
    layout.setDirection(QBoxLayout.Direction.LeftToRight if horizontal else QBoxLayout.Direction.TopToBottom)


def stack_pages(*pages: QWidget) -> QStackedWidget:
    """Return a stack of pages that shows the first."""
    stack = QStackedWidget()
    for page in pages:
        stack.addWidget(page)
    return stack


def scroll_area(inside: QWidget, area: QScrollArea | None = None) -> QScrollArea:
    """Return a frameless scroll area, a new one unless given, around `inside`."""
    area = area or QScrollArea()
    inside.setObjectName("inside")
    area.setWidget(inside)
    area.setWidgetResizable(True)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    return area
