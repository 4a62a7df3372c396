"""Bodies that are no finger: dead loads, prescribed displacements and contact, at both kinematics."""

from dataclasses import replace

import numpy as np
import pytest

from solver._kernels import SLIP
from solver.body.finite import FiniteBody
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import Hooke, NeoHooke, stress
from solver.contact import LoadState
from solver.continuation.finite_states import solve_dead_load
from solver.equilibrium import EquilibriumState, Newton
from tests.solver.finite_examples import block, boundary_nodes

DERMIS = NeoHooke(0.08, 0.48)


def block_on_the_flat():
    """A block on the surface, held in the middle of its foot only, everything below touching."""
    mesh = block(columns=4, rows=2)
    middle = mesh.skin[np.isclose(mesh.nodes[mesh.skin, 0], 1.0)]
    newton = Newton(FiniteBody.of(replace(mesh, held=middle), [DERMIS]).condensed)
    start = EquilibriumState.undeformed(newton.condensed)
    touching = np.full(len(mesh.skin), SLIP, np.int32)
    return newton, replace(start, state=touching, sense=np.ones_like(touching))


@pytest.mark.parametrize(
    ("stretch", "lateral", "nominal"),
    [(0.9, 1.101300, -0.012098), (0.8, 1.224285, -0.029016), (0.7, 1.376321, -0.054219)],
)
def test_a_block_pressed_on_the_flat_by_a_dead_traction_takes_the_closed_forms_shape(stretch, lateral, nominal):
    newton, start = block_on_the_flat()
    mesh = newton.condensed.body.mesh
    top = np.flatnonzero(np.isclose(mesh.nodes[:, 1], 1.0))
    top = top[np.argsort(mesh.nodes[top, 0])]
    loads = edge_load(mesh, top, np.ones((len(top), 1)) @ [[0.0, nominal]])
    state = solve_dead_load(newton.condensed.body, loads, load=LoadState(0.0, 0.0, sense=1), start=start)
    exact = (mesh.nodes - [1.0, 0.0]) * [lateral - 1.0, stretch - 1.0]
    np.testing.assert_allclose(state.u, exact, atol=3e-5)  # the traction is given to five figures
    # the held corner of two of the four edges takes a sixth of each
    assert state.force[1] == pytest.approx(-2.0 * nominal * (1.0 - 1.0 / 12.0), rel=1e-9)


def test_a_prescribed_affine_boundary_is_affine_inside():
    mesh = block(columns=3, rows=3, distortion=0.15, seed=4)
    newton = Newton(FiniteBody.of(replace(mesh, held=boundary_nodes(mesh)), [DERMIS]).condensed)
    gradient = np.array([[0.2, 0.3], [-0.1, -0.1]])
    state = solve_dead_load(
        newton.condensed.body,
        prescribed=mesh.nodes @ gradient.T * newton.condensed.body.mesh.driven,
        load=LoadState(-1e3, 0.0),
    )
    np.testing.assert_allclose(state.u, mesh.nodes @ gradient.T, atol=1e-9)


def test_a_hanging_bar_carries_its_dead_traction_far_from_the_clamp():
    mesh = block(columns=2, rows=6, width=0.5, height=3.0)
    newton = Newton(FiniteBody.of(mesh, [DERMIS]).condensed)
    loads = edge_load(mesh, mesh.skin, np.ones((len(mesh.skin), 1)) @ [[0.0, -0.01]])
    place = mesh.nodes + solve_dead_load(newton.condensed.body, loads, load=LoadState(-1e3, 0.0)).u
    low, next_up = (np.isclose(mesh.nodes[:, 1], height) for height in (0.0, 0.5))
    stretches = np.ptp(place[low, 0]) / 0.5, (place[next_up, 1].mean() - place[low, 1].mean()) / 0.5
    P = stress(DERMIS, np.diag(stretches))  # noqa: N806
    np.testing.assert_allclose(P, [[0.0, 0.0], [0.0, 0.01]], atol=2e-4)


def test_small_loads_give_the_small_strain_answer():
    mesh = block(columns=4, rows=3, distortion=0.1, seed=2)
    loads = edge_load(mesh, mesh.skin, np.ones((len(mesh.skin), 1)) @ [[1e-5, -2e-5]])
    newton = Newton(FiniteBody.of(mesh, [NeoHooke(1.0, 0.3)]).condensed)
    finite = solve_dead_load(newton.condensed.body, loads, load=LoadState(-1e3, 0.0), steps=1)
    body = LinearBody.of(mesh, [Hooke(1.0, 0.3)], loads)
    small = body.displacement(body.condensed.free_displacement())
    np.testing.assert_allclose(finite.u, small, rtol=1e-3, atol=1e-4 * np.abs(small).max())


def test_a_load_on_an_elements_centre_is_refused():
    mesh = block()
    loads = np.zeros(mesh.nodes.shape)
    loads[mesh.elements[0, 8]] = 1.0
    with pytest.raises(ValueError, match="centre of an element"):
        solve_dead_load(FiniteBody.of(mesh, [DERMIS]), loads)
