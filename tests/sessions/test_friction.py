"""Friction of a stroke and what forbids it: every flaw, from strokes in closed form."""

import json
from dataclasses import replace

import numpy as np
import pytest
from closed_form import PLAIN, SETTINGS, N, T, analyse, block, names, noisy, slide, times, trapezium, trial, wrench

from sessions.strokes import FlawName
from sessions.strokes.settings import SystematicSettings
from sessions.strokes.stroke import rule_for
from sessions.strokes.stroke_measures import EVERYTHING


def sticking(mu=0.6, peak=None, stick=0.5):
    """Return T/N and the path of a finger that sticks from 1.0 to 1.5 s, then slides; `peak` is a static peak."""
    ratio = mu * np.clip((T - 1.0) / stick, 0, 1)
    if peak is not None:
        ratio += (peak - mu) * np.exp(-(((T - 1.0 - stick) / 0.03) ** 2))
    return wrench(T, N, ratio, 20.0 * np.maximum(T - 1.0 - stick, 0.0) - 15.0)


# Numbers


@pytest.mark.parametrize("mu", [0.1, 0.24, 0.67, 1.8])
def test_mu_dynamic_is_the_ratio_and_lies_in_its_interval(mu):
    exact = replace(SETTINGS, gain_error=0.0, systematic=SystematicSettings(tilt_prior=0.0))
    (stroke,) = analyse(block(T, noisy(slide(T, mu=mu))), settings=exact).strokes
    assert stroke.mu_dynamic == pytest.approx(mu, rel=0.005)
    low, high = stroke.mu_dynamic_interval
    assert low < stroke.mu_dynamic < high
    assert high - low < 0.02 * mu


@pytest.mark.parametrize(("gain_error", "axis_error"), [(None, 0.01), (0.02, 0.02)])
def test_the_interval_of_mu_holds_the_calibrations_error_of_both_axes(gain_error, axis_error):
    alone = SystematicSettings(cross_talk=0.0, tilt_prior=0.0)
    analysis = analyse(block(T, noisy(slide(T))), settings=replace(SETTINGS, gain_error=gain_error, systematic=alone))
    low, high = analysis.strokes[0].mu_dynamic_interval
    # A ratio of two gains, each off by `axis_error`; noise is far below, and 1000 draws tell to 5 %.
    assert (high - low) / 2.0 == pytest.approx(1.95996 * 2.0**0.5 * axis_error * 0.5, rel=0.1)
    assert analysis.friction[0].mu_interval == (low, high)
    assert f"{100 * axis_error:g} % of each axis" in analysis.to_dict()["interval"]


@pytest.mark.parametrize(("cross_talk", "tilt"), [(0.02, 0.0), (0.0, 2.0)])
def test_cross_talk_and_lean_widen_the_intervals_of_mu_and_tau_max_as_the_closed_form_says(cross_talk, tilt):
    alone = SystematicSettings(cross_talk=cross_talk, tilt_prior=tilt)
    analysis = analyse(block(T, noisy(slide(T))), settings=replace(SETTINGS, gain_error=0.0, systematic=alone))
    (stroke,) = analysis.strokes
    # Cross-talk c of its own into either force: d(T/N) = c sqrt(1 + mu^4). A lean e turns both: d(T/N) = e (1 + mu^2).
    # T itself changes by either share of N = 2 N over 100 mm2.
    lean = np.radians(tilt)
    mu_error = cross_talk * np.hypot(1.0, 0.5**2) + lean * (1.0 + 0.5**2)
    low, high = stroke.mu_dynamic_interval
    assert (high - low) / 2.0 == pytest.approx(1.95996 * mu_error, rel=0.1)
    low, high = analysis.intervals[0].tau_max
    assert (high - low) / 2.0 == pytest.approx(1.95996 * (cross_talk + lean) * 2.0 / 100.0, rel=0.1)


