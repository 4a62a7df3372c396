"""Small strain in compiled loops is small strain in plain NumPy, to round-off: elements and answers."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.linalg import LinAlgError

from solver.body.linear import LinearBody, elimination
from solver.body.linear_compiled import ReducedInLoops
from solver.body.stiffness import Elastic
from solver.constitutive.linear import Hooke, Moduli
from solver.linalg.dissection import Reduced
from solver.mesh import Mesh
from solver.mesh.blocks import block
from solver.mesh.mesher import Sizing, finger_mesh
from solver.response.solution import answers, solve
from solver.scene import Finger, Friction, Loading, Material, Materials, Receptor, Scene, Solve
from solver.scene.published import SLIPPERINESS, STICKINESS, scene

TISSUES = [Hooke(0.136, 0.48), Hooke(0.08, 0.48), Hooke(0.034, 0.3)]
CLOSE = 1e-11


@pytest.fixture(scope="module")
def mesh():
    return finger_mesh(Finger(), Receptor(), Sizing(3, 2.0)).mesh


def off(found, expected):
    return np.abs(found - expected).max() / max(np.abs(expected).max(), np.finfo(float).tiny)


@pytest.mark.parametrize("nu", [0.0, 0.48, 0.4999999])
def test_the_stiffness_of_elements_is_the_plain_one(mesh, nu):
    tissues = [Hooke(E, nu) for E in (0.136, 0.08, 0.034)]
    plain, found = Elastic.of(mesh, tissues), ReducedInLoops(mesh, tissues)
    for name in ("stiffness", "dilatation", "shear", "lame"):
        assert off(getattr(found.elastic, name), getattr(plain, name)) < CLOSE
    assert off(found.elastic.centre, plain.centre) < 1e-14


def test_a_body_eliminated_in_loops_is_the_plain_one(mesh):
    """Under dead loads on all nodes, the elements' centres too."""
    rng = np.random.default_rng(1)
    load = rng.normal(size=mesh.nodes.shape)
    load[mesh.held] = 0.0
    plain = Reduced.of(elimination(mesh), Elastic.of(mesh, TISSUES).stiffness, load.reshape(-1, 1))
    found = ReducedInLoops(mesh, TISSUES).loaded(load.ravel())
    assert off(found.stiffness, plain.stiffness) < CLOSE
    assert off(found.load, plain.load) < CLOSE
    skin = rng.normal(size=(2 * len(mesh.skin), 2))
    whole = plain.all_unknowns(skin, loaded=True)
    assert off(found.all_unknowns(skin, loaded=True), whole) < CLOSE
    assert off(found.all_unknowns(skin), plain.all_unknowns(skin)) < CLOSE
    nodes = mesh.elements[40]
    some = np.concatenate([2 * nodes, 2 * nodes + 1])
    assert off(found.all_unknowns(skin, loaded=True, only=some)[some], whole[some]) < CLOSE
    other = rng.normal(size=mesh.nodes.shape)
    other[mesh.held] = 0.0
    (felt, recover), (expected, recover_plainly) = (one.condensed(other.ravel()) for one in (found, plain))
    assert off(felt, expected) < CLOSE
    assert off(recover(skin[:, 0]), recover_plainly(skin[:, 0])) < CLOSE


def test_what_no_stable_body_is_made_of_is_refused_both_ways(mesh):
    """A negative shear modulus, unless it is refused at the door; an element turned inside out."""
    unstable = [Moduli(-0.05, 0.1)] * 3
    for in_loops in (False, True):
        with pytest.raises(LinAlgError):
            LinearBody.of(mesh, unstable, in_loops=in_loops, checked=True)
    flat = block(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]))
    nodes = flat.nodes.copy()
    nodes[:, 0] *= -1.0
    with pytest.raises(LinAlgError, match="folded"):
        ReducedInLoops(Mesh(nodes, flat.elements, flat.region, flat.skin, flat.held), TISSUES)


PUBLISHED = scene(STICKINESS[4])
SOFT = Material(0.08, 0.4999999)


def rubbed(loading: Loading, **rest) -> Scene:
    return Scene(friction=Friction(0.5), loading=loading, solve=Solve(tolerance=0.01), **rest)


ASKED = {
    "published": PUBLISHED,
    "history": replace(scene(SLIPPERINESS[2]), solve=Solve(course="history", tolerance=0.01)),
    "forces given": rubbed(Loading(normal_force=0.1, tangential_force=0.02)),
    "pressed only": rubbed(Loading(1.0, "none")),
    "nearly incompressible": rubbed(Loading(1.5), materials=Materials(SOFT, SOFT, SOFT)),
}


@pytest.mark.parametrize("name", ASKED)
def test_an_answer_is_the_same_both_ways_to_round_off(name):
    plain, found = (answers([ASKED[name]], in_loops=in_loops)[0] for in_loops in (False, True))
    one, other = plain.to_dict(), found.to_dict()
    for key in ("sed_ending", "sed_point", "normal_force", "tangential_force", "indentation", "contact_width"):
        assert other[key] == pytest.approx(one[key], rel=1e-7), key
    for key in ("error_estimate", "normal_force_error", "tangential_force_error"):
        assert (other[key] is None) == (one[key] is None), key  # what is given has no error
        assert other[key] is None or other[key] == pytest.approx(one[key], rel=1e-4, abs=1e-7), key
    assert other["newton_iterations"] == one["newton_iterations"]
    assert found.skin.state == plain.skin.state
    assert other["warnings"] == one["warnings"]


def test_the_same_question_is_answered_bit_by_bit_the_same_again():
    scenes = [scene(surface) for surface in SLIPPERINESS]
    first = answers(scenes, in_loops=True)
    again = answers(scenes, in_loops=True)
    for one, other in zip(first, again, strict=True):
        assert (one.sed_ending, one.error_estimate) == (other.sed_ending, other.error_estimate)
        np.testing.assert_array_equal(one.displacement, other.displacement)
    assert solve(scenes[0], in_loops=True).sed_ending == solve(scenes[0], in_loops=True).sed_ending
