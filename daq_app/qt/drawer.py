"""Two things beside each other, of which the second opens and closes like a drawer and keeps its size."""

from PySide6.QtCore import QByteArray, Qt
from PySide6.QtWidgets import QSplitter, QWidget

from daq_app.qt.remembered import DRAWER, DRAWER_SIZES
from daq_app.qt.screens import settings

SHARES = (500, 300)  # of the width, before somebody moved the handle [-]


class Drawer(QSplitter):
    """What is always there, and a drawer at its right that remembers whether it is open and how wide it is.

    Where there is no room for both, the drawer begins closed, and takes the whole place when it is opened.
    """

    def __init__(self, main: QWidget, drawer: QWidget) -> None:
        """Place both as they were left."""
        super().__init__(Qt.Orientation.Horizontal)
        self._main, self._drawer = main, drawer
        self._room = True
        self._instead = False  # it was opened where there is no room for both
        self.addWidget(main)
        self.addWidget(drawer)
        self.setChildrenCollapsible(False)
        for at, share in enumerate(SHARES):
            self.setStretchFactor(at, share)
        self.setSizes(list(SHARES))
        sizes = settings().value(DRAWER_SIZES)
        if isinstance(sizes, QByteArray):
            self.restoreState(sizes)
        self.handle(1).setAccessibleName("edge of the drawer")
        self.splitterMoved.connect(self._keep_sizes)
        self._wanted = settings().value(DRAWER) != "no"
        self._place()

    @property
    def is_open(self) -> bool:
        """Say whether the drawer is seen."""
        return self._wanted if self._room else self._instead

    def set_room(self, room: bool) -> None:
        """Say whether there is room for both."""
        if room != self._room:
            self._room, self._instead = room, False
            self._place()

    def toggle(self) -> None:
        """Open or close the drawer; where there is room for both this is remembered."""
        if self._room:
            self._wanted = not self._wanted
            settings().setValue(DRAWER, "yes" if self._wanted else "no")
        else:
            self._instead = not self._instead
        self._place()

    def _place(self) -> None:
        self._drawer.setVisible(self.is_open)
        self._main.setVisible(self._room or not self._instead)

    def _keep_sizes(self) -> None:
        settings().setValue(DRAWER_SIZES, self.saveState())
