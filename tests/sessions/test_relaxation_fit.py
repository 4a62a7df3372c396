"""How a finger relaxes, from presses that are held: known parts and times are recovered, short holds are named."""

from dataclasses import replace

import numpy as np
import pytest
from finger_presses import PUBLISHED, SPREAD, law, power_law, power_law_model, presses, published

from sessions.prediction.finger_fit import LoadingCurve, fit
from sessions.prediction.press_model import FitError
from sessions.prediction.relaxation_fit import BLOCK, HoldCurve, relaxation, relaxing_fit
from solver import Friction, Loading, Relaxation, Solve, solve

RATE, DEEP = 200.0, 1.5  # [Hz], [mm]
CALM = power_law(0.0, (0.0, 0.0))  # the elastic force [N]


@pytest.fixture(scope="module")
def model():
    return power_law_model(SPREAD)


@pytest.fixture(scope="module")
def elastic(model):
    return fit(model, presses(CALM, 1e-4, np.random.default_rng(1), count=2))


def hold_curve(elastic, press, part, tau, rng, rise=0.5, hold=3.0, size=1.0):
    """Return a press that goes down evenly and stands, its force by a fine sum over all that went before.

    N(t) = e(t) - g integral of (1 - exp(-(t - s) / tau)) de(s), by the trapezoidal rule in 4000 steps.
    """
    time = np.arange(round((rise + hold) * RATE)) / RATE
    force = np.empty(len(time))
    for at, now in enumerate(time):
        s = np.linspace(0.0, min(now, rise), 4001)
        e = CALM(DEEP * s / rise)
        relaxation = 1.0 - np.exp(-(now - s) / tau)
        force[at] = size * (e[-1] - part * np.sum((relaxation[1:] + relaxation[:-1]) / 2.0 * np.diff(e)))
    depth = DEEP * np.minimum(time / rise, 1.0)
    return HoldCurve(time, depth + elastic.touch[press], force + 0.005 * rng.standard_normal(len(time)))


@pytest.mark.parametrize(("part", "tau"), [(0.4, 0.8), (0.2, 0.3)])
def test_intervals_hold_a_known_part_and_time(model, elastic, part, tau):
    rng = np.random.default_rng(2)
    estimate = relaxation(model, elastic, [hold_curve(elastic, press, part, tau, rng, size=1.3) for press in (0, 1)])
    assert estimate.part.low <= part <= estimate.part.high
    assert estimate.time.low <= tau <= estimate.time.high
    assert estimate.part.value == pytest.approx(part, abs=0.02)
    assert estimate.time.value == pytest.approx(tau, rel=0.1)
    assert estimate.at_once == pytest.approx(1.3, rel=0.02)
    assert f"{100 * (1 - estimate.part.value):.0f} % of the stiffness at once" in estimate.sentence


@pytest.mark.slow
def test_a_finger_that_relaxes_on_its_way_down_is_as_stiff_as_at_once_and_not_bent_by_it(model, elastic):
    """Its force over depth is bent by what relaxes: fitted as if elastic, layers miss their intervals."""
    rng = np.random.default_rng(6)
    holds = [hold_curve(elastic, item, 0.4, 0.6, rng, rise=1.0) for item in (0, 1)]
    way = [np.flatnonzero(item.time <= 1.0) for item in holds]
    nothing = [np.full(len(item), np.nan) for item in way]
    down = [
        LoadingCurve.of(item.displacement[at], item.force[at], none)
        for item, at, none in zip(holds, way, nothing, strict=True)
    ]
    naive = fit(model, down)
    layers_fit, rate = relaxing_fit(model, down, holds)
    assert rate.part.value == pytest.approx(0.4, abs=0.02)
    assert rate.time.value == pytest.approx(0.6, rel=0.1)
    for item, true in zip(layers_fit.layers, PUBLISHED, strict=True):
        assert item.stiffness.low <= true <= item.stiffness.high
    assert layers_fit.overall.value == pytest.approx(1.0, rel=0.03)
    layers = zip(naive.layers, PUBLISHED, strict=True)
    assert not all(item.stiffness.low <= true <= item.stiffness.high for item, true in layers)
    assert holds[0].fall > 0.05


