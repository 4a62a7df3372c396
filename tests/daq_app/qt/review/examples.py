"""A recorded session, work that is never done, and made fingers and histories for tests of Review."""

import time
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from daq_app.analyst.frame import Film, Frame, FrameMesh, Instant
from daq_app.analyst.stroke import RawReadings
from drivers.readings import ReadingBlock
from solver.prediction import ROW, Skin

SESSION = Path(__file__).parents[3] / "data" / "sessions" / "version-1" / "sealed"


class Nobody:
    """Work that is never done; what was asked for is kept."""

    def __init__(self):
        self.requests = []

    def poll(self):
        return ()

    def ask(self, request):
        self.requests.append(request)

    def close(self):
        """Do nothing."""


def until(application, condition):
    end = time.monotonic() + 120.0  # of a machine that hangs, not of a slow one
    while not condition():
        assert time.monotonic() < end
        application.processEvents()
        time.sleep(0.005)


def frame(sed):
    square = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    contact = Skin(np.array([0.0, 1.0]), np.zeros(2), np.ones(2), np.ones(2), ("stick", "slip"))
    return Frame(PARTS, square, {"sed": np.full(3, sed)}, {"skin": square}, square, contact, np.full(len(ROW), sed))


PARTS = FrameMesh(np.array([[0, 1, 2]]), np.array([[0, 0, 1, 1, 2, 2, 2, 2]]), np.array([1]))


def film(**more):
    instants = [Instant(0.1 * i, 1.0, 0.0 if i < 2 else 0.5, 0.001 * i, 3, i) for i in range(4)]
    return Film(tuple(frame(0.001 * i) for i in range(4)), tuple(instants), **more)


def raw(stroke, n=50):
    time_s = np.linspace(stroke.onset - 0.1, stroke.lift + 0.1, n)
    whole = np.arange(n)
    block = ReadingBlock(whole + 7, whole, whole, time_s, whole, np.ones((n, 6)))
    return RawReadings("here", "counts", block, time_s, time_s, "zero")


def drag(application, widget, begin, end, modifier=Qt.KeyboardModifier.NoModifier):
    QTest.mousePress(widget, Qt.MouseButton.LeftButton, modifier, begin)
    QTest.mouseMove(widget, end)
    application.processEvents()
    QTest.mouseRelease(widget, Qt.MouseButton.LeftButton, modifier, end)
