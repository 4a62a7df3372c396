"""Scenes at finite strain from their keys to a prediction, with its error, its audits, or its refusal."""

import json
from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest

from solver import Friction, Loading, NoSteadyState, NotConverged, Scene, Solve, solve, solve_many
from solver.accuracy.audits import audits, refuse_unsound, round_off_warnings
from solver.accuracy.error_estimate import NO_NESTED_STATE
from solver.contact import LoadState
from solver.equilibrium.load_stepping import solve_full_slip
from solver.response import finite_answers
from solver.response.finite_answers import Meshes, coarse_solution, refine
from solver.scene.published import SLIPPERINESS, STICKINESS, scene
from solver.verification.fine_meshes import numbers_on_mesh
from solver.verification.methods import FiniteMethod
from solver.verification.random_scenes import random_scene
from tests.solver.finite_examples import published

# Ending-averaged SED [MPa], normal and tangential force [N/mm] of the published finger: means of two independent codes
# (quadrilaterals with exact contact, up to 36,000 unknowns; high-order triangles with penalty contact, 27,000).
REFERENCE = {
    "slipperiness 0": (0.0019115, 0.08142, 0.05048),
    "slipperiness 55": (0.0025631, 0.09056, 0.03985),
    "slipperiness 100": (0.0039081, 0.10361, 0.02487),
    "stickiness 0": (0.009656, 0.26279, 0.05666),
}


def finite(surface, **options):
    return replace(scene(surface), solve=Solve("finite", **options))


@pytest.fixture(scope="module")
def four():
    surfaces = [SLIPPERINESS[0], SLIPPERINESS[2], SLIPPERINESS[4], STICKINESS[0]]
    return dict(zip(REFERENCE, solve_many([finite(surface) for surface in surfaces]), strict=True))


@pytest.mark.parametrize("name", REFERENCE)
def test_the_published_surfaces_come_out_within_their_own_error_estimate(four, name):
    prediction, (sed, normal, tangential) = four[name], REFERENCE[name]
    doubt = 0.0022  # what the two codes differ by, at most
    assert prediction.sed_ending == pytest.approx(sed, rel=prediction.error_estimate + doubt)
    assert prediction.normal_force == pytest.approx(normal, rel=prediction.normal_force_error + doubt)
    assert prediction.tangential_force == pytest.approx(tangential, rel=prediction.tangential_force_error + doubt)
    assert prediction.error_estimate < 0.03


@pytest.mark.parametrize("name", REFERENCE)
def test_forces_balance_and_nothing_is_exceeded(four, name):
    audits = dict(four[name].audits)
    assert audits.pop("smallest_det_F") > 0.5
    assert all(value < 1e-8 for value in audits.values()), audits


@pytest.mark.parametrize(("factors", "least"), [((1.01, 1.0), 0.001), ((1.0, 0.99), 0.005)], ids=["drag", "push"])
def test_a_force_reported_one_percent_wrong_does_other_work_than_the_body_stores(factors, least):
    sticky = finite(STICKINESS[0])
    finger = published(4)
    state = solve_full_slip(finger.newton, LoadState(2.0, float(sticky.friction.mu), sticky.friction.cap, -1))
    balance = audits(finger, state, state.u)["work_balance"]
    wrong_audits = audits(finger, replace(state, reaction=np.array(factors) * state.reaction), state.u)
    assert balance < 1e-9
    assert least < wrong_audits["work_balance"] < 0.01


def test_a_force_assigned_to_the_neighbouring_node_is_unbalanced_there():
    sticky = finite(STICKINESS[0])
    finger = published(4)
    state = solve_full_slip(finger.newton, LoadState(2.0, float(sticky.friction.mu), sticky.friction.cap, -1))
    sound_audits = audits(finger, state, state.u)
    reaction, middle = state.reaction.copy(), int(np.argmax(state.reaction[:, 1]))
    moved_force = 0.2 * reaction[middle]
    reaction[middle] -= moved_force
    reaction[middle + 1] += moved_force
    wrong_audits = audits(finger, replace(state, reaction=reaction), state.u)
    assert wrong_audits["equilibrium_y"] < 1e-9
    assert sound_audits["inner_forces"] < 1e-9
    assert wrong_audits["inner_forces"] == pytest.approx(float(np.abs(moved_force).max()) / state.force[1], rel=1e-6)
    with pytest.raises(NotConverged, match=r"Forces balance to 0\.\d+ only"):
        refuse_unsound(wrong_audits, 2.0)
    assert round_off_warnings(sound_audits) == ()
    assert round_off_warnings(sound_audits | {"inner_forces": 2e-8})[0].startswith("Forces balance to 2e-08 only")


