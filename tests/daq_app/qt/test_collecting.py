"""When Python's cycles are collected: between two events, never inside a call of Qt, which may hold locks there."""

import gc
import subprocess
import sys
import weakref

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QWidget
from x11_desk import ROOT

from daq_app.qt.start import open_window

pytestmark = pytest.mark.qt

# Qt holds locks of two senders while it calls disconnectNotify; among 3,000 objects some share them.
DISCONNECTING = """
from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QWidget
from daq_app.qt import start

class Sender(QObject):
    sent = Signal()
    def disconnectNotify(self, signal):
        [[] for _ in range(100_000)]

def build(application):
    objects = [QObject() for _ in range(3_000)]
    for one in objects:
        one.objectNameChanged.connect(one.deleteLater)
    objects.append(objects)
    del objects, one
    sender, receiver = Sender(), lambda: None
    sender.sent.connect(receiver)
    sender.sent.disconnect(receiver)
    QTimer.singleShot(0, application.quit)
    return QWidget()

start._show_window(build)
"""


class Node:
    pass


class SilentRecorder:
    def send(self, request):
        pass

    def close(self):
        pass


def test_objects_in_a_cycle_do_not_stop_a_window_that_lets_go_of_a_signal(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    subprocess.run([sys.executable, "-c", DISCONNECTING], check=True, timeout=60)


def test_a_widget_in_a_cycle_is_deleted_between_two_events_and_not_before(driver):
    node = Node()
    node.self, node.widget = node, QWidget()
    widget = weakref.ref(node.widget)
    del node
    for _ in range(20):
        [[] for _ in range(10 * gc.get_threshold()[0])]
    assert widget() is not None
    driver.until(lambda: [[] for _ in range(1_000)] and widget() is None, "its end")


def test_nothing_keeps_a_window_that_is_closed_until_python_ends(application):
    window = open_window(application, SilentRecorder)
    bridge = weakref.ref(window.bridge)
    window.bridge.end()
    for widget in (window, window.subject):
        widget.deleteLater()
    del window, widget
    application.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.unfreeze()  # an opening window keeps all there is from collection
    gc.collect()
    assert bridge() is None
