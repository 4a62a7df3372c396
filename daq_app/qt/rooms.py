"""Navigation of the window: menu, rail and rooms. Menu entries have the same actions as keys."""

import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, Literal

from PySide6.QtCore import QEvent, Qt, QTimer, QUrl, qVersion
from PySide6.QtGui import QAction, QActionGroup, QDesktopServices, QResizeEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QListWidgetItem,
    QMainWindow,
    QMenu,
    QMessageBox,
    QPushButton,
    QStackedWidget,
    QToolButton,
    QWidget,
)

from daq_app.qt import preferences
from daq_app.qt.bridge import Bridge
from daq_app.qt.keys import KEYS
from daq_app.qt.layout import hbox, vbox
from daq_app.qt.parts import Panel, RowList, button, label, set_text
from daq_app.qt.preferences import name_of, recent_sessions, remember_session
from daq_app.qt.tokens import GRID, px, theme_of
from daq_app.window.state import NewSession
from daq_app.wording import EXPERIMENTER, languages, tr, tr_noop
from sessions.recording.head import installed_version

if TYPE_CHECKING:
    from daq_app.qt.analyst_window import AnalystWindow

Room = Literal["prepare", "run", "review"]
ROOMS: tuple[Room, ...] = ("prepare", "run", "review")
WHY_NOT = {
    "prepare": tr_noop("A session is being recorded: end it before the next is prepared."),
    "run": tr_noop("No session is running: start one in Prepare."),
}
KEY_OF = {key.act: key.key for key in KEYS}
ROOM_NAMES: Mapping[Room, str] = {"prepare": tr_noop("Prepare"), "run": tr_noop("Run"), "review": tr_noop("Review")}
_WIDTH = 84  # before the font's scale [px]
DOCS = Path(__file__).parents[2] / "docs" / "index.md"
_SESSION = (
    ("redo", tr_noop("Redo…")), ("undo", tr_noop("Undo the last redo")), ("skip", tr_noop("Skip…")),
    ("pause", tr_noop("Pause or resume")), ("note", tr_noop("Note…")), ("end", tr_noop("End…")),
)  # fmt: skip
PANELS = (
    ("bench", tr_noop("Bench")), ("drawer", tr_noop("Drawer: axes, sample, finger")),
    ("mirror", tr_noop("The subject's page")), ("inspect", tr_noop("Inspect the last trial")),
    ("hold", tr_noop("Hold the picture")), ("model", tr_noop("Live model at finite strain")),
)  # fmt: skip
_LIBRARIES = ("PySide6-Essentials", "numpy", "scipy", "numba")
LIST_WIDTH = 200  # of the recent sessions, before the font's scale [px]
_STAMP = re.compile(r"(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)")  # in the name of a session's folder
LEAST_FOR_LIST = 760  # width from which the list is next to an open session, before the font's scale [px]


