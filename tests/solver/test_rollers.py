"""Bodies held along one direction alone: rollers, planes of symmetry, and one component prescribed."""

from dataclasses import replace

import numpy as np
import pytest

from solver.body.finite import FiniteBody
from solver.body.linear import LinearBody, edge_load
from solver.body.validation import BodyError
from solver.constitutive import Hooke, NeoHooke
from solver.contact import LoadState
from solver.continuation.finite_states import solve_dead_load
from solver.equilibrium import Newton
from solver.equilibrium.load_stepping import march
from solver.mesh import Mesh
from solver.mesh import block as round_block
from solver.verification.published.bodies import ring
from solver.verification.published.locking import INNER, OUTER, YOUNG, widening
from tests.solver.finite_examples import block

NO_SKIN = np.zeros((0, 2))
CLEAR = LoadState(-1e3, 0.0)


def nodes_at(mesh, axis, value):
    return np.flatnonzero(np.isclose(mesh.nodes[:, axis], value, atol=1e-12))


def submesh(mesh, keep):
    """Return the elements `keep` of a mesh with nodes numbered anew, and these nodes' numbers in the whole."""
    elements = mesh.elements[keep]
    old, new = np.unique(elements, return_inverse=True)
    number = np.full(len(mesh.nodes), -1)
    number[old] = np.arange(len(old))
    skin, held = (number[nodes[number[nodes] >= 0]] for nodes in (mesh.skin, mesh.held))
    return Mesh(mesh.nodes[old], new.reshape(elements.shape), mesh.region[keep], skin, held), old


def block_on_rollers():
    """A distorted block whose left side rolls along y and whose foot rolls along x; the top is free."""
    mesh = block(columns=3, rows=3, distortion=0.15, seed=4)
    return replace(
        mesh, skin=mesh.skin[:0], held=mesh.held[:0], held_x=nodes_at(mesh, 0, 0.0), held_y=nodes_at(mesh, 1, 0.0)
    )


def test_a_block_on_rollers_under_a_dead_traction_stretches_evenly_at_small_strain():
    mesh = block_on_rollers()
    top = nodes_at(mesh, 1, 1.0)
    top = top[np.argsort(mesh.nodes[top, 0])]
    loads = edge_load(mesh, top, np.ones((len(top), 1)) @ [[0.0, -1e-3]])
    displacement = LinearBody.of(mesh, [Hooke(1.0, 0.3)], loads).displacement(NO_SKIN)
    exact = mesh.nodes * [1e-3 * 0.3 * 1.3, -1e-3 * (1.0 - 0.3**2)]  # plane strain
    np.testing.assert_allclose(displacement, exact, atol=1e-15)


def test_one_component_prescribed_leaves_the_other_free_at_small_strain():
    mesh = block_on_rollers()
    mesh = replace(mesh, held_y=np.union1d(mesh.held_y, nodes_at(mesh, 1, 1.0)))
    prescribed = np.zeros(mesh.nodes.shape)
    prescribed[nodes_at(mesh, 1, 1.0), 1] = -0.01
    displacement = LinearBody.of(mesh, [Hooke(1.0, 0.3)], prescribed=prescribed).displacement(NO_SKIN)
    np.testing.assert_allclose(displacement, mesh.nodes * [0.01 * 0.3 / 0.7, -0.01], atol=1e-14)


def test_one_component_prescribed_leaves_the_other_free_at_finite_strain():
    """Sides free at a stretch of 0.8: the closed form of the law."""
    mesh = block_on_rollers()
    side = nodes_at(mesh, 0, 2.0)
    skin = side[np.argsort(mesh.nodes[side, 1])][2:5]
    mesh = replace(mesh, skin=skin, held_y=np.union1d(mesh.held_y, nodes_at(mesh, 1, 1.0)))
    prescribed = np.zeros(mesh.nodes.shape)
    prescribed[nodes_at(mesh, 1, 1.0), 1] = -0.2
    state = solve_dead_load(FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)]), prescribed=prescribed, load=CLEAR)
    np.testing.assert_allclose(state.u, mesh.nodes * [0.224285, -0.2], atol=1e-6)
    side_u = state.u[side, 0]
    assert np.ptp(side_u) < 1e-9


