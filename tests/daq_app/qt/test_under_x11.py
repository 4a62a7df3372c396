"""The program as it is started, on a real X server, driven by key presses and mouse clicks of the server's own."""

import os
import shutil
import subprocess
import sys
import time

import pytest
from x11_desk import ROOT, Desk, kinds, server, until

from sessions.recording import Recording

pytestmark = [
    pytest.mark.qt,
    pytest.mark.slow,
    pytest.mark.skipif(
        not (shutil.which("Xvfb") and shutil.which("xdotool")), reason="needs the system packages xvfb and xdotool"
    ),
]

SIZE = (1600, 1000)


def test_one_trial_and_an_early_end_with_real_keys_and_a_real_mouse(tmp_path):
    with server(*SIZE) as display, (desk := Desk(display)).program(tmp_path):
        window = desk.window("^daq-app$")
        folder = tmp_path / "recordings"
        time.sleep(1.0)
        desk.do("windowfocus", "--sync", window)
        desk.do("type", "P07")

        def has_begun():
            desk.keys(window, "Return")  # until the simulated bench is connected this only says what is missing
            time.sleep(1.0)
            return "started" in kinds(folder)

        until(has_begun, "the session")
        desk.keys(window, "space")
        until(lambda: "mount_asked" in kinds(folder), "the first trial")
        desk.keys(window, "space")
        until(lambda: "score_asked" in kinds(folder), "the stroke")
        subject = desk.window("subject$")
        # A click in the middle of the line, which lies in the middle of the subject's window.
        _, _, width, height = desk.box(subject)
        for share in range(20, 80, 2):  # down the window: the line's height is its own affair
            desk.do("mousemove", "--window", subject, width // 2, height * share // 100, "click", 1)
        desk.keys(subject, "Return")
        until(lambda: "scored" in kinds(folder), "the score")
        desk.keys(window, "ctrl+e")
        desk.do("type", "enough")
        desk.keys(window, "Return")
        until(lambda: "ended" in kinds(folder), "the end")
        [session] = folder.glob("*/")
        recording = Recording.open(session)
        [answer] = [event.data for event in recording.events if event.kind == "scored"]
        assert answer["score"] == pytest.approx(50.0, abs=1.0)
        assert answer["input_device"] == "mouse"
        assert recording.end["cause"] == "aborted"
        assert recording.end["reason"] == "enough"
        assert "SIMULATED" in recording.simulated_sentence
        desk.keys(window, "alt+F4")


def test_without_a_screen_one_sentence_says_what_to_do(tmp_path):
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")}
    environment["PYTHONPATH"] = str(ROOT)
    for display in (None, ":99999"):
        screenless = {**environment, **({"DISPLAY": display} if display else {})}
        process = subprocess.run(
            [sys.executable, "-m", "daq_app"], cwd=tmp_path, env=screenless, capture_output=True, text=True
        )
        assert process.returncode == 1
        assert process.stdout == ""
        assert process.stderr.count("\n") == 1
        assert "screen" in process.stderr
