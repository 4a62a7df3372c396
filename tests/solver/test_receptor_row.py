"""Responses beside those of the ending: along a row at any depth, and of many scenes without estimates."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Receptor, Scene, Solve, solve
from solver.prediction import ROW
from solver.quantities import NAMES
from solver.response.receptor_row import responses_along, rough_responses, row_along

SCENES = {
    kind: Scene(friction=Friction(0.3, 0.02), loading=Loading(1.2, "-x"), solve=Solve(kind, "steady", 0.005, "quick"))
    for kind in ("small", "finite")
}


@pytest.fixture(scope="module", params=SCENES)
def prediction(request):
    return solve(SCENES[request.param])


def test_along_the_row_the_sed_is_that_of_the_prediction_and_in_its_middle_every_quantity_is_the_ending_s(prediction):
    (row,) = responses_along([prediction])
    np.testing.assert_allclose(row[0], prediction.row.sed, rtol=1e-9)
    middle = row[:, np.flatnonzero(ROW == 0.0)[0]]
    np.testing.assert_allclose(middle, [prediction.responses[name].value for name in NAMES], rtol=1e-9)


def test_an_ending_elsewhere_answers_as_the_reference_ending_of_a_scene_that_has_it_there(prediction):
    deep = Receptor(depth=0.4)
    row = row_along(prediction, np.array([0.0]), deep)
    deep_prediction = solve(replace(prediction.scene, receptor=deep))
    for name, value, row_error in zip(NAMES, row.values[:, 0], row.errors[:, 0], strict=True):
        exact, error = deep_prediction.responses[name]
        # two meshes, each refined for an ending at another depth, with an error of its own
        assert value == pytest.approx(exact, abs=row_error + error), name


def test_without_estimates_the_same_states_are_found_and_a_scene_that_cannot_slide_is_nan(prediction):
    scene = prediction.scene
    wedged = replace(scene, friction=Friction(3.0), loading=Loading(2.0, "+x"))
    rough = rough_responses([scene, wedged])
    assert rough.shape == (2, len(NAMES), 1)
    exact = np.array([prediction.responses[name].value for name in NAMES])
    assert np.abs(rough[0, :, 0] / exact - 1.0).max() < 0.03  # a mesh of 4 to 6 elements to the tip radius
    assert np.isnan(rough[1]).all()


def test_of_no_scene_there_is_no_response():
    assert rough_responses([], (0.0, 1.0)).shape == (0, len(NAMES), 2)


@pytest.mark.parametrize("kinematics", SCENES)
def test_errors_along_a_row_at_another_depth_lie_above_the_true_ones(kinematics):
    scene, deep = SCENES[kinematics], Receptor(depth=0.4)
    row = row_along(solve(replace(scene, solve=replace(scene.solve, tolerance=0.02))), receptor=deep)
    fine = row_along(solve(replace(scene, solve=replace(scene.solve, tolerance=0.0005))), receptor=deep)
    comparable = np.isfinite(row.values) & (fine.errors < row.errors / 3.0)
    assert comparable.sum() > 0.5 * comparable.size
    assert np.mean((np.abs(row.values - fine.values) <= row.errors)[comparable]) >= 0.95
    assert np.array_equal(np.isfinite(row.errors), np.isfinite(row.values))
