"""Strokes: found, bounded, timed; forces in the face frame; steady windows and speed. Truth is in closed form."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from closed_form import (
    COUNTS,
    HEIGHT,
    PLAIN,
    SETTINGS,
    T,
    analyse,
    block,
    names,
    noisy,
    slide,
    times,
    trapezium,
    trial,
    with_info,
    wrench,
)
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter
from scipy.stats import linregress

from sessions.plan.plan import Frame
from sessions.strokes.bootstrap import BootstrapSettings, stroke_intervals
from sessions.strokes.forces import Filter, centre_of_pressure, friction_ratio, in_face_frame, normal_force
from sessions.strokes.sliding import displacement, movement, steady_window
from sessions.strokes.stroke import StrokeCurve


def steadily(**changes):
    return replace(SETTINGS, steady=replace(SETTINGS.steady, **changes))


def test_a_speed_has_the_standard_error_and_the_r_squared_of_its_regression():
    time = np.arange(12.0) * SETTINGS.filter.block
    place = 20.0 * time + np.random.default_rng(4).normal(size=12)
    line = linregress(time, place)
    motion = movement(time, np.column_stack([0.6 * place, 0.8 * place]), 1.0 / SETTINGS.filter.block, SETTINGS)
    assert motion.along == pytest.approx((0.6 * line.slope, 0.8 * line.slope))
    assert (motion.speed, motion.error) == pytest.approx((line.slope, line.stderr))
    assert motion.explained == pytest.approx(line.rvalue**2)
    assert displacement(np.array([[0.0, 0.0], [3.0, 4.0]])) == 5.0
    assert np.isnan(displacement(np.array([[1.0, 2.0]])))


def test_a_plain_stroke_comes_back_without_a_flaw():
    analysis = analyse(block(T, noisy(PLAIN)))
    assert names(analysis) == set()
    (stroke,) = analysis.strokes
    assert stroke.onset == pytest.approx(1.0, abs=0.01)
    assert stroke.lift == pytest.approx(3.0, abs=0.01)
    assert stroke.speed == pytest.approx(25.0, rel=0.01)
    assert stroke.speed_error < 0.25
    assert stroke.direction == 1
    inside = (stroke.steady[0] <= T) & (stroke.steady[1] >= T)
    force = trapezium(T, 1.0, 3.0, 0.1, 2.0)[inside].mean()
    assert stroke.normal_force == pytest.approx(force, rel=0.005)
    assert stroke.tangential_force == pytest.approx(0.5 * force, rel=0.005)
    assert stroke.steady[0] > 1.0
    assert stroke.steady[1] < 3.0
    assert stroke.steady[1] - stroke.steady[0] > 1.5


def test_direction_is_minus_one_towards_the_hand():
    assert analyse(block(T, noisy(slide(T, direction=-1)))).strokes[0].direction == -1


def test_the_speed_along_a_slanted_path_is_the_whole_speed():
    along = 30.0 * (T - 2.0)
    n = trapezium(T, 1.0, 3.0, 0.1, 2.0)
    c, s = np.cos(0.4), np.sin(0.4)
    rotated = wrench(T, n, 0.5 * np.ones_like(T), along)
    rotated[:, [0, 1]] = rotated[:, :2] @ np.array([[c, s], [-s, c]])
    rotated[:, [3, 4]] = rotated[:, 3:5] @ np.array([[c, s], [-s, c]])
    assert analyse(block(T, noisy(rotated))).strokes[0].speed == pytest.approx(30.0, rel=0.01)


@pytest.mark.parametrize("offset", [0.0, 3.0, -11.0])
def test_an_offset_of_every_axis_changes_nothing(offset):
    plain = analyse(block(T, noisy(PLAIN))).strokes[0]
    other = analyse(block(T, noisy(PLAIN, offset=np.full(6, offset)))).strokes[0]
    assert other.mu_dynamic == pytest.approx(plain.mu_dynamic, abs=1e-9)
    assert other.speed == pytest.approx(plain.speed, abs=1e-6)
    assert other.onset == plain.onset


def test_counts_become_newtons_by_the_calibration():
    analysis = analyse(block(T, np.rint(noisy(PLAIN) / np.diag(COUNTS.matrix))), info=with_info(calibration=COUNTS))
    assert analysis.strokes[0].peak_normal == pytest.approx(2.0, rel=0.01)
    assert names(analysis) == set()


def test_two_strokes_with_a_lift_between_are_two():
    t = times(8.0)
    two_strokes = noisy(slide(t, begin=1.0, end=3.0) + slide(t, begin=5.0, end=7.0, direction=-1))
    analysis = analyse(block(t, two_strokes))
    assert [s.direction for s in analysis.strokes] == [1, -1]
    assert names(analysis) == set()
    assert "second_stroke" in names(analyse(block(t, two_strokes), of=trial()))


def test_strokes_told_apart_by_a_valley_alone_say_so():
    t = times(8.0)
    dip = 3.0 - 2.8 * trapezium(t, 3.6, 4.4, 0.2)  # from 3 N down to 0.2 N and back
    n = trapezium(t, 1.0, 7.0, 0.1) * dip
    analysis = analyse(block(t, noisy(wrench(t, n, 0.5 * np.ones_like(t), 10.0 * (t - 4.0)))))
    assert len(analysis.strokes) == 2
    assert all("not_lifted_between" in s.flaws for s in analysis.strokes)
    assert analysis.strokes[0].lift == pytest.approx(3.6 + 0.2 * 2.4 / 2.8, abs=0.02)  # 0.6 N, a fifth of the peak


def test_a_wandering_force_is_one_stroke():
    n = trapezium(T, 1.0, 3.0, 0.1) * (2.0 + 1.2 * np.sin(2 * np.pi * 1.5 * T))
    analysis = analyse(block(T, noisy(wrench(T, n, 0.5 * np.ones_like(T), 20.0 * (T - 2.0)))))
    assert len(analysis.strokes) == 1
    assert analysis.strokes[0].mu_dynamic == pytest.approx(0.5, rel=0.01)


def test_a_tap_and_a_light_touch_are_named_and_are_no_strokes():
    t = times(8.0)
    tap = wrench(t, trapezium(t, 5.0, 5.12, 0.02, 2.0), 0.1 * np.ones_like(t), np.zeros_like(t))
    brush = wrench(t, trapezium(t, 6.0, 7.0, 0.1, 0.2), 0.1 * np.ones_like(t), np.zeros_like(t))
    analysis = analyse(block(t, noisy(slide(t) + tap + brush)), of=trial())
    assert len(analysis.strokes) == 1
    assert [flaw.name for flaw in analysis.flaws] == ["tap", "light_touch"]


def test_a_recording_that_begins_in_contact_has_no_onset_and_its_zero_from_after():
    early = T >= 1.5
    analysis = analyse(block(T[early], noisy(PLAIN)[early]))
    (stroke,) = analysis.strokes
    assert stroke.onset is None
    assert stroke.lift == pytest.approx(3.0, abs=0.01)
    assert {"begins_in_contact", "zero_after_contact"} <= set(stroke.flaws)
    assert stroke.mu_dynamic == pytest.approx(0.5, rel=0.01)


def test_a_recording_that_ends_in_contact_has_no_lift():
    late = T <= 2.5
    (stroke,) = analyse(block(T[late], noisy(PLAIN)[late])).strokes
    assert stroke.lift is None
    assert "ends_in_contact" in stroke.flaws


def test_onset_is_the_same_live_and_offline():
    from sessions.strokes.contacts import ContactDetector

    raw = noisy(PLAIN)
    live = ContactDetector().feed(T, normal_force(raw, Frame("-z")))
    (stroke,) = analyse(block(T, raw)).strokes
    assert abs(stroke.onset - live[0].time) <= 1 / 200
    assert abs(stroke.lift - live[1].time) <= 1 / 200


def test_nothing_touching_is_no_stroke_and_says_so():
    analysis = analyse(block(T, noisy(np.zeros((len(T), 6)))), of=trial())
    assert analysis.strokes == ()
    assert names(analysis, "refused") == {"no_stroke"}


# The centre of pressure and the frame


@given(x=st.floats(-40, 40), y=st.floats(-40, 40), n=st.floats(0.5, 30), mu=st.floats(0, 2), h=st.floats(-50, 50))
def test_the_centre_of_pressure_is_where_the_force_was_put(x, y, n, mu, h):
    ones = np.ones(1)
    applied = wrench(0 * ones, n * ones, mu * ones, x * ones, across=y, height=h)
    assert centre_of_pressure(applied, h)[0] == pytest.approx([x, y], abs=1e-9)


@pytest.mark.parametrize("normal", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_whatever_the_normal_axis_pressing_is_the_same_force_and_turns_nothing_else(normal):
    raw = np.zeros((1, 6))
    raw[0, "xyz".index(normal[1])] = 3.0 if normal[0] == "+" else -3.0
    rotated = in_face_frame(raw, Frame(normal))
    assert rotated[0].tolist() == pytest.approx([0, 0, -3.0, 0, 0, 0])
    assert normal_force(raw, Frame(normal))[0] == 3.0


@given(st.sampled_from(["+x", "-x", "+y", "-y", "+z", "-z"]), st.lists(st.floats(-9, 9), min_size=6, max_size=6))
def test_turning_into_the_face_frame_is_a_rotation(normal, values):
    raw = np.array([values])
    rotated = in_face_frame(raw, Frame(normal))[0]
    force, torque = raw[0, :3], raw[0, 3:]
    assert np.linalg.norm(rotated[:3]) == pytest.approx(np.linalg.norm(force))
    assert rotated[:3] @ rotated[3:] == pytest.approx(force @ torque)  # a mirror would turn its sign
    assert rotated[2] == pytest.approx(-normal_force(raw, Frame(normal))[0])


def test_a_stroke_on_any_axis_has_the_same_friction():
    raw = noisy(PLAIN)
    cycled = raw[:, [2, 0, 1, 5, 3, 4]]  # the transducer mounted with its x axis out of the face
    rotated = analyse(block(T, cycled), frame=Frame("-x", "set", HEIGHT, "set")).strokes[0]
    other = analyse(block(T, raw)).strokes[0]
    assert (rotated.mu_dynamic, rotated.speed) == pytest.approx((other.mu_dynamic, other.speed))


def test_the_ratio_means_nothing_below_the_floor():
    ratio = friction_ratio(np.array([[0.1, 0, -0.2, 0, 0, 0], [3, 4, -10, 0, 0, 0]]), 0.3)
    assert np.isnan(ratio[0])
    assert ratio[1] == 0.5


# The filter


def test_the_filter_is_down_three_decibels_at_its_cut_off_without_delay():
    t = times(10.0)
    wave = np.cos(2 * np.pi * 20.0 * (t - 5.0))[:, None]
    out = Filter(20.0, 12).apply(wave, 200.0, [slice(0, len(t))])[:, 0]
    assert out[1000] == pytest.approx(1 / np.sqrt(2), rel=2e-3)  # the crest stays where it was
    assert np.argmax(out[995:1006]) == 5


def test_the_filter_keeps_a_constant_and_never_reaches_across_a_gap():
    values = np.concatenate([np.zeros(100), np.ones(100)])[:, None]
    out = Filter(20.0, 12).apply(values, 200.0, [slice(0, 100), slice(100, 200)])
    assert np.allclose(out, values, atol=1e-12)


def test_too_short_a_stretch_has_no_filtered_value():
    assert np.isnan(Filter(20.0, 12).apply(np.ones((8, 1)), 200.0, [slice(0, 8)])).all()


# Steady windows, means and speed


def test_the_steady_window_leaves_ramps_out():
    ratio = np.concatenate([np.linspace(0, 0.5, 100), np.full(300, 0.5), np.linspace(0.5, 0.2, 60)])
    window = steady_window(ratio, 200.0, len(ratio), SETTINGS)
    assert 90 <= window.start <= 105
    assert 395 <= window.stop <= 410
    assert ratio[window].mean() == pytest.approx(0.5, rel=0.005)


@pytest.mark.parametrize(("scatter", "stop"), [(1.5, 599), (2.0, 600)])
def test_the_steady_window_ends_where_the_ratio_lies_within_so_many_deviations_of_its_median(scatter, stop):
    # Spread evenly over ±0.08: the median deviation is 0.04, and by the normal law the standard deviation 0.0593.
    ratio = 0.5 + np.random.default_rng(6).permutation(np.linspace(-0.08, 0.08, 600))
    ratio[0], ratio[-1] = 0.5, 0.6
    assert steady_window(ratio, 200.0, 600, steadily(steady_scatter=scatter)) == slice(0, stop)


def test_a_ratio_that_never_settles_has_no_steady_window():
    t = times(3.0)
    assert steady_window(0.3 + 0.2 * np.sin(2 * np.pi * 1.1 * t), 200.0, len(t), SETTINGS) is None
    assert steady_window(np.linspace(0.2, 0.8, 600), 200.0, 600, SETTINGS) is None


def two_levels():
    """Return T/N of a slide whose first 320 readings scatter by 6 % of 0.5 and whose last 280 by 1 % of 0.7."""
    draw = np.random.default_rng(3)
    return np.concatenate([0.5 + 0.03 * draw.standard_normal(320), 0.7 + 0.007 * draw.standard_normal(280)])


def test_the_steady_window_grows_from_that_part_of_the_slide_in_which_the_ratio_varies_least():
    """The longest steady stretch would be the first level."""
    window = steady_window(two_levels(), 200.0, 600, steadily(steady_seed=0.4))
    assert 310 <= window.start <= 325
    assert window.stop == 600
    even = 0.5 + 0.01 * np.random.default_rng(4).standard_normal(600)
    window = steady_window(even, 200.0, 600, SETTINGS)
    assert window.stop - window.start > 590  # all of it, not the half


def test_the_stretch_of_least_variance_has_the_wanted_length_and_no_other_of_that_length_varies_less():
    draw = np.random.default_rng(5)
    ratio = 0.5 + 0.02 * (1.5 + np.sin(np.arange(600) / 70.0)) * draw.standard_normal(600)
    window = steady_window(ratio, 200.0, 600, steadily(steady_rule="least variance"))
    assert 295 <= window.stop - window.start <= 306
    every = [ratio[start : start + 300].var() for start in range(0, 301, 5)]
    assert ratio[window].var() == pytest.approx(min(every), rel=0.02)


def test_the_middle_half_and_the_whole_slide_ask_for_no_steadiness():
    ratio = np.concatenate([np.full(100, np.nan), np.linspace(0.2, 0.8, 400), np.full(100, np.nan)])
    windows = {
        rule: steady_window(ratio, 200.0, 600, steadily(steady_rule=rule))
        for rule in ("middle half", "whole slide", "least variance", "widened")
    }
    assert (windows["least variance"], windows["widened"]) == (None, None)
    assert (windows["middle half"], windows["whole slide"]) == (slice(200, 400), slice(100, 500))


@cache
def plain_stroke():
    (stroke,) = analyse(block(T, noisy(PLAIN))).strokes
    return stroke


def interval_of_mean(ratio):
    """Return the interval of the mean of T/N (n,) at 200 readings a second, of an exact bench."""
    ones, n = np.ones(len(ratio)), len(ratio)
    columns = (np.arange(n) / 200.0, 2 * ones, 2 * ones, 2 * ratio, np.outer(2 * ratio, [1, 0]), ratio)
    curve = StrokeCurve(*columns, np.zeros((n, 2)), ones, noise=(0.0, 0.0), quiet=1.0)
    steady, mean = (0.0, float(columns[0][-1])), float(ratio.mean())
    plain = plain_stroke()
    exact = BootstrapSettings(repeats=500, gain_error=0.0, cross_talk=0.0, tilt_error=(0.0, 0.0))
    bare = replace(plain, curve=curve, steady=steady, mu_dynamic=mean, zero_drift=None, speed=None, break_away=None)
    return stroke_intervals(
        replace(bare, heading=None, slide_onset=None, tau_max=None, onset=None), 0, exact
    ).mu_dynamic


def test_a_mean_of_white_noise_lies_in_its_interval_as_often_as_it_says():
    draw = np.random.default_rng(1)
    ends = [interval_of_mean(0.5 + 0.05 * draw.standard_normal(300)) for _ in range(400)]
    assert 0.90 <= np.mean([low <= 0.5 <= high for low, high in ends]) <= 0.98


SLOW = pytest.mark.slow


@pytest.mark.parametrize("correlation_time", [0.2, *(pytest.param(one, marks=SLOW) for one in (0.05, 0.1, 0.4))])  # [s]
def test_a_mean_of_a_ratio_that_wanders_lies_in_its_interval_as_often_as_it_says(correlation_time):
    draw, memory = np.random.default_rng(2), np.exp(-1 / (200.0 * correlation_time))
    steps = draw.standard_normal((400, 800)) * np.sqrt(1.0 - memory**2)
    wandering = lfilter([1.0], [1.0, -memory], steps, axis=1)[:, 400:]
    ends = [interval_of_mean(0.5 + 0.02 * noise) for noise in wandering]
    assert 0.90 <= np.mean([low <= 0.5 <= high for low, high in ends]) <= 0.98


def test_an_even_movement_is_all_explained_and_exact():
    t = times(1.0)
    fit = movement(t, np.column_stack([3.0 * t, -4.0 * t]), 200.0, SETTINGS)
    assert fit.speed == pytest.approx(5.0)
    assert fit.along == pytest.approx((3.0, -4.0))
    assert fit.explained == pytest.approx(1.0)


def test_a_curve_reaches_beyond_the_stroke_and_cannot_be_written_to():
    (stroke,) = analyse(block(T, noisy(PLAIN))).strokes
    assert stroke.curve.time[0] < stroke.onset < stroke.lift < stroke.curve.time[-1]
    with pytest.raises(ValueError, match="read-only"):
        stroke.curve.ratio[0] = 1.0
