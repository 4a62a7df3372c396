"""Scenes at finite strain from their keys to a prediction, with its error, its audits, or its refusal."""

import json
from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest

from solver import Friction, Loading, NoSteadyState, NotConverged, Scene, Solve, solve, solve_many
from solver.accuracy.audits import audits, refuse_unsound, rounding
from solver.equilibrium import LoadState
from solver.equilibrium.load_stepping import solve_full_slip
from solver.response import finite_answers
from solver.response.finite_answers import Meshes, coarse_solution, refine
from solver.response.solution import ERROR_UNKNOWN
from solver.scene.published import SLIPPERINESS, STICKINESS, scene
from solver.verification.methods import FiniteMethod
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
    found, (sed, normal, tangential) = four[name], REFERENCE[name]
    reference = 0.0022  # what the two codes differ by, at most
    assert found.sed_ending == pytest.approx(sed, rel=found.error_estimate + reference)
    assert found.normal_force == pytest.approx(normal, rel=found.normal_force_error + reference)
    assert found.tangential_force == pytest.approx(tangential, rel=found.tangential_force_error + reference)
    assert found.error_estimate < 0.03


@pytest.mark.parametrize("name", REFERENCE)
def test_forces_balance_and_nothing_is_exceeded(four, name):
    audits = dict(four[name].audits)
    assert audits.pop("smallest_det_F") > 0.5
    assert all(value < 1e-8 for value in audits.values()), audits


@pytest.mark.parametrize(("wrong", "left"), [((1.01, 1.0), 0.001), ((1.0, 0.99), 0.005)], ids=["drag", "push"])
def test_a_force_told_one_percent_wrong_does_other_work_than_the_body_stores(wrong, left):
    asked = finite(STICKINESS[0])
    finger = published(4)
    shape = solve_full_slip(finger.newton, LoadState(2.0, float(asked.friction.mu), asked.friction.cap, -1))
    told = audits(finger, shape, shape.u)["work_balance"]
    planted = audits(finger, replace(shape, reaction=np.array(wrong) * shape.reaction), shape.u)
    assert told < 1e-9
    assert left < planted["work_balance"] < 0.01


def test_a_force_told_of_the_neighbouring_node_is_unbalanced_there():
    asked = finite(STICKINESS[0])
    finger = published(4)
    shape = solve_full_slip(finger.newton, LoadState(2.0, float(asked.friction.mu), asked.friction.cap, -1))
    told = audits(finger, shape, shape.u)
    reaction, middle = shape.reaction.copy(), int(np.argmax(shape.reaction[:, 1]))
    moved = 0.2 * reaction[middle]
    reaction[middle] -= moved
    reaction[middle + 1] += moved
    planted = audits(finger, replace(shape, reaction=reaction), shape.u)
    assert planted["equilibrium_y"] < 1e-9
    assert told["inner_forces"] < 1e-9
    assert planted["inner_forces"] == pytest.approx(float(np.abs(moved).max()) / shape.force[1], rel=1e-6)
    with pytest.raises(NotConverged, match=r"Forces balance to 0\.\d+ only"):
        refuse_unsound(planted, 2.0)
    assert rounding(told) == ()
    assert rounding(told | {"inner_forces": 2e-8})[0].startswith("Forces balance to 2e-08 only")


DIFFERENT = 0.05  # part of the range of several surfaces that differences between them may be off


@pytest.mark.parametrize("number", [0, 1, 2], ids=["SED", "normal force", "tangential force"])
def test_differences_between_surfaces_solved_together_are_good_to_5_percent_of_their_range(four, number):
    slip = [name for name in REFERENCE if name.startswith("slip")]
    found = [(four[name].sed_ending, four[name].normal_force, four[name].tangential_force)[number] for name in slip]
    true = [REFERENCE[name][number] for name in slip]
    apart = np.subtract.outer(found, found) - np.subtract.outer(true, true)
    assert np.abs(apart).max() < DIFFERENT * np.ptp(true)


