"""What a missing zero, a wrong frame, unit or height costs a stroke in closed form."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from closed_form import (
    CALIBRATION,
    COUNTS,
    HEIGHT,
    PLAIN,
    SETTINGS,
    N,
    T,
    analyse,
    block,
    names,
    noisy,
    with_info,
    wrench,
)
from scipy import stats

from sessions.plan.plan import Frame
from sessions.strokes import ZERO_SETTING, ZERO_STATED
from sessions.strokes.contacts import Contact
from sessions.strokes.span import zero_after, zero_before, zero_for
from sessions.strokes.stroke_measures import EVERYTHING

TENTHS = np.arange(100.0) / 10.0  # [s]
WINDOWS = np.array([[0, 20], [10, 30], [20, 40], [60, 80]])


def quiet(before=0.0, after=0.0, longest=10.0):
    """Return quiet windows over noise, with a force along x that is `before` up to 5 s and `after` from then on."""
    settings = replace(SETTINGS, zero=replace(SETTINGS.zero, zero_stretch=longest))
    readings = np.random.default_rng(8).normal(size=(100, 6))
    readings[:, 0] += np.where(TENTHS < 5.0, before, after)
    return SimpleNamespace(time=TENTHS, wrench=readings, smooth=readings, quiet=WINDOWS, settings=settings)


@pytest.mark.parametrize(
    ("zero", "readings"),
    [
        (zero_before(quiet(), 8.5), slice(60, 80)),  # the one before does not overlap
        (zero_before(quiet(), 6.0), slice(0, 40)),
        (zero_before(quiet(longest=2.95), 6.0), slice(10, 40)),  # all three last longer
        (zero_before(quiet(), 3.0), slice(0, 30)),
        (zero_after(quiet(), 0.5), slice(10, 40)),
        (zero_after(quiet(), 2.0), slice(60, 80)),  # a window has to begin after the instant
    ],
)
def test_a_zero_is_the_mean_of_overlapping_quiet_windows_with_its_standard_error(zero, readings):
    stretch = quiet().wrench[readings]
    assert (zero.start, zero.stop) == (TENTHS[readings][0], TENTHS[readings][-1])
    assert zero.level == pytest.approx(stretch.mean(axis=0))
    assert zero.error == pytest.approx(stats.sem(stretch))
    assert zero_before(quiet(), 1.9) is zero_after(quiet(), 6.0) is None


@pytest.mark.parametrize("step", [0.0, 12.0])
def test_a_zero_that_drifts_lies_half_way_with_the_deviation_of_a_uniform_distribution(step):
    span = quiet(after=step, longest=2.0)
    zero = zero_for(span, Contact(45, 55, 4.5, 5.5), np.zeros(100, bool))
    before, after = span.wrench[20:40], span.wrench[60:80]
    drift, noise = after.mean(axis=0) - before.mean(axis=0), np.hypot(stats.sem(before), stats.sem(after))
    assert zero.level == pytest.approx(before.mean(axis=0) + drift / 2.0)
    # of the mean of two zeros, and of a step that noise does not explain, uniformly anywhere between them
    beyond = np.maximum(drift**2 - noise**2, 0.0)
    assert zero.error == pytest.approx(np.sqrt((noise / 2.0) ** 2 + beyond / 12.0))
    assert (abs(drift[0]) / math.sqrt(12.0) == pytest.approx(zero.error[0], rel=0.01)) == bool(step)


def test_without_an_unloaded_stretch_there_are_no_numbers():
    inside = (T > 1.3) & (T < 2.8)
    n = 2.0 + 0.5 * np.sin(2 * np.pi * 2.0 * T)
    raw = noisy(wrench(T, n, 0.5 * np.ones_like(T), 20.0 * (T - 2.0)))[inside]
    analysis = analyse(block(T[inside], raw))
    assert "no_unloaded_stretch" in names(analysis, "refused")
    (stroke,) = analysis.strokes
    assert all(getattr(stroke, name) is None for name in EVERYTHING if name != "readings")


def test_without_an_unloaded_stretch_counts_do_not_even_show_a_contact():
    inside = (T > 1.3) & (T < 2.8)
    n = 2.0 + 0.5 * np.sin(2 * np.pi * 2.0 * T)
    raw = noisy(wrench(T, n, 0.5 * np.ones_like(T), 20.0 * (T - 2.0)))[inside] / np.diag(COUNTS.matrix)
    analysis = analyse(block(T[inside], raw), info=with_info(calibration=COUNTS))
    assert analysis.strokes == ()
    assert names(analysis, "refused") == {"no_unloaded_stretch"}


def test_a_zero_that_somebody_stated_is_used():
    inside = (T > 1.3) & (T < 2.8)
    raw = noisy(PLAIN)[inside]
    analysis = analyse(block(T[inside], raw), info=with_info(settings={ZERO_SETTING: ZERO_STATED}))
    (stroke,) = analysis.strokes
    assert stroke.mu_dynamic == pytest.approx(0.5, rel=0.01)
    assert stroke.zero == ZERO_STATED


def test_a_zero_that_moves_during_the_stroke_is_named_and_at_last_forbids_the_numbers():
    def with_step(newtons):
        step = np.zeros((len(T), 6))
        step[T > 2.0, 0] = newtons
        return analyse(block(T, noisy(PLAIN + step)))

    assert names(with_step(0.02)) == set()
    assert names(with_step(0.07)) == {"drift"}
    assert with_step(0.07).strokes[0].mu_dynamic is not None
    assert names(with_step(0.3), "refused") == {"drift"}
    assert with_step(0.3).strokes[0].mu_dynamic is None


def test_a_normal_axis_along_which_the_finger_pulls_is_refused():
    n = N * (1.0 + 0.2 * np.sin(2 * np.pi * 1.7 * T))
    raw = noisy(wrench(T, n, 0.5 * np.ones_like(T), 25.0 * (T - 2.0)))
    analysis = analyse(block(T, raw), frame=Frame("+z", "set", HEIGHT, "set"))
    assert analysis.strokes == ()
    assert names(analysis, "refused") == {"normal_axis_implausible"}


@pytest.mark.parametrize(("factor", "flaw"), [(1000.0, "units_implausible"), (0.001, "no_steady_sliding")])
def test_torques_in_the_wrong_unit_give_no_speed_and_no_proof_of_sliding(factor, flaw):
    raw = noisy(PLAIN)
    raw[:, 3:] *= factor
    (stroke,) = analyse(block(T, raw), info=with_info(calibration=wide())).strokes
    assert flaw in stroke.flaws
    assert stroke.speed is None
    assert stroke.mu_dynamic is None


def test_a_sentence_has_all_digits_of_a_force_in_a_wrong_unit():
    flaws = analyse(block(T, noisy(PLAIN) * 6170.0), info=with_info(calibration=wide())).flaws
    (sentence,) = [flaw.sentence for flaw in flaws if flaw.name == "units_implausible"]
    assert re.search(r"reaches 12\d{3} N, more than a finger presses", sentence)  # 6170 times 2 N, and filtered


def wide():
    return replace(CALIBRATION, rated=np.full(6, math.nan))


def test_a_height_nobody_stated_forbids_a_speed_that_depends_on_it():
    ratio = 0.5 + 0.04 * (T - 2.0)  # rises by 8 % a second
    raw = noisy(wrench(T, N, ratio, 7.0 * (T - 2.0)))
    (stroke,) = analyse(block(T, raw)).strokes
    (unknown,) = analyse(block(T, raw), frame=Frame("-z", "default", HEIGHT, "default")).strokes
    assert stroke.speed == pytest.approx(7.0, rel=0.05)
    assert unknown.speed is None
    assert unknown.reasons["speed"] == "height_unknown"


def test_a_height_nobody_stated_leaves_a_speed_that_hardly_depends_on_it():
    (stroke,) = analyse(block(T, noisy(PLAIN)), frame=Frame("-z", "default", 0.0, "default")).strokes
    assert stroke.speed == pytest.approx(25.0, rel=0.01)
