"""Intervals of a stroke: the same from the same seed, wide for the reasons they name, and true as often as they say."""

from collections import defaultdict
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import test_ground_truth as ground_truth
from closed_form import GAINS_ALONE, PLAIN, T, analyse, block, noisy
from scipy import integrate, stats

from sessions.strokes.bootstrap import (
    BootstrapSettings,
    drag_direction,
    friction_draws,
    mean_inflation,
    stroke_intervals,
)
from sessions.strokes.contacts import onset_draws
from sessions.strokes.stroke import StrokeCurve
from simulators.bench import BenchSettings
from simulators.stroke import Course
from simulators.subject import SimulatedSubject

NUMBERS = ("mu_dynamic", "mu_max", "tau_max", "speed")
NO_ERROR = BootstrapSettings(repeats=4000, gain_error=0.0, cross_talk=0.0, tilt_error=(0.0, 0.0))
FORCES = ("normal_force", "tangential_force", "peak_normal", "peak_tangential")


@cache
def strokes_of_a_visit():
    return ground_truth.visit(1).analyse().strokes


@pytest.fixture(scope="module")
def strokes():
    return strokes_of_a_visit()


def width(interval):
    return interval[1] - interval[0]


def test_the_same_seed_gives_the_same_bits_and_another_seed_others(strokes):
    once, again = (stroke_intervals(strokes[0], 0) for _ in range(2))
    other = stroke_intervals(strokes[0], 0, BootstrapSettings(seed=1))
    assert once == again
    assert once.mu_dynamic != other.mu_dynamic


def test_every_number_lies_in_its_interval(strokes):
    for number, stroke in enumerate(strokes):
        intervals = stroke_intervals(stroke, number)
        for name in (*NUMBERS, *FORCES, "heading"):
            low, high = getattr(intervals, name)
            assert low < getattr(stroke, name) < high
        assert intervals.onset[0] < stroke.onset <= intervals.onset[1]


def test_losses_that_leave_the_zero_no_filtered_reading_leave_the_intervals():
    present = np.flatnonzero(((T > 1.0) & (T < 3.0)) | (np.arange(len(T)) % 8 > 0))  # elsewhere seven at a time
    stroke = analyse(block(T[present], noisy(PLAIN)[present], sequence=present)).strokes[0]
    intervals = stroke_intervals(stroke, 0)
    for name in (*NUMBERS, *FORCES):
        low, high = getattr(intervals, name)
        assert low < getattr(stroke, name) < high


def test_of_a_calibration_alone_tau_max_has_the_closed_form(strokes):
    # The gain of a long-known force, normal with 2 %: 1.96 * 2 % to both sides, noise of 4 mN being far below.
    intervals = stroke_intervals(strokes[4], 4, GAINS_ALONE)
    assert width(intervals.tau_max) / strokes[4].tau_max == pytest.approx(2 * 1.95996 * 0.02, rel=0.03)


def test_without_an_error_of_calibration_intervals_are_narrower(strokes):
    exact = stroke_intervals(strokes[0], 0, BootstrapSettings(gain_error=0.0))
    usual = stroke_intervals(strokes[0], 0)
    for name in NUMBERS:
        assert width(getattr(exact, name)) < width(getattr(usual, name))


def test_a_number_that_was_withheld_has_no_interval(strokes):
    intervals = stroke_intervals(replace(strokes[0], mu_dynamic=None, speed=None, mu_static=None), 0)
    assert (intervals.mu_dynamic, intervals.speed, intervals.mu_static) == (None, None, None)
    assert intervals.tau_max is not None
    assert stroke_intervals(replace(strokes[0], curve=None), 0).tau_max is None


def test_the_instants_of_a_held_finger_have_intervals_and_the_direction_is_sure(strokes):
    for number, stroke in enumerate(strokes):
        intervals = stroke_intervals(stroke, number)
        assert (intervals.break_away is None) == (stroke.break_away is None)
        assert intervals.direction_agrees == 1.0
        if intervals.break_away is not None:
            assert intervals.break_away[0] < stroke.break_away < intervals.break_away[1]
            assert width(intervals.break_away) < 0.01
            assert intervals.slide_onset[0] <= stroke.slide_onset <= intervals.slide_onset[1]
            assert stroke.break_away < intervals.slide_onset[1]


