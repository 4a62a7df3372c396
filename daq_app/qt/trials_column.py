"""The trials of a session, and prediction against score: choosing in one chooses everywhere."""

from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QListWidget, QWidget

from daq_app.analyst import messages as m
from daq_app.analyst.shown import greatest_errors, marks_of, points, row_words
from daq_app.analyst.state import AnalystState, chosen, rows
from daq_app.qt.parts import Wrapped, choice, label, vbox
from daq_app.qt.tokens import MODEL, Tokens
from daq_app.qt.zoomed_plot import ZoomedPlot, pg
from daq_app.wording import tr
from sessions.prediction import QUANTITIES
from sessions.report.wording import shown_response


class TrialsColumn(QWidget):
    """`requested` carries the chosen row, `responded` the quantity that is compared with the score."""

    requested = Signal(object)
    responded = Signal(object)

    def __init__(self, tokens: Tokens) -> None:
        super().__init__()
        self._tokens = tokens
        self._listed: tuple[str, ...] = ()
        self.list = QListWidget()
        self.list.setAccessibleName(tr("trials"))
        self.list.currentRowChanged.connect(self._chosen)
        self.responses = choice(tr("quantity that is held against the score"))
        for shown in (shown_response(quantity.name) for quantity in QUANTITIES):
            self.responses.addItem(f"{tr(shown.label)} [{shown.unit}]", shown.name)
        self.responses.activated.connect(lambda: self.responded.emit(m.Respond(self.responses.currentData())))
        self.errors = Wrapped("quiet")
        self.relation, self.points = self._relation()
        vbox(
            label(tr("Trials"), "section"),
            (self.list, 3),
            label(tr("At the plan's depth, against the score"), "section"),
            self.responses,
            self.errors,
            (self.relation, 2),
            on=self,
        )

    def show_state(self, state: AnalystState) -> None:
        """Show what is known now."""
        listed = row_words(state)
        self.list.blockSignals(True)
        if len(listed) != self.list.count():
            self.list.clear()
            self.list.addItems(listed)
        elif listed != self._listed:
            for at, words in enumerate(listed):
                self.list.item(at).setText(words)
        self._listed = listed
        for at, row in enumerate(rows(state)):
            item = self.list.item(at)
            marks = marks_of(row)
            item.setToolTip(marks)
            item.setData(Qt.ItemDataRole.AccessibleTextRole, f"{listed[at]} {marks}".rstrip())
        self.list.setCurrentRow(state.row if chosen(state) is not None else -1)
        self.list.blockSignals(False)
        self.errors.show_text(greatest_errors(state.report, state.response))
        ring = pg.mkPen(QColor(self._tokens.text))
        self.points.setData(
            [
                {
                    "pos": (p.score, p.response),
                    "data": p.row,
                    "size": 18 if p.row == state.row else 11,
                    "symbol": "s" if p.row == state.row else "o",
                    "brush": MODEL,
                    "pen": ring,
                }
                for p in points(state)
            ]
        )

    def _chosen(self, row: int) -> None:
        if row >= 0:
            self.requested.emit(m.Choose(row))

    def _relation(self) -> tuple[Any, Any]:
        plot = ZoomedPlot(self._tokens)
        plot.setAccessibleName(tr("prediction against score: a point chooses its trial"))
        plot.setLabel("bottom", tr("mean score"))
        scatter = pg.ScatterPlotItem()
        scatter.sigClicked.connect(self._point_clicked)
        plot.addItem(scatter)
        return plot, scatter

    def _point_clicked(self, _item: object, clicked: Any, *_: object) -> None:  # noqa: ANN401  pyqtgraph has no types
        if len(clicked) and clicked[0].data() is not None:
            self.requested.emit(m.Choose(int(clicked[0].data())))
