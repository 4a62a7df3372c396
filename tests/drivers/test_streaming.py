"""What a stream on a line does when this computer, and not the device, was away."""

import time

import numpy as np

from drivers.calibration import Calibration
from drivers.clock import RealClock
from drivers.clock_recovery import ClockRecovery
from drivers.readings import Records
from drivers.streaming import StreamingTransducer
from drivers.transducer import TransducerInfo

RATE = 200.0
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


class LineOfABusyComputer:
    """A device that sends all the time; one wait of its reader lasts far longer than it was to."""

    def __init__(self):
        self.began = time.monotonic()
        self.taken = 0
        self.waits = 0

    def send(self, data):
        pass

    def receive(self, timeout):
        self.waits += 1
        if self.waits == 10:
            time.sleep(BUSY)
            return None  # as where the wait was over before the computer was busy
        time.sleep(min(timeout, 0.01))
        due = int((time.monotonic() - self.began) * RATE)
        data, self.taken = bytes(max(due - self.taken, 0)), max(due, self.taken)
        return data or None

    def close(self):
        pass


def test_a_device_is_not_taken_to_be_silent_while_this_computer_was_busy():
    line = LineOfABusyComputer()
    calibration = Calibration("FT1", "counts", np.eye(6), np.full(6, np.nan), "a test")
    info = TransducerInfo("test://line", "test", "Test", "FT1", False, RATE, np.nan, calibration)
    transducer = StreamingTransducer(info, lambda _: line, PlainConversation(), RealClock())
    transducer.start()
    received = 0
    while received < 2.0 * BUSY * RATE:
        received += len(transducer.read(1.0))
    transducer.stop()
    assert line.waits > 10
    assert transducer.health.restarted == 0
