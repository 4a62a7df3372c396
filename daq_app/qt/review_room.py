"""The room in which recorded sessions are looked at: the recent ones at the left, the chosen one beside them."""

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from daq_app.qt.analyst_window import AnalystWindow
from daq_app.qt.parts import bare, button, label
from daq_app.qt.remembered import recent_sessions, remember_session
from daq_app.qt.tokens import GRID, theme_of
from daq_app.wording import tr

LIST_WIDTH = 200  # before the font's scale [px]


class ReviewRoom(QWidget):
    """One session at a time; another takes its place."""

    def __init__(self, scale: float) -> None:
        """Show no session."""
        super().__init__()
        self.analyst: AnalystWindow | None = None
        self.recent = QListWidget()
        self.recent.setAccessibleName(tr("recent sessions"))
        self.recent.itemActivated.connect(self._go)
        self.recent.itemClicked.connect(self._go)
        self._none = label(tr("Choose a session at the left, or open one."), "title", wrap=True)
        side = QWidget()
        side.setFixedWidth(round(LIST_WIDTH * scale))
        column = QVBoxLayout(side)
        column.setContentsMargins(0, GRID, 0, GRID)
        column.addWidget(label(tr("Recent sessions"), "section"))
        column.addWidget(self.recent, 1)
        column.addWidget(button(tr("Open…  Ctrl+O"), tr("open a recorded session"), self.choose))
        self._row = bare(QHBoxLayout(self), GRID)
        self._row.addWidget(side)
        self._row.addWidget(self._none, 1)

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