@pytest.mark.parametrize("benches", [15, pytest.param(60, marks=pytest.mark.slow)])
def test_of_benches_whose_gains_are_off_the_interval_of_mu_holds_the_true_one_in_nine_of_ten(benches):
    draw = np.random.default_rng(3)
    coverage = []
    for seed in range(benches):
        gains = np.concatenate([1.0 + 0.01 * draw.standard_normal(3), np.ones(3)])
        (stroke,) = analyse(block(T, noisy(slide(T, mu=0.48) * gains, seed))).strokes
        coverage.append(stroke.mu_dynamic_interval[0] <= 0.48 <= stroke.mu_dynamic_interval[1])
    assert np.mean(coverage) >= 0.9


def test_tau_max_is_the_peak_tangential_force_over_the_contact_area():
    n = N + 1.5 * np.exp(-(((T - 2.0) / 0.25) ** 2))
    (stroke,) = analyse(block(T, noisy(wrench(T, n * (N > 0), 0.4 * np.ones_like(T), 25.0 * (T - 2.0))))).strokes
    assert stroke.peak_tangential == pytest.approx(0.4 * 3.5, rel=0.01)
    assert stroke.tau_max == pytest.approx(0.4 * 3.5 / 100.0, rel=0.01)  # MPa over 100 mm2


def test_a_static_peak_is_given_where_one_stands_out():
    (stroke,) = analyse(block(T, noisy(sticking(peak=0.85)))).strokes
    assert stroke.mu_static == pytest.approx(0.85, rel=0.05)
    assert stroke.mu_dynamic == pytest.approx(0.6, rel=0.01)


def test_without_a_static_peak_there_is_none_and_the_reason_says_so():
    (stroke,) = analyse(block(T, noisy(sticking()))).strokes
    assert stroke.mu_static is None
    assert stroke.reasons["mu_static"] == "no static peak stands out"


def test_the_slide_begins_where_the_finger_begins_to_move():
    (stroke,) = analyse(block(T, noisy(sticking()))).strokes
    assert stroke.slide_onset == pytest.approx(1.5, abs=0.05)
    assert stroke.steady[0] >= 1.45


def test_the_maximum_is_hardly_raised_by_noise():
    for seed in range(20):
        (stroke,) = analyse(block(T, noisy(sticking(mu=0.28), seed=seed))).strokes
        assert stroke.mu_max == pytest.approx(0.28, rel=0.01)


# What the model gets


def test_stickiness_gets_the_maximum_and_slipperiness_the_mean():
    raw = block(T, noisy(sticking(peak=0.9)))
    (sticky,) = analyse(raw, of=trial("stickiness")).friction
    (slippery,) = analyse(raw, of=trial("slipperiness")).friction
    assert (sticky.rule, slippery.rule) == ("maximum", "mean over steady window")
    assert sticky.mu > slippery.mu
    assert slippery.mu == pytest.approx(0.6, rel=0.01)
    assert sticky.mu_interval[0] < sticky.mu < sticky.mu_interval[1]
    assert slippery.mu_interval[0] < slippery.mu < slippery.mu_interval[1]


def test_another_descriptor_is_judged_by_direction_and_no_plan_gets_the_mean():
    assert rule_for(trial("roughness", direction=1)) == "maximum"
    assert rule_for(trial("roughness", direction=-1)) == "mean over steady window"
    assert rule_for(None) == "mean over steady window"


# Flaws of the readings


def test_lost_readings_are_counted_and_cost_nothing_where_they_are_few():
    present = np.ones(len(T), bool)
    present[[300, 301, 450]] = False
    analysis = analyse(block(T[present], noisy(PLAIN)[present], sequence=np.flatnonzero(present)))
    assert names(analysis) == {"lost_readings"}
    assert "3 readings" in analysis.flaws[0].sentence
    assert analysis.strokes[0].tau_max == pytest.approx(0.01, rel=0.01)


def test_a_rate_that_changes_midway_is_named_and_costs_no_stroke():
    t = times(8.0)
    raw = noisy(slide(t, mu=0.5) + slide(t, mu=0.3, begin=5.0, end=7.0))
    later = np.concatenate([t[t < 4.0], 4.0 + np.arange(1600) / 400.0])  # 200 Hz, then 400 Hz, both in true time
    analysis = analyse(block(later, np.column_stack([np.interp(later, t, column) for column in raw.T])))
    assert [stroke.mu_dynamic for stroke in analysis.strokes] == pytest.approx([0.5, 0.3], rel=0.01)
    assert "irregular_time" in names(analysis)


