"""Estimates of the analysis against the ground truth of the simulated bench: ten surfaces of the paper, default bench.

Three seeds in `make test`, fifty in `make test-long`.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Block, Frame, SessionPlan, Stimulus, Trial
from sessions.strokes import AnalysisSettings
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.contacts import ContactDetector
from sessions.strokes.forces import normal_force
from sessions.strokes.trial_analysis import TrialContext
from simulators.bench import RATED, Bench, BenchSettings, StrokeGroundTruth
from simulators.stroke import paper_surfaces
from simulators.subject import SimulatedSubject

RATE = 200.0
CALIBRATION = Calibration("FT0001", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.array(RATED), "the bench's own")
INFO = TransducerInfo("sim:", "net-ft", "SIMULATED", "FT0001", True, RATE, 7000.0, CALIBRATION, {})
FRAME = Frame("-z", "set", BenchSettings().height, "set")


@dataclass(frozen=True)
class Visit:
    """One subject's ten strokes: what was recorded and the ground truth, in the same order."""

    parts: list[tuple[Trial, ReadingBlock]]
    strokes: list[StrokeGroundTruth]

    def analyse(self):
        blocks = (Block("b", "", 1, 2.0, ("", ""), tuple(trial for trial, _ in self.parts)),)
        plan = SessionPlan("sensotact", "S1", 0, "given", blocks, forces=True, frame=FRAME)
        return analyse_blocks(self.parts, TrialContext(plan, INFO, AnalysisSettings()))


def visit(seed, settings=None, rate=RATE):
    bench, subject = Bench(seed, settings), SimulatedSubject(seed)
    parts, strokes, begin = [], [], 0.5
    for number, surface in enumerate(paper_surfaces().values(), 1):
        bench.mount(surface)
        truth = bench.begin_stroke(subject.stroke(surface), begin)
        position = np.arange(np.ceil((begin - 0.2) * rate), (truth.end + 0.6) * rate).astype(np.int64)
        time = position / rate
        counts = np.rint(bench.wrench(time) / np.diag(CALIBRATION.matrix))
        healthy = np.zeros(len(time), np.int64)
        block = ReadingBlock(position, position, healthy, time, np.rint(time * 1e9).astype(np.int64), counts)
        stimulus = Stimulus(surface.descriptor, surface.index, f"K{number}")
        parts.append((Trial(number, "b", stimulus, surface.direction, 1), block))
        strokes.append(truth)
        begin = truth.end + 1.0
    return Visit(parts, strokes)


@pytest.fixture(scope="module", params=[3, pytest.param(50, marks=pytest.mark.slow)], ids="{} seeds".format)
def visits(request):
    return [visit(seed) for seed in range(request.param)]


@pytest.fixture(scope="module")
def analyses(visits):
    return [visit.analyse() for visit in visits]


@pytest.fixture(scope="module")
def rows(visits, analyses):
    """Return (stroke, friction, ground truth) of every trial of every seed."""
    rows = []
    for visit, analysis in zip(visits, analyses, strict=True):
        assert len(analysis.strokes) == len(analysis.friction) == 10
        rows += zip(analysis.strokes, analysis.friction, visit.strokes, strict=True)
    return rows


def errors(rows, estimate_of, truth_of):
    return np.array([estimate_of(stroke, friction) / truth_of(truth) - 1.0 for stroke, friction, truth in rows])


def test_the_mu_the_model_gets_is_within_two_per_cent(rows):
    assert np.abs(errors(rows, lambda _, friction: friction.mu, lambda truth: truth.mu)).max() < 0.02


def test_mu_dynamic_and_mu_max_are_both_within_two_per_cent(rows):
    assert np.abs(errors(rows, lambda stroke, _: stroke.mu_dynamic, lambda truth: truth.mu)).max() < 0.02
    assert np.abs(errors(rows, lambda stroke, _: stroke.mu_max, lambda truth: truth.mu)).max() < 0.02


def test_tau_max_is_within_three_per_cent(rows):
    assert np.abs(errors(rows, lambda _, friction: friction.tau_max, lambda truth: truth.tau_max)).max() < 0.03


