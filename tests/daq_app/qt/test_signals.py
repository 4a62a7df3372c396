"""Signals that ask the window's program to end: Ctrl-C in its terminal, and that of a system which shuts down."""

import signal
import subprocess
import sys

import pytest
from x11_desk import ROOT

from tests.daq_app.qt.review.examples import SESSION

pytestmark = [pytest.mark.qt, pytest.mark.skipif(sys.platform == "win32", reason="a signal of its own kind there")]

CHILD = """
import signal, sys
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
from daq_app.qt.start import window
number, run = int(sys.argv.pop(1)), QApplication.exec
QApplication.exec = lambda *_: (QTimer.singleShot(0, lambda: signal.raise_signal(number)), run())[1]
sys.exit(window(sys.argv[1:]))
"""


@pytest.mark.parametrize(
    ("number", "arguments"),
    [(signal.SIGINT, []), (signal.SIGTERM, []), (signal.SIGTERM, [str(SESSION)])],
    ids=["Ctrl-C, experimenter", "end, experimenter", "end, analyst"],
)
def test_a_signal_closes_the_window_without_a_word(tmp_path, monkeypatch, number, arguments):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    command = [sys.executable, "-c", CHILD, str(number.value), *arguments]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert process.returncode == 130
    words = [line for line in process.stderr.splitlines() if not line.startswith("This plugin")]  # Qt's, offscreen
    assert not words
