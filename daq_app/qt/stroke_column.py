"""The chosen stroke: its curves and edges, its replay, its decisions, its numbers and its readings."""

from collections.abc import Callable

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QFontMetrics
from PySide6.QtWidgets import QFormLayout, QTabWidget, QWidget

from daq_app.analyst import state as m
from daq_app.analyst.session_words import FRICTION_HEAD, friction_table, numbers
from daq_app.analyst.state import AnalystState, selected_row
from daq_app.analyst.stroke import Edge, History
from daq_app.qt.layout import hbox, scroll_area, vbox
from daq_app.qt.parts import WrappedLabel, button, entry, label
from daq_app.qt.pictures import SaveButtons
from daq_app.qt.preferences import settings
from daq_app.qt.stroke_view import StrokeView
from daq_app.qt.tables import ReadingsTable, TextTable
from daq_app.qt.tokens import GRID, TEXT, Tokens, font, px
from daq_app.qt.transport_bar import TransportBar
from daq_app.wording import tr, tr_noop
from sessions.report.contents import StrokeFinding

_NUMBERS, _READINGS = range(2)  # tabs
AUTHOR = "analyst/by"  # key under which the code is remembered
NOBODY = "analyst"  # author of decisions without a code
DRAGGED = "dragged by hand"


class StrokeColumn(QWidget):
    """All data of one stroke."""

    def __init__(self, tokens: Tokens, ask: Callable[[m.Ask], None], on_end: Callable[[], None]) -> None:
        """Show no stroke; `ask` sends requests, `on_end` is called at the end of a replay."""
        super().__init__()
        self._ask = ask
        self._stroke: StrokeFinding | None = None
        self._play_next = False
        self._moving = False  # an edge was moved, and the result is pending
        self._excerpt: m.Excerpt | None = None
        self._request: tuple[int, int] | None = None  # requested readings: stroke, and version of the report
        self.stroke = StrokeView(tokens)
        self.stroke.moved.connect(self._drag)
        self.player = TransportBar(tr("the recorded readings"))
        self.player.moved.connect(self._move)
        self.player.ended.connect(on_end)
        self.decisions = DecisionsBar(ask)
        self.save = SaveButtons(tr("the stroke"), lambda name, path: ask(m.Write(f"picture {name}", path)))
        self._lines: tuple[tuple[str, str], ...] = ()
        self.readings = ReadingsTable()
        self.tabs = QTabWidget()
        self.tabs.setAccessibleName(tr("numbers and readings"))
        inside = QWidget()
        growth = QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow
        self._numbers = QFormLayout(inside, labelAlignment=Qt.AlignmentFlag.AlignLeft, fieldGrowthPolicy=growth)
        self._numbers.setContentsMargins(GRID, GRID // 2, GRID, GRID // 2)
        self._scroll = scroll_area(inside)  # if space is short the numbers are scrolled, never cut
        self._scroll.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._scroll.setAccessibleName(tr("numbers of the stroke and its prediction"))
        self.tabs.addTab(self._scroll, tr("Numbers"))
        self.tabs.addTab(self.readings, tr("Readings"))
        self.friction = TextTable(tr("friction of every stroke"), [tr(text) for text in FRICTION_HEAD])
        self.friction.row_chosen.connect(self._choose)
        self.tabs.addTab(self.friction, tr("All strokes"))
        self.tabs.setMinimumHeight(170)
        row = hbox((self.player, 1), self.save)
        vbox((self.stroke, 4), row, self.decisions, (self.tabs, 3), on=self, spacing=GRID // 2)

    def show_state(self, state: AnalystState) -> None:
        row = selected_row(state)
        stroke = None if row is None else row.stroke
        if stroke is not self._stroke:
            self._stroke = stroke
            self.stroke.show_stroke(stroke)
            self.save.set_name("" if stroke is None else f"stroke {stroke.number}")
            self._excerpt = None
        elif self._moving and state.step is None:  # it was not recorded: the message below says why
            self.stroke.show_edges()
        self._moving = self._moving and state.step is not None
        sentences = () if stroke is None else stroke.decided.values()
        self.decisions.sentences_label.show_text("\n".join(f"✎ {sentence}" for sentence in sentences))
        self.decisions.show_history(state.history)
        self._show_readings(state)
        self.friction.show_lines(friction_table(state.report), state.row)
        if (lines := numbers(state)) != self._lines:
            self._lines = lines
            while self._numbers.rowCount():
                self._numbers.removeRow(0)
            for name, value in lines:
                self._numbers.addRow(label(name, "quiet"), number := WrappedLabel("value"))
                number.show_text(value)

    def go_to_readings(self) -> None:
        """Go to the first reading of the steady window."""
        self.tabs.setCurrentIndex(_READINGS)
        self.readings.table.setFocus()
        if self._excerpt is not None and self._stroke is not None and self._stroke.steady is not None:
            self.readings.go_to(int(self._excerpt.readings.block.time.searchsorted(self._stroke.steady[0])))

    def _choose(self, row: int) -> None:
        self._ask(m.Choose(row))

    def go_to_numbers(self) -> None:
        self.tabs.setCurrentIndex(_NUMBERS)
        self._scroll.setFocus()

    def play(self) -> None:
        """Play the readings from their beginning once they have arrived."""
        self._play_next = True

    def _show_readings(self, state: AnalystState) -> None:
        stroke, excerpt = self._stroke, state.excerpt
        request = None if stroke is None else (stroke.number, state.version)
        if request != self._request:
            self._request = request  # set first, because asking re-enters this function
            if stroke is not None:
                self._ask(m.ShowReadings(stroke.number))
        if excerpt is not None and (stroke is None or excerpt.stroke != stroke.number):
            excerpt = None
        if excerpt is self._excerpt and not (excerpt is None and self.player.slider.maximum()):
            return
        self._excerpt = excerpt
        readings = None if excerpt is None else excerpt.readings
        self.stroke.show_readings(readings)
        self.readings.show_readings(readings, None if stroke is None else stroke.steady)
        times: list[float] = [] if readings is None else readings.block.time.tolist()
        with QSignalBlocker(self.player):
            self.player.set_times(times)
        if times and self._play_next:
            self._play_next = False
            self.player.toggle()

    def _drag(self, edge: Edge, time: float) -> None:
        if self._stroke is not None:
            self._moving = True
            author, reason = self.decisions.author(), self.decisions.reason()
            self._ask(m.Move(self._stroke.number, edge, time, author, reason))

    def _move(self, index: int) -> None:
        self.stroke.show_moment(index)
        if not self.player.playing:
            self.readings.go_to(index)


class DecisionsBar(QWidget):
    """A code, a reason, undo and redo; below them the decisions about the chosen stroke."""

    def __init__(self, ask: Callable[[m.Ask], None]) -> None:
        super().__init__()
        self.author_field = entry(tr("code of who decides; never a name"), NOBODY)
        self.author_field.setText(str(settings().value(AUTHOR, "")))
        self.author_field.setMaximumWidth(px(110))
        self.author_field.editingFinished.connect(lambda: settings().setValue(AUTHOR, self.author_field.text()))
        self.reason_field = entry(tr("why an edge is moved"), DRAGGED)
        self.reason_field.setMinimumWidth(QFontMetrics(font(TEXT)).horizontalAdvance(DRAGGED) + 3 * GRID)
        self.undo = button(tr("Undo"), "", lambda: ask(m.Undo(self.author())), "small")
        self.redo = button(tr("Redo"), "", lambda: ask(m.Undo(self.author(), redo=True)), "small")
        self.show_history(History())
        self.sentences_label = WrappedLabel("value", "look")
        author = label(tr("by"), "quiet"), self.author_field
        reason = label(tr("why"), "quiet"), (self.reason_field, 1)
        row = hbox(*author, *reason, self.undo, self.redo, spacing=GRID // 2)
        vbox(row, self.sentences_label, on=self, spacing=GRID // 2)

    def author(self) -> str:
        return self.author_field.text().strip() or NOBODY

    def reason(self) -> str:
        return self.reason_field.text().strip() or DRAGGED

    def show_history(self, history: History) -> None:
        for widget, decision, text in (
            (self.undo, history.undo, tr_noop("undo {decision}, Ctrl+Z")),
            (self.redo, history.redo, tr_noop("redo {decision}, Ctrl+Shift+Z")),
        ):
            widget.setEnabled(bool(decision))
            none = tr("{button}: no decision", button=widget.text())
            widget.setAccessibleName(tr(text, decision=decision) if decision else none)
            widget.setToolTip(widget.accessibleName())
