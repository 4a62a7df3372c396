"""What the model says of a session, trial by trial, with friction given as the paper's tables give it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from paper_friction import NORMAL_FORCE, PLAN, analysis, parameters, stroke

from sessions.plan.plan import Finger as OwnFinger
from sessions.prediction import PredictionOptions, predict, with_own_finger
from solver import Finger, Friction, Loading, Scene, SceneError, solve, solve_many
from solver.accuracy.error_estimate import NO_NESTED_STATE
from solver.response.fields import Sketch, path_until_failure, place_of_least_stretch, stills
from solver.scene.published import SLIPPERINESS, STICKINESS


@pytest.fixture(scope="module")
def tables():
    """An analysis that found the paper's tables."""
    surfaces = STICKINESS + SLIPPERINESS
    directions = [1] * 5 + [-1] * 5
    friction = [
        parameters(n + 1, s.mu, s.printed_bound * 1e-2, d, s.speed)
        for n, (s, d) in enumerate(zip(surfaces, directions, strict=True))
    ]
    return analysis(friction, [stroke(n + 1) for n in range(10)])


def beginning(whole, count):
    """Return an analysis of the first strokes alone."""
    return analysis(whole.friction[:count], whole.strokes[:count])


@pytest.fixture(scope="module")
def progress_calls(tables):
    """The prediction, and what was told on the way to it when the seventh trial was wanted first."""
    calls = []
    return predict(tables, PLAN, watch=lambda *call: calls.append(call), first=6), calls


@pytest.fixture(scope="module")
def prediction(progress_calls):
    return progress_calls[0]


def test_the_trial_that_is_wanted_first_is_reported_first_and_each_as_it_stays(progress_calls):
    prediction, calls = progress_calls
    assert [number for number, _, _ in calls] == [6, 0, 1, 2, 3, 4, 5, 7, 8, 9]
    for number, row, _ in calls:
        assert row.to_dict() == prediction.trials[number].to_dict()


def test_the_pictures_of_the_way_end_at_the_settled_finger_and_show_the_history(progress_calls):
    _, row, way = progress_calls[1][0]
    instants = [way.march[at] for at in (5, 30, -1)]
    at_depth, sliding, last = stills(way.finger, instants, Sketch.of(way.finger.geometry.mesh, way.scene))
    history = row.history
    for still, at in ((at_depth, 5), (sliding, 30), (last, -1)):
        assert still.sed == pytest.approx(history.sed_ending[at], rel=1e-9)
    settled, skin = row.picture()
    np.testing.assert_allclose(last.fields.nodes, settled.nodes, atol=1e-9)
    np.testing.assert_allclose(last.fields.sed, settled.sed, rtol=1e-6)
    assert last.skin.state == skin.state
    np.testing.assert_allclose(last.row, row.prediction.row.sed, rtol=1e-6)
    lowest = at_depth.fields.outlines["skin"][:, 1].min()
    assert lowest == pytest.approx(0.0, abs=0.01)  # the skin lies on the surface


def test_a_solve_without_an_answer_is_followed_to_its_last_good_state(progress_calls):
    _, _, way = progress_calls[1][0]
    slippery = replace(way.scene, friction=Friction(3.0, None))
    instants, why = path_until_failure(slippery, way.finger)
    assert why is not None
    assert "mm" in str(why)
    times = [instant.time for instant in instants]
    assert times == sorted(times)
    assert times[-1] >= 1.0  # it was pressed, and lost while it slid
    last = instants[-1]
    assert np.prod(way.finger.body.stretches(way.finger.displacement(last.state)), axis=0).min() > 0.0  # nothing folds
    x, y = place_of_least_stretch(way.finger, last.state, last.depth)
    nodes = way.finger.geometry.mesh.nodes + way.finger.displacement(last.state)
    assert nodes[:, 0].min() <= x <= nodes[:, 0].max()
    assert y <= nodes[:, 1].max()


def test_every_trial_has_its_row_in_the_order_of_the_plan(prediction):
    assert [row.trial for row in prediction.trials] == list(range(1, 11))
    assert [row.stimulus.index for row in prediction.trials] == [0, 20, 50, 80, 100, 0, 20, 55, 75, 100]
    assert [row.indentation for row in prediction.trials] == [2.0] * 5 + [1.5] * 5
    assert all(row.sed > 0 and row.error_estimate < 0.01 for row in prediction.trials)


