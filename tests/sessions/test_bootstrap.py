"""Intervals of a stroke: the same from the same seed, wide for the reasons they name, and true as often as they say."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sessions.analysis.bootstrap import BootstrapSettings, stroke_intervals
from simulators.bench import BenchSettings

PLANTED = Path(__file__).parents[1] / "end_to_end" / "test_planted_truth.py"
_spec = importlib.util.spec_from_file_location("planted_truth", PLANTED)
assert _spec is not None
assert _spec.loader is not None
planted_truth = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(planted_truth)

NUMBERS = ("mu_dynamic", "mu_max", "tau_max", "speed")


@pytest.fixture(scope="module")
def strokes():
    return planted_truth.visit(1).analysed().strokes


def width(interval):
    return interval[1] - interval[0]


def test_the_same_seed_gives_the_same_bits_and_another_seed_others(strokes):
    once, again = (stroke_intervals(strokes[0], 0) for _ in range(2))
    other = stroke_intervals(strokes[0], 0, BootstrapSettings(seed=1))
    assert once == again
    assert once.mu_dynamic != other.mu_dynamic


def test_every_number_lies_in_its_interval(strokes):
    for number, stroke in enumerate(strokes):
        found = stroke_intervals(stroke, number)
        for name in NUMBERS:
            low, high = getattr(found, name)
            assert low < getattr(stroke, name) < high


def test_of_a_calibration_alone_tau_max_has_the_closed_form(strokes):
    # The gain of a long-known force, normal with 2 %: 1.96 * 2 % to both sides, noise of 4 mN being far below.
    found = stroke_intervals(strokes[4], 4, BootstrapSettings(repeats=20000, gain_error=0.02))
    assert width(found.tau_max) / strokes[4].tau_max == pytest.approx(2 * 1.95996 * 0.02, rel=0.03)


def test_without_an_error_of_calibration_intervals_are_narrower(strokes):
    exact = stroke_intervals(strokes[0], 0, BootstrapSettings(gain_error=0.0))
    usual = stroke_intervals(strokes[0], 0)
    for name in NUMBERS:
        assert width(getattr(exact, name)) < width(getattr(usual, name))


def test_a_number_that_was_withheld_has_no_interval(strokes):
    found = stroke_intervals(replace(strokes[0], mu_dynamic=None, speed=None, mu_static=None), 0)
    assert (found.mu_dynamic, found.speed, found.mu_static) == (None, None, None)
    assert found.tau_max is not None
    assert stroke_intervals(replace(strokes[0], curve=None), 0).tau_max is None


def covered(seeds):
    """Return the share of strokes whose intervals hold the truth; each bench's gains are drawn with 1 %."""
    held = {name: [] for name in ("mu_dynamic", "tau_max", "speed")}
    for seed in seeds:
        a, b, c, d, e, f = np.random.default_rng([seed, 9]).normal(1.0, 0.01, 6).tolist()
        visit = planted_truth.visit(seed, BenchSettings(gains=(a, b, c, d, e, f)))
        for number, (stroke, truth) in enumerate(zip(visit.analysed().strokes, visit.planted, strict=True)):
            found = stroke_intervals(stroke, number)
            for name, planted in (("mu_dynamic", truth.mu), ("tau_max", truth.tau_max), ("speed", truth.speed)):
                low, high = getattr(found, name)
                held[name].append(low <= planted <= high)
    return {name: float(np.mean(hits)) for name, hits in held.items()}


@pytest.mark.slow
def test_intervals_of_400_visits_hold_the_truth_90_to_98_times_in_a_hundred():
    for name, share in covered(range(1000, 1400)).items():
        assert 0.90 <= share <= 0.98, (name, share)
