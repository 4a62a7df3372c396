"""Simulated boxes that are switched off when a test ends."""

import threading

import pytest

from drivers import deadline
from drivers.clock import PacedClock
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox


@pytest.fixture
def box(monkeypatch):
    """Return a function that starts a networked box, by default told that time runs ten times as fast.

    However busy this machine is, its first reading is waited for.
    """
    monkeypatch.setattr(deadline, "CONNECTING", 120.0)
    boxes, before = [], set(threading.enumerate())

    def started(bench=None, *, clock=None, **settings):
        boxes.append(NetFtBox(bench or Bench(1), clock or PacedClock(10.0), **settings))
        boxes[-1].start()
        return boxes[-1]

    yield started
    for one in boxes:
        one.close()
    left = [thread.name for thread in set(threading.enumerate()) - before]
    assert not left, f"threads left running: {left}"