def test_a_press_without_its_relaxation_is_the_elastic_one_that_the_convolution_was_made_of():
    rng = np.random.default_rng(6)
    time, unrelaxed = (
        np.cumsum(rng.uniform(0.02, 0.2, 40)),
        np.concatenate([[0.0], np.cumsum(rng.uniform(-0.1, 0.3, 39))]),
    )
    part, tau = 0.4, 0.7
    rate = np.diff(unrelaxed) / np.diff(time)

    def memory(now):  # of one spring and dashpot: the integral of exp(-(now - s) / tau) over what the force grew
        ends = np.minimum(time, now)
        return np.sum(rate * tau * np.diff(np.exp((ends - now) / tau)))

    force = (1.0 - part) * unrelaxed + part * np.array([memory(now) for now in time])
    press = HoldCurve(time, np.zeros(40), force)
    assert press.unrelaxed(part, tau).force == pytest.approx(unrelaxed, abs=1e-12)


def test_the_fall_of_a_held_force_is_that_of_the_means_over_its_blocks():
    time = np.append(0.0, np.arange(1.0, 80.0) * BLOCK / 4.0 + 0.001)  # beside the bounds of blocks
    force = np.where(time < 0.5, 2.0, 1.5) + np.tile([0.3, -0.3], len(time) // 2)  # within a block it cancels
    assert HoldCurve(time, np.zeros(len(time)), force).fall == pytest.approx(0.25)


def test_a_finger_that_does_not_relax_is_not_said_to(model, elastic):
    estimate = relaxation(model, elastic, [hold_curve(elastic, p, 0.0, 1.0, np.random.default_rng(3)) for p in (0, 1)])
    assert estimate.part.low <= 0.01
    assert "do not show" in estimate.sentence
    assert estimate.relaxing(published()) == published()


def test_a_hold_that_is_much_shorter_than_the_time_bounds_neither_and_says_so(model, elastic):
    estimate = relaxation(
        model, elastic, [hold_curve(elastic, press, 0.5, 20.0, np.random.default_rng(4), hold=1.0) for press in (0, 1)]
    )
    assert estimate.time.high is None or estimate.part.high is None
    assert "hold longer" in estimate.sentence


def test_the_scene_is_as_stiff_at_once_and_relaxes_alike_in_all_layers(model, elastic):
    estimate = relaxation(
        model, elastic, [hold_curve(elastic, press, 0.4, 0.8, np.random.default_rng(5), size=1.2) for press in (0, 1)]
    )
    scene = estimate.relaxing(published())
    assert pytest.approx(0.034 * estimate.at_once) == scene.materials.fat.E
    for name in ("epidermis", "dermis", "fat"):
        (term,) = scene.materials.of(name).prony
        assert (term.g, term.tau) == (estimate.part.value, estimate.time.value)
    assert scene.materials.bone == published().materials.bone


def test_without_a_hold_there_is_one_sentence(model, elastic):
    with pytest.raises(FitError, match="No press is held"):
        relaxation(model, elastic, [])


@pytest.mark.slow
def test_the_solver_s_own_finger_that_relaxes_presses_as_the_formula_says():
    """A press of 1 s of tissues that relax alike. Their bulk does not relax, which is worth about g (1 - 2 nu)."""
    part, tau = 0.4, 0.5
    still = published()
    term = (Relaxation(part, tau),)
    layers = {name: replace(still.materials.of(name), prony=term) for name in ("epidermis", "dermis", "fat")}
    scene = replace(
        still,
        materials=replace(still.materials, **layers),
        friction=Friction(0.0),
        loading=Loading(1.2, "+x"),
        solve=Solve(course="history", evidence="quick"),
    )
    history = solve(scene).history
    down = history.time <= 1.0
    time, depth = history.time[down], -history.bone_y[down]
    elastic = law(PUBLISHED)
    fine = np.linspace(0.0, 1.0, 2001)
    e = elastic(np.interp(fine, time, depth))
    deep = np.flatnonzero(depth > 0.4)
    assert len(deep) > 10
    for at in deep[::5]:
        past = fine <= time[at]
        relaxation = 1.0 - np.exp(-(time[at] - fine[past]) / tau)
        force = e[past][-1] - part * np.sum((relaxation[1:] + relaxation[:-1]) / 2.0 * np.diff(e[past]))
        assert 15.0 * history.normal_force[down][at] == pytest.approx(force, rel=0.02)
