"""The zero of a take, measured while readings come: the numbers that the log keeps of it."""

import statistics

import numpy as np
import pytest
from stand_ins import INFO

from drivers.readings import ReadingBlock
from sessions.plan.plan import Frame
from sessions.run.live_detection import TakeWatch
from sessions.run.steps import Zeroed
from sessions.strokes.settings import DetectorSettings

RATE = 128  # [Hz]; exact in binary, as is the stretch of half a second
STRETCH = 64
COUNTS = 1e6  # in a newton, by the calibration of the stand-in


def stretch(first, normal):
    """Return readings whose normal force is that [N] and whose other axes follow from their number."""
    number = np.arange(first, first + len(normal))
    raw = np.outer(number % 5, np.arange(6.0)) + 7.0
    raw[:, 2] = -COUNTS * np.asarray(normal)
    return ReadingBlock(number, number, 0 * number, number / RATE, np.zeros(len(number), np.int64), raw)


@pytest.fixture
def watch():
    return TakeWatch(INFO, Frame("-z", "set", 12.0, "set"), STRETCH / RATE, DetectorSettings())


def quiet_force(count):
    return 0.25 + 0.004 * np.resize([0.0, 1.0, 3.0, -1.0], count)


def test_a_zero_is_measured_as_soon_as_its_stretch_is_whole_and_holds_its_mean_and_its_spread(watch):
    block = stretch(0, quiet_force(STRETCH))
    assert watch.feed(block.between(0, STRETCH - 1)) == ()
    (zero,) = watch.feed(block.between(STRETCH - 1, STRETCH))
    assert isinstance(zero, Zeroed)
    assert zero.mean == pytest.approx([statistics.fmean(axis) for axis in block.raw.T])
    assert zero.spread == pytest.approx([statistics.stdev(axis) for axis in block.raw.T])
    assert zero.normal_force == pytest.approx(statistics.fmean(quiet_force(STRETCH)))
    assert zero.noise == pytest.approx(statistics.stdev(quiet_force(STRETCH)))
    assert (zero.readings, zero.first_sequence, zero.last_sequence) == (STRETCH, 0, STRETCH - 1)
    assert zero.duration == (STRETCH - 1) / RATE


def test_a_hand_that_leaves_the_face_is_not_in_the_zero(watch):
    normal = [*np.full(40, 2.0), *quiet_force(160)]
    (zero,) = [event for n in range(200) for event in watch.feed(stretch(n, [normal[n]]))]
    assert (zero.first_sequence, zero.last_sequence, zero.readings) == (40, 40 + STRETCH, STRETCH + 1)
    assert zero.normal_force == pytest.approx(0.25, abs=0.004)
