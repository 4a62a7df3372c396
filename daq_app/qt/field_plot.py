"""Which field is drawn over the finger and where its colours end, and the field as a curve."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QDoubleSpinBox, QHBoxLayout, QWidget

from daq_app.analyst.frame import FIELD_CHOICES, FieldChoice, Finger, Range
from daq_app.analyst.probe import Line, along_line, along_skin, read_out
from daq_app.qt.parts import bare, button, choice, fill, hbox, vbox
from daq_app.qt.tokens import GRID, MODEL, TARGET, Tokens
from daq_app.qt.zoomed_plot import ZoomedPlot, pg
from daq_app.wording import tr, tr_noop

Curve = tuple[NDArray[np.float64], NDArray[np.float64]]
NOTHING: Curve = (np.empty(0), np.empty(0))
NAMES = ("A", "B")  # of two sessions
RECEPTORS, SKIN, LINE = range(3)
SOURCES = (tr_noop("SED of the receptors"), tr_noop("Field along the skin"), tr_noop("Field along the line"))
PLACES = (
    tr_noop("along the skin, proximal to distal [mm]"),
    tr_noop("along the skin at rest, proximal to distal [mm]"),
    tr_noop("from A to B [mm]"),
)
ALL_TRIALS, OWN, FIXED = range(3)
LARGEST = 1e6  # in a number field: far beyond any stress or strain of tissue


class FieldPlot(QWidget):
    """A list of what is plotted, a button to draw a line, and the plot."""

    changed = Signal()

    def __init__(self, tokens: Tokens) -> None:
        super().__init__()
        self.source = choice(tr("what is plotted under the finger"), map(tr, SOURCES))
        self.draw = button(
            tr("Line"), tr("draw a line over the finger with the mouse"), lambda: None, "small", checkable=True
        )
        self.plot = ZoomedPlot(tokens)
        self.plot.read = self._read
        self.plot.setMinimumHeight(self.plot.minimumHeight() + 2 * GRID)  # two lines of words under it
        self.values, self._unit = [NOTHING], ""
        self._named = False  # two curves are
        self._curves = [
            pg.PlotDataItem(
                pen=pg.mkPen(MODEL, width=2, style=style), connect="finite", symbolSize=4, symbolPen=None, name=name
            )
            for name, style in zip(NAMES, (Qt.PenStyle.SolidLine, Qt.PenStyle.DashLine), strict=True)
        ]
        self._here = pg.InfiniteLine(pos=0.0, angle=90, pen=pg.mkPen(tokens.quiet, width=1))
        for curve in self._curves:
            self.plot.addItem(curve)
        self.plot.addItem(self._here, ignoreBounds=True)
        vbox(hbox((self.source, 1), self.draw, spacing=GRID // 2), (self.plot, 1), on=self, spacing=GRID // 2)
        self.source.currentIndexChanged.connect(lambda: self.changed.emit())

    def show_field(self, fingers: Sequence[Finger | None], field: FieldChoice, line: Line | None) -> None:
        """Plot a field of at most two fingers, the second dashed."""
        source = self.source.currentIndex()
        axis = "SED [kPa]" if source == RECEPTORS else field.axis
        self.values = [_curve(finger, source, field, line) for finger in fingers]
        place, _ = self.values[0]
        words = tr(PLACES[source])
        if source == LINE and line is None:
            words = tr("Press Line and drag over the finger, or drag with Shift.")
        for at, curve in enumerate(self._curves):
            known = self.values[at] if at < len(self.values) else NOTHING
            curve.setData(*known, symbol="o" if source == RECEPTORS else None, symbolBrush=MODEL)
        if (len(fingers) > 1) != self._named:
            self._named = len(fingers) > 1
            self.plot.name_curves(self._curves if self._named else (), (0.0, 0.0))
        self._here.setVisible(source != LINE)
        self.plot.name_across(f"{axis}<br>{words}" if len(place) else words)
        self.plot.setAccessibleName(f"{axis}: {words}")
        self._unit = "kPa" if source == RECEPTORS else field.unit.removesuffix("-")

    def _read(self, at: float) -> str:
        """Return what each curve says at a place [mm]."""
        names = NAMES if len(self.values) > 1 else ("",)
        said = [
            read_out("mm", place, at, [(name, self._unit, values)])
            for name, (place, values) in zip(names, self.values, strict=True)
        ]
        return "   ".join(filter(None, said))


def _curve(finger: Finger | None, source: int, field: FieldChoice, line: Line | None) -> Curve:
    """Return places (m,) [mm] and values (m,) of what is plotted; none where the finger has none."""
    if finger is None:
        return NOTHING
    if source == RECEPTORS:
        return (finger.arcs, 1000.0 * finger.frame.row) if len(finger.arcs) == len(finger.frame.row) else NOTHING
    if source == SKIN:
        return along_skin(finger.frame, finger.parts, field)
    return NOTHING if line is None else along_line(finger.frame, finger.parts, field, line)


class FieldBar(QWidget):
    """Two lists and two numbers."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._automatic: Range = (0.0, 1.0)
        self.which = choice(tr("field that is drawn"), (tr(field.label) for field in FIELD_CHOICES))
        self.ranges = choice(tr("range of the colours"), (tr("All trials"), tr("Own scale"), tr("Fixed")))
        self.low, self.high = _number(tr("colours begin at")), _number(tr("colours end at"))
        layout = bare(QHBoxLayout(self), GRID // 2)
        fill(layout, (self.which, 3), (self.ranges, 2))
        for number in (self.low, self.high):
            number.setVisible(False)
            number.valueChanged.connect(lambda: self.changed.emit())
            layout.addWidget(number)
        self.which.currentIndexChanged.connect(self._free)
        self.ranges.currentIndexChanged.connect(self._fix)

    @property
    def field(self) -> FieldChoice:
        """The field that is drawn."""
        return FIELD_CHOICES[max(self.which.currentIndex(), 0)]

    @property
    def mode(self) -> int:
        """`ALL_TRIALS`, `OWN` or `FIXED`."""
        return self.ranges.currentIndex()

    def range(self, automatic: Range) -> Range:
        """Return where colours begin and end: as given, or as somebody fixed them, the lesser number first."""
        self._automatic = automatic
        ends = sorted((self.low.value(), self.high.value()))
        return (ends[0], ends[1]) if self.mode == FIXED and ends[0] < ends[1] else automatic

    def fix(self, ends: Range) -> None:
        """Fix the colours at these ends."""
        self._automatic = ends
        self.ranges.setCurrentIndex(FIXED)
        self._fix()

    def _free(self) -> None:
        """Fit the colours to another field: numbers that were fixed are of another unit."""
        if self.mode == FIXED:
            self.ranges.setCurrentIndex(ALL_TRIALS)
        else:
            self.changed.emit()

    def _fix(self) -> None:
        """Begin fixed colours with those that were shown."""
        for number, end in zip((self.low, self.high), self._automatic, strict=True):
            number.setVisible(self.mode == FIXED)
            number.blockSignals(True)
            number.setSuffix(f" {self.field.unit}".removesuffix(" -"))
            number.setSingleStep((self._automatic[1] - self._automatic[0]) / 20.0)
            number.setValue(end)
            number.blockSignals(False)
        self.changed.emit()


def _number(name: str) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setAccessibleName(name)
    box.lineEdit().setAccessibleName(name)
    box.setMinimumHeight(TARGET)
    box.setRange(-LARGEST, LARGEST)
    box.setDecimals(3)
    return box
