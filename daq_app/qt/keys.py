"""The keys of the experimenter's and the analyst's windows, one list each, shown by F1; routing of keys."""

from collections.abc import Callable
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QObject, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QApplication, QMainWindow, QWidget

from daq_app.qt.layout import hbox, scroll_area, vbox
from daq_app.qt.parts import Panel, button, is_text_field, label, label_grid
from daq_app.qt.subject_window import SubjectWindow
from daq_app.qt.tokens import GRID, px
from daq_app.window.subject import Owner, owner
from daq_app.wording import tr, tr_noop

_WIDTH = 720  # of the page, before the font's scale


@dataclass(frozen=True, slots=True)
class Key:
    """A key, its action, and a description."""

    key: str
    act: str
    description: str


KEYS = (
    Key(tr_noop("Space"), "primary", tr_noop("do what the sentence says (Enter too, unless it gives answers)")),
    Key("R", "redo", tr_noop("redo the trial on the button, with a reason unless the stroke gives one")),
    Key("Ctrl+Z", "undo", tr_noop("undo the last redo, until the next stroke: what it discarded counts again")),
    Key("S", "skip", tr_noop("skip the trial, with a reason")),
    Key("P", "pause", tr_noop("pause or resume")),
    Key("N", "note", tr_noop("write a note, stored with its time")),
    Key(
        "0",
        "no answer",
        tr_noop("the subject gives no answer to this trial; where it is typed in digits, use the button"),
    ),
    Key("Ctrl+E", "end", tr_noop("end the session before its last trial, with a reason")),
    Key("Ctrl+N", "new", tr_noop("new session, after one has ended")),
    Key("F2", "go to prepare", tr_noop("prepare a session")),
    Key("F3", "go to run", tr_noop("go to the current session")),
    Key("F4", "go to review", tr_noop("look at recorded sessions, the last one first")),
    Key("T", "tare", tr_noop("measure the zero of the bench, outside a session")),
    Key("A", "acknowledge", tr_noop("acknowledge overloads")),
    Key("H", "hold", tr_noop("hold the picture; readings continue")),
    Key("+", "longer", tr_noop("show a longer stretch of time")),
    Key("-", "shorter", tr_noop("show a shorter stretch of time")),
    Key("M", "model", tr_noop("live model at finite strain, or at small strain again")),
    Key("D", "drawer", tr_noop("open or close the drawer: six axes, sample and finger")),
    Key("V", "mirror", tr_noop("show or fold a small picture of the page that the subject sees now")),
    Key("I", "inspect", tr_noop("inspect the last stroke's trial, and go back; a click on a tile inspects any trial")),
    Key("B", "bench", tr_noop("show or fold the bench")),
    Key("F5", "pilot", tr_noop("pilot the protocol of the page with simulated hand and answers")),
    Key("F6", "subject", tr_noop("show the subject's window and go to it")),
    Key("F7", "preview", tr_noop("preview every page that the subject will see, by this protocol and language")),
    Key("Ctrl+M", "ruler", tr_noop("measure the subject's line with a ruler")),
    Key("Ctrl+O", "open", tr_noop("look at a recorded session: strokes, predictions, report, exports")),
    Key("F1", "keys", tr_noop("show or hide these keys")),
    Key("Esc", "leave", tr_noop("leave the entry, or these keys")),
)

ANALYST_KEYS = (
    Key("Tab", "next", tr_noop("go to the next control; in the line at the top to the next element of the path")),
    Key("Enter", "follow", tr_noop("follow it: to the trial, prediction, friction, window or readings")),
    Key("Up  Down", "trial", tr_noop("choose another trial, in the list")),
    Key("Left  Right", "edge", tr_noop("move the edge whose button has the focus by 5 ms; with Shift by 50 ms")),
    Key(tr_noop("Enter"), "record", tr_noop("record the edge's position as a decision, with author and reason")),
    Key("Esc", "back", tr_noop("put the edge back where it was")),
    Key("Home", "all", tr_noop("show the whole stroke again after zooming; a double-click on a plot too")),
    Key("Ctrl+C", "copy", tr_noop("copy selected cells of a table as tab-separated values; a click on a head sorts")),
    Key("Ctrl+Z", "undo", tr_noop("undo the last decision; that too is recorded")),
    Key("Ctrl+Shift+Z", "redo", tr_noop("redo the decision that was undone last")),
    Key("Space", "play", tr_noop("play and pause, in the replay or in the history")),
    Key("Left  Right", "step", tr_noop("one reading or state of the history back or on; Home and End: to the ends")),
    Key("Ctrl+1 2 3", "pages", tr_noop("go to the trials, the stroke, the model")),
    Key(tr_noop("Esc"), "stop", tr_noop("stop the work; finished results are kept")),
    Key("F1", "keys", tr_noop("show or hide these keys")),
)

_SAME = {"Return": "Space", "Enter": "Space", "=": "+"}  # keys with the action of another
_PLAIN = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.KeypadModifier  # do not change a key's meaning


def act_of(event: QKeyEvent) -> str | None:
    """Return the action of a key, None if it has none."""
    name, modifiers = QKeySequence(event.key()).toString(), event.modifiers() & ~_PLAIN
    name = _SAME.get(name, name)
    if modifiers == Qt.KeyboardModifier.ControlModifier:
        name = f"Ctrl+{name}"
    elif modifiers != Qt.KeyboardModifier.NoModifier:
        return None
    return next((key.act for key in KEYS if key.key == name), None)


