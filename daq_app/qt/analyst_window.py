"""The analyst's window: trials, the stroke of the chosen one, and the model's answer to it."""

from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QObject, QSignalBlocker, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QColor, QKeyEvent, QKeySequence, QResizeEvent
from PySide6.QtWidgets import QFileDialog, QLabel, QMainWindow, QProgressBar, QSizePolicy, QTabWidget, QWidget

from daq_app.analyst import state as m
from daq_app.analyst.process import Analyst
from daq_app.analyst.session_words import Link, greatest_errors, lineage, marks_of, points, progress_text, row_text
from daq_app.analyst.state import AnalystState, fold, rows, selected_row
from daq_app.qt.keys import ANALYST_KEYS, KeysPage
from daq_app.qt.layout import hbox, scroll_area, set_horizontal, vbox
from daq_app.qt.model_column import FINGER, SESSION, ModelColumn
from daq_app.qt.parts import Panel, RowList, WrappedLabel, button, choice, label, whole_facts
from daq_app.qt.plots import ZoomedPlot, pg
from daq_app.qt.stroke_column import StrokeColumn
from daq_app.qt.tokens import GRID, MODEL, Tokens, px, theme_of
from daq_app.wording import tr
from sessions.exchange import FORMATS
from sessions.prediction import QUANTITIES
from sessions.report.wording import shown_response

_LOOK = 30  # between two polls of the work [ms]
_ONE_ROW = 760  # width from which the progress is in a row with the buttons, before the font's scale [px]
_LEAST = (480, 320)  # least size of the window [px]


