"""An axis that clips or freezes alone, and a wild reading, are named without a rated range; coarse steps are neither.

Three strokes of 4 N with a ratio of 0.68 are simulated in closed form; the calibration states no rated range.
"""

from dataclasses import replace

import closed_form
import numpy as np
import pytest
from closed_form import (
    CALIBRATION,
    HEIGHT,
    INFO,
    SETTINGS,
    analyse,
    block,
    names,
    noisy,
    times,
    trapezium,
    trial,
    wrench,
)

from sessions.strokes.signal_quality import constant_readings, constant_runs, repeated_readings, spikes

T = times(10.0)
BEGINS = (1.0, 4.0, 7.0)
MU = 0.68
UNRATED = replace(INFO, calibration=replace(CALIBRATION, rated=np.full(6, np.nan)))
PRESS = sum(trapezium(T, at, at + 2.0, 0.3, 4.0) for at in BEGINS) * (1.0 + 0.05 * np.sin(2 * np.pi * 0.7 * T))
ALONG = sum(25.0 * (np.clip(T, at, at + 2.0) - at - 1.0) * ((at - 0.5 < T) & (at + 2.5 > T)) for at in BEGINS)
CLEAN = noisy(wrench(T, PRESS, np.full_like(T, MU), ALONG))
FX, FZ = 0, 2


def with_axis(axis, change):
    raw = CLEAN.copy()
    raw[:, axis] = change(raw[:, axis].copy())
    return raw


def analyse_raw(raw):
    return analyse(block(T, raw), info=UNRATED)


def frozen(column):
    column[(T > 1.8) & (T < 2.8)] = column[T > 1.8][0]
    return column


def flaws_named(analysis, name):
    return [flaw for flaw in analysis.flaws if flaw.name == name and flaw.stroke is None]


def test_the_strokes_are_sound_before_they_are_spoilt():
    analysis = analyse_raw(CLEAN)
    assert names(analysis) == set()
    assert [stroke.mu_dynamic for stroke in analysis.strokes] == pytest.approx([MU] * 3, rel=0.01)


@pytest.mark.parametrize(
    ("axis", "low", "high", "name"), [(FZ, -3.0, np.inf, "Fz"), (FX, -2.0, 2.0, "Fx"), (FX, -np.inf, 2.5, "Fx")]
)
def test_a_flat_top_is_named_as_saturation_and_no_peak_of_it_is_given(axis, low, high, name):
    analysis = analyse_raw(with_axis(axis, lambda column: np.clip(column, low, high)))
    assert flaws_named(analysis, "saturated")[0].sentence.startswith(name)
    for stroke in analysis.strokes:
        assert stroke.mu_max is stroke.mu_static is stroke.tau_max is stroke.peak_normal is None
        assert stroke.mu_dynamic is None or stroke.mu_dynamic == pytest.approx(MU, rel=0.01)


def test_a_stroke_whose_middle_is_clipped_is_not_reported_as_two_taps():
    t = times(5.0)
    rise, lift = (np.clip(way / 0.12, 0.0, 1.0) for way in (t - 1.0, 3.5 - t))
    press = 2.0 * (rise**2 * (3.0 - 2.0 * rise)) * (lift**2 * (3.0 - 2.0 * lift)) * (1.0 + 0.05 * np.sin(19.5 * t))
    ratio = 0.5 * np.clip((t - 1.12) / 0.25, 0.0, 1.0)
    raw = noisy(wrench(t, press, ratio, 20.0 * np.maximum(t - 1.37, 0.0)))
    raw[:, FZ] = np.maximum(raw[:, FZ], -1.9)
    analysis = analyse(block(t, raw), info=UNRATED)
    assert analysis.strokes == ()
    assert "tap" not in names(analysis)
    assert len([flaw for flaw in flaws_named(analysis, "saturated") if "goes on" in flaw.sentence]) == 2


def test_one_axis_frozen_while_the_others_move_is_named_and_left_out():
    analysis = analyse_raw(with_axis(FZ, frozen))
    assert flaws_named(analysis, "frozen_sensor")[0].sentence.startswith("Fz")
    first, *rest = analysis.strokes
    assert first.mu_max is first.mu_static is first.tau_max is None
    assert first.mu_dynamic is None or first.mu_dynamic == pytest.approx(MU, rel=0.01)
    assert [stroke.mu_dynamic for stroke in rest] == pytest.approx([MU] * 2, rel=0.01)
    assert all(stroke.flaws == () for stroke in rest)


@pytest.mark.parametrize("readings", [slice(380, 381), slice(380, 382)])
def test_a_wild_reading_is_named_before_it_is_filtered_and_stays_raw(readings):
    def hit(column):
        column[readings] = 40.0
        return column

    spiked = block(T, with_axis(FX, hit))
    analysis = analyse(spiked, info=UNRATED)
    assert "Fx" in flaws_named(analysis, "wild_reading")[0].sentence
    assert (spiked.raw[readings, FX] == 40.0).all()
    first, *rest = analysis.strokes
    assert "wild_reading" in first.flaws
    assert first.mu_max == pytest.approx(MU, rel=0.01)
    assert first.mu_static is None
    assert first.peak_tangential == pytest.approx(MU * PRESS.max(), rel=0.02)
    assert all(stroke.flaws == () for stroke in rest)


