"""Bodies handed in as meshes: any mesh can be halved, and the change says how far its numbers are off."""

from dataclasses import replace

import numpy as np
import pytest

from solver.accuracy.error_estimate import PARTS, estimate_errors
from solver.body.finite import FiniteBody
from solver.body.linear import Elastic, LinearBody, edge_load
from solver.constitutive import Hooke, NeoHooke
from solver.contact import ForceLoad, LoadState
from solver.equilibrium import Newton
from solver.equilibrium.load_stepping import march, slide_under, solve_full_slip
from solver.mesh import HalvedMesh, block, quality

SLIDE = LoadState(0.15, 0.3, sense=-1)


def foot(columns, rows=None):
    """A round block of 4 x 2 mm, so many elements long."""
    return block(np.linspace(-2.0, 2.0, columns + 1), np.linspace(0.0, 2.0, (rows or columns // 2) + 1), 8.0)


def small(mesh):
    return Newton(LinearBody.of(mesh, [Hooke(0.08, 0.48)]).condensed)


def finite(mesh):
    return Newton(FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)]).condensed)


def force(_, state):
    return state.force


def test_a_halved_mesh_is_the_same_body_and_has_what_the_coarse_one_could_do():
    mesh = replace(block(np.array([-2.0, -1.0, 2.0]), np.array([0.0, 0.5, 2.0])), region=np.array([0, 1, 0, 1]))
    halved = HalvedMesh.of(mesh)
    laws = [Hooke(0.08, 0.0), Hooke(0.3, 0.0)]  # without pressure modes, which the finer mesh has more of
    displacement = np.random.default_rng(1).normal(size=mesh.nodes.shape)
    energies = []
    for some_mesh, u in ((mesh, displacement), (halved.mesh, halved.between(displacement))):
        energies.append(np.sum(u[some_mesh.elements] * Elastic.of(some_mesh, laws).forces(u[some_mesh.elements])))
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)
    assert quality(halved.mesh)["jacobian_ratio"] == pytest.approx(1.0)
    assert len(halved.mesh.nodes) == 81
    assert np.array_equal(halved.mesh.nodes[: len(mesh.nodes)], mesh.nodes)


def test_what_is_held_rolls_and_may_touch_stays_so_on_every_new_node_between():
    mesh = foot(6)
    middle = np.flatnonzero(np.abs(mesh.nodes[:, 0]) < 1e-9)
    rolls = replace(mesh, held=mesh.held[:0], held_y=mesh.held, held_x=middle)
    halved = HalvedMesh.of(rolls)
    driven, nodes = halved.mesh.driven, halved.mesh.nodes
    assert np.array_equal(driven[:, 1], nodes[:, 1] == 2.0)
    assert np.array_equal(driven[:, 0], np.abs(nodes[:, 0]) < 1e-9)
    skin = nodes[halved.mesh.skin]
    assert len(skin) == 2 * len(mesh.skin) - 1
    assert np.all(np.diff(skin[:, 0]) > 0.0)


def test_a_pressure_along_a_chain_of_edges_amounts_to_the_same_force_on_both_meshes():
    mesh = foot(6)
    halved = HalvedMesh.of(mesh)
    forces = [
        edge_load(some_mesh, chain, np.ones((len(chain), 2))).sum(axis=0)
        for some_mesh, chain in ((mesh, mesh.skin), (halved.mesh, halved.chain(mesh.skin)))
    ]
    assert forces[1] == pytest.approx(forces[0], rel=1e-4)  # the length of a curved edge, by quadrature


@pytest.mark.parametrize("newton_of", [small, finite])
@pytest.mark.parametrize("columns", [10, 12, 16, 20])
def test_errors_of_the_forces_on_a_round_foot_lie_above_the_true_ones_and_below_ten_times_them(newton_of, columns):
    fine = [solve_full_slip(newton_of(foot(n)), SLIDE).force for n in (64, 72)]
    mesh = foot(columns)
    newton, nested = newton_of(mesh), newton_of(HalvedMesh.of(mesh).mesh)
    estimate = estimate_errors(force, newton, solve_full_slip(newton, SLIDE), (nested, solve_full_slip(nested, SLIDE)))
    true_error = np.abs(estimate.value - fine[1])
    assert np.all(np.abs(fine[1] - fine[0]) < estimate.error / 3.0)
    assert np.all(true_error <= estimate.error)
    assert np.all(estimate.error < 10.0 * np.maximum(true_error, 2e-4 * np.abs(fine[1])))


def test_under_a_given_force_the_depth_has_an_error():
    mesh = foot(12)
    newton, nested = small(mesh), small(HalvedMesh.of(mesh).mesh)
    states = [slide_under(model, LoadState(0.0, 0.3, sense=-1), 0.02) for model in (newton, nested, small(foot(72)))]

    def depth(_, state):
        return np.array([state.load.depth])

    estimate = estimate_errors(depth, newton, states[0], (nested, states[1]), ForceLoad(0.02, None))
    assert abs(estimate.value - states[2].load.depth) <= estimate.error
    assert estimate.error < 0.02 * estimate.value


def test_a_press_with_friction_errs_by_its_load_steps_too():
    def press(newton, steps):
        *_, last = march(newton, [LoadState(0.2 * (n + 1) / steps, 0.5) for n in range(steps)])
        return last

    def drag_of_half(_, state):  # of the right half: by symmetry the whole has none
        return np.array([state.reaction[len(state.reaction) // 2 + 1 :, 0].sum()])

    mesh = foot(12)
    newton, nested = small(mesh), small(HalvedMesh.of(mesh).mesh)
    usual, finer = press(newton, 25), press(nested, 25)
    truth = drag_of_half(None, press(small(foot(48)), 400))
    fewer = [press(newton, round(25 * part)) for part in PARTS]
    estimate = estimate_errors(drag_of_half, newton, usual, (nested, finer), fewer=fewer)
    without_steps = estimate_errors(drag_of_half, newton, usual, (nested, finer))
    assert abs(estimate.value - truth) <= estimate.error
    assert estimate.error > without_steps.error
    with pytest.raises(ValueError, match="fewer has 1 states"):
        estimate_errors(drag_of_half, newton, usual, (nested, finer), fewer=fewer[:1])
