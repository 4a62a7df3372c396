"""A slide resumed from its prediction: the same state, and nearby states as they are solved alone."""

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


def with_mu(scene, mu):
    return replace(scene, friction=replace(scene.friction, mu=mu))


@pytest.fixture(scope="module")
def predictions():
    return dict(zip(DRIVEN, solve_many(tuple(DRIVEN.values())), strict=True))


def slide_near(prediction):
    (slide,) = nearby([prediction])
    return slide


@pytest.mark.parametrize("name", DRIVEN)
def test_taken_up_it_has_the_sed_that_was_predicted(predictions, name):
    seds = [[predictions[name].sed_ending, predictions[name].sed_point]]
    assert slide_near(predictions[name]).seds([DRIVEN[name]]) == pytest.approx(np.array(seds), rel=1e-7)


@pytest.mark.parametrize("name", DRIVEN)
def test_its_tangent_says_where_states_beside_it_lie(predictions, name):
    scene, slide = DRIVEN[name], slide_near(predictions[name])
    derivative = slide.derivatives().sed
    more_friction = replace(scene, friction=Friction(scene.friction.mu * (1 + 1e-5), scene.friction.tau_max))
    sed, nearby_sed = slide.seds([scene, more_friction])[:, 0]
    assert nearby_sed - sed == pytest.approx(derivative.mu * 1e-5 * scene.friction.mu, rel=1e-3)


@pytest.mark.parametrize("name", DRIVEN)
def test_states_beside_it_are_those_that_are_solved(name):
    scene = DRIVEN[name]
    more_friction = with_mu(scene, 1.05 * scene.friction.mu)
    first, second = solve_many([scene, more_friction])  # on one mesh
    sed, nearby_sed = slide_near(first).seds([scene, more_friction])[:, 0]
    assert nearby_sed - sed == pytest.approx(second.sed_ending - first.sed_ending, rel=1e-5)


@pytest.mark.parametrize("name", ["small, by depth", "finite, by depth"])
def test_beyond_the_limit_of_sliding_there_is_no_state_and_none_is_invented(name):
    scene = replace(DRIVEN[name], friction=Friction(0.3), loading=Loading(1.2))
    (prediction,) = solve_many([scene])
    seds = slide_near(prediction).seds([with_mu(scene, 0.31), with_mu(scene, 1.9)])
    assert np.isnan(seds).tolist() == [[False, False], [True, True]]


def test_a_finger_that_is_only_pressed_or_held_by_a_drag_depends_on_its_way():
    press = Loading(1.0, "none")
    drag = Loading(normal_force=0.06, tangential_force=0.01)
    predictions = solve_many([Scene(friction=Friction(0.4), loading=loading) for loading in (press, drag)])
    assert [slide_near(prediction) for prediction in predictions] == [None, None]


@pytest.mark.parametrize("name", ["small, by depth", "finite, by depth"])
def test_the_end_of_a_course_that_has_nearly_settled_is_taken_up_as_the_settled_slide(predictions, name):
    prediction = predictions[name]
    states = tuple("stick" if state == "slip" and n % 3 else state for n, state in enumerate(prediction.skin.state))
    assert "stick" in states
    nearly_settled = replace(prediction, skin=replace(prediction.skin, state=states))
    assert slide_near(nearly_settled).seds([DRIVEN[name]])[0, 0] == pytest.approx(prediction.sed_ending, rel=1e-7)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_no_sed_is_reported_where_contact_would_reach_beyond_the_skin_that_was_looked_at(kinematics):
    scene = Scene(friction=Friction(0.3), loading=Loading(0.2), solve=Solve(kinematics))
    (prediction,) = solve_many([scene])
    seds = slide_near(prediction).seds([replace(scene, loading=Loading(depth)) for depth in (0.21, 3.0)])
    assert np.isnan(seds).tolist() == [[False, False], [True, True]]
