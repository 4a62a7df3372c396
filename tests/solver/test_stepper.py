"""The warm steppers find depth and travel from the forces, reading by reading."""

import gc
import tracemalloc
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from solver import Friction, Loading, Scene, Solve, solve, stepper
from solver.contact import ForceLoad, LoadState
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import FiniteFinger, LinearFinger
from solver.equilibrium.load_stepping import march
from solver.mesh.mesher import Sizing
from solver.prediction import ROW
from solver.response.stepper import FiniteStepper, SmallStepper
from solver.verification.histories import press_and_slide

KINEMATICS = ("small", "finite")


@cache
def finger_on_mesh(kinematics, fineness):
    scene = Scene(friction=Friction(0.3), loading=Loading(2.0), solve=Solve(kinematics=kinematics))
    finger_class = LinearFinger if kinematics == "small" else FiniteFinger
    return finger_class.of(scene, Sizing(fineness, 2.0, margin=4.0))


def stepper_on_mesh(kinematics, mu, tau=np.inf):
    return (
        SmallStepper(finger_on_mesh("small", 6), mu, tau)
        if kinematics == "small"
        else FiniteStepper(finger_on_mesh("finite", 5), mu, tau)
    )


def readings(kinematics, depth, mu, direction):
    """Yield forces and SED of a course driven by depth, 200 readings of pressing and 60 of sliding at 20 mm/s."""
    if kinematics == "finite":
        fine = finger_on_mesh("finite", 8)
        course = press_and_slide(depth, mu, np.inf, direction, press=200, slides=60, distance=6.0)
        for finite_state in march(fine.newton, course, tolerance=1e-7):
            yield finite_state.force[1], finite_state.force[0], fine.sed_ending(finite_state.u)
        return
    fine = finger_on_mesh("small", 12)
    course = press_and_slide(depth, mu, np.inf, direction, press=200, slides=60, distance=6.0)
    for state in march(fine.newton, course):
        yield state.force[1], state.force[0], fine.sed_ending(fine.displacement(state))


COURSES = [(1.5, 0.62, -1), (1.5, 0.24, -1), (2.0, 0.28, 1)]  # depth [mm], mu, direction


@pytest.mark.parametrize(
    ("kinematics", "depth", "mu", "direction"),
    [
        *(("small", *course) for course in COURSES),
        *(pytest.param("finite", *course, marks=pytest.mark.slow) for course in COURSES),
    ],
)
def test_one_call_a_reading_keeps_the_response_within_two_per_cent_of_its_peak(kinematics, depth, mu, direction):
    live = stepper_on_mesh(kinematics, mu)
    course = list(readings(kinematics, depth, mu, direction))
    seds = [live.step(normal, tangential) for normal, tangential, _ in course]
    truth = np.array([sed for _, _, sed in course])
    assert np.abs(seds - truth).max() < 0.02 * truth.max()
    assert live.depth == pytest.approx(depth, rel=0.03)


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_a_lifted_finger_has_no_response_and_starts_afresh(kinematics):
    live = stepper_on_mesh(kinematics, 0.4)
    for part in (0.2, 0.4, 0.6, 0.8, 1.0):
        assert live.step(0.01 * part, 0.0) > 0.0
    assert live.step(0.0, 0.0) == 0.0
    assert live.depth == 0.0
    undeformed = stepper_on_mesh(kinematics, 0.4)
    np.testing.assert_array_equal(live.outline(), undeformed.outline())


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_a_reading_that_is_no_number_costs_that_reading_alone(kinematics):
    live, undisturbed = stepper_on_mesh(kinematics, 0.4), stepper_on_mesh(kinematics, 0.4)
    for part in (0.2, 0.4, 0.6, 0.8, 1.0):
        expected = undisturbed.step(0.01 * part, 0.002 * part)
        for nonsense in ((np.nan, 0.0), (0.01, np.nan), (np.inf, 0.0)):
            assert np.isnan(live.step(*nonsense))
        assert live.step(0.01 * part, 0.002 * part) == expected


