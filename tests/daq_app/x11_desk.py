"""An X server in memory, its keys and mouse, and the program as it is started on it, for tests."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from sessions.recording import Recording, RecordingError

ROOT = Path(__file__).parents[2]
PATIENCE = 120.0  # far beyond what anything takes [s]


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while not (result := condition()):
        assert time.monotonic() < end, f"{what} did not come"
        time.sleep(0.1)
    return result


@contextmanager
def server(width, height):
    """Run an X server with one screen of so many pixels; yield its display."""
    reading, writing = os.pipe()
    screen = f"{width}x{height}x24"
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", screen, "-nolisten", "tcp", "-noreset"]
    process = subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        number = pipe.readline().strip()
    try:
        yield f":{number}"
    finally:
        process.terminate()
        process.wait()


class Desk:
    """Keys and mouse of an X server, and the window's program on it."""

    def __init__(self, display):
        self.environment = {**os.environ, "DISPLAY": display}
        self.environment.pop("QT_QPA_PLATFORM", None)

    def do(self, *words):
        process = subprocess.run(["xdotool", *map(str, words)], env=self.environment, capture_output=True, text=True)
        return process.stdout.strip()

    def window(self, name):
        windows = until(lambda: self.do("search", "--onlyvisible", "--name", name), name)
        return windows.splitlines()[0]

    def active(self):
        """Return the name of the window that the window manager gives the keyboard."""
        return self.do("getactivewindow", "getwindowname")

    def keys(self, window, *keys):
        self.do("windowfocus", "--sync", window)
        self.press(*keys)

    def press(self, *keys):
        """Press keys on whatever has the keyboard."""
        for key in keys:
            self.do("key", "--clearmodifiers", key)

    def box(self, window):
        """Return left, top, width and height of a window [pixels]."""
        lines = self.do("getwindowgeometry", "--shell", window).splitlines()
        box = {name: int(value) for name, value in (line.split("=") for line in lines)}
        return box["X"], box["Y"], box["WIDTH"], box["HEIGHT"]

    @contextmanager
    def program(self, folder):
        """Run the program in a folder of its own."""
        environment = {**self.environment, "PYTHONPATH": str(ROOT), "HOME": str(folder)}
        program = subprocess.Popen([sys.executable, "-m", "daq_app"], cwd=folder, env=environment)
        try:
            yield program
        finally:
            program.send_signal(signal.SIGTERM)
            program.wait(PATIENCE)


def events(folder):
    """Return what the one session below a folder has written down so far."""
    try:
        [session] = folder.glob("*/")
        return Recording.open(session).events
    except (ValueError, RecordingError, OSError):
        return ()


def kinds(folder):
    return [event.kind for event in events(folder)]