class LineageLabel(QLabel):
    """Links in their order."""

    followed = Signal(str)  # target of the link

    def __init__(self) -> None:
        flags = Qt.TextInteractionFlag.LinksAccessibleByMouse | Qt.TextInteractionFlag.LinksAccessibleByKeyboard
        super().__init__(textFormat=Qt.TextFormat.RichText, wordWrap=True, textInteractionFlags=flags)
        self._links: tuple[Link, ...] = ()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.linkActivated.connect(self.followed.emit)
        self.linkHovered.connect(self._show_tool_tip)
        self.setAccessibleName(tr("from the number back to its readings"))

    def show_links(self, links: tuple[Link, ...]) -> None:
        if links == self._links:
            return
        self._links = links
        self._show()
        text = " → ".join(f"{link.text} ({link.detail})" if link.detail else link.text for link in links)
        self.setAccessibleName(tr("from the number back to its readings: {whole}", whole=text))

    def changeEvent(self, event: QEvent) -> None:
        """Redraw the links in the colour of a new theme."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.StyleChange:
            self._show()

    def _show(self) -> None:
        style = f"color: {theme_of(self).act}"
        texts = ((link.target, escape(link.text).replace(" ", "&nbsp;")) for link in self._links)
        elements = (f'<a href="{target}" style="{style}">{text}</a>' for target, text in texts)
        self.setText("&nbsp;&nbsp;→&nbsp; ".join(elements))

    def _show_tool_tip(self, target: str) -> None:
        self.setToolTip(next((link.detail for link in self._links if link.target == target), ""))


class AnalystWindow(QMainWindow):
    """A session folder, from its trials to the model. It shows the latest `AnalystState`."""

    def __init__(self, folder: Path, tokens: Tokens, work: Analyst | None = None) -> None:
        """Open `folder`; `work` runs in another process, started here if none is given."""
        super().__init__()
        self.setWindowTitle(f"{folder.name} – daq-app")
        self.setAccessibleName(tr("analyst's window"))
        self.state = AnalystState(folder)
        self.tokens = tokens
        self._work = work or Analyst(folder)
        self.keys = KeysPage(self, ANALYST_KEYS)
        self._simulation_label = label(tr("SIMULATED"), "simulated")
        self.lineage = LineageLabel()
        self.lineage.followed.connect(self._follow)
        self._progress_label = WrappedLabel("quiet", keeps_room=True)
        self.trials = TrialsColumn(tokens, self.ask, self.take)
        self.stroke = StrokeColumn(tokens, self.ask, self._replay_next)
        self.model = ModelColumn(tokens, self.ask, self._progress_label.show_text)
        self.progress = QProgressBar(format="%p %")
        self.progress.setAccessibleName(tr("progress"))
        self.stop = button(tr("Stop  Esc"), tr("stop the work"), lambda: self.ask(m.Stop()))
        name = tr("have the model answer the trials that are left")
        self.go_on = button(tr("Go on"), name, lambda: self.ask(m.GoOn()))
        self.report = button(tr("Report…"), tr("write the report"), self.write_report)
        self.format = choice(tr("format of the export"), sorted(FORMATS))
        self.export = button(tr("Export…"), tr("write an export"), self.write_export)
        self._columns = {tr("Trials"): self.trials, tr("Stroke"): self.stroke, tr("Model"): self.model}
        self._areas = [scroll_area(column) for column in self._columns.values()]  # scrolled if too high
        self._panels = [Panel(name.lower()) for name in self._columns]
        for panel, area in zip(self._panels, self._areas, strict=True):
            vbox(area, on=panel, margins=GRID)
        for column in self._columns.values():
            column.installEventFilter(self)
        self._pages = QTabWidget()
        self._pages.setAccessibleName(tr("trials, stroke or model"))
        self._panes = QWidget()
        self._row = hbox(on=self._panes, spacing=GRID)
        self._narrow: bool | None = None
        self.setCentralWidget(self._lay_out())
        self._place_columns()
        self._timer = QTimer(self)
        self._timer.timeout.connect(lambda: self.take(*self._work.poll()))
        self._timer.start(_LOOK)
        self._show()

    def sizeHint(self) -> QSize:
        return QSize(1440, 860)

    def take(self, *messages: m.Message) -> None:
        for message in messages:
            self.state = fold(self.state, message)
        if messages:
            self._show()

    def ask(self, request: m.Ask) -> None:
        if isinstance(request, m.Choose) and request.row == self.state.row:
            return
        self._work.ask(request)
        self.take(request)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if not self.press(event):
            super().keyPressEvent(event)

    def press(self, event: QKeyEvent) -> bool:
        """Handle a key of this window, independent of the focus; return whether it has a meaning."""
        control = event.modifiers() & Qt.KeyboardModifier.ControlModifier
        match event.key():
            case _ if event.matches(QKeySequence.StandardKey.Undo):
                self.stroke.decisions.undo.click()
            case _ if event.matches(QKeySequence.StandardKey.Redo):
                self.stroke.decisions.redo.click()
            case Qt.Key.Key_F1:
                self.keys.toggle()
            case Qt.Key.Key_Escape if self.keys.isVisible():
                self.keys.hide()
            case Qt.Key.Key_Escape if self.stop.isEnabled():
                self.ask(m.Stop())
            case Qt.Key.Key_Home:
                self.stroke.stroke.show_all()
            case Qt.Key.Key_1 | Qt.Key.Key_2 | Qt.Key.Key_3 if control:
                self._go_to(event.key() - Qt.Key.Key_1)
            case _:
                return False
        return True

    def resizeEvent(self, event: QResizeEvent) -> None:
        set_horizontal(self._foot, self.width() >= px(_ONE_ROW))
        self._place_columns()
        self.keys.fit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Place the columns anew after one of them has asked for another size."""
        if event.type() == QEvent.Type.LayoutRequest:
            QTimer.singleShot(0, self, self._place_columns)
        return super().eventFilter(watched, event)

    def closeEvent(self, event: QCloseEvent) -> None:
        self._timer.stop()
        self._work.close()
        super().closeEvent(event)

    def hand_over(self, tokens: Tokens) -> "AnalystWindow":
        """Return a window in another theme with the same content, which takes over the work."""
        self._timer.stop()
        window = AnalystWindow(self.state.folder, tokens, self._work)
        window.state = self.state
        window._show()
        return window

    def _go_to(self, column: int) -> None:
        self._pages.setCurrentIndex(column)
        (self.trials.list, self.stroke.stroke.handles["onset"], self.model.tabs)[column].setFocus()

    def write_report(self) -> None:
        name, _ = QFileDialog.getSaveFileName(self, tr("Report"), str(self.state.folder / "report.html"), "*.html")
        if name:
            self.ask(m.Write("report", name))

    def write_export(self) -> None:
        export_format = self.format.currentText()
        name, _ = QFileDialog.getSaveFileName(self, tr("New folder"), f"{self.state.folder.name}-{export_format}")
        if name:
            self.ask(m.Write(export_format, name))

    def _follow(self, target: str) -> None:
        self._pages.setCurrentIndex({"session": 2, "prediction": 2, "trial": 0}.get(target, 1))
        match target:
            case "session" | "prediction":
                self.model.tabs.setCurrentIndex(SESSION if target == "session" else FINGER)
                self.model.tabs.setFocus()
            case "trial":
                self.trials.list.setFocus()
            case "friction":
                self.stroke.go_to_numbers()
            case "window":
                self.stroke.stroke.handles["steady begin"].setFocus()
            case _:
                self.stroke.go_to_readings()

    def _replay_next(self) -> None:
        """Replay the next trial after the end of one."""
        if self.state.row + 1 < len(rows(self.state)):
            self.stroke.play()
            self.ask(m.Choose(self.state.row + 1))

    def _show(self) -> None:
        state = self.state
        busy = state.step is not None
        self.progress.setVisible(busy)
        self.progress.setValue(0 if state.step is None else round(100 * state.step.fraction))
        self._progress_label.show_text(progress_text(state.step) or state.outcome)
        self.stop.setEnabled(busy)
        self.go_on.setVisible(state.halted and not busy)
        for widget in (self.report, self.export):
            widget.setEnabled(not busy and state.report is not None)
        note = "" if state.report is None else state.report.head
        self._simulation_label.setVisible(bool(note))
        self._simulation_label.setToolTip(note)
        self.lineage.show_links(lineage(state))
        for column in (self.trials, self.stroke, self.model):
            column.show_state(state)

    def _place_columns(self) -> None:
        least = [column.minimumSizeHint().width() + 2 * GRID for column in self._columns.values()]
        narrow = self.width() < sum(width + 4 * GRID for width in least)
        for area, width in zip(self._areas, least, strict=True):
            area.setMinimumWidth(0 if narrow else width)
        if narrow == self._narrow:
            return
        self._narrow = narrow
        self._pages.setVisible(narrow)
        self._panes.setVisible(not narrow)
        for name, panel, stretch in zip(self._columns, self._panels, (3, 6, 6), strict=True):
            if narrow:
                self._pages.addTab(panel, name)
            else:
                self._row.addWidget(panel, stretch)
                panel.show()
        if narrow and self.state.comparison is not None:  # keep the comparison in sight
            self._pages.setCurrentIndex(2)

    def _lay_out(self) -> QWidget:
        self.progress.setFixedWidth(px(140))
        self.format.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.format.setFixedWidth(px(90))
        window = QWidget()
        window.setObjectName("window")
        window.setMinimumSize(*_LEAST)  # the columns fit into less than their preferred size
        acts = self.stop, self.go_on, self.report, self.format, self.export
        header, status = hbox((self.lineage, 1), self._simulation_label), hbox((self._progress_label, 1), self.progress)
        self._foot = hbox((status, 1), hbox(1, *acts))
        header.setAlignment(self._simulation_label, Qt.AlignmentFlag.AlignTop)
        vbox(header, (self._panes, 1), (self._pages, 1), self._foot, on=window, margins=GRID)
        return window


