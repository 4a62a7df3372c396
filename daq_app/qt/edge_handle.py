"""A handle for one edge of a stroke's windows: focused, the arrows move it, Enter records where it is."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import QPushButton, QSizePolicy

from daq_app.analyst.edges import LEAP, STEP, Placed
from daq_app.analyst.messages import Edge
from daq_app.wording import tr, tr_noop

NAMES: dict[Edge, str] = tr_noop({"onset": "onset", "steady begin": "steady", "steady end": "to", "lift": "lift"})


class EdgeHandle(QPushButton):
    """Says where an edge is; `moved` tells where it would be, `recorded` where it was left."""

    moved = Signal(str, float)  # the edge, and the instant [s, device time]
    recorded = Signal(str, float)  # likewise

    def __init__(self, edge: Edge) -> None:
        """Stand for no stroke yet."""
        super().__init__()
        self.edge: Edge = edge
        self._placed: Placed | None = None
        self._time, self._origin = 0.0, 0.0
        self.setAutoDefault(False)
        self.setProperty("role", "handle")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.show_edge(None, 0.0)

    def show_edge(self, placed: Placed | None, origin: float) -> None:
        """Show an edge, its time told since `origin` [s]."""
        self._placed, self._origin = placed, origin
        self._time = 0.0 if placed is None else placed.time
        self.setEnabled(placed is not None)
        self._show()

    def show_at(self, time: float) -> None:
        """Show where the edge is being moved to [s, device time]."""
        self._time = time
        self._show()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Move by the arrows, record with Enter, go back with Esc."""
        far = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        match event.key():
            case Qt.Key.Key_Left:
                self.moved.emit(self.edge, self._time - (LEAP if far else STEP))
            case Qt.Key.Key_Right:
                self.moved.emit(self.edge, self._time + (LEAP if far else STEP))
            case Qt.Key.Key_Return | Qt.Key.Key_Enter if self._away:
                self.recorded.emit(self.edge, self._time)
            case Qt.Key.Key_Escape if self._away:
                self._back()
            case _:
                super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:  # noqa: N802  Qt's name
        """Go back to where it was: only Enter records."""
        if self._away:
            self._back()
        super().focusOutEvent(event)

    @property
    def _away(self) -> bool:
        return self._placed is not None and self._time != self._placed.time

    def _back(self) -> None:
        if self._placed is not None:
            self.moved.emit(self.edge, self._placed.time)

    def _show(self) -> None:
        name, placed = tr(NAMES[self.edge]), self._placed
        if placed is None:
            self.setText(name)
            self.setAccessibleName(tr("{name}: no stroke", name=name))
            return
        at = f"{self._time - self._origin:.3f}"
        mark = "✎ " if placed.decided else "" if placed.present else "○ "
        self.setText(f"{mark}{name} {at}{' ⏎' if self._away else ''}")
        state = placed.decided or (tr("as found") if placed.present else tr("not found; where it could be"))
        self.setToolTip(
            tr("{state}\nDrag the line, or: ← → move (Shift further), Enter records, Esc goes back", state=state)
        )
        spoken = {"steady begin": tr("steady from"), "steady end": tr("steady to")}.get(self.edge, name)
        self.setAccessibleName(f"{spoken} {at} s, {state}{', Enter records' if self._away else ''}")
