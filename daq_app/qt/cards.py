"""Cards of the page of a new session: a frame, the transducer, the subject's screen, and unfinished sessions."""

import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from daq_app.qt.bench_panel import show_connecting
from daq_app.qt.layout import Part, fill, hbox, vbox
from daq_app.qt.parts import Panel, WrappedLabel, button, choice, field, label, regrade, set_text
from daq_app.qt.preferences import Millimetres, name_of
from daq_app.qt.subject_picture import Thumbnail
from daq_app.qt.tokens import GRID, missing_glyphs
from daq_app.recorder.messages import ResumeSession
from daq_app.window.checklist import Card
from daq_app.window.new_session import SessionForm, UnfinishedSession, subject_texts, unfinished_sessions
from daq_app.window.state import Message, TransducerHolders
from daq_app.window.subject import LENGTH, SubjectText, translator
from daq_app.window.view_bench import BenchView, bench_summary
from daq_app.wording import tr
from sessions.plan.protocols.protocol import ENGLISH


class CardFrame(Panel):
    """Holds the fields of a card."""

    def __init__(self, name: str) -> None:
        super().__init__("", "card")
        self._name = name
        self._card: Card | None = None
        self._mark = label("○")
        self.message = WrappedLabel("quiet", keeps_room=True)
        self._fields = vbox(spacing=4)
        header = hbox(self._mark, (label(tr(name), "name", wrap=True), 1), spacing=GRID)
        vbox(header, self.message, self._fields, on=self, margins=GRID, spacing=4)

    def add(self, *fields: Part) -> None:
        fill(self._fields, *fields)

    def show_card(self, card: Card) -> None:
        """Show whether the card is ready, and its line; nothing is marked wrong before Start is pressed."""
        if card == self._card:
            return
        self._card = card
        set_text(self._mark, "✓" if card.ready else "○")
        self.message.show_text(card.text)
        regrade(self.message, "")
        state = tr("ready") if card.ready else tr("not ready")
        self.setAccessibleName(f"{tr(self._name)}: {state}. {card.text}".strip())

    def insist(self) -> None:
        """Mark the line as the reason why the session cannot begin."""
        regrade(self.message, "wrong")


_LOOK_AGAIN = 3000  # for sessions that were in use [ms]


class CutShort(Panel):
    """Lists the sessions that can be resumed; hidden if there are none."""

    _new_list = Signal(object)  # from a thread

    def __init__(self, send: Callable[[Message], None]) -> None:
        super().__init__("", "banner")
        self._items: tuple[UnfinishedSession, ...] = ()
        self._holders: dict[str, str] = {}
        self._send = send
        self.setProperty("grade", "look")
        self._sessions = choice(tr("sessions that were cut short"))
        self._description = label("", wrap=True)  # complete, even if the list is narrow
        self._sessions.currentTextChanged.connect(partial(set_text, self._description))
        name = tr("resume the session that was cut short")
        self.go_on = button(tr("Resume it"), name, lambda: send(ResumeSession(self._sessions.currentData())))
        heading = label(tr("▲ Sessions that were cut short"), wrap=True)
        fill(QVBoxLayout(self), heading, self._sessions, self._description, self.go_on)
        self._folder = Path()
        self._again = QTimer(self, singleShot=True, interval=_LOOK_AGAIN)
        self._again.timeout.connect(lambda: (page := self.parentWidget()) and page.isVisible() and self._look())
        self._new_list.connect(self.show_sessions, Qt.ConnectionType.QueuedConnection)
        self.show_sessions(())

    def look_in(self, folder: Path) -> None:
        """Search a folder for such sessions without blocking the window, again and again while one is in use."""
        self._folder = folder
        self._look()

    def _look(self) -> None:
        folder = self._folder

        def look() -> None:
            sessions = unfinished_sessions(folder)
            with suppress(RuntimeError):  # the page may be gone
                self._new_list.emit(sessions)

        threading.Thread(target=look, daemon=True).start()

    def show_sessions(self, sessions: tuple[UnfinishedSession, ...]) -> None:
        """Show the sessions that no recorder writes; one that is in use may be free soon, and its transducer too."""
        in_use = [session for session in sessions if session.in_use]
        if in_use:
            self._again.start()
        holders = {session.uri: session.description for session in in_use if session.uri}
        if holders != self._holders:
            self._holders = holders
            self._send(TransducerHolders(holders))
        sessions = tuple(session for session in sessions if not session.in_use)
        if sessions != self._items:
            self._items = sessions
            self._sessions.clear()
            for index, session in enumerate(sessions):
                self._sessions.addItem(session.description, str(session.folder))
                self._sessions.setItemData(index, str(session.folder), Qt.ItemDataRole.ToolTipRole)
        self._sessions.setVisible(len(sessions) > 1)
        self.setVisible(bool(sessions))


