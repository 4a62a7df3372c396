"""A plot that the wheel zooms and the mouse moves; Home or a double-click shows all of it again."""

from collections.abc import Callable
from typing import Any

import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent

from daq_app.qt.tokens import Tokens

pg: Any = pyqtgraph  # it has no types


class ZoomedPlot(pg.PlotWidget):
    """A plot in the colours of a theme; `reset` shows all of it."""

    reset: Callable[[], None]

    def __init__(self, tokens: Tokens) -> None:
        """Show nothing yet."""
        base: Any = super()
        base.__init__(background=tokens.surface)
        self.setMinimumSize(120, 100)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setToolTip("Wheel: zoom. Drag: move. Home or double-click: show all.")
        item: Any = self.getPlotItem()
        self.reset = item.enableAutoRange
        item.setMenuEnabled(False)
        item.hideButtons()
        for side in ("left", "bottom"):
            item.getAxis(side).setPen(QColor(tokens.line))
            item.getAxis(side).setTextPen(QColor(tokens.quiet))
            item.getAxis(side).enableAutoSIPrefix(False)

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Show all with Home; leave every other key to the window."""
        if event.key() == Qt.Key.Key_Home:
            self.reset()
        else:
            event.ignore()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:  # noqa: N802  Qt's name
        """Show all."""
        event.accept()
        self.reset()
