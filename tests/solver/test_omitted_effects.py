"""Estimates of what the model leaves out, against their closed forms in the numbers of the answer."""

import math
from dataclasses import replace

import pytest
from scipy.integrate import quad

from solver import Friction, Loading, Material, Materials, Relaxation, Scene, Solve, solve
from solver.accuracy.omitted_effects import relaxing_scene
from solver.equilibrium.finger import settled_moduli

SLIDE = Scene(friction=Friction(0.3), loading=Loading(1.0, "+x"), solve=Solve(evidence="quick"))


@pytest.fixture(scope="module")
def prediction():
    return solve(SLIDE)


def estimate(answer, name):
    return answer.model["left_out"][name]["estimate"]


def test_the_bone_yields_under_the_force_on_it_as_a_bar_in_plane_strain(prediction):
    force = math.hypot(prediction.normal_force, prediction.tangential_force)
    bone = SLIDE.materials.bone
    assert estimate(prediction, "bone compliance") == pytest.approx(2.0 * force * (1.0 - bone.nu**2) / bone.E / 1.0)


def test_moving_tissue_presses_by_density_times_speed_squared_and_a_settled_slide_moves_none(prediction):
    assert estimate(prediction, "inertia") == 0.0
    course = solve(replace(SLIDE, solve=Solve("small", "history", evidence="quick")))
    pressure = course.normal_force / course.contact_width
    density = 1.1e-9  # N s2 / mm4: 1.1 g/cm3
    assert estimate(course, "inertia") == pytest.approx(2.0 * density * 15.0**2 / pressure)


def test_tissue_within_half_a_contact_width_of_a_side_is_softer_by_nu_squared(prediction):
    assert estimate(prediction, "the third dimension") == pytest.approx(0.48**2 * prediction.contact_width / 15.0)
    narrow = solve(replace(SLIDE, finger=replace(SLIDE.finger, width=1.0)))
    assert estimate(narrow, "the third dimension") == pytest.approx(0.48**2)


def test_a_slide_that_slips_throughout_forgets_its_history(prediction):
    assert estimate(prediction, "history") == 0.0
    press = solve(replace(SLIDE, loading=Loading(1.0, "none")))
    assert press.model["left_out"]["history"]["how"] == "the history was marched"


def test_tissue_that_is_taken_to_relax_comes_to_rest_with_the_moduli_of_the_scene():
    rest = settled_moduli(relaxing_scene(SLIDE).materials)
    for moduli, expected in zip(rest, settled_moduli(SLIDE.materials), strict=True):
        assert (moduli.shear, moduli.lame) == pytest.approx((expected.shear, expected.lame))
    compressible = Materials(Material(0.136, 0.1), SLIDE.materials.dermis, SLIDE.materials.fat)
    assert relaxing_scene(replace(SLIDE, materials=compressible)) is None  # of auxetic tissue at once


def test_relaxing_tissue_keeps_the_overstress_of_a_press_of_a_second_and_the_slide():
    part, time = 0.3, 0.4
    layers = (
        replace(layer, prony=(Relaxation(part, time),)) for layer in (Material(0.136, 0.48), Material(0.08, 0.48))
    )
    relaxing = solve(replace(SLIDE, materials=Materials(*layers)))
    slide = relaxing.model["left_out"]["viscosity"]["from"]["slide_s"]
    modulus = quad(lambda s: 1.0 - part + part * math.exp(-(1.0 + slide - s) / time), 0.0, 1.0)[0]
    assert estimate(relaxing, "viscosity") == pytest.approx((modulus / (1.0 - part)) ** 2 - 1.0)  # of an energy