CONTRAST_ERROR = 0.05  # part of the range of several surfaces that differences between them may be off


@pytest.mark.parametrize("number", [0, 1, 2], ids=["SED", "normal force", "tangential force"])
def test_differences_between_surfaces_solved_together_are_good_to_5_percent_of_their_range(four, number):
    slip = [name for name in REFERENCE if name.startswith("slip")]
    numbers = [(four[name].sed_ending, four[name].normal_force, four[name].tangential_force)[number] for name in slip]
    truth = [REFERENCE[name][number] for name in slip]
    errors = np.subtract.outer(numbers, numbers) - np.subtract.outer(truth, truth)
    assert np.abs(errors).max() < CONTRAST_ERROR * np.ptp(truth)


@pytest.mark.slow
def test_differences_between_five_surfaces_are_those_of_separate_overkill_solves():
    scenes = [finite(surface, tolerance=0.01) for surface in SLIPPERINESS]
    numbers = np.array([[p.sed_ending, p.normal_force, p.tangential_force] for p in solve_many(scenes)])
    meshes = [
        FiniteMethod(scenes[0], fineness, shift) for fineness, shift in ((15.0, False), (15.0, True), (13.0, False))
    ]
    truth = np.mean([[mesh.numbers(mesh.solve(scene)) for scene in scenes] for mesh in meshes], axis=0)
    errors = (numbers[:, None] - numbers) - (truth[:, None] - truth)
    assert (np.abs(errors).max(axis=(0, 1)) < CONTRAST_ERROR * np.ptp(truth, axis=0)).all()


