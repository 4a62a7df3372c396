import numpy as np
import pytest

from solver import Finger, Receptor
from solver.body import Probes
from solver.body.linear import Elastic, LinearBody
from solver.constitutive import Hooke
from solver.linalg import symbolic_factorization
from solver.mesh import Q2P1, block, local_coordinates
from solver.mesh.mesher import Sizing, finger_mesh
from tests.solver.oracle import linear as oracle

TISSUES = [Hooke(0.136, 0.48), Hooke(0.08, 0.48), Hooke(0.034, 0.48)]


def test_rigid_motion_of_an_element_needs_no_force():
    geometry = finger_mesh(Finger(), Receptor(), Sizing(4, 2.0))
    elastic = Elastic.of(geometry.mesh, TISSUES)
    x = geometry.mesh.nodes[geometry.mesh.elements]
    for motion in (np.ones_like(x) * [1, 0], np.ones_like(x) * [0, 1], np.stack([-x[..., 1], x[..., 0]], axis=-1)):
        force = elastic.forces(motion).reshape(len(x), 18, 1)
        # Round-off of sums whose terms are as large as stiffness times coordinate.
        terms = np.abs(oracle.elastic(geometry.mesh, TISSUES).stiffness) @ np.abs(motion).reshape(len(x), 18, 1)
        assert np.abs(force / terms).max() < 1e-14


def test_energy_of_probes_adds_up_to_that_of_the_stiffness():
    mesh = block(np.array([0.0, 0.7, 2.0]), np.array([0.0, 1.0, 1.5]))
    elastic = Elastic.of(mesh, [Hooke(0.08, 0.48)])
    displacement = np.random.default_rng(4).normal(0, 0.1, (len(mesh.nodes), 2))
    energy = 0.5 * np.sum(displacement[mesh.elements] * elastic.forces(displacement[mesh.elements]))
    points, weights = np.polynomial.legendre.leggauss(4)
    across, up = np.meshgrid(points, points)
    at = np.stack([across.ravel(), up.ravel()], axis=1)
    total = 0.0
    for element, corners in enumerate(mesh.elements[:, :4]):
        probes = Probes.at(mesh, elastic.centre, np.full(16, element), at)
        area = np.prod(np.ptp(mesh.nodes[corners], axis=0)) / 4.0
        total += area * (np.outer(weights, weights).ravel() @ elastic.energy(probes, displacement[:, :, None])[:, 0])
    assert total == pytest.approx(energy, rel=1e-12)


def test_places_are_found_again_in_curved_elements():
    geometry = finger_mesh(Finger(), Receptor(), Sizing(4, 2.0))
    corners = geometry.mesh.nodes[geometry.mesh.elements]
    at = np.random.default_rng(5).uniform(-1, 1, (len(corners), 2))
    places = (Q2P1.shape(at)[0][:, None] @ corners)[:, 0]
    assert np.abs(local_coordinates(corners, places, np.zeros_like(at)) - at).max() < 1e-11


def test_elimination_of_a_single_part_works_too():
    mesh = block(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    plan = symbolic_factorization(mesh)
    assert plan.inner.tolist() == [4]  # x and y of the middles of both sides
    assert plan.border.tolist() == [6]  # those of the skin's three nodes


def test_a_held_block_that_is_sheared_answers_as_the_closed_form():
    """A wide flat layer under shear traction q: its underside moves by q h / G."""
    mesh = block(np.linspace(-40, 40, 81), np.array([0.0, 0.5, 1.0]))
    law = Hooke(0.08, 0.48)
    body = LinearBody.of(mesh, [law])
    forces = np.stack([0.001 * body.condensed.fixed_length, np.zeros(len(mesh.skin))], axis=1)
    displacement = body.condensed.with_load(forces.ravel()).free_displacement()
    assert displacement[len(mesh.skin) // 2, 0] == pytest.approx(0.001 * 1.0 / law.shear, rel=1e-6)
