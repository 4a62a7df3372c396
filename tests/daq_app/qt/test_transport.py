import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq_app.qt.transport_bar import Transport

pytestmark = pytest.mark.qt


@given(steps=st.lists(st.tuples(st.sampled_from(["play", "pause", "seek", "speed"]), st.floats(0.0, 2.0)), max_size=12))
def test_a_replay_never_leaves_its_recording_and_stands_still_when_paused(steps):
    now, transport = 0.0, Transport(1.0, 4.0, 1.0)
    for what, by in steps:
        before = transport.at(now)
        match what:
            case "play":
                transport = transport.played(now)
            case "pause":
                transport = transport.paused(now)
                assert transport.at(now + by) == pytest.approx(before)
            case "seek":
                transport = transport.sought(by * 3.0, now)
            case "speed":
                transport = transport.at_speed(0.1 + by, now)
                assert transport.at(now) == pytest.approx(before)
        now += by
        assert 1.0 <= transport.at(now) <= 4.0
