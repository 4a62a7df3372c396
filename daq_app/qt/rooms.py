"""The rooms of the window: a session that is prepared or run in one, recorded sessions in the other."""

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QListWidget, QListWidgetItem, QStackedWidget, QWidget

from daq_app.qt.bridge import Bridge
from daq_app.qt.menus import Menus, Rail, Room
from daq_app.qt.parts import button, hbox, label, vbox
from daq_app.qt.remembered import recent_sessions, remember_session
from daq_app.qt.tokens import GRID, theme_of
from daq_app.window.messages import NewSession
from daq_app.wording import tr

if TYPE_CHECKING:
    from daq_app.qt.analyst_window import AnalystWindow

LIST_WIDTH = 200  # of the recent sessions, before the font's scale [px]


class ReviewRoom(QWidget):
    """One session at a time; another takes its place."""

    def __init__(self, scale: float) -> None:
        super().__init__()
        self.analyst: AnalystWindow | None = None
        self.recent = QListWidget()
        self.recent.setAccessibleName(tr("recent sessions"))
        self.recent.itemActivated.connect(self._go)
        self.recent.itemClicked.connect(self._go)
        self._none = label(tr("Choose a session at the left, or open one."), "title", wrap=True)
        side = QWidget()
        side.setFixedWidth(round(LIST_WIDTH * scale))
        vbox(
            label(tr("Recent sessions"), "section"),
            (self.recent, 1),
            button(tr("Open…  Ctrl+O"), tr("open a recorded session"), self.choose),
            on=side,
            margins=(0, GRID, 0, GRID),
        )
        self._row = hbox(side, (self._none, 1), on=self, spacing=GRID)

    def enter(self) -> None:
        """Open the newest session where none is open."""
        self._list()
        if self.analyst is None and (listed := recent_sessions()):
            self.open(listed[0])

    def choose(self) -> None:
        """Ask for the folder of a session, and open it."""
        listed = recent_sessions()
        name = QFileDialog.getExistingDirectory(self, tr("Session folder"), str(listed[0].parent) if listed else ".")
        if name:
            self.open(Path(name))

    def open(self, folder: Path) -> None:
        """Open a session in place of the one that is open."""
        if self.analyst is not None and self.analyst.state.folder == folder:
            return
        self.leave()
        remember_session(folder)
        self._list()
        from daq_app.qt.analyst_window import AnalystWindow  # loaded when somebody looks at a session

        self.analyst = AnalystWindow(folder, theme_of(self))
        self.analyst.setWindowFlags(Qt.WindowType.Widget)
        self._none.hide()
        self._row.addWidget(self.analyst, 1)
        self.analyst.show()

    def leave(self) -> None:
        """End the work on the session that is open."""
        if self.analyst is not None:
            self.analyst.close()
            self._row.removeWidget(self.analyst)
            self.analyst.deleteLater()
            self.analyst = None
            self._none.show()

    def _list(self) -> None:
        self.recent.clear()
        for place in recent_sessions():
            item = QListWidgetItem(place.name)
            item.setToolTip(str(place))
            item.setData(Qt.ItemDataRole.UserRole, str(place))
            self.recent.addItem(item)

    def _go(self, item: QListWidgetItem) -> None:
        self.open(Path(item.data(Qt.ItemDataRole.UserRole)))


class Rooms(QStackedWidget):
    """Shows one room; rail and menu say which, and which others can be entered."""

    def __init__(self, bridge: Bridge, scale: float, rail: Rail, menus: Menus) -> None:
        """Show nothing yet: the room of the session in hand is the first widget that is added."""
        super().__init__()
        self._bridge = bridge
        self._rail = rail
        self._menus = menus
        self._kept: str | None = None  # folder of the session that was put among the recent ones
        self.review = ReviewRoom(scale)  # added when it is first entered

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
        return self.review.analyst if self.room == "review" else None

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
        self.review.leave()

    def _entered(self) -> ReviewRoom:
        if self.count() == 1:
            self.addWidget(self.review)
        self.setCurrentIndex(1)
        return self.review
