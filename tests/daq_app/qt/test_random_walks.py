"""Random keys, clicks and faults in the real window: wherever they lead, there is a way on or a sentence why not.

The quick run takes forty steps, and `make test-long` ten walks of two hundred.
WALKS=2000 in the environment asks for so many long walks, each begun anew, in place of ten.
"""

import os
import random
import signal
import time
from contextlib import suppress

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QFileDialog, QLineEdit, QMessageBox

from daq_app.qt.rooms import ReviewRoom
from daq_app.recorder.messages import Connect, Disconnect
from daq_app.window.state import NewSession

pytestmark = pytest.mark.qt

NONE, CONTROL, LEFT = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ControlModifier, Qt.MouseButton.LeftButton
KEY = Qt.Key
COURSE = [KEY.Key_Space] * 8 + [KEY.Key_R, KEY.Key_S, KEY.Key_P, KEY.Key_N, KEY.Key_0, KEY.Key_I, KEY.Key_D]
COURSE += [KEY.Key_Escape] * 3 + [KEY.Key_F1, KEY.Key_F2, KEY.Key_F3, KEY.Key_F4, KEY.Key_F5, KEY.Key_F6, KEY.Key_Tab]
COURSE += [KEY.Key_H, KEY.Key_Plus, KEY.Key_Minus, KEY.Key_B, KEY.Key_A, KEY.Key_T, KEY.Key_Return]
WITH_CONTROL = [KEY.Key_E, KEY.Key_N, KEY.Key_M, KEY.Key_Z]
ANSWER = [KEY.Key_Left, KEY.Key_Right, KEY.Key_Home, KEY.Key_Return, KEY.Key_Return, KEY.Key_Space, KEY.Key_1]
BY_ITSELF = {"taring", "ready", "stroking", "settling", "resuming"}  # phases that end without anybody
LONGEST = 60.0  # that such a phase may last on a busy machine [s]


