"""Who decides about a stroke's windows and why, and the way back."""

from collections.abc import Callable

from PySide6.QtCore import QSettings, Signal
from PySide6.QtGui import QFontMetrics, QUndoCommand, QUndoStack
from PySide6.QtWidgets import QLineEdit, QWidget

from daq_app.analyst import messages as m
from daq_app.analyst.messages import History
from daq_app.qt.parts import Wrapped, button, hbox, label, vbox
from daq_app.qt.remembered import type_scale
from daq_app.qt.tokens import GRID, TEXT, font
from daq_app.wording import tr

BY = "analyst/by"  # where the code is remembered
NOBODY = "analyst"  # who decided, where nobody gave a code
DRAGGED = "dragged by hand"


class DecisionStack(QUndoStack):
    """The session's file holds the decisions, and whatever it says is shown; `wanted` asks for the next line of it."""

    wanted = Signal(bool)  # True: redo; False: undo

    def show_history(self, history: History) -> None:
        """Show what can be undone and redone; nothing is asked for by it."""
        words = [self.text(at) for at in range(self.count())]
        if (*history.done, *history.undone) == tuple(words) and len(history.done) == self.index():
            return
        self.blockSignals(True)  # each command that is pushed is done, and one that is left is undone
        self.clear()
        for one in (*history.done, *history.undone):
            self.push(_Decision(one, self.wanted.emit))
        self.setIndex(len(history.done))
        self.blockSignals(False)
        self.indexChanged.emit(self.index())


class _Decision(QUndoCommand):
    def __init__(self, words: str, ask: Callable[[bool], object]) -> None:
        super().__init__(words)
        self._ask = ask

    def undo(self) -> None:
        self._ask(False)

    def redo(self) -> None:
        self._ask(True)


class DecisionsBar(QWidget):
    """A code, a reason, undo and redo; under them what was decided about the chosen stroke."""

    requested = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.by = QLineEdit(str(QSettings().value(BY, "")))
        self.by.setPlaceholderText(NOBODY)
        self.by.setAccessibleName(tr("code of who decides; never a name"))
        self.by.setMaximumWidth(round(110 * type_scale()))
        self.by.editingFinished.connect(lambda: QSettings().setValue(BY, self.by.text()))
        self.why = QLineEdit()
        self.why.setPlaceholderText(DRAGGED)
        self.why.setMinimumWidth(QFontMetrics(font(TEXT, type_scale())).horizontalAdvance(DRAGGED) + 3 * GRID)
        self.why.setAccessibleName(tr("why an edge is moved"))
        self.stack = DecisionStack(self)
        self.stack.wanted.connect(self._ask)
        self.stack.indexChanged.connect(self._show_next)
        self.undo = button(tr("Undo"), "", self.stack.undo, "small")
        self.redo = button(tr("Redo"), "", self.stack.redo, "small")
        self._show_next()
        self.sentences_label = Wrapped("value", "look")
        vbox(
            hbox(
                label(tr("by"), "quiet"),
                self.by,
                label(tr("why"), "quiet"),
                (self.why, 1),
                self.undo,
                self.redo,
                spacing=GRID // 2,
            ),
            self.sentences_label,
            on=self,
            spacing=GRID // 2,
        )

    def who(self) -> str:
        """Return the code of who decides."""
        return self.by.text().strip() or NOBODY

    def reason(self) -> str:
        """Return why."""
        return self.why.text().strip() or DRAGGED

    def show_decided(self, sentences: tuple[str, ...], history: m.History) -> None:
        """Show what was decided about a stroke, and what of the session can be undone."""
        self.sentences_label.show_text("\n".join(f"✎ {sentence}" for sentence in sentences))
        self.stack.show_history(history)

    def _ask(self, again: bool) -> None:
        self.requested.emit(m.Undo(self.who(), again))

    def _show_next(self) -> None:
        """Say on each button what it would do next."""
        stack = self.stack
        for widget, can, words in (
            (self.undo, stack.canUndo(), tr("undo {decision}, Ctrl+Z", decision=stack.undoText())),
            (self.redo, stack.canRedo(), tr("redo {decision}, Ctrl+Shift+Z", decision=stack.redoText())),
        ):
            widget.setEnabled(can)
            widget.setAccessibleName(words if can else tr("{button}: no decision", button=widget.text()))
            widget.setToolTip(widget.accessibleName())