def test_the_paper_s_friction_gives_the_paper_s_finding(prediction):
    seds = np.array([row.sed for row in prediction.trials])
    index = np.array([row.stimulus.index for row in prediction.trials])
    assert np.corrcoef(seds[:5], index[:5])[0, 1] >= 0.95
    assert np.corrcoef(seds[5:], index[5:])[0, 1] <= -0.85
    assert seds[7] < seds[8]  # 55 below 75


def test_all_trials_share_one_mesh(prediction):
    assert len({row.prediction.dofs for row in prediction.trials}) == 1


def test_model_forces_are_those_per_mm_times_the_finger_s_width_which_is_marked_as_assumed(prediction):
    assert (prediction.width, prediction.width_origin) == (15.0, "assumed")
    for row in prediction.trials:
        assert row.normal_force == pytest.approx(15.0 * row.prediction.normal_force)
        assert row.tangential_force == pytest.approx(15.0 * row.prediction.tangential_force)
        assert row.measured_normal == NORMAL_FORCE


def test_at_the_matching_depth_the_model_presses_as_hard_as_the_finger_did(prediction):
    for row in (prediction.trials[0], prediction.trials[9]):
        scene = row.prediction.scene
        deeper = replace(scene, loading=replace(scene.loading, indentation=row.matching_depth))
        assert solve(deeper).normal_force * 15.0 == pytest.approx(NORMAL_FORCE, rel=0.01)


def test_the_opposite_direction_is_predicted_at_the_same_depth(prediction):
    row = prediction.trials[4]
    scene = row.prediction.scene
    back = solve(replace(scene, loading=replace(scene.loading, slide="-x")))
    assert row.opposite_sed == pytest.approx(back.sed_ending, rel=row.opposite_error + back.error_estimate)
    assert row.opposite_sed != pytest.approx(row.sed, rel=0.05)


def test_the_course_presses_a_second_then_slides_at_the_measured_speed(prediction):
    row = prediction.trials[2]
    late = row.history.time > 1.0
    assert np.allclose(row.history.bone_x[late], row.speed * (row.history.time[late] - 1.0))
    assert row.history.sed_ending[-1] == pytest.approx(row.sed)


def test_the_bound_read_as_printed_is_a_named_choice_that_leaves_next_to_no_drag(tables):
    prediction = predict(beginning(tables, 2), PLAN, PredictionOptions(tau_reading="as-printed", course="steady"))
    assert prediction.trials[0].tau_max == pytest.approx(0.8033e-4)
    assert max(row.tangential_per_mm for row in prediction.trials[:2]) < 0.0040
    assert prediction.to_dict()["options"]["tau_reading"] == "as-printed"


def test_another_finger_is_taken_from_a_scene(tables):
    other = Scene(finger=Finger(tip_radius=6.0, width=12.0), friction=Friction(0.1), loading=Loading(1.0))
    prediction = predict(beginning(tables, 1), PLAN, PredictionOptions(scene=other, course="steady"))
    assert (prediction.width, prediction.width_origin) == (12.0, "set")
    assert prediction.trials[0].prediction.scene.finger.tip_radius == 6.0
    assert prediction.trials[0].prediction.scene.loading.indentation == 2.0
    assert prediction.trials[0].mu == 0.28


def test_what_the_stroke_does_not_tell_is_missing_with_its_reason(tables):
    friction = list(tables.friction)
    friction[1] = parameters(2, None, 0.01, 1, flaws=("no_steady_sliding",))
    strokes = list(tables.strokes)
    strokes[1] = stroke(2, flaws=("no_steady_sliding",))
    strokes[3] = stroke(4, normal_force=None)
    prediction = predict(analysis(friction[:4], strokes[:4]), PLAN, PredictionOptions(course="steady"))
    assert prediction.trials[1].sed is None
    assert "no_steady_sliding" in prediction.trials[1].reasons["sed"]
    assert prediction.trials[3].sed is not None
    assert prediction.trials[3].matching_depth is None
    assert "steady normal force" in prediction.trials[3].reasons["matching_depth"]
    assert prediction.trials[4].reasons["sed"] == "No stroke was found in this trial."
    json.dumps(prediction.to_dict(), allow_nan=False)


