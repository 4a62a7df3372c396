"""Two things beside each other, of which the second opens and closes like a drawer and keeps its size."""

from collections.abc import Callable

from PySide6.QtCore import QByteArray, Qt
from PySide6.QtWidgets import QSplitter, QWidget

from daq_app.qt.remembered import DRAWER, DRAWER_SIZES
from daq_app.qt.screens import settings
from daq_app.wording import tr

SHARES = (500, 300)  # of the width, before somebody moved the handle [-]


class Openness:
    """Whether a part is open, remembered under a `key` where there is room for the part and its neighbour.

    Where there is none it begins closed, and can be opened all the same, which is not remembered. `place` is called
    when it has changed.
    """

    def __init__(self, key: str, place: Callable[[], object]) -> None:
        """Take what was remembered; open where nothing was."""
        self._key, self._place = key, place
        self._wanted = settings().value(key) != "no"
        self._instead = False  # it was opened where there is no room
        self.room = True

    def __bool__(self) -> bool:
        """Say whether it is open."""
        return self._wanted if self.room else self._instead

    def set_room(self, room: bool) -> None:
        """Say whether there is room."""
        if room != self.room:
            self.room, self._instead = room, False
            self._place()

    def toggle(self) -> None:
        """Open or close it."""
        if self.room:
            self._wanted = not self._wanted
            settings().setValue(self._key, "yes" if self._wanted else "no")
        else:
            self._instead = not self._instead
        self._place()


class Drawer(QSplitter):
    """What is always there, and a drawer at its right that remembers whether it is open and how wide it is.

    Where there is no room for both, the drawer begins closed, and takes the whole place when it is opened.
    """

    def __init__(self, main: QWidget, drawer: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._main, self._drawer = main, drawer
        self.addWidget(main)
        self.addWidget(drawer)
        self.setChildrenCollapsible(False)
        for at, share in enumerate(SHARES):
            self.setStretchFactor(at, share)
        self.setSizes(list(SHARES))
        sizes = settings().value(DRAWER_SIZES)
        if isinstance(sizes, QByteArray):
            self.restoreState(sizes)
        self.handle(1).setAccessibleName(tr("edge of the drawer"))
        self.splitterMoved.connect(lambda: settings().setValue(DRAWER_SIZES, self.saveState()))
        self.open = Openness(DRAWER, self._place)
        self._place()

    def _place(self) -> None:
        self._drawer.setVisible(bool(self.open))
        self._main.setVisible(self.open.room or not self.open)
