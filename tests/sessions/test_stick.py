"""Where the stick phase ends, of climbs in closed form."""

import numpy as np
import pytest
from closed_form import N, T, analyse, block, noisy, slide, trapezium, wrench

from sessions.strokes.settings import ClimbSettings
from sessions.strokes.stick import Climb, ClimbReadings


def climbing(ratio, slip):
    """Return the stroke whose T/N climbs by `ratio` (n,) until the `slip` [s], the finger moving from there on."""
    return analyse(block(T, noisy(wrench(T, N, ratio, 25.0 * np.maximum(T - slip, 0.0))))).strokes[0]


@pytest.mark.parametrize("climb", [0.15, 0.3, 0.6])
def test_break_away_is_where_the_ratio_stops_climbing(climb):
    ratio = 0.5 * np.clip((T - 1.0) / climb, 0.0, 1.0)
    assert climbing(ratio, 1.0 + climb).break_away == pytest.approx(1.0 + climb, abs=0.005)


@pytest.mark.parametrize("rest", [0.1, 0.5, 1.0])
def test_a_finger_that_rests_before_it_is_moved_breaks_away_no_earlier(rest):
    slip = 1.1 + rest + 0.25
    stroke = climbing(0.5 * np.clip((T - slip) / 0.25 + 1.0, 0.0, 1.0), slip)
    assert stroke.break_away == pytest.approx(slip, abs=0.005)


def test_a_rest_of_three_readings_is_distinguished_from_the_climb():
    time = np.arange(300) / 200.0
    readings = ClimbReadings(time, 0.05 + 0.5 * np.clip((time - 0.012) / 0.5, 0.0, 1.0), ClimbSettings())
    climb = readings.fit(0.1, peaked=False)
    assert (climb.begins, climb.meets, climb.rest) == pytest.approx((0.012, 0.512, 0.05), abs=1e-4)


@pytest.mark.parametrize("bend", [1.5, 2.0, 3.0])
def test_a_climb_that_bends_as_edges_of_contact_slip_first_ends_where_all_of_it_slips(bend):
    progress = np.clip((T - 1.0) / 0.4, 0.0, 1.0)
    stroke = climbing(0.5 * (1.0 - (1.0 - progress) ** bend), 1.4)
    assert stroke.break_away == pytest.approx(1.4, abs=0.01)


@pytest.mark.parametrize("fall", [0.0, 0.08])
def test_the_slopes_of_a_climb_are_those_of_differences(fall):
    parameters = np.array([1.1, 1.42, 1.7, fall, 0.05, 0.4, 0.1 if fall else 0.0])
    times = np.linspace(1.0, 2.0, 37)
    slopes = Climb(*parameters).slopes(times)
    for number in [0, 1, 2, 3, 4, 5, 6] if fall else [0, 1, 2, 4, 5]:
        step = 1e-6 * np.eye(7)[number]
        change = (Climb(*(parameters + step)).ratio(times) - Climb(*(parameters - step)).ratio(times)) / 2e-6
        np.testing.assert_allclose(slopes[:, number], change, atol=1e-6)


@pytest.mark.parametrize("peak", [0.1, 0.3])
def test_a_static_peak_is_where_the_finger_breaks_away_but_for_what_the_filter_rounds(peak):
    above = 1.0 + peak * np.exp(-np.maximum(T - 1.4, 0.0) / 0.08)
    stroke = climbing(0.5 * np.clip((T - 1.0) / 0.4, 0.0, 1.0) * above, 1.4)
    assert stroke.break_away == pytest.approx(1.4, abs=0.02)


def test_no_break_away_is_reported_after_the_slide_began():
    stroke = climbing(0.5 * np.clip((T - 1.0) / 1.0, 0.0, 1.0), 1.4)
    assert stroke.slide_onset == pytest.approx(1.4, abs=0.05)
    assert stroke.break_away is None
    assert stroke.reasons["break_away"] == "the contact slides before T/N stops climbing"


def test_a_ratio_that_does_not_climb_has_no_stick_phase():
    assert analyse(block(T, noisy(slide(T)))).strokes[0].break_away is None


# ---- a finger that sticks and slips, and friction that follows the normal force


def sawing(frequency, drop, mu=0.5):
    """Return a stroke whose T/N climbs by `drop` of mu and falls back within a tenth of the period, `frequency` Hz."""
    phase = frequency * np.maximum(T - 1.0, 0.0) % 1.0
    saw = np.where(phase < 0.9, phase / 0.9, (1.0 - phase) / 0.1)
    return wrench(T, trapezium(T, 1.0, 3.0, 0.1, 2.0), mu * (1.0 - drop * (1.0 - saw)), 25.0 * (T - 2.0))


@pytest.mark.parametrize(("frequency", "drop"), [(5.0, 0.2), (8.0, 0.3), (13.0, 0.15)])
def test_of_a_finger_that_sticks_and_slips_tau_max_is_that_of_the_crests_and_no_static_peak_is_given(frequency, drop):
    (stroke,) = (analysis := analyse(block(T, noisy(sawing(frequency, drop))))).strokes
    assert "stick_slip" in stroke.flaws
    assert any(f"{frequency:.2g} Hz" in flaw.sentence for flaw in analysis.flaws)
    assert stroke.tau_max == pytest.approx(0.5 * 2.0 / 100.0, rel=0.02)
    low, high = analysis.intervals[0].tau_max
    assert low < 0.5 * 2.0 / 100.0 < high
    assert stroke.mu_static is None


@pytest.mark.parametrize("hum", [0.02, 0.1])  # N
def test_hum_and_noise_are_no_stick_slip(hum):
    raw = noisy(slide(T))
    raw[:, :3] += hum * np.sin(2 * np.pi * 50.0 * T + 0.3)[:, None]
    (stroke,) = analyse(block(T, raw)).strokes
    assert "stick_slip" not in stroke.flaws


def test_friction_that_falls_with_the_normal_force_is_no_static_peak():
    n = trapezium(T, 1.0, 3.0, 0.4, 3.0)
    ratio = 0.5 * (np.maximum(n, 0.1) / 3.0) ** (-1.0 / 3.0)
    (stroke,) = analyse(block(T, noisy(wrench(T, n, ratio, 25.0 * (T - 2.0))))).strokes
    assert stroke.mu_static is None