@pytest.mark.slow
def test_a_surface_without_a_settled_slide_keeps_its_row_with_the_solver_s_sentence(tables):
    sticky = analysis([*tables.friction[:2], parameters(3, 5.0, 9e9, -1)], tables.strokes[:3])
    prediction = predict(sticky, PLAN, PredictionOptions(course="steady"))
    assert prediction.trials[1].sed is not None
    assert prediction.trials[2].sed is None
    assert "no steady sliding" in prediction.trials[2].reasons["sed"]


def test_a_force_that_would_press_the_model_to_its_bone_has_no_matching_depth(tables):
    hard = analysis(tables.friction[:1], [stroke(1, normal_force=40.0)])
    row = predict(hard, PLAN, PredictionOptions(course="steady")).trials[0]
    assert row.matching_depth is None
    assert "bone" in row.reasons["matching_depth"]


def test_a_recording_without_a_plan_needs_a_depth():
    loose = analysis([parameters(None, 0.4, 0.03, 1)], [stroke(None)])
    imported = replace(PLAN, blocks=(), forces=True)
    nothing = predict(loose, imported).trials[0]
    assert nothing.sed is None
    assert "indentation" in nothing.reasons["sed"]
    row = predict(loose, imported, PredictionOptions(indentation=1.5)).trials[0]
    assert row.sed > 0
    assert row.trial is None
    assert row.stroke == 0


def test_a_depth_beyond_the_finger_is_refused(tables):
    with pytest.raises(SceneError, match="indentation"):
        predict(tables, PLAN, PredictionOptions(indentation=8.0))


def test_a_visit_for_scores_only_predicts_nothing():
    assert predict(analysis([], []), replace(PLAN, forces=False)).trials == ()


def test_it_is_plain_data_that_says_simulated_at_its_head(prediction):
    document = prediction.to_dict()
    assert next(iter(document)) == "simulated"
    assert document["simulated"] == "SIMULATED"
    assert json.loads(json.dumps(document, allow_nan=False)) == json.loads(json.dumps(document))
    row = document["trials"][0]
    assert row["stimulus"] == {"descriptor": "stickiness", "index": 0, "code": "K1"}
    assert len(row["solver"]["time"]) == len(row["solver"]["history"]["sed_ending"])


def test_a_picture_can_be_drawn_of_every_row(prediction):
    fields, skin = prediction.trials[0].picture()
    assert len(fields.sed) == len(fields.nodes)
    assert len(skin.pressure) == len(skin.state)


def test_the_subjects_own_finger_and_angle_are_predicted_unless_another_finger_is_asked_for():
    assert with_own_finger(PredictionOptions(), PLAN).scene is None
    own = replace(PLAN, finger=OwnFinger(tip_radius=6.5, width=17.0), contact_angle=40.0)
    scene = with_own_finger(PredictionOptions(), own).scene
    assert scene.finger == replace(Finger(), tip_radius=6.5, contact_angle=40.0, width=17.0)
    other = Scene(friction=Friction(0.0), loading=Loading(1.0), finger=Finger(width=12.0))
    assert with_own_finger(PredictionOptions(scene=other), own).scene == other


def test_where_the_nested_mesh_has_no_such_state_the_error_is_not_known_and_its_reason_says_so(tables, monkeypatch):
    def bounded_by_nothing(scenes, *rest, **options):
        return [
            replace(answer, nested=None, unknown=NO_NESTED_STATE) for answer in solve_many(scenes, *rest, **options)
        ]

    monkeypatch.setattr("sessions.prediction.scenes.solve_many", bounded_by_nothing)
    row = predict(beginning(tables, 1), PLAN, PredictionOptions(course="steady")).trials[0]
    assert row.sed is not None
    errors = (row.error_estimate, row.opposite_error, row.normal_force_error, row.tangential_force_error)
    assert errors == (None,) * 4
    assert "not known" in row.reasons["error_estimate"]
