"""What a stream on a line does when this computer, or the thread that reads it, was away."""

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from drivers import threaded
from drivers.calibration import Calibration
from drivers.clock import RealClock
from drivers.clock_recovery import ClockRecovery
from drivers.deadline import Deadline
from drivers.readings import Records
from drivers.streaming import StreamingTransducer, measured_rate
from drivers.transducer import SetupError, TransducerInfo

RATE = 200.0
HALF = 0.2  # of the time for which a rate is measured [real s]
BUSY = 1.0  # for how long the computer does something else, well beyond what a device may be quiet [real s]


class OneByteRecords:
    """Decodes a line on which each byte is a record."""

    malformed = 0

    def feed(self, data):
        return Records.of([(byte,) * 6 for byte in data], [0] * len(data), [0] * len(data))


class PlainConversation:
    """Says nothing around a stream."""

    def begin(self, _):
        return b""

    def end(self, _):
        pass

    def decoder(self):
        return OneByteRecords()

    def numbering(self, rate, factor):
        return ClockRecovery(rate, factor)


class Line:
    """A device that sends all the time; the tenth wait of its reader is `busy`."""

    def __init__(self, busy=lambda: None):
        self.began = time.monotonic()
        self.sent_count = 0
        self.waits = 0
        self.busy = busy

    def send(self, data):
        pass

    def receive(self, timeout):
        self.waits += 1
        if self.waits == 10:
            self.busy()
            return None  # as where the wait was over before the computer was busy
        time.sleep(min(timeout, 0.01))
        due = int((time.monotonic() - self.began) * RATE)
        data, self.sent_count = bytes(max(due - self.sent_count, 0)), max(due, self.sent_count)
        return data or None

    def close(self):
        pass


def transducer_on(line):
    calibration = Calibration("FT1", "counts", np.eye(6), np.full(6, np.nan), "a test")
    info = TransducerInfo("test://line", "test", "Test", "FT1", False, RATE, np.nan, calibration)
    return StreamingTransducer(info, lambda _: line, PlainConversation(), RealClock(), opening=Deadline.for_opening())


def test_a_device_is_not_taken_to_be_silent_while_this_computer_was_busy():
    line = Line(lambda: time.sleep(BUSY))
    transducer = transducer_on(line)
    transducer.start()
    received = 0
    while received < 2.0 * BUSY * RATE:
        received += len(transducer.read(1.0))
    transducer.stop()
    assert line.waits > 10
    assert transducer.health.restarted == 0


class SlowStart(Line):
    """A line whose reader keeps up with 0.7 of the records at first, then with none, and then with all."""

    def receive(self, timeout):
        time.sleep(min(timeout, 0.01))
        elapsed = time.monotonic() - self.began
        due = self.sent_count if HALF < elapsed < 2.5 * HALF else int(elapsed * RATE * (0.7 if elapsed < HALF else 1.0))
        data, self.sent_count = bytes(due - self.sent_count), due
        return data or None


def test_a_rate_is_not_confirmed_by_a_stretch_in_which_nothing_came():
    rate = measured_rate(SlowStart(), PlainConversation(), RealClock(), 2.0 * HALF, Deadline(20.0))
    assert rate == pytest.approx(RATE, rel=0.05)


class LateThread(threading.Thread):
    """A thread that begins to run only after its start was broken off, as on a busy computer."""

    def start(self):
        threading.Timer(0.05, super().start).start()
        raise KeyboardInterrupt


def test_a_start_that_was_broken_off_can_be_made_again(monkeypatch):
    transducer = transducer_on(Line())
    with monkeypatch.context() as patch:
        patch.setattr(threaded, "threading", SimpleNamespace(Thread=LateThread))
        with pytest.raises(KeyboardInterrupt):
            transducer.start()
    transducer.start()
    assert len(transducer.read(1.0))
    transducer.close()


def test_a_stream_that_its_device_holds_up_beyond_a_stop_does_not_come_back_with_the_next_start(monkeypatch):
    monkeypatch.setattr(threaded, "_LEAVING", 0.05)
    release = threading.Event()
    line = Line(lambda: release.wait(10.0))
    transducer = transducer_on(line)
    transducer.start()
    while line.waits < 10:
        time.sleep(0.001)
    transducer.stop()
    with pytest.raises(SetupError, match="test://line still holds up the stream before"):
        transducer.start()
    release.set()
    while transducer._last_thread.is_alive():
        time.sleep(0.001)
    transducer.start()
    transducer.close()
