"""Simulated boxes that are switched off when a test ends."""

import threading

import pytest

from drivers import deadline
from drivers.clock import PacedClock
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox


@pytest.fixture
def start_box(monkeypatch):
    """Return a function that starts a networked box, by default in simulated time ten times as fast.

    A driver waits for its first reading however busy this machine is.
    """
    monkeypatch.setattr(deadline, "CONNECTING", 120.0)
    boxes, threads_before = [], set(threading.enumerate())

    def start(bench=None, *, clock=None, **settings):
        boxes.append(NetFtBox(bench or Bench(1), clock or PacedClock(10.0), **settings))
        boxes[-1].start()
        return boxes[-1]

    yield start
    for box in boxes:
        box.close()
    leftovers = [thread.name for thread in set(threading.enumerate()) - threads_before]
    assert not leftovers, f"threads left running: {leftovers}"
