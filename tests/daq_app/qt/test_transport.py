import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from daq_app.qt.transport_bar import SPEEDS, TransportBar

pytestmark = pytest.mark.qt
TIMES = [1.0, 1.5, 2.0, 4.0]


@pytest.mark.usefixtures("application")
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(steps=st.lists(st.tuples(st.sampled_from(["play", "seek", "speed", "on"]), st.integers(0, 3)), max_size=12))
def test_a_replay_stands_where_it_was_put_whatever_plays_and_however_fast(steps):
    bar, places = TransportBar("the replay"), []
    bar.moved.connect(places.append)
    bar.set_times(TIMES)
    bar.seek(1)
    for what, by in steps:
        before = places[-1]
        match what:
            case "play":
                bar.toggle()
                assert places[-1] == (0 if before == len(TIMES) - 1 and bar.playing else before)
            case "seek":
                bar.seek(by)
                assert places[-1] == by
            case "speed":
                bar.speed.setCurrentIndex(by)
                bar.speed.activated.emit(by)
                assert places[-1] == before
            case "on":
                bar.step(+1)
                assert (places[-1], bar.playing) == (min(before + 1, len(TIMES) - 1), False)


def test_a_replay_ends_at_its_last_reading_and_begins_anew_from_there(application):
    bar, places, ends = TransportBar("the replay"), [], []
    bar.moved.connect(places.append)
    bar.ended.connect(lambda: ends.append(bar.playing))
    bar.set_times([0.0, 0.1, 0.2])
    bar.speed.setCurrentIndex(SPEEDS.index(4.0))
    bar.speed.activated.emit(SPEEDS.index(4.0))
    bar.toggle()
    while not ends:
        application.processEvents()
    assert (places[-1], ends, bar.play.text()) == (2, [False], "▶")
    bar.toggle()
    assert places[-1] == 0
    assert bar.playing
    bar.toggle()
