import numpy as np
import pytest

from daq_app.window.live_trace import CHANNELS, LiveTrace, PlotScale


def feed_blocks(trace, time, first_channel, *, block=117):
    values = np.full((len(CHANNELS), len(time)), np.nan)
    values[0] = first_channel
    for at in range(0, len(time), block):
        trace.add(time[at : at + block], values[:, at : at + block])


def by_hand(time, values, width):
    columns = {}
    for t, v in zip(time, values, strict=True):
        columns.setdefault(int(np.floor(t / width)), []).append(v)
    return [(min(vs), max(vs)) for _, vs in sorted(columns.items())]


def test_each_column_holds_the_least_and_the_greatest_of_its_readings_however_they_came():
    rate = 7000.0
    time = np.arange(30_000) / rate
    values = np.random.default_rng(1).normal(size=len(time)).astype(np.float32)
    trace = LiveTrace(rate)
    feed_blocks(trace, time[:20_000], values[:20_000])
    trace.columns(0.0, 4.0, 400)  # a frame drawn in between
    feed_blocks(trace, time[20_000:], values[20_000:])
    columns = trace.columns(0.2, 4.2, 400)
    inside = (time >= 0.2) & (time < 4.2)
    expected = by_hand(time[inside], values[inside], 0.01)
    pairs = np.sort(columns.values[0].reshape(-1, 2), axis=1)
    assert pairs == pytest.approx(np.array(expected))


def test_a_single_reading_is_never_decimated_away():
    rate = 7000.0
    time = np.arange(int(60 * rate)) / rate
    values = np.zeros(len(time))
    values[123_456] = 40.0
    trace = LiveTrace(rate)
    feed_blocks(trace, time, values, block=7000)
    assert trace.columns(0.0, 60.0, 800).values[0].max() == 40.0


def test_missing_readings_are_drawn_as_a_gap_at_every_width():
    rate = 200.0
    time = np.arange(12_000) / rate
    time = time[(time < 10.0) | (time >= 10.5)]
    trace = LiveTrace(rate)
    feed_blocks(trace, time, np.ones(len(time)))
    for first, last, count in [(9.0, 12.0, 800), (0.0, 60.0, 800)]:
        columns = trace.columns(first, last, count)
        [gap] = np.flatnonzero(np.isnan(columns.values[0]))
        assert columns.time[gap - 1] < 10.0 + 60.0 / 800
        assert columns.time[gap + 1] >= 10.5 - 60.0 / 800


def test_the_ring_keeps_the_last_minute_and_no_more():
    rate = 500.0
    time = np.arange(int(150 * rate)) / rate
    trace = LiveTrace(rate)
    feed_blocks(trace, time, time, block=997)
    times, values = trace.between(-1.0, 1e9)
    assert times[-1] == time[-1]
    assert 60.0 <= times[-1] - times[0] <= 64.0
    assert values[0] == pytest.approx(times)


def test_a_new_connection_begins_with_an_empty_picture():
    trace = LiveTrace(200.0)
    feed_blocks(trace, np.arange(1000) / 200.0, np.ones(1000))
    trace.clear()
    assert trace.newest is None
    assert len(trace.columns(0.0, 5.0, 100).time) == 0


def test_the_ring_says_which_readings_were_dropped_for_newer_ones():
    trace = LiveTrace(200.0)
    feed_blocks(trace, 100.0 + np.arange(2000) / 200.0, np.ones(2000))
    assert trace.holds(0.0)  # nothing came before, and nothing was dropped
    feed_blocks(trace, 110.0 + np.arange(30_000) / 200.0, np.ones(30_000))
    assert not trace.holds(150.0)
    assert trace.holds(250.0)
    trace.clear()
    assert trace.holds(0.0)


@pytest.mark.parametrize(("least", "greatest"), [(0.0, np.inf), (-np.inf, 1.0), (np.inf, np.inf), (np.nan, np.nan)])
def test_a_scale_stays_where_data_are_infinite_or_missing(least, greatest):
    scale = PlotScale(0.0, 5.0, 5.0)
    assert scale.following(least, greatest, 1.0) == scale
