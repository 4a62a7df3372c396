"""Whether a part of the window is open: as it was left, or where it has no room, as it was opened there."""

from collections.abc import Callable

from daq_app.qt.screens import settings


class Openness:
    """Open or closed, remembered under a `key` where there is room for both the part and what is beside it.

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
