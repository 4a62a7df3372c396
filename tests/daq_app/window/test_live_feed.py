import numpy as np
import pytest

from daq_app.recorder.messages import Live
from daq_app.window.live_feed import LiveFeed, merge_live
from daq_app.window.live_trace import CHANNELS
from drivers.calibration import Calibration
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Frame

FRAME = Frame("-z", "set", 20.0, "set")
CALIBRATION = Calibration("FT1", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.array([36.0] * 3 + [500.0] * 3), "test")
RATE = 7000.0
INFO = TransducerInfo("test://", "test", "stand-in", "FT1", True, RATE, RATE, CALIBRATION)


@pytest.fixture
def feed():
    feed = LiveFeed()
    feed.device(INFO)
    return feed


def live(first, wrench, *, stream=1, zero=(0.0,) * 6, status=None):
    n = len(wrench)
    number = np.arange(first, first + n)
    status = np.zeros(n, np.int64) if status is None else status
    return Live(stream, number, number / RATE, number, wrench, status, zero)


def sliding(n, *, speed=25.0, mu=0.5, normal=2.0, height=20.0):
    """A finger that slides along +x at a known speed, as a wrench about the transducer's origin (r x F by hand)."""
    x = speed * np.arange(n) / RATE
    force = np.tile([mu * normal, 0.0, -normal], (n, 1))
    place = np.column_stack([x, np.zeros(n), np.full(n, height)])
    return np.hstack([force, np.cross(place, force)])


def feed_blocks(feed, wrench, block=117):
    for first in range(0, len(wrench), block):
        feed.add(live(first, wrench[first : first + block]), FRAME)


def channel(feed, name):
    return feed.trace.between(-1.0, 1e9)[1][CHANNELS.index(name)]


def test_force_ratio_speed_and_place_are_those_of_a_finger_that_slides_at_a_known_speed(feed):
    feed_blocks(feed, sliding(7000))
    assert channel(feed, "N") == pytest.approx(2.0)
    assert channel(feed, "T") == pytest.approx(1.0)
    assert channel(feed, "mu") == pytest.approx(0.5)
    assert channel(feed, "x")[-1] == pytest.approx(25.0 * 6999 / RATE, abs=1e-4)
    speed = channel(feed, "speed")
    assert np.isnan(speed[:600]).all()
    assert speed[1100:] == pytest.approx(25.0, rel=1e-6)


def test_nothing_is_said_of_ratio_place_and_speed_where_nothing_presses(feed):
    feed_blocks(feed, sliding(3000, normal=0.2))
    assert np.isnan(channel(feed, "mu")).all()
    assert np.isnan(channel(feed, "speed")).all()
    assert channel(feed, "N") == pytest.approx(0.2)


def test_readings_the_device_calls_invalid_are_not_drawn(feed):
    status = np.zeros(100, np.int64)
    status[40:60] = 2
    feed.add(live(0, sliding(100), status=status), FRAME)
    assert np.isnan(channel(feed, "N")[40:60]).all()
    assert np.isfinite(channel(feed, "N")[:40]).all()


def test_a_reading_that_the_device_calls_invalid_moves_no_speed(feed):
    wrench, status = sliding(7000), np.zeros(7000, np.int64)
    wrench[3000, 3:], status[3000] = 1e5, 2
    feed.add(live(0, wrench, status=status), FRAME)
    speed = channel(feed, "speed")
    assert np.isnan(speed[3000:3300]).all()  # its mean of 50 ms holds the reading
    assert speed[np.isfinite(speed)] == pytest.approx(25.0, rel=1e-6)


def test_the_take_holds_every_reading_since_it_began_with_its_number_and_time(feed):
    feed_blocks(feed, sliding(1000))
    feed.take_begins()
    feed.add(live(1000, sliding(300)), FRAME)
    feed.add(live(1310, sliding(50)), FRAME)
    take = feed.take()
    assert take.sequence.tolist() == [*range(1000, 1300), *range(1310, 1360)]
    assert take.raw[0] == pytest.approx(sliding(300)[0])


def test_readings_that_are_missing_leave_a_gap_however_few_they_are(feed):
    feed.add(live(0, sliding(100)), FRAME)
    feed.add(live(103, sliding(100)), FRAME)
    columns = feed.trace.columns(0.0, 0.05, 500)
    [gap] = np.flatnonzero(np.isnan(columns.values[CHANNELS.index("N")]))
    assert columns.time[gap - 1] == 99 / RATE
    assert columns.time[gap + 1] == 103 / RATE


def test_readings_that_came_in_several_messages_are_taken_as_one_up_to_whatever_came_between():
    first, second = live(0, sliding(100)), live(100, sliding(50))
    rezeroed, other = live(150, sliding(10), zero=(1.0,) * 6), live(0, sliding(5), stream=2)
    messages = list(merge_live([first, second, "a word", rezeroed, other]))
    assert [len(f.time) if isinstance(f, Live) else f for f in messages] == [150, "a word", 10, 5]
    assert messages[0].time.tolist() == [*first.time, *second.time]
    assert messages[0].wrench.tolist() == [*first.wrench.tolist(), *second.wrench.tolist()]


def test_a_new_stream_begins_a_new_picture(feed):
    feed_blocks(feed, sliding(1000))
    feed.add(live(0, sliding(20), stream=2), FRAME)
    assert len(channel(feed, "N")) == 20
    assert len(feed.take()) == 20
