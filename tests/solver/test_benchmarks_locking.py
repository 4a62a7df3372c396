"""Thick cylinder (MacNeal and Harder 1985, Finite Elem. Anal. Des. 1, 3) and Cook's membrane: no locking at any nu."""

import pytest

from solver.verification.published.locking import cook, hole_displacement, widening
from solver.verification.published.problems import COOK

PRINTED = {0.3: 4.582500e-3, 0.48: 5.017200e-3, 0.49: 5.039925e-3, 0.499: 5.060249e-3, 0.4999: 5.062275e-3}


@pytest.mark.parametrize("nu", [*PRINTED, 0.49999, 0.4999999])
def test_a_thick_cylinder_does_not_lock(nu):
    """Five elements across the wall, against the closed form, and that against its printed values."""
    if nu in PRINTED:
        assert widening(nu) == pytest.approx(PRINTED[nu], abs=5e-10)
    assert hole_displacement(nu, 5, 20) == pytest.approx(widening(nu), rel=2e-4)


@pytest.mark.parametrize("nu", [0.3, 0.4999999])
def test_even_two_elements_across_the_wall_of_a_cylinder_do_not_lock(nu):
    assert hole_displacement(nu, 2, 8) == pytest.approx(widening(nu), rel=5e-3)


@pytest.mark.parametrize("case", COOK, ids=lambda case: case[0])
def test_cook_s_membrane_rises_by_what_others_found(case):
    _, _, young, nu, force, middle, corner = case
    middle_rise, corner_rise = cook(young, nu, force, 32)
    assert middle_rise == pytest.approx(middle, rel=0.002)
    if corner is not None:
        assert corner_rise == pytest.approx(corner, rel=0.002)


def test_even_four_elements_along_cook_s_membrane_do_not_lock():
    assert cook(240.565, 0.4999, 100.0, 4)[0] == pytest.approx(7.693, rel=0.012)
