"""The networked box as a transducer, over a link in memory that brings what a test gives it."""

import struct
import threading
import time
from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ledger import Ledger

from drivers import deadline
from drivers.calibration import Calibration
from drivers.clock import PacedClock, RealClock
from drivers.net_ft import device
from drivers.net_ft.device import NetFtTransducer
from drivers.net_ft.wire import NET_FT
from drivers.transducer import DeviceFault, LinkLost, SetupError, TransducerInfo
from simulators.bench import Bench
from simulators.faults import Fault
from simulators.net_ft_electronics import NET_FT as BOX
from simulators.net_ft_electronics import Electronics

START = bytes.fromhex("1234 0002 00000000")
STOP = bytes.fromhex("1234 0000 00000000")


def record(number, counter, *, status=0, counts=(0, 0, -500, 0, 0, 0)):
    return struct.pack(">III6i", number % 2**32, counter % 2**32, status, *counts)


def line(first, last, *, number=1, counter=1000, step=35):
    return [record(number + k, counter + k * step) for k in range(first, last)]


class MemoryLink:
    """Brings what it was given, and keeps what it was sent."""

    def __init__(self, *answers):
        """Give the n-th request for the stream the n-th answer: datagrams, or an error that ends the link."""
        self.requests = []
        self.closed = False
        self._answers = deque(answers)
        self._coming = deque()

    def send(self, data):
        if data == START and self._answers:
            self._coming.extend(self._answers.popleft())
        self.requests.append(data)

    def receive(self, timeout):
        if not self._coming:
            time.sleep(timeout)
            return None
        datagram = self._coming.popleft()
        if isinstance(datagram, Exception):
            raise datagram
        return datagram

    def close(self):
        self.closed = True

    @property
    def empty(self):
        return not self._coming and not self._answers


def transducer_on(link, *, rate=200.0, clock=None, reachable=True, serial="FT1"):
    calibration = Calibration("FT1", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.full(6, np.nan), "a test")
    info = TransducerInfo("net-ft://box", "net-ft", "Net F/T", "FT1", False, rate, 7000.0, calibration, status=NET_FT)

    def identify():
        """Return who answers: the box that was opened, and once all has come that it sent, the one of `serial`."""
        return replace(info, serial=serial if link.requests and link.empty else "FT1") if reachable else None

    return NetFtTransducer(info, lambda _: link, identify, clock or RealClock())


def all_readings(transducer, link):
    """Start, wait until the link has brought everything, stop, and return every reading."""
    transducer.start()
    while not link.empty:
        time.sleep(0.001)
    transducer.stop()
    return transducer.read(0.0)


def readings_until_lost(transducer, reason):
    """Read until the link is lost for `reason`, and return how many readings came."""
    received, end = 0, time.monotonic() + 60.0
    try:
        while time.monotonic() < end:
            received += len(transducer.read(1.0))
        raise AssertionError("it was never lost")
    except LinkLost as error:
        if reason not in str(error):
            raise
    return received


@pytest.fixture
def hasty(monkeypatch):
    """Give up in a tenth of the time."""
    monkeypatch.setattr(deadline, "CONNECTING", deadline.CONNECTING / 10)
    for name in ("_TICK", "_ASK_EVERY", "_SILENCE", "_QUIET"):
        monkeypatch.setattr(device, name, getattr(device, name) / 10)


def test_readings_keep_every_number_the_box_sent():
    counts = (1_000_000, -2_000_000, 5_000_000, 125_000, -1, 2**31 - 1)
    link = MemoryLink([record(1, 35, counts=counts), record(2, 70, status=0x80010000, counts=counts)])
    block = all_readings(transducer_on(link), link)
    assert block.sequence.tolist() == [1, 2]
    assert block.counter.tolist() == [35, 70]
    assert block.status.tolist() == [0, 0x80010000]
    assert block.raw.tolist() == [list(counts)] * 2
    assert block.time.tolist() == [0.0, 0.005]
    assert np.all(block.received_ns > 0)


def test_time_is_the_boxs_and_starts_at_0():
    link = MemoryLink(line(0, 50, counter=123456))
    np.testing.assert_allclose(all_readings(transducer_on(link), link).time, np.arange(50) / 200.0, rtol=1e-15)


