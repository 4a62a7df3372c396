"""Plots that zoom with the wheel and move with the mouse; curves of a field, and its selection."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyqtgraph
from PySide6.QtCore import QEvent, QLocale, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QKeyEvent, QMouseEvent, QValidator
from PySide6.QtWidgets import QDoubleSpinBox, QWidget

from daq_app.analyst.frame import FIELD_CHOICES, FieldChoice, Frame, Line, Range, along_line, along_skin, read_out
from daq_app.qt.layout import hbox, vbox
from daq_app.qt.parts import button, choice, label
from daq_app.qt.preferences import type_scale
from daq_app.qt.tokens import GRID, MODEL, SMALL, TARGET, Tokens, font
from daq_app.wording import step_above, tr, tr_noop
from drivers.arrays import Array
from solver.prediction import ROW

pg: Any = pyqtgraph  # has no types: other modules import it from here
Curve = tuple[Array, Array]
_NOTHING: Curve = (np.empty(0), np.empty(0))
_NAMES = ("A", "B")  # of two sessions
_RECEPTORS, SKIN, LINE = range(3)
SOURCES = (tr_noop("SED of the receptors"), tr_noop("Field along the skin"), tr_noop("Field along the line"))
_PLACES = (
    tr_noop("along the skin, proximal to distal [mm]"),
    tr_noop("along the skin at rest, proximal to distal [mm]"),
    tr_noop("from A to B [mm]"),
)
ALL_TRIALS, OWN, FIXED_RANGE = range(3)
_LARGEST = 1e6  # in a number field: far beyond any stress or strain of tissue


class RoomyAxis(pg.AxisItem):
    """A vertical axis with a complete name, whose labels are at least a line apart."""

    def resizeEvent(self, event: object = None) -> None:
        """Centre the name; one longer than the axis begins at its top, and ends next to the labels below the plot."""
        pg.AxisItem.resizeEvent(self, event)
        self.label.setY(max(self.label.y(), self.label.boundingRect().width()))

    def tickSpacing(self, least: float, greatest: float, size: float) -> list[tuple[float, float]]:  # noqa: N802  Qt's
        """Return spacings and offsets of the labels on `size` pixels, the widest first."""
        spacings = pg.AxisItem.tickSpacing(self, least, greatest, size)
        spacing = QFontMetricsF(self.style["tickFont"]).height() * (greatest - least) / size
        if not spacings or spacings[0][0] >= spacing:
            return spacings
        return [(step_above(spacing), 0.0)]


def style_axis(axis: Any, tokens: Tokens, type_face: QFont) -> None:  # noqa: ANN401  pyqtgraph has no types
    """Give an axis the colours of a theme, a type face and true minus signs."""
    numbers = axis.tickStrings

    def with_minus_signs(*ticks: Any) -> list[str]:  # noqa: ANN401
        return [text.replace("-", "−") for text in numbers(*ticks)]

    axis.tickStrings = with_minus_signs
    axis.setTickFont(type_face)
    axis.setLabel(**{"font-size": f"{type_face.pixelSize()}px"})
    axis.setPen(QColor(tokens.line))
    axis.setTextPen(QColor(tokens.quiet))
    axis.enableAutoSIPrefix(False)


def name_axis(axis: Any, text: str) -> None:  # noqa: ANN401  pyqtgraph has no types
    """Set the label of an axis, centred: pyqtgraph centres a new label only when the axis is resized."""
    if text != axis.labelText:
        axis.setLabel(text)
        axis.resizeEvent()


class ZoomedPlot(pg.PlotWidget):
    """A plot in the colours of a theme; `reset` shows all of it, `read` returns the text at a position."""

    reset: Callable[[], None]
    read: Callable[[float], str] | None = None

    def __init__(self, tokens: Tokens) -> None:
        axes = {"left": RoomyAxis("left")}
        pg.PlotWidget.__init__(self, background=tokens.surface, axisItems=axes, enableMenu=False)
        self._names: Any = None
        self._text = tokens.text
        self.setMinimumSize(120, round(100 + 160 * (type_scale() - 1)))  # the axes grow with the type
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setToolTip(tr("Wheel: zoom. Drag: move. Home or double-click: show all."))
        item: Any = self.getPlotItem()
        self.reset = item.enableAutoRange
        self._pointer = pg.InfiniteLine(angle=90, pen=pg.mkPen(tokens.text, width=1))
        item.addItem(self._pointer, ignoreBounds=True)
        self.readout = label("", "tight")
        self.readout.setParent(self)
        self.readout.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.readout.setStyleSheet(f"background: {tokens.surface}; color: {tokens.text}; padding: 0 {GRID // 2}px;")
        self._hide_words()
        item.hideButtons()
        for side in ("left", "bottom"):
            style_axis(item.getAxis(side), tokens, font(SMALL))

    def name_across(self, name: str) -> None:
        """Name the horizontal axis in one or two lines, below its labels."""
        axis: Any = self.getPlotItem().getAxis("bottom")
        name_axis(axis, name)
        above = axis.style["tickTextOffset"][1] + QFontMetricsF(axis.style["tickFont"]).height()
        axis.setHeight(round(above + axis.label.boundingRect().height()))

    def show_numbers(self, *, visible: bool) -> None:
        """Show the labels of both axes, or hide them: an empty plot has no scale."""
        for side in ("left", "bottom"):
            self.getPlotItem().getAxis(side).setStyle(showValues=visible)

    def name_curves(self, curves: Sequence[Any], corner: tuple[float, float]) -> None:
        """Add a legend of curves at `corner`, from 0, 0 at the top left to 1, 1."""
        if self._names is not None:
            self._names.scene().removeItem(self._names)
            self._names = None
        if curves:
            size = f"{font(SMALL).pixelSize()}px"
            self._names = pg.LegendItem(offset=None, colCount=len(curves), labelTextSize=size, pen=None, brush=None)
            self._names.layout.setContentsMargins(GRID, 0, GRID, 0)
            self._names.setParentItem(self.getPlotItem().getViewBox())
            self._names.anchor(corner, corner)
            self._names.setLabelTextColor(self._text)
            for curve in curves:
                self._names.addItem(curve, curve.name())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Home:
            self.reset()
        else:
            event.ignore()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        pg.PlotWidget.mouseMoveEvent(self, event)
        box: Any = self.getPlotItem().getViewBox()
        scene, room = self.mapToScene(event.position().toPoint()), box.sceneBoundingRect()
        x = float(box.mapSceneToView(scene).x())
        text = self.read(x) if self.read is not None and room.contains(scene) else ""
        if not text:
            self._hide_words()
            return
        self._pointer.setPos(x)
        self._pointer.show()
        self.readout.setText(text)
        self.readout.adjustSize()
        left = room.left() if scene.x() > room.center().x() else room.right() - self.readout.width()
        self.readout.move(round(left), round(room.top()))
        self.readout.show()

    def leaveEvent(self, event: QEvent) -> None:
        self._hide_words()
        pg.PlotWidget.leaveEvent(self, event)

    def _hide_words(self) -> None:
        self.readout.hide()
        self._pointer.hide()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        event.accept()
        self.reset()


class FieldPlot(QWidget):
    """A list of curves, a button to draw a line, and the plot."""

    changed = Signal()

    def __init__(self, tokens: Tokens) -> None:
        super().__init__()
        self.source = choice(tr("what is plotted under the finger"), map(tr, SOURCES))
        name = tr("draw a line over the finger with the mouse")
        self.draw = button(tr("Line"), name, lambda: None, "small", checkable=True)
        self.plot = ZoomedPlot(tokens)
        self.plot.read = self._read
        self.plot.setMinimumHeight(self.plot.minimumHeight() + 2 * GRID)  # two lines of text below it
        self.values, self._unit = [_NOTHING], ""
        self._named = False  # two curves have a legend
        pens = (pg.mkPen(MODEL, width=2, style=style) for style in (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine))
        self._curves = [
            pg.PlotDataItem(pen=pen, connect="finite", symbolSize=4, symbolPen=None, name=name)
            for name, pen in zip(_NAMES, pens, strict=True)
        ]
        self._zero_line = pg.InfiniteLine(pos=0.0, angle=90, pen=pg.mkPen(tokens.quiet, width=1))
        for curve in self._curves:
            self.plot.addItem(curve)
        self.plot.addItem(self._zero_line, ignoreBounds=True)
        vbox(hbox((self.source, 1), self.draw, spacing=GRID // 2), (self.plot, 1), on=self, spacing=GRID // 2)
        self.source.currentIndexChanged.connect(lambda: self.changed.emit())

    def show_field(self, frames: Sequence[Frame | None], field: FieldChoice, line: Line | None) -> None:
        """Plot a field of at most two fingers, the second dashed."""
        source = self.source.currentIndex()
        axis = "SED [kPa]" if source == _RECEPTORS else field.axis
        self.values = [_curve(frame, source, field, line) for frame in frames]
        positions, _ = self.values[0]
        text = tr(_PLACES[source])
        if source == LINE and line is None:
            text = tr("Press Line and drag over the finger, or drag with Shift.")
        for index, curve in enumerate(self._curves):
            points = self.values[index] if index < len(self.values) else _NOTHING
            curve.setData(*points, symbol="o" if source == _RECEPTORS else None, symbolBrush=MODEL)
        if (len(frames) > 1) != self._named:
            self._named = len(frames) > 1
            self.plot.name_curves(self._curves if self._named else (), (0.0, 0.0))
        self._zero_line.setVisible(source != LINE)
        self.plot.name_across(f"{axis}<br>{text}" if len(positions) else text)
        self.plot.show_numbers(visible=len(positions) > 0)
        self.plot.setAccessibleName(f"{axis}: {text}")
        self._unit = "kPa" if source == _RECEPTORS else field.unit.removesuffix("-")

    def _read(self, position: float) -> str:
        names = _NAMES if len(self.values) > 1 else ("",)
        readouts = (
            read_out("mm", positions, position, [(name, self._unit, values)])
            for name, (positions, values) in zip(names, self.values, strict=True)
        )
        return "   ".join(filter(None, readouts))


def _curve(frame: Frame | None, source: int, field: FieldChoice, line: Line | None) -> Curve:
    """Return positions (m,) [mm] and values (m,) of a curve; empty if the finger has none."""
    if frame is None:
        return _NOTHING
    if source == _RECEPTORS:
        return ROW, 1000.0 * frame.row
    if source == SKIN:
        return along_skin(frame, field)
    return _NOTHING if line is None else along_line(frame, field, line)


class FieldBar(QWidget):
    """Lists of fields and of colour ranges, and the two ends of a fixed range."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._automatic: Range = (0.0, 1.0)
        self.field_choice = choice(tr("field that is drawn"), (tr(field.label) for field in FIELD_CHOICES))
        self.ranges = choice(tr("range of the colours"), (tr("All trials"), tr("Own scale"), tr("Fixed")))
        self.low, self.high = _NumberField(tr("colours begin at")), _NumberField(tr("colours end at"))
        hbox((self.field_choice, 3), (self.ranges, 2), self.low, self.high, on=self, spacing=GRID // 2)
        for number in (self.low, self.high):
            number.setVisible(False)
            number.valueChanged.connect(lambda: self.changed.emit())
        self.field_choice.currentIndexChanged.connect(self._free)
        self.ranges.currentIndexChanged.connect(self._fix)

    @property
    def field(self) -> FieldChoice:
        return FIELD_CHOICES[max(self.field_choice.currentIndex(), 0)]

    @property
    def mode(self) -> int:
        """Return `ALL_TRIALS`, `OWN` or `FIXED_RANGE`."""
        return self.ranges.currentIndex()

    def range(self, automatic: Range) -> Range:
        """Return the colour range: `automatic`, or the fixed ends in ascending order."""
        self._automatic = automatic
        limits = sorted((self.low.value(), self.high.value()))
        return (limits[0], limits[1]) if self.mode == FIXED_RANGE and limits[0] < limits[1] else automatic

    def fix(self, limits: Range) -> None:
        self._automatic = limits
        self.ranges.setCurrentIndex(FIXED_RANGE)
        self._fix()

    def _free(self) -> None:
        """Reset a fixed range after a change of field: its numbers are in another unit."""
        if self.mode == FIXED_RANGE:
            self.ranges.setCurrentIndex(ALL_TRIALS)
        else:
            self.changed.emit()

    def _fix(self) -> None:
        """Begin a fixed range with the displayed one."""
        for number, limit in zip((self.low, self.high), self._automatic, strict=True):
            number.setVisible(self.mode == FIXED_RANGE)
            with QSignalBlocker(number):
                number.setSuffix(f" {self.field.unit}".removesuffix(" -"))
                number.setSingleStep((self._automatic[1] - self._automatic[0]) / 20.0)
                number.setValue(limit)
        self.changed.emit()


class _NumberField(QDoubleSpinBox):
    """A number field with a decimal point in every locale; a comma counts as a point."""

    def __init__(self, name: str) -> None:
        super().__init__(minimum=-_LARGEST, maximum=_LARGEST, decimals=3)
        self.setLocale(QLocale.c())
        self.setAccessibleName(name)
        self.lineEdit().setAccessibleName(name)
        self.setMinimumHeight(TARGET)

    def validate(self, text: str, pos: int) -> tuple[QValidator.State, str, int]:
        return super().validate(text.replace(",", "."), pos)
