"""A finger's stiffnesses from presses: known ones are recovered, and what cannot be told apart is not told apart."""

import numpy as np
import pytest
from finger_presses import LOUD, PUBLISHED, SPREAD, WIDER, law, power_law, power_law_model, presses, published

from sessions.prediction.finger_fit import fit
from sessions.prediction.press_model import CONTRASTS, FitError, check, press_model

STIFFNESSES = np.array([0.2, 0.06, 0.05])  # [MPa]
HALF = 1.959964  # of a 95 % interval, in standard deviations


def holds(interval, value):
    return (interval.low is None or interval.low <= value) and (interval.high is None or value <= interval.high)


# In closed form


def test_where_the_force_tells_two_of_three_numbers_the_third_keeps_the_prior_s_width():
    """N gives s = m + LOUD u1 and u0. Of u1 the prior and s leave a normal law, of log E_i = s + ... likewise."""
    model = power_law_model(SPREAD)
    finger_fit = fit(model, presses(power_law(0.1, (0.5, 0.0)), 1e-4, np.random.default_rng(1), points=30))
    remainder = np.sqrt(1.0 - LOUD**2 / (LOUD**2 + SPREAD**2 / 3.0))
    for number, layer in enumerate(finger_fit.layers):
        deviation = abs(SPREAD * CONTRASTS[1, number] - LOUD) * remainder
        width = np.log(layer.stiffness.high / layer.stiffness.low)
        assert width == pytest.approx(2.0 * HALF * deviation, rel=0.04)
        assert layer.ratio == pytest.approx(deviation / SPREAD, rel=0.04)
        assert layer.profile.low is None  # the likelihood alone bounds no layer
        assert layer.profile.high is None


def test_force_and_touch_of_a_power_law_come_back():
    finger_fit = fit(power_law_model(SPREAD), presses(power_law(0.3, (0.8, 0.0)), 1e-4, np.random.default_rng(2)))
    curves = presses(power_law(0.3, (0.8, 0.0)), 1e-4, np.random.default_rng(2))
    for touch, curve in zip(finger_fit.touch, curves, strict=True):
        assert touch == pytest.approx(curve.touch - 0.03, abs=2e-3)  # the onset was seen 0.03 mm late


def test_lengths_of_the_contact_tell_what_forces_leave_open():
    """Of u1 forces say nothing; 16 lengths that are off by 1 % say log(5 d^0.5) + WIDER u1 to 0.01 / 4."""
    curves = presses(power_law(0.1, (0.5, 0.8)), 1e-4, np.random.default_rng(9), count=1)
    depth = curves[0].displacement - curves[0].touch + 0.03
    rng = np.random.default_rng(10)
    width = 5.0 * np.sqrt(depth) * np.exp(WIDER * 0.8) * (1.0 + 0.01 * rng.standard_normal(len(depth)))
    blind, seeing = (fit(power_law_model(SPREAD), [curve]) for curve in (curves[0], curves[0]._replace(width=width)))
    true = power_law_model(SPREAD).stiffnesses(np.array([0.1]), np.array([[0.5, 0.8]]))[0]
    assert seeing.widths == 16
    for before, after, value in zip(blind.layers, seeing.layers, true, strict=True):
        assert after.ratio < 0.2 * before.ratio
        assert holds(after.stiffness, value)
        assert holds(after.profile, value)
        assert after.profile.low is not None
        assert after.stiffness.value == pytest.approx(value, rel=0.03)


def test_a_calibration_that_is_off_by_5_per_cent_widens_the_overall_stiffness_by_as_much():
    """Of a factor whose log has a standard uncertainty of 0.05 the interval is 0.1 wide to either side."""
    curves = presses(power_law(0.0, (0.0, 0.0)), 1e-4, np.random.default_rng(3))
    finger_fit = fit(power_law_model(SPREAD), curves, gain_error=0.05)
    width = np.log(finger_fit.overall.high / finger_fit.overall.low)
    assert width == pytest.approx(2.0 * HALF * 0.05, rel=0.05)


@pytest.mark.slow
def test_intervals_hold_true_stiffnesses_as_often_as_they_say():
    model, rng = power_law_model(SPREAD, error=1e-5), np.random.default_rng(4)
    inside, count = 0, 60
    for _ in range(count):
        contrast, mean = rng.standard_normal(2), SPREAD / np.sqrt(3.0) * rng.standard_normal()
        finger_fit = fit(model, presses(power_law(mean, contrast), 0.02, rng, count=1, points=20))
        true = model.stiffnesses(np.array([mean]), contrast[None])[0]
        inside += sum(holds(layer.stiffness, value) for layer, value in zip(finger_fit.layers, true, strict=True))
    assert 0.90 <= inside / (3 * count) <= 0.99


