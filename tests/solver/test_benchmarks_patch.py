"""Patch tests on bad meshes: distorted to 0.45 of an edge, fifty times longer than wide, with curved edges."""

from dataclasses import replace

import numpy as np
import pytest

from solver._kernels.compiling import SHEAR_LIMITED, SLIP, STICK
from solver.body import Probes
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import Hooke
from solver.equilibrium import EquilibriumState, LoadState, Newton
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh import Q2P1, Mesh, block, quality
from solver.verification.published.bodies import distort
from tests.solver.oracle.laws import hooke_energy

GRADIENT = np.array([[0.01, 0.03], [-0.02, -0.01]])  # keeps volume, as an incompressible body asks


def sheet(kind: str) -> Mesh:
    tall = 2.0 / 50 if kind == "aspect 50" else 2.0
    mesh = block(np.linspace(0, 3, 5), np.linspace(0, tall, 5), held=False)
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    edge = np.flatnonzero(np.any((mesh.nodes < low + 1e-9) | (mesh.nodes > high - 1e-9), axis=1))
    mesh = replace(mesh, held=edge, skin=mesh.skin[:0])
    if kind == "distorted":
        return distort(mesh, 0.45, 2)
    if kind == "curved":
        rng = np.random.default_rng(4)
        nodes = mesh.nodes.copy()
        inner = np.setdiff1d(np.arange(len(nodes)), edge)
        nodes[inner] += rng.uniform(-0.05, 0.05, (len(inner), 2))
        mesh = replace(mesh, nodes=nodes)
        quality(mesh)
    return mesh


@pytest.mark.parametrize("kind", ["straight", "distorted", "curved", "aspect 50"])
@pytest.mark.parametrize(("nu", "round_off"), [(0.0, 1e-14), (0.3, 1e-14), (0.48, 1e-13), (0.4999999, 1e-8)])
def test_a_linear_field_on_the_boundary_is_linear_inside_and_its_stress_constant(kind, nu, round_off):
    mesh = sheet(kind)
    exact = mesh.nodes @ GRADIENT.T
    body = LinearBody.of(mesh, [Hooke(1.0, nu)], prescribed=exact * mesh.driven)
    found = body.displacement(np.zeros((0, 2)))
    assert np.abs(found - exact).max() < round_off
    everywhere = np.repeat(np.arange(len(mesh.elements)), 4), np.tile(Q2P1.corners, (len(mesh.elements), 1))
    probes = Probes.at(mesh, body.elastic.centre, *everywhere)
    slope = probes.displacement_gradient(mesh, found)
    assert np.abs(slope - GRADIENT).max() < 1e3 * round_off
    energy = body.elastic.energy(probes, found[:, :, None])[:, 0]
    assert np.allclose(energy, hooke_energy(Hooke(1.0, nu), GRADIENT), rtol=1e6 * round_off)


def pressed(nu: float, shear: float, seed: int):
    """A block distorted to 0.45 under uniform pressure 1e-3 and shear, its sides pressed so that it stays as wide."""
    mesh = distort(block(np.linspace(-1, 1, 6), np.linspace(0, 1.5, 4), held=False), 0.45, seed)
    order = np.arange(len(mesh.nodes)).reshape(11, 7)
    aside = 1e-3 * nu / (1.0 - nu)
    loads = edge_load(mesh, order[:, 0], np.tile([shear, -1e-3], (11, 1)))
    loads += edge_load(mesh, order[0], np.tile([aside, -shear], (7, 1)))
    loads += edge_load(mesh, order[-1], np.tile([-aside, shear], (7, 1)))
    return mesh, loads


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("nu", "round_off"), [(0.0, 1e-12), (0.48, 1e-12), (0.4999999, 1e-7)])
def test_a_uniform_pressure_comes_through_a_distorted_block_unchanged(seed, nu, round_off):
    mesh, loads = pressed(nu, 0.0, seed)
    body = LinearBody.of(mesh, [Hooke(0.08, nu)], loads, free=("y", "turn"))
    found = solve_full_slip(Newton(body.condensed), LoadState(0.0, 0.0, np.inf, -1))
    assert np.abs(found.normal / body.condensed.fixed_length / 1e-3 - 1.0).max() < round_off


@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 0.999999])
def test_a_block_sheared_below_mu_p_sticks_at_every_point(part):
    mu = 0.4
    mesh, loads = pressed(0.48, part * mu * 1e-3, 1)
    body = LinearBody.of(mesh, [Hooke(0.08, 0.48)], loads, free=("x", "y", "turn"))
    newton = Newton(body.condensed)
    still = replace(EquilibriumState.undeformed(body.condensed), state=np.full(len(mesh.skin), STICK, np.int32))
    found = newton.solve_linear(still, LoadState(0.0, mu), newton.skin_x)
    assert (found.state == STICK).all()
    assert np.abs(found.tangential / body.condensed.fixed_length + part * mu * 1e-3).max() < 1e-15


@pytest.mark.parametrize("bound", [0.0, 1e-9, 1e-4, 3.999e-4, 4.001e-4, 1e9])
def test_a_uniform_patch_drags_by_the_smaller_of_mu_p_and_the_bound_exactly(bound):
    """Q = min(mu P, tau_max l), at every point and in sum."""
    mu = 0.4
    shear = min(mu * 1e-3, bound)
    mesh, loads = pressed(0.48, shear, 1)
    body = LinearBody.of(mesh, [Hooke(0.08, 0.48)], loads, free=("y", "turn"))
    found = solve_full_slip(Newton(body.condensed), LoadState(0.0, mu, bound, -1))
    assert (found.state == (SLIP if bound > mu * 1e-3 else SHEAR_LIMITED)).all()
    assert np.abs(found.tangential / body.condensed.fixed_length + shear).max() < 1e-15
    assert -found.tangential.sum() == pytest.approx(min(mu * 2e-3, bound * 2.0), rel=1e-12, abs=1e-18)
