"""A state carried to a finer mesh."""

import numpy as np
import pytest

from solver.carrying import Places, carried
from solver.mesher import Sizing, finger_mesh
from solver.newton import Pull
from solver.scene import Finger, Receptor
from solver.sliding import settled
from tests.solver.finite_examples import finger

PULL = Pull(1.0, 0.28, 0.008033, -1)


def places(fineness):
    return Places.of(finger_mesh(Finger(), Receptor(), Sizing(fineness, 2.0, margin=2.0)), finger(fineness)[0].body)


def test_a_mesh_carries_a_state_to_itself_unchanged():
    newton, _, _ = finger(5)
    shape = settled(newton, PULL)
    same = carried(shape, places(5), places(5))
    np.testing.assert_allclose(same.u, shape.u, atol=1e-13)
    np.testing.assert_array_equal(same.touching, shape.touching)
    np.testing.assert_allclose(same.pressure, shape.pressure, atol=1e-7)


@pytest.mark.parametrize("fineness", [8, 12])
def test_a_carried_state_is_a_few_iterations_from_the_finer_meshs_own(fineness):
    coarse, _, _ = finger(5)
    fine, _, _ = finger(fineness)
    start = carried(settled(coarse, PULL), places(5), places(fineness))
    found, direct = settled(fine, PULL, start), settled(fine, PULL)
    assert found.iterations - start.iterations <= 5
    np.testing.assert_allclose(found.u, direct.u, atol=1e-9)
