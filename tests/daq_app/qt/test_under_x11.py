"""The program as it is started, on a real X server, driven by key presses and mouse clicks of the server's own."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sessions.recording import Recording, RecordingError

pytestmark = [
    pytest.mark.qt,
    pytest.mark.slow,
    pytest.mark.skipif(
        not (shutil.which("Xvfb") and shutil.which("xdotool")), reason="needs the system packages xvfb and xdotool"
    ),
]

ROOT = Path(__file__).parents[3]
PATIENCE = 120.0  # far beyond what anything takes [s]
SIZE = (1600, 1000)


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end, f"{what} did not come"
        time.sleep(0.1)
    return found


@pytest.fixture
def display():
    reading, writing = os.pipe()
    screen = f"{SIZE[0]}x{SIZE[1]}x24"
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", screen, "-nolisten", "tcp"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    with os.fdopen(reading) as told:
        number = told.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait()


class Desk:
    """Keys and mouse of an X server."""

    def __init__(self, display):
        self.environment = {**os.environ, "DISPLAY": display}
        self.environment.pop("QT_QPA_PLATFORM", None)

    def do(self, *words):
        done = subprocess.run(["xdotool", *map(str, words)], env=self.environment, capture_output=True, text=True)
        return done.stdout.strip()

    def window(self, name):
        found = until(lambda: self.do("search", "--onlyvisible", "--name", name), name)
        return found.splitlines()[0]

    def keys(self, window, *keys):
        self.do("windowfocus", "--sync", window)
        for key in keys:
            self.do("key", "--clearmodifiers", key)


def kinds(folder):
    try:
        [session] = folder.glob("*/")
        return [event.kind for event in Recording.open(session).events]
    except (ValueError, RecordingError, OSError):
        return []


def test_one_trial_and_an_early_end_with_real_keys_and_a_real_mouse(display, tmp_path):
    desk = Desk(display)
    environment = {**desk.environment, "PYTHONPATH": str(ROOT), "HOME": str(tmp_path)}
    program = subprocess.Popen([sys.executable, "-m", "daq_app"], cwd=tmp_path, env=environment)
    try:
        window = desk.window("^daq-app$")
        folder = tmp_path / "recordings"
        time.sleep(1.0)
        desk.do("windowfocus", "--sync", window)
        desk.do("type", "P07")

        def begun():
            desk.keys(window, "Return")  # until the simulated bench is connected this only says what is missing
            time.sleep(1.0)
            return "started" in kinds(folder)

        until(begun, "the session")
        desk.keys(window, "space")
        until(lambda: "mount_asked" in kinds(folder), "the first trial")
        desk.keys(window, "space")
        until(lambda: "score_asked" in kinds(folder), "the stroke")
        subject = desk.window("subject$")
        # A click in the middle of the line, which lies in the middle of the subject's window.
        geometry = dict(line.split("=") for line in desk.do("getwindowgeometry", "--shell", subject).splitlines())
        width, height = int(geometry["WIDTH"]), int(geometry["HEIGHT"])
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
        [scored] = [event.data for event in recording.events if event.kind == "scored"]
        assert scored["score"] == pytest.approx(50.0, abs=1.0)
        assert scored["input_device"] == "mouse"
        assert recording.end["cause"] == "aborted"
        assert recording.end["reason"] == "enough"
        assert "SIMULATED" in recording.simulated_sentence
        desk.keys(window, "alt+F4")
    finally:
        program.send_signal(signal.SIGTERM)
        program.wait(PATIENCE)


def test_without_a_screen_one_sentence_says_what_to_do(tmp_path):
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")}
    environment["PYTHONPATH"] = str(ROOT)
    for display in (None, ":99999"):
        told = {**environment, **({"DISPLAY": display} if display else {})}
        done = subprocess.run([sys.executable, "-m", "daq_app"], cwd=tmp_path, env=told, capture_output=True, text=True)
        assert done.returncode == 1
        assert done.stdout == ""
        assert done.stderr.count("\n") == 1
        assert "screen" in done.stderr