class TrialsColumn(QWidget):
    """The trials, and the plot of prediction against score."""

    def __init__(self, tokens: Tokens, ask: Callable[[m.Ask], None], respond: Callable[[m.Respond], None]) -> None:
        """Show no trials; `ask` takes the chosen row, `respond` the quantity to compare with the score."""
        super().__init__()
        self._tokens, self._ask = tokens, ask
        self.list = RowList(tr("trials"))
        self.list.currentRowChanged.connect(self._choose)
        self.responses = choice(tr("quantity compared with the score"))
        for response in (shown_response(quantity.name) for quantity in QUANTITIES):
            self.responses.addItem(f"{tr(response.label)} [{response.unit}]", response.name)
        self.responses.activated.connect(lambda: respond(m.Respond(self.responses.currentData())))
        self.errors = WrappedLabel("quiet")
        self.relation = ZoomedPlot(tokens)
        self.relation.setAccessibleName(tr("prediction against score: a point chooses its trial"))
        self.relation.setLabel("bottom", tr("mean score"))
        self.points: Any = pg.ScatterPlotItem()
        self.points.sigClicked.connect(self._point_clicked)
        self.relation.addItem(self.points)
        self.none = label("", wrap=True)
        self.none.setAlignment(Qt.AlignmentFlag.AlignTop)
        self._below = label(tr("At the plan's depth, against the score"), "section")
        plot = (self.relation, 2), (self.none, 2)
        vbox(label(tr("Trials"), "section"), (self.list, 3), self._below, self.responses, self.errors, *plot, on=self)

    def show_state(self, state: AnalystState) -> None:
        trials = rows(state)
        with QSignalBlocker(self.list):
            if len(trials) != self.list.count():
                self.list.clear()
                self.list.addItems([""] * len(trials))
            for index, row in enumerate(trials):
                item, text, marks = self.list.item(index), row_text(row), marks_of(row)
                item.setText(whole_facts(text))
                item.setToolTip(marks)
                item.setData(Qt.ItemDataRole.AccessibleTextRole, f"{text} {marks}".rstrip())
            self.list.setCurrentRow(state.row if selected_row(state) is not None else -1)
        self.errors.show_text(greatest_errors(state.report, state.response))
        marks = {True: {"size": 18, "symbol": "s"}, False: {"size": 11, "symbol": "o"}}
        alike = {"brush": MODEL, "pen": pg.mkPen(QColor(self._tokens.text))}
        spots = [
            {"pos": (point.score, point.response), "data": point.row} | marks[point.row == state.row] | alike
            for point in points(state)
        ]
        self.points.setData(spots)
        self.relation.setVisible(bool(spots))
        self.none.setVisible(not spots)
        empty = state.report is not None and not trials
        for widget in (self.list, self._below, self.responses):
            widget.setHidden(empty)
        text = tr("No trial has both a score and an answer of the model.")
        if state.stage != "predicted" and state.step is not None:
            text = tr("The model has not answered yet.")
        no_stroke = tr("This session has no stroke. Its answers are kept: Export… writes them.")
        self.none.setText(no_stroke if empty else text)

    def _choose(self, row: int) -> None:
        if row >= 0:
            self._ask(m.Choose(row))

    def _point_clicked(self, _item: object, spots: Any, *_: object) -> None:  # noqa: ANN401  pyqtgraph has no types
        if len(spots) and spots[0].data() is not None:
            self._ask(m.Choose(int(spots[0].data())))
