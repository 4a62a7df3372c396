"""A whole session of ten trials by keyboard alone and by mouse alone, on one screen and on two, as at a bench."""

import subprocess
import sys
import time

import pytest
from x11_desk import PATIENCE, ROOT, kinds, until

from sessions.recording import Recording
from tests.daq_app.qt.test_keys_under_x11 import DESK, TABLET, answer_by_keys, begin, count, desk_of, pytestmark  # noqa: F401

TRIALS = 10
LOCATED = ROOT / "tests" / "daq_app" / "located_program.py"
SCREENS = pytest.mark.parametrize("screens", [(1600,), (DESK, TABLET)], ids=["one screen", "two screens"])


class Mouse:
    """Clicks on what the program says is there."""

    def __init__(self, desk, folder):
        environment = {**desk.environment, "PYTHONPATH": str(ROOT), "HOME": str(folder)}
        self._desk = desk
        self.program = subprocess.Popen(
            [sys.executable, str(LOCATED)],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def where(self, name):
        self.program.stdin.write(f"{name}\n")
        self.program.stdin.flush()
        return self.program.stdout.readline().rstrip("\n").split(" ", 2)

    def click(self, name):
        """Click on a part as soon as it can be used, stays where it is, and the X server has its window in front."""

        def still():
            before = self.where(name)
            time.sleep(0.3)
            in_front = len(before) == 3 and self._desk.active() == before[2]
            return before[:2] if in_front and before == self.where(name) else []

        self._desk.do("mousemove", *until(still, name), "click", 1)

    def close(self):
        self.program.terminate()
        self.program.communicate(timeout=PATIENCE)


def covers(desk, screens):
    """Check that on one screen the subject's page takes the whole frame while an answer is due."""
    if len(screens) == 1:
        until(lambda: desk.box(desk.window("subject$")) == desk.box(desk.window("^daq-app$")), "the subject's page")


def answers_of_whole(folder):
    """Check that the one session below a folder is whole, and return its answers."""
    until(lambda: "ended" in kinds(folder), "the end")
    [session] = folder.glob("*/")
    until((session / "session.h5").exists, "the sealed copy")
    recording = Recording.open(session)
    assert recording.end["cause"] == "finished"
    assert len([event for event in recording.events if event.kind == "take_kept"]) == TRIALS
    return [event.data for event in recording.events if event.kind == "scored"]


@SCREENS
def test_ten_trials_by_keyboard_alone(tmp_path, screens):
    folder = tmp_path / "recordings"
    with desk_of(screens) as desk, desk.program(tmp_path):
        begin(desk, folder)
        for number in range(1, TRIALS):
            desk.press("space")
            answer_by_keys(desk, folder, number)
        desk.press("space")
        count(folder, "score_asked", TRIALS)
        until(lambda: desk.active() == "daq-app · subject", "the subject's window")
        covers(desk, screens)
        desk.press("Right", "Return")
        count(folder, "scored", TRIALS)
        time.sleep(2.0)  # the finger is away
        desk.press("space")
        answers = answers_of_whole(folder)
    assert [answer["score"] for answer in answers] == [50.0] * TRIALS
    assert {answer["input_device"] for answer in answers} == {"keyboard"}


@SCREENS
def test_ten_trials_by_mouse_alone(tmp_path, screens):
    folder = tmp_path / "recordings"
    with desk_of(screens) as desk:
        mouse = Mouse(desk, tmp_path)
        try:
            mouse.click("take the proposed code")
            mouse.click("Start")
            mouse.click("Begin")
            for number in range(1, TRIALS + 1):
                mouse.click("Zero: Mount")
                count(folder, "score_asked", number)
                covers(desk, screens)
                mouse.click("Line from")
                mouse.click("Next")
                count(folder, "scored", number)
            mouse.click("End session")
            answers = answers_of_whole(folder)
        finally:
            mouse.close()
    assert [answer["score"] for answer in answers] == pytest.approx([50.0] * TRIALS, abs=1.0)
    assert {answer["input_device"] for answer in answers} == {"mouse"}