class TransducerRow(QWidget):
    """Two buttons and a few lines of text; `act` carries out the action of a button."""

    def __init__(self, act: Callable[[str], None]) -> None:
        super().__init__()
        self.connect_button = button(tr("Connect"), tr("connect the transducer"), lambda: act("connect"))
        self.zero = button(tr("Zero  T"), tr("measure the zero of the transducer"), lambda: act("tare"))
        self.summary = label("", "quiet", wrap=True)
        vbox(hbox((self.connect_button, 1), (self.zero, 1)), self.summary, on=self, spacing=GRID // 2)

    def show_view(self, view: BenchView) -> None:
        set_text(self.summary, bench_summary(view))
        show_connecting(self.connect_button, view)
        self.zero.setEnabled(view.can_tare)


class ScreenFields(QWidget):
    """Content of the card of the subject's screen, for a second screen or a tablet."""

    def __init__(self, act: Callable[[str], None], form: Callable[[], SessionForm]) -> None:
        """Show nothing yet; `act` carries out the action of a button, `form` is read after each change."""
        super().__init__()
        self._form = form
        self.status = ""  # the length of the line, and characters without a font
        self.problem = ""  # why the subject's page is not on a tablet, if it should be
        self._line_words = ""
        self._size = QSize(1000, 640)  # of the subject's window
        self.language = choice(tr("language that the subject reads"))
        self._wish = ENGLISH  # chosen language, kept even while a protocol lacks it
        self.thumbnail = Thumbnail()
        name = tr("check the subject's line with a ruler")
        self._ruler = button(tr("Check with a ruler  Ctrl+M"), name, lambda: act("ruler"))
        self.camera = QLabel()
        self.camera.setAccessibleName(tr("address and code for the tablet's camera"))
        self.camera.hide()
        self._new_code = button(tr("New code"), tr("let another tablet in, by a new code"), lambda: act("tablet"))
        self._new_code.hide()
        language = field(tr("Language that the subject reads"), self.language)
        vbox(language, self.thumbnail, self._ruler, self.camera, self._new_code, on=self, spacing=4)

    def show_line(self, scale: Millimetres, size: QSize) -> None:
        """Show the origin of the length of the subject's line; `size` is that of the subject's window."""
        self._size = size
        self._line_words = tr("Line of {length:.0f} mm, {words}.", length=LENGTH, words=scale.origin)
        self.show_form()

    def show_tablet(self, status: str, problem: str, picture: bytes) -> None:
        """Show how to reach the tablet, why no session can begin, and its address for a camera (PNG, or empty)."""
        self._line_words, self.problem = status, problem
        pixmap = QPixmap()
        pixmap.loadFromData(picture)
        self.camera.setPixmap(pixmap)
        self.camera.setVisible(bool(picture))
        self._ruler.hide()  # the tablet's page has its own
        self._new_code.show()
        self.show_form()

    def offer_languages(self) -> None:
        """Offer the languages of the form's protocol, and select the preferred one if it is among them."""
        codes, _ = subject_texts(self._form())
        if list(codes) != [self.language.itemData(index) for index in range(self.language.count())]:
            if self.language.findData(self._wish) >= 0:
                self._wish = self.language.currentData()
            self.language.clear()
            for code in codes:
                self.language.addItem(name_of(code), code)
            self.language.setCurrentIndex(max(self.language.findData(self._wish), 0))

    def show_form(self) -> None:
        """Show the page of the form, and name its characters without a font."""
        form = self._form()
        self.thumbnail.show_form(form, self._size)
        self.status = self._line_words
        if not self._new_code.isHidden():
            return  # the tablet has its own fonts
        _, texts = subject_texts(form)
        translate = translator(form.language or ENGLISH)
        if lost := missing_glyphs([*texts, *map(translate, SubjectText)], self.font()):
            self.status += " " + tr("No font here draws {lost}: install one that does.", lost=lost)
