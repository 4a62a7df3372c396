"""Placement of the subject's page: on a second screen, over the experimenter's window, or on a tablet."""

import io
import time
from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QLocale, QObject, Qt, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QMainWindow

from daq_app.qt.answer_fields import FULL, newest_force
from daq_app.qt.bridge import Bridge
from daq_app.qt.course_panel import CoursePanel
from daq_app.qt.keys import Keyboard
from daq_app.qt.preferences import USUAL_DPI, Millimetres, line_settings, millimetres
from daq_app.qt.subject_window import SubjectWindow
from daq_app.tablet.dialogue import AnswerGiven, Dialogue, Force, FromTablet, Hello, Ruler
from daq_app.tablet.server import TabletServer, own_address
from daq_app.window.course_state import SessionState
from daq_app.window.live_trace import LiveTrace
from daq_app.window.subject import LENGTH, SubjectView, translator
from daq_app.window.view import View
from daq_app.wording import tr
from sessions.recording import Setting

FORCE_EVERY = 0.05  # between two values of the bar [s]
_STEPS = 200  # distinguishable steps of the bar


class TabletScreen(QObject):
    """The subject's page on one tablet, through a local server."""

    answered = Signal(object)  # an event of `run.steps`
    changed = Signal()  # the tablet, its line or the code has changed
    _incoming = Signal(object, float)  # from the server's threads
    _moved = Signal()

    def __init__(self, address: str | None, port: int) -> None:
        """Serve the page at an address of this machine. Raises NoTabletServer."""
        super().__init__()
        self.session_offset = 0.0  # session clock minus this machine's monotonic one [s]
        self._pixels: float | None = None  # per millimetre, measured with a ruler
        self._fraction = 0.0
        self._last_sent = 0.0  # when the bar got its last value [s]
        self._incoming.connect(self._take, Qt.ConnectionType.QueuedConnection)
        self._moved.connect(self.changed, Qt.ConnectionType.QueuedConnection)
        self.server = TabletServer(address or own_address(), port, self._incoming.emit, self._moved.emit)
        self._dialogue = Dialogue(self.server.send)

    @property
    def status(self) -> str:
        url = self.server.url
        if not self.server.code_is_used:
            return tr("Open {url} on the tablet, and type the code {code}.", url=url, code=self.server.code)
        if not self.server.connected:
            return tr("The tablet has disconnected. Open {url} on it again; “New code” admits another.", url=url)
        state = tr("checked") if self._pixels else tr("not checked")
        line = tr("Line of {length:.0f} mm, {checked} with a ruler.", length=LENGTH, checked=state)
        return f"{tr('The tablet shows the page.')} {line}"

    def picture(self) -> bytes:
        """Return the address with the code as a QR code (PNG); empty once the code is used."""
        if self.server.code_is_used:
            return b""
        import segno  # an optional package, already checked by the server

        png = io.BytesIO()
        segno.make(self.server.link, micro=False).save(png, kind="png", scale=4, border=4)
        return png.getvalue()

    @property
    def problem(self) -> str:
        """Return why no session can begin; empty if one can."""
        return "" if self.server.connected else self.status

    def show_view(self, view: SubjectView, session: SessionState | None) -> None:
        mirrored = QLocale(view.language).textDirection() == Qt.LayoutDirection.RightToLeft
        self._dialogue.show(view, session, translator(view.language), mirrored=mirrored)

    def show_force(self, trace: LiveTrace) -> None:
        fraction, now = min(max(newest_force(trace) / FULL, 0.0), 1.0), time.monotonic()
        if now - self._last_sent >= FORCE_EVERY and round(fraction * _STEPS) != round(self._fraction * _STEPS):
            self._fraction, self._last_sent = fraction, now
            self.server.send(Force(fraction))

    def line_settings(self) -> tuple[Setting, ...]:
        """Return the settings that a session stores about the answer line."""
        scale = Millimetres(self._pixels or USUAL_DPI / 25.4, self._pixels is not None)
        return (Setting("subject's screen", "web", "", "set"), *line_settings(scale))

    def _take(self, message: FromTablet, arrival: float) -> None:
        match message:
            case Hello(pixels_per_mm=pixels) | Ruler(pixels):
                self._pixels = pixels
                self.changed.emit()
            case AnswerGiven():
                event = self._dialogue.take(message, partial(self._session_time, message.sent, arrival))
                if event is not None:
                    self.answered.emit(event)

    def _session_time(self, sent: float, arrival: float, tablet_time: float) -> float:
        """Convert a time of the tablet's clock [ms] to the session's [s], counted back from the answer's arrival."""
        return arrival + self.session_offset - max(sent - tablet_time, 0.0) * 1e-3


