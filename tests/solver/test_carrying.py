"""A state carried to a finer mesh."""

import numpy as np
import pytest

from solver import Finger, Receptor
from solver.contact import LoadState
from solver.equilibrium.finger import GridPositions, MeshTransfer
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh.mesher import Sizing, finger_mesh
from tests.solver.finite_examples import finger

LOAD = LoadState(1.0, 0.28, 0.008033, -1)


def places(fineness):
    return GridPositions.of(
        finger_mesh(Finger(), Receptor(), Sizing(fineness, 2.0, margin=2.0)), finger(fineness)[0].condensed.body
    )


def test_a_mesh_carries_a_state_to_itself_unchanged():
    newton, _, _ = finger(5)
    state = solve_full_slip(newton, LOAD)
    transferred_state = MeshTransfer.of(places(5), places(5)).transfer_state(state)
    np.testing.assert_allclose(transferred_state.u, state.u, atol=1e-13)
    np.testing.assert_array_equal(transferred_state.touching, state.touching)
    np.testing.assert_allclose(transferred_state.pressure, state.pressure, atol=1e-7)


def test_a_linear_pressure_and_a_displacement_of_the_whole_are_the_same_on_another_mesh():
    old, new = places(5), places(8)
    pressures = [
        np.einsum("eq,eqm,eq->em", mesh.body.elements.weight, mesh.body.elements.modes, 1.0 + mesh.points @ [2.0, -3.0])
        for mesh in (old, new)
    ]
    uniform_shift = np.tile([0.3, -0.2], (len(old.body.mesh.nodes), 1))
    u, pressure = MeshTransfer.of(old, new).fields(uniform_shift, pressures[0])
    np.testing.assert_allclose(pressure, pressures[1], rtol=1e-10, atol=1e-12)
    held = new.body.mesh.driven
    np.testing.assert_allclose(u, np.where(held, 0.0, [0.3, -0.2]), rtol=1e-13)


@pytest.mark.parametrize("fineness", [8, 12])
def test_a_carried_state_is_a_few_iterations_from_the_finer_meshs_own(fineness):
    coarse, _, _ = finger(5)
    fine, _, _ = finger(fineness)
    start = MeshTransfer.of(places(5), places(fineness)).transfer_state(solve_full_slip(coarse, LOAD))
    transferred, direct = solve_full_slip(fine, LOAD, start), solve_full_slip(fine, LOAD)
    assert transferred.iterations - start.iterations <= 5
    np.testing.assert_allclose(transferred.u, direct.u, atol=1e-9)
