"""Settled sliding at finite strain: the published finger, the incompressible limit, balance, and patch states."""

from dataclasses import replace

import numpy as np
import pytest

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP
from solver.body.finite import FiniteBody
from solver.constitutive import NeoHooke
from solver.contact import LoadState
from solver.equilibrium import Newton
from solver.equilibrium.load_stepping import solve_full_slip
from tests.solver.finite_examples import block, finger
from tests.solver.oracle import finite as oracle

# ending-averaged SED [MPa], normal and tangential force [N/mm]: means of two independent codes (quadrilaterals with
# exact contact, up to 36,000 unknowns; high-order triangles with penalty contact, 27,000), which agree to 0.05-0.2 %
REFERENCE = {
    "press d1.5": (LoadState(1.5, 0.0, np.inf, 1), 0.0065997, 0.12497, 0.0),
    "press d2.0": (LoadState(2.0, 0.0, np.inf, 1), 0.0102866, 0.20519, 0.0),
    "slip 0": (LoadState(1.5, 0.62, 0.04707, 1), 0.0019115, 0.08142, 0.05048),
    "slip 55": (LoadState(1.5, 0.44, 0.03009, 1), 0.0025631, 0.09056, 0.03985),
    "slip 100": (LoadState(1.5, 0.24, 0.00877, 1), 0.0039081, 0.10361, 0.02487),
    "stick 0": (LoadState(2.0, 0.28, 0.008033, -1), 0.009656, 0.26279, 0.05666),
    "stick 0 at d1.0": (LoadState(1.0, 0.28, 0.008033, -1), 0.003254, 0.07777, 0.02177),
    "stick 100 at d1.0": (LoadState(1.0, 0.67, 0.05255, -1), 0.0020332, 0.09485, 0.06355),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_the_published_finger_answers_as_two_other_codes_found(name):
    load, sed, normal, tangential = REFERENCE[name]
    newton, probes, _ = finger(24, margin=3.0)
    state = solve_full_slip(newton, load, tolerance=1e-8)
    assert probes.average(state.u)[0] == pytest.approx(sed, rel=0.003)
    assert state.force[1] == pytest.approx(normal, rel=0.003)
    assert load.sense * state.force[0] == pytest.approx(tangential, rel=0.003, abs=1e-12)


@pytest.fixture(scope="module")
def bounded_slide():
    newton, _, _ = finger(5)
    return newton, solve_full_slip(newton, LoadState(1.5, 0.44, 0.03009, 1))


def test_the_surface_and_the_bone_push_alike(bounded_slide):
    newton, state = bounded_slide
    body = newton.condensed.body
    pressure = oracle.pressure(body, state.u)
    force, _ = oracle.forces_and_tangents(body, state.u, pressure)
    nodal_force = np.zeros(body.mesh.nodes.shape)
    np.add.at(nodal_force, body.elements.nodes, force.reshape(-1, 9, 2))
    bone = nodal_force[body.mesh.held].sum(axis=0)
    np.testing.assert_allclose(state.force, -bone, atol=1e-10)
    free = np.ones(len(nodal_force), bool)
    free[body.mesh.held] = free[body.mesh.skin] = False
    assert np.abs(nodal_force[free]).max() < 1e-10


def test_forces_of_touching_points_obey_the_friction_law(bounded_slide):
    newton, state = bounded_slide
    load = state.load
    length = oracle.tributary(state.skin_positions(newton.condensed)[:, 0])
    slip, bounded, is_open = (state.state == code for code in (SLIP, SHEAR_LIMITED, OPEN))
    np.testing.assert_allclose(state.reaction[slip, 0], load.mu * state.reaction[slip, 1], atol=1e-12)
    np.testing.assert_allclose(state.reaction[bounded, 0], load.tau * length[bounded], atol=1e-12)
    np.testing.assert_allclose(state.reaction[is_open], 0.0, atol=1e-12)
    assert (state.reaction[slip | bounded, 1] >= -1e-12).all()
    height = state.skin_positions(newton.condensed)[:, 1] - load.depth
    assert height.min() > -1e-10


@pytest.mark.parametrize("name", ["press d2.0", "slip 100", "stick 0"])
def test_incompressible_tissue_takes_as_many_iterations_and_has_its_own_limit(name):
    iterations, sed = [], []
    for nu in (0.48, 0.49, 0.4999, 0.4999999):
        newton, probes, _ = finger(8, nu=nu)
        state = solve_full_slip(newton, REFERENCE[name][0])
        iterations.append(state.iterations)
        sed.append(probes.average(state.u)[0])
    assert len(set(iterations)) == 1
    assert sed[-1] == pytest.approx(sed[-2], rel=3e-3)


def test_without_friction_both_directions_are_the_same_and_a_bound_of_nothing_is_no_friction():
    newton, probes, _ = finger(5)
    loads = (LoadState(1.0, 0.0, np.inf, 1), LoadState(1.0, 0.0, np.inf, -1), LoadState(1.0, 0.5, 0.0, 1))
    sed = [probes.average(solve_full_slip(newton, load).u)[0] for load in loads]
    np.testing.assert_allclose(sed, sed[0], rtol=1e-10)


def test_the_next_surface_follows_from_the_last_one():
    newton, _, _ = finger(5)
    first = solve_full_slip(newton, LoadState(1.5, 0.24, 0.00877, 1))
    load = LoadState(1.5, 0.44, 0.03009, 1)
    from_last, direct = solve_full_slip(newton, load, first), solve_full_slip(newton, load)
    assert from_last.iterations - first.iterations <= 7
    np.testing.assert_allclose(from_last.u, direct.u, atol=1e-9)


def test_scaling_all_stiffness_scales_the_answer():
    newton, probes, _ = finger(5)
    body = newton.condensed.body
    stiff = FiniteBody.of(body.mesh, [NeoHooke(10 * E, 0.48) for E in (0.136, 0.08, 0.034)])
    state = solve_full_slip(newton, LoadState(1.0, 0.44, 0.02, 1))
    stiff_state = solve_full_slip(Newton(stiff.condensed), LoadState(1.0, 0.44, 0.2, 1))
    np.testing.assert_allclose(stiff_state.u, state.u, atol=1e-9)
    stiff_sed = replace(probes, elements=stiff).average(stiff_state.u)[0]
    assert stiff_sed == pytest.approx(10 * probes.average(state.u)[0], rel=1e-9)


@pytest.mark.parametrize("distortion", [0.0, 0.06])
def test_a_block_pressed_between_its_sides_has_the_closed_form_pressure_at_every_node(distortion):
    mesh = block(distortion=distortion, held="sides and top")
    body = FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)])
    u = np.zeros(mesh.nodes.shape)
    u[:, 1] = (1.0 - mesh.nodes[:, 1]) * 0.2  # to 0.8 of its height; sigma_yy = -0.193089
    force = np.zeros(mesh.nodes.shape)
    element_forces, _ = oracle.forces_and_tangents(body, u, oracle.pressure(body, u))
    np.add.at(force, mesh.elements, element_forces.reshape(-1, 9, 2))
    length = oracle.tributary(mesh.nodes[mesh.skin, 0])
    np.testing.assert_allclose(force[mesh.skin[1:-1], 1], 0.193089 * length[1:-1], rtol=3e-6)
    inside = np.setdiff1d(np.arange(len(force)), np.concatenate([mesh.skin, mesh.held]))
    np.testing.assert_allclose(force[inside], 0.0, atol=1e-15)


