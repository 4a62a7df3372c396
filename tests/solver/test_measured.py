"""Evidence for what was left out can be measured, and scenes that need more than was asked are told so."""

import json
from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Material, Materials, Relaxation, Scene, SceneError, Solve, solve
from solver.accuracy.residual_overstress import relaxing_scene
from solver.scene.published import SLIPPERINESS, STICKINESS, scene


@pytest.fixture(scope="module")
def measured():
    return solve(replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5, evidence="measured")))


def entry(found, name):
    return found.model["left_out"][name]


@pytest.mark.slow
def test_measured_differences_are_those_of_two_solves(measured):
    plain = replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5))
    base = solve(plain).sed_ending
    with_bone = solve(replace(plain, finger=replace(plain.finger, bone="meshed"))).sed_ending
    assert entry(measured, "bone compliance")["estimate"] == pytest.approx(abs(with_bone / base - 1.0))
    finite = solve(replace(plain, solve=Solve("finite", tolerance=0.5))).sed_ending
    assert entry(measured, "finite strain")["estimate"] == pytest.approx(abs(finite / base - 1.0))
    assert entry(measured, "history")["estimate"] < 1e-9  # a settled slide has none left
    assert 0.0 < entry(measured, "viscosity")["estimate"] < 1.0
    assert measured.sed_ending == base


@pytest.mark.slow
def test_the_estimate_stays_beside_the_measured_number_and_the_cost_is_told(measured):
    assert "measured" in entry(measured, "bone compliance")["how"]
    assert entry(measured, "bone compliance")["estimated"] > 0.0
    assert measured.evidence_s > 0.0
    printed = json.loads(json.dumps(measured.to_dict()))
    assert printed["evidence_s"] == measured.evidence_s
    assert any("finite strain" in told and "%" in told for told in measured.warnings)


def test_a_difference_that_two_meshes_explain_is_not_told_as_one_of_the_kinematics():
    touch = Scene(loading=Loading(1e-6, "none"), friction=Friction(0.0), solve=Solve(evidence="measured"))
    found = solve(touch)
    told = entry(found, "finite strain")
    assert told["estimate"] == told["estimated"] < 1e-3  # as small as its strains
    assert "the estimate stands" in told["how"]
    assert not any("finite strain" in warning for warning in found.warnings)


def test_without_being_asked_nothing_is_measured_but_what_tissues_still_hold_and_that_took_time():
    found = solve(replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5)))
    assert found.evidence_s > 0.0
    assert all("measured" not in told["how"] for told in found.model["left_out"].values())
    assert "marched" in entry(found, "viscosity")["how"]


def test_a_bone_too_soft_to_count_as_rigid_is_told():
    given = replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5))
    soft = replace(given, materials=replace(given.materials, bone=Material(1.0, 0.3)))
    assert any('finger.bone = "meshed"' in told for told in solve(soft).warnings)
    meshed = replace(soft, finger=replace(soft.finger, bone="meshed"))
    assert not any("bone" in told for told in solve(meshed).warnings)


@pytest.mark.slow
def test_a_scene_that_folds_at_finite_strain_is_told_at_small_strain():
    found = solve(replace(scene(STICKINESS[4]), solve=Solve(tolerance=0.5, evidence="measured")))
    assert entry(found, "finite strain")["estimate"] is None
    assert 0.3 < entry(found, "finite strain")["from"]["limit_mu"] < 0.5
    assert any("no settled state" in told for told in found.warnings)


def test_evidence_of_another_kind_is_refused():
    with pytest.raises(SceneError, match=r"solve\.evidence"):
        Solve(evidence="guessed")


def still_held(settled, marched):
    """Return what a whole course has at the ending above the settled SED, when a settled answer says that it looks."""
    course, slip = marched.history, entry(settled, "viscosity")["from"]["slide_s"]
    return np.interp(1.0 + slip, course.time, course.sed_ending) / settled.sed_ending - 1.0


def test_a_relaxing_finger_solved_as_settled_is_told_what_it_still_holds_and_one_marched_holds_nothing():
    given = replace(scene(SLIPPERINESS[4]), solve=Solve(tolerance=0.5))
    dermis = replace(given.materials.dermis, prony=(Relaxation(0.3, 1.0),))
    settled = solve(replace(given, materials=replace(given.materials, dermis=dermis)))
    assert any("viscosity" in told and "history" in told for told in settled.warnings)
    marched = solve(replace(settled.scene, solve=Solve("small", "history", 0.5)))
    assert entry(marched, "viscosity")["estimate"] == 0.0
    assert entry(settled, "viscosity")["estimate"] == pytest.approx(still_held(settled, marched), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize(
    "surface", [SLIPPERINESS[0], SLIPPERINESS[4], STICKINESS[0]], ids=["slip 0", "slip 100", "stick 0"]
)
def test_what_tissues_would_still_hold_is_what_a_course_in_small_steps_on_a_finer_mesh_has(kinematics, surface):
    settled = solve(replace(scene(surface), solve=Solve(kinematics)))
    marched = solve(replace(relaxing_scene(settled.scene), solve=Solve(kinematics, "history")))
    assert entry(settled, "viscosity")["estimate"] == pytest.approx(still_held(settled, marched), rel=0.1)


def test_a_rigid_bone_too_stiff_to_be_meshed_with_the_tissues_leaves_the_estimate_with_the_reason():
    usual = scene(SLIPPERINESS[4])
    stiff = replace(usual.materials, bone=Material(1e12, 0.3))
    found = solve(replace(usual, materials=stiff, solve=Solve(tolerance=0.5, evidence="measured")))
    told = entry(found, "bone compliance")
    assert told["estimate"] == told["estimated"]
    assert "was to be measured, but: materials.bone.E" in told["how"]


def test_tissues_that_would_be_too_stiff_at_once_have_no_relaxing_scene():
    stiff = Material(9e11, 0.3)
    tissues = Materials(stiff, stiff, stiff)
    pressed = Scene(materials=tissues, friction=Friction(0.3), loading=Loading(1.0), solve=Solve(tolerance=0.5))
    assert relaxing_scene(pressed) is None
    assert solve(pressed).sed_ending > 0.0
