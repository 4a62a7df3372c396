"""Parts of the page of a new session: a card of its checklist, the transducer's row, and what was cut short."""

import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from daq_app.qt.parts import Panel, button, choice, fill, hbox, label, regrade, say, vbox
from daq_app.qt.tokens import GRID
from daq_app.recorder.messages import ResumeSession
from daq_app.window.checklist import Card
from daq_app.window.messages import Message
from daq_app.window.new_session import Unfinished, unfinished
from daq_app.window.view_bench import BenchView, bench_summary
from daq_app.wording import tr


class CardFrame(Panel):
    """Holds the fields of a card in `body`."""

    def __init__(self, name: str) -> None:
        super().__init__("", "card")
        self._name = name
        self._card: Card | None = None
        self._mark = label("○")
        self.words = label("", "quiet", wrap=True)
        self.body = QVBoxLayout()
        self.body.setSpacing(4)
        vbox(
            hbox(self._mark, (label(tr(name), "name", wrap=True), 1), spacing=GRID),
            self.words,
            self.body,
            on=self,
            margins=GRID,
            spacing=4,
        )

    def show_card(self, card: Card) -> None:
        """Show whether the card is ready, and its line; nobody is blamed before Start was asked for."""
        if card == self._card:
            return
        self._card = card
        say(self._mark, "✓" if card.ready else "○")
        say(self.words, card.words)
        self.words.setVisible(bool(card.words))
        self.setAccessibleName(
            f"{tr(self._name)}: {tr('ready') if card.ready else tr('not ready')}. {card.words}".strip()
        )
        regrade(self.words, "")

    def insist(self) -> None:
        """Mark the line as what keeps the session from beginning."""
        regrade(self.words, "wrong")


class CutShort(Panel):
    """Lists the sessions that can go on; without one it is not seen."""

    _listed = Signal(object)  # from a thread

    def __init__(self, send: Callable[[Message], None]) -> None:
        """Offer nothing; `send` takes what is asked for."""
        super().__init__("", "banner")
        self._send = send
        self._shown: tuple[Unfinished, ...] = ()
        self.setProperty("grade", "look")
        self._sessions = choice(tr("sessions that were cut short"))
        self.go_on = button(tr("Go on with it"), tr("go on with the session that was cut short"), self._resumed)
        fill(QVBoxLayout(self), label(tr("▲ Sessions that were cut short"), wrap=True), self._sessions, self.go_on)
        self._listed.connect(self.show_sessions, Qt.ConnectionType.QueuedConnection)
        self.show_sessions(())

    def look_in(self, folder: Path) -> None:
        """Look for such sessions in a folder, without holding up the window."""

        def look() -> None:
            sessions = unfinished(folder)
            with suppress(RuntimeError):  # the page is gone by now
                self._listed.emit(sessions)

        threading.Thread(target=look, daemon=True).start()

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


class TransducerRow(QWidget):
    """Two buttons and a few lines of words; `act` does what a button stands for."""

    def __init__(self, act: Callable[[str], None]) -> None:
        super().__init__()
        self.connect_button = button(tr("Connect"), tr("connect the transducer"), lambda: act("connect"))
        self.zero = button(tr("Zero  T"), tr("measure the zero of the transducer"), lambda: act("tare"))
        self.words = label("", "quiet", wrap=True)
        vbox(hbox((self.connect_button, 1), (self.zero, 1)), self.words, on=self, spacing=GRID // 2)

    def show_view(self, view: BenchView) -> None:
        """Show which transducer it is, its zero, noise and life, and what can be done with it."""
        connected = view.lamp != "off"
        act = tr("Disconnect") if connected else tr("Connect")
        say(self.words, bench_summary(view))
        self.connect_button.setText(act)
        self.connect_button.setAccessibleName(tr("{act} the transducer", act=act))
        self.connect_button.setEnabled(not connected or view.connect is not None)
        self.zero.setEnabled(view.can_tare)
