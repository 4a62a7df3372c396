"""A slide taken up again where its prediction stopped: the same state, and those beside it as they are solved alone."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Scene, Solve, solve_many
from solver.response.nearby import nearby

DRIVEN = {
    "small, by depth": Scene(friction=Friction(0.44, 0.03), loading=Loading(2.0)),
    "small, by force": Scene(friction=Friction(0.4), loading=Loading(normal_force=0.9, force_unit="N", slide="-x")),
    "finite, by depth": Scene(friction=Friction(0.4, 0.008), loading=Loading(1.2, "-x"), solve=Solve("finite")),
    "finite, by force": Scene(
        friction=Friction(0.3, 0.02), loading=Loading(normal_force=0.9, force_unit="N"), solve=Solve("finite")
    ),
}


def rubbed(scene, mu):
    return replace(scene, friction=replace(scene.friction, mu=mu))


@pytest.fixture(scope="module")
def found():
    return dict(zip(DRIVEN, solve_many(tuple(DRIVEN.values())), strict=True))


def taken_up(prediction):
    (one,) = nearby([prediction])
    return one


@pytest.mark.parametrize("name", DRIVEN)
def test_taken_up_it_has_the_sed_that_was_predicted(found, name):
    told = [[found[name].sed_ending, found[name].sed_point]]
    assert taken_up(found[name]).seds([DRIVEN[name]]) == pytest.approx(np.array(told), rel=1e-7)


@pytest.mark.parametrize("name", DRIVEN)
def test_its_tangent_says_where_states_beside_it_lie(found, name):
    scene, one = DRIVEN[name], taken_up(found[name])
    by = one.derivatives().sed
    loads = replace(scene, friction=Friction(scene.friction.mu * (1 + 1e-5), scene.friction.tau_max))
    here, there = one.seds([scene, loads])[:, 0]
    assert there - here == pytest.approx(by.mu * 1e-5 * scene.friction.mu, rel=1e-3)


@pytest.mark.parametrize("name", DRIVEN)
def test_states_beside_it_are_those_that_are_solved(name):
    scene = DRIVEN[name]
    beside = rubbed(scene, 1.05 * scene.friction.mu)
    first, second = solve_many([scene, beside])  # on one mesh
    here, there = taken_up(first).seds([scene, beside])[:, 0]
    assert there - here == pytest.approx(second.sed_ending - first.sed_ending, rel=1e-5)


@pytest.mark.parametrize("name", ["small, by depth", "finite, by depth"])
def test_beyond_the_limit_of_sliding_there_is_no_state_and_none_is_invented(name):
    scene = replace(DRIVEN[name], friction=Friction(0.3), loading=Loading(1.2))
    (prediction,) = solve_many([scene])
    seds = taken_up(prediction).seds([rubbed(scene, 0.31), rubbed(scene, 1.9)])
    assert np.isnan(seds).tolist() == [[False, False], [True, True]]


def test_a_finger_that_is_only_pressed_or_held_by_a_drag_depends_on_its_way():
    pressed = Loading(1.0, "none")
    held = Loading(normal_force=0.06, tangential_force=0.01)
    found = solve_many([Scene(friction=Friction(0.4), loading=one) for one in (pressed, held)])
    assert [taken_up(one) for one in found] == [None, None]


@pytest.mark.parametrize("name", ["small, by depth", "finite, by depth"])
def test_the_end_of_a_course_that_has_nearly_settled_is_taken_up_as_the_settled_slide(found, name):
    prediction = found[name]
    stuck = tuple("stick" if state == "slip" and n % 3 else state for n, state in enumerate(prediction.skin.state))
    assert "stick" in stuck
    ended = replace(prediction, skin=replace(prediction.skin, state=stuck))
    assert taken_up(ended).seds([DRIVEN[name]])[0, 0] == pytest.approx(prediction.sed_ending, rel=1e-7)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_no_sed_is_told_where_contact_would_reach_beyond_the_skin_that_was_looked_at(kinematics):
    scene = Scene(friction=Friction(0.3), loading=Loading(0.2), solve=Solve(kinematics))
    (prediction,) = solve_many([scene])
    seds = taken_up(prediction).seds([replace(scene, loading=Loading(depth)) for depth in (0.21, 3.0)])
    assert np.isnan(seds).tolist() == [[False, False], [True, True]]
