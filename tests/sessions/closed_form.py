"""Strokes in closed form, as readings: written for these tests alone, so that no simulator vouches for the analysis."""

from dataclasses import replace

import numpy as np

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Block, Frame, SessionPlan, Stimulus, Trial
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.bootstrap import BootstrapSettings
from sessions.strokes.settings import AnalysisSettings
from sessions.strokes.trial_analysis import TrialContext

HEIGHT = 12.0  # [mm]
NOISE = np.array([0.004] * 3 + [0.05] * 3)  # [N, N mm]
CALIBRATION = Calibration("made", "N, N mm", np.eye(6), np.array([36.0] * 3 + [500.0] * 3), "closed form")
COUNTS = Calibration("made", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.array([36.0] * 3 + [500.0] * 3), "made")
INFO = TransducerInfo("made:", "made", "closed form", "made", True, 200.0, 7000.0, CALIBRATION, {})
SETTINGS = AnalysisSettings()
GAINS_ALONE = BootstrapSettings(repeats=20000, gain_error=0.02, cross_talk=0.0, tilt_error=(0.0, 0.0))


def times(duration=4.0, rate=200.0):
    return np.arange(round(duration * rate)) / rate


def trapezium(t, begin, end, rise, height=1.0):
    """Return 0 outside begin to end, `height` inside, with straight flanks of `rise` seconds."""
    return height * np.clip(np.minimum(t - begin, end - t) / rise, 0.0, 1.0)


def wrench(t, normal, ratio, along, *, direction=1, across=0.0, height=HEIGHT):
    """Return the wrench (n, 6) [N, N mm] of a finger at x = along, y = across that drags along x."""
    fx, fy, fz = direction * ratio * normal, np.zeros_like(t), -normal
    # r x F with r = (x, y, h), written out.
    return np.column_stack([fx, fy, fz, across * fz - height * fy, height * fx - along * fz, along * fy - across * fx])


def slide(t, *, mu=0.5, newtons=2.0, speed=25.0, direction=1, begin=1.0, end=3.0):
    """Return the wrench of one plain stroke: touch, slide at once, lift."""
    along = direction * (speed * (np.clip(t, begin, end) - begin) - speed * (end - begin) / 2)
    return wrench(t, trapezium(t, begin, end, 0.1, newtons), mu * np.ones_like(t), along, direction=direction)


def to_and_fro(t, *, mu=0.5, newtons=2.0, speed=25.0, begin=1.0, end=7.0, ways=4):
    """Return the wrench of a finger that goes `ways` times along x, first from the hand, and never lifts between.

    Each way takes equally long; at each turn the skin is pulled over within 0.1 s, mu changing straight from one sign
    to the other.
    """
    each = (end - begin) / ways
    phase = (np.clip(t, begin, end - 1e-9) - begin) / each
    way = np.where(np.floor(phase) % 2 == 0, 1.0, -1.0)
    along = speed * each * (way * (phase - np.floor(phase) - 0.5))
    since = (phase - np.floor(phase)) * each
    ratio = mu * np.where(phase >= 1.0, way * np.clip(since / 0.05 - 1.0, -1.0, 1.0), 1.0)
    return wrench(t, trapezium(t, begin, end, 0.1, newtons), ratio, along)


def noisy(clean, seed=0, offset=None):
    """Return a wrench with white noise of the usual size, and an offset (6,)."""
    with_noise = clean + np.random.default_rng(seed).standard_normal(clean.shape) * NOISE
    return with_noise if offset is None else with_noise + offset


def block(t, raw, *, sequence=None, status=None):
    n = len(t)
    position = np.arange(n) if sequence is None else sequence
    state = np.zeros(n, np.int64) if status is None else status
    return ReadingBlock(position, position, state, t, np.rint(t * 1e9).astype(np.int64), raw)


def trial(descriptor="slipperiness", direction=1, number=1):
    return Trial(number, "b", Stimulus(descriptor, 50, "K3"), direction, 1)


def plan(trials=(), frame=None):
    frame = frame or Frame("-z", "set", HEIGHT, "set")
    blocks = (Block("b", "", 1, 2.0, ("", ""), tuple(trials)),) if trials else ()
    return SessionPlan("made", "S1", 0, "given", blocks, forces=True, frame=frame)


def analyse(readings, *, of=None, frame=None, info=INFO, settings=SETTINGS):
    """Return the analysis of a block: of a trial, or of a recording without trials."""
    return analyse_blocks([(of, readings)], TrialContext(plan([of] if of else [], frame), info, settings))


def names(analysis, grade=None):
    return {str(flaw.name) for flaw in analysis.flaws if grade is None or flaw.grade == grade}


def with_info(**changes):
    return replace(INFO, **changes)


T = times()  # [s]
N = trapezium(T, 1.0, 3.0, 0.1, 2.0)  # [N] of the plain stroke
PLAIN = slide(T)