def test_both_counters_may_wrap():
    link = MemoryLink(line(0, 50, number=2**32 - 20, counter=2**32 - 400))
    transducer = transducer_on(link)
    block = all_readings(transducer, link)
    assert np.diff(block.sequence).tolist() == [1] * 49
    np.testing.assert_allclose(np.diff(block.time), 1 / 200.0, rtol=1e-12)
    assert transducer.health.lost == 0


FAULTS = st.lists(
    st.builds(
        Fault,
        kind=st.sampled_from(["lose", "repeat", "reorder", "corrupt", "shorten", "delay"]),
        start=st.floats(0.02, 0.4),
        stop=st.floats(0.41, 0.9),
        share=st.floats(0.05, 0.9),
        delay=st.floats(0.004, 0.04),
    ),
    max_size=4,
)


@settings(max_examples=30, deadline=None)
@given(timetable=FAULTS, seed=st.integers(0, 1000))
def test_every_reading_is_received_or_named_as_lost_whatever_befalls_it(timetable, seed):
    faults = Ledger(timetable, seed=seed)
    box = Electronics(Bench(seed), faults, rate=200, first_tick=0, product=BOX)
    for k in range(200):
        faults.route(k / 200, [(k / 200, struct.pack(">I", k + 1) + box.readings([35 * k])[0])])
    faults.route(2.0, [])
    link = MemoryLink(faults.delivered)
    transducer = transducer_on(link)
    block = all_readings(transducer, link)

    originals = set(faults.datagrams)
    sound = [d for d in faults.delivered if d in originals]
    numbers = [int.from_bytes(d[:4], "big") for d in sound]
    expected = sorted({n for i, n in enumerate(numbers) if n == max(numbers[: i + 1])})
    health = transducer.health
    assert block.sequence.tolist() == expected
    assert block.raw.tolist() == [list(struct.unpack(">6i", faults.datagrams[n - 1][12:])) for n in expected]
    assert health.received == len(expected)
    assert health.received + health.lost == expected[-1]
    assert health.received + health.repeated + health.late + health.malformed == len(faults.delivered)
    assert health.malformed == len(faults.delivered) - len(sound)


def test_saturated_readings_are_kept_marked_and_counted():
    saturated = [record(k + 1, 35 * k, status=0x80020000) for k in range(3)]
    link = MemoryLink(saturated + line(3, 5, counter=0))
    transducer = transducer_on(link)
    assert (all_readings(transducer, link).status & 1 << 17 != 0).tolist() == [True] * 3 + [False] * 2
    assert transducer.health.saturated == 3


def test_stalled_readings_are_kept_and_counted():
    stalled = [record(4 + k, 1070) for k in range(3)]
    link = MemoryLink(line(0, 3) + stalled + line(6, 9))
    transducer = transducer_on(link)
    block = all_readings(transducer, link)
    assert block.time.tolist() == pytest.approx([0, 0.005, 0.01, 0.01, 0.01, 0.01, 0.03, 0.035, 0.04])
    assert transducer.health.stalled == 3
    assert transducer.health.lost == 0


@pytest.mark.usefixtures("hasty")
def test_a_start_that_was_lost_is_repeated():
    link = MemoryLink([], [], line(0, 5))
    transducer = transducer_on(link)
    assert len(all_readings(transducer, link)) == 5
    assert link.requests.count(START) == 3


@pytest.mark.usefixtures("hasty")
def test_a_box_that_never_answers_is_given_up_with_a_reason():
    for reachable, reason in ((False, "check its power"), (True, "firewall")):
        link = MemoryLink()
        with pytest.raises(LinkLost, match=reason):
            transducer_on(link, reachable=reachable).start()
        assert link.requests.count(START) > 2
        assert link.closed


@pytest.mark.usefixtures("hasty")
def test_a_box_that_falls_silent_is_asked_again_and_goes_on_behind_a_gap():
    link = MemoryLink(line(0, 10), line(0, 5, counter=1000 + 30 * 35))
    transducer = transducer_on(link)
    assert all_readings(transducer, link).sequence.tolist() == [*range(1, 11), *range(31, 36)]
    assert transducer.health.lost == 20


@pytest.mark.usefixtures("hasty")
def test_a_box_that_stays_silent_is_given_up_after_all_it_sent_was_read():
    for reachable, reason in ((False, "check its power"), (True, "other program")):
        link = MemoryLink(line(0, 10))
        transducer = transducer_on(link, reachable=reachable)
        transducer.start()
        assert readings_until_lost(transducer, reason) == 10
        assert link.closed
        transducer.close()


