"""Thick cylinder (MacNeal and Harder 1985, Finite Elem. Anal. Des. 1, 3) and Cook's membrane: no locking at any nu."""

import numpy as np
import pytest

from daq_app.accuracy.published.bodies import membrane, ring
from solver.body import Body, edge_load
from solver.materials import Hooke

PRINTED = {0.3: 4.582500e-3, 0.48: 5.017200e-3, 0.49: 5.039925e-3, 0.499: 5.060249e-3, 0.4999: 5.062275e-3}


def widened(nu, radial, around):
    """Displacement of the hole of a cylinder a = 3, b = 9, E = 1000 under the pressure 1, mean over corner nodes."""
    mesh, hole = ring(3.0, 9.0, radial, around)
    at = mesh.nodes[hole]
    body = Body.of(mesh, [Hooke(1000.0, nu)], edge_load(mesh, hole, at / 3.0), free=("x", "y", "turn"))
    skin = np.concatenate([body.touchable.normal_free, body.touchable.tangential_free])
    moved = body.displacement(skin[:, None])[hole, :, 0]
    return float(np.sum(moved * at, axis=1)[:-1:2].mean() / 3.0)


@pytest.mark.parametrize("nu", [*PRINTED, 0.49999, 0.4999999])
def test_a_thick_cylinder_does_not_lock(nu):
    """u(a) = (1 + nu)/E [(1 - 2 nu) A a + A b^2/a], A = p a^2/(b^2 - a^2), on five elements across the wall."""
    share = 9.0 / (81.0 - 9.0)
    exact = (1 + nu) / 1000.0 * ((1 - 2 * nu) * share * 3.0 + share * 81.0 / 3.0)
    if nu in PRINTED:
        assert exact == pytest.approx(PRINTED[nu], abs=5e-10)
    assert widened(nu, 5, 20) == pytest.approx(exact, rel=2e-4)


@pytest.mark.parametrize("nu", [0.3, 0.4999999])
def test_even_two_elements_across_the_wall_of_a_cylinder_do_not_lock(nu):
    share = 9.0 / (81.0 - 9.0)
    exact = (1 + nu) / 1000.0 * ((1 - 2 * nu) * share * 3.0 + share * 81.0 / 3.0)
    assert widened(nu, 2, 8) == pytest.approx(exact, rel=5e-3)


# E, nu, F, u_y at the middle of the right edge, and at its upper end; plane stress as the plane strain that equals it:
# E (1 + 2 nu)/(1 + nu)^2 and nu/(1 + nu) for E = 1, nu = 1/3
COOK = {
    "plane stress": (0.9375, 0.25, 1.0, 23.967, 25.18),
    "incompressible": (1.12499998, 0.499999975, 1.0, 16.447, None),
    "nearly incompressible": (240.565, 0.4999, 100.0, 7.693, 8.072),
}


@pytest.mark.parametrize("case", COOK)
def test_cook_s_membrane_rises_by_what_others_found(case):
    young, nu, force, middle, corner = COOK[case]
    mesh = membrane(32, 32)
    loads = edge_load(mesh, mesh.skin, np.tile([0.0, force / 16.0], (len(mesh.skin), 1)))
    body = Body.of(mesh, [Hooke(young, nu)], loads)
    risen = body.touchable.normal_free
    assert risen[len(risen) // 2] == pytest.approx(middle, rel=0.002)
    if corner is not None:
        assert risen[-1] == pytest.approx(corner, rel=0.002)


def test_even_four_elements_along_cook_s_membrane_do_not_lock():
    mesh = membrane(4, 4)
    loads = edge_load(mesh, mesh.skin, np.tile([0.0, 100.0 / 16.0], (len(mesh.skin), 1)))
    risen = Body.of(mesh, [Hooke(240.565, 0.4999)], loads).touchable.normal_free
    assert risen[len(risen) // 2] == pytest.approx(7.693, rel=0.012)
