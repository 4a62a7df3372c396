"""Error estimates lie above the errors and near them, and a tolerance is met."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from solver.accuracy.finite_errors import error_estimates

from solver import Finger, Friction, Loading, Material, Materials, Receptor, Scene, Solve, solve
from solver.accuracy.adaptivity import nested_solution, solution_on
from solver.accuracy.error_estimate import DEFAULT, FINENESS, coarsest_for, estimates
from solver.mesh.mesher import AT_CUT
from solver.scene.published import STICKINESS, scene
from tests.solver.drawn_scenes import DRAWN, HELD_OUT


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_a_receptor_elsewhere_than_the_published_one_has_no_mesh_coarser_than_the_usual_one(kinematics):
    asked = Scene(friction=Friction(0.3), loading=Loading(1.0), solve=Solve(kinematics, tolerance=0.05))
    assert coarsest_for(asked, 0.05) < DEFAULT[kinematics]
    assert coarsest_for(replace(asked, receptor=Receptor(1.0)), 0.05) == DEFAULT[kinematics]
    larger = Finger(10.0, 1.5, 2.5, 30.0, 3.0, (-2.0, 1.5))  # twice the published one in all lengths
    same = replace(asked, finger=larger, receptor=Receptor(3.8, (0.4, 2.0)))
    assert coarsest_for(same, 0.05) < DEFAULT[kinematics]


@pytest.mark.slow
def test_estimates_lie_above_the_errors_of_scenes_drawn_at_random_and_mostly_below_ten_times_them():
    close: list[bool] = []
    for depth, mu, bound, slide, angle, moduli, truth in DRAWN:
        asked = Scene(
            finger=Finger(contact_angle=angle),
            materials=Materials(*(Material(modulus, 0.48) for modulus in moduli)),
            friction=Friction(mu, bound),
            loading=Loading(depth, slide),
        )
        found = solve(asked)
        numbers = np.array([found.sed_ending, found.normal_force, found.tangential_force])
        estimates = np.array([found.error_estimate, found.normal_force_error, found.tangential_force_error])
        errors = np.abs(numbers / truth - 1.0)
        assert np.all(errors <= estimates)
        close.extend((estimates < 10.0 * np.maximum(errors, 2e-4)).tolist())
    assert np.mean(close) >= 0.75


@pytest.mark.parametrize(  # SED: meshes of 23 to 40; without small elements there, 40 is 0.03 % below
    ("depth", "ending", "truth"),
    [
        (1.425, (0.0035, 0.0017), 2.1443e-3),
        pytest.param(1.9, (0.001, 0.001), 3.0087e-3, marks=pytest.mark.slow),
    ],
)
def test_an_ending_that_is_hardly_more_than_a_point_is_as_true_as_any_and_its_estimate_lies_above(depth, ending, truth):
    asked = Solve(evidence="quick")
    found = solve(Scene(friction=Friction(0.6), loading=Loading(1.0), receptor=Receptor(depth, ending), solve=asked))
    assert abs(found.sed_ending / truth - 1.0) <= found.error_estimate <= 0.002


def test_a_drag_that_cannot_be_is_exactly_none():
    found = solve(Scene(friction=Friction(0.0), loading=Loading(1.0, "+x")))
    assert found.tangential_force == 0.0
    assert found.tangential_force_error == 0.0
    assert 0.0 < found.normal_force_error < 0.01


@pytest.mark.parametrize("tolerance", [0.01, 0.003, 0.001])
def test_the_tolerance_is_met_with_no_more_work_than_it_needs(tolerance):
    asked = replace(scene(STICKINESS[4]), solve=Solve(tolerance=tolerance))
    found = solve(asked)
    assert found.error_estimate <= tolerance
    assert abs(found.sed_ending / 0.009553 - 1.0) < max(tolerance, 0.0015)  # the reference is good to 0.1 %
    assert found.dofs < {0.01: 2500, 0.003: 8000, 0.001: 30000}[tolerance]


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_what_no_mesh_changes_is_off_by_what_the_mesh_alone_decides_and_less_on_finer_ones(kinematics):
    asked = replace(scene(STICKINESS[0]), solve=Solve(kinematics))
    free = replace(asked, friction=Friction(0.3))
    numbers = np.array([1.0, 2.0, 0.6])
    found = [estimates(free, fineness, numbers, numbers[None]) for fineness in FINENESS[kinematics]]
    assert all((finer < coarser).all() for coarser, finer in pairwise(found))
    assert found[0][0] < 0.01
    assert estimates(free, 8.0, numbers * [1, 1, 0], numbers[None] * [1, 1, 0])[2] == 0.0
    assert coarsest_for(asked, 0.01) == FINENESS[kinematics][0]
    assert DEFAULT[kinematics] in FINENESS[kinematics]


def test_a_drag_below_the_friction_limit_is_known_to_a_part_of_an_element():
    bounded = replace(scene(STICKINESS[0]), friction=Friction(0.5, 0.01))
    numbers = np.array([1.0, 0.2, 0.05])
    free = replace(bounded, friction=Friction(0.5))
    with_bound, without = (estimates(scene, 8.0, numbers, numbers[None]) for scene in (bounded, free))
    # a fifth of an element of 0.5 x 5 / 8 mm under 0.01 MPa, by the drag, for a drag of half of mu N
    more = 0.2 * 0.5 * 0.01 * 0.3125 / 0.05
    assert with_bound == pytest.approx([*without[:2], np.hypot(without[2], more)])


def test_of_two_meshes_whose_errors_fall_with_the_square_of_an_element_the_estimate_knows_the_error():
    finite = replace(scene(STICKINESS[0]), friction=Friction(0.3), solve=Solve("finite"))
    truth, error = np.array([1.0, 2.0, 0.6]), 0.01
    own, coarser = truth * (1.0 + error), truth * (1.0 + error / 0.6**2)
    found = estimates(finite, 20.0, own, coarser[None])
    assert np.all(found * own >= error * truth)
    assert np.all(found < 1.01 * error)


# Published scenes of solver/verification/random_scenes.py at finite strain and others with low bounds: depth, mu,
# bound, slide, contact angle, moduli, and the mean of three solves on far finer meshes. Two meshes with lines at the
# same edges of contact agree on them and are wrong: 4 % off with three layers in the fat, 1.3 % off where the bound
# acts on a part of an element.
DECEIVING = (
    (
        1.99320910990755,
        0.5670427049329415,
        0.04581172098166008,
        "-x",
        36.29489091638562,
        (0.1074120661063343, 0.07798624984533795, 0.029127994577057028),
        (0.00100988, 0.11117694, 0.06304208),
    ),
    (
        1.8244161575188902,
        0.46395847982401955,
        0.00511502663592019,
        "+x",
        67.47383524256935,
        (0.15543655238990728, 0.06828896150165999, 0.039045860033311154),
        (0.00515991, 0.19396537, 0.03331597),
    ),
)


@pytest.mark.parametrize("tolerance", [pytest.param(0.01, marks=pytest.mark.slow), None])
@pytest.mark.parametrize("drawn", DECEIVING, ids=["layers", "bound"])
def test_at_finite_strain_estimates_see_layers_in_the_fat_and_the_bound_at_the_edges_of_contact(drawn, tolerance):
    depth, mu, bound, slide, angle, moduli, truth = drawn
    asked = Scene(
        finger=Finger(contact_angle=angle),
        materials=Materials(*(Material(modulus, 0.48) for modulus in moduli)),
        friction=Friction(mu, bound),
        loading=Loading(depth, slide),
        solve=Solve("finite", tolerance=tolerance),
    )
    found = solve(asked)
    numbers = np.array([found.sed_ending, found.normal_force, found.tangential_force])
    estimates = np.array([found.error_estimate, found.normal_force_error, found.tangential_force_error])
    assert np.all(np.abs(numbers / truth - 1.0) <= estimates)
    assert tolerance is None or found.error_estimate <= tolerance


STICKS_LEAST = (
    0.0096274  # SED of stickiness 0, on meshes of 17, 23 and 26, with the elements at the cut carried on to none
)


def test_a_bound_far_from_the_edges_of_contact_keeps_no_tolerance_from_being_met():
    found = solve(replace(scene(STICKINESS[0]), solve=Solve("finite", tolerance=0.003)))
    assert found.error_estimate <= 0.003
    assert found.dofs < 8000
    assert found.sed_ending == pytest.approx(STICKS_LEAST, rel=0.003)


def test_what_all_meshes_have_in_common_where_the_cut_meets_the_bone_is_part_of_the_estimate():
    sticks = replace(scene(STICKINESS[0]), solve=Solve("finite"))
    way_up = nested_solution(sticks, 2.0, 11.0, lambda: False)
    usual = solution_on(sticks, 11.0, replace(way_up.coarse, at_cut=AT_CUT), lambda: False)
    left: list[float] = []
    for top in (way_up.top, usual):
        numbers = top.finger.all_numbers(top.shape)
        found, _, stays = error_estimates(sticks, 11.0, replace(way_up, top=top), numbers, lambda: False)
        assert numbers[0] == pytest.approx(STICKS_LEAST, rel=found.sed)
        assert stays < found.sed
        left.append(stays)
    assert 2.0 * left[0] < left[1]


def test_where_no_mesh_meets_a_tolerance_for_the_corner_of_the_cut_no_finer_one_is_tried():
    squeezed = Scene(finger=Finger(contact_angle=31.0), friction=Friction(0.55), loading=Loading(1.5, "+x"))
    found = solve(replace(squeezed, solve=Solve("finite", tolerance=0.0018)))
    assert found.error_stays > 2.0 * 0.0018
    assert found.dofs < 5000  # fineness 11, the coarsest that might
    assert "Where the cut meets the bone" in found.warnings[-1]


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_estimates_lie_above_the_errors_of_scenes_that_nothing_was_chosen_on_and_mostly_below_ten_times_them(
    kinematics,
):
    close: list[bool] = []
    for kind, depth, mu, bound, slide, angle, moduli, truth in HELD_OUT:
        if kind != kinematics:
            continue
        asked = Scene(
            finger=Finger(contact_angle=angle),
            materials=Materials(*(Material(modulus, 0.48) for modulus in moduli)),
            friction=Friction(mu, bound),
            loading=Loading(depth, slide),
            solve=Solve(kind),
        )
        found = solve(asked)
        numbers = np.array([found.sed_ending, found.normal_force, found.tangential_force])
        estimates = np.array([found.error_estimate, found.normal_force_error, found.tangential_force_error])
        errors = np.abs(numbers / truth - 1.0)
        assert np.all(errors <= estimates)
        close.extend((estimates < 10.0 * np.maximum(errors, 2e-4)).tolist())
    assert np.mean(close) >= 0.75