def test_a_surface_begun_at_anothers_state_ends_where_one_begun_at_the_undeformed_finger_does():
    first, second = finite(SLIPPERINESS[0]), finite(SLIPPERINESS[1])
    own, common = Meshes(), Meshes()
    coarse_solution(first, 1.5, 4.0, common)
    lows = [coarse_solution(second, 1.5, 4.0, meshes) for meshes in (common, own)]
    assert lows[0].state.iterations < lows[1].state.iterations
    tops = [refine(second, 6.0, low, meshes)[0].state for low, meshes in zip(lows, (common, own), strict=True)]
    np.testing.assert_allclose(tops[0].u, tops[1].u, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(tops[0].reaction, tops[1].reaction, rtol=0.0, atol=1e-11)


def test_a_result_is_json_and_says_what_was_modelled(four):
    document = json.loads(json.dumps(four["stickiness 0"].to_dict(), allow_nan=False))
    assert document["model"]["kinematics"].startswith("finite strain")
    assert "finite strain" not in document["model"]["left_out"]


@pytest.mark.parametrize(
    "surface",
    [*(pytest.param(surface, marks=pytest.mark.slow) for surface in STICKINESS[1:-1]), STICKINESS[-1]],
    ids=lambda s: str(s.index),
)
def test_where_no_settled_sliding_exists_there_is_no_number_but_both_limits(surface):
    with pytest.raises(NoSteadyState) as refusal:
        solve(finite(surface))
    # Without a bound the branch ends at mu = 0.373 (several meshes and orders of a study of this finger).
    assert refusal.value.limit_mu == pytest.approx(0.373, rel=0.04)
    assert type(refusal.value.limit_mu) is float  # a Python number for scripts, not NumPy's
    assert refusal.value.limit_indentation < 2.0


def test_the_marched_course_ends_in_the_state_found_directly():
    prediction = solve(finite(SLIPPERINESS[4], course="history"))
    assert prediction.audits["course_against_direct"] < 1e-9
    assert prediction.audits["course_work_balance"] < 1e-6
    assert prediction.audits["course_step_work"] < 1e-3
    assert prediction.audits["course_least_dissipation"] > -1e-14
    assert prediction.history.sed_ending[-1] == pytest.approx(prediction.sed_ending, rel=1e-12)
    assert prediction.history.bone_y[-1] == pytest.approx(-1.5)
    assert prediction.history.time[39] == pytest.approx(1.0)


def test_small_and_finite_strain_agree_where_the_press_is_shallow():
    shallow = Scene(friction=Friction(0.3), loading=Loading(0.02, "+x", 15.0))
    small, large = (solve(replace(shallow, solve=Solve(kinematics))) for kinematics in ("small", "finite"))
    assert large.normal_force == pytest.approx(small.normal_force, rel=0.02)
    assert large.sed_ending == pytest.approx(small.sed_ending, rel=0.03)


def test_a_shear_limit_acts_alike_on_both_sides_of_a_friction_of_one():
    scene = Scene(loading=Loading(1.5, "-x"), friction=Friction(1.0, 0.003), solve=Solve("finite", tolerance=0.3))
    below, above = solve_many(replace(scene, friction=Friction(mu, 0.003)) for mu in (1.0 - 1e-9, 1.0 + 1e-9))
    assert above.sed_ending == pytest.approx(below.sed_ending, rel=1e-8)
    assert above.tangential_force == pytest.approx(below.tangential_force, rel=1e-8)


@pytest.mark.parametrize(("least_dofs", "estimate_known"), [(5_000, True), (1e9, False)])
def test_an_answer_that_the_nested_mesh_has_not_is_solved_on_a_finer_one_or_said_to_be_of_unknown_error(
    monkeypatch, least_dofs, estimate_known
):
    nested = finite_answers.solve_nested

    def lose_coarse(scene, top, *arguments):
        return (NO_NESTED_STATE, None) if top.finger.body.mesh.dofs < least_dofs else nested(scene, top, *arguments)

    monkeypatch.setattr(finite_answers, "solve_nested", lose_coarse)
    scene = Scene(friction=Friction(0.3), loading=Loading(0.5, "+x"), solve=Solve("finite", evidence="quick"))
    prediction = solve(scene)
    assert (prediction.error_estimate < 0.01) == estimate_known
    unknown = "The error of this answer is not known, since the nested mesh has no such state"
    assert any(warning.startswith(unknown) for warning in prediction.warnings) == (not estimate_known)


def test_setting_up_a_mesh_counts_once_where_the_first_mesh_is_that_of_the_answer():
    scene = Scene(friction=Friction(0.3), loading=Loading(1e-5, "+x"), solve=Solve("finite", evidence="quick"))
    begin = perf_counter()
    prediction = solve(scene)
    assert prediction.wall_s > 0.0
    assert prediction.setup_s + prediction.wall_s + prediction.estimate_s < perf_counter() - begin


def test_where_finer_meshes_fold_at_the_free_cut_a_coarse_meshs_answer_counts_with_its_own_error_and_says_so():
    pushed = random_scene("axis", 14002, "finite")
    loose, strict = (replace(pushed, solve=Solve("finite", tolerance=t, evidence="quick")) for t in (0.03, 0.003))
    driven = replace(strict, finger=replace(strict.finger, cut="driven"))
    loose_answer, answer, driven_answer = map(solve, (loose, strict, driven))
    assert loose_answer.error_estimate <= 0.03
    assert not any("folds" in warning for warning in (*loose_answer.warnings, *driven_answer.warnings))
    assert driven_answer.error_estimate <= 0.003 < answer.error_estimate
    assert "on finer ones tissue beside the free cut folds" in answer.warnings[-1]
    apart = abs(answer.sed_ending / loose_answer.sed_ending - 1.0)
    assert apart <= answer.error_estimate + loose_answer.error_estimate


def test_a_corner_of_bone_and_cut_that_one_element_resolves_is_no_fold():
    answer = solve(replace(scene(STICKINESS[0]), solve=Solve("finite", tolerance=0.005, evidence="quick")))
    assert answer.unknown is None
    assert not any("folds" in warning for warning in answer.warnings)


@pytest.mark.slow
def test_where_fine_meshes_disagree_because_a_free_cut_folds_no_error_is_known_and_a_driven_cut_has_no_such_fold():
    free = random_scene("fingers", 14021, "finite")
    apart, answers = [], []
    for cut in ("free", "driven"):
        pushed = replace(free, finger=replace(free.finger, cut=cut))
        one, other = (numbers_on_mesh([pushed], 15.0, shift)[0, 0] for shift in (False, True))
        apart.append(abs(one / other - 1.0))
        answers.append(solve(replace(pushed, solve=Solve("finite", tolerance=0.01, evidence="quick"))))
    assert apart[0] > 0.003
    assert answers[0].to_dict()["error_estimate"] is None
    assert "folds" in answers[0].warnings[-1]
    assert apart[1] < answers[1].error_estimate <= 0.01
