"""The decisions about a session as Qt's undo stack: what Undo and Redo would do next, and whether they can."""

from collections.abc import Callable

from PySide6.QtCore import Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

from daq_app.analyst.messages import History


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
