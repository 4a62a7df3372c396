"""A settled sliding state is given only where there is one."""

from dataclasses import replace

import numpy as np
import pytest

from solver.existence import steady
from solver.failures import NoSteadyState
from solver.newton import Pull
from solver.scene import Finger, Friction, Loading, Material, Materials, Scene, Solve
from solver.sliding import settled
from solver.solution import solve
from tests.solver.finite_examples import finger

TOWARDS_TIP = -1


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    ("mu", "tau"),
    [
        (0.44, 0.015478),
        pytest.param(0.48, 0.019038, marks=SLOW),
        pytest.param(0.64, 0.049998, marks=SLOW),
        pytest.param(0.67, 0.05255, marks=SLOW),
    ],
)
def test_four_surfaces_have_no_settled_sliding_at_two_millimetres_and_the_refusal_says_how_far_they_have(mu, tau):
    newton, _, outline = finger(8, margin=3.0)
    with pytest.raises(NoSteadyState, match="folds") as refusal:
        steady(newton, Pull(2.0, mu, tau, TOWARDS_TIP), outline)
    assert refusal.value.limit_mu == pytest.approx(0.375, rel=0.04)
    assert "finer meshes" not in str(refusal.value)
    assert 1.4 < refusal.value.limit_indentation < 1.9


def test_a_sound_state_is_the_direct_one():
    newton, _, outline = finger(5)
    pull = Pull(1.5, 0.44, 0.03009, 1)
    shape = steady(newton, pull, outline)
    np.testing.assert_array_equal(shape.u, settled(newton, pull).u)


def test_friction_without_measure_is_the_bound_alone():
    newton, probes, outline = finger(6, margin=3.0)
    sed = [probes.average(newton.body, steady(newton, Pull(1.0, mu, 0.005, 1), outline).u)[0] for mu in (50.0, 1000.0)]
    assert sed[0] == pytest.approx(sed[1], rel=1e-3)


def test_a_bound_next_to_nothing_leaves_the_frictionless_state_whatever_the_coefficient():
    newton, probes, outline = finger(5)
    sed = [
        probes.average(newton.body, steady(newton, Pull(1.0, mu, tau, 1), outline).u)[0]
        for mu, tau in ((0.0, np.inf), (1000.0, 1e-9))
    ]
    assert sed[0] == pytest.approx(sed[1], rel=1e-6)


@pytest.mark.parametrize("depth", [1e-6, 1e-4, 1e-2])
def test_a_finger_that_barely_touches_has_an_answer(depth):
    newton, _, outline = finger(5)
    shape = steady(newton, Pull(depth, 0.5, 0.01, 1), outline)
    assert shape.touching.any()
    assert shape.force[1] > 0.0


@pytest.mark.slow
def test_where_skin_folds_at_one_place_before_its_limit_point_answers_and_refusals_say_that_the_mesh_has_a_part_in_it():
    tissues = Materials(*(Material(modulus, 0.48) for modulus in (0.1525, 0.0775, 0.0303)))
    asked = Scene(
        finger=Finger(contact_angle=69.4),
        materials=tissues,
        friction=Friction(0.8),
        loading=Loading(1.8, "+x"),
        solve=Solve("finite"),
    )
    assert any("squeezed" in told for told in solve(asked).warnings)
    assert not any("squeezed" in told for told in solve(replace(asked, friction=Friction(0.6))).warnings)
    with pytest.raises(NoSteadyState, match="finer meshes"):
        solve(replace(asked, friction=Friction(0.95)))
