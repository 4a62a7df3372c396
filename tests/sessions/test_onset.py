"""The contact detector, from closed forms."""

from itertools import pairwise

import numpy as np
import pytest
from closed_form import times, trapezium
from hypothesis import given, settings
from hypothesis import strategies as st

from sessions.strokes.contacts import ContactDetector, onset_threshold
from sessions.strokes.settings import DetectorSettings


def noisy(force, sd=0.004, seed=0):
    return force + sd * np.random.default_rng(seed).standard_normal(len(force))


T = times(4.0)
PRESS = trapezium(T, 1.0, 3.0, 0.2, 2.0)  # rises by 10 N/s: 12 mN after 1.2 ms
FORCE = noisy(PRESS)
EVENTS = ContactDetector().feed(T, FORCE)


def test_a_press_is_one_onset_and_one_lift():
    assert [event.touches for event in EVENTS] == [True, False]


def test_onset_lies_within_two_readings_of_where_the_force_leaves_three_standard_deviations():
    for seed in range(200):
        onset = ContactDetector().feed(T, noisy(PRESS, seed=seed))[0]
        assert abs(onset.time - 1.0012) <= 2 / 200


def test_lift_is_the_first_reading_below_the_lift_threshold():
    lift = EVENTS[1]
    below = 3.0 - 0.6 * 0.05 / 10.0  # 0.03 N on a flank of 10 N/s
    assert 0.0 <= lift.time - below <= 2 / 200


def test_an_event_is_noticed_once_it_has_held():
    assert EVENTS[0].noticed - EVENTS[0].time >= 0.010
    assert EVENTS[1].noticed - EVENTS[1].time >= 0.020 - 1e-9


@settings(max_examples=40, deadline=None)
@given(cuts=st.lists(st.integers(0, len(T)), max_size=12).map(sorted))
def test_events_do_not_depend_on_how_the_readings_were_cut(cuts):
    detector, events = ContactDetector(), []
    edges = [0, *cuts, len(T)]
    for a, b in pairwise(edges):
        events += detector.feed(T[a:b], FORCE[a:b])
    assert tuple(events) == EVENTS


def test_the_zero_is_the_unloaded_force_whatever_it_is():
    events = ContactDetector().feed(T, FORCE + 7.5)
    assert events == EVENTS


def test_the_threshold_lies_above_the_measured_noise():
    assert onset_threshold(0.1, DetectorSettings()) == pytest.approx(0.5)
    rough = noisy(np.zeros_like(T), sd=0.1)
    assert ContactDetector().feed(T, rough) == ()
    assert [e.touches for e in ContactDetector().feed(T, noisy(PRESS, sd=0.1))] == [True, False]


def test_a_force_that_dips_between_the_thresholds_is_one_contact():
    force = PRESS.copy()
    force[(T > 1.8) & (T < 2.0)] = 0.04  # below the onset threshold, above the lift threshold
    assert [event.touches for event in ContactDetector().feed(T, noisy(force, sd=0.001))] == [True, False]


def test_one_reading_above_the_threshold_is_no_contact():
    force = noisy(np.zeros_like(T))
    force[400] = 1.0
    assert ContactDetector().feed(T, force) == ()


def test_one_reading_below_the_lift_threshold_is_no_lift():
    force = FORCE.copy()
    force[400] = 0.0
    assert ContactDetector().feed(T, force) == EVENTS


def test_a_slow_drift_is_followed_and_is_no_contact():
    t = times(60.0)
    drift = 0.3 * np.sin(2 * np.pi * t / 60.0)  # six thresholds high, 0.03 N/s at its steepest
    assert ContactDetector().feed(t, noisy(drift)) == ()


def test_nothing_is_detected_before_an_unloaded_stretch_was_seen():
    moving = 2.0 + np.sin(2 * np.pi * 3.0 * T)
    assert ContactDetector().feed(T, noisy(moving)) == ()


def test_a_zero_taken_in_contact_is_taken_anew_once_the_finger_has_left():
    sticking = np.where(T < 1.0, 1.5, 0.0) + trapezium(T, 2.0, 3.0, 0.1, 2.0)
    events = ContactDetector().feed(T, noisy(sticking))
    assert [event.touches for event in events] == [True, False]
    assert events[0].time == pytest.approx(2.0, abs=0.01)


def test_a_baseline_given_is_used_from_the_first_reading_on():
    sticking = np.where(T < 1.0, 1.5, 0.0)
    events = ContactDetector(noise=0.004).feed(T, noisy(sticking))
    assert [event.touches for event in events] == [True, False]
    assert events[0].time == 0.0


def test_readings_lost_in_the_middle_of_a_press_change_nothing_else():
    present = np.ones(len(T), bool)
    present[400:460] = False
    assert ContactDetector().feed(T[present], FORCE[present]) == EVENTS
