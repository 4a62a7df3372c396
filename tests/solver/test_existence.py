"""A settled sliding state is given only where there is one."""

import numpy as np
import pytest

from solver.existence import steady
from solver.failures import NoSteadyState
from solver.newton import Pull
from solver.sliding import settled
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


@pytest.mark.parametrize("depth", [1e-6, 1e-4, 1e-2])
def test_a_finger_that_barely_touches_has_an_answer(depth):
    newton, _, outline = finger(5)
    shape = steady(newton, Pull(depth, 0.5, 0.01, 1), outline)
    assert shape.touching.any()
    assert shape.force[1] > 0.0
