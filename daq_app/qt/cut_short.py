"""The offer, above everything else in Prepare, to go on with a session that was cut short."""

import threading
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QFrame, QVBoxLayout

from daq_app.qt.parts import button, choice, label
from daq_app.recorder.messages import ResumeSession
from daq_app.window.messages import Message
from daq_app.window.new_session import Unfinished, unfinished
from daq_app.wording import tr


class CutShort(QFrame):
    """Lists the sessions that can go on; without one it is not seen."""

    def __init__(self, send: Callable[[Message], None]) -> None:
        """Offer nothing; `send` takes what is asked for."""
        super().__init__()
        self._send = send
        self._shown: tuple[Unfinished, ...] = ()
        self.setProperty("role", "banner")
        self.setProperty("grade", "look")
        self._sessions = choice(tr("sessions that were cut short"))
        self.go_on = button(tr("Go on with it"), tr("go on with the session that was cut short"), self._resumed)
        layout = QVBoxLayout(self)
        for widget in (label(tr("▲ Sessions that were cut short"), wrap=True), self._sessions, self.go_on):
            layout.addWidget(widget)
        self.show_sessions(())

    def look_in(self, folder: Path) -> None:
        """Look for such sessions in a folder, without holding up the window."""
        results: list[tuple[Unfinished, ...]] = []
        worker = threading.Thread(target=lambda: results.append(unfinished(folder)), daemon=True)
        worker.start()
        self._looking = timer = QTimer(self)
        timer.setInterval(100)

        def look() -> None:
            if not worker.is_alive():
                timer.stop()
                self.show_sessions(results[0] if results else ())

        timer.timeout.connect(look)
        timer.start()

    def show_sessions(self, sessions: tuple[Unfinished, ...]) -> None:
        """Offer these sessions."""
        if sessions != self._shown:
            self._shown = sessions
            self._sessions.clear()
            for session in sessions:
                self._sessions.addItem(session.words, str(session.folder))
                at = self._sessions.count() - 1
                self._sessions.setItemData(at, str(session.folder), Qt.ItemDataRole.ToolTipRole)
        self.setVisible(bool(sessions))

    def _resumed(self) -> None:
        folder = self._sessions.currentData()
        if folder:
            self._send(ResumeSession(str(folder)))