class SubjectSide(QObject):
    """Shows the page and gives it the keyboard when an answer is due, and takes both back afterwards."""

    line_changed = Signal()  # the screen, a measured length or the tablet has changed

    def __init__(
        self,
        window: QMainWindow,
        bridge: Bridge,
        subject: SubjectWindow,
        tablet: TabletScreen | None,
        course: CoursePanel,
        act: Callable[[str], None],
    ) -> None:
        """Follow the subject's window, and a `tablet` if one is used; `act` carries out the action of a key."""
        super().__init__(window)
        self._window, self._bridge, self._mirror = window, bridge, course.mirror
        self._subject, self._tablet = subject, tablet
        self.keyboard = Keyboard(window, course.plan, subject, act, self._answered_by_keys)
        self.keyboard.free.connect(self._bring)
        subject.answered.connect(bridge.send)
        subject.answered.connect(self._let_go)
        subject.ruler.finished.connect(lambda: subject.scoring or self.come_back())
        subject.screen_changed.connect(self.line_changed)
        application = QGuiApplication.instance()
        assert isinstance(application, QGuiApplication)
        for screens_changed in (application.screenAdded, application.screenRemoved):
            screens_changed.connect(self._follow_screens, Qt.ConnectionType.QueuedConnection)  # after window moves
        if tablet is not None:
            tablet.answered.connect(bridge.send)
            tablet.changed.connect(self.line_changed)

    def show(self) -> None:
        """Show the subject's window, and move the keyboard to it even from a text being typed."""
        if self.keyboard.focused_field() is not None:
            self._window.setFocus()
        self._show_subject(activating=True)
        self.show_view(self._bridge.view)  # a hidden window may be out of date
        self._subject.raise_()
        self._subject.activateWindow()

    def begin(self) -> None:
        """Show the page on a second screen from the first step on, without moving the keyboard."""
        if self._tablet is None and self._with_people():
            self._show_subject(activating=False)

    def show_view(self, view: View) -> None:
        """Update the subject's page and its mirror; show the page for an answer that is due."""
        session, subject = self._bridge.state.session, self._subject
        self._mirror.show_view(view.mirror, subject.size())
        if self._tablet is not None:
            self._tablet.session_offset = self._bridge.session_offset
            self._tablet.show_view(view.subject, session)
            if not subject.isVisible():
                return  # keys of this computer are not answers
        was_scoring = subject.scoring
        subject.show_view(view.subject, None if session is None else session.plan.answering_hand)
        if not was_scoring:
            self._bring()
        elif not subject.scoring:  # the question was withdrawn
            self._let_go()

    def show_force(self) -> None:
        trace = self._bridge.feed.trace
        if self._tablet is not None and self._bridge.view.subject.force:
            self._tablet.show_force(trace)
        if self._subject.press.isVisible():
            self._subject.press.show_force(trace)

    def line_settings(self) -> tuple[Setting, ...]:
        tablet, screen = self._tablet, self._subject.screen()
        return line_settings(millimetres(screen)) if tablet is None else tablet.line_settings()

    def come_back(self) -> None:
        """Return the keyboard to the experimenter's window, and clear its screen."""
        self._clear_screen()
        self._window.activateWindow()

    def _follow_screens(self) -> None:
        if not self._subject.scoring and not self._subject.measuring:
            self._clear_screen()

    def _clear_screen(self) -> None:
        """Move the page from the experimenter's screen to a second one, if there is one."""
        if self._subject.screen() is self._window.screen():
            self._subject.hide()
            self.begin()
            self._window.raise_()

    def _show_subject(self, *, activating: bool) -> None:
        subject, own_screen = self._subject, self._window.screen()
        elsewhere = [screen for screen in QGuiApplication.screens() if screen is not own_screen]
        subject.setAttribute(Qt.WidgetAttribute.WA_ShowWithoutActivating, not activating)
        if elsewhere and not subject.isVisible():
            subject.setGeometry(elsewhere[0].availableGeometry())
            subject.setWindowState(Qt.WindowState.WindowFullScreen)  # showFullScreen would take the keyboard
        elif not elsewhere and activating and subject.scoring:
            subject.setGeometry(self._window.geometry())
        if elsewhere or activating:
            subject.show()

    def _bring(self) -> None:
        """Show the subject's window for an answer that is due, with the keyboard unless somebody is typing."""
        if not self._subject.scoring or not self._with_people():
            return
        active = QGuiApplication.applicationState() == Qt.ApplicationState.ApplicationActive
        if active and self.keyboard.focused_field() is None:
            self.show()
        else:
            self._show_subject(activating=False)

    def _with_people(self) -> bool:
        session = self._bridge.state.session
        return session is not None and session.people != "simulated people"

    def _answered_by_keys(self) -> bool:
        return self._with_people() and (self._tablet is None or self._subject.isVisible())

    def _let_go(self) -> None:
        """Return the keyboard when no answer is due, unless another window has it."""
        field = self.keyboard.focused_field()
        if field is None or field.window() is self._window:
            self.come_back()
