"""Small strain in compiled loops is small strain in plain NumPy, to round-off: elements, elimination, contact."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.linalg import LinAlgError

from solver.body.linear import Body
from solver.body.linear_elimination import LinearElimination
from solver.constitutive.linear import Hooke, Moduli
from solver.contact.active_set import SHEAR_LIMITED, SLIP, STICK, ContactLost, Course, forced, untouched
from solver.contact.law import FrictionLaw
from solver.equilibrium.load_path import march
from solver.mesh import Mesh
from solver.mesh.blocks import block
from solver.mesh.mesher import Sizing, finger_mesh
from solver.response.solution import answers, solve
from solver.scene import Finger, Loading, Receptor
from solver.scene.published import SLIPPERINESS, scene
from tests.solver.oracle import linear as oracle
from tests.solver.oracle.contact import Course as PlainCourse

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
    plain, found = oracle.elastic(mesh, tissues), LinearElimination(mesh, tissues)
    for name in ("stiffness", "dilatation", "shear", "lame"):
        assert off(getattr(found.elastic, name), getattr(plain, name)) < CLOSE
    assert off(found.elastic.centre, plain.centre) < 1e-14


def test_a_body_eliminated_in_loops_is_the_plain_one(mesh):
    """Under dead loads on all nodes, the elements' centres too."""
    rng = np.random.default_rng(1)
    load = rng.normal(size=mesh.nodes.shape)
    load[mesh.held] = 0.0
    plain = oracle.Reduced(mesh, oracle.elastic(mesh, TISSUES).stiffness, load.reshape(-1, 1))
    found = LinearElimination(mesh, TISSUES).loaded(load.ravel())
    assert off(found.stiffness, plain.stiffness) < CLOSE
    assert off(found.load, plain.load) < CLOSE
    skin = rng.normal(size=(2 * len(mesh.skin), 2))
    whole = plain.all_unknowns(skin, load.reshape(-1, 1))
    assert off(found.all_unknowns(skin, loaded=True), whole) < CLOSE
    assert off(found.all_unknowns(skin), plain.all_unknowns(skin)) < CLOSE
    nodes = mesh.elements[40]
    some = np.concatenate([2 * nodes, 2 * nodes + 1])
    assert off(found.all_unknowns(skin, loaded=True, only=some)[some], whole[some]) < CLOSE
    compliance = np.linalg.inv(plain.stiffness)
    other = rng.normal(size=(mesh.nodes.size, 2))
    other.reshape(-1, 2, 2)[mesh.held] = 0.0
    assert off(found.under(other, compliance), plain.under(other)) < CLOSE


def test_what_no_stable_body_is_made_of_is_refused(mesh):
    """A negative shear modulus, unless it is refused at the door; an element turned inside out."""
    unstable = [Moduli(-0.05, 0.1)] * 3
    with pytest.raises(LinAlgError):
        Body.of(mesh, unstable, checked=True)
    flat = block(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]))
    nodes = flat.nodes.copy()
    nodes[:, 0] *= -1.0
    with pytest.raises(LinAlgError, match="folded"):
        LinearElimination(Mesh(nodes, flat.elements, flat.region, flat.skin, flat.held), TISSUES)


LAWS = [FrictionLaw(0.0, np.inf), FrictionLaw(0.5, np.inf), FrictionLaw(0.9, 0.008), FrictionLaw(0.3, 0.0)]


@pytest.fixture(scope="module")
def touchable(mesh):
    return Body.of(mesh, TISSUES).touchable


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
def test_settled_slides_are_the_plain_ones(touchable, law, direction):
    plain, found = (course(touchable, law).sliding(1.5, direction) for course in (PlainCourse, Course))
    agree(found, plain)
    assert found.iterations == plain.iterations
    again = Course(touchable, law).sliding(1.4, direction, plain.state)
    agree(again, PlainCourse(touchable, law).sliding(1.4, direction, plain.state))


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_course_of_stick_slip_and_turning_round_is_the_plain_one(touchable, law):
    courses = [PlainCourse(touchable, law), Course(touchable, law)]
    states = [untouched(touchable)] * 2
    met = set()
    way = [(0.3, 0.0), (0.9, 0.0), (1.5, 0.0), (1.5, 0.05), (1.5, 0.2), (1.5, 1.0), (1.5, 3.0), (1.5, 2.9), (1.2, 1.0)]
    for depth, travel in way:
        states = [course.step(state, depth, travel) for course, state in zip(courses, states, strict=True)]
        agree(states[1], states[0])
        met |= set(states[0].state)
    assert law.frictionless or (met >= {STICK, SLIP} and (SHEAR_LIMITED in met) == np.isfinite(law.tau_max))


@pytest.mark.parametrize("drag", [0.02, None])
def test_a_body_pressed_and_dragged_by_forces_is_the_plain_one(touchable, drag, monkeypatch):
    law, loading = FrictionLaw(0.5, 0.01), Loading(normal_force=0.1, tangential_force=drag)
    found = march(touchable, law, loading).instants
    monkeypatch.setattr("solver.equilibrium.load_path.Course", PlainCourse)
    plain = march(touchable, law, loading).instants
    assert len(found) == len(plain)
    for one, other in zip(found, plain, strict=True):
        agree(one.contact, other.contact)
        assert one.contact.normal.sum() == pytest.approx(other.contact.normal.sum(), rel=1e-12)


def test_where_the_plain_search_gives_up_so_do_the_loops(touchable):
    for course in (PlainCourse, Course):
        with pytest.raises(ContactLost, match="after 2 corrections"):
            course(touchable, FrictionLaw(0.5, np.inf), 2).sliding(1.5, 1, np.zeros(len(touchable.gap), np.int8))
        free = replace(forced(touchable, 0.1, 0.0), gap=touchable.gap + 1.0)
        with pytest.raises(ContactLost, match="no unique forces"):
            course(free, FrictionLaw(0.5, np.inf)).sliding(0.5, 1)


def test_the_same_question_is_answered_bit_by_bit_the_same_again():
    scenes = [scene(surface) for surface in SLIPPERINESS]
    first = answers(scenes)
    again = answers(scenes)
    for one, other in zip(first, again, strict=True):
        assert (one.sed_ending, one.error_estimate) == (other.sed_ending, other.error_estimate)
        np.testing.assert_array_equal(one.displacement, other.displacement)
    assert solve(scenes[0]).sed_ending == solve(scenes[0]).sed_ending