def test_a_long_gap_in_the_stroke_withholds_its_peaks_but_not_its_mean():
    present = np.ones(len(T), bool)
    present[400:430] = False
    (stroke,) = analyse(block(T[present], noisy(PLAIN)[present], sequence=np.flatnonzero(present))).strokes
    assert stroke.tau_max is None
    assert stroke.mu_max is None
    assert stroke.reasons["tau_max"] == "lost_readings"
    assert stroke.mu_dynamic == pytest.approx(0.5, rel=0.01)


def test_saturation_withholds_the_peaks():
    t = times()
    n = trapezium(t, 1.0, 3.0, 0.1, 30.0) + 10.0 * np.exp(-(((t - 2.0) / 0.2) ** 2))
    raw = noisy(wrench(t, n * (n > 0.01), 0.2 * np.ones_like(t), 25.0 * (t - 2.0)))
    raw[:, 2] = np.clip(raw[:, 2], -36.001, 36.001)
    (stroke,) = analyse(block(t, raw)).strokes
    assert "saturated" in stroke.flaws
    assert stroke.tau_max is None
    assert stroke.peak_normal is None


def test_readings_the_device_calls_invalid_are_left_out():
    status = np.zeros(len(T), np.int64)
    status[400:404] = 1 << 17
    raw = noisy(PLAIN)
    raw[400:404] = 0.0
    analysis = analyse(block(T, raw, status=status))
    assert len(analysis.strokes) == 1
    assert "saturated" in names(analysis)


def test_a_frozen_stretch_is_left_out_and_named():
    raw = noisy(PLAIN)
    raw[420:460] = raw[419]
    analysis = analyse(block(T, raw))
    assert "frozen_sensor" in names(analysis)
    assert analysis.strokes[0].tau_max is None
    assert analysis.strokes[0].mu_dynamic == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize(
    ("part", "value", "flaw"),
    [(np.s_[200:], noisy(PLAIN)[199], "frozen_sensor"), (np.s_[:, 0], 0.0, "dead_sensor")],
)
def test_a_sensor_frozen_most_of_the_time_or_with_a_dead_force_axis_is_refused(part, value, flaw):
    raw = noisy(PLAIN)
    raw[part] = value
    analysis = analyse(block(T, raw))
    assert analysis.strokes == ()
    assert names(analysis, "refused") == {flaw}


def test_time_that_stands_still_is_refused():
    analysis = analyse(block(np.zeros(len(T)), noisy(PLAIN)))
    assert analysis.strokes == ()
    assert names(analysis, "refused") == {"unknown_rate"}


def test_uneven_time_is_named_and_nothing_is_filtered():
    uneven = T + np.random.default_rng(3).uniform(0, 0.002, len(T))
    analysis = analyse(block(uneven, noisy(PLAIN)))
    assert "irregular_time" in names(analysis)
    assert analysis.filtered.startswith("not filtered")
    assert analysis.strokes[0].mu_dynamic == pytest.approx(0.5, rel=0.01)


def test_too_few_readings_are_no_stroke():
    assert names(analyse(block(T[:5], noisy(PLAIN)[:5])), "refused") == {"no_stroke"}


# Flaws of the stroke


def test_too_little_force_gives_no_friction():
    analysis = analyse(block(T, noisy(slide(T, newtons=0.2))))
    assert "too_little_force" in names(analysis, "refused")
    assert analysis.strokes[0].mu_dynamic is None
    assert analysis.strokes[0].tau_max is None


def test_a_press_that_does_not_slide_gives_no_friction():
    analysis = analyse(block(T, noisy(wrench(T, N, 0.3 * np.ones_like(T), np.zeros_like(T)))))
    assert names(analysis, "refused") == {"no_steady_sliding"}
    assert analysis.strokes[0].mu_dynamic is None
    assert analysis.strokes[0].peak_normal == pytest.approx(2.0, rel=0.01)