def press_then_drag(normal, drag):
    """Yield forces [N/mm]: 100 readings of pressing, 200 of a drag that grows, 5 held."""
    yield from ((normal * n / 100, 0.0) for n in range(1, 101))
    yield from ((normal, drag * min(n, 200) / 200) for n in range(1, 206))


def test_pressed_much_deeper_than_its_mesh_was_made_for_it_ends_in_the_full_solves_state():
    scene = Scene(
        friction=Friction(1.0),
        loading=Loading(None, "-x", normal_force=1.85, force_unit="N"),
        solve=Solve("finite", tolerance=0.05),
    )
    live = stepper(replace(scene, loading=Loading(1.5, "-x")))
    seds = [live.step(*forces) for forces in press_then_drag(1.85 / scene.finger.width, 1.85 / scene.finger.width)]
    prediction = solve(scene)
    assert not np.isnan(seds).any()
    assert abs(seds[-1] - prediction.sed_ending) < 0.02 * max(seds)
    assert live.depth == pytest.approx(prediction.indentation, rel=0.02)
    assert live.depth > 2.1


def test_at_finite_strain_no_number_is_reported_of_skin_that_folds_until_the_force_has_eased():
    live = stepper(Scene(friction=Friction(1.0), loading=Loading(1.5, "+x"), solve=Solve("finite")))
    seds = [live.step(*forces) for forces in press_then_drag(2.0 / 15.0, -2.0 / 15.0)]
    first = int(np.flatnonzero(np.isnan(seds))[0])  # the full solve has no settled state there
    assert first > 100
    assert np.isnan(seds[first:]).all()
    assert 0.0 < live.step(1.0 / 15.0, -0.2 / 15.0) < seds[100]


def test_a_state_that_has_not_caught_up_with_its_forces_is_not_told_of():
    live = stepper(Scene(friction=Friction(0.3), loading=Loading(1.5), solve=Solve("finite")))
    seds = [live.step(0.1, 0.0) for _ in range(20)]
    assert np.isnan(seds[0])
    assert np.isfinite(seds[-1])
    for sed in seds:
        assert np.isnan(sed) or sed == pytest.approx(seds[-1], rel=0.05)


@pytest.mark.parametrize("knock", [0.3, 10.0, 1e300])  # N/mm
def test_one_reading_of_a_knock_costs_that_reading_alone(knock):
    live = stepper_on_mesh("finite", 0.3)
    for part in np.linspace(1 / 80, 1.0, 80):
        sed = live.step(0.08 * part, 0.023 * part)
    assert np.isnan(live.step(knock, 0.023))
    seds = [live.step(0.08, 0.023) for _ in range(4)]
    np.testing.assert_allclose(seds, sed, rtol=0.005)  # shared out anew between stick and slip


@pytest.mark.parametrize("readings_of_turn", [1, 2, 10])
def test_a_drag_that_turns_within_one_reading_ends_where_one_that_never_turned_does(readings_of_turn):
    turning, straight = stepper_on_mesh("finite", 0.44), stepper_on_mesh("finite", 0.44)
    for part in np.linspace(1 / 80, 1.0, 80):
        turning.step(0.08 * part, 0.0352 * part)
        straight.step(0.08 * part, -0.0352 * part)
    for part in np.linspace(1.0, -1.0, readings_of_turn + 1)[1:]:
        turning.step(0.08, 0.0352 * part)
    assert turning.step(0.08, -0.0352) == pytest.approx(straight.step(0.08, -0.0352), rel=1e-3)


def test_a_reading_may_be_a_number_of_any_kind():
    live, float_stepper = stepper_on_mesh("small", 0.3), stepper_on_mesh("small", 0.3)
    for kind in (np.float32, np.float64, np.array):
        assert live.step(kind(0.0625), kind(0.015625)) == float_stepper.step(0.0625, 0.015625)
    np.testing.assert_equal(live.step(1, 0), float_stepper.step(1.0, 0.0))


