"""A field as a curve: of the receptors, along the skin, or along a line that somebody draws."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from daq_app.analyst.field_list import FieldChoice
from daq_app.analyst.frame import Finger
from daq_app.analyst.probe import Line, along_line, along_skin, read_out
from daq_app.qt.parts import bare, button, choice
from daq_app.qt.tokens import GRID, MODEL, Tokens
from daq_app.qt.zoomed_plot import ZoomedPlot
from daq_app.wording import tr, tr_noop

pg: Any = pyqtgraph  # it has no types

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


class FieldPlot(QWidget):
    """A list of what is plotted, a button to draw a line, and the plot."""

    changed = Signal()

    def __init__(self, tokens: Tokens) -> None:
        """Show nothing yet."""
        super().__init__()
        self.source = choice(tr("what is plotted under the finger"))
        self.source.addItems([tr(words) for words in SOURCES])
        self.draw = button(tr("Line"), tr("draw a line over the finger with the mouse"), lambda: None, "small")
        self.draw.setCheckable(True)
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
        top = QHBoxLayout()
        top.setSpacing(GRID // 2)
        top.addWidget(self.source, 1)
        top.addWidget(self.draw)
        layout = bare(QVBoxLayout(self), GRID // 2)
        layout.addLayout(top)
        layout.addWidget(self.plot, 1)
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