def test_speed_is_within_ten_per_cent(rows):
    assert np.abs(errors(rows, lambda _, friction: friction.speed, lambda truth: truth.speed)).max() < 0.10


def test_onset_is_within_two_readings_of_where_the_force_exceeds_three_standard_deviations(rows):
    late = np.array([stroke.onset - truth.onset for stroke, _, truth in rows])
    assert np.abs(late).max() <= 2 / RATE


def test_lift_is_within_two_readings_too(rows):
    early = np.array([stroke.lift - truth.lift for stroke, _, truth in rows])
    assert np.abs(early).max() <= 2 / RATE


def test_every_direction_is_found(rows):
    assert all(stroke.direction == truth.direction for stroke, _, truth in rows)


def test_nothing_is_flawed_and_only_the_static_peak_is_withheld(rows):
    assert all(stroke.flaws == () and set(stroke.reasons) == {"mu_static"} for stroke, _, _ in rows)


def test_the_steady_window_lies_in_the_slide(rows):
    assert all(truth.slip <= stroke.steady[0] and stroke.steady[1] <= truth.end for stroke, _, truth in rows)


def test_break_away_is_within_five_milliseconds_of_the_slip_and_reported_only_where_the_finger_was_held(rows):
    ends = [(stroke.break_away, truth.slip) for stroke, _, truth in rows if truth.surface.holds]
    assert max(abs(estimate - true) for estimate, true in ends) < 0.005
    assert all(stroke.break_away is None for stroke, _, truth in rows if not truth.surface.holds)


def test_the_slides_onset_is_found_where_the_finger_was_held(rows):
    onsets = [(stroke.slide_onset, truth.slip) for stroke, _, truth in rows if truth.surface.holds]
    assert len(onsets) == len(rows) / 2
    assert max(abs(estimate - truth) for estimate, truth in onsets) < 0.06  # a fifth of the speed, 50 ms after slip


def test_intervals_of_mu_cover_the_truth_at_least_as_often_as_they_say(rows):
    hits = [low <= truth.mu <= high for (low, high), truth in ((s.mu_dynamic_interval, t) for s, _, t in rows)]
    assert np.mean(hits) >= 0.95


def test_live_and_offline_tell_the_same_onset_and_lift(visits, analyses):
    """The runner feeds the detector what arrives in 20 ms; offline the same class gets a whole trial."""
    for visit, analysis in zip(visits[:5], analyses[:5], strict=True):
        for (_, block), stroke in zip(visit.parts, analysis.strokes, strict=True):
            detector, events = ContactDetector(), []
            force = normal_force(CALIBRATION.wrench(block.raw, np.zeros(6)), FRAME)
            for start in range(0, len(block), 4):
                events += detector.feed(block.time[start : start + 4], force[start : start + 4])
            assert [event.touches for event in events] == [True, False]
            assert abs(events[0].time - stroke.onset) <= 2 / RATE
            assert abs(events[1].time - stroke.lift) <= 2 / RATE


@pytest.mark.parametrize("rate", [500.0, 1000.0])
def test_other_rates_give_the_same_friction(rate):
    simulated = visit(3, rate=rate)
    for friction, truth in zip(simulated.analyse().friction, simulated.strokes, strict=True):
        assert friction.mu == pytest.approx(truth.mu, rel=0.02)
        assert friction.tau_max == pytest.approx(truth.tau_max, rel=0.03)


def test_an_offset_from_the_plates_weight_changes_nothing():
    settings = BenchSettings(offset=(0.4, -0.3, -1.5, 12.0, -8.0, 3.0))
    simulated = visit(4, settings)
    for friction, truth in zip(simulated.analyse().friction, simulated.strokes, strict=True):
        assert friction.mu == pytest.approx(truth.mu, rel=0.02)
        assert friction.speed == pytest.approx(truth.speed, rel=0.10)


def test_ten_times_the_noise_is_measured_and_still_gives_friction():
    simulated = visit(5, BenchSettings(noise_force=0.04, noise_torque=0.5))
    analysis = simulated.analyse()
    assert len(analysis.strokes) == 10
    for friction, truth in zip(analysis.friction, simulated.strokes, strict=True):
        assert friction.mu == pytest.approx(truth.mu, rel=0.08)
