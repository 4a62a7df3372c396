"""What the recorder sends while a transducer streams: how often, at what rate, and each reading once."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from recordings import readings
from stand_ins import CALIBRATION, INFO

from daq_app.recorder.bench import Bench, Tap
from daq_app.recorder.display import Display
from daq_app.recorder.messages import HealthReport, Live, Tared
from drivers.clock import RealClock
from drivers.readings import ReadingBlock
from drivers.transducer import Health


class Watched:
    """A display whose real time stands still until it is set."""

    def __init__(self, monkeypatch, factor=1.0):
        self.now, self.messages = 100.0, []
        monkeypatch.setattr("daq_app.recorder.display.time", SimpleNamespace(monotonic=lambda: self.now))
        self.display = Display(self.messages.append, factor)
        self.display.device(INFO)
        self.display.stream_began()

    def of(self, kind):
        return [message for message in self.messages if isinstance(message, kind)]


def test_every_reading_is_sent_once_at_most_sixty_times_a_second_and_health_ten_times(monkeypatch):
    watched = Watched(monkeypatch)
    for step in range(2000):
        watched.now = 100.0 + step / 1000.0
        watched.display.take(readings(step, 1))
        watched.display.look(Health(received=step))
    lives, reports = watched.of(Live), watched.of(HealthReport)
    assert 100 <= len(lives) <= 120
    assert 19 <= len(reports) <= 21
    sequence = np.concatenate([live.sequence for live in lives])
    assert sequence.tolist() == list(range(len(sequence)))
    assert len(sequence) > 1980
    assert {live.stream for live in lives} == {lives[0].stream}


@pytest.mark.parametrize("factor", [1.0, 10.0])
def test_the_rate_is_of_the_last_second_of_the_session_s_clock(monkeypatch, factor):
    watched = Watched(monkeypatch, factor)
    for step in range(31):  # 100 a second at first, then 250
        watched.now = 100.0 + step / 10.0
        watched.display.take(readings(0, 10 if step < 15 else 25))
        watched.display.look(Health())
    rates = [report.rate for report in watched.of(HealthReport)]
    assert rates[:2] == [0.0, 0.0]  # readings of 0.2 s give no rate yet
    assert rates[12] == pytest.approx(100.0 / factor)
    assert rates[30] == pytest.approx(250.0 / factor)


def test_readings_of_the_device_before_are_a_wrench_by_its_own_calibration_and_zero(monkeypatch):
    watched = Watched(monkeypatch)
    block = readings(10, 3)
    watched.display.set_zero((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    watched.display.take(block)
    watched.display.device(replace(INFO, calibration=replace(CALIBRATION, matrix=2.0 * CALIBRATION.matrix)))
    watched.display.take(block)
    watched.display.stream_began()
    watched.display.take(block)
    watched.now = 101.0
    watched.display.look(Health())
    before, after, anew = watched.of(Live)
    scale = np.array([1e-6] * 3 + [1e-3] * 3)  # of the stand-in
    expected = (block.raw - np.arange(1.0, 7.0)) * scale
    np.testing.assert_allclose(before.wrench, expected)
    np.testing.assert_allclose(after.wrench, 2.0 * expected)
    assert (after.stream, anew.stream) == (before.stream, before.stream + 1)
    assert before.status.tolist() == [
        status if INFO.status.doubtful(np.array([status]))[0] else 0 for status in block.status
    ]


def test_readings_called_invalid_or_doubtful_are_counted_once_in_a_stream(monkeypatch):
    watched = Watched(monkeypatch)
    for total in (3, 3, 5):
        watched.now += 1.0
        watched.display.look(Health(saturated=total, doubtful=1))
    assert [report.saturated for report in watched.of(HealthReport)] == [4, 4, 6]


def test_what_a_session_reads_is_shown_and_stamped_by_the_session_s_clock(monkeypatch):
    watched, calls = Watched(monkeypatch), []
    inner = SimpleNamespace(info=INFO, read=lambda _: readings(5, 3, received_ns=1000))
    inner.start = lambda: calls.append("start")
    tap = Tap(inner, watched.display, 250)
    tap.start()
    assert calls == ["start"]
    block = tap.read(0.0)
    assert block.received_ns.tolist() == [1250] * 3
    assert block.raw.tolist() == readings(5, 3).raw.tolist()
    watched.display.look(Health())
    (live,) = watched.of(Live)
    assert (live.sequence.tolist(), live.received_ns.tolist()) == ([5, 6, 7], [1250] * 3)


class LumpyTransducer:
    """Gives readings at 128 Hz in lumps of forty, whose raw numbers alternate about (100, 200, ... 600)."""

    info, health = INFO, Health()

    def __init__(self):
        self.begun, self.start, self.stop = 0, lambda: None, lambda: None

    def read(self, _):
        number = np.arange(self.begun, self.begun + 40)
        self.begun += 40
        raw = 100.0 * np.arange(1.0, 7.0) + np.where(number % 2, 1.0, -1.0)[:, None] * np.arange(6.0)
        return ReadingBlock(number, number, 0 * number, number / 128.0, 0 * number, raw)


def test_a_tare_takes_as_long_a_stretch_as_was_asked_for_and_tells_its_mean_and_noise(monkeypatch):
    watched = Watched(monkeypatch)
    connection = SimpleNamespace(transducer=LumpyTransducer(), frame=None)
    monkeypatch.setattr("daq_app.recorder.bench.connect", lambda *_: nullcontext(connection))
    bench = Bench(RealClock(), watched.display, watched.messages.append)
    bench.connect("sim:")
    bench.begin_tare(0.5)
    bench.look()
    assert watched.of(Tared) == []
    bench.look()
    (tared,) = watched.of(Tared)
    lump = LumpyTransducer().read(0.0).raw
    raw = np.vstack([lump, lump[:25]])  # 65 readings span half a second
    assert (tared.readings, tared.duration) == (65, 0.5)
    assert tared.mean == pytest.approx(raw.mean(axis=0))
    assert tared.spread == pytest.approx(raw.std(axis=0, ddof=1))