def test_presses_that_tell_nothing_of_a_layer_say_so():
    curves = presses(power_law(0.0, (0.0, 0.0)), 0.5, np.random.default_rng(5), points=6)
    skin = fit(power_law_model(SPREAD), curves).layers[0]
    assert skin.ratio > 0.8
    assert "cannot tell the stiffness of the epidermis" in skin.sentence
    assert f"{100 * skin.ratio:.0f} %" in skin.sentence
    assert skin.prior.high == pytest.approx(0.136 * 2.0**HALF, rel=1e-6)


def test_too_few_points_are_refused_in_a_sentence():
    curves = presses(power_law(0.0, (0.0, 0.0)), 0.01, np.random.default_rng(7), count=1, points=7)
    with pytest.raises(FitError, match="too few: press deeper"):
        fit(power_law_model(SPREAD), curves)


def test_presses_deeper_than_the_finger_are_refused_in_a_sentence():
    with pytest.raises(FitError, match="do not fit this finger"):
        press_model(published(), SPREAD, 6.0)


# With the solver


@pytest.fixture(scope="module")
def model():
    return press_model(published(), SPREAD, 2.0)


@pytest.fixture(scope="module")
def true_force():
    return law(STIFFNESSES)


@pytest.mark.slow
def test_the_model_has_the_solver_s_forces_for_stiffnesses_that_it_never_solved(model, true_force):
    log = np.log(STIFFNESSES / PUBLISHED)
    forces = 15.0 * np.exp(log.mean() + model.log_force((CONTRASTS @ log / SPREAD)[None])[0])
    in_range = model.depth < 1.8
    np.testing.assert_allclose(forces[in_range], true_force(model.depth[in_range]), rtol=0.01)


@pytest.mark.slow
def test_a_finger_all_of_whose_layers_are_twice_as_stiff_is_found_twice_as_stiff(model):
    published_force = law(PUBLISHED)
    finger_fit = fit(model, presses(lambda depth: 2.0 * published_force(depth), 0.002, np.random.default_rng(2)))
    assert finger_fit.overall.value == pytest.approx(2.0, rel=0.03)
    assert holds(finger_fit.overall, 2.0)


@pytest.mark.slow
def test_known_layers_lie_in_their_intervals_and_the_force_in_between_within_5_per_cent(model, true_force):
    finger_fit = fit(model, presses(true_force, 0.01, np.random.default_rng(3)))
    best = np.array([layer.stiffness.value for layer in finger_fit.layers])
    for layer_fit, true in zip(finger_fit.layers, STIFFNESSES, strict=True):
        assert holds(layer_fit.stiffness, true)
        assert holds(layer_fit.profile, true)
    depth = np.array([0.3, 0.7, 1.1, 1.5])
    np.testing.assert_allclose(law(best)(depth), true_force(depth), rtol=0.05)
    assert check(model, best, 1.6).deviation < 0.02


@pytest.mark.slow
def test_friction_that_nobody_allows_for_is_taken_for_stiffness_and_one_that_is_known_is_not(model):
    curves = presses(law(STIFFNESSES, mu=0.5), 0.005, np.random.default_rng(6))
    without_friction, with_friction = (fit(p, curves) for p in (model, press_model(published(), SPREAD, 2.0, 0.5)))
    for layer, true in zip(with_friction.layers, STIFFNESSES, strict=True):
        assert holds(layer.stiffness, true)
    assert without_friction.overall.value > 1.01 * with_friction.overall.value


@pytest.mark.slow
def test_of_100_simulated_fingers_intervals_hold_90_to_98_per_cent_and_forces_held_out_lie_within_5(model):
    rng = np.random.default_rng(20)
    inside, deviations, test_depths = [], [], np.array([0.5, 0.85, 1.2, 1.55])
    for _ in range(100):
        true = PUBLISHED * np.exp(SPREAD * rng.standard_normal(3))
        force = law(true)
        finger_fit = fit(model, presses(force, 0.002, rng))
        inside += [holds(layer_fit.stiffness, value) for layer_fit, value in zip(finger_fit.layers, true, strict=True)]
        best = np.array([layer.stiffness.value for layer in finger_fit.layers])
        deviations.append(np.abs(law(best, depths=test_depths)(test_depths) / force(test_depths) - 1.0).max())
    assert 0.90 <= np.mean(inside) <= 0.98
    assert max(deviations) < 0.05
