"""How a press follows the stiffness of each tissue: against differences of whole solves, and N's linearity."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Materials, Scene, Solve, solve, solve_many
from solver.response.nearby import stiffness_shares

LAYERS = ("epidermis", "dermis", "fat")


def press(depth=1.0, mu=0.0, **factors):
    usual = Materials()
    tissues = {name: replace(usual.of(name), E=usual.of(name).E * factor) for name, factor in factors.items()}
    return Scene(
        materials=replace(usual, **tissues),
        friction=Friction(mu),
        loading=Loading(depth),
        solve=Solve(evidence="quick"),
    )


def test_shares_of_the_tissues_are_the_slopes_of_solved_forces_and_their_sum_is_one():
    shares = stiffness_shares([solve(press())])[0]
    step = 0.003
    for share, name in zip(shares, LAYERS, strict=False):
        up, down = (solve(press(**{name: np.exp(change)})).normal_force for change in (step, -step))
        assert share == pytest.approx(np.log(up / down) / (2 * step), rel=1e-4)
    assert shares[3] == 0.0  # the bone is rigid
    assert shares.sum() == pytest.approx(1.0, abs=1e-9)


def test_all_layers_twice_as_stiff_double_the_force_and_leave_the_shares():
    usual, stiff = solve_many([press()])[0], solve(press(epidermis=2.0, dermis=2.0, fat=2.0))
    assert stiff.normal_force == pytest.approx(2.0 * usual.normal_force, rel=1e-9)
    np.testing.assert_allclose(stiffness_shares([usual]), stiffness_shares([stiff]), atol=1e-9)


def test_a_press_with_friction_has_no_shares():
    with pytest.raises(ValueError, match="friction"):
        stiffness_shares([solve(press(mu=0.3))])
