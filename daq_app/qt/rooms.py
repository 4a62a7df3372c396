"""The rooms of the window: a session that is prepared or run in one, recorded sessions in the other."""

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QStackedWidget

from daq_app.qt.bridge import Bridge
from daq_app.qt.menus import Menus, Rail, Room
from daq_app.qt.remembered import remember_session
from daq_app.window.messages import NewSession

if TYPE_CHECKING:  # loaded when somebody looks at a session
    from daq_app.qt.analyst_window import AnalystWindow
    from daq_app.qt.review_room import ReviewRoom


class Rooms(QStackedWidget):
    """Shows one room; rail and menu say which, and which others can be entered."""

    def __init__(self, bridge: Bridge, scale: float, rail: Rail, menus: Menus) -> None:
        """Show nothing yet: the room of the session in hand is the first widget that is added."""
        super().__init__()
        self._bridge = bridge
        self._scale = scale
        self._rail = rail
        self._menus = menus
        self._kept: str | None = None  # folder of the session that was put among the recent ones
        self.review: ReviewRoom | None = None

    @property
    def room(self) -> Room:
        """Return the room that is shown."""
        if self.currentIndex() == 1:
            return "review"
        return "prepare" if self._bridge.view.course is None else "run"

    @property
    def over(self) -> bool:
        """Say whether the session in hand has ended."""
        session = self._bridge.state.session
        return session is not None and session.over

    @property
    def analyst(self) -> "AnalystWindow | None":
        """Return the session that is looked at; None in the other rooms."""
        return None if self.review is None or self.room != "review" else self.review.analyst

    def go_to(self, room: Room) -> None:
        """Show a room, where it can be: Review on the session that has just ended, or else on the newest."""
        session = self._bridge.state.session
        if room != "review":
            self.setCurrentIndex(0)
            if room == "prepare" and self.over:
                self._bridge.send(NewSession())
        elif session is not None and session.over:
            self.open(Path(session.folder))
        else:
            self._entered().enter()
        self.show_state()

    def choose(self) -> None:
        """Ask for a session, and open it."""
        self._entered().choose()
        self.show_state()

    def open(self, folder: Path) -> None:
        """Look at a recorded session."""
        self._entered().open(folder)
        self.show_state()

    def show_state(self) -> None:
        """Show in rail and menu what can be done now, and keep a session that has ended among the recent ones."""
        session = self._bridge.state.session
        if session is not None and session.over and session.folder != self._kept:
            self._kept = session.folder
            remember_session(Path(session.folder))
        in_hand = self._bridge.view.course is not None
        self._rail.show_room(self.room, in_hand=in_hand, over=self.over)
        self._menus.show_state(in_hand=in_hand, over=self.over, opened=self.analyst is not None)

    def leave(self) -> None:
        """End the work on the session that is looked at."""
        if self.review is not None:
            self.review.leave()

    def _entered(self) -> "ReviewRoom":
        """Show the room of recorded sessions, which is made when it is first entered."""
        if self.review is None:
            from daq_app.qt.review_room import ReviewRoom

            self.review = ReviewRoom(self._scale)
            self.addWidget(self.review)
        self.setCurrentIndex(1)
        return self.review