def name_of(event: QKeyEvent) -> str:
    """Return the name of a key pressed without Ctrl, Alt or the like; empty with one of them."""
    if event.modifiers() & ~_PLAIN:
        return ""
    return "Enter" if event.key() == Qt.Key.Key_Return else QKeySequence(event.key()).toString()


class KeysPage(Panel):
    """The list of all keys, shown over the window."""

    def __init__(self, parent: QWidget, keys: tuple[Key, ...] = KEYS) -> None:
        super().__init__(tr("keys of this window"))
        self._window, self._keys = parent, keys
        self.setParent(parent)
        self.hide()

    def _fill(self) -> None:
        header = hbox((label(tr("Keys"), "title"), 1), button(tr("Close  F1"), tr("close the keys"), self.hide))
        rows, pairs = QWidget(), ((tr(key.key), label(tr(key.description), wrap=True)) for key in self._keys)
        grid = label_grid(pairs, role="value")
        grid.setHorizontalSpacing(3 * GRID)
        self._rows = vbox(grid, on=rows, margins=(0, 0, GRID, 0))
        self._area = scroll_area(rows)
        self._area.setFocusPolicy(Qt.FocusPolicy.StrongFocus)  # keys scroll it
        margins = (2 * GRID, int(1.5 * GRID), 2 * GRID, int(1.5 * GRID))
        self._column = vbox(header, (self._area, 1), on=self, margins=margins, spacing=GRID)

    def toggle(self) -> None:
        """Show the page over everything else, or hide it; it is filled when first shown."""
        if self.layout() is None:  # None before it is filled
            self._fill()
        self.setVisible(not self.isVisible())
        self.raise_()
        self.fit()  # after it has the window's font

    def fit(self) -> None:
        """Centre the page in the window, no larger than necessary."""
        if self.layout() is None:  # never shown
            return
        window = self._window.size()
        size = QSize(px(_WIDTH), 0).boundedTo(window - QSize(4 * GRID, 4 * GRID))
        around = self._column.totalMinimumSize() - self._area.minimumSizeHint()
        keys = self._rows.totalHeightForWidth(size.width() - around.width())
        size.setHeight(min(around.height() + keys, window.height() - 4 * GRID))
        self.resize(size)
        self.move((window.width() - size.width()) // 2, (window.height() - size.height()) // 2)


class Keyboard(QObject):
    """The keys of the experimenter's and the subject's window."""

    typing = Signal(QWidget)  # this text field of either window has the keyboard
    free = Signal()  # no text field or other program has the keyboard any more
    nothing_to_give = Signal()  # the key that gives an answer was pressed while none is due

    def __init__(
        self,
        window: QMainWindow,
        plan: QWidget,
        subject: SubjectWindow,
        act: Callable[[str], None],
        answered_by_keys: Callable[[], bool],
    ) -> None:
        """Watch the subject's window and the experimenter's plan; `act` carries out the action of a key.

        `answered_by_keys` says whether people of the present session can answer with this computer's keys.
        """
        super().__init__(window)
        self._window, self._plan, self._subject, self._act = window, plan, subject, act
        self._answered_by_keys = answered_by_keys
        for widget in (plan, subject, *subject.findChildren(QWidget)):
            widget.installEventFilter(self)
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.focusChanged.connect(self._focus_changed)
        application.applicationStateChanged.connect(self._state_changed)

    def focused_field(self) -> QWidget | None:
        """Return the text field that the experimenter types in, or None."""
        field: QWidget | None = QApplication.focusWidget()
        if field is None or field.window() is self._subject:
            field = self._window.focusWidget()
        return field if is_text_field(field) and field.isVisible() else None

    def press(self, event: QKeyEvent) -> bool:
        """Handle a key that no field took; return whether it has a meaning."""
        match self._owner(event):
            case "answer":
                if not self._subject.scoring:
                    self.nothing_to_give.emit()
                elif self._subject.isVisible():  # no answers on an invisible page
                    self._subject.take_key(event)
                return True
            case "course":
                act = act_of(event)
                if act is None or event.isAutoRepeat():
                    return False
                self._act(act)
                return True
            case "text":
                return False

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Route the keys of the plan and of the subject's window to their owners."""
        if event.type() != QEvent.Type.KeyPress or not isinstance(event, QKeyEvent) or self._subject.measuring:
            return False
        field, key_owner = self.focused_field(), self._owner(event, from_subject=watched is not self._plan)
        if watched is self._plan:  # a list would search for letters
            return (key_owner == "answer" or act_of(event) is not None) and self.press(event)
        if key_owner == "text" and field is not None:
            self._window.activateWindow()
            QApplication.sendEvent(field, event)
            return True
        is_ours = key_owner == "course" or not self._subject.scoring
        last = (self._subject, self._subject.number.field)  # the field keeps a letter that is no number
        return watched in last and is_ours and self.press(event)

    def _owner(self, event: QKeyEvent, *, from_subject: bool = False) -> Owner:
        typing, by_keys = self.focused_field() is not None, self._answered_by_keys()
        return owner(name_of(event), self._subject.asks, typing=typing, from_subject=from_subject, by_keys=by_keys)

    def _focus_changed(self, previous: QWidget | None, now: QWidget | None) -> None:
        if is_text_field(now):
            self.typing.emit(now)
        came_here = now is not None and now.window() is self._window
        if came_here and is_text_field(previous) and self.focused_field() is None:
            self.free.emit()

    def _state_changed(self, state: Qt.ApplicationState) -> None:
        if state == Qt.ApplicationState.ApplicationActive and self.focused_field() is None:
            self.free.emit()
