"""A state carried to a finer mesh."""

import numpy as np
import pytest

from solver import Finger, Receptor
from solver.equilibrium.full_slip import settled
from solver.equilibrium.mesh_transfer import MeshTransfer, Places
from solver.equilibrium.newton import LoadState
from solver.mesh.mesher import Sizing, finger_mesh
from tests.solver.finite_examples import finger
from tests.solver.oracle import finite as oracle

PULL = LoadState(1.0, 0.28, 0.008033, -1)


def places(fineness):
    return Places.of(finger_mesh(Finger(), Receptor(), Sizing(fineness, 2.0, margin=2.0)), finger(fineness)[0].body)


def test_a_mesh_carries_a_state_to_itself_unchanged():
    newton, _, _ = finger(5)
    shape = settled(newton, PULL)
    same = MeshTransfer.of(places(5), places(5)).carried(shape)
    np.testing.assert_allclose(same.u, shape.u, atol=1e-13)
    np.testing.assert_array_equal(same.touching, shape.touching)
    np.testing.assert_allclose(same.pressure, shape.pressure, atol=1e-7)


def test_the_compiled_carrying_is_the_plain_one():
    shape = settled(finger(5)[0], PULL)
    bridge = MeshTransfer.of(places(5), places(8))
    old, new = bridge.old, bridge.new
    combined = np.einsum("em,eml->el", shape.pressure, old.body.combination)
    slopes = combined.copy()
    slopes[:, 0] -= np.einsum("ei,ei->e", combined[:, 1:], old.body.centre)
    layers = len(old.heights) // 2
    host = bridge.station[:, None, :, None] * layers + bridge.layer[None, :, None, :]
    u, pressure = oracle.carry(
        shape.u.reshape(len(old.arcs), len(old.heights), 2), slopes, (bridge.along, bridge.along_parts),
        (bridge.across, bridge.across_parts), host.reshape(-1, 9), new.points, new.body.weight, new.body.modes,
    )  # fmt: skip
    found, modes = bridge.fields(shape.u, shape.pressure)
    np.testing.assert_allclose(found, u.reshape(-1, 2), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(modes, pressure, rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize("fineness", [8, 12])
def test_a_carried_state_is_a_few_iterations_from_the_finer_meshs_own(fineness):
    coarse, _, _ = finger(5)
    fine, _, _ = finger(fineness)
    start = MeshTransfer.of(places(5), places(fineness)).carried(settled(coarse, PULL))
    found, direct = settled(fine, PULL, start), settled(fine, PULL)
    assert found.iterations - start.iterations <= 5
    np.testing.assert_allclose(found.u, direct.u, atol=1e-9)
