"""A settled sliding state is given only where there is one."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Finger, Friction, Loading, Material, Materials, NoSteadyState, Receptor, Scene, Solve, solve
from solver.contact import LoadState
from solver.continuation.existence import slide_on_branch
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.load_stepping import march, solve_full_slip
from solver.mesh.mesher import Sizing
from solver.response.finite_answers import Meshes, coarse_solution, refine
from tests.solver.finite_examples import published

TOWARDS_TIP = -1


SLOW = pytest.mark.slow


def refine_from_coarse(scene, depth, fineness):
    """Return the state of a scene on a mesh of `fineness`, begun on a coarse one."""
    meshes = Meshes()
    return refine(scene, fineness, coarse_solution(scene, depth, fineness, meshes), meshes)[0]


@pytest.mark.slow
def test_a_press_deep_into_the_tissue_is_refused_with_the_same_depth_as_one_a_little_too_deep():
    deepest = []
    for depth in (2.8, 3.4, 3.7):
        with pytest.raises(NoSteadyState) as refusal:
            solve(Scene(friction=Friction(0.2), loading=Loading(depth), solve=Solve("finite", tolerance=0.1)))
        deepest.append(refusal.value.limit_indentation)
    assert deepest == pytest.approx([deepest[0]] * 3, rel=0.03)
    assert deepest[0] < 2.8


def test_a_deep_press_without_friction_has_an_error_estimate_that_holds_for_a_finer_mesh_pressed_step_by_step():
    scene = Scene(friction=Friction(0.0), loading=Loading(3.3), solve=Solve("finite", tolerance=0.1, evidence="quick"))
    answer = solve(scene)
    fine = FiniteFinger.of(scene, Sizing(8.0, 3.3, margin=3.0))
    *_, pressed = march(fine.newton, [LoadState(depth, 0.0) for depth in np.linspace(0.1, 3.3, 33).tolist()])
    assert answer.error_estimate < 0.1
    assert any("pressed by 70 % of its tissue" in warning for warning in answer.warnings)
    assert answer.sed_ending == pytest.approx(fine.sed_ending(pressed.u), rel=answer.error_estimate)


@pytest.mark.slow
@pytest.mark.parametrize("mu", [0.0, 0.02])
def test_a_press_whose_skin_folds_without_friction_is_refused_with_the_depth_up_to_which_it_slides(mu):
    scene = Scene(friction=Friction(mu), loading=Loading(4.1), solve=Solve("finite", tolerance=0.1, evidence="quick"))
    with pytest.raises(NoSteadyState, match="the skin folds") as refusal:
        solve(scene)
    deepest = refusal.value.limit_indentation
    finger = FiniteFinger.of(scene, Sizing(8.0, 4.1, margin=3.0))
    depths = np.linspace(0.1, 0.95 * deepest, 40).tolist()
    *_, pressed = march(finger.newton, [LoadState(depth, mu, sense=TOWARDS_TIP) for depth in depths])
    assert finger.skin_compression(pressed).least_stretch == pytest.approx(0.60, abs=0.03)  # they fold at 0.54
    with pytest.raises(NoSteadyState) as again:
        solve(replace(scene, loading=Loading(1.06 * deepest)))
    assert again.value.limit_indentation == pytest.approx(deepest, rel=0.02)


@pytest.mark.parametrize(
    ("mu", "tau", "deepest"),
    [
        pytest.param(0.44, 0.015478, 1.85, marks=SLOW),
        pytest.param(0.48, 0.019038, 1.75, marks=SLOW),
        pytest.param(0.64, 0.049998, 1.45, marks=SLOW),
        pytest.param(0.67, 0.05255, 1.43, marks=SLOW),
    ],
)
def test_four_surfaces_have_no_settled_sliding_at_two_millimetres_and_the_refusal_says_how_far_they_have(
    mu, tau, deepest
):
    with pytest.raises(NoSteadyState, match="folds") as refusal:
        slide_on_branch(published(8), LoadState(2.0, mu, tau, TOWARDS_TIP))
    assert refusal.value.limit_mu == pytest.approx(0.373, rel=0.03)
    assert refusal.value.limit_indentation == pytest.approx(deepest, rel=0.03)


def test_a_sound_state_is_the_direct_one():
    finger = published(5)
    load = LoadState(1.5, 0.44, 0.03009, 1)
    state = slide_on_branch(finger, load)
    np.testing.assert_array_equal(state.u, solve_full_slip(finger.newton, load).u)


def test_friction_without_measure_is_the_bound_alone():
    finger = published(6)
    sed = [finger.sed_ending(slide_on_branch(finger, LoadState(1.0, mu, 0.005, 1)).u) for mu in (50.0, 1000.0)]
    assert sed[0] == pytest.approx(sed[1], rel=1e-3)


def test_a_bound_next_to_nothing_leaves_the_frictionless_state_whatever_the_coefficient():
    finger = published(5)
    sed = [
        finger.sed_ending(slide_on_branch(finger, LoadState(1.0, mu, tau, 1)).u)
        for mu, tau in ((0.0, np.inf), (1000.0, 1e-9))
    ]
    assert sed[0] == pytest.approx(sed[1], rel=1e-6)


@pytest.mark.parametrize("fineness", [7, pytest.param(11, marks=SLOW)])
@pytest.mark.parametrize(("depth", "tau", "sense"), [(0.01, 0.003, -1), (1e-6, 0.005, -1), (0.1, 0.01, 1)])
def test_skin_that_nearly_all_slips_at_the_bound_drags_with_the_bound_on_all_that_touches(depth, tau, sense, fineness):
    finger = published(fineness, depth)
    state = slide_on_branch(finger, LoadState(depth, 1000.0, tau, sense))
    touching = np.flatnonzero(state.touching)
    x = state.skin_positions(finger.newton.condensed)[:, 0]
    longest = x[min(touching[-1] + 1, len(x) - 1)] - x[max(touching[0] - 1, 0)]  # to the neighbours that do not touch
    assert tau * (x[touching[-1]] - x[touching[0]]) * 0.99 <= sense * state.force[0] <= tau * longest * 1.01


@pytest.mark.parametrize("depth", [1e-6, 1e-4, 1e-2])
def test_a_finger_that_barely_touches_has_an_answer(depth):
    state = slide_on_branch(published(5), LoadState(depth, 0.5, 0.01, 1))
    assert state.touching.any()
    assert state.force[1] > 0.0


def folding_scene(mu, tolerance=None):
    """Return a random scene whose skin folds at mu = 0.74 (`test_limit`)."""
    return Scene(
        finger=Finger(contact_angle=69.4),
        materials=Materials(*(Material(modulus, 0.48) for modulus in (0.1525, 0.0775, 0.0303))),
        friction=Friction(mu),
        loading=Loading(1.8, "+x"),
        solve=Solve("finite", tolerance=tolerance),
    )


@SLOW
@pytest.mark.parametrize("fineness", [7.0, 10.0, 14.0, 20.0, 24.0])
@pytest.mark.parametrize("mu", [0.8, 0.85, 0.9])
def test_beyond_the_fold_every_mesh_refuses_also_where_it_has_a_creased_state(mu, fineness):
    with pytest.raises(NoSteadyState):
        refine_from_coarse(folding_scene(mu), 1.8, fineness)


@SLOW
def test_every_mesh_has_the_state_below_the_fold_on_the_same_branch():
    solutions = [refine_from_coarse(folding_scene(0.71), 1.8, fineness) for fineness in (7.0, 10.0, 14.0, 20.0)]
    np.testing.assert_allclose([s.finger.sed_ending(s.state.u) for s in solutions], 0.00286, rtol=0.01)


@SLOW
def test_answers_near_the_largest_friction_say_so_and_refusals_name_it():
    assert any("squeezed" in warning for warning in solve(folding_scene(0.735)).warnings)
    assert not any("squeezed" in warning for warning in solve(folding_scene(0.6)).warnings)
    with pytest.raises(NoSteadyState, match="folds") as refusal:
        solve(folding_scene(0.76))
    assert refusal.value.limit_mu == pytest.approx(0.735, rel=0.03)  # on a mesh of half the size


@pytest.mark.parametrize("fineness", [pytest.param(fineness, marks=SLOW) for fineness in (7.0, 11.0, 14.0)])
def test_a_fold_that_lies_where_meshes_are_coarse_is_seen_by_all_of_them(fineness):
    """Dragged from distal to proximal, a small finger folds where its tip ends; skin is squeezed to 0.54 there.

    Meshes of 7, 11 and 14 have 0.70, 0.67 and 0.65. On meshes made for the fold the state is lost at 0.875 to 0.888.
    """
    finger = Finger(
        tip_radius=2.5427,
        epidermis=0.2299,
        dermis=0.68397,
        shaft_length=5.1859,
        bone_radius=0.41,
        bone_centre=(-0.0554, 0.34236),
        contact_angle=50.374,
        cut="driven",
    )
    tissues = Materials(Material(0.17512, 0.48), Material(0.09348, 0.48), Material(0.03503, 0.48))

    def scene_at(mu):
        return Scene(
            finger=finger,
            materials=tissues,
            friction=Friction(mu),
            loading=Loading(1.0997, "-x"),
            receptor=Receptor(0.435, (0.1017, 0.1526)),
            solve=Solve("finite"),
        )

    assert refine_from_coarse(scene_at(0.84), 1.0997, fineness).state.touching.any()
    with pytest.raises(NoSteadyState) as refusal:
        refine_from_coarse(scene_at(0.91), 1.0997, fineness)
    assert refusal.value.limit_mu == pytest.approx(0.88, rel=0.03)
