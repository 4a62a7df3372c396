"""The course of a simulated stroke."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulators.stroke import Course, Stroke

STROKES = st.builds(
    Stroke,
    peak_normal_force=st.floats(0.5, 10.0),
    speed=st.floats(5.0, 50.0),
    direction=st.sampled_from([1, -1]),
    approach=st.floats(0.5, 1.0),
    stick=st.floats(0.3, 0.6),
    slide=st.floats(1.5, 3.0),
    peak_at=st.floats(0.4, 0.7),
    sag=st.floats(0.28, 0.4),
    wander=st.floats(0.06, 0.14),
    phases=st.tuples(*[st.floats(0.0, 6.3)] * 3),
)
TIMES = np.arange(0.0, 6.0, 1e-3)


@given(STROKES, st.floats(0.1, 1.0))
def test_the_normal_force_reaches_its_peak_once_and_in_the_slide(stroke, mu):
    course = Course(stroke, mu, holds=True)
    force = course.normal_force(TIMES)
    assert course.normal_force(np.array([course.peak]))[0] == pytest.approx(stroke.peak_normal_force, rel=1e-12)
    assert force.max() <= stroke.peak_normal_force
    assert course.steady[0] < course.peak < course.steady[1]
    assert np.all(force[np.abs(TIMES - course.peak) > 0.3] < 0.97 * stroke.peak_normal_force)


@given(STROKES, st.floats(0.1, 1.0), st.booleans())
def test_nothing_touches_before_the_touch_and_after_the_lift(stroke, mu, holds):
    course = Course(stroke, mu, holds)
    force = course.normal_force(TIMES)
    outside = (course.touch >= TIMES) | (course.lift <= TIMES)
    assert np.all(force[outside] == 0.0)
    inside = (course.touch + 1e-3 < TIMES) & (course.lift - 1e-3 > TIMES)
    assert np.all(force[inside] > 0.0)


@given(STROKES, st.floats(0.1, 1.0))
def test_a_surface_that_holds_the_finger_is_climbed_in_a_straight_line_before_it_slides(stroke, mu):
    course = Course(stroke, mu, holds=True)
    times = np.linspace(course.touch, course.slip, 11)
    assert course.ratio(times) == pytest.approx(np.linspace(0.0, mu, 11))
    assert np.ptp(course.position(times)) < 0.5
    assert course.ratio(np.linspace(course.slip, course.lift, 50)) == pytest.approx(np.full(50, mu))


@given(STROKES, st.floats(0.1, 1.0))
def test_a_surface_that_does_not_hold_is_slid_on_from_the_touch(stroke, mu):
    course = Course(stroke, mu, holds=False)
    assert course.slip == course.touch
    assert course.ratio(np.array([course.touch, course.peak, course.lift])).tolist() == [mu] * 3


@given(STROKES, st.floats(0.1, 1.0), st.booleans())
def test_the_finger_slides_at_its_speed_and_never_leaps(stroke, mu, holds):
    course = Course(stroke, mu, holds)
    start, stop = course.steady
    positions = course.position(np.array([start, stop]))
    assert (positions[1] - positions[0]) / (stop - start) == pytest.approx(stroke.speed, rel=0.1)
    speed = np.gradient(course.position(TIMES), TIMES)
    sliding = (start + 0.3 <= TIMES) & (stop >= TIMES)
    assert np.all(np.abs(speed[sliding] / stroke.speed - 1.0) < 1.5 * stroke.speed_wander)
    assert np.all(np.abs(speed) < 1.5 * stroke.speed)


def test_every_start_is_smooth_as_a_hands_is():
    course = Course(Stroke(3.0, 20.0), 0.5, holds=True)
    force = course.normal_force(TIMES)
    assert np.abs(np.diff(force, 2)).max() < 3.0 * 10 / 0.1**2 * 1e-6  # a minimum-jerk rise: 5.8 peak / duration²


@pytest.mark.parametrize(
    "properties",
    [
        {"peak_normal_force": 0.0},
        {"speed": -1.0},
        {"approach": -0.1},
        {"direction": 0},
        {"slide": 0.1},
        {"peak_at": 0.9},
        {"sag": 0.1, "wander": 0.2},
    ],
)
def test_a_course_no_hand_can_take_is_refused(properties):
    with pytest.raises(ValueError, match=r"stroke|wander"):
        Stroke(**({"peak_normal_force": 3.0, "speed": 20.0} | properties))
