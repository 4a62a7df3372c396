"""Omitted effects can be measured, and a prediction warns where one of them matters."""

import json
from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Material, Materials, Relaxation, Scene, SceneError, Solve, solve
from solver.accuracy.omitted_effects import relaxing_scene
from solver.scene.published import SLIPPERINESS, STICKINESS, scene


@pytest.fixture(scope="module")
def measured_prediction():
    return solve(replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5, evidence="measured")))


def entry(prediction, name):
    return prediction.model["left_out"][name]


@pytest.mark.slow
def test_measured_differences_are_those_of_two_solves(measured_prediction):
    without_evidence = replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5))
    base = solve(without_evidence).sed_ending
    with_bone = solve(replace(without_evidence, finger=replace(without_evidence.finger, bone="meshed"))).sed_ending
    assert entry(measured_prediction, "bone compliance")["estimate"] == pytest.approx(abs(with_bone / base - 1.0))
    finite = solve(replace(without_evidence, solve=Solve("finite", tolerance=0.5))).sed_ending
    assert entry(measured_prediction, "finite strain")["estimate"] == pytest.approx(abs(finite / base - 1.0))
    assert entry(measured_prediction, "history")["estimate"] < 1e-9  # a settled slide has none left
    assert 0.0 < entry(measured_prediction, "viscosity")["estimate"] < 1.0
    assert measured_prediction.sed_ending == base


@pytest.mark.slow
def test_the_estimate_stays_beside_the_measured_number_and_the_cost_is_reported(measured_prediction):
    assert "measured" in entry(measured_prediction, "bone compliance")["how"]
    assert entry(measured_prediction, "bone compliance")["estimated"] > 0.0
    assert measured_prediction.evidence_s > 0.0
    document = json.loads(json.dumps(measured_prediction.to_dict()))
    assert document["evidence_s"] == measured_prediction.evidence_s
    assert any("finite strain" in warning and "%" in warning for warning in measured_prediction.warnings)


def test_a_difference_that_two_meshes_explain_is_not_reported_as_one_of_the_kinematics():
    scene = Scene(loading=Loading(1e-6, "none"), friction=Friction(0.0), solve=Solve(evidence="measured"))
    prediction = solve(scene)
    effect = entry(prediction, "finite strain")
    assert effect["estimate"] == effect["estimated"] < 1e-3  # as small as its strains
    assert "the estimate is kept" in effect["how"]
    assert not any("finite strain" in warning for warning in prediction.warnings)


def test_without_being_asked_nothing_is_measured_but_what_tissues_still_hold_and_that_took_time():
    prediction = solve(replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5)))
    assert prediction.evidence_s > 0.0
    assert all("measured" not in effect["how"] for effect in prediction.model["left_out"].values())
    assert "marched" in entry(prediction, "viscosity")["how"]


def test_a_bone_too_soft_to_count_as_rigid_is_reported():
    slippery = replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5))
    soft = replace(slippery, materials=replace(slippery.materials, bone=Material(1.0, 0.3)))
    assert any('finger.bone = "meshed"' in warning for warning in solve(soft).warnings)
    with_bone = replace(soft, finger=replace(soft.finger, bone="meshed"))
    assert not any("bone" in warning for warning in solve(with_bone).warnings)


@pytest.mark.slow
def test_a_scene_that_folds_at_finite_strain_is_reported_at_small_strain():
    prediction = solve(replace(scene(STICKINESS[4]), solve=Solve(tolerance=0.5, evidence="measured")))
    assert entry(prediction, "finite strain")["estimate"] is None
    assert 0.3 < entry(prediction, "finite strain")["from"]["limit_mu"] < 0.5
    assert any("no settled state" in warning for warning in prediction.warnings)


def test_evidence_of_another_kind_is_refused():
    with pytest.raises(SceneError, match=r"solve\.evidence"):
        Solve(evidence="guessed")


def residual_overstress(settled, stepwise):
    """Return what a whole course has at the ending above the settled SED, when a settled answer says that it looks."""
    course, slip = stepwise.history, entry(settled, "viscosity")["from"]["slide_s"]
    return np.interp(1.0 + slip, course.time, course.sed_ending) / settled.sed_ending - 1.0


def test_a_relaxing_finger_solved_as_settled_is_told_what_it_still_holds_and_one_marched_holds_nothing():
    slippery = replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5))
    dermis = replace(slippery.materials.dermis, prony=(Relaxation(0.3, 1.0),))
    settled = solve(replace(slippery, materials=replace(slippery.materials, dermis=dermis)))
    assert any("viscosity" in warning and "history" in warning for warning in settled.warnings)
    stepwise = solve(replace(settled.scene, solve=Solve("small", "history", 0.5)))
    assert entry(stepwise, "viscosity")["estimate"] == 0.0
    assert entry(settled, "viscosity")["estimate"] == pytest.approx(residual_overstress(settled, stepwise), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize(
    "surface", [SLIPPERINESS[0], SLIPPERINESS[4], STICKINESS[0]], ids=["slip 0", "slip 100", "stick 0"]
)
def test_what_tissues_would_still_hold_is_what_a_course_in_small_steps_on_a_finer_mesh_has(kinematics, surface):
    settled = solve(replace(scene(surface), solve=Solve(kinematics)))
    stepwise = solve(replace(relaxing_scene(settled.scene), solve=Solve(kinematics, "history")))
    assert entry(settled, "viscosity")["estimate"] == pytest.approx(residual_overstress(settled, stepwise), rel=0.1)


def test_a_rigid_bone_too_stiff_to_be_meshed_with_the_tissues_leaves_the_estimate_with_the_reason():
    usual = scene(SLIPPERINESS[4])
    stiff = replace(usual.materials, bone=Material(1e12, 0.3))
    prediction = solve(replace(usual, materials=stiff, solve=Solve(tolerance=0.5, evidence="measured")))
    effect = entry(prediction, "bone compliance")
    assert effect["estimate"] == effect["estimated"]
    assert "was to be measured, but: materials.bone.E" in effect["how"]


def test_tissues_that_would_be_too_stiff_at_once_have_no_relaxing_scene():
    stiff = Material(9e11, 0.3)
    tissues = Materials(stiff, stiff, stiff)
    scene = Scene(materials=tissues, friction=Friction(0.3), loading=Loading(1.0), solve=Solve(tolerance=0.5))
    assert relaxing_scene(scene) is None
    assert solve(scene).sed_ending > 0.0
