"""Patch tests on bad meshes: distorted to 0.45 of an edge, fifty times longer than wide, with curved edges.

Irons and Razzaque 1972 for elements; Taylor and Papadopoulos 1991 for contact.
"""

from dataclasses import replace

import numpy as np
import pytest

from solver import ContactLost
from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.body import Probes
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import MATERIALS, Hooke
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh import Q2P1, block
from solver.verification.published.bodies import distort
from tests.solver.finite_examples import sheet
from tests.solver.oracle.laws import hooke_energy

GRADIENT = np.array([[0.01, 0.03], [-0.02, -0.01]])  # keeps volume, as an incompressible body asks
PRESSURE = 1e-3  # [MPa]
MU = 0.4


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("kind", ["straight", "distorted", "curved", "aspect 50"])
@pytest.mark.parametrize(("nu", "round_off"), [(0.0, 1e-14), (0.3, 1e-14), (0.48, 1e-13), (0.4999999, 1e-8)])
def test_a_linear_field_on_the_boundary_is_linear_inside_and_its_stress_constant(material, kind, nu, round_off):
    mesh = sheet(kind)
    exact = mesh.nodes @ GRADIENT.T
    body = LinearBody.of(mesh, [material(1.0, nu)], prescribed=exact * mesh.driven)
    displacement = body.displacement(np.zeros((0, 2)))
    assert np.abs(displacement - exact).max() < round_off
    at_corners = np.repeat(np.arange(len(mesh.elements)), 4), np.tile(Q2P1.corners, (len(mesh.elements), 1))
    probes = Probes.at(mesh, body.elastic.centre, *at_corners)
    slope = probes.displacement_gradient(mesh, displacement)
    assert np.abs(slope - GRADIENT).max() < 1e3 * round_off
    energy = body.elastic.energy(probes, displacement[:, :, None])[:, 0]
    assert np.allclose(energy, hooke_energy(Hooke(1.0, nu), GRADIENT), rtol=1e6 * round_off)


def loaded_block(nu, shear, seed, *, confined=True):
    """A block distorted to 0.45 under uniform pressure and shear; `confined`, it stays as wide."""
    mesh = distort(block(np.linspace(-1, 1, 6), np.linspace(0, 1.5, 4), held=False), 0.45, seed)
    order = np.arange(len(mesh.nodes)).reshape(11, 7)
    side_pressure = PRESSURE * nu / (1.0 - nu) if confined else 0.0
    loads = edge_load(mesh, order[:, 0], np.tile([shear, -PRESSURE], (11, 1)))
    loads += edge_load(mesh, order[0], np.tile([side_pressure, -shear], (7, 1)))
    loads += edge_load(mesh, order[-1], np.tile([-side_pressure, shear], (7, 1)))
    return mesh, loads


def tractions(body, state):
    return state.normal / body.condensed.fixed_length, state.tangential / body.condensed.fixed_length


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("nu", "round_off"), [(0.0, 1e-12), (0.48, 1e-12), (0.4999999, 1e-7)])
def test_a_uniform_pressure_comes_through_a_distorted_block_unchanged(seed, nu, round_off):
    mesh, loads = loaded_block(nu, 0.0, seed)
    body = LinearBody.of(mesh, [Hooke(0.08, nu)], loads, free=("y", "turn"))
    state = solve_full_slip(Newton(body.condensed), LoadState(0.0, 0.0, np.inf, -1))
    assert np.abs(tractions(body, state)[0] / PRESSURE - 1.0).max() < round_off


def test_a_block_pressed_between_free_sides_has_the_closed_forms_strains():
    """eps_yy = -p (1 - nu^2)/E, eps_xx = p nu (1 + nu)/E."""
    mesh, loads = loaded_block(0.48, 0.0, 1, confined=False)
    body = LinearBody.of(mesh, [Hooke(0.08, 0.48)], loads, free=("y", "turn"))
    state = solve_full_slip(Newton(body.condensed), LoadState(0.0, 0.0, np.inf, -1))
    strains = np.ptp(body.displacement(state.u), axis=0) / [2.0, 1.5]
    assert strains == pytest.approx([0.008880, 0.009620], rel=1e-12)


def solve_sticking(part):
    """Return a block sheared by `part` of mu p, and its state if all its points stick."""
    mesh, loads = loaded_block(0.48, part * MU * PRESSURE, 1)
    body = LinearBody.of(mesh, [Hooke(0.08, 0.48)], loads, free=("x", "y", "turn"))
    newton = Newton(body.condensed)
    start = EquilibriumState.undeformed(body.condensed, LoadState(0.0, MU))
    start = replace(start, state=np.full(len(mesh.skin), STICK, np.int32))
    return body, newton.solve_linear(start, newton.skin_x)


@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 0.999999])
def test_a_block_sheared_below_mu_p_sticks_at_every_point(part):
    body, state = solve_sticking(part)
    assert (state.state == STICK).all()
    normal, tangential = tractions(body, state)
    assert np.abs(normal - PRESSURE).max() < 1e-14
    assert np.abs(tangential + part * MU * PRESSURE).max() < 1e-15


def test_no_point_sticks_alone_when_the_shear_exceeds_the_limit():
    with pytest.raises(ContactLost):  # the block accelerates: nothing can balance its load
        solve_sticking(1.001)


@pytest.mark.parametrize("bound", [0.0, 1e-9, 1e-4, 3.999e-4, 4.001e-4, 1e9])
def test_a_uniform_patch_drags_by_the_smaller_of_mu_p_and_the_bound_exactly(bound):
    """Q = min(mu P, tau_max l), at every point and in sum."""
    shear = min(MU * PRESSURE, bound)
    mesh, loads = loaded_block(0.48, shear, 1)
    body = LinearBody.of(mesh, [Hooke(0.08, 0.48)], loads, free=("y", "turn"))
    state = solve_full_slip(Newton(body.condensed), LoadState(0.0, MU, bound, -1))
    assert (state.state == (SLIP if bound > MU * PRESSURE else SHEAR_LIMITED)).all()
    assert np.abs(tractions(body, state)[1] + shear).max() < 1e-15
    assert -state.tangential.sum() == pytest.approx(min(MU * 2e-3, bound * 2.0), rel=1e-12, abs=1e-18)


def test_a_block_that_is_lifted_touches_nowhere():
    body = LinearBody.of(block(np.linspace(-1, 1, 4), np.linspace(0, 1, 3)), [Hooke(0.08, 0.48)])
    state = solve_full_slip(Newton(body.condensed), LoadState(-0.1, 0.3, np.inf, -1))
    assert (state.state == OPEN).all()
    assert not state.normal.any()
