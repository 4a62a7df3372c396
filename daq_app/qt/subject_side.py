"""The subject's page where it is: on a second screen, over the experimenter's window for an answer, or on a tablet."""

from collections.abc import Callable

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QMainWindow

from daq_app.qt.bridge import Bridge
from daq_app.qt.course_panel import CoursePanel
from daq_app.qt.keys import Keyboard
from daq_app.qt.screens import line_settings
from daq_app.qt.subject_window import SubjectWindow
from daq_app.qt.tablet_screen import TabletScreen
from daq_app.window.messages import Message
from daq_app.window.view import View
from sessions.recording import Setting


class SubjectSide(QObject):
    """Brings the page, and the keyboard with it, when an answer is due, and lets both go when it is given."""

    line_changed = Signal()  # another screen, a ruler, or a tablet that came, went or was measured

    def __init__(
        self,
        window: QMainWindow,
        bridge: Bridge,
        subject: SubjectWindow,
        tablet: TabletScreen | None,
        course: CoursePanel,
        act: Callable[[str], None],
    ) -> None:
        """Follow the subject's window, and a `tablet` where the subject answers there; `act` does what a key is for."""
        super().__init__(window)
        self._window, self._bridge, self._mirror = window, bridge, course.mirror
        self._subject, self._tablet = subject, tablet
        self.keyboard = Keyboard(window, course.plan, subject, act)
        self.keyboard.free.connect(self._bring)
        subject.answered.connect(self._answered)
        subject.screen_changed.connect(self.line_changed)
        if tablet is not None:
            tablet.answered.connect(bridge.send)
            tablet.changed.connect(self.line_changed)

    def show(self) -> None:
        """Show the subject's window, and let the keyboard go to it from whatever is being typed."""
        if self.keyboard.typed_in() is not None:
            self._window.setFocus()
        self._place(activating=True)
        self.show_view(self._bridge.view)  # which a window that is hidden need not have
        self._subject.raise_()
        self._subject.activateWindow()

    def show_view(self, view: View) -> None:
        """Show what the subject sees now, small in the mirror too; bring the page for an answer that is due."""
        session, subject = self._bridge.state.session, self._subject
        self._mirror.show_view(view.mirror, subject.size())
        if self._tablet is not None:
            self._tablet.session_offset = self._bridge.session_offset
            self._tablet.show_view(view.subject, session)
            if not subject.isVisible():
                return  # no key here is an answer
        was_scoring = subject.scoring
        subject.show_view(view.subject, None if session is None else session.plan.answering_hand)
        if not was_scoring:
            self._bring()

    def show_force(self) -> None:
        """Show how hard is pressed, where the subject is to see it."""
        trace = self._bridge.feed.trace
        if self._tablet is not None and self._bridge.view.subject.force:
            self._tablet.show_force(trace)
        if self._subject.press.isVisible():
            self._subject.press.show_force(trace)

    def line_settings(self) -> tuple[Setting, ...]:
        """Return what a recording says of the subject's line."""
        return line_settings(self._subject.screen()) if self._tablet is None else self._tablet.line_settings()

    def come_back(self) -> None:
        """Let the keyboard come back to the experimenter's window, which is in front where it shares a screen."""
        if len(QGuiApplication.screens()) == 1:
            self._subject.hide()
            self._window.raise_()
        self._window.activateWindow()

    def _place(self, *, activating: bool) -> None:
        """Show the subject's window: on a second screen where there is one."""
        subject, here = self._subject, self._window.screen()
        elsewhere = [screen for screen in QGuiApplication.screens() if screen is not here]
        subject.setAttribute(Qt.WidgetAttribute.WA_ShowWithoutActivating, not activating)
        if elsewhere and not subject.isVisible():
            subject.setGeometry(elsewhere[0].availableGeometry())
            subject.setWindowState(Qt.WindowState.WindowFullScreen)  # not showFullScreen: that takes the keyboard
        elif not elsewhere and activating and subject.scoring:
            subject.setGeometry(self._window.geometry())
        if elsewhere or activating:
            subject.show()

    def _bring(self) -> None:
        """Bring the subject's window for an answer that is due, and the keyboard unless somebody is typing."""
        session = self._bridge.state.session
        if not self._subject.scoring or session is None or session.people == "simulated people":
            return
        active = QGuiApplication.applicationState() == Qt.ApplicationState.ApplicationActive
        if active and self.keyboard.typed_in() is None:
            self.show()
        else:
            self._place(activating=False)

    def _answered(self, event: Message) -> None:
        self._bridge.send(event)
        field = self.keyboard.typed_in()
        if field is None or field.window() is self._window:
            self.come_back()