def halves():
    """A round foot and its right half, which the plane of symmetry holds along x."""
    whole = round_block(np.linspace(-2.0, 2.0, 9), np.linspace(0.0, 1.5, 4), radius=4.0)
    half, old = submesh(whole, whole.nodes[whole.elements[:, 8], 0] > 0.0)
    return whole, replace(half, held_x=np.setdiff1d(nodes_at(half, 0, 0.0), half.held)), old


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_half_a_body_at_its_plane_of_symmetry_is_the_whole_to_round_off_at_small_strain(mu):
    whole, half, old = halves()

    def press(mesh):
        body = LinearBody.of(mesh, [Hooke(0.08, 0.48)])
        *_, state = march(Newton(body.condensed), [LoadState(depth, mu) for depth in (0.05, 0.1, 0.15)])
        return state.force[1], body.displacement(state.u)

    (force, whole_u), (half_force, half_u) = press(whole), press(half)
    assert half_force == pytest.approx(force / 2.0, rel=1e-11)
    np.testing.assert_allclose(half_u, whole_u[old], atol=1e-13)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_half_a_body_at_its_plane_of_symmetry_is_the_whole_to_round_off_at_finite_strain(mu):
    whole, half, old = halves()

    def press(mesh):
        newton = Newton(FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)]).condensed)
        *_, state = march(newton, [LoadState(depth, mu) for depth in (0.1, 0.2, 0.3)], None, 1e-14)
        return state.force[1], state.u

    (force, whole_u), (half_force, half_u) = press(whole), press(half)
    assert half_force == pytest.approx(force / 2.0, rel=1e-11)
    np.testing.assert_allclose(half_u, whole_u[old], atol=1e-12)


def quarter(radial=5, around=20):
    """A quarter of a thick cylinder on rollers, and its hole in order."""
    whole, hole = ring(INNER, OUTER, radial, around)
    centre = whole.nodes[whole.elements[:, 8]]
    mesh, old = submesh(replace(whole, skin=whole.skin[:0]), (centre > 0.0).all(axis=1))
    number = np.full(len(whole.nodes), -1)
    number[old] = np.arange(len(old))
    inside = number[hole[:-1]]
    inside = inside[inside >= 0]
    order = inside[np.argsort(-mesh.nodes[inside, 0])]
    around_it = np.flatnonzero(np.isclose(np.hypot(*mesh.nodes.T), OUTER))
    outside = around_it[np.argsort(mesh.nodes[around_it, 0])]
    mesh = replace(mesh, skin=outside[4:1:-1], held_x=nodes_at(mesh, 0, 0.0), held_y=nodes_at(mesh, 1, 0.0))
    return mesh, order


@pytest.mark.parametrize("nu", [0.3, 0.4999999])
def test_a_quarter_of_a_thick_cylinder_on_rollers_widens_as_the_closed_form_says(nu):
    mesh, hole = quarter()
    loads = edge_load(mesh, hole, mesh.nodes[hole] / INNER)
    body = LinearBody.of(mesh, [Hooke(YOUNG, nu)], loads)
    displacement = body.displacement(body.condensed.free_displacement())[hole]
    radial = np.sum(displacement * mesh.nodes[hole], axis=1)[::2] / INNER
    np.testing.assert_allclose(radial, widening(nu), rtol=2e-4)


def test_a_quarter_of_a_thick_cylinder_widens_so_at_finite_strain_under_a_small_pressure():
    mesh, hole = quarter()
    loads = 1e-4 * edge_load(mesh, hole, mesh.nodes[hole] / INNER)
    state = solve_dead_load(FiniteBody.of(mesh, [NeoHooke(YOUNG, 0.49)]), loads, load=CLEAR, steps=1)
    radial = np.sum(state.u[hole] * mesh.nodes[hole], axis=1)[::2] / INNER
    np.testing.assert_allclose(radial, 1e-4 * widening(0.49), rtol=2e-4)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"held_y": np.array([3])}, "held along y; leave its edge out"),
        ({"held": np.empty(0, np.int64), "held_x": np.array([0, 1])}, "leaves the body a motion"),
        ({"held_x": np.array([10**6])}, "mesh.held_x names a node that does not exist"),
    ],
)
def test_what_is_held_so_that_it_cannot_be_solved_is_refused_in_a_sentence(change, sentence):
    mesh = round_block(np.linspace(-1.0, 1.0, 3), np.linspace(0.0, 1.0, 3))
    change = {name: mesh.skin[:1] if name == "held_y" else nodes for name, nodes in change.items()}
    with pytest.raises(BodyError, match=sentence):
        LinearBody.of(replace(mesh, **change), [Hooke(0.08, 0.48)])


def test_at_finite_strain_a_body_that_nothing_holds_is_refused_in_a_sentence():
    mesh = round_block(np.linspace(-1.0, 1.0, 3), np.linspace(0.0, 1.0, 3), held=False)
    with pytest.raises(BodyError, match="nothing holds the body"):
        FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)])


def test_what_nothing_holds_cannot_be_prescribed():
    mesh = block_on_rollers()
    with pytest.raises(BodyError, match=r"moves node \d+ along y, where nothing holds it"):
        LinearBody.of(mesh, [Hooke(0.08, 0.48)], prescribed=mesh.nodes * [0.0, 1.0])