def test_exactly_the_readings_that_repeat_the_first_of_a_frozen_stretch_are_marked():
    raw, expected = CLEAN.copy(), np.zeros(len(T), bool)
    raw[400:480], expected[401:480] = raw[400], True
    assert (repeated_readings(block(T, raw), SETTINGS.signal) == expected).all()
    column = with_axis(FZ, frozen)
    runs = constant_runs(T, column, np.zeros(len(T), bool), SETTINGS.signal)
    inside = np.flatnonzero((T > 1.8) & (T < 2.8))
    assert [(run.axis, run.clipped, run.first, run.last) for run in runs] == [(FZ, False, inside[0], inside[-1])]
    assert np.flatnonzero(constant_readings(column, runs, clipped=False)).tolist() == inside[1:].tolist()


@pytest.mark.parametrize("noise", [0.0, 0.2, 1.0])
@pytest.mark.parametrize("step", [0.01, 0.1])
def test_coarse_steps_are_neither_clipped_nor_frozen_nor_wild(step, noise):
    """Steps of hundredths or tenths of a newton, a hundred times as large for torques, with little or much noise."""
    clean = wrench(T, PRESS, np.full_like(T, MU), ALONG)
    steps = step * np.array([1.0] * 3 + [100.0] * 3)
    rough = clean + noise * steps * np.random.default_rng(1).standard_normal(clean.shape)
    raw = np.round(rough / steps) * steps
    assert constant_runs(T, raw, np.zeros(len(T), bool), SETTINGS.signal) == ()
    assert not spikes(raw, SETTINGS.signal).any()


def in_coarse_steps(frozen=None):
    """Return a slanting stroke from 1.5 to 3.5 s of 5 in steps of 50 mN and 0.5 N mm; at rest nothing ever changes."""
    t = times(6.0)
    clean = closed_form.slide(t, mu=MU, begin=1.5, end=3.5)
    clean[:, 1] += 0.1 * clean[:, 0]
    clean[:, 3] -= HEIGHT * 0.1 * clean[:, 0]
    clean[:, 5] += 0.5 * clean[:, 0] * np.sin(t)
    steps = np.array([0.05] * 3 + [0.5] * 3)
    raw = np.round(noisy(clean) / steps) * steps
    if frozen is not None:
        first, last = np.searchsorted(t, frozen)
        raw[first:last] = raw[first]
    return block(t, raw)


def test_a_sensor_of_coarse_steps_at_rest_is_not_frozen_and_its_stroke_is_one():
    analysis = analyse(in_coarse_steps(), of=trial())
    assert analysis.flaws == ()
    (stroke,) = analysis.strokes
    assert stroke.onset == pytest.approx(1.5, abs=0.01)
    assert stroke.mu_dynamic == pytest.approx(MU * np.sqrt(1.01), rel=0.025 / (2.0 * MU))  # half a step of T


def test_the_same_sensor_frozen_for_a_while_is_named_by_the_jump_with_which_it_lives_again():
    analysis = analyse(in_coarse_steps(frozen=(2.0, 2.4)), of=trial())
    assert "first at 2.0" in flaws_named(analysis, "frozen_sensor")[0].sentence


def test_the_same_sensor_frozen_under_the_finger_until_the_recording_ends_is_named_and_gives_no_steady_stretch():
    analysis = analyse(in_coarse_steps(frozen=(2.5, 5.1)), of=trial())
    assert "first at 2.5" in flaws_named(analysis, "frozen_sensor")[0].sentence
    assert all(stroke.steady is None or stroke.steady[1] < 2.52 for stroke in analysis.strokes)


def test_a_sensor_that_never_reads_below_zero_is_not_clipped_where_nothing_presses():
    analysis = analyse_raw(with_axis(FZ, lambda column: np.minimum(np.round(column, 2), 0.0)))
    assert not names(analysis) & {"saturated", "frozen_sensor"}


@pytest.mark.parametrize("spike", [-80.0, 80.0])
@pytest.mark.parametrize("seed", range(8))
def test_twelve_spikes_of_eighty_newtons_hide_no_good_stroke(seed, spike):
    raw = CLEAN.copy()
    at = np.random.default_rng(seed).choice(np.flatnonzero((T > 0.5) & (T < 9.5)), 12, replace=False)
    raw[at, FZ] += spike
    analysis = analyse_raw(raw)
    assert names(analysis, "refused") == set()
    assert "wild_reading" in names(analysis)
    assert [stroke.mu_dynamic for stroke in analysis.strokes] == pytest.approx([MU] * 3, rel=0.01)


@pytest.mark.parametrize("first", [250, 300, 400, 440])
@pytest.mark.parametrize("spacing", [4, 5, 8])
def test_twelve_spikes_close_together_are_told_apart_from_the_stroke_they_lie_in(first, spacing):
    raw = CLEAN.copy()
    raw[first : first + 12 * spacing : spacing, FZ] -= 80.0
    marks = spikes(raw, SETTINGS.signal)
    assert np.flatnonzero(marks[:, FZ]).tolist() == list(range(first, first + 12 * spacing, spacing))
    analysis = analyse_raw(raw)
    assert len(analysis.strokes) == 3
    assert analysis.strokes[0].mu_dynamic == pytest.approx(MU, rel=0.01)
