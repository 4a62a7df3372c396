"""The rail at the left of the window: Prepare, Run and Review."""

from collections.abc import Callable, Mapping
from typing import Literal

from PySide6.QtWidgets import QFrame, QVBoxLayout

from daq_app.qt.parts import button
from daq_app.qt.tokens import GRID
from daq_app.wording import tr, tr_noop

Room = Literal["prepare", "run", "review"]
ROOMS: tuple[Room, ...] = ("prepare", "run", "review")
WHY_NOT = {
    "prepare": tr_noop("A session is being recorded: end it before the next is prepared."),
    "run": tr_noop("No session is in hand: start one in Prepare."),
}
ROOM_NAMES: Mapping[Room, str] = {"prepare": tr_noop("Prepare"), "run": tr_noop("Run"), "review": tr_noop("Review")}
KEY = {"prepare": "F2", "run": "F3", "review": "F4"}
WIDTH = 84  # before the font's scale [px]


class Rail(QFrame):
    """Three buttons, one for each room; that of the room that is shown stays pressed."""

    def __init__(self, scale: float, go: Callable[[Room], None]) -> None:
        """Show that nothing is open; `go` is called with the room that is wanted."""
        super().__init__()
        self.setAccessibleName(tr("rooms"))
        self.setProperty("role", "strip")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(GRID // 2, GRID, GRID // 2, GRID)
        self.buttons = {
            room: button(
                f"{tr(ROOM_NAMES[room])}\n{KEY[room]}", tr(ROOM_NAMES[room]), lambda room=room: go(room), "rail"
            )
            for room in ROOMS
        }
        for widget in self.buttons.values():
            widget.setCheckable(True)
            layout.addWidget(widget)
        layout.addStretch(1)
        self.setFixedWidth(round(WIDTH * min(scale, 1.4)))

    def show_room(self, room: Room, *, in_hand: bool, over: bool) -> None:
        """Show which room is open, and which can be; a session may be `in_hand`, or `over`."""
        for name, widget in self.buttons.items():
            widget.setChecked(name == room)
            closed = (name == "prepare" and in_hand and not over) or (name == "run" and not in_hand)
            widget.setEnabled(not closed)
            widget.setToolTip(tr(WHY_NOT[name]) if closed else "")
            widget.setAccessibleDescription(widget.toolTip())
