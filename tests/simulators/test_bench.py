"""The simulated bench: its wrench is the ground truth of the stroke, with the stated errors."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from simulators.bench import Bench, BenchSettings
from simulators.stroke import Stroke, Surface, paper_surfaces
from simulators.subject import SimulatedSubject

EXACT = BenchSettings(noise_force=0.0, noise_torque=0.0, drift_force=0.0, drift_torque=0.0)
SURFACES = paper_surfaces()


def stroked_bench(surface, *, seed=0, at=0.0, settings=None):
    bench = Bench(seed, settings)
    bench.mount(surface)
    return bench, bench.begin_stroke(SimulatedSubject(seed).stroke(surface), at)


@pytest.mark.parametrize(
    ("descriptor", "forces"),
    [("stickiness", [2.87, 3.52, 3.97, 7.81, 7.84]), ("slipperiness", [7.59, 7.71, 6.84, 5.00, 3.65])],
)
def test_the_papers_surfaces_are_pressed_as_their_tables_ask(descriptor, forces):
    surfaces = [surface for key, surface in SURFACES.items() if key[0] == descriptor]
    assert [round(s.peak_normal_force, 2) for s in surfaces] == forces


@pytest.mark.parametrize("surface", SURFACES.values())
@pytest.mark.parametrize("seed", [1, 2])
def test_mu_tau_max_speed_and_direction_lie_in_the_wrench(surface, seed):
    bench, truth = stroked_bench(surface, seed=seed, settings=EXACT)
    times = np.arange(0.0, truth.end + 0.2, 1e-3)
    wrench = bench.wrench(times)
    normal, tangential = -wrench[:, 2], np.hypot(wrench[:, 0], wrench[:, 1])
    steady = (times >= truth.steady[0]) & (times <= truth.steady[1])
    height = bench.settings.height
    x = (wrench[steady, 4] - height * wrench[steady, 0]) / normal[steady]
    y = -(wrench[steady, 3] + height * wrench[steady, 1]) / normal[steady]
    displacement = np.array([x[-1] - x[0], y[-1] - y[0]])

    assert tangential[steady] / normal[steady] == pytest.approx(np.full(steady.sum(), surface.mu))
    assert (tangential / np.maximum(normal, 1e-9)).max() <= surface.mu * (1 + 1e-9)
    assert tangential.max() / 100.0 == pytest.approx(surface.tau_max, rel=1e-4)
    assert (truth.mu, truth.tau_max) == (surface.mu, pytest.approx(surface.tau_max))
    assert np.sign(displacement[0]) == truth.direction == surface.direction
    assert np.sign(wrench[steady, 0].mean()) == surface.direction
    assert np.hypot(*displacement) / np.ptp(times[steady]) == pytest.approx(truth.speed, rel=1e-3)
    assert truth.speed == pytest.approx(surface.speed, rel=0.1)


def test_onset_and_lift_are_where_the_true_force_crosses_three_deviations_of_the_noise():
    bench, truth = stroked_bench(SURFACES["stickiness", 50], at=3.0)
    times = np.array([truth.onset - 2e-5, truth.onset + 2e-5, truth.lift - 2e-5, truth.lift + 2e-5])
    normal = -bench.true_wrench(times)[:, 2]
    assert (normal > 0.012).tolist() == [False, True, True, False]
    assert truth.touch < truth.onset < truth.slip < truth.peak < truth.lift < truth.end
    assert truth.touch - 3.0 >= 0.5


def test_white_noise_has_the_stated_size_and_no_memory():
    noise = Bench(5).wrench(np.arange(40_000) / 200.0) - Bench(5, EXACT).wrench(np.arange(40_000) / 200.0)
    white = np.diff(noise, axis=0) / np.sqrt(2)  # takes the drift away
    assert white.std(axis=0) == pytest.approx([0.004] * 3 + [0.05] * 3, rel=0.03)
    assert np.corrcoef(white.T)[np.triu_indices(6, 1)] == pytest.approx(np.zeros(15), abs=0.03)
    assert np.mean(white[2:] * white[:-2], axis=0) / white.var(axis=0) == pytest.approx(np.zeros(6), abs=0.03)


def test_drift_stays_within_its_limit_and_is_slow():
    settings = BenchSettings(noise_force=0.0, noise_torque=0.0)
    drift = np.abs(Bench(7, settings).wrench(np.arange(0.0, 3600.0, 0.5)))
    assert np.all(drift.max(axis=0) <= [0.010] * 3 + [0.1] * 3)
    assert np.all(drift.max(axis=0) >= [0.002] * 3 + [0.02] * 3)
    assert np.abs(np.diff(drift[:, 0])).max() < 0.5e-3


def test_the_same_seed_and_instant_feel_the_same_whoever_asks_and_when():
    bench = Bench(3)
    times = np.arange(1000) / 7000
    wrench = bench.wrench(times)
    assert np.array_equal(wrench[500:510], bench.wrench(times[500:510]))
    assert np.array_equal(wrench, Bench(3).wrench(times))
    assert not np.array_equal(wrench, Bench(4).wrench(times))


@given(st.floats(-3, 3), st.floats(-3, 3))
@settings(max_examples=20)
def test_a_tilted_stimulus_turns_the_wrench_and_keeps_its_size(about_x, about_y):
    surface = SURFACES["slipperiness", 20]
    times = np.linspace(1.0, 2.5, 50)
    flat = stroked_bench(surface, settings=EXACT)[0].wrench(times)
    tilted = stroked_bench(surface, settings=replace(EXACT, tilt=(about_x, about_y)))[0].wrench(times)
    turn = Rotation.from_euler("xy", [about_x, about_y], degrees=True)  # about the fixed axes: x, then y
    for columns in (slice(0, 3), slice(3, 6)):
        assert tilted[:, columns] == pytest.approx(turn.apply(flat[:, columns]), abs=1e-10)


def test_offset_and_wrong_gains_are_felt():
    settings = replace(EXACT, offset=(1, 0, -2, 0, 0, 5), gains=(2,) * 6)
    surface = SURFACES["stickiness", 0]
    times = np.linspace(0.0, 2.0, 20)
    expected = 2 * stroked_bench(surface, settings=EXACT)[0].wrench(times) + [1, 0, -2, 0, 0, 5]
    assert stroked_bench(surface, settings=settings)[0].wrench(times) == pytest.approx(expected)


def test_nothing_is_stroked_unless_mounted_and_no_two_strokes_at_once():
    bench = Bench()
    with pytest.raises(ValueError, match="mount"):
        bench.begin_stroke(Stroke(3.0, 20.0), 0.0)
    bench.mount(Surface(0.5))
    first = bench.begin_stroke(Stroke(3.0, 20.0), 0.0)
    with pytest.raises(ValueError, match="has not ended"):
        bench.begin_stroke(Stroke(3.0, 20.0), first.end - 0.01)
    bench.begin_stroke(Stroke(3.0, 20.0), first.end + 0.01)
    assert len(bench.ground_truth()) == 2


def test_a_surface_mounted_after_a_stroke_began_does_not_change_it():
    bench, truth = stroked_bench(SURFACES["stickiness", 0])
    bench.mount(SURFACES["stickiness", 100])
    assert bench.ground_truth() == (truth,)


@pytest.mark.parametrize(
    "properties", [{"mu": 0.0}, {"mu": 0.5, "tau_max": -1.0}, {"mu": 0.5, "speed": 0.0}, {"mu": 0.5, "direction": 2}]
)
def test_what_no_surface_can_be_is_refused(properties):
    with pytest.raises(ValueError, match="surface"):
        Surface(**properties)