class Rail(Panel):
    """Three buttons, one for each room; the button of the current room stays pressed."""

    def __init__(self, go: Callable[[Room], None]) -> None:
        super().__init__(tr("rooms"), "strip")
        self.buttons: dict[Room, QPushButton] = {}
        for room in ROOMS:
            name, key = tr(ROOM_NAMES[room]), KEY_OF[f"go to {room}"]
            self.buttons[room] = button(f"{name}\n{key}", name, partial(go, room), "rail", checkable=True)
        vbox(*self.buttons.values(), 1, on=self, margins=(GRID // 2, GRID, GRID // 2, GRID))
        self.setFixedWidth(px(_WIDTH, most=1.4))

    def show_room(self, room: Room, *, in_hand: bool, session_over: bool) -> None:
        """Show the current room and the available ones; a session may be `in_hand`, or `session_over`."""
        for name, widget in self.buttons.items():
            widget.setChecked(name == room)
            closed = (name == "prepare" and in_hand and not session_over) or (name == "run" and not in_hand)
            widget.setEnabled(not closed)
            widget.setToolTip(tr(WHY_NOT[name]) if closed else "")
            widget.setAccessibleDescription(widget.toolTip())


class Menus:
    """Fills the menu bar of a window."""

    def __init__(self, window: QMainWindow, act: Callable[[str], None]) -> None:
        """Build the menu; `act` carries out the action of an entry, or the change of a preference."""
        self._act = act
        bar = window.menuBar()
        if (more := bar.findChild(QToolButton)) is not None:
            more.setAccessibleName(tr("the rest of the menu"))
        file = bar.addMenu(tr("&File"))
        self._add(file, "open", tr("Open session…"))
        self.recent = file.addMenu(tr("Open recent"))
        self.recent.aboutToShow.connect(self._list_recent)
        file.addSeparator()
        self.report = self._add(file, "report", tr("Write report…"))
        self.export = self._add(file, "export", tr("Export…"))
        file.addSeparator()
        self._add(file, "quit", tr("Quit"))
        self.session = bar.addMenu(tr("&Session"))
        self._add(self.session, "new", tr("New session"))
        self.pilot = self._add(self.session, "pilot", tr("Pilot the protocol"))
        self._add(self.session, "preview", tr("Preview the subject's pages"))
        self._add(self.session, "tare", tr("Zero the bench"))
        self.session.addSeparator()
        self.course = [self._add(self.session, name, tr(text)) for name, text in _SESSION]
        view = bar.addMenu(tr("&View"))
        for room in ROOMS:
            self._add(view, f"go to {room}", tr(ROOM_NAMES[room]))
        view.addSeparator()
        themes = {name: name for name in preferences.THEMES}
        self._choices(view.addMenu(tr("Theme")), preferences.THEME, themes, preferences.theme())
        sizes = {f"{100 * scale:.0f} %": scale for scale in preferences.SCALES}
        self._choices(view.addMenu(tr("Font size")), preferences.SCALE, sizes, preferences.preferred_scale())
        codes = {name_of(code): code for code in languages(EXPERIMENTER)}
        menu, language = view.addMenu(tr("Language")), preferences.language()
        self.languages = self._choices(menu, preferences.LANGUAGE, codes, language)
        panels = view.addMenu(tr("Panels"))
        for name, text in PANELS:
            self._add(panels, name, tr(text))
        self._add(view, "subject", tr("Subject's window"))
        help_menu = bar.addMenu(tr("&Help"))
        self._add(help_menu, "keys", tr("Keys"))
        docs = help_menu.addAction(tr("Documentation"), lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(str(DOCS))))
        docs.setEnabled(DOCS.exists())
        help_menu.addAction(tr("About daq-app"), lambda: about_box(window).show())

    def show_state(self, *, in_hand: bool, session_over: bool, session_open: bool) -> None:
        for action in self.course:
            action.setEnabled(in_hand and not session_over)
        self.pilot.setEnabled(not in_hand)
        for action in (self.report, self.export):
            action.setEnabled(session_open)

    def _add(self, menu: QMenu, name: str, text: str) -> QAction:
        """Return an entry that shows its key; the key itself is routed by the window."""
        return menu.addAction(f"{text}\t{KEY_OF.get(name, '')}".rstrip(), lambda: self._act(name))

    def _choices(self, menu: QMenu, preference: str, values: Mapping[str, object], now: object) -> QActionGroup:
        """Return an entry for each value of a preference, by name, which stores and applies it."""

        def choose(value: object) -> None:
            preferences.settings().setValue(preference, str(value))
            self._act(preference)

        group = QActionGroup(menu)
        for name, value in values.items():
            text = tr(name)
            action = menu.addAction(text[:1].upper() + text[1:], lambda value=value: choose(value))
            action.setCheckable(True)
            action.setChecked(value == now)
            group.addAction(action)
        return group

    def _list_recent(self) -> None:
        self.recent.clear()
        folders = preferences.recent_sessions()
        for folder in folders:
            self.recent.addAction(folder.name, lambda folder=folder: self._act(f"open {folder}"))
        if not folders:
            self.recent.addAction(tr("No session was recorded or opened yet")).setEnabled(False)


def about_box(parent: QWidget) -> QMessageBox:
    """Return a box with the versions, deleted when it is closed."""
    box = QMessageBox(QMessageBox.Icon.NoIcon, tr("About daq-app"), about_text(), parent=parent)
    box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    return box


def about_text() -> str:
    """Return the versions of the program and of its libraries."""
    own, *libraries = (f"{name} {installed_version(name) or tr('unknown')}" for name in ("daq-app", *_LIBRARIES))
    return "\n".join((own, f"Python {python_version()}", f"Qt {qVersion()}", *libraries))


class ReviewRoom(QWidget):
    """Shows one session at a time."""

    def __init__(self) -> None:
        super().__init__()
        self.analyst: AnalystWindow | None = None
        self._has_room = False  # for the list next to an open session
        self.recent = RowList(tr("recent sessions"))
        self.recent.itemActivated.connect(self._open_item)
        self.recent.itemClicked.connect(self._open_item)
        self._none = label("", "title", wrap=True)
        self._side, choose = QWidget(), button(tr("Open…  Ctrl+O"), tr("open a recorded session"), self.choose)
        self._side.setFixedWidth(px(LIST_WIDTH))
        heading, margins = label(tr("Recent sessions"), "section"), (0, GRID, 0, GRID)
        vbox(heading, (self.recent, 1), choose, on=self._side, margins=margins)
        self._row = hbox(self._side, (self._none, 1), on=self, spacing=GRID)

    def enter(self) -> None:
        self._list()
        if self.analyst is None and (recent := recent_sessions()):
            self.open(recent[0])

    def choose(self) -> None:
        recent = recent_sessions()
        name = QFileDialog.getExistingDirectory(self, tr("Session folder"), str(recent[0].parent) if recent else ".")
        if name:
            self.open(Path(name))

    def open(self, folder: Path) -> None:
        """Open a session in place of the current one."""
        folder = folder.absolute()
        if self.analyst is not None and self.analyst.state.folder == folder:
            return
        self.leave()
        remember_session(folder)
        self._list()
        from daq_app.qt.analyst_window import AnalystWindow  # slow to load, so only when a session is opened

        self._show_analyst(AnalystWindow(folder, theme_of(self)))

    def leave(self) -> None:
        if self.analyst is not None:
            self.analyst.close()
            self._remove(self.analyst)
            self.analyst = None
            self._none.show()
            self._show_list()

    def fit(self, width: int) -> None:
        """Adjust to a width, even while hidden; a narrow room has no list next to an open session."""
        self._has_room = width >= px(LEAST_FOR_LIST)
        self._show_list()

    def changeEvent(self, event: QEvent) -> None:
        """Show the session in the colours of a new theme, after all other parts."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.StyleChange:
            QTimer.singleShot(0, self, self._follow_theme)

    def _follow_theme(self) -> None:
        """Show the session in a new window, because plots keep their initial colours."""
        previous, tokens = self.analyst, theme_of(self)
        if previous is not None and previous.tokens is not tokens:
            self._show_analyst(previous.hand_over(tokens))
            self._remove(previous)

    def _show_analyst(self, analyst: "AnalystWindow") -> None:
        self.analyst = analyst
        analyst.setWindowFlags(Qt.WindowType.Widget)
        self._none.hide()
        self._show_list()
        self._row.addWidget(analyst, 1)
        analyst.show()

    def _show_list(self) -> None:
        self._side.setVisible(self.analyst is None or self._has_room)

    def _remove(self, analyst: "AnalystWindow") -> None:
        self._row.removeWidget(analyst)
        analyst.deleteLater()

    def _list(self) -> None:
        self.recent.clear()
        folders = recent_sessions()
        some, none = tr("Choose a session at the left, or open one."), tr("No session was recorded or opened yet.")
        set_text(self._none, some if folders else none)
        for folder in folders:
            lines = "\n".join(folder.name.rsplit("_", 2))  # subject, protocol, time: none truncated
            item = QListWidgetItem(_STAMP.sub(r"\1-\2-\3 \4:\5:\6", lines))
            item.setToolTip(str(folder))
            item.setData(Qt.ItemDataRole.UserRole, str(folder))
            self.recent.addItem(item)

    def _open_item(self, item: QListWidgetItem) -> None:
        self.open(Path(item.data(Qt.ItemDataRole.UserRole)))


class Rooms(QStackedWidget):
    """Shows one room; rail and menu show which one, and which others are available."""

    def __init__(self, bridge: Bridge, rail: Rail, menus: Menus) -> None:
        """Show nothing yet: the room of the current session is the first widget added."""
        super().__init__()
        self._bridge, self._rail, self._menus = bridge, rail, menus
        self._recent_folder: str | None = None  # folder of the session added to the recent ones
        self.review = ReviewRoom()  # added when first entered

    @property
    def room(self) -> Room:
        if self.currentIndex() == 1:
            return "review"
        return "prepare" if self._bridge.view.course is None else "run"

    @property
    def session_over(self) -> bool:
        session = self._bridge.state.session
        return session is not None and session.is_over

    @property
    def analyst(self) -> "AnalystWindow | None":
        """Return the open session's window; None in the other rooms."""
        return self.review.analyst if self.room == "review" else None

    def go_to(self, room: Room) -> None:
        """Show a room, if available: Review with the session that has just ended, else with the newest."""
        session = self._bridge.state.session
        if room != "review":
            self.setCurrentIndex(0)
            if room == "prepare" and self.session_over:
                self._bridge.send(NewSession())
        elif session is not None and session.is_over:
            self.open(Path(session.folder))
        else:
            self._enter_review().enter()
        self.show_state()

    def choose(self) -> None:
        self._enter_review().choose()
        self.show_state()

    def open(self, folder: Path) -> None:
        self._enter_review().open(folder)
        self.show_state()

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.review.fit(event.size().width())  # even while hidden, or it would keep the window wide

    def show_state(self) -> None:
        """Update rail and menu, and add an ended session to the recent ones."""
        session = self._bridge.state.session
        if session is not None and session.is_over and session.folder != self._recent_folder:
            self._recent_folder = session.folder
            remember_session(Path(session.folder))
        in_hand = self._bridge.view.course is not None
        self._rail.show_room(self.room, in_hand=in_hand, session_over=self.session_over)
        self._menus.show_state(in_hand=in_hand, session_over=self.session_over, session_open=self.analyst is not None)

    def _enter_review(self) -> ReviewRoom:
        if self.count() == 1:
            self.addWidget(self.review)
        self.setCurrentIndex(1)
        return self.review
