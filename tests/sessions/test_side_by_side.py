"""The same trials under both readings, by depth and by force, and at both strains: each held against its own solve."""

import json
import re
from dataclasses import replace

import pytest
from paper_friction import NORMAL_FORCE, PLAN, analysis, parameters, stroke

from sessions.prediction import PredictionOptions, predict, uncertainty
from sessions.prediction.stored import Variant
from sessions.prediction.uncertainty import with_alternatives
from solver import Friction, Loading, Scene, Solve, solve
from solver.scene.published import STICKINESS

TRIALS = (2, 4)  # stickiness 20 and 80: with and without a settled slide at finite strain
SMALL = [("computed", "depth"), ("as-printed", "depth"), ("computed", "force"), ("computed", "other way")]


def inputs(trials=TRIALS):
    surfaces = {number: STICKINESS[number - 1] for number in trials}
    friction = [parameters(n, s.mu, s.printed_bound * 1e-2, 1, s.speed) for n, s in surfaces.items()]
    friction = [replace(row, stroke=at) for at, row in enumerate(friction)]
    block = replace(PLAN.blocks[0], trials=tuple(PLAN.blocks[0].trials[n - 1] for n in trials))
    return analysis(friction, [stroke(n) for n in trials]), replace(PLAN, blocks=(block,))


@pytest.fixture(scope="module")
def plain():
    return predict(*inputs(), PredictionOptions(course="steady", variants="small"))


@pytest.fixture(scope="module")
def variants(plain):
    return with_alternatives(plain)


def pick(row, reading, driven, kinematics="small"):
    return next(a for a in row.alternatives if a.variant == Variant(kinematics, reading, driven))


def test_every_trial_is_reported_along_the_same_named_ways(variants):
    for row in variants.trials:
        assert [(a.variant.tau_reading, a.variant.driven) for a in row.alternatives] == SMALL
        assert all(a.sed > 0 and a.error_estimate < 0.01 and a.reason == "" for a in row.alternatives)


def test_what_was_predicted_anyway_is_not_solved_again(variants):
    for row in variants.trials:
        assert pick(row, "computed", "depth").sed == row.sed
        assert pick(row, "computed", "other way").sed == row.opposite_sed


def test_the_reading_as_printed_is_that_of_a_scene_with_a_hundredth_of_the_bound(variants):
    for row, number in zip(variants.trials, TRIALS, strict=True):
        bound = STICKINESS[number - 1].printed_bound * 1e-4
        scene = Scene(friction=Friction(row.mu, bound), loading=Loading(2.0), solve=Solve("small", "steady"))
        variant = pick(row, "as-printed", "depth")
        assert variant.tau_max == pytest.approx(bound)
        solution = solve(scene)
        assert variant.sed == pytest.approx(solution.sed_ending, rel=variant.error_estimate + solution.error_estimate)


def test_pressed_with_the_force_measured_the_model_has_that_force_at_the_depth_that_matches(plain, variants):
    for row, before in zip(variants.trials, plain.trials, strict=True):
        variant = pick(row, "computed", "force")
        assert variant.normal_force == pytest.approx(NORMAL_FORCE, rel=1e-6)
        assert variant.indentation == pytest.approx(before.matching_depth, rel=5e-3)
        assert row.matching_depth == variant.indentation  # one question, one answer
        assert variant.tangential_force <= row.mu * NORMAL_FORCE * (1 + 1e-9)


def test_the_other_way_is_the_same_depth_slid_back(variants):
    for row in variants.trials:
        variant = pick(row, "computed", "other way")
        assert variant.indentation == row.indentation
        friction, back = Friction(row.mu, row.tau_max), Loading(2.0, "-x")
        solution = solve(Scene(friction=friction, loading=back))
        assert variant.sed == pytest.approx(solution.sed_ending, rel=variant.error_estimate + solution.error_estimate)