def drawn_stroke(time, normal=2.0, ratio=0.5, degrees=0.0, noise=0.0, curve=None, **changes):
    """Return a stroke in closed form over `time` (n,) [s] at an angle to the x axis, without noise of the forces.

    `normal` [N] and `ratio` [-] are numbers or courses (n,); the centre of pressure has white noise [mm].
    """
    full, way = np.ones(len(time)), np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    normal, tangential = normal * full, ratio * normal * full
    position = 25.0 * time[:, None] * way + np.random.default_rng(0).normal(0.0, noise, (len(time), 2))
    columns = (time, normal, normal, tangential, np.outer(tangential, way), ratio * full, position, 25.0 * full)
    loads = {"normal_force": normal.mean(), "tangential_force": tangential.mean(), "peak_normal": normal.max()}
    loads |= {"peak_tangential": tangential.max(), "tau_max": tangential.max() / 80.0, "contact_area": 80.0}
    numbers = {"mu_dynamic": np.mean(ratio), "mu_max": np.max(ratio), "zero_drift": 0.0, "area_exponent": 0.0}
    numbers |= {"direction": 1, "heading": degrees, "onset": None, "break_away": None, "slide_onset": None}
    curve = StrokeCurve(*columns, **{"noise": (0.0, 0.0), "quiet": 0.0, **(curve or {})})
    steady = (time[0], time[-1])
    return replace(strokes_of_a_visit()[0], curve=curve, steady=steady, **(loads | numbers | changes))


TWO_SECONDS = np.arange(400) / 200.0


def test_a_movement_nearly_across_leaves_its_sign_in_doubt():
    intervals = stroke_intervals(
        drawn_stroke(TWO_SECONDS, degrees=60.0, noise=0.3), 0
    )  # as far along x as the analysis asks for
    assert intervals.heading[0] < 60.0 < intervals.heading[1]
    assert 0.2 < intervals.direction_agrees < 0.8


@pytest.mark.parametrize("degrees", [45.0, 15.0])
def test_of_a_calibration_alone_a_heading_has_the_closed_form(degrees):
    intervals = stroke_intervals(drawn_stroke(TWO_SECONDS, degrees=degrees), 0, GAINS_ALONE)
    ratio = np.sqrt(2.0) * 0.02  # of the gains of two torques, of tan: d(angle) = sin(2 angle) / 2 d(log tan)
    half = np.degrees(1.95996 * ratio * np.sin(2.0 * np.radians(degrees)) / 2.0)
    assert width(intervals.heading) == pytest.approx(2.0 * half, rel=0.02)


@pytest.mark.parametrize("rule", ["maximum", "mean"])
def test_the_friction_of_a_repeat_is_the_ratio_of_its_forces(rule):
    small = BootstrapSettings(gain_error=0.001, cross_talk=0.001, tilt_error=(0.05, 0.05))  # so the first order is all
    draws = friction_draws(drawn_stroke(TWO_SECONDS, zero_drift=0.006), 0, rule, small)
    assert draws.mu.std() > 0.001
    assert draws.mu == pytest.approx(draws.tau_max * 80.0 / draws.normal_force, abs=0.005 * draws.mu.std())


def test_the_mean_of_a_force_that_climbs_is_that_of_a_window_cut_at_both_ends():
    time = np.arange(4000) / 200.0
    stroke = drawn_stroke(time, 2.0 + 0.05 * time)
    low, high = stroke_intervals(stroke, 0, replace(NO_ERROR, repeats=2000)).normal_force
    # Each end moves evenly by up to a fifth of 20 s, the middle by half their difference: a triangle of ±2 s.
    half = 0.05 * 2.0 * (1.0 - 0.05**0.5)
    assert (low, high) == pytest.approx(
        (stroke.normal_force - half, stroke.normal_force + half), abs=0.05 * 0.1
    )  # a block


