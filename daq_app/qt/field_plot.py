"""A field as a curve: of the receptors, along the skin, or along a line that somebody draws."""

from typing import Any

import numpy as np
import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from numpy.typing import NDArray
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from daq_app.analyst.field_list import FieldChoice
from daq_app.analyst.frame import Frame, Parts
from daq_app.analyst.probe import Line, along_line, along_skin, read_out
from daq_app.qt.parts import button, choice
from daq_app.qt.tokens import GRID, MODEL, Tokens
from daq_app.qt.zoomed_plot import ZoomedPlot
from daq_app.wording import tr, tr_noop

pg: Any = pyqtgraph  # it has no types

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
        self.values, self._unit = (np.empty(0), np.empty(0)), ""
        self._curve = pg.PlotDataItem(pen=pg.mkPen(MODEL, width=2), connect="finite", symbolSize=4, symbolPen=None)
        self._here = pg.InfiniteLine(pos=0.0, angle=90, pen=pg.mkPen(tokens.quiet, width=1))
        self.plot.addItem(self._curve)
        self.plot.addItem(self._here, ignoreBounds=True)
        top = QHBoxLayout()
        top.setSpacing(GRID // 2)
        top.addWidget(self.source, 1)
        top.addWidget(self.draw)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID // 2)
        layout.addLayout(top)
        layout.addWidget(self.plot, 1)
        self.source.currentIndexChanged.connect(lambda: self.changed.emit())

    def show_field(
        self, frame: Frame | None, parts: Parts, arcs: NDArray[np.float64], field: FieldChoice, line: Line | None
    ) -> None:
        """Plot a field of a frame; `arcs` (r,) [mm] are the places of its receptors."""
        source = self.source.currentIndex()
        place, values, axis = np.empty(0), np.empty(0), field.axis
        if source == RECEPTORS:
            axis = "SED [kPa]"
            if frame is not None and len(arcs) == len(frame.row):
                place, values = arcs, 1000.0 * frame.row
        elif frame is not None and source == SKIN:
            place, values = along_skin(frame, parts, field)
        elif frame is not None and line is not None:
            place, values = along_line(frame, parts, field, line)
        words = tr(PLACES[source])
        if source == LINE and line is None:
            words = tr("Press Line and drag over the finger, or drag with Shift.")
        self._curve.setData(place, values, symbol="o" if source == RECEPTORS else None, symbolBrush=MODEL)
        self._here.setVisible(source != LINE)
        self.plot.getPlotItem().setLabel("bottom", f"{axis} {words}" if len(place) else words)
        self.plot.setAccessibleName(f"{axis}: {words}")
        self.values, self._unit = (place, values), "kPa" if source == RECEPTORS else field.unit.removesuffix("-")

    def _read(self, at: float) -> str:
        """Return what the curve says at a place [mm]."""
        place, values = self.values
        return read_out("mm", place, at, [("", self._unit, values)])
