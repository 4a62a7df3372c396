"""Small strain in compiled loops is small strain in plain NumPy, to round-off: elements and elimination."""

import numpy as np
import pytest
from numpy.linalg import LinAlgError

from solver import Finger, Receptor, solve, solve_many
from solver.body.linear import LinearBody, LinearElimination
from solver.constitutive import Hooke, Moduli
from solver.mesh import Mesh, MeshError, block
from solver.mesh.mesher import Sizing, finger_mesh
from solver.scene.published import SLIPPERINESS, scene
from tests.solver.oracle import linear as oracle

TISSUES = [Hooke(0.136, 0.48), Hooke(0.08, 0.48), Hooke(0.034, 0.3)]
CLOSE = 1e-11


@pytest.fixture(scope="module")
def mesh():
    return finger_mesh(Finger(), Receptor(), Sizing(3, 2.0)).mesh


def error(values, expected):
    return np.abs(values - expected).max() / max(np.abs(expected).max(), np.finfo(float).tiny)


@pytest.mark.parametrize("nu", [0.0, 0.48, 0.4999999])
def test_the_stiffness_of_elements_is_the_plain_one(mesh, nu):
    tissues = [Hooke(E, nu) for E in (0.136, 0.08, 0.034)]
    expected, elimination = oracle.elastic(mesh, tissues), LinearElimination(mesh, tissues)
    for name in ("shear", "lame"):
        assert error(getattr(elimination.elastic.elements, name), getattr(expected, name)) < CLOSE
    dilatation = np.swapaxes(elimination.elastic.combination, 1, 2) @ elimination.elastic.divergence
    assert error(dilatation, expected.dilatation) < CLOSE
    assert error(elimination.elastic.centre, expected.centre) < 1e-14
    displacement = np.random.default_rng(2).normal(size=(len(mesh.elements), 9, 2))
    forces = expected.stiffness @ displacement.reshape(-1, 18, 1)
    assert error(elimination.elastic.forces(displacement).reshape(forces.shape), forces) < CLOSE


def test_a_body_eliminated_in_loops_is_the_plain_one(mesh):
    """Under dead loads on all nodes, the elements' centres too."""
    rng = np.random.default_rng(1)
    load = rng.normal(size=mesh.nodes.shape)
    load[mesh.held] = 0.0
    expected = oracle.CondensedBody(mesh, oracle.elastic(mesh, TISSUES).stiffness, load.reshape(-1, 1))
    body = LinearElimination(mesh, TISSUES)
    condensed_load = body.condense(load)
    assert error(body.stiffness, expected.stiffness) < CLOSE
    assert error(body.skin_load(condensed_load)[:, None], expected.load) < CLOSE
    skin = rng.normal(size=(2 * len(mesh.skin), 2))
    u = expected.all_unknowns(skin, load.reshape(-1, 1)).reshape(*mesh.nodes.shape, 2)
    assert error(body.displacement(skin, condensed_load), u) < CLOSE
    assert error(body.displacement(skin, body.no_load), expected.all_unknowns(skin).reshape(u.shape)) < CLOSE
    nodes = mesh.elements[40]
    assert error(body.displacement(skin, condensed_load, only=nodes)[nodes], u[nodes]) < CLOSE


def test_what_no_stable_body_is_made_of_is_refused(mesh):
    """A negative shear modulus, unless it is refused at the door; an element turned inside out."""
    unstable = [Moduli(-0.05, 0.1)] * 3
    with pytest.raises(LinAlgError):
        LinearBody.of(mesh, unstable, checked=True)
    flat = block(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]))
    nodes = flat.nodes.copy()
    nodes[:, 0] *= -1.0
    with pytest.raises(MeshError, match="folded"):
        LinearElimination(Mesh(nodes, flat.elements, flat.region, flat.skin, flat.held), TISSUES)


def test_the_same_question_is_answered_bit_by_bit_the_same_again():
    scenes = [scene(surface) for surface in SLIPPERINESS]
    first = solve_many(scenes)
    second = solve_many(scenes)
    for prediction, repeat in zip(first, second, strict=True):
        assert (prediction.sed_ending, prediction.error_estimate) == (repeat.sed_ending, repeat.error_estimate)
        np.testing.assert_array_equal(prediction.displacement, repeat.displacement)
    assert solve(scenes[0]).sed_ending == solve(scenes[0]).sed_ending
