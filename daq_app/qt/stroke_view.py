"""A measured stroke: forces and their ratio over time, with the edges of its windows as handles."""

from typing import Any

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFocusEvent, QFontMetricsF, QKeyEvent
from PySide6.QtWidgets import QPushButton, QSizePolicy, QWidget

from daq_app.analyst.frame import read_out
from daq_app.analyst.stroke import EDGE_LEAP, EDGE_STEP, EDGES, Edge, EdgePosition, RawReadings, clamp_edge, edges_of
from daq_app.qt.layout import hbox, vbox
from daq_app.qt.painting import sheer
from daq_app.qt.plots import ZoomedPlot, pg
from daq_app.qt.tokens import GRID, MU, SMALL, N, T, Tokens, font
from daq_app.wording import tr, tr_noop
from sessions.report.contents import StrokeFinding

_NAMES: dict[Edge, str] = tr_noop({"onset": "onset", "steady begin": "steady", "steady end": "to", "lift": "lift"})
_ROWS: dict[Edge, int] = {"onset": 0, "steady begin": 1, "steady end": 1, "lift": 0}  # of the labels above the curves


class EdgeHandle(QPushButton):
    """Shows the time of an edge; `moved` carries it during a move, `recorded` at its end."""

    moved = Signal(str, float)  # edge, time [s, device time]
    recorded = Signal(str, float)  # edge, time [s, device time]

    def __init__(self, edge: Edge) -> None:
        super().__init__()
        self.edge: Edge = edge
        self._placed: EdgePosition | None = None
        self._time, self._origin = 0.0, 0.0
        self.setAutoDefault(False)
        self.setProperty("role", "handle")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.show_edge(None, 0.0)

    def show_edge(self, placed: EdgePosition | None, origin: float) -> None:
        """Show an edge, with its time from `origin` [s]."""
        self._placed, self._origin = placed, origin
        self._time = 0.0 if placed is None else placed.time
        self.setEnabled(placed is not None)
        self._show()

    def show_at(self, time: float) -> None:
        """Show the time to which the edge is being moved [s, device time]."""
        self._time = time
        self._show()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        far = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        match event.key():
            case Qt.Key.Key_Left:
                self.moved.emit(self.edge, self._time - (EDGE_LEAP if far else EDGE_STEP))
            case Qt.Key.Key_Right:
                self.moved.emit(self.edge, self._time + (EDGE_LEAP if far else EDGE_STEP))
            case Qt.Key.Key_Return | Qt.Key.Key_Enter if self._away:
                self.recorded.emit(self.edge, self._time)
            case Qt.Key.Key_Escape if self._away:
                self._back()
            case _:
                super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Undo an unrecorded move: only Enter records."""
        if self._away:
            self._back()
        super().focusOutEvent(event)

    @property
    def _away(self) -> bool:
        return self._placed is not None and self._time != self._placed.time

    def _back(self) -> None:
        if self._placed is not None:
            self.moved.emit(self.edge, self._placed.time)

    def _show(self) -> None:
        name, placed = tr(_NAMES[self.edge]), self._placed
        if placed is None:
            self.setText(name)
            self.setAccessibleName(tr("{name}: no stroke", name=name))
            return
        time_text = f"{self._time - self._origin:.3f} s"
        mark = "✎ " if placed.decision else "" if placed.present else "○ "
        self.setText(f"{mark}{name} {time_text}{' ⏎' if self._away else ''}")
        state = placed.decision or (tr("as found") if placed.present else tr("not found; where it could be"))
        tool_tip = tr("{state}\nDrag the line, or: ← → move (Shift further), Enter records, Esc goes back", state=state)
        self.setToolTip(tool_tip)
        speech = {"steady begin": tr("steady from"), "steady end": tr("steady to")}.get(self.edge, name)
        self.setAccessibleName(f"{speech} {time_text}, {state}{tr(', Enter records') if self._away else ''}")


class StrokeView(QWidget):
    """Two plots, one above the other, and a handle for each edge; time is counted from contact onset."""

    moved = Signal(str, float)  # edge, new time [s, device time]

    def __init__(self, tokens: Tokens) -> None:
        super().__init__()
        self._tokens = tokens
        self._stroke: StrokeFinding | None = None
        self._origin = 0.0
        self._time = np.empty(0)
        self._columns = [np.empty(0)] * 3
        self._raw: RawReadings | None = None
        self._plots = [_plot(tokens, name) for name in (tr("N and T [N]"), "µ = T/N [-]")]
        for plot in self._plots:
            plot.reset, plot.read = self.show_all, self._read
        self._plots[0].getPlotItem().getAxis("bottom").setLabel("")
        self._plots[1].setXLink(self._plots[0])
        self._windows = [
            pg.LinearRegionItem(brush=sheer(tokens.act, 36), pen=pg.mkPen(None), movable=False, span=(0, 1))
            for _ in self._plots
        ]
        pen = pg.mkPen(sheer(tokens.quiet, 110), width=1)
        self._raw_curves = [pg.PlotCurveItem(pen=pen, connect="finite") for _ in range(2)]
        self._curves = [
            pg.PlotCurveItem(pen=pg.mkPen(colour, width=2), connect="finite", name=name)
            for colour, name in ((N, "N"), (T, "T"), (MU, "µ"))
        ]
        self._plots[0].name_curves(self._curves[:2], (0.5, 0.0))
        for item in (*self._raw_curves, *self._curves[:2], self._windows[0]):
            self._plots[0].addItem(item)
        for item in (self._curves[2], self._windows[1]):
            self._plots[1].addItem(item)
        self._now = [pg.InfiniteLine(angle=90, pen=pg.mkPen(tokens.text, width=2)) for _ in self._plots]
        for plot, line in zip(self._plots, self._now, strict=True):
            plot.addItem(line, ignoreBounds=True)
            line.hide()
        self._lines = {edge: [self._line(edge, plot) for plot in self._plots] for edge in EDGES}
        self.handles: dict[Edge, EdgeHandle] = {edge: EdgeHandle(edge) for edge in EDGES}
        for handle in self.handles.values():
            handle.moved.connect(self._try)
            handle.recorded.connect(self.moved.emit)
        strip = hbox(*((handle, 1) for handle in self.handles.values()), spacing=GRID // 2)
        vbox(*((plot, 1) for plot in self._plots), strip, on=self, spacing=GRID // 2)
        self._extent = self._range = (0.0, 1.0)  # of the forces, and of the plot with the labels of edges [N]
        self._forces: Any = self._plots[0].getPlotItem().getViewBox()
        self._forces.sigResized.connect(self._make_room)
        self.show_stroke(None)

    def show_stroke(self, stroke: StrokeFinding | None) -> None:
        trace = None if stroke is None else stroke.trace
        is_another = self._stroke is None or stroke is None or stroke.number != self._stroke.number
        self._stroke = stroke
        self._origin = 0.0 if trace is None else trace.origin
        word = tr("no stroke") if stroke is None else tr("stroke {number}", number=stroke.number)
        self.setAccessibleName(tr("forces and friction of {word}", word=word))
        self._time = np.empty(0) if trace is None else trace.time
        self._columns = [self._time] * 3 if trace is None else [trace.normal, trace.tangential, trace.mu]
        for plot in self._plots:
            plot.show_numbers(visible=len(self._time) > 0)
        self._plots[1].setLabel("bottom", tr("time since contact [s]") if len(self._time) else word)
        self.show_edges()
        if is_another:
            self._raw = None
        self.show_moment(None)
        if is_another:
            self.show_all()

    def show_all(self) -> None:
        for plot in self._plots:
            plot.enableAutoRange()
            plot.autoRange()
            plot.disableAutoRange()
        if len(self._time):
            self._plots[0].setXRange(self._time[0], self._time[-1], padding=0.09)
            finite = self._columns[2][np.isfinite(self._columns[2])]
            self._plots[1].setYRange(0.0, max(float(finite.max()), 0.01) if len(finite) else 1.0, padding=0.1)
        low, high = self._forces.viewRange()[1]
        self._extent = self._range = low, high
        self._make_room()

    def _make_room(self) -> None:
        """Place the labels of edges in rows above the curves, unless the plot is zoomed."""
        height, metrics = max(self._forces.height(), 1.0), QFontMetricsF(font(SMALL))
        row, (low, high) = 1.25 * metrics.height() / height, self._extent
        begin, end = (self._lines[edge][0] for edge in ("steady begin", "steady end"))
        long = sum(metrics.horizontalAdvance(line.label.format) for line in (begin, end)) + 2 * GRID
        apart = (end.value() - begin.value()) / max(self._forces.viewPixelSize()[0], 1e-12)
        rows: dict[Edge, int] = {**_ROWS, "steady end": 1 if apart > long else 2}
        for edge, number in rows.items():
            self._lines[edge][0].label.setPosition(1.0 - (number + 0.5) * row)
        if np.allclose(self._forces.viewRange()[1], self._range):
            share = min((max(rows.values()) + 1) * row, 0.6)
            self._range = low, low + (high - low) / (1.0 - share)
            self._plots[0].setYRange(*self._range, padding=0.0)

    def _read(self, time: float) -> str:
        names = (("N", "N"), ("T", "N"), ("µ", ""))
        curves = [(name, unit, column) for (name, unit), column in zip(names, self._columns, strict=True)]
        return read_out("s", self._time, time, curves)

    def show_readings(self, readings: RawReadings | None) -> None:
        """Show the recorded readings as thin lines behind the stroke."""
        self._raw = readings
        self.show_moment(None)

    def show_moment(self, index: int | None) -> None:
        """Show the readings up to one of them, as in a live plot; None shows the whole stroke."""
        raw = self._raw
        now = None if index is None or raw is None else float(raw.block.time[index]) - self._origin
        until = len(self._time) if now is None else int(np.searchsorted(self._time, now, side="right"))
        for curve, column in zip(self._curves, self._columns, strict=True):
            curve.setData(self._time[:until], column[:until])
        stop = 0 if raw is None else len(raw.block) if index is None else index + 1
        for curve, name in zip(self._raw_curves, ("normal", "tangential"), strict=True):
            data = () if raw is None else (raw.block.time[:stop] - self._origin, getattr(raw, name)[:stop])
            curve.setData(*(data or ([], [])))
        for line in self._now:
            line.setVisible(now is not None)
            if now is not None:
                line.setPos(now)

    def show_edges(self) -> None:
        by_edge = {} if self._stroke is None else {placement.edge: placement for placement in edges_of(self._stroke)}
        for edge in EDGES:
            placement = by_edge.get(edge)
            self.handles[edge].show_edge(placement, self._origin)
            for line in self._lines[edge]:
                line.setVisible(placement is not None)
                if placement is not None:
                    style = Qt.PenStyle.DashDotLine if placement.decision else Qt.PenStyle.SolidLine
                    style = style if placement.present else Qt.PenStyle.DotLine
                    line.setPen(pg.mkPen(self._tokens.act, width=3 if placement.decision else 1.5, style=style))
                    line.setPos(placement.time - self._origin)
            label: Any = self._lines[edge][0].label
            label.setFormat(f"✎ {tr(edge)}" if placement is not None and placement.decision else tr(edge))
        self._fill()

    def _fill(self) -> None:
        visible = self._stroke is not None and self._stroke.steady is not None
        limits = [float(self._lines[edge][0].value()) for edge in ("steady begin", "steady end")]
        for window in self._windows:
            window.setVisible(visible)
            window.setRegion(limits)
        self._make_room()

    def _try(self, edge: Edge, time: float) -> None:
        """Show an edge at the position to which it is being moved, within its limits."""
        if self._stroke is None:
            return
        inside = clamp_edge(self._stroke, edge, time)
        for line in self._lines[edge]:
            line.setPos(inside - self._origin)
        self.handles[edge].show_at(inside)
        self._fill()

    def _line(self, edge: Edge, plot: Any) -> Any:  # noqa: ANN401  pyqtgraph has no types
        line: Any = pg.InfiniteLine(angle=90, movable=True, hoverPen=pg.mkPen(self._tokens.text, width=3))
        if plot is self._plots[0]:
            side = 1.05 if edge in ("lift", "steady end") else -0.05  # on the side of the line with room
            anchors = [(side, 0.5)] * 2
            ground = self._tokens.surface if edge == "lift" else None  # covers the end of a window just before it
            look = {"color": self._tokens.act, "fill": ground}
            line.label = pg.InfLineLabel(line, tr(edge), anchors=anchors, **look)
            line.label.setFont(font(SMALL))
        line.sigDragged.connect(lambda: self._try(edge, float(line.value()) + self._origin))
        line.sigPositionChangeFinished.connect(lambda: self.moved.emit(edge, float(line.value()) + self._origin))
        plot.addItem(line, ignoreBounds=True)
        return line


def _plot(tokens: Tokens, name: str) -> Any:  # noqa: ANN401  pyqtgraph has no types
    plot = ZoomedPlot(tokens)
    item = plot.getPlotItem()
    item.showGrid(x=False, y=True, alpha=0.15)
    item.setLabel("left", name)
    metrics = QFontMetricsF(font(SMALL))
    item.getAxis("left").setWidth(round(metrics.horizontalAdvance("00.00") + 1.5 * metrics.height()))  # common
    return plot
