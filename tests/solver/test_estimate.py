"""Error estimates lie above the errors and near them, and a tolerance is met."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Finger, Friction, Loading, Material, Materials, Receptor, Relaxation, Scene, Solve, solve
from solver.accuracy.convergence_order import local_excess, trial_warnings
from solver.accuracy.error_estimate import WIDTH, edge_errors, errors, half_width
from solver.continuation.small_states import expected_depth, nearest_state, settled_state
from solver.equilibrium import EQUILIBRIUM
from solver.equilibrium.finger import LinearFinger
from solver.mesh.mesher import Sizing
from solver.prediction import COUNT, NestedNumbers
from solver.scene.published import STICKINESS, scene
from solver.verification.fine_meshes import fine_numbers, numbers_on_mesh
from solver.verification.random_scenes import random_scene
from tests.solver.drawn_scenes import DECEIVING, HELD_OUT, RANDOM


def scene_of(depth, mu, bound, slide, angle, moduli, settings=None):
    """Return the scene of an indentation [mm], friction, its bound, a slide, an angle and three moduli [MPa]."""
    return Scene(
        finger=Finger(contact_angle=angle),
        materials=Materials(*(Material(modulus, 0.48) for modulus in moduli)),
        friction=Friction(mu, bound),
        loading=Loading(depth, slide),
        solve=settings or Solve(),
    )


def errors_and_estimates(prediction, truth):
    """Return the relative errors of SED and forces, and their estimates (3,)."""
    numbers = np.array([prediction.sed_ending, prediction.normal_force, prediction.tangential_force])
    estimates = np.array([prediction.error_estimate, prediction.normal_force_error, prediction.tangential_force_error])
    return np.abs(numbers / truth - 1.0), estimates


def solve_and_judge(scene, truth):
    """Solve a scene whose estimates must hold; return of each number whether its estimate is below ten errors."""
    true_errors, estimates = errors_and_estimates(solve(scene), truth)
    assert np.all(true_errors <= estimates)
    return (estimates < 10.0 * np.maximum(true_errors, 2e-4)).tolist()


@pytest.mark.slow
def test_estimates_lie_above_the_errors_of_scenes_drawn_at_random_and_mostly_below_ten_times_them():
    close: list[bool] = []
    for *numbers, truth in RANDOM:
        close += solve_and_judge(scene_of(*numbers), truth)
    assert np.mean(close) >= 0.75


@pytest.mark.parametrize(  # SED: meshes of 23 to 40; without small elements there, 40 is 0.03 % below
    ("depth", "ending", "truth"),
    [
        (1.425, (0.0035, 0.0017), 2.1443e-3),
        pytest.param(1.9, (0.001, 0.001), 3.0087e-3, marks=pytest.mark.slow),
    ],
)
def test_an_ending_that_is_hardly_more_than_a_point_is_as_true_as_any_and_its_estimate_lies_above(depth, ending, truth):
    scene = Scene(friction=Friction(0.6), loading=Loading(1.0), receptor=Receptor(depth, ending))
    prediction = solve(replace(scene, solve=Solve(evidence="quick")))
    assert abs(prediction.sed_ending / truth - 1.0) <= prediction.error_estimate <= 0.003


def test_a_drag_that_cannot_be_is_exactly_none():
    prediction = solve(Scene(friction=Friction(0.0), loading=Loading(1.0, "+x")))
    assert prediction.tangential_force == 0.0
    assert prediction.tangential_force_error == 0.0
    assert 0.0 < prediction.normal_force_error < 0.01


@pytest.mark.parametrize("tolerance", [0.01, 0.003, 0.001])
def test_the_tolerance_is_met_with_no_more_work_than_it_needs(tolerance):
    strict_scene = replace(scene(STICKINESS[4]), solve=Solve(tolerance=tolerance))
    prediction = solve(strict_scene)
    assert prediction.error_estimate <= tolerance
    assert abs(prediction.sed_ending / 0.009553 - 1.0) < max(tolerance, 0.0015)  # the reference is good to 0.1 %
    assert prediction.dofs < {0.01: 2500, 0.003: 8000, 0.001: 30000}[tolerance]


def test_an_error_that_falls_with_the_square_of_an_element_is_known_and_edges_add_a_share_of_what_a_node_changes():
    sliding = Scene(friction=Friction(0.3), loading=Loading(1.0))
    truth, error = np.ones(COUNT), 0.04
    zeros = np.zeros((2, 1, COUNT))
    edges = edge_errors(np.full((2, COUNT), 0.012), np.full((2, COUNT), 0.005), linear=[WIDTH])
    nested = NestedNumbers(truth * (1.0 + error / 4.0), zeros, zeros, zeros, np.zeros(COUNT), 0.0)
    estimate = errors(sliding, truth * (1.0 + error), nested, None)
    assert estimate.error_estimate == pytest.approx(error / (1.0 + error), rel=1e-12)
    assert estimate.corrected_error == pytest.approx(error / 4.0 / (1.0 + error / 4.0), rel=1e-12)
    with_edges = errors(sliding, truth * (1.0 + error), replace(nested, edge_errors=edges), None)
    assert with_edges.error_estimate - estimate.error_estimate == pytest.approx(0.01 / 3.0 / 1.04, rel=1e-12)
    assert with_edges.corrected_error - estimate.corrected_error == pytest.approx(0.01 / 3.0 / 1.01, rel=1e-12)
    widths = with_edges.contact_width_error, estimate.contact_width_error
    by_both = 2.0 * (0.01 / 3.0 + 0.024 / 12.0)  # it follows an edge by a line
    assert widths[0] - widths[1] == pytest.approx(by_both / 1.04, rel=1e-12)
    for name, response in estimate.responses.items():
        assert with_edges.responses[name].error - response.error == pytest.approx(0.01 / 3.0, rel=1e-12)


def test_errors_of_second_order_and_edges_at_any_place_lie_below_the_estimate_and_some_come_near():
    rng, largest = np.random.default_rng(5), 0.0
    for _ in range(20000):
        series, changes = rng.normal(), rng.exponential(size=2)  # error but for an edge; changes as it moves by a node
        on_mesh, on_nested = changes * (rng.uniform(size=2) / 2.0) ** 2  # from an edge up to half a node away
        value, nested = series + on_mesh, series / 4.0 + on_nested
        bound = half_width(np.array([nested - value]), edge_errors(*changes[:, None, None]))[0]
        largest = max(largest, abs(value) / bound, abs(nested) / (bound - abs(nested - value)))
    assert 0.9 < largest <= 1.0 + 1e-12


def test_parts_of_an_error_that_cancel_in_the_change_and_fall_at_different_rates_lie_below_the_bound():
    rng, largest = np.random.default_rng(6), 0.0
    for _ in range(20000):
        *_, corner = parts = rng.normal(size=3)  # of the change
        most = np.array([4 / 3, 4 / 3, 2.0])  # errors by parts of the second order, and of the first at a corner
        error = abs(float(parts @ (1.0 + rng.integers(0, 2, 3) * (most - 1.0))))
        bound = abs(parts.sum()) + local_excess(parts[:, None], np.abs([corner]))[0]
        largest = max(largest, error / bound)
    assert 0.99 < largest <= 1.0 + 1e-12


def test_an_error_that_cancels_in_the_change_lies_below_the_estimate():
    sliding = random_scene("fingers", 44004, "finite")
    truth = 0.00260875  # SED on two meshes of 40 elements to a tip radius and a refined one, which differ by 0.03 %
    prediction = solve(replace(sliding, solve=replace(sliding.solve, tolerance=0.003, evidence="quick")))
    nested, error = prediction.nested, abs(prediction.sed_ending - truth)
    change = abs(nested.numbers[0] - prediction.sed_ending)
    by_change = half_width(change, nested.edge_errors[..., 0])
    assert by_change < error < prediction.error_estimate * prediction.sed_ending


def test_the_sed_follows_an_edge_of_contact_by_a_parabola_about_a_place_within_half_a_node():
    """The states of contact are changed by hand, and the linearised body solved under each; no estimate has a part."""
    ratios, places = [], []
    for number in range(40, 52):
        sample = random_scene("axis", number, "small")
        finger = LinearFinger.of(sample, Sizing(8.0, expected_depth(sample), margin=4.0))
        state, newton = nearest_state(sample, finger), finger.newton
        x = np.ascontiguousarray(state.skin_positions(newton.condensed)[:, 0])
        newton.linearise(state, x, 0, None)

        def sed_change(edge, nodes, state=state, newton=newton, x=x, finger=finger):
            contact, sense = state.state.copy(), state.sense.copy()
            moved_nodes, source = (
                (slice(edge + 1, edge + 1 + nodes), edge)
                if nodes > 0
                else (slice(edge + 1 + nodes, edge + 1), edge + 1)
            )
            contact[moved_nodes], sense[moved_nodes] = contact[source], sense[source]
            guess = replace(state, state=contact, sense=sense)
            assert newton.solve_contact(guess, x, 0, None) >= 0
            new_state = newton.apply_step(guess, state.load, newton.steps[:, EQUILIBRIUM].copy(), x)[0]
            return finger.numbers([new_state])[0, 0] - finger.numbers([state])[0, 0]

        for edge in np.flatnonzero(np.diff(state.touching.astype(int))).tolist():
            two_back, back, on, two_on = (sed_change(edge, nodes) for nodes in (-2, -1, 1, 2))
            ratios.append((two_back + two_on) / (back + on))
            places.append((back - on) / (2.0 * (back + on)))
    assert len(ratios) >= 20
    assert np.median(ratios) == pytest.approx(4.0, rel=0.2)  # twice as far off, four times the change
    assert np.percentile(np.abs(places), 75) <= 0.5


def test_estimates_of_the_row_lie_above_its_errors_beneath_the_edges_of_contact_too():
    sliding = Scene(friction=Friction(0.35), loading=Loading(1.3, "+x"), finger=Finger(contact_angle=52.0))
    prediction = solve(replace(sliding, solve=Solve(tolerance=0.02, evidence="quick")))
    fine = LinearFinger.of(sliding, Sizing(24.0, 1.3, margin=4.0))
    truth = fine.row.average(fine.displacement(settled_state(sliding, fine)))
    finite = np.isfinite(truth)
    assert finite.sum() >= 40
    row_errors = np.abs(prediction.row.sed - truth)[finite]
    assert np.mean(row_errors <= (prediction.row.error * prediction.row.sed)[finite]) >= 0.95
    # What halving changes would not do: it says nothing of where contact ends.
    assert np.mean(row_errors <= (4 / 3 * np.abs(prediction.nested.row - prediction.row.sed))[finite]) < 0.95


def row_error_ratios(sliding, tolerance, fine_tolerance):
    """Return the errors of receptors near the contact by their estimates, and by those from the changes alone."""
    rough, fine = (
        solve(replace(sliding, solve=replace(sliding.solve, tolerance=each, evidence="quick")))
        for each in (tolerance, fine_tolerance)
    )
    near = rough.row.sed > 0.1 * np.nanmax(rough.row.sed)
    assert near.sum() >= 20
    error = np.abs(rough.row.sed - fine.nested.row)
    by_change = half_width(rough.nested.row - rough.row.sed, rough.nested.row_edge_errors)
    return (error / (rough.row.error * rough.row.sed))[near], (error / by_change)[near]


def test_estimates_of_the_row_hold_what_cancels_in_its_changes_between_two_meshes():
    ratios, by_change = row_error_ratios(random_scene("fingers", 46011, "finite"), 0.01, 0.0007)
    assert np.all(ratios <= 1.0)
    assert np.mean(by_change <= 1.0) < 0.9


@pytest.mark.parametrize("number", [46021, 46027])
def test_where_a_receptor_s_change_passes_zero_its_estimate_keeps_the_size_of_the_errors_around(number):
    ratios, by_change = row_error_ratios(random_scene("stiff", number, "small"), 0.003, 0.0001)
    assert np.max(by_change) > 15.0
    assert np.max(ratios) < 3.0


def test_where_the_nested_mesh_has_no_state_nothing_is_known():
    estimate = errors(Scene(friction=Friction(0.3), loading=Loading(1.0)), np.ones(COUNT), None, None)
    assert estimate[:5] == (1.0, 1.0, 1.0, 1.0, 1.0)
    assert estimate.shift_error is None


@pytest.mark.parametrize("kinematics", ["small", pytest.param("finite", marks=pytest.mark.slow)])
def test_the_nested_value_is_nearer_the_truth_than_the_meshs_own(kinematics):
    sticky = replace(scene(STICKINESS[0]), solve=Solve(kinematics))
    truth = STICKS_LEAST if kinematics == "finite" else float(numbers_on_mesh([sticky], 26.0, shift=False)[0, 0])
    predictions = [solve(replace(sticky, solve=Solve(kinematics, tolerance=t))) for t in (0.02, 0.01, 0.005, 0.003)]
    ratios = [abs(p.sed_ending_corrected / truth - 1.0) / abs(p.sed_ending / truth - 1.0) for p in predictions]
    assert np.median(ratios) < 0.5
    assert max(ratios) < 1.0


@pytest.mark.parametrize(
    ("case", "tolerance"),
    [
        pytest.param(DECEIVING[0], None, id="layers"),
        pytest.param(DECEIVING[0], 0.01, id="layers, 1 %", marks=pytest.mark.slow),
        pytest.param(DECEIVING[1], None, id="bound"),
        pytest.param(DECEIVING[1], 0.01, id="bound, 1 %", marks=pytest.mark.slow),
    ],
)
def test_at_finite_strain_estimates_see_layers_in_the_fat_and_the_bound_at_the_edges_of_contact(case, tolerance):
    *numbers, truth = case
    prediction = solve(scene_of(*numbers, Solve("finite", tolerance=tolerance)))
    true_errors, estimates = errors_and_estimates(prediction, truth)
    assert np.all(true_errors <= estimates)
    assert tolerance is None or prediction.error_estimate <= tolerance


STICKS_LEAST = 0.0096274  # SED of stickiness 0, on meshes of 17, 23 and 26 with lines at the edges of contact


@pytest.mark.parametrize("tolerance", [0.003, None])
def test_a_tolerance_that_is_missed_is_named_whether_it_was_asked_for_or_not(tolerance):
    tiny = Scene(
        friction=Friction(0.3), loading=Loading(1e-6, "+x"), solve=Solve(tolerance=tolerance, evidence="quick")
    )
    answer = solve(tiny)
    assert answer.error_estimate > 0.003
    assert "The finest mesh leaves an error estimate above the tolerance, 0.3 %." in answer.warnings


def test_the_law_of_a_bone_without_elements_changes_nothing():
    sliding = Scene(friction=Friction(0.2), loading=Loading(0.5), solve=Solve("finite", evidence="quick"))
    bone = replace(sliding.materials.bone, law="ogden")
    other = solve(replace(sliding, materials=replace(sliding.materials, bone=bone)))
    usual = solve(sliding)
    assert (other.sed_ending, other.error_estimate) == (usual.sed_ending, usual.error_estimate)


def test_a_bound_far_from_the_edges_of_contact_keeps_no_tolerance_from_being_met():
    published = scene(STICKINESS[0])
    held = replace(published, finger=replace(published.finger, cut="driven"))  # a free cut nearly folds under this drag
    prediction, finer = (solve(replace(held, solve=Solve("finite", tolerance=error))) for error in (0.003, 0.001))
    assert prediction.error_estimate <= 0.003
    assert prediction.dofs < 11000  # half of the finest mesh's
    assert prediction.sed_ending == pytest.approx(finer.sed_ending, rel=0.003)


@pytest.mark.parametrize("kinematics", ["small", pytest.param("finite", marks=pytest.mark.slow)])
def test_estimates_lie_above_the_errors_of_scenes_that_nothing_was_chosen_on_and_mostly_below_ten_times_them(
    kinematics,
):
    close: list[bool] = []
    for kind, *numbers, truth in HELD_OUT:
        if kind == kinematics:
            close += solve_and_judge(scene_of(*numbers, Solve(kind)), truth)
    assert np.mean(close) >= 0.75


def test_skin_so_stiff_that_one_node_touches_is_estimated_by_contact_that_grows_not_by_contact_lost():
    skin = Materials(Material(640.0, 0.48), Material(4.0, 0.48), Material(0.034, 0.48))
    scene = Scene(materials=skin, friction=Friction(0.3), loading=Loading(0.6, "+x"), solve=Solve(tolerance=0.5))
    prediction = solve(scene)
    assert sum(state != "open" for state in prediction.skin.state) == 1
    truth = fine_numbers([scene])[:, 0, 0]
    true_error = abs(prediction.sed_ending / truth.mean() - 1.0)
    assert true_error <= prediction.error_estimate < 10.0 * max(true_error, 2e-4)


@pytest.mark.parametrize(
    ("dermis", "words"),
    [(0.08, ""), (3.4, ""), (68.0, "dermis is 2,000 times as stiff as the fat"), (1e-4, "epidermis is 1,400 times")],
)
def test_an_answer_warns_where_no_trial_of_the_estimates_had_tissues_so_different(dermis, words):
    materials = Materials(dermis=Material(dermis, 0.48))
    prediction = solve(Scene(materials=materials, friction=Friction(0.3), loading=Loading(0.5, "+x")))
    warnings = [warning for warning in prediction.warnings if "times as stiff" in warning]
    assert len(warnings) == bool(words)
    assert words in "".join(warnings)


def test_the_error_at_a_corner_of_very_stiff_tissue_is_of_first_order_and_the_estimate_lies_above_it():
    scene = random_scene("extreme", 204, "small")  # a dermis 130 times as stiff as the fat
    truth = float(fine_numbers([scene])[:, 0, 0].mean())
    prediction = solve(replace(scene, solve=replace(scene.solve, tolerance=0.01)))
    error = abs(prediction.sed_ending / truth - 1.0)
    assert 4 / 3 * abs(prediction.nested.numbers[0] / prediction.sed_ending - 1.0) < error < prediction.error_estimate


def test_presses_deeper_than_half_of_the_tissue_at_finite_strain_warn_that_estimates_were_not_tried_there():
    for kinematics, depth, count in (("finite", 2.3, 0), ("finite", 2.4, 1), ("small", 2.4, 0)):
        scene = Scene(friction=Friction(0.0), loading=Loading(0.5, "none"), solve=Solve(kinematics))  # 4.74 mm thick
        assert len([*trial_warnings(scene, depth)]) == count


def test_tissues_that_relax_warn_of_a_difference_in_stiffness_as_the_elastic_ones_that_they_relax_to():
    # With half its shear modulus relaxed, G = 0.08 and K = 0.1 MPa become G = 0.04 and K = 0.1: E = 0.105882.
    relaxing = Material(9.0 * 0.08 * 0.1 / 0.38, 0.14 / 0.76, prony=(Relaxation(0.5, 1.0),))
    elastic = Material(9.0 * 0.04 * 0.1 / 0.34, 0.22 / 0.68)
    scenes = [
        Scene(materials=Materials(Material(12.0, 0.3), dermis), friction=Friction(0.3), loading=Loading(0.5, "+x"))
        for dermis in (relaxing, elastic)
    ]
    assert [*trial_warnings(scenes[0], 1.0)] == [*trial_warnings(scenes[1], 1.0)] != []