def test_of_blocks_that_are_not_alike_the_interval_of_mu_is_students():
    ratio = np.where(np.arange(800) // 20 % 2, 0.52, 0.48)  # 40 blocks of 0.1 s that alternate
    stroke = drawn_stroke(np.arange(800) / 200.0, ratio=ratio)
    interval = stroke_intervals(stroke, 0, replace(NO_ERROR, inwards=0.0)).mu_dynamic
    expected = stats.t.interval(0.95, 39, 0.5, stats.sem(ratio[::20]))
    assert interval == pytest.approx(expected, abs=0.02 * width(expected))


def test_a_peak_that_readings_miss_lies_above_the_greatest_reading():
    stroke = drawn_stroke(TWO_SECONDS, curve={"crests": np.ones(400), "crest_gap": 0.1})
    intervals = stroke_intervals(stroke, 0, NO_ERROR)
    assert intervals.peak_tangential == pytest.approx((1.0025, 1.0975), abs=0.002)
    assert intervals.tau_max == pytest.approx((1.0025 / 80.0, 1.0975 / 80.0), rel=0.002)


def test_noise_lowers_a_peak_by_the_greatest_of_as_many_draws():
    curve = {"noise": (0.001, 0.002), "quiet": 1e9}  # [N]; of a zero that is known
    intervals = stroke_intervals(drawn_stroke(TWO_SECONDS, curve=curve), 0, NO_ERROR)
    # Filtered readings are independent every 25 ms: 80 of them. Their greatest strays about its mean, twice below.
    greatest = stats.norm.ppf(np.array([0.025, 0.975]) ** (1 / 80))
    mean = integrate.quad(lambda z: z * 80 * stats.norm.cdf(z) ** 79 * stats.norm.pdf(z), -8.0, 8.0)[0]
    for interval, force, noise in ((intervals.peak_normal, 2.0, 0.002), (intervals.peak_tangential, 1.0, 0.001)):
        assert interval == pytest.approx(force + noise * (greatest - 2.0 * mean), abs=0.05 * noise)


def test_a_drag_has_the_direction_of_its_force_however_small_it_is():
    forces = np.array([[0.03, -0.01], [np.nan, np.nan], [0.0, 0.05]])
    np.testing.assert_allclose(drag_direction(forces), [0.6, 0.8])
    np.testing.assert_allclose(drag_direction(np.zeros((2, 2))), [1.0, 0.0])  # there is none: along +x


def test_an_instant_that_a_person_decided_has_no_interval(strokes):
    sticking = next(stroke for stroke in strokes if stroke.break_away is not None)
    deciders = dict.fromkeys(("onset", "stick", "slide_onset"), "by E02")
    intervals = stroke_intervals(replace(sticking, decided=deciders), 0)
    assert (intervals.onset, intervals.break_away, intervals.slide_onset) == (None, None, None)


@pytest.mark.parametrize(
    ("blocks", "correlation"),
    [
        ([0.0, 0.0, 1.0, 1.0] * 2, 0.5),  # 1/8 between neighbours; less its bias in eight, (1/8 + 1/8) / (1 - 4/8)
        ([0.0, 1.0, 0.0, 0.0, 1.0], 0.0),  # five that hardly have a neighbour alike
        ([0.0, 1.0] * 4, 0.0),  # those that alternate are taken to be independent
        ([0.0, 0.0, 1.0, 1.0], 0.8),  # four say nothing of how alike they are
        (np.arange(20.0), 0.8),
    ],
)
def test_the_mean_of_few_alike_blocks_strays_as_an_autoregression_does(blocks, correlation):
    inflation, dof = mean_inflation(np.asarray(blocks), BootstrapSettings())
    independent = (1.0 - correlation) / (1.0 + correlation)
    assert inflation == pytest.approx(independent**-0.5)
    assert dof == pytest.approx(max(len(blocks) * independent - 1.0, 2.0))


def test_of_a_force_without_noise_the_onset_lies_anywhere_between_two_readings():
    time = np.arange(60) * 0.005
    force = 20.0 * np.maximum(time - 0.2013, 0.0)
    draws = onset_draws((time, force), 0.205, 1e-9, np.zeros(4000), BootstrapSettings(), np.random.default_rng(0))
    assert draws.min() == pytest.approx(0.2, abs=1e-5)
    assert draws.max() == pytest.approx(0.205, abs=1e-5)
    assert draws.mean() == pytest.approx(0.2025, abs=1e-4)


def test_an_onset_that_no_force_climbed_to_has_no_interval():
    time = np.arange(60) * 0.005
    draw = np.random.default_rng(0)
    assert (
        onset_draws((time, np.full(60, 2.0)), 0.205, 0.004, np.zeros(9), BootstrapSettings(), draw) is None
    )  # it touched before
    assert (
        onset_draws((time, 2.0 - 8.0 * time), 0.0, 0.004, np.zeros(9), BootstrapSettings(), draw) is None
    )  # the first reading


def test_a_finger_that_slid_when_its_speed_was_first_known_began_at_any_instant_since_the_contact(strokes):
    stroke = next(stroke for stroke in strokes if stroke.break_away is None)
    low, high = stroke_intervals(stroke, strokes.index(stroke)).slide_onset
    assert stroke.onset <= low < stroke.onset + 0.01
    assert low < stroke.slide_onset <= high


def truths(seed, truth):
    course = Course(SimulatedSubject(seed).stroke(truth.surface), truth.mu, truth.surface.holds)
    slant = course.stroke.slant
    normal = float(course.normal_force(np.linspace(*course.steady, 400)).mean())  # at full speed, fully pressed
    yield from (("normal_force", normal), ("tangential_force", truth.mu * normal))
    yield from (("mu_dynamic", truth.mu), ("tau_max", truth.tau_max), ("speed", truth.speed))
    yield from (("peak_normal", truth.peak_normal_force), ("peak_tangential", truth.mu * truth.peak_normal_force))
    yield "onset", truth.onset
    yield "heading", slant if truth.direction == 1 else slant + 180.0
    if truth.surface.holds:
        yield "break_away", truth.slip


def coverage_of(seeds, noise):
    """Return the share of strokes whose intervals hold the truth; each bench's gains are drawn with 1 %.

    `noise` is how many times the usual one. In one stroke of a hundred a number may be withheld.
    """
    coverage = defaultdict(list)
    for seed in seeds:
        a, b, c, d, e, f = np.random.default_rng([seed, 9]).normal(1.0, 0.01, 6).tolist()
        bench = BenchSettings(gains=(a, b, c, d, e, f), noise_force=0.004 * noise, noise_torque=0.05 * noise)
        visit = ground_truth.visit(seed, bench)
        for number, (stroke, truth) in enumerate(zip(visit.analyse().strokes, visit.strokes, strict=True)):
            intervals = stroke_intervals(stroke, number, BootstrapSettings(cross_talk=0.0, tilt_error=(0.0, 0.0)))
            for name, true_value in truths(seed, truth):
                low, high = getattr(intervals, name) or (None, None)
                if low is None:
                    coverage[name].append(None)
                    continue
                true_value += 360.0 * round((low - true_value) / 360.0) if name == "heading" else 0.0
                coverage[name].append(low <= true_value <= high)
    assert all(hits.count(None) <= 0.01 * len(hits) for hits in coverage.values())
    return {name: float(np.mean([hit for hit in hits if hit is not None])) for name, hits in coverage.items()}


@pytest.mark.slow
@pytest.mark.parametrize(("seeds", "noise"), [(range(1000, 1300), 1.0), (range(1300, 1500), 10.0)])
def test_intervals_of_hundreds_of_visits_hold_the_truth_90_to_98_times_in_a_hundred(seeds, noise):
    for name, share in coverage_of(seeds, noise).items():
        assert 0.90 <= share <= 0.98, (name, share)
