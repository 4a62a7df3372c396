"""Brings each key to whom it is meant for, whichever of the session's two windows has the keyboard."""

from collections.abc import Callable

from PySide6.QtCore import QElapsedTimer, QEvent, QObject, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QMainWindow, QWidget

from daq_app.qt.keys import act_of, name_of
from daq_app.qt.parts import is_text_field
from daq_app.qt.subject_window import SubjectWindow
from daq_app.window.key_owner import owner


class Keyboard(QObject):
    """The keys of the experimenter's and the subject's window."""

    free = Signal()  # it is no longer a text's, or another program's

    def __init__(self, window: QMainWindow, plan: QWidget, subject: SubjectWindow, act: Callable[[str], None]) -> None:
        """Watch the subject's window and the experimenter's plan; `act` does what a key of the course stands for."""
        super().__init__(window)
        self._window = window
        self._plan = plan
        self._subject = subject
        self._act = act
        self._since_answer = QElapsedTimer()
        for watched in (plan, subject, *subject.findChildren(QWidget)):
            watched.installEventFilter(self)
        subject.answered.connect(self._since_answer.start)
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.focusChanged.connect(self._focus_changed)
        application.applicationStateChanged.connect(self._state_changed)

    def typed_in(self) -> QWidget | None:
        """Return the text that the experimenter types in; None where there is none."""
        field: QWidget | None = QApplication.focusWidget()
        if field is None or field.window() is self._subject:
            field = self._window.focusWidget()
        return field if is_text_field(field) and field.isVisible() else None

    def press(self, event: QKeyEvent) -> bool:
        """Take a key that no field took; return whether it meant anything."""
        match owner(name_of(event), self._subject.asks, typing=self.typed_in() is not None):
            case "answer":
                self._subject.take_key(event)
                return True
            case "course":
                act = act_of(event)
                if act is None or event.isAutoRepeat() or self._pressed_twice(event):
                    return False
                self._act(act)
                return True
            case "text":
                return False

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802  Qt's name
        """Give the keys of the plan and of the subject's window to whom they are meant for."""
        if event.type() != QEvent.Type.KeyPress or not isinstance(event, QKeyEvent) or self._subject.measuring:
            return False
        field, key = self.typed_in(), name_of(event)
        whose = owner(key, self._subject.asks, typing=field is not None, from_subject=watched is not self._plan)
        if watched is self._plan:  # a list would search for letters
            return (whose == "answer" or act_of(event) is not None) and self.press(event)
        if whose == "text" and field is not None:
            self._window.activateWindow()
            QApplication.sendEvent(field, event)
            return True
        return watched is self._subject and whose == "course" and self.press(event)

    def _pressed_twice(self, event: QKeyEvent) -> bool:
        """Say whether a key is the second press of the one that gave the answer, as the system counts presses."""
        soon = self._since_answer.isValid() and self._since_answer.elapsed() < QApplication.doubleClickInterval()
        return soon and event.key() == self._subject.given_with

    def _focus_changed(self, old: QWidget | None, new: QWidget | None) -> None:
        if new is not None and new.window() is self._window and is_text_field(old) and self.typed_in() is None:
            self.free.emit()

    def _state_changed(self, state: Qt.ApplicationState) -> None:
        if state == Qt.ApplicationState.ApplicationActive and self.typed_in() is None:
            self.free.emit()
