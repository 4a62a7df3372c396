"""One live plot: curves over the last seconds, with gaps left as gaps and what was found in them marked."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QResizeEvent
from PySide6.QtWidgets import QGraphicsItem, QVBoxLayout, QWidget

from daq_app.course_state import Mark
from daq_app.live_trace import CHANNELS, Columns
from daq_app.plot_scale import MARGIN, PlotScale
from daq_app.qt.curve import Curve
from daq_app.qt.tokens import SMALL, Tokens, font

pg: Any = pyqtgraph  # it has no types

AXIS_WIDTH = 52  # the same for all, so that their times stand under each other [before the font's scale]
LEAST_FOR_HALVES = 100  # a lower plot has numbers at its ends alone


class LivePlot(QWidget):
    """A plot whose time axis stands still: 0 is now."""

    def __init__(
        self,
        name: str,
        curves: Sequence[Curve],
        scale: PlotScale,
        tokens: Tokens,
        type_scale: float,
        channels: Sequence[str] = CHANNELS,
    ) -> None:
        """Show nothing yet; `channels` names the rows of what will be shown."""
        super().__init__()
        self._channels = tuple(channels)
        self._curves = tuple(curves)
        self._scale = scale
        self._tokens = tokens
        self._marks: list[Any] = []
        self._shown_marks: tuple[tuple[str, float, float], ...] = ()
        self._seconds = 0.0
        self.setAccessibleName(f"plot of {name}")
        self._plot: Any = pg.PlotWidget()
        self._plot.setMinimumSize(40, 32)
        self._plot.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._plot)
        item = self._item = self._plot.getPlotItem()
        item.setMenuEnabled(False)
        item.hideButtons()
        item.setMouseEnabled(False, False)
        item.showGrid(x=False, y=True, alpha=0.15)
        for side in ("left", "bottom"):
            axis = item.getAxis(side)
            # Painted once and copied from then on: the axes stand still while the curves move.
            axis.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
            axis.setStyle(
                tickFont=font(SMALL, type_scale), tickLength=-4, autoExpandTextSpace=False, hideOverlappingLabels=False
            )
        item.getAxis("left").setStyle(hideOverlappingLabels=False)
        item.getAxis("left").setWidth(round(AXIS_WIDTH * type_scale))
        item.getAxis("bottom").setHeight(round(22 * type_scale))
        self._label = pg.TextItem(name, anchor=(0, 0))
        self._label.setFont(font(SMALL, type_scale, bold=True))
        self._label.setParentItem(item.getViewBox())
        self._label.setPos(QPointF(6, 2))
        self._items = [pg.PlotCurveItem(connect="finite", antialias=False) for _ in self._curves]
        for made in self._items:
            item.addItem(made)
        self.set_tokens(tokens)
        self._show_scale()

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._tokens = tokens
        self._plot.setBackground(tokens.surface)
        for side in ("left", "bottom"):
            axis = self._item.getAxis(side)
            axis.setPen(QColor(tokens.line))
            axis.setTextPen(QColor(tokens.quiet))
        self._label.setColor(QColor(tokens.quiet))
        for curve, made in zip(self._curves, self._items, strict=True):
            style = Qt.PenStyle.DashLine if curve.dashed else Qt.PenStyle.SolidLine
            made.setPen(pg.mkPen(self._colour(curve.colour), width=1, style=style))

    def show_seconds(self, seconds: float) -> None:
        """Show the last so many seconds."""
        if seconds != self._seconds:
            self._seconds = seconds
            self._item.getViewBox().setXRange(-seconds, 0.0, padding=0)

    def show_columns(self, columns: Columns, now: float, marks: Sequence[Mark], clock: float) -> None:
        """Draw the columns with `now` [s, device time] at the right edge; `clock` [s] is for the scale's patience."""
        time = columns.time - now
        least, greatest = np.inf, -np.inf
        for curve, made in zip(self._curves, self._items, strict=True):
            values = columns.values[self._channels.index(curve.channel)]
            known = np.isfinite(values)
            if known.any():
                least, greatest = min(least, float(values[known].min())), max(greatest, float(values[known].max()))
            made.setData(time, values)
        scale = self._scale.following(least, greatest, clock)
        if (scale.low, scale.high) != (self._scale.low, self._scale.high):
            self._scale = scale
            self._show_scale()
        self._scale = scale
        self._show_marks(marks, now)

    def _show_scale(self) -> None:
        low, high = self._scale.low, self._scale.high
        self._item.getViewBox().setYRange(low, high, padding=MARGIN)
        ends = [value for value in (low, 0.0, high) if value == 0.0 or abs(value) >= 0.2 * (high - low)]
        halves = [low / 2, high / 2] if self.height() >= LEAST_FOR_HALVES else []
        ticks = sorted({value for value in (*ends, *halves) if low <= value <= high})
        self._item.getAxis("left").setTicks([[(value, f"{value:g}".replace("-", "−")) for value in ticks]])

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Show as many numbers as there is room for."""
        super().resizeEvent(event)
        self._show_scale()

    def _show_marks(self, marks: Sequence[Mark], now: float) -> None:
        """Move the marks with the readings: a line for onset and lift, a shaded stretch for the steady window."""
        wanted = tuple((mark.kind, mark.start, mark.stop) for mark in marks)
        if wanted != self._shown_marks:
            for made in self._marks:
                self._item.removeItem(made)
            self._marks = [self._mark(mark) for mark in marks]
            for made in self._marks:
                self._item.addItem(made)
            self._shown_marks = wanted
        for made, (kind, start, stop) in zip(self._marks, wanted, strict=True):
            if kind == "steady":
                made.setRegion((start - now, stop - now))
            else:
                made.setPos(start - now)

    def _mark(self, mark: Mark) -> Any:  # noqa: ANN401  pyqtgraph has no types
        colour = QColor(self._tokens.quiet)
        if mark.kind == "steady":
            fill = QColor(self._tokens.act)
            fill.setAlpha(36)
            return pg.LinearRegionItem(
                brush=fill, pen=pg.mkPen(self._tokens.act, style=Qt.PenStyle.DotLine), movable=False
            )
        style = Qt.PenStyle.SolidLine if mark.kind == "onset" else Qt.PenStyle.DashLine
        position = 0.86 if mark.kind == "onset" else 0.72
        return pg.InfiniteLine(
            pen=pg.mkPen(colour, width=1, style=style),
            label=mark.kind,
            labelOpts={"position": position, "color": colour, "movable": False},
        )

    def _colour(self, name: str) -> str:
        return name if name.startswith("#") else str(getattr(self._tokens, name))