@pytest.mark.parametrize("readings_of_lift", [4, pytest.param(8, marks=pytest.mark.slow)])  # 20 and 40 ms at 200 Hz
def test_a_finger_that_lifts_quickly_is_reported_as_it_is(readings_of_lift):
    finger, mu = finger_on_mesh("finite", 5), 0.4
    live = stepper_on_mesh("finite", mu)
    part = np.linspace(0.0, 1.0, readings_of_lift + 1)[1:-1]
    lift = 1.0 - part**2 * (3.0 - 2.0 * part)
    course = [ForceLoad(0.1 * p, 0.0) for p in np.linspace(0.05, 1.0, 30)]
    course += [ForceLoad(0.1, -0.0399 * p) for p in np.linspace(0.05, 1.0, 30)]
    course += [ForceLoad(0.1 * p, -0.0399 * p) for p in lift.tolist()]
    states = march(finger.newton, course, EquilibriumState.undeformed(finger.newton.condensed, LoadState(0.0, mu)))
    truth = np.array([finger.sed_ending(state.u) for state in states])
    seds = np.array([live.step(forces.normal, forces.tangential) for forces in course])
    assert np.abs(seds - truth).max() < 0.02 * truth.max()


def test_forces_held_still_are_met_exactly_at_finite_strain():
    live = stepper_on_mesh("finite", 0.6)
    for part in np.linspace(0.1, 1.0, 10):
        live.step(0.05 * part, 0.01 * part)
    for _ in range(20):
        live.step(0.05, 0.01)
    np.testing.assert_allclose(live.state.force, [0.01, 0.05], rtol=1e-8)


def test_the_condensed_finger_gives_the_energies_and_the_outline_of_the_meshed_one():
    finger = finger_on_mesh("small", 6)
    live = stepper_on_mesh("small", 0.4)
    for n in range(1, 21):
        sed = live.step(0.004 * n, -0.001 * n)
    displacement = finger.displacement(live.state)
    assert sed == pytest.approx(finger.sed_ending(displacement), rel=1e-10)
    np.testing.assert_allclose(live.row(), finger.row.average(displacement), rtol=1e-8)
    skin_nodes = finger.geometry.all_skin
    outline = finger.geometry.mesh.nodes[skin_nodes] + displacement[skin_nodes] - [0.0, live.depth]
    np.testing.assert_allclose(live.outline(), outline, atol=1e-12)


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_the_drawn_skin_lies_on_the_surface_where_it_touches_and_nowhere_below(kinematics):
    scene = Scene(friction=Friction(0.5), loading=Loading(1.0, "-x"), solve=Solve(kinematics=kinematics))
    live = stepper(scene)
    for n in range(1, 31):
        live.step(0.001 * n, 0.0002 * n)
    height = live.outline()[:, 1]
    assert height.min() == pytest.approx(0.0, abs=1e-6)
    assert (height < 1e-6).sum() > 5
    assert live.row().shape == ROW.shape


def test_a_force_that_presses_beyond_the_looked_at_skin_loses_the_state_and_says_nan():
    live = stepper_on_mesh("small", 0.3)
    for n in range(1, 200):
        if np.isnan(live.step(0.05 * n, 0.0)):
            break
    assert n < 199
    assert live.step(0.01, 0.0) > 0.0


def test_memory_does_not_grow_with_the_readings():
    live = stepper_on_mesh("small", 0.3)

    def rub():
        for n in range(1, 200):
            live.step(0.0005 * n, 0.0001 * n)

    def traced_memory():
        gc.collect()  # tuples that Python keeps for reuse are no readings'
        return tracemalloc.get_traced_memory()[0]

    rub()
    tracemalloc.start()
    rub()
    before = traced_memory()
    for _ in range(3):
        rub()
    after = traced_memory()
    tracemalloc.stop()
    assert after - before < 2000  # bytes
