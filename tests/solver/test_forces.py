"""Forces in place of depth and slide, and courses that turn round."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import (
    Finger,
    Friction,
    Loading,
    Material,
    Materials,
    NoSteadyState,
    NotConverged,
    Scene,
    SceneError,
    Solve,
    SolveFailure,
    solve,
)
from solver.continuation import existence, finite_states
from solver.equilibrium import load_stepping
from solver.scene.published import SLIPPERINESS, STICKINESS, scene

KINEMATICS = ("small", "finite")
COURSES = ("small", pytest.param("finite", marks=pytest.mark.slow))  # a course at finite strain takes seconds
COARSE = 0.5  # tolerance that the coarsest mesh meets


def published(kinematics, course="steady"):
    return replace(scene(SLIPPERINESS[4]), solve=Solve(kinematics, course, COARSE))


def under_force(scene, **changes):
    return replace(scene, loading=replace(scene.loading, indentation=None, **changes))


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_the_force_of_a_driven_finger_presses_it_to_the_same_depth(kinematics):
    by_depth = solve(published(kinematics))
    prediction = solve(under_force(published(kinematics), normal_force=by_depth.normal_force))
    assert prediction.normal_force == pytest.approx(by_depth.normal_force, rel=1e-9)
    assert prediction.indentation == pytest.approx(1.5, rel=2e-3)  # the meshes are made for about the same depth
    assert prediction.sed_ending == pytest.approx(by_depth.sed_ending, rel=5e-3)
    assert prediction.shift is None


@pytest.mark.parametrize("kinematics", COURSES)
def test_a_course_under_a_normal_force_ends_in_the_settled_state_found_directly(kinematics):
    prediction = solve(under_force(published(kinematics, "history"), normal_force=1.2, force_unit="N"))
    assert prediction.audits["course_against_direct"] < 1e-9
    assert prediction.normal_force == pytest.approx(1.2 / 15.0, rel=1e-9)
    np.testing.assert_allclose(prediction.history.normal_force[prediction.history.time >= 1.0], 0.08, rtol=1e-8)


@pytest.mark.parametrize("kinematics", COURSES)
def test_a_drag_below_the_limit_shifts_the_finger_until_the_skin_carries_it(kinematics):
    scene = under_force(published(kinematics, "history"), normal_force=0.1, tangential_force=0.01)
    prediction = solve(scene)
    assert prediction.normal_force == pytest.approx(0.1, rel=1e-8)
    assert prediction.tangential_force == pytest.approx(0.01, rel=1e-6)
    assert "stick" in prediction.skin.state
    assert prediction.shift < 0.0  # towards -x, where it slides
    assert max(prediction.audits[n] for n in ("equilibrium_x", "equilibrium_y", "tension", "cone_violation")) < 1e-9
    np.testing.assert_allclose(prediction.history.time[-1], 2.0)


@pytest.mark.parametrize(("mu", "direction"), [(1e-2, "+x"), (1e-6, "-x")])
@pytest.mark.parametrize("kinematics", COURSES)
def test_a_drag_is_met_where_friction_is_so_small_that_all_but_one_point_slip(kinematics, mu, direction):
    scene = under_force(published(kinematics), normal_force=0.1, tangential_force=mu * 0.06, slide=direction)
    prediction = solve(replace(scene, friction=Friction(mu)))
    frictionless = solve(replace(under_force(published(kinematics), normal_force=0.1), friction=Friction(0.0)))
    assert prediction.tangential_force == pytest.approx(mu * 0.06, rel=1e-6)
    assert prediction.audits["drag_missed"] < 1e-8
    assert prediction.sed_ending == pytest.approx(frictionless.sed_ending, rel=0.2 * mu + 3e-3)  # two meshes
    assert prediction.error_estimate < 0.1


@pytest.mark.parametrize("kinematics", KINEMATICS)
def test_a_bound_of_nothing_is_no_friction_whatever_its_coefficient(kinematics):
    scene = under_force(published(kinematics), normal_force=0.1)
    frictionless, no_bond = (solve(replace(scene, friction=law)) for law in (Friction(0.0), Friction(378.0, 0.0)))
    assert no_bond.sed_ending == pytest.approx(frictionless.sed_ending, rel=2e-3)
    assert no_bond.error_estimate < 2.0 * frictionless.error_estimate


@pytest.mark.parametrize("kinematics", COURSES)
def test_a_drag_of_the_friction_limit_is_the_settled_slide_and_more_is_refused_in_a_sentence(kinematics):
    scene = replace(published(kinematics), friction=Friction(0.24, 0.004), solve=Solve(kinematics, tolerance=0.5))
    scene = under_force(scene, normal_force=0.1)
    sliding = solve(scene)
    limit = sliding.tangential_force  # below mu N, since part of the skin slips at the bound
    assert limit < 0.999 * 0.24 * 0.1
    at_limit = solve(under_force(scene, normal_force=0.1, tangential_force=limit))
    assert at_limit.sed_ending == pytest.approx(sliding.sed_ending, rel=1e-6)
    assert at_limit.error_estimate < 0.1  # though coarser meshes slide a little earlier
    with pytest.raises(NoSteadyState, match=r"outside the friction limit.*slides from 0\.0"):
        solve(under_force(scene, normal_force=0.1, tangential_force=(limit + 0.024) / 2))


def test_small_strain_under_forces_has_the_work_of_the_bone_in_elastic_energy_and_friction():
    prediction = solve(under_force(published("small", "history"), normal_force=0.1, tangential_force=0.015))
    assert prediction.audits["course_work_balance"] < 1e-12
    assert prediction.audits["course_least_dissipation"] > -1e-12


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"indentation": 1.0, "normal_force": 0.1}, "loading.indentation"),
        ({}, "loading.indentation"),
        ({"normal_force": -0.1}, "loading.normal_force"),
        ({"normal_force": 0.1, "force_unit": "kg"}, "loading.force_unit"),
        ({"indentation": 1.0, "tangential_force": 0.1}, "loading.tangential_force"),
        ({"normal_force": 0.1, "tangential_force": 0.0501}, "loading.tangential_force"),
        ({"normal_force": 0.1, "tangential_force": 0.01, "slide": "none"}, "loading.slide"),
        ({"normal_force": 0.1, "tangential_force": 0.01, "slide": ("+x", "-x")}, "loading.slide"),
        ({"indentation": 1.0, "slide": ()}, "loading.slide"),
        ({"indentation": 1.0, "slide": ("+x", "none")}, "loading.slide"),
    ],
)
def test_loads_that_contradict_each_other_or_the_friction_are_refused(change, key):
    with pytest.raises(SceneError) as refusal:
        Scene(friction=Friction(0.5), loading=Loading(**change))
    assert refusal.value.key == key


@pytest.mark.parametrize("kinematics", COURSES)
def test_a_finger_that_slides_there_and_back_ends_as_if_it_had_slid_back_only(kinematics):
    reversing = published(kinematics, "history")
    reversing = replace(reversing, loading=replace(reversing.loading, slide=("-x", "+x", "-x")))
    prediction = solve(reversing)
    one_way = solve(published(kinematics))
    assert prediction.sed_ending == pytest.approx(one_way.sed_ending, rel=1e-9)
    assert prediction.audits["course_against_direct"] < 1e-9
    drag = prediction.history.tangential_force
    other_way = solve(sliding_back(kinematics))  # at finite strain on a mesh of its own, whose lines follow its contact
    tolerance = 1e-9 if kinematics == "small" else prediction.tangential_force_error + other_way.tangential_force_error
    assert drag.min() == pytest.approx(-other_way.tangential_force, rel=tolerance)
    assert (np.diff(prediction.history.time) > 0.0).all()
    assert np.sign(np.diff(prediction.history.bone_x[prediction.history.time > 1.0])).min() == -1.0


def sliding_back(kinematics):
    return replace(published(kinematics), loading=replace(published(kinematics).loading, slide="+x"))


def test_friction_takes_work_in_every_step_of_a_reversal():
    sticky = replace(scene(STICKINESS[0]), solve=Solve("small", "history", COARSE))
    prediction = solve(replace(sticky, loading=replace(sticky.loading, slide=("+x", "-x"))))
    assert prediction.audits["course_work_balance"] < 1e-12
    assert prediction.audits["course_least_dissipation"] > -1e-12


@pytest.mark.slow
def test_at_finite_strain_a_leg_without_a_settled_state_is_refused_with_its_limits():
    sticky = replace(scene(STICKINESS[4]), solve=Solve("finite", "history", COARSE))
    with pytest.raises(NoSteadyState) as refusal:  # the skin folds when it slides along +x at 2 mm
        solve(replace(sticky, loading=replace(sticky.loading, slide=("+x", "-x"))))
    assert refusal.value.limit_mu < 0.5


def test_without_friction_a_drag_of_nothing_is_the_settled_slide():
    frictionless = replace(published("small"), friction=Friction(0.0))
    sliding = solve(under_force(frictionless, normal_force=0.05))
    for course in ("steady", "history"):
        scene = replace(frictionless, solve=Solve("small", course, COARSE))
        without_drag = under_force(scene, normal_force=0.05, tangential_force=0.0)
        assert solve(without_drag).sed_ending == pytest.approx(sliding.sed_ending, rel=1e-9)


def answer_or_sentence(scene, failure):
    """Return the answer to a scene; None where it is refused by such a failure, whose words must be a sentence."""
    try:
        return solve(scene)
    except failure as refusal:
        sentence = str(refusal)
    assert sentence.endswith(".")
    return None


FORCES = st.builds(
    dict,
    mu=st.sampled_from([0.0, 1e-9, 0.02, 0.3, 0.7, 1.2]),
    tau_max=st.sampled_from([None, 0.002, 0.03]),
    normal_force=st.floats(-3.0, -0.5).map(lambda power: 10.0**power),
    part=st.sampled_from([None, 0.0, 0.3, 0.9, 1.0]),
    slide=st.sampled_from(["+x", "-x"]),
    angle=st.sampled_from([20.0, 45.0, 80.0]),
    nail=st.sampled_from([0.0, 10.0]),
)


@given(sample=FORCES)
@settings(max_examples=6, deadline=None)
def test_any_forces_lead_to_a_state_that_has_them_or_to_a_sentence(sample):
    drag = None if sample["part"] is None else sample["part"] * sample["mu"] * sample["normal_force"]
    scene = Scene(
        finger=Finger(contact_angle=sample["angle"], nail_length=sample["nail"]),
        friction=Friction(sample["mu"], sample["tau_max"]),
        loading=Loading(normal_force=sample["normal_force"], tangential_force=drag, slide=sample["slide"]),
        solve=Solve(tolerance=COARSE),
    )
    prediction = answer_or_sentence(scene, SolveFailure)
    if prediction is None:
        return
    assert prediction.normal_force == pytest.approx(sample["normal_force"], rel=1e-6)
    if drag is not None:
        assert prediction.tangential_force == pytest.approx(drag, rel=1e-5, abs=1e-12)
    assert prediction.sed_ending > 0.0
    for name in ("equilibrium_x", "equilibrium_y", "penetration", "tension", "cone_violation"):
        assert prediction.audits[name] < 1e-7


@pytest.mark.slow
def test_at_finite_strain_a_force_is_met_up_to_the_largest_depth_and_refused_without_a_limit_of_friction_beyond():
    scene = Scene(friction=Friction(0.3), loading=Loading(normal_force=0.33), solve=Solve("finite", tolerance=COARSE))
    prediction = solve(scene)  # a step of the search passes the depth at which the skin folds; 0.33 lies before it
    assert prediction.normal_force == pytest.approx(0.33, rel=1e-8)
    with pytest.raises(NoSteadyState, match=r"under a normal force of 0\.33") as refusal:
        solve(replace(scene, friction=Friction(0.4)))
    assert refusal.value.limit_mu is None  # that of the depth at which the search ended would be none of this scene
    assert refusal.value.limit_indentation < 2.0
    assert 0.2 < refusal.value.limit_normal_force < 0.33


def test_a_finger_pressed_to_its_bone_is_refused_with_the_force_that_its_tissue_carries():
    scene = Scene(friction=Friction(0.0), loading=Loading(None, normal_force=0.6), solve=Solve(tolerance=COARSE))
    with pytest.raises(NoSteadyState, match="to its bone") as refusal:
        solve(scene)
    largest_force = float(str(refusal.value).split("carry up to ")[1].split()[0])
    bone_depth = scene.finger.bone_depth()
    deepest = replace(scene, loading=Loading(0.999 * bone_depth))
    assert solve(deepest).normal_force == pytest.approx(largest_force, rel=0.01)


def test_a_press_is_found_whatever_would_become_of_a_slide():
    scene = Scene(
        loading=Loading(None, "none", normal_force=0.1), friction=Friction(1.6), solve=Solve(tolerance=COARSE)
    )
    depths = [solve(replace(scene, friction=Friction(mu))).indentation for mu in (1.6, 10.0)]
    assert depths[0] == pytest.approx(depths[1], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dermis", "friction", "normal_force", "tolerance"),
    [
        (0.08, Friction(1.118277397182296, 0.002070548525770076), 0.0044497192655214915, 0.003),
        (5407.8454161623995, Friction(0.5586545703197969, 0.025616377070578233), 0.1910637957430237, 0.003),
        (150.69821590921816, Friction(0.3094747251088029, 0.0016722533203269358), 0.4910914796322509, None),
    ],
)
def test_a_force_that_one_mesh_does_not_meet_is_met_on_another_or_refused_in_a_sentence(
    dermis, friction, normal_force, tolerance
):
    scene = Scene(
        materials=Materials(dermis=Material(dermis, 0.48)),
        friction=friction,
        loading=Loading(normal_force=normal_force, slide="-x"),
        solve=Solve("finite", tolerance=tolerance, evidence="quick"),
    )
    prediction = answer_or_sentence(scene, NotConverged)
    assert prediction is None or prediction.normal_force == pytest.approx(normal_force, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "normal_force"), [(1.108, 0.2568), (0.3, 100.0)])
def test_a_limit_under_a_force_has_a_slide_a_little_less_deep_and_none_a_little_deeper(mu, normal_force):
    loading = Loading(normal_force=normal_force)
    scene = Scene(friction=Friction(mu), loading=loading, solve=Solve("finite", tolerance=0.1))
    with pytest.raises(NoSteadyState) as refusal:
        solve(scene)
    deepest = refusal.value.limit_indentation
    below = solve(replace(scene, loading=Loading(0.97 * deepest)))
    assert below.normal_force == pytest.approx(refusal.value.limit_normal_force, rel=0.05)
    with pytest.raises(NoSteadyState):
        solve(replace(scene, loading=Loading(1.06 * deepest)))


def test_a_largest_depth_that_has_a_slide_beyond_it_is_no_limit_under_a_force(monkeypatch):
    """Simulated: the force is lost while it grows, and the branch seems to end at two thirds of the depth."""
    press = Scene(friction=Friction(0.3), loading=Loading(normal_force=0.1), solve=Solve("finite", tolerance=COARSE))
    expected, depth_limit, march = solve(press), existence.depth_limit, load_stepping.march

    def end_too_early(scene, load):
        depth = expected.indentation / 1.5
        return replace(
            depth_limit(scene, load._replace(depth=depth)), value=depth, ends_early=True, corrector_failed=False
        )

    def lose_on_the_way(newton, course, start):
        yield from march(newton, course[:3], start)
        raise NotConverged("lost")

    for module in (existence, finite_states):
        monkeypatch.setattr(module, "depth_limit", end_too_early)
    monkeypatch.setattr(load_stepping, "march", lose_on_the_way)
    prediction = solve(press)
    assert prediction.normal_force == pytest.approx(0.1, rel=1e-8)
    assert prediction.indentation == pytest.approx(expected.indentation, rel=1e-3)
