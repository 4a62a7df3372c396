"""The recorder's bench and its display, in this process on the simulated transducer."""

from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest
from session_messages import INFO

from daq_app.recorder.bench import Bench
from daq_app.recorder.display import Display
from daq_app.recorder.messages import Device, Failed, HealthReport, LinkBack, LinkDown, Live, NoDevice, People, Tared
from daq_app.recorder.session import CLIENT_GONE, _Operator
from drivers.clock import RealClock
from drivers.readings import ReadingBlock
from drivers.transducer import Health, LinkLost, SetupError
from sessions.recording import LoggedEvent, RecordingError


class Seat:
    """A bench in this process on the simulated transducer, and what it reports."""

    def __init__(self):
        self.reports = []
        self.display = Display(self.reports.append, 1.0)
        self.bench = Bench(RealClock(), self.display, self.reports.append)
        self.bench.connect("sim:?seed=7")

    def until(self, kind):
        """Go on until a report of this kind comes, and return it; those before are forgotten."""
        self.reports.clear()
        while not (reports := [report for report in self.reports if isinstance(report, kind)]):
            self.bench.look()
            self.display.look(self.bench.health)
        return reports[0]


@pytest.fixture
def seat():
    new_seat = Seat()
    yield new_seat
    new_seat.bench.disconnect()


def test_a_tare_that_a_session_or_a_lost_transducer_ends_is_reported(seat):
    seat.bench.begin_tare(60.0)
    seat.bench.lend(0)
    seat.bench.stream()
    seat.bench.begin_tare(60.0)
    seat.bench.lose("the cable is out")
    words = [report.sentence.partition(": ")[2] for report in seat.reports if isinstance(report, Failed)]
    assert words == ["a session began; zero again after it", "the transducer is no longer connected"]


def test_what_is_reported_has_the_address_that_was_asked_for(seat):
    assert [report.info.uri for report in seat.reports if isinstance(report, Device)] == ["sim:?seed=7"]


def test_a_transducer_at_the_address_that_is_asked_for_stays_connected(seat):
    connected = seat.bench.connected
    with seat.bench.instead("sim:?seed=7"):
        assert seat.bench.connected is connected
    assert not any(isinstance(report, NoDevice) for report in seat.reports)


def test_a_transducer_in_another_place_that_does_not_answer_leaves_the_connected_one_alone(seat):
    connected = seat.bench.connected
    with pytest.raises(LinkLost, match="nothing answers"), seat.bench.instead("net-ft://127.0.0.1?http=1"):
        pass
    assert seat.bench.connected is connected
    assert seat.until(Live)


def test_a_transducer_that_turns_out_to_be_the_wrong_one_gives_back_the_former(seat):
    def compare():
        assert seat.bench.uri == "sim:?seed=8&rate=100"
        raise RecordingError("another one")

    again = r"another one; sim:\?seed=7 is connected again$"
    with pytest.raises(RecordingError, match=again), seat.bench.instead("sim:?seed=8&rate=100"):
        compare()
    assert seat.bench.uri == "sim:?seed=7"
    assert seat.until(Live)


def test_a_transducer_that_does_not_open_in_the_place_of_the_connected_one_gives_it_back(seat):
    again = r"rate=9000.*; sim:\?seed=7 is connected again$"
    with pytest.raises(SetupError, match=again), seat.bench.instead("sim:?rate=9000"):
        pass
    assert seat.until(Live)


def test_a_transducer_that_refuses_to_stream_after_a_session_is_lost_and_tried_again(seat, monkeypatch):
    def refuse():
        raise SetupError("another program has it")

    seat.bench.lend(0)
    monkeypatch.setattr(seat.bench.connected.transducer, "start", refuse)
    seat.bench.stream()
    assert LinkDown("another program has it") in seat.reports
    assert seat.until(LinkBack).same


def test_readings_called_invalid_are_counted_until_somebody_acknowledges_also_across_streams():
    reports = []
    display = Display(reports.append, 1.0)
    display.look(Health(saturated=3))
    display.stream_began()
    display.device(None)  # which has health reported at once
    display.look(Health(saturated=2))
    display.device(None)
    display.look(Health())
    display.acknowledge()
    display.look(Health())
    assert [report.saturated for report in reports] == [3, 5, 5, 0]


def test_the_load_is_that_of_what_the_transducer_feels_its_zero_included():
    reports = []
    display = Display(reports.append, 1.0)
    display.device(INFO)
    display.set_zero((0.0, 0.0, -9e6, 0.0, 0.0, 0.0))  # a plate of 9 N
    ones = np.zeros(1, np.int64)
    display.take(ReadingBlock(ones, ones, ones, ones / 1.0, ones, np.array([[4.5e6, 0.0, -18e6, 0.0, 0.0, 0.0]])))
    display.look(Health())
    [report] = (report for report in reports if isinstance(report, HealthReport))
    assert report.load[:3] == report.peak[:3] == pytest.approx((4.5 / 36, 0.0, 0.5))


def test_the_time_since_the_newest_reading_is_reported_and_where_none_need_come_it_is_nothing(monkeypatch):
    now, reports = [100.0], []
    monkeypatch.setattr("daq_app.recorder.display.time.monotonic", lambda: now[0])
    display, ones = Display(reports.append, 1.0), np.zeros(1, np.int64)

    def silence(at, **how):
        now[0] = at
        display.look(Health(), **how)
        return reports[-1].silence

    assert silence(130.0) == 0.0  # there is no transducer
    display.device(INFO)
    display.stream_began()
    assert silence(131.5) == 1.5
    display.take(ReadingBlock(ones, ones, ones, ones / 1.0, ones, np.zeros((1, 6))))
    assert silence(131.7) == pytest.approx(0.2)
    assert silence(190.0, streaming=False) == 0.0


def test_zero_and_greatest_loads_stay_when_the_same_transducer_answers_again_and_go_with_another(seat):
    seat.bench.begin_tare(0.5)
    tare, peak = seat.until(Tared), seat.until(HealthReport).peak
    seat.bench.lose("the cable is out")
    assert seat.until(LinkBack).same
    assert seat.until(Live).zero == tare.mean
    assert np.all(np.array(seat.until(HealthReport).peak) >= peak)
    seat.bench.lose("the cable is out")
    seat.bench.uri = "sim:?seed=8"
    assert not seat.until(LinkBack).same
    assert seat.until(Live).zero == (0.0,) * 6


def test_a_finger_that_stays_holds_a_session_without_a_client_no_longer_than_a_stroke_takes():
    now_ns = [0]
    clock, inbox = SimpleNamespace(now_ns=lambda: now_ns[0]), SimpleNamespace(stop_wanted=Event(), exhausted=False)
    prepared = SimpleNamespace(clock=clock, info=None, people=People(), plan=SimpleNamespace(forces=False))
    operator = _Operator(prepared, None, None, inbox, lambda _: None)
    operator.take_safe([LoggedEvent(1, 0, "contact_onset", 1, 0, {})])
    assert operator.stop() is None
    inbox.exhausted = True
    ends = {}
    for second in range(20):
        now_ns[0] = second * 1_000_000_000
        ends[second] = operator.stop()
    assert ends[5] is None
    assert ends[10] == ends[19] == ("client", CLIENT_GONE)
