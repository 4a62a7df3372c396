"""Differences between surfaces that are solved together: their errors, and the warnings where these are large."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from solver import Finger, Friction, Loading, Material, Materials, Scene, Solve, solve_many
from solver.accuracy.error_estimate import compared_sets, contrast_error
from solver.scene.published import STICKINESS, scene

PUBLISHED = scene(STICKINESS[0])


def surface(numbers, nested, edges=(0.0, 0.0, 0.0, 0.0)):
    names = ("sed_ending", "normal_force", "tangential_force", "indentation")
    nested_numbers = SimpleNamespace(numbers=np.array(nested), edge_errors=np.zeros((2, 1, 4)))
    nested_numbers.edge_errors[1, 0] = edges
    return SimpleNamespace(scene=PUBLISHED, nested=nested_numbers, **dict(zip(names, numbers, strict=True)))


def test_what_halving_the_elements_changes_alike_in_all_surfaces_falls_out_of_their_differences():
    first, second = (1.0, 2.0, 0.5, 1.0), (1.2, 2.2, 0.7, 1.0)
    surfaces = [surface(numbers, np.array(numbers) + 0.3) for numbers in (first, second)]
    assert contrast_error(surfaces).share == pytest.approx(0.0, abs=1e-12)
    # four thirds of what it changes in their difference, by their range
    changed_surfaces = [surfaces[0], surface(second, np.add(second, [0.33, 0.3, 0.3, 0.3]))]
    assert contrast_error(changed_surfaces).share == pytest.approx(4.0 / 3.0 * 0.03 / 0.2)


def test_errors_by_edges_of_contact_of_two_surfaces_add_as_squares_in_their_difference():
    first, second = (1.0, 2.0, 0.5, 1.0), (1.2, 2.2, 0.7, 1.0)
    surfaces = [surface(first, first, (0.03, 0.0, 0.0, 0.0)), surface(second, second, (0.04, 0.0, 0.0, 0.0))]
    assert contrast_error(surfaces).share == pytest.approx(0.05 / 0.2)


@pytest.mark.parametrize(("change", "warns"), [(0.004, True), (0.0005, False)])
def test_of_forces_only_what_a_sensor_could_tell_is_warned_of(change, warns):
    first, second = (1.0, 1.0, 0.3, 2.0), (1.1, 1.01, 0.3, 2.0)
    error = contrast_error([surface(first, first), surface(second, np.add(second, [0.0, change, 0.0, 0.0]))])
    assert ("Differences in normal force" in error.warning) == warns


def test_variants_of_one_surface_and_surfaces_pressed_otherwise_are_not_told_apart():
    first, second = scene(STICKINESS[0]), scene(STICKINESS[2])
    deeper = replace(second, loading=Loading(1.0, "+x"))
    variant = replace(second, solve=Solve(evidence="quick"))
    assert compared_sets(dict(enumerate([first, deeper, variant, second]))) == [[0, 3]]
    assert compared_sets(dict(enumerate([first, deeper, variant, first]))) == []


# Three surfaces for one finger, whose normal forces (finite strain) or SED (small) differ by 2 and 0.6 %: indentation,
# contact angle, moduli, and for each surface mu, bound and the mean of three solves on far finer meshes.
SURFACES_ALIKE = {
    "finite": (
        1.9453824434540352,
        52.768285531663444,
        (0.12561350965518028, 0.10102004119009433, 0.03731941227568045),
        (
            (0.31708494247858965, 0.01876643849318715, (0.00377605525, 0.258807410, 0.0820639326)),
            (0.3775009024088661, None, (0.00342437463, 0.253646986, 0.0957519661)),
            (0.17302156508179378, None, (0.0111661969, 0.256314119, 0.0443478701)),
        ),
    ),
    "small": (
        0.9946963522975397,
        71.54826541385889,
        (0.17506644897696486, 0.0989132821156936, 0.03613420814511986),
        (
            (0.5566218765428702, 0.012322557398619328, (0.00289504299, 0.0730953659, 0.0406864797)),
            (0.5975862051326736, 0.007267728220609088, (0.00289523829, 0.0699444578, 0.0273257913)),
            (0.3909704583472945, None, (0.00291362589, 0.0699464803, 0.0273470074)),
        ),
    ),
}


def surfaces_alike(kinematics, tolerance, course="steady", contrast=None):
    """Return the surfaces, and the truth (3, 3) of them."""
    depth, angle, moduli, surfaces = SURFACES_ALIKE[kinematics]
    base = Scene(
        finger=Finger(contact_angle=angle),
        materials=Materials(*(Material(modulus, 0.48) for modulus in moduli)),
        friction=Friction(0.0),
        loading=Loading(depth, "+x"),
        solve=Solve(kinematics, course, tolerance=tolerance, contrast_tolerance=contrast),
    )
    return [replace(base, friction=Friction(mu, bound)) for mu, bound, _ in surfaces], np.array(
        [truth for _, _, truth in surfaces]
    )


@pytest.mark.parametrize("kinematics", SURFACES_ALIKE)
def test_differences_in_sed_between_surfaces_that_hardly_differ_are_as_good_as_is_asked_for(kinematics):
    surfaces, truth = surfaces_alike(kinematics, 0.01, contrast=0.03)
    predictions = solve_many(surfaces)
    seds = np.array([p.sed_ending for p in predictions])
    assert np.ptp(seds - truth[:, 0]) < 0.03 * np.ptp(truth[:, 0])


def test_surfaces_that_nobody_asked_to_tell_apart_say_in_what_and_by_how_much_they_may_be_off():
    surfaces, truth = surfaces_alike("small", 0.01)
    predictions = solve_many(surfaces)
    seds = np.array([p.sed_ending for p in predictions])
    error = np.ptp(seds - truth[:, 0]) / np.ptp(truth[:, 0])
    (warning,) = {w for p in predictions for w in p.warnings if w.startswith("Differences in")}
    assert "more than all" in warning or 100.0 * error < float(warning.split(" may be off by ")[1].split(" %")[0])
    quick_predictions = solve_many([replace(s, solve=Solve(evidence="quick")) for s in surfaces])
    assert not [w for p in quick_predictions for w in p.warnings if w.startswith("Differences")]


@pytest.mark.slow
def test_courses_of_surfaces_that_hardly_differ_are_marched_and_reported_once_on_a_mesh_that_tells_them_apart():
    surfaces, truth = surfaces_alike("small", None, "history", 0.05)
    numbers = []
    predictions = solve_many(surfaces, watch=lambda number, *_: numbers.append(number))
    assert numbers == [0, 1, 2]
    seds = np.array([p.sed_ending for p in predictions])
    assert np.ptp(seds - truth[:, 0]) < 0.05 * np.ptp(truth[:, 0])
