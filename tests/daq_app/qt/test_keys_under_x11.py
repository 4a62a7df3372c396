"""Whose a key is, with real keys and a real mouse under a window manager, on one screen and on two."""

import shutil
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from x11_desk import Desk, events, kinds, server, until

pytestmark = [
    pytest.mark.qt,
    pytest.mark.slow,
    pytest.mark.skipif(
        not all(map(shutil.which, ("Xvfb", "xdotool", "xrandr", "openbox"))),
        reason="needs the system packages xvfb, xdotool, x11-xserver-utils and openbox",
    ),
]

HEIGHT = 900
DESK, TABLET = 1400, 1000  # widths of the experimenter's and the subject's screen [pixels]
WINDOW, SUBJECT = "daq-app", "daq-app · subject"


def xrandr(desk, *words):
    subprocess.run(["xrandr", *words], env=desk.environment, check=True, capture_output=True)


def plug_in(desk, number, width, offset):
    monitor = f"{width}/{width // 4}x{HEIGHT}/{HEIGHT // 4}+{offset}+0"
    xrandr(desk, "--setmonitor", f"screen{number}", monitor, "none" if number else "screen")


@contextmanager
def desk_of(screens):
    with server(sum(screens), HEIGHT) as display:
        desk = Desk(display)
        offset = 0
        for at, width in enumerate(screens):
            plug_in(desk, at, width, offset)
            offset += width
        manager = subprocess.Popen(["openbox", "--sm-disable"], env=desk.environment, stderr=subprocess.DEVNULL)
        try:
            yield desk
        finally:
            manager.terminate()
            manager.wait()


OTHER = """
from PySide6.QtWidgets import QApplication, QLineEdit
application = QApplication([])
line = QLineEdit()
line.setWindowTitle("another program")
line.textChanged.connect(lambda text: print(text, flush=True))
line.show()
application.exec()
"""


def count(folder, kind, number):
    until(lambda: kinds(folder).count(kind) >= number, f"{kind} {number}")


def begin(desk, folder):
    desk.window("^daq-app$")
    until(lambda: desk.active() == WINDOW, "the keyboard")
    time.sleep(1.0)
    desk.do("type", "P07")

    def has_begun():
        desk.press("Return")  # until the simulated bench is connected this only says what is missing
        time.sleep(1.0)
        return "started" in kinds(folder)

    until(has_begun, "the session")
    desk.press("space")
    mount_asked(folder, 1)


def mount_asked(folder, number):
    """Wait until a stimulus is asked for, and until the sentence that says so can have been read."""
    count(folder, "mount_asked", number)
    time.sleep(1.5)


def answer_by_keys(desk, folder, number):
    """Answer with the keyboard as it is: nobody touches the mouse."""
    count(folder, "score_asked", number)
    until(lambda: desk.active() == SUBJECT, "the subject's window")
    desk.press("Right", "Return")
    count(folder, "scored", number)
    mount_asked(folder, number + 1)


@pytest.mark.parametrize("screens", [(1600,), (DESK, TABLET)])
def test_one_keyboard_runs_trial_after_trial_without_the_mouse_and_a_note_keeps_every_key_typed(tmp_path, screens):
    folder = tmp_path / "recordings"
    with desk_of(screens) as desk, desk.program(tmp_path):
        begin(desk, folder)
        desk.press("space")
        answer_by_keys(desk, folder, 1)
        desk.press("space")  # without the mouse: the next trial
        count(folder, "take_started", 2)
        desk.press("n")
        desk.do("type", "loud ")
        count(folder, "score_asked", 2)  # meanwhile the hand has stroked and an answer is due
        time.sleep(1.0)
        desk.do("type", "12")
        assert desk.active() == WINDOW
        desk.press("Return")
        count(folder, "note", 1)
        answer_by_keys(desk, folder, 2)
        log = events(folder)
        assert [event.data["text"] for event in log if event.kind == "note"] == ["loud 12"]
        assert [event.data["score"] for event in log if event.kind == "scored"] == [50.0, 50.0]


def test_keys_of_the_course_work_on_the_subjects_window_and_a_click_there_takes_no_key_from_a_note(tmp_path):
    folder = tmp_path / "recordings"
    with desk_of((DESK, TABLET)) as desk, desk.program(tmp_path):
        begin(desk, folder)
        desk.press("F6")
        until(lambda: desk.active() == SUBJECT, "the subject's window")
        desk.press("space")
        count(folder, "score_asked", 1)
        desk.press("n")  # on the subject's window, which has the keyboard
        until(lambda: desk.active() == WINDOW, "the note")
        desk.do("type", "a")
        x, y, width, height = desk.box(desk.window("subject$"))
        assert x >= DESK
        for share in range(20, 80, 2):  # down the window: the line's height is its own affair
            desk.do("mousemove", x + width // 2, y + height * share // 100, "click", 1)
        desk.do("type", "10b")
        desk.press("Return")
        count(folder, "note", 1)
        assert [event.data["text"] for event in events(folder) if event.kind == "note"] == ["a10b"]
        assert "scored" not in kinds(folder)
        answer_by_keys(desk, folder, 1)


@pytest.mark.parametrize("screens", [(1600,), (DESK, TABLET)])
def test_no_key_typed_into_another_program_answers_and_the_subjects_window_comes_when_the_keyboard_is_back(
    tmp_path, screens
):
    folder = tmp_path / "recordings"
    with desk_of(screens) as desk, desk.program(tmp_path):
        begin(desk, folder)
        window = desk.window("^daq-app$")
        command = [sys.executable, "-c", OTHER]
        other = subprocess.Popen(command, env=desk.environment, stdout=subprocess.PIPE, text=True)
        try:
            until(lambda: desk.active() == "another program", "another program")
            desk.do("windowactivate", "--sync", window)
            desk.press("space")
            count(folder, "take_started", 1)
            desk.do("windowactivate", "--sync", desk.window("another program"))
            desk.do("type", "1")
            count(folder, "score_asked", 1)
            time.sleep(1.0)
            desk.do("type", "2")
            assert desk.active() == "another program"
            desk.do("windowactivate", "--sync", window)
            until(lambda: desk.active() == SUBJECT, "the subject's window")
            desk.do("windowactivate", "--sync", window)  # now because the experimenter wants it
            time.sleep(1.0)
            assert desk.active() == WINDOW
            desk.press("Right", "Return")  # whichever window has the keyboard
            count(folder, "scored", 1)
        finally:
            other.terminate()
            text, _ = other.communicate()
        assert text.split() == ["1", "12"]


def test_the_page_leaves_with_the_second_screen_and_comes_back_with_it(tmp_path):
    with desk_of((DESK, TABLET)) as desk, desk.program(tmp_path):
        begin(desk, tmp_path / "recordings")

        def is_there():
            return desk.box(desk.window("subject$"))[0] >= DESK

        until(is_there, "the page on the second screen")
        xrandr(desk, "--delmonitor", "screen1")
        until(lambda: not desk.do("search", "--onlyvisible", "--name", "subject$"), "a screen without the page")
        assert desk.active() == WINDOW
        plug_in(desk, 1, TABLET, DESK)
        until(is_there, "the page on the second screen again")
        assert desk.active() == WINDOW