class Walk:
    """A person who presses anything, with a bench and a recorder that fail now and then."""

    def __init__(self, driver, seed, files):
        self.driver, self.window, self.seed = driver, driver.window, seed
        self.random = random.Random(seed)
        self.wrong, self.right = files
        self.steps = []
        acts = ((self.course_key, 10), (self.answer_key, 6), (self.click, 6), (self.type, 3), (self.held_key, 1))
        acts += ((self.tile, 2), (self.resize, 1), (self.spoil_form, 1), (self.fault, 1), (self.good_form, 2))
        self._acts, self._weights = zip(*acts, strict=True)

    def step(self):
        act = self.random.choices(self._acts, self._weights)[0]
        self.steps.append(f"{act.__name__} {act() or ''}".strip())
        end = time.monotonic() + self.random.choice((0.0, 0.0, 0.02, 0.15))
        while True:
            self.driver.application.processEvents()
            if time.monotonic() >= end:
                break
            time.sleep(0.002)
        why = self.dead_end()
        assert not why, f"seed {self.seed}, after {self.steps[-12:]}: {why}"

    # ---- what is done

    def course_key(self):
        key = self.random.choice(COURSE)
        QTest.keyClick(self.window.focusWidget() or self.window, key)
        return key.name

    def held_key(self):
        key = self.random.choice(WITH_CONTROL)
        QTest.keyClick(self.window, key, CONTROL)
        return key.name

    def answer_key(self):
        subject = self.window.subject
        key = self.random.choice(ANSWER)
        if subject.asks == "line" and self.random.random() < 0.3:
            place = subject.line.point_at(100.0 * self.random.random())
            QTest.mouseClick(subject.line, LEFT, pos=QPointF(place).toPoint())
            return "line"
        QTest.keyClick(subject.line if subject.asks == "line" else subject, key)
        return key.name

    def click(self):
        places = (self.window, self.window.subject)
        buttons = [
            b for place in places for b in place.findChildren(QAbstractButton) if b.isVisible() and b.isEnabled()
        ]
        if not buttons:
            return ""
        button = self.random.choice(buttons)
        QTest.mouseClick(button, LEFT, pos=QPoint(button.width() // 2, button.height() // 2))
        return button.accessibleName() or button.text()

    def tile(self):
        tiles = self.window.middle.strip.tiles
        if tiles and self.window.middle.strip.isVisible():
            QTest.mouseClick(self.random.choice(tiles), LEFT)

    def type(self):
        field = self.window.focusWidget()
        if isinstance(field, QLineEdit) and field is not self.window.page.folder:
            QTest.keyClicks(field, self.random.choice(("P07", "a slip", "12", "stop")))
            QTest.keyClick(field, self.random.choice((KEY.Key_Return, KEY.Key_Escape)))

    def resize(self):
        size = self.random.choice(((1366, 768), (1440, 900), (1000, 700), (1920, 1080)))
        self.window.resize(*size)
        return str(size)

    def spoil_form(self):
        page = self.window.page
        if self.driver.session is not None:
            return ""
        return self.random.choice(
            (
                lambda: page.seed.setText("many"),
                lambda: page.folder.setText("/dev/null/nowhere"),
                lambda: page.study.setText("a/b"),
                lambda: page.add_protocol(self.wrong),
                lambda: page.subject.setText("Ada Lovelace"),
            )
        )()

    def good_form(self):
        page = self.window.page
        if self.driver.session is None:
            page.seed.clear()
            page.study.clear()
            page.area.clear()
            page.height_above.clear()
            page.folder.setText(self.right)
            name = self.random.choice(("three", "three", "magnitude-estimation", "paired-comparison"))
            if name == "three":
                page.add_protocol(f"{self.right}/three.toml")
            else:
                page.protocol.setCurrentText(name)
            (page.with_forces if self.random.random() < 0.8 else page.scores_only).setChecked(True)
            page.subject.setText(f"P{self.random.randrange(100)}")

    def fault(self):
        bridge = self.window.bridge
        what = self.random.choice(("killed", "unplugged", "plugged", "wrong address"))
        if what == "killed" and self.driver.state.exit_reason is None:
            with suppress(ProcessLookupError):  # killed a moment ago, and the window has not heard of it
                os.kill(bridge._client.pid, signal.SIGKILL)
        elif what == "unplugged":
            bridge.send(Disconnect())
        elif what == "plugged":
            self.plug()
        else:
            bridge.send(Connect("net-ft://127.0.0.1?http=9"))
        return what

    def plug(self):
        """Connect the simulated bench where nothing is connected or being connected, in place of any other."""
        bench = self.driver.state.bench
        if bench.link == "none":
            self.window.bridge.send(Connect("sim:?rate=100"))
        elif bench.link == "open" and not bench.info.simulated:
            self.window.bridge.send(Disconnect())

    def is_free(self):
        """Return whether the simulated bench is connected and no session is in hand."""
        bench = self.driver.state.bench
        return self.driver.session is None and bench.link == "open" and bench.info.simulated

    # ---- what must hold

    def dead_end(self):
        """Return why nothing can be done and nothing says so; empty where there is a way on."""
        window = self.window
        if QApplication.activeModalWidget() is not None:
            return "a dialog stands in the way"
        if not any(button.isEnabled() and button.isVisible() for button in window.rail.buttons.values()):
            return "no room can be entered"
        if window.rooms.room == "review":
            return (
                "" if window.rail.buttons["prepare"].isEnabled() or window.rail.buttons["run"].isEnabled() else "Review"
            )
        to_do = window.to_do
        if not to_do.sentence.isVisible() or not to_do.sentence.text().strip():
            return "no sentence says what to do"
        if self.driver.state.drawing_error is not None:
            return f"an error in the window: {self.driver.state.drawing_error}"
        if to_do.primary.isVisible() and to_do.primary.isEnabled():
            return ""
        session = self.driver.session
        if session is None:
            not_ready = [frame for frame in window.page.frames.values() if "not ready" in frame.accessibleName()]
            reasons = [
                frame for frame in not_ready if frame.message.isVisibleTo(frame) and frame.message.text().strip()
            ]
            return "" if not_ready and reasons == not_ready else "Start is not lit, and no card says why"
        if window.subject.scoring:
            answer = window.course.buttons["no answer"].isEnabled()
            return "" if answer or window.course.asking else "an answer is due, and cannot be given or left out"
        acts = (window.course.buttons["skip"], window.course.buttons["pause"], window.course.buttons["end"])
        if session.phase in BY_ITSELF or any(button.isEnabled() for button in acts):
            return ""
        return (
            "" if to_do.sentence.text().startswith(("Wait", "The session is being")) else f"{session.phase}: no way on"
        )

    def goes_on(self):
        """Do what the window says until a session that is in hand is over and another could begin."""
        window, driver = self.window, self.driver
        QTest.keyClick(window, KEY.Key_Escape)
        if window.course.asking:
            window.course.leave()
        window.setFocus()
        window.act("go to run" if driver.session is not None else "go to prepare")
        deadline = time.monotonic() + 3 * LONGEST
        while not self.is_free():  # a session that was asked for may begin meanwhile
            session = driver.session
            what = f"{session and session.phase}, {window.to_do.sentence.text()!r}, {driver.view.banner}"
            assert time.monotonic() < deadline, f"seed {self.seed}, after {self.steps[-12:]}: {what}"
            if session is None:
                self.plug()
            elif session.is_over:
                if session.end is not None and session.sealing == "running":
                    driver.until(lambda: driver.session.sealing != "running", "the seal")
                window.bridge.send(NewSession())
            elif window.course.buttons["end"].isEnabled() and not window.course.asking:
                QTest.keyClick(window, KEY.Key_E, CONTROL)
                QTest.keyClicks(window.course.line, "enough")
                QTest.keyClick(window.course.line, KEY.Key_Return)
            driver.application.processEvents()
            time.sleep(0.01)
        self.good_form()
        window.page.with_forces.setChecked(True)
        driver.until(window.to_do.primary.isEnabled, "Start")


@pytest.fixture
def files(tmp_path, monkeypatch, driver):  # noqa: ARG001  the driver writes the protocol there
    """Return a protocol that cannot be read and a folder that can be used; nothing opens a dialog or a browser."""
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("name = ")
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "three.toml").write_text((tmp_path / "three.toml").read_text())
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_, **__: ("", ""))
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_, **__: "")
    monkeypatch.setattr(QMessageBox, "about", lambda *_: None)
    monkeypatch.setattr(ReviewRoom, "open", lambda *_: None)  # what is looked at there has tests of its own
    return str(wrong), str(tmp_path / "recordings")


def walk_randomly(driver, seed, files, steps):
    walk = Walk(driver, seed, files)
    walk.good_form()
    for _ in range(steps):
        walk.step()
    walk.goes_on()


def test_a_walk_notices_a_start_that_is_dark_without_a_reason_and_a_dialog_in_the_way(driver, files):
    walk = Walk(driver, 0, files)
    assert walk.dead_end() == ""  # the card says that the subject's code is missing
    words = driver.window.page.frames["Subject"].message
    sentence = words.text()
    words.setText("")
    assert "no card says why" in walk.dead_end()
    words.setText(sentence)
    box = QMessageBox(driver.window)
    box.setModal(True)
    box.show()
    assert "dialog" in walk.dead_end()
    box.hide()
    box.deleteLater()
    assert walk.dead_end() == ""


def test_forty_random_steps_lead_into_no_dead_end(driver, files):
    walk_randomly(driver, 1, files, 40)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 2 + int(os.environ.get("WALKS", "10"))))
def test_long_walks_of_random_steps_lead_into_no_dead_end(driver, files, seed):
    walk_randomly(driver, seed, files, 200)
