"""A stroke as it was felt: forces and their ratio over time, with its steady window."""

from typing import Any

import numpy as np
import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QVBoxLayout, QWidget

from daq_app.qt.tokens import MU, N, T, Tokens
from sessions.report.contents import StrokeFinding

pg: Any = pyqtgraph  # it has no types


class StrokeView(QWidget):
    """Two plots above each other; the time is since contact onset."""

    def __init__(self, tokens: Tokens) -> None:
        """Show nothing yet."""
        super().__init__()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self._plots = [_plot(tokens, name) for name in ("N and T [N]", "µ = T/N [-]")]
        for plot in self._plots:
            layout.addWidget(plot)
        self._plots[1].setXLink(self._plots[0])
        fill = QColor(tokens.act)
        fill.setAlpha(36)
        pen = pg.mkPen(tokens.act, style=Qt.PenStyle.DotLine)
        self._windows = [pg.LinearRegionItem(brush=fill, pen=pen, movable=False) for _ in self._plots]
        self._curves = [pg.PlotCurveItem(pen=pg.mkPen(colour), connect="finite") for colour in (N, T, MU)]
        for item in (*self._curves[:2], self._windows[0]):
            self._plots[0].addItem(item)
        for item in (self._curves[2], self._windows[1]):
            self._plots[1].addItem(item)
        self.show_stroke(None)

    def show_stroke(self, stroke: StrokeFinding | None) -> None:
        """Show a stroke, or nothing."""
        trace = None if stroke is None else stroke.trace
        steady = None if stroke is None else stroke.steady
        name = "no stroke" if stroke is None else f"stroke {stroke.number}"
        self.setAccessibleName(f"forces and friction of {name}")
        values = ((), (), ()) if trace is None else (trace.normal, trace.tangential, trace.mu)
        time = np.array(() if trace is None else trace.time, np.float64)
        for curve, column in zip(self._curves, values, strict=True):
            curve.setData(time, np.array([np.nan if v is None else v for v in column], np.float64))
        for window in self._windows:
            window.setVisible(steady is not None and trace is not None)
            if steady is not None and trace is not None:
                window.setRegion((steady[0] - trace.origin, steady[1] - trace.origin))
        for plot in self._plots:
            plot.autoRange()


def _plot(tokens: Tokens, name: str) -> Any:  # noqa: ANN401  pyqtgraph has no types
    plot = pg.PlotWidget(background=tokens.surface)
    plot.setMinimumSize(120, 80)
    plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    item = plot.getPlotItem()
    item.setMenuEnabled(False)
    item.hideButtons()
    item.showGrid(x=False, y=True, alpha=0.15)
    for side in ("left", "bottom"):
        item.getAxis(side).setPen(QColor(tokens.line))
        item.getAxis(side).setTextPen(QColor(tokens.quiet))
    item.getAxis("left").enableAutoSIPrefix(False)
    item.setLabel("left", name)
    item.setLabel("bottom", "time since contact [s]")
    return plot
