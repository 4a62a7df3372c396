"""States that tissue would leave: columns that buckle and layers that wrinkle."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from solver import Finger, Friction, Loading, Material, Materials, Scene, Solve, solve
from solver.body.finite import FiniteBody
from solver.constitutive import NeoHooke
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.load_stepping import march
from solver.mesh import block

LENGTH, THICKNESS = 10.0, 1.0
STRAIN = pi**2 / 12.0 * (THICKNESS / LENGTH) ** 2  # Euler's: the ends keep their direction, one is free to move


@pytest.mark.parametrize(("part", "stable"), [(0.5, True), (0.93, True), (1.05, False)])
def test_a_straight_column_is_stable_up_to_eulers_load_if_its_end_may_slide(part, stable):
    mesh = block(np.linspace(0.0, THICKNESS, 3), np.linspace(0.0, LENGTH, 21))
    newton = Newton(FiniteBody.of(mesh, [NeoHooke(0.1, 0.3)]).condensed)
    (state,) = march(newton, [LoadState(part * STRAIN * LENGTH, 0.0)])
    assert newton.is_stable(state) == stable


def test_a_column_whose_end_sticks_carries_four_times_as_much():
    mesh = block(np.linspace(0.0, THICKNESS, 3), np.linspace(0.0, LENGTH, 21))
    newton = Newton(FiniteBody.of(mesh, [NeoHooke(0.1, 0.3)]).condensed)
    start = EquilibriumState.undeformed(newton.condensed, LoadState(0.0, 10.0))
    loads = [LoadState(part * STRAIN * LENGTH, 10.0) for part in (3.0, 4.3)]
    assert [newton.is_stable(state) for state in march(newton, loads, start)] == [True, False]


def test_a_thin_stiff_layer_that_wrinkles_on_a_fine_mesh_leaves_a_coarse_answer_and_says_so():
    """A layer on a base wrinkles at 0.52 of the power 2/3 of their stiffness' ratio (Allen 1969): at 2.6 % here."""
    scene = Scene(
        finger=Finger(epidermis=0.06, dermis=1.94),
        materials=Materials(epidermis=Material(7.2, 0.48)),
        friction=Friction(0.35),
        loading=Loading(1.5, "+x"),
        solve=Solve("finite", tolerance=0.02),
    )
    answer = solve(scene)
    assert any("unstable, like a stiff layer that wrinkles" in warning for warning in answer.warnings)
    usual = solve(replace(scene, finger=Finger(), materials=Materials()))
    assert not any("unstable" in warning for warning in usual.warnings)
