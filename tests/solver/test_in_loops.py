"""Small strain in compiled loops is small strain in plain NumPy, to round-off: elements, contact, answers."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.linalg import LinAlgError

from solver.body.linear import Body, elimination
from solver.body.linear_compiled import ReducedInLoops
from solver.body.stiffness import Elastic
from solver.constitutive.linear import Hooke, Moduli
from solver.contact.active_set import SHEAR_LIMITED, SLIP, STICK, ContactLost, Course, forced, untouched
from solver.contact.law import FrictionLaw
from solver.equilibrium.load_path import march
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
    compliance = np.linalg.inv(plain.stiffness)
    other = rng.normal(size=(mesh.nodes.size, 2))
    other.reshape(-1, 2, 2)[mesh.held] = 0.0
    assert off(found.under(other, compliance), plain.under(other, compliance)) < CLOSE


def test_what_no_stable_body_is_made_of_is_refused_both_ways(mesh):
    """A negative shear modulus, unless it is refused at the door; an element turned inside out."""
    unstable = [Moduli(-0.05, 0.1)] * 3
    for in_loops in (False, True):
        with pytest.raises(LinAlgError):
            Body.of(mesh, unstable, in_loops=in_loops, checked=True)
    flat = block(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]))
    nodes = flat.nodes.copy()
    nodes[:, 0] *= -1.0
    with pytest.raises(LinAlgError, match="folded"):
        ReducedInLoops(Mesh(nodes, flat.elements, flat.region, flat.skin, flat.held), TISSUES)


LAWS = [FrictionLaw(0.0, np.inf), FrictionLaw(0.5, np.inf), FrictionLaw(0.9, 0.008), FrictionLaw(0.3, 0.0)]


@pytest.fixture(scope="module")
def both(mesh):
    """The same body both ways, its contact found both ways."""
    return [Body.of(mesh, TISSUES, in_loops=in_loops).touchable for in_loops in (False, True)]


def agree(found, plain, size=1.0):
    np.testing.assert_array_equal(found.state, plain.state)
    touching = plain.touching
    np.testing.assert_array_equal(found.sense[touching], plain.sense[touching])
    for name in ("normal", "tangential", "shift", "gap", "motion"):
        expected = getattr(plain, name)
        assert np.abs(getattr(found, name) - expected).max(initial=0.0) < 1e-9 * max(
            np.abs(expected).max(initial=0), size
        )


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("direction", [1, -1])
def test_settled_slides_are_the_plain_ones(both, law, direction):
    plain, found = (Course(body, law).sliding(1.5, direction) for body in both)
    agree(found, plain)
    assert found.iterations == plain.iterations
    again = Course(both[1], law).sliding(1.4, direction, plain.state)
    agree(again, Course(both[0], law).sliding(1.4, direction, plain.state))


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_course_of_stick_slip_and_turning_round_is_the_plain_one(both, law):
    courses = [Course(body, law) for body in both]
    states = [untouched(body) for body in both]
    met = set()
    way = [(0.3, 0.0), (0.9, 0.0), (1.5, 0.0), (1.5, 0.05), (1.5, 0.2), (1.5, 1.0), (1.5, 3.0), (1.5, 2.9), (1.2, 1.0)]
    for depth, travel in way:
        states = [course.step(state, depth, travel) for course, state in zip(courses, states, strict=True)]
        agree(states[1], states[0])
        met |= set(states[0].state)
    assert law.frictionless or (met >= {STICK, SLIP} and (SHEAR_LIMITED in met) == np.isfinite(law.tau_max))


@pytest.mark.parametrize("drag", [0.02, None])
def test_a_body_pressed_and_dragged_by_forces_is_the_plain_one(both, drag):
    law, loading = FrictionLaw(0.5, 0.01), Loading(normal_force=0.1, tangential_force=drag)
    plain, found = (march(body, law, loading).instants for body in both)
    assert len(found) == len(plain)
    for one, other in zip(found, plain, strict=True):
        agree(one.contact, other.contact)
        assert one.contact.normal.sum() == pytest.approx(other.contact.normal.sum(), rel=1e-12)


def test_where_the_plain_search_gives_up_so_do_the_loops(both):
    for body in both:
        with pytest.raises(ContactLost, match="after 2 corrections"):
            Course(body, FrictionLaw(0.5, np.inf), 2).sliding(1.5, 1, np.zeros(len(body.gap), np.int8))
        free = replace(forced(body, 0.1, 0.0), gap=body.gap + 1.0)
        with pytest.raises(ContactLost, match="no unique forces"):
            Course(free, FrictionLaw(0.5, np.inf)).sliding(0.5, 1)


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


def test_who_solves_once_waits_for_no_compiled_loops_and_who_asks_for_them_gets_them():
    code = """
import sys
from solver.scene.published import STICKINESS, scene
from solver.scene import Solve
from solver.response.solution import solve
import subprocess
import sys
from dataclasses import replace
asked = replace(scene(STICKINESS[0]), solve=Solve(tolerance=0.05))
for in_loops in (False, True):
    solve(asked, in_loops=in_loops)
    print("solver._kernels" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]