def test_a_ratio_that_never_settles_gives_no_friction():
    ratio = 0.4 + 0.2 * np.sin(2 * np.pi * 1.3 * T)
    analysis = analyse(block(T, noisy(wrench(T, N, ratio, 25.0 * (T - 2.0)))))
    assert names(analysis, "refused") == {"no_steady_sliding"}
    assert analysis.strokes[0].tau_max is None


def test_a_side_load_at_low_force_is_named_and_does_not_make_the_maximum():
    n = trapezium(T, 1.0, 3.0, 0.4, 3.0)
    ratio = np.where(T < 1.12, 1.6, 0.5)  # up to 0.9 N of 3 N
    analysis = analyse(block(T, noisy(wrench(T, n, ratio, 25.0 * (T - 2.0)))))
    assert "ratio_above_one_at_low_force" in names(analysis)
    assert analysis.strokes[0].mu_max == pytest.approx(0.5, rel=0.02)


def test_a_ratio_above_one_throughout_is_doubted_and_given():
    analysis = analyse(block(T, noisy(slide(T, mu=1.4))))
    assert names(analysis) == names(analysis, "doubtful") == {"ratio_above_one"}
    assert analysis.strokes[0].mu_dynamic == pytest.approx(1.4, rel=0.01)


def test_coarse_torques_give_no_speed():
    raw = noisy(slide(T, speed=10.0))
    raw[:, 3:] = np.round(raw[:, 3:] / 20.0) * 20.0  # 20 N mm: 10 mm at 2 N
    (stroke,) = analyse(block(T, raw)).strokes
    assert stroke.speed is None
    assert {"speed_not_measurable", "no_steady_sliding"} & set(stroke.flaws)


@pytest.mark.parametrize("degrees", [30.0, 90.0, 200.0])
def test_a_stroke_obliquely_across_the_face_has_the_numbers_of_one_along_it(degrees):
    raw, turn = noisy(slide(T)), np.radians(degrees)
    turned, (c, s) = raw.copy(), (np.cos(turn), np.sin(turn))
    for x, y in ((0, 1), (3, 4)):
        turned[:, x], turned[:, y] = c * raw[:, x] - s * raw[:, y], s * raw[:, x] + c * raw[:, y]
    along, oblique = (analyse(block(T, readings)) for readings in (raw, turned))
    for name in ("mu_dynamic", "mu_max", "speed", "tau_max", "normal_force"):
        expected = getattr(along.strokes[0], name)
        assert getattr(oblique.strokes[0], name) == pytest.approx(expected, rel=1e-9), name
    assert "side_load" not in names(oblique)


def test_a_finger_that_goes_the_wrong_way_is_named():
    analysis = analyse(block(T, noisy(slide(T, direction=-1))), of=trial(direction=1))
    assert "wrong_direction" in names(analysis)
    assert analysis.strokes[0].direction == -1
    assert "wrong_direction" in analysis.friction[0].flaws


# What is handed on


def test_the_document_is_plain_json_with_the_promised_keys():
    analysis = analyse(block(T, noisy(PLAIN)), of=trial())
    document = json.loads(json.dumps(analysis.to_dict(), allow_nan=False))
    promised = {"trial", "onset", "lift", "steady", "mu_static", "mu_dynamic", "tau_max", "speed", "direction", "flaws"}
    assert promised <= set(document["strokes"][0])
    assert document["flaws"] == []
    assert document["simulated"] == "SIMULATED"
    assert "20 Hz" in document["filter"]


def test_every_withheld_number_has_its_reason_and_no_other():
    raw = noisy(slide(T, newtons=0.2))
    (stroke,) = analyse(block(T, raw)).strokes
    for name in EVERYTHING:
        if name in stroke.reasons and name != "readings":
            assert getattr(stroke, name) is None
    assert set(stroke.reasons.values()) <= {str(flaw) for flaw in FlawName} | {"no static peak stands out"}
