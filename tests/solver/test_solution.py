"""The published scenes: reference numbers, balance, history, limits, and what a prediction tells about itself."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import (
    Cancelled,
    Finger,
    Friction,
    Loading,
    Material,
    Materials,
    NoSteadyState,
    Receptor,
    Scene,
    Solve,
    SolveFailure,
    solve,
    solve_many,
)
from solver.accuracy.audits import audits
from solver.body.linear import skin_lengths
from solver.contact import LoadState
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh.mesher import Sizing
from solver.response.fields import fields_of
from solver.scene.published import SLIPPERINESS, STICKINESS, scene, scenes

# Mean of two independent codes (structured quadrilaterals with exact active sets; a public high-order triangle code
# with penalty contact), err 0.1 % of sed_ending: the reference page of this finger, small strain.
# sed_ending, sed_point [MPa], normal, tangential force [N/mm]
REFERENCE = {
    "stickiness 0": (0.008566, 0.008727, 0.16347, 0.04535),
    "stickiness 50": (0.008811, 0.008843, 0.18689, 0.08971),
    "stickiness 100": (0.009553, 0.009338, 0.2292, 0.1535),
    "slipperiness 0": (0.0053575, 0.005314, 0.09802, 0.06077),
    "slipperiness 55": (0.00525, 0.005294, 0.09631, 0.04238),
    "slipperiness 100": (0.005185, 0.0053, 0.09677, 0.02323),
}
AFTER_PRESS = (0.0051777, 0.0053391, 0.10065, 0.0)  # d = 1.5 without friction


@pytest.fixture(scope="module")
def ten():
    return {p.scene.title: p for p in solve_many(scenes())}


@pytest.fixture(scope="module")
def histories():
    history_scenes = [replace(s, solve=Solve(course="history")) for s in (scene(STICKINESS[4]), scene(SLIPPERINESS[4]))]
    return solve_many(history_scenes)


@pytest.mark.parametrize("title", REFERENCE)
def test_the_reference_cases_are_met(ten, title):
    prediction, (sed, point, normal, tangential) = ten[title], REFERENCE[title]
    assert prediction.sed_ending == pytest.approx(sed, rel=0.003)
    assert prediction.sed_point == pytest.approx(point, rel=0.01)
    assert prediction.normal_force == pytest.approx(normal, rel=0.003)
    assert prediction.tangential_force == pytest.approx(tangential, rel=0.003)


def test_a_finger_that_is_pressed_without_friction_meets_the_reference():
    prediction = solve(Scene(friction=Friction(0.0), loading=Loading(1.5, "none")))
    assert prediction.sed_ending == pytest.approx(AFTER_PRESS[0], rel=0.003)
    assert prediction.sed_point == pytest.approx(AFTER_PRESS[1], rel=0.01)
    assert prediction.normal_force == pytest.approx(AFTER_PRESS[2], rel=0.003)
    assert prediction.tangential_force == 0.0


def test_differences_between_surfaces_are_met_within_five_per_cent_of_their_range(ten):
    for names in (list(REFERENCE)[:3], list(REFERENCE)[3:]):
        expected = np.array([REFERENCE[n][0] for n in names])
        seds = np.array([ten[n].sed_ending for n in names])
        assert np.abs(np.diff(seds) - np.diff(expected)).max() < 0.05 * np.ptp(expected)


def test_the_finding_of_the_paper_holds_on_its_own_numbers(ten):
    sticky = [ten[f"stickiness {s.index}"].sed_ending for s in STICKINESS]
    slippery = [ten[f"slipperiness {s.index}"].sed_ending for s in SLIPPERINESS]
    assert np.corrcoef(sticky, [s.index for s in STICKINESS])[0, 1] >= 0.95
    assert np.corrcoef(slippery, [s.index for s in SLIPPERINESS])[0, 1] <= -0.85
    assert sticky == sorted(sticky)
    # slipperiness 55 lies below 75, as its measured friction does; the rest falls
    order = [slippery[i] for i in (0, 1, 3, 2, 4)]
    assert order == sorted(order, reverse=True)


def test_every_result_balances_and_exceeds_nothing(ten):
    for prediction in ten.values():
        checks = prediction.audits
        for name in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance"):
            assert checks[name] < 1e-8
        assert checks["penetration"] < 1e-10
        assert checks["tension"] < 1e-10
        assert checks["cone_violation"] < 1e-10
        skin = prediction.skin
        bound = np.minimum(prediction.scene.friction.mu * skin.pressure, prediction.scene.friction.cap)
        assert np.all(np.abs(skin.traction) <= bound + 1e-12)
        assert skin.gap.min() == 0.0


def test_the_estimate_lies_above_the_error_and_below_one_per_cent(ten):
    for title, (sed, *_) in REFERENCE.items():
        error = abs(ten[title].sed_ending / sed - 1.0)
        assert error < ten[title].error_estimate < 0.01


def test_a_force_assigned_to_the_neighbouring_node_is_unbalanced_there():
    sliding = Scene(friction=Friction(0.44, 0.02), loading=Loading(1.0, "-x"))
    finger = LinearFinger.of(sliding, Sizing(5, 1.0, margin=3.0))
    contact = solve_full_slip(finger.newton, LoadState(1.0, 0.44, 0.02, 1))
    displacement = finger.displacement(contact)
    reaction, middle = contact.reaction.copy(), int(np.argmax(contact.normal))
    normal = reaction[:, 1]
    moved_force = 0.2 * normal[middle]
    normal[middle] -= moved_force
    normal[middle + 1] += moved_force
    sound_audits = audits(finger, contact, displacement)
    wrong_audits = audits(finger, replace(contact, reaction=reaction), displacement)
    assert max(sound_audits["inner_forces"], wrong_audits["equilibrium_y"]) < 1e-10
    assert wrong_audits["inner_forces"] == pytest.approx(moved_force / normal.sum(), rel=1e-6)


@pytest.mark.parametrize(
    ("nu", "depth", "balance"),
    [
        (0.4999999, 2.0, 1e-8),
        (0.4999999, 1e-2, 1e-7),
        (0.4999999, 1e-5, 1e-6),
        (0.4999999, 1e-6, 1e-6),
        (0.4999, 1e-6, 1e-8),
    ],
)
def test_forces_balance_near_the_incompressible_limit_and_in_tiny_contacts(nu, depth, balance):
    sliding = Scene(
        materials=Materials(Material(0.136, nu), Material(0.08, nu), Material(0.034, nu)),
        friction=Friction(0.3),
        loading=Loading(depth, "+x"),
    )
    checks = solve(sliding).audits
    for name in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance"):
        assert checks[name] < balance


def test_the_marched_course_ends_in_the_state_solved_directly(ten, histories):
    for prediction in histories:
        direct = ten[prediction.scene.title]
        assert prediction.audits["course_against_direct"] < 1e-10
        assert prediction.history.sed_ending[-1] == pytest.approx(prediction.sed_ending, rel=1e-12)
        assert prediction.sed_ending == pytest.approx(direct.sed_ending, rel=2e-3)  # on another mesh when depths differ


def test_the_course_presses_within_a_second_then_slides_at_the_scene_s_speed(histories):
    for prediction in histories:
        course, loading = prediction.history, prediction.scene.loading
        press = course.time <= 1.0
        assert np.allclose(course.bone_y[press], -loading.indentation * course.time[press])
        assert not course.bone_x[press].any()
        slip = loading.direction * loading.speed * (course.time[~press] - 1.0)
        assert np.allclose(course.bone_x[~press], slip)
        assert course.sed_ending[0] == 0.0
        assert np.all(np.diff(course.time) > 0)
        assert course.slipping[-1] == 1.0
        assert course.slipping[press][-1] < 1.0


def test_the_course_loses_no_work(histories):
    for prediction in histories:
        assert prediction.audits["course_work_balance"] < 1e-12
        assert prediction.audits["course_step_work"] < 1e-3
        assert prediction.audits["course_least_dissipation"] > -1e-14


def test_direction_and_speed_do_not_matter_without_friction():
    frictionless = [
        Scene(friction=Friction(mu, cap), loading=Loading(1.5, slide, speed))
        for mu, cap, slide, speed in ((0.0, None, "+x", 5.0), (0.0, None, "-x", 50.0), (0.4, 0.0, "+x", 5.0))
    ]
    frictionless.append(Scene(friction=Friction(0.0), loading=Loading(1.5, "none")))
    predictions = solve_many(frictionless)
    for prediction in predictions[1:]:
        assert prediction.sed_ending == pytest.approx(predictions[0].sed_ending, rel=1e-12)
    history = solve(Scene(friction=Friction(0.4, 0.0), loading=Loading(1.5, "+x"), solve=Solve(course="history")))
    assert history.sed_ending == pytest.approx(predictions[0].sed_ending, rel=1e-10)


def test_stiffer_everything_scales_the_energy_and_moves_nothing():
    usual = scene(STICKINESS[2])
    soft = usual.materials
    factor = 3.0
    stiff = Materials(*(Material(factor * t.E, t.nu) for t in (soft.epidermis, soft.dermis, soft.fat, soft.bone)))
    friction = Friction(usual.friction.mu, factor * usual.friction.cap)
    prediction, stiff_prediction = solve(usual), solve(replace(usual, materials=stiff, friction=friction))
    assert stiff_prediction.sed_ending == pytest.approx(factor * prediction.sed_ending, rel=1e-10)
    assert stiff_prediction.contact_width == pytest.approx(prediction.contact_width, rel=1e-10)


def test_pressing_with_friction_is_marched_and_sticks_in_the_middle():
    prediction = solve(Scene(friction=Friction(0.4), loading=Loading(1.5, "none")))
    assert "stick" in prediction.skin.state
    assert prediction.tangential_force > 0.0
    assert prediction.audits["equilibrium_x"] < 1e-8


def test_work_put_in_by_deeper_pressing_is_the_normal_force():
    """Without friction dW/dd = N: elastic energy U = 1/2 sum f u at d + h less that at d - h, by 2 h."""
    step = 1e-3
    deep, mid, shallow = solve_many(
        [Scene(friction=Friction(0.0), loading=Loading(d, "none")) for d in (1.0 + step, 1.0, 1.0 - step)]
    )

    def elastic_energy(p):
        forces = p.skin.pressure * skin_lengths(p.mesh)
        return 0.5 * forces @ p.displacement[p.mesh.skin, 1]

    assert (elastic_energy(deep) - elastic_energy(shallow)) / (2 * step) == pytest.approx(mid.normal_force, rel=1e-5)


def test_where_the_drag_wedges_the_finger_in_there_is_no_number_but_a_limit():
    wedged = Scene(friction=Friction(2.0), loading=Loading(2.0, "+x"), solve=Solve(tolerance=0.5))
    with pytest.raises(NoSteadyState, match="wedges") as refusal:
        solve(wedged)
    limit = refusal.value.limit_mu
    assert limit is not None
    assert 1.0 < limit < 1.6
    solve(replace(wedged, friction=Friction(0.97 * limit)))
    document = refusal.value.to_dict()["error"]
    assert document["kind"] == "no_steady_state"
    assert document["limit_mu"] == limit
    assert json.loads(json.dumps(document)) == document


def test_a_bound_lets_even_the_stickiest_surface_slide():
    prediction = solve(Scene(friction=Friction(1000.0, 0.005), loading=Loading(1.5, "-x")))
    assert set(prediction.skin.state) <= {"open", "cap", "slip"}
    assert prediction.audits["cone_violation"] < 1e-10


any_scene = given(
    depth=st.floats(-4, 0.4).map(lambda power: 10**power),
    mu=st.sampled_from([0.0, 1e-9, 0.3, 0.7, 1.5, 1000.0]),
    bound=st.sampled_from([None, 0.0, 1e-9, 0.005, 0.05, 1e9]),
    slide=st.sampled_from(["+x", "-x", "none"]),
    angle=st.floats(15, 85),
    nu=st.sampled_from([0.0, 0.3, 0.48, 0.4999999]),
    course=st.sampled_from(["steady", "steady", "history"]),
)


@settings(deadline=None, max_examples=5, derandomize=True)
@any_scene
def test_any_scene_ends_in_a_balanced_answer_or_in_a_sentence(**sample):
    balanced_or_refused(**sample)


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@any_scene
def test_sixty_scenes_end_in_balanced_answers_or_in_sentences(**sample):
    balanced_or_refused(**sample)


def balanced_or_refused(depth, mu, bound, slide, angle, nu, course):
    sample = Scene(
        finger=Finger(contact_angle=angle),
        materials=Materials(Material(0.136, nu), Material(0.08, nu), Material(0.034, nu)),
        friction=Friction(mu, bound),
        loading=Loading(depth, slide),
        solve=Solve(course=course),
    )
    (result,) = solve_many([sample])
    if isinstance(result, SolveFailure):
        assert str(result).endswith(".")
        assert mu > 0.7 or "round-off" in str(result)  # a state exists below, and is not refused
        json.dumps(result.to_dict(), allow_nan=False)
        return
    json.dumps(result.to_dict(), allow_nan=False)
    assert result.sed_ending > 0.0
    assert result.error_estimate > 0.0
    assert result.audits["equilibrium_y"] < 1e-4
    assert result.audits["equilibrium_y"] < 1e-8 or result.warnings
    assert result.audits["cone_violation"] < 1e-9


def test_a_run_can_be_stopped():
    with pytest.raises(Cancelled):
        solve_many(scenes(), progress=lambda part: part < 0.35)
    assert len(solve_many(scenes()[:1], progress=lambda _: None)) == 1  # a listener that returns nothing stops nothing


def test_a_prediction_is_reported_as_plain_data_with_all_the_contract_asks_for(ten, histories):
    document = ten["stickiness 100"].to_dict()
    for name in (
        "sed_ending",
        "sed_point",
        "normal_force",
        "tangential_force",
        "contact_width",
        "error_estimate",
        "normal_force_error",
        "tangential_force_error",
        "dofs",
    ):
        assert document[name] == getattr(ten["stickiness 100"], name)
    assert {"newton_iterations", "wall_s", "setup_s", "row", "model", "audits"} <= set(document)
    assert len(document["row"]["arc"]) == len(document["row"]["sed"]) == 57
    assert document["row"]["arc"][0] == -8.0
    assert document["row"]["arc"][-1] == 6.0
    assert document["row"]["sed"][32] == pytest.approx(document["sed_ending"], rel=1e-12)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    history = histories[0].to_dict()
    columns = [history[name] for name in ("time", "bone_x", "bone_y")]
    assert {len(column) for column in columns} == {len(history["history"]["sed_ending"])}
    json.dumps(history, allow_nan=False)


def test_what_was_left_out_comes_with_numbers_of_this_scene(ten):
    sticky, slippery = (ten[n].model["left_out"] for n in ("stickiness 100", "slipperiness 100"))
    for name, entry in sticky.items():
        assert set(entry) == {"estimate", "from", "how"}
        assert entry["estimate"] is None or entry["estimate"] >= 0.0
        assert entry["from"] != slippery[name]["from"] or name == "inertia"  # which a settled slide has none of
    assert 1e-5 < sticky["bone compliance"]["estimate"] < 1e-2


def test_strains_too_large_for_small_strain_are_warned_of(ten):
    assert any("finite strain" in w for w in ten["stickiness 100"].warnings)
    shallow = solve(Scene(friction=Friction(0.1), loading=Loading(0.02, "+x")))
    assert not shallow.warnings


def test_a_finger_too_short_for_the_row_has_no_number_there():
    small = Finger(2.0, 0.3, 0.5, shaft_length=4.0, bone_radius=0.6, bone_centre=(-0.4, 0.3))
    receptor = Receptor(depth=0.7, ending=(0.1, 0.4))
    prediction = solve(Scene(finger=small, receptor=receptor, friction=Friction(0.2), loading=Loading(0.5, "+x")))
    assert np.isnan(prediction.row.sed[0])
    assert prediction.to_dict()["row"]["sed"][0] is None


def test_pictures_can_be_drawn_of_a_prediction(ten):
    prediction = ten["slipperiness 0"]
    picture = fields_of(prediction)
    assert picture.triangles.max() < len(picture.nodes)
    assert picture.sed.shape == (len(picture.nodes),)
    assert picture.sed.min() >= 0.0
    corners = picture.nodes[picture.triangles]
    assert picture.nodes[:, 1].min() > -1e-9  # nothing below the surface
    assert corners.shape[1:] == (3, 2)
    assert set(picture.outlines) == {"skin", "epidermis", "dermis", "bone"}
    assert len(picture.patch) > 4