def test_it_is_plain_data_for_files_and_reports(variants):
    rows = json.loads(json.dumps(variants.to_dict()))["trials"]
    assert rows[0]["alternatives"][1]["variant"] == {
        "kinematics": "small",
        "tau_reading": "as-printed",
        "driven": "depth",
    }


def test_a_trial_without_friction_or_force_says_why_in_each_variant():
    friction_analysis, plan = inputs((2,))
    without = replace(friction_analysis, strokes=(stroke(2, normal_force=None),))
    options = PredictionOptions(course="steady", variants="small")
    (row,) = with_alternatives(predict(without, plan, options)).trials
    assert pick(row, "computed", "force").reason == "The stroke gives no steady normal force."
    (row,) = with_alternatives(predict(replace(friction_analysis, friction=(), strokes=()), plan, options)).trials
    assert {alternative.reason for alternative in row.alternatives} == {"No stroke was found in this trial."}


def test_a_trial_pressed_by_its_force_until_tissue_turns_inside_out_has_the_solver_s_sentence_and_no_number():
    friction_analysis, plan = inputs()
    pressed = replace(friction_analysis, strokes=(stroke(2, normal_force=2.5), stroke(4, normal_force=5.9)))
    options = PredictionOptions(course="steady", variants="small", intervals=True)
    light, deep = (pick(r, "computed", "force") for r in with_alternatives(predict(pressed, plan, options)).trials)
    friction = Friction(STICKINESS[3].mu, STICKINESS[3].printed_bound * 1e-2)
    loading = Loading(normal_force=5.9, force_unit="N")
    warnings = solve(Scene(friction=friction, loading=loading, solve=Solve("small", "steady"))).warnings
    (sentence,) = (warning for warning in warnings if "turned inside out" in warning)
    assert re.sub("[0-9.]+", "#", deep.reason) == re.sub("[0-9.]+", "#", sentence)
    assert deep.interval.reason == deep.reason
    assert (deep.sed, deep.normal_force, deep.indentation, deep.interval.low) == (None,) * 4
    assert light.sed > 0


def test_where_a_strain_has_no_settled_slide_the_solver_s_sentence_stands_in_its_place(monkeypatch):
    kinematics = []

    def none(scenes, _progress):
        kinematics.extend(scene.solve.kinematics for scene in scenes)
        return tuple("There is none." for _ in scenes)

    monkeypatch.setattr(uncertainty, "predict_scenes", none)
    (row,) = with_alternatives(predict(*inputs((4,)), PredictionOptions(course="steady", variants="both"))).trials
    assert kinematics == ["small"] * 2 + ["finite"] * 4
    assert pick(row, "computed", "depth", "finite").sed is None
    assert pick(row, "computed", "depth", "finite").reason == "There is none."
    assert pick(row, "computed", "depth").sed == row.sed


@pytest.mark.slow
def test_at_finite_strain_a_sticky_surface_has_no_settled_slide_at_its_depth_and_says_so():
    (row,) = with_alternatives(predict(*inputs((4,)), PredictionOptions(course="steady", variants="both"))).trials
    variant = pick(row, "computed", "depth", "finite")
    assert variant.sed is None
    assert "settled sliding up to mu" in variant.reason
    assert pick(row, "as-printed", "depth", "finite").sed > 0


def test_a_finger_pressed_until_its_tissue_turns_inside_out_is_doubted_and_no_other(variants):
    assert all(alternative.doubt == "" for row in variants.trials for alternative in row.alternatives)
    deep = with_alternatives(predict(*inputs(), PredictionOptions(course="steady", variants="small", indentation=3.0)))
    doubts = [pick(row, "computed", "depth").doubt for row in deep.trials]
    assert all("turned inside out" in doubt for doubt in doubts)
    assert all(row.prediction.audits["smallest_det_F"] < 0 for row in deep.trials)
    assert all(doubt in row.prediction.warnings for doubt, row in zip(doubts, deep.trials, strict=True))
