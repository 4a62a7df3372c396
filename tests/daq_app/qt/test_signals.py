"""Ctrl-C in the terminal from which a window was started."""

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
run = QApplication.exec
QApplication.exec = lambda *_: (QTimer.singleShot(0, lambda: signal.raise_signal(signal.SIGINT)), run())[1]
sys.exit(window(sys.argv[1:]))
"""


@pytest.mark.parametrize("arguments", [[], [str(SESSION)]], ids=["experimenter", "analyst"])
def test_ctrl_c_closes_the_window_without_a_traceback(tmp_path, monkeypatch, arguments):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    command = [sys.executable, "-c", CHILD, *arguments]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert process.returncode == 130
    assert "Traceback" not in process.stderr
