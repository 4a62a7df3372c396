"""Patch tests (benchmarks of Irons and Razzaque 1972; Taylor and Papadopoulos 1991): exact to round-off on any mesh."""

from dataclasses import replace

import numpy as np
import pytest

from solver import ContactLost
from solver._kernels.compiling import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.body import Probes
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import Hooke
from solver.equilibrium import EquilibriumState, LoadState, Newton
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh import Mesh, block
from tests.solver.oracle.laws import hooke_energy

DERMIS = Hooke(0.08, 0.48)
PRESSURE = 0.001


def distorted(mesh: Mesh, by: float, seed: int) -> Mesh:
    """Move inner nodes at random; corners of elements only, mid-nodes follow."""
    rng = np.random.default_rng(seed)
    nodes = mesh.nodes.copy()
    corner = np.zeros(len(nodes), bool)
    corner[mesh.elements[:, :4]] = True
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    inner = np.all((nodes > low + 1e-9) & (nodes < high - 1e-9), axis=1)
    nodes[corner & inner] += rng.uniform(-by, by, (int((corner & inner).sum()), 2))
    for side in range(4):
        ends = mesh.elements[:, [side, (side + 1) % 4]]
        nodes[mesh.elements[:, 4 + side]] = nodes[ends].mean(axis=1)
    nodes[mesh.elements[:, 8]] = nodes[mesh.elements[:, :4]].mean(axis=1)
    return replace(mesh, nodes=nodes)


@pytest.mark.parametrize(("nu", "round_off"), [(0.0, 1e-14), (0.3, 1e-14), (0.48, 1e-14), (0.4999999, 1e-9)])
def test_a_linear_displacement_on_the_boundary_is_linear_inside(nu, round_off):
    mesh = distorted(block(np.linspace(0, 3, 5), np.linspace(0, 2, 4), held=False), 0.2, 1)
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    boundary = np.flatnonzero(np.any((mesh.nodes < low + 1e-9) | (mesh.nodes > high - 1e-9), axis=1))
    mesh = replace(mesh, held=boundary, skin=mesh.skin[:0])
    # at the incompressible limit a linear field must keep its volume, or its pressure swamps everything
    gradient = np.array([[0.01, 0.03], [-0.02, -0.01]])
    exact = mesh.nodes @ gradient.T
    body = LinearBody.of(mesh, [Hooke(1.0, nu)], prescribed=exact * mesh.driven)
    found = body.displacement(np.zeros((0, 2)))
    assert np.abs(found - exact).max() < round_off  # which the ratio of the moduli, 5e6 at the limit, magnifies
    probes = Probes.at(mesh, body.elastic.centre, np.arange(len(mesh.elements)), np.full((len(mesh.elements), 2), 0.3))
    energy = body.elastic.energy(probes, found[:, :, None])[:, 0]
    assert np.allclose(energy, hooke_energy(Hooke(1.0, nu), gradient), rtol=1e-9)


def pressed_block(shear: float = 0.0, *, confined: bool = False):
    """A block under uniform pressure and shear, nothing held; confined, its sides are pressed and it stays as wide."""
    mesh = distorted(block(np.linspace(-1, 1, 6), np.linspace(0, 1.5, 4), held=False), 0.1, 3)
    order = np.arange(len(mesh.nodes)).reshape(11, 7)
    top, left, right = order[:, 0], order[0], order[-1]
    aside = PRESSURE * DERMIS.nu / (1.0 - DERMIS.nu) if confined else 0.0
    loads = edge_load(mesh, top, np.ones((len(top), 1)) @ [[shear, -PRESSURE]])
    loads += edge_load(mesh, left, np.ones((len(left), 1)) @ [[aside, -shear]])
    loads += edge_load(mesh, right, np.ones((len(right), 1)) @ [[-aside, shear]])
    return mesh, loads


def test_a_uniform_pressure_reaches_a_frictionless_surface_unchanged():
    mesh, loads = pressed_block()
    body = LinearBody.of(mesh, [DERMIS], loads, free=("y", "turn"))
    found = solve_full_slip(Newton(body.condensed), LoadState(0.0, 0.0, np.inf, -1))
    assert np.allclose(found.normal, PRESSURE * body.condensed.fixed_length, rtol=0, atol=1e-15)
    # strains of the page: eps_yy = -p (1 - nu^2)/E, eps_xx = p nu (1 + nu)/E
    moved = body.displacement(found.u)
    strain_x = np.ptp(moved[:, 0]) / 2.0
    strain_y = np.ptp(moved[:, 1]) / 1.5
    assert strain_x == pytest.approx(0.008880, rel=1e-12)
    assert strain_y == pytest.approx(0.009620, rel=1e-12)


@pytest.mark.parametrize("part", [0.999, 0.5, 0.0])
def test_below_the_friction_limit_every_point_sticks_and_carries_the_same_traction(part):
    mu = 0.4
    mesh, loads = pressed_block(part * mu * PRESSURE, confined=True)
    body = LinearBody.of(mesh, [DERMIS], loads, free=("x", "y", "turn"))
    newton = Newton(body.condensed)
    start = replace(EquilibriumState.undeformed(body.condensed), state=np.full(len(mesh.skin), STICK, np.int32))
    found = newton.solve_linear(start, LoadState(0.0, mu), newton.skin_x)
    assert (found.state == STICK).all()
    assert np.allclose(found.normal, PRESSURE * body.condensed.fixed_length, rtol=0, atol=1e-15)
    assert np.allclose(found.tangential, -part * mu * PRESSURE * body.condensed.fixed_length, rtol=0, atol=1e-15)


def test_no_point_sticks_alone_when_the_shear_exceeds_the_limit():
    mu = 0.4
    mesh, loads = pressed_block(1.001 * mu * PRESSURE, confined=True)
    body = LinearBody.of(mesh, [DERMIS], loads, free=("x", "y", "turn"))
    newton = Newton(body.condensed)
    start = replace(EquilibriumState.undeformed(body.condensed), state=np.full(len(mesh.skin), STICK, np.int32))
    with pytest.raises(ContactLost):  # the block accelerates: nothing can balance its load
        newton.solve_linear(start, LoadState(0.0, mu), newton.skin_x)


@pytest.mark.parametrize("bound", [np.inf, 0.3 * PRESSURE])
def test_in_full_slip_every_point_carries_the_same_traction(bound):
    mu = 0.4
    shear = min(mu * PRESSURE, bound)
    mesh, loads = pressed_block(shear, confined=True)
    body = LinearBody.of(mesh, [DERMIS], loads, free=("y", "turn"))
    found = solve_full_slip(Newton(body.condensed), LoadState(0.0, mu, bound, -1))
    assert (found.state == (SLIP if bound == np.inf else SHEAR_LIMITED)).all()
    assert np.allclose(found.normal, PRESSURE * body.condensed.fixed_length, rtol=0, atol=1e-15)
    assert np.allclose(found.tangential, -shear * body.condensed.fixed_length, rtol=0, atol=1e-15)


def test_a_block_that_is_lifted_touches_nowhere():
    mesh = block(np.linspace(-1, 1, 4), np.linspace(0, 1, 3))
    body = LinearBody.of(mesh, [DERMIS])
    found = solve_full_slip(Newton(body.condensed), LoadState(-0.1, 0.3, np.inf, -1))
    assert (found.state == OPEN).all()
    assert not found.normal.any()
