"""The real window on a screen in memory, with the real recorder behind it, whose clock runs fast."""

import gc
import os
import time
from pathlib import Path

import pytest

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from examples import short_protocol
from PySide6.QtCore import QEvent, QSettings, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from daq_app.qt.preferences import SCALE, settings, type_scale
from daq_app.qt.start import collect_between_events, open_window
from daq_app.qt.subject_window import SubjectWindow
from daq_app.qt.tokens import LIGHT, style_sheet
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import Stop
from daq_app.window.live_model_process import LiveModel
from daq_app.window.state import Dismissed, NewSession
from sessions.recording import Recording
from sessions.run import steps

PACE = 20.0  # simulated seconds in a real one
RATE = 100.0  # of readings, by the simulated clock [Hz]: enough for a stroke, and a fifth of it for a bench at rest
FRAME = 50  # between two looks of the window at the recorder [ms]: drawing 60 pictures a second would take half a core
PATIENCE = 60.0  # far beyond what anything takes [s]


# Three of the ten surfaces of sensotact-friction: enough for a session from its first trial to its last.
THREE = short_protocol("three", "Three surfaces", [0, 100], [100])


class Driver:
    """Drives a window as a person does, and waits for what must come."""

    def __init__(self, application, window):
        self.application = application
        self.window = window

    @property
    def state(self):
        return self.window.bridge.state

    @property
    def session(self):
        return self.state.session

    @property
    def view(self):
        return self.window.bridge.view

    def until(self, condition, what="it"):
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, f"{what} did not come: {self.state.failure}, {self.view.banner}"
            self.application.processEvents()
            time.sleep(0.005)

    def phase(self, *phases):
        self.until(lambda: self.session is not None and self.session.phase in phases, f"{phases}")

    def sealed(self):
        """Return the recording of the session, once it is sealed."""
        self.until(lambda: self.session is not None and self.session.sealing == "sealed", "the sealed session")
        return Recording.open(Path(self.session.folder))

    def abort(self):
        """End the session early, and return its recording."""
        self.window.bridge.send(steps.Abort("enough"))
        return self.sealed()

    def begin(self, subject="P07", *, scores_only=False):
        """Begin a session by keyboard, up to its first stimulus."""
        page = self.window.page
        if scores_only:
            page.scores_only.setChecked(True)
        QTest.keyClicks(page.subject, subject)
        QTest.keyClick(page.subject, Qt.Key.Key_Return)
        self.phase("idle")
        self.go_on("mounting")

    def go_on(self, *phases):
        """Press Space, and wait for a phase."""
        QTest.keyClick(self.window, Qt.Key.Key_Space)
        self.phase(*phases)

    def answer(self, *keys, on=None):
        """Give an answer by keys on the line or another widget, and wait for the next trial."""
        number = self.session.trial
        for key in (*keys, Qt.Key.Key_Return):
            QTest.keyClick(on or self.window.subject.line, key)
        self.until(lambda: self.session.phase == "closing" or self.session.trial != number, "the next trial")


@pytest.fixture(scope="session")
def application(tmp_path_factory):
    QSettings.setDefaultFormat(QSettings.Format.IniFormat)
    QSettings.setPath(QSettings.Format.IniFormat, QSettings.Scope.UserScope, str(tmp_path_factory.mktemp("settings")))
    application = QApplication.instance() or QApplication([])
    application.setDoubleClickInterval(0)  # a test presses as soon as a step is there
    return application


@pytest.fixture(scope="module", autouse=True)
def no_window_stays(application):
    """Collect as the program does, and delete every window after its file: one that stays is styled with the next."""
    timer = collect_between_events(application)
    yield
    timer.stop()
    for widget in application.topLevelWidgets():
        if type(widget).__module__.startswith("daq_app.") and widget.parent() is None:
            widget.deleteLater()
    application.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    application.setStyleSheet("")  # as before a first window
    gc.unfreeze()  # an opening window keeps all there is from collection
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.fixture
def type_size():
    """Return what chooses a size of type; the usual one comes back."""

    def choose_scale(scale):
        settings().setValue(SCALE, str(scale))
        type_scale.cache_clear()

    yield choose_scale
    choose_scale(None)


@pytest.fixture
def subject_page(application, type_size):
    """Return a function that shows a view in a window for the subject, in the program's own style."""
    windows = []

    def show_page(view, scale=1.0, direction=Qt.LayoutDirection.LeftToRight):
        type_size(scale)
        window = SubjectWindow(lambda: 0.0)
        windows.append(window)
        window.setStyleSheet(style_sheet(LIGHT))
        window.setLayoutDirection(direction)
        window.resize(1366, 768)
        window.show()
        window.show_view(view, "right")
        for _ in range(3):
            application.processEvents()
        return window

    yield show_page
    for window in windows:
        window.hide()
        window.deleteLater()


@pytest.fixture(scope="module")
def one_window(application, request):
    """One window for all tests of a file: a session that is over leaves it as it was.

    A file without a session sets its own PACE of 1: readings that come 20 times as fast keep a core a third busy.

    Its live model does not start by itself, for with time running so fast it would keep a core busy all along.
    """
    settings().clear()  # what the window of another file remembers
    pace = getattr(request.module, "PACE", PACE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LiveModel, "prepare", lambda _: None)
        patch.setattr("daq_app.qt.bridge._FRAME", FRAME)
        patch.setattr("daq_app.qt.start.SIMULATED_BENCH", f"sim:?rate={RATE if pace > 1.0 else RATE / 5.0:g}")
        window = open_window(application, lambda: Recorder.start(pace=pace))
    window.resize(1440, 900)
    window.show()
    yield window
    window.bridge.end()


@pytest.fixture
def driver(application, one_window, tmp_path):
    driver = Driver(application, one_window)
    driver.until(lambda: driver.state.bench.link == "open", "the simulated bench")
    one_window.page.folder.setText(str(tmp_path / "recordings"))
    (tmp_path / "three.toml").write_text(THREE)
    one_window.page.add_protocol(str(tmp_path / "three.toml"))
    one_window.page.practice.setChecked(False)
    one_window.page.with_forces.setChecked(True)
    one_window.page.people_score.setChecked(True)
    one_window.page.subject.clear()
    one_window.page.study.clear()
    one_window.notice.warn("")
    one_window.page.subject.setFocus()
    yield driver
    one_window.resize(1440, 900)
    if driver.session is not None:
        if not driver.session.is_over:
            one_window.bridge.send(Stop())
        driver.sealed()
        one_window.bridge.send(NewSession())
    one_window.bridge.send(Dismissed())
    application.sendPostedEvents(None, QEvent.Type.DeferredDelete)  # a loop that only processes events leaves these
