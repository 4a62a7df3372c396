"""Observed orders of convergence: the errors of a sequence of meshes fall as theory says, and no slower."""

import numpy as np
import pytest

from daq_app.accuracy.published.bodies import distorted, graded, membrane, mirrored, mound, ring
from solver.body import Body, edge_load
from solver.contact import Course
from solver.elements import Q2P1
from solver.finger import FingerModel
from solver.friction import FrictionLaw
from solver.materials import Hooke
from solver.mesher import Sizing
from solver.reference import STICKINESS, scene
from solver.stiffness import Probes

POINTS = np.array([[0.31, -0.57], [-0.77, 0.11], [0.43, 0.83]])


def order(sizes, errors):
    """Return the slope of the best line through the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


def cylinder_errors(nu, radial):
    """Errors of a thick cylinder's displacement, stress and energy (root of the energy's), on distorted elements."""
    young, share = 1000.0, 9.0 / 72.0
    mesh, hole = ring(3.0, 9.0, radial, 4 * radial)
    mesh = distorted(mesh, 0.2, 5)
    loads = edge_load(mesh, hole, mesh.nodes[hole] / 3.0)
    body = Body.of(mesh, [Hooke(young, nu)], loads, free=("x", "y", "turn"))
    skin = np.concatenate([body.touchable.normal_free, body.touchable.tangential_free])
    found = body.displacement(skin[:, None])[:, :, 0]
    x, y = mesh.nodes.T
    r2 = x * x + y * y
    exact = ((1 + nu) / young * ((1 - 2 * nu) * share + share * 81.0 / r2))[:, None] * mesh.nodes
    off = (found - exact).ravel()
    one, zero = np.ones_like(x), np.zeros_like(x)
    rigid = np.stack([np.stack(m, axis=1).ravel() for m in ((one, zero), (zero, one), (-y, x))], axis=1)
    off -= rigid @ np.linalg.lstsq(rigid, off, rcond=None)[0]
    element = np.repeat(np.arange(len(mesh.elements)), len(POINTS))
    probes = Probes.at(mesh, body.elastic, element, np.tile(POINTS, (len(mesh.elements), 1)))
    slope = probes.displacement_gradient(mesh, found)
    shear = (slope + np.swapaxes(slope, 1, 2))[:, 0, 1] * body.elastic.shear[element]
    at = placed_points(mesh, element)
    closed = -2 * share * 81.0 * at[:, 0] * at[:, 1] / np.sum(at * at, axis=1) ** 2
    energy = 0.5 * float(np.sum(loads * found))
    true = 0.5 * 2 * np.pi * 3.0 * (1 + nu) / young * ((1 - 2 * nu) * share * 3.0 + share * 27.0)
    errors = np.sqrt(np.mean(off**2)), np.sqrt(np.mean((shear - closed) ** 2)), abs(energy / true - 1)
    return np.array(errors)


def placed_points(mesh, element):
    values = Q2P1.shape(np.tile(POINTS, (len(mesh.elements), 1)))[0]
    return (values[:, None] @ mesh.nodes[mesh.elements[element]])[:, 0]


@pytest.mark.parametrize("nu", [0.3, 0.4999, 0.4999999])
def test_displacements_converge_with_order_3_stresses_with_2_and_energy_with_4(nu):
    sizes = [1 / 8, 1 / 16, 1 / 32]
    displacement, stress, energy = np.array([cylinder_errors(nu, round(1 / h)) for h in sizes]).T
    assert order(sizes, displacement) > 2.9
    assert order(sizes, stress) > 1.9
    assert order(sizes, energy) > 3.7


def test_at_the_singular_corner_of_cook_s_membrane_the_order_is_that_of_the_singularity():
    """Clamped meets free at 108 degrees: the stress is infinite there, and no uniform mesh converges faster."""
    risen = []
    for count in (4, 8, 16, 32, 64):
        mesh = membrane(count, count)
        loads = edge_load(mesh, mesh.skin, np.tile([0.0, 100.0 / 16.0], (len(mesh.skin), 1)))
        body = Body.of(mesh, [Hooke(240.565, 0.4999)], loads)
        risen.append(body.touchable.normal_free[len(mesh.skin) // 2])
    gained = np.diff(risen)
    assert np.all(gained > 0.0)
    assert 0.9 < order([1 / 4, 1 / 8, 1 / 16, 1 / 32], gained) < 1.5


def press(finest, nu):
    x, y = mirrored(graded(finest, 0.3, 1.2, 20.0)), graded(finest, 0.3, 0.0, 20.0)
    body = Body.of(mound(x, y, 1000.0, 3.0), [Hooke(0.08, nu)])
    return Course(body.touchable, FrictionLaw(0.0, np.inf)).sliding(1e-3, 1).normal.sum()


@pytest.mark.parametrize("nu", [0.4999])
def test_the_force_of_a_contact_whose_edge_falls_anywhere_converges_with_order_2(nu):
    """The root mean square over meshes of nearly one size, since a single one may be right by chance."""
    sizes = [0.4, 0.2, 0.1, 0.05]
    true = np.mean([press(0.025 * s, nu) for s in (1.0, 1.1)])
    near = np.linspace(0.9, 1.1, 4)
    errors = [np.sqrt(np.mean([(press(h * s, nu) / true - 1) ** 2 for s in near])) for h in sizes]
    assert order(sizes, errors) > 1.7
    assert errors[-1] < 1e-4


def test_the_finger_s_energy_at_the_ending_converges_with_order_2():
    """The root mean square over shifted meshes of nearly one size, as for any contact whose edge falls anywhere."""
    asked = [scene(s) for s in (STICKINESS[0], STICKINESS[4])]

    def seds(fineness, shift):
        model = FingerModel.of(asked[0], Sizing(fineness, 2.0, shift))
        laws = [FrictionLaw(s.friction.mu, s.friction.cap) for s in asked]
        found = [Course(model.body.touchable, law).sliding(2.0, 1) for law in laws]
        return np.array([model.sed_ending(model.displacement(contact)) for contact in found])

    both = (False, True)
    true = np.mean([seds(36, shift) for shift in both], axis=0)
    sizes = [1 / 4, 1 / 6, 1 / 8, 1 / 12, 1 / 16]
    errors = [
        np.sqrt(np.mean([(seds(k / h, s) / true - 1) ** 2 for k in (0.92, 1.0, 1.08) for s in both], axis=0))
        for h in sizes
    ]
    for column in np.array(errors).T:
        assert order(sizes, column) > 1.8
        assert column[-1] < 5e-4