def test_turning_the_unloaded_body_by_a_right_angle_stores_nothing():
    body = FiniteBody.of(block(distortion=0.06), [NeoHooke(0.08, 0.48)])
    x, y = body.mesh.nodes.T
    u = np.stack([-y - x, x - y], axis=1)
    force, _ = oracle.forces_and_tangents(body, u, np.zeros((len(body.elements.nodes), 3)))
    assert abs(oracle.energy(body, u)) < 1e-15
    np.testing.assert_allclose(force, 0.0, atol=1e-14)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_displacements_are_as_good_as_was_asked_for_whichever_state_they_start_from(tolerance):
    newton, _, _ = finger(5)
    start = None
    for name in ("slip 100", "slip 0", "slip 55", "stick 0 at d1.0", "press d2.0"):
        load = REFERENCE[name][0]
        alone = solve_full_slip(newton, load, None, tolerance)
        from_last = solve_full_slip(newton, load, start, tolerance)
        exact = solve_full_slip(newton, load, alone, 1e-14)
        assert np.abs(alone.u - exact.u).max() < tolerance * newton.length_scale
        assert np.abs(from_last.u - exact.u).max() < tolerance * newton.length_scale
        start = solve_full_slip(newton, load, from_last, tolerance)  # leaves its tangent behind for the next surface


def test_contact_settled_within_a_linear_system_takes_the_whole_depth_in_one_step_of_few_iterations():
    newton, _, _ = finger(8, margin=3.0)
    for name in ("slip 0", "slip 55", "slip 100", "stick 0"):
        assert solve_full_slip(newton, REFERENCE[name][0], tolerance=1e-6).iterations <= 6