@pytest.mark.slow
def test_differences_between_five_surfaces_are_those_of_separate_overkill_solves():
    scenes = [finite(surface, tolerance=0.01) for surface in SLIPPERINESS]
    found = np.array([[p.sed_ending, p.normal_force, p.tangential_force] for p in solve_many(scenes)])
    meshes = [
        FiniteMethod(scenes[0], fineness, shift) for fineness, shift in ((15.0, False), (15.0, True), (13.0, False))
    ]
    true = np.mean([[mesh.numbers(mesh.solve(scene)) for scene in scenes] for mesh in meshes], axis=0)
    apart = (found[:, None] - found) - (true[:, None] - true)
    assert (np.abs(apart).max(axis=(0, 1)) < DIFFERENT * np.ptp(true, axis=0)).all()


def test_a_surface_begun_at_anothers_state_ends_where_one_begun_at_the_undeformed_finger_does():
    one, other = finite(SLIPPERINESS[0]), finite(SLIPPERINESS[1])
    alone, after_one = Meshes(), Meshes()
    coarse_solution(one, 1.5, 4.0, after_one)
    lows = [coarse_solution(other, 1.5, 4.0, meshes) for meshes in (after_one, alone)]
    assert lows[0].state.iterations < lows[1].state.iterations
    tops = [refine(other, 6.0, low, meshes).top.state for low, meshes in zip(lows, (after_one, alone), strict=True)]
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
    assert type(refusal.value.limit_mu) is float  # scripts are told numbers, not those of a library
    assert refusal.value.limit_indentation < 2.0


def test_the_marched_course_ends_in_the_state_found_directly():
    found = solve(finite(SLIPPERINESS[4], course="history"))
    assert found.audits["course_against_direct"] < 1e-9
    assert found.audits["course_work_balance"] < 1e-6
    assert found.audits["course_step_work"] < 1e-3
    assert found.audits["course_least_dissipation"] > -1e-14
    assert found.history.sed_ending[-1] == pytest.approx(found.sed_ending, rel=1e-12)
    assert found.history.bone_y[-1] == pytest.approx(-1.5)
    assert found.history.time[39] == pytest.approx(1.0)


def test_small_and_finite_strain_agree_where_the_press_is_shallow():
    pressed = Scene(friction=Friction(0.3), loading=Loading(0.02, "+x", 15.0))
    small, large = (solve(replace(pressed, solve=Solve(kinematics))) for kinematics in ("small", "finite"))
    assert large.normal_force == pytest.approx(small.normal_force, rel=0.02)
    assert large.sed_ending == pytest.approx(small.sed_ending, rel=0.03)


@pytest.mark.parametrize(("lost_below", "known"), [(5_000, True), (1e9, False)])
def test_an_answer_that_the_nested_mesh_has_not_is_solved_on_a_finer_one_or_said_to_be_of_unknown_error(
    monkeypatch, lost_below, known
):
    nested = finite_answers.solve_nested

    def lost(scene, top, *more):
        return (None, None) if top.finger.body.mesh.dofs < lost_below else nested(scene, top, *more)

    monkeypatch.setattr(finite_answers, "solve_nested", lost)
    found = solve(Scene(friction=Friction(0.3), loading=Loading(0.5, "+x"), solve=Solve("finite", evidence="quick")))
    assert (found.error_estimate < 0.01) == known
    assert (ERROR_UNKNOWN in found.warnings) == (not known)


def test_setting_up_a_mesh_counts_once_where_the_first_mesh_is_that_of_the_answer():
    begin = perf_counter()
    answer = solve(Scene(friction=Friction(0.3), loading=Loading(1e-5, "+x"), solve=Solve("finite", evidence="quick")))
    assert answer.wall_s > 0.0
    assert answer.setup_s + answer.wall_s + answer.estimate_s < perf_counter() - begin