@pytest.mark.usefixtures("hasty")
def test_another_transducer_that_answers_after_a_silence_is_named_and_not_read():
    link = MemoryLink(line(0, 10))
    transducer = transducer_on(link, serial="FT2")
    transducer.start()
    assert readings_until_lost(transducer, "transducer FT2 answers where FT1 was") == 10
    assert link.requests.count(START) == 1
    transducer.close()


@pytest.mark.usefixtures("hasty")
def test_a_stream_that_is_taken_again_and_again_is_given_up():
    link = MemoryLink(*[line(0, 10, counter=1000 + 35 * 100 * k) for k in range(5)])
    transducer = transducer_on(link)
    transducer.start()
    readings_until_lost(transducer, "another program")
    transducer.close()


def test_a_link_that_breaks_is_lost_after_all_it_brought_was_read():
    link = MemoryLink([*line(0, 10), LinkLost("the cable is out")])
    transducer = transducer_on(link)
    transducer.start()
    assert readings_until_lost(transducer, "the cable is out") == 10
    transducer.close()


def test_an_error_of_ours_ends_the_stream_in_a_sentence_and_not_in_silence():
    transducer = transducer_on(MemoryLink([*line(0, 10), ZeroDivisionError("by zero")]))
    transducer.start()
    assert readings_until_lost(transducer, "net-ft://box: unexpected ZeroDivisionError (by zero); open it anew") == 10
    transducer.close()


def test_a_link_that_breaks_before_start_looks_loses_no_reading(monkeypatch):
    transducer = transducer_on(MemoryLink([*line(0, 10), LinkLost("the cable is out")]))
    has_come = transducer.has_come

    def look_late():
        transducer._thread.join()
        return has_come()

    monkeypatch.setattr(transducer, "has_come", look_late)
    transducer.start()
    assert readings_until_lost(transducer, "the cable is out") == 10
    transducer.close()


def test_a_box_that_sends_at_another_rate_than_it_says_is_refused():
    link = MemoryLink(line(0, 10, step=7))
    with pytest.raises(DeviceFault, match="200 Hz but sends 1000 Hz"):
        transducer_on(link).start()
    assert link.closed


def test_an_unstated_rate_is_learned_from_the_stream():
    link = MemoryLink(line(0, 10, step=7))
    transducer = transducer_on(link, rate=float("nan"))
    np.testing.assert_allclose(np.diff(all_readings(transducer, link).time), 0.001, rtol=1e-12)


def test_stopping_says_stop_twice_and_gives_everything_back():
    link = MemoryLink(line(0, 5))
    transducer = transducer_on(link)
    transducer.start()
    transducer.stop()
    transducer.stop()
    transducer.close()
    transducer.close()
    assert link.requests[-2:] == [STOP, STOP]
    assert link.closed
    assert not [t for t in threading.enumerate() if t.name.startswith("net-ft")]
    assert len(transducer.read(10.0)) == 5
    assert len(transducer.read(10.0)) == 0


def test_starting_twice_is_refused_and_starting_again_after_a_stop_begins_anew():
    link = MemoryLink(line(0, 5), line(0, 7, counter=99_000))
    transducer = transducer_on(link)
    transducer.start()
    with pytest.raises(SetupError, match="already"):
        transducer.start()
    transducer.stop()
    transducer.start()
    transducer.stop()
    assert transducer.read(0.0).time.tolist() == pytest.approx([k / 200 for k in range(7)])
    assert transducer.health.received == 7
    assert transducer.health.lost == 0


def test_waiting_is_reported_in_the_sessions_clock():
    link = MemoryLink(line(0, 5))
    transducer = transducer_on(link, clock=PacedClock(1000.0))
    transducer.start()
    while len(transducer.read(10.0)):
        pass
    began = time.monotonic()
    transducer.read(100.0)
    assert time.monotonic() - began >= 0.1
    transducer.close()


def test_lag_is_the_age_of_the_newest_reading_when_it_is_handed_over():
    link = MemoryLink(line(0, 5))
    clock = PacedClock(1.0)
    transducer = transducer_on(link, clock=clock)
    block = all_readings(transducer, link)
    assert 0.0 <= transducer.health.lag_ms <= (clock.now_ns() - block.received_ns[-1]) * 1e-6
