"""The analyst's window: trials, the stroke of the chosen one, and what the model says of it."""

from pathlib import Path
from typing import Any, Protocol

import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QColor, QKeyEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QListWidget,
    QMainWindow,
    QProgressBar,
    QScrollArea,
    QSizePolicy,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from daq_app import analyst as a
from daq_app.analyst_process import Analyst
from daq_app.qt.parts import button, choice, label, panel, say
from daq_app.qt.picture_view import PictureView
from daq_app.qt.stroke_view import StrokeView
from daq_app.qt.tokens import GRID, MODEL, Tokens
from sessions.exports import FORMATS
from sessions.exports.figures.style import Panel

pg: Any = pyqtgraph  # it has no types
LOOK = 50  # between two looks at the work [ms]


class Work(Protocol):
    """What is done for the window, as `daq_app.analyst_process.Analyst` does it."""

    def poll(self) -> tuple[a.Message, ...]:
        """Return what came since the last call."""
        ...

    def write(self, asked: a.Write) -> None:
        """Begin to write a file."""
        ...

    def cancel(self) -> a.Cancelled:
        """Stop what is being done, at once."""
        ...


class AnalystWindow(QMainWindow):
    """A session folder, followed from its trials to the model. It knows nothing but the last `AnalystState`."""

    def __init__(self, folder: Path, tokens: Tokens, work: Work | None = None) -> None:
        """Open `folder`; `work` is done by another process, begun here where none is given."""
        super().__init__()
        self.setWindowTitle(f"{folder.name} – daq-app")
        self.setAccessibleName("analyst's window")
        self.state = a.AnalystState(folder)
        self._shown: a.AnalystState | None = None
        self._work: Work = work or Analyst(folder)
        self._tokens = tokens
        self._head = label("", "simulated")
        self._way = label("", "quiet", wrap=True)
        self._way.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.trials = QListWidget()
        self.trials.setAccessibleName("trials")
        self.trials.currentRowChanged.connect(self._row_chosen)
        self.stroke = StrokeView(tokens)
        self._numbers = QGridLayout()
        self.fingers = (PictureView(), PictureView())
        self.picture, self.which = PictureView(), choice("picture of the session")
        self.which.activated.connect(self._show_picture)
        self.relation, self._points = self._relation()
        self.progress = QProgressBar()
        self.progress.setAccessibleName("progress")
        self._words = label("", "quiet", wrap=True)
        self.stop = button("Stop  Esc", "stop what is being done", self._cancel)
        self.report = button("Report…", "write the report", self._report)
        self.format, self.export = choice("format of the export"), button("Export…", "write an export", self._export)
        self.format.addItems(sorted(FORMATS))
        self.setCentralWidget(self._placed())
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._look)
        self._timer.start(LOOK)
        self._show()

    def sizeHint(self) -> QSize:  # noqa: N802  Qt's name
        """Return the size the window opens with."""
        return QSize(1440, 860)

    def take(self, message: a.Message) -> None:
        """Fold a message, and show what is known then."""
        self.state = a.fold(self.state, message)
        self._show()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Stop the work with Esc."""
        if event.key() == Qt.Key.Key_Escape and self.stop.isEnabled():
            self._cancel()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802  Qt's name
        """End the work with the window."""
        self._timer.stop()
        self._work.cancel()
        super().closeEvent(event)

    def _look(self) -> None:
        for message in self._work.poll():
            self.take(message)

    def _cancel(self) -> None:
        self.take(self._work.cancel())

    def _row_chosen(self, row: int) -> None:
        if row >= 0 and row != self.state.row:
            self.take(a.Choose(row))

    def _report(self) -> None:
        name, _ = QFileDialog.getSaveFileName(self, "Report", str(self.state.folder / "report.html"), "*.html")
        if name:
            self.write("report", name)

    def _export(self) -> None:
        what = self.format.currentText()
        name, _ = QFileDialog.getSaveFileName(self, "New folder", f"{self.state.folder.name}-{what}")
        if name:
            self.write(what, name)

    def write(self, what: str, path: str) -> None:
        """Have a report or an export written."""
        asked = a.Write(what, path)
        self._work.write(asked)
        self.take(asked)

    def _show(self) -> None:
        state, before = self.state, self._shown
        self._shown = state
        busy = state.step is not None
        self.progress.setVisible(busy)
        self.progress.setValue(0 if state.step is None else round(100 * state.step.part))
        say(self._words, a.progress_words(state.step) or state.told)
        self.stop.setEnabled(busy)
        for made in (self.report, self.export):
            made.setEnabled(not busy and state.report is not None)
        if before is None or before.report is not state.report:
            self._show_session()
        if before is None or before.report is not state.report or before.row != state.row:
            self._show_chosen()

    def _show_session(self) -> None:
        state = self.state
        head = "" if state.report is None else state.report.head
        self._head.setVisible(bool(head))
        self._head.setText("SIMULATED")
        self._head.setToolTip(head)
        self.trials.blockSignals(True)
        self.trials.clear()
        self.trials.addItems([row.words for row in a.rows(state)])
        self.trials.blockSignals(False)
        kept = self.which.currentText()
        self.which.clear()
        self.which.addItems([picture.title for picture in a.pictures(state)])
        self.which.setCurrentIndex(max(self.which.findText(kept), 0))
        self._show_picture()

    def _show_chosen(self) -> None:
        state = self.state
        row = a.chosen(state)
        self.trials.setCurrentRow(state.row if row is not None else -1)
        self.stroke.show_stroke(None if row is None else row.stroke)
        while (item := self._numbers.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.hide()
                old.deleteLater()
        for at, (name, value) in enumerate(a.numbers(state)[:-1]):
            self._numbers.addWidget(label(name, "quiet"), at, 0)
            self._numbers.addWidget(label(value, wrap=True), at, 1)
        say(self._way, a.lineage(state))
        ring = pg.mkPen(QColor(self._tokens.text))
        self._points.setData(
            [
                {
                    "pos": (p.score, p.sed_kpa),
                    "data": p.row,
                    "size": 18 if p.row == state.row else 11,
                    "symbol": "s" if p.row == state.row else "o",
                    "brush": MODEL,
                    "pen": ring,
                }
                for p in a.points(state)
            ]
        )
        head = "" if state.report is None else state.report.head
        pictures = a.finger_pictures(state)
        for view, picture in zip(self.fingers, (*pictures, None, None), strict=False):
            view.show_panel(picture, self._pixels(picture), head)

    def _show_picture(self) -> None:
        pictures, at = a.pictures(self.state), self.which.currentIndex()
        head = "" if self.state.report is None else self.state.report.head
        picture = pictures[at] if 0 <= at < len(pictures) else None
        self.picture.show_panel(picture, self._pixels(picture), head)

    def _pixels(self, picture: Panel | None) -> bytes:
        return b"" if picture is None else self.state.pixels.get(picture.name, b"")

    def _relation(self) -> tuple[Any, Any]:
        plot = pg.PlotWidget(background=self._tokens.surface)
        plot.setMinimumSize(120, 100)
        plot.setAccessibleName("prediction against score: a point chooses its trial")
        plot.getPlotItem().setMenuEnabled(False)
        plot.setLabel("bottom", "mean score")
        plot.setLabel("left", "SED [kPa]")
        plot.getAxis("left").enableAutoSIPrefix(False)
        points = pg.ScatterPlotItem()
        points.sigClicked.connect(self._point_clicked)
        plot.addItem(points)
        return plot, points

    def _point_clicked(self, _item: object, points: Any, *_: object) -> None:  # noqa: ANN401  pyqtgraph has no types
        if len(points) and points[0].data() is not None:
            self.take(a.Choose(int(points[0].data())))

    def _placed(self) -> QWidget:
        left, left_layout = panel("trials")
        left_layout.addWidget(label("Trials", "section"))
        left_layout.addWidget(self.trials, 3)
        left_layout.addWidget(label("Prediction against score", "section"))
        left_layout.addWidget(self.relation, 2)
        middle, middle_layout = panel("stroke")
        middle_layout.addWidget(self.stroke, 3)
        told = QWidget()
        told.setLayout(self._numbers)
        self._numbers.setColumnStretch(1, 1)
        self._numbers.setContentsMargins(0, 0, 0, 0)
        scrolled = QScrollArea()  # where there is little room the numbers are scrolled, never cut
        scrolled.setWidget(told)
        scrolled.setWidgetResizable(True)
        scrolled.setAccessibleName("numbers of the stroke and its prediction")
        middle_layout.addWidget(scrolled, 2)
        tabs = QTabWidget()
        tabs.setAccessibleName("pictures")
        for name, view in (("Finger", self.fingers[0]), ("Contact", self.fingers[1]), ("Session", self._session())):
            tabs.addTab(view, name)
        right, right_layout = panel("prediction")
        right_layout.addWidget(tabs, 1)
        columns = QHBoxLayout()
        columns.setSpacing(GRID)
        for part, stretch in ((left, 3), (middle, 5), (right, 5)):
            columns.addWidget(part, stretch)
        foot = QHBoxLayout()
        foot.addWidget(self._words, 1)
        self.progress.setFixedWidth(200)
        self.format.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.format.setFixedWidth(110)
        for part in (self.progress, self.stop, self.report, self.format, self.export):
            foot.addWidget(part)
        top = QHBoxLayout()
        top.addWidget(self._way, 1)
        top.addWidget(self._head)
        window = QWidget()
        window.setObjectName("window")
        layout = QVBoxLayout(window)
        layout.setContentsMargins(GRID, GRID, GRID, GRID)
        layout.addLayout(top)
        layout.addLayout(columns, 1)
        layout.addLayout(foot)
        return window

    def _session(self) -> QWidget:
        page = QWidget()
        layout = QVBoxLayout(page)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.which)
        layout.addWidget(self.picture, 1)
        return page
