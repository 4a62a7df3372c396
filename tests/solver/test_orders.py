"""Observed orders of convergence: the errors of a sequence of meshes fall as theory says, and no slower."""

import pytest

from solver.verification import orders


def orders_hold(rows):
    """Every row's order is at least what theory leads one to expect."""
    return {f"{row.problem}, {row.quantity}": row.order for row in rows if not row.order > row.least} == {}


def test_displacements_converge_with_order_3_stresses_with_2_and_energy_with_4():
    rows = list(orders.cylinders(quick=False))
    assert [row.quantity for row in rows] == ["displacement", "stress", "energy"] * 2
    assert orders_hold(rows)


def test_at_the_singular_corner_of_cook_s_membrane_the_order_is_that_of_the_singularity():
    """Clamped meets free at 108 degrees: the stress is infinite there, and no uniform mesh converges faster."""
    (row,) = orders.membranes(quick=False)
    assert all(error > 0.0 for error in row.errors)  # it rises from mesh to mesh
    assert 0.9 < row.order < 1.5


def test_the_force_of_a_contact_whose_edge_falls_anywhere_converges_with_order_2():
    """The root mean square over meshes of nearly one size, since a single one may be right by chance."""
    (row,) = orders.press_orders(quick=False)
    assert orders_hold([row])
    assert row.errors[-1] < 1e-4


def test_the_finger_s_energy_at_the_ending_converges_with_order_2():
    """The root mean square over shifted meshes of nearly one size, as for any contact whose edge falls anywhere."""
    rows = list(orders.fingers(quick=False, kinematics="small"))
    assert len(rows) == 2
    assert orders_hold(rows)
    assert all(row.errors[-1] < 5e-4 for row in rows)


@pytest.mark.slow
def test_at_finite_strain_it_converges_with_order_2_too():
    (row,) = orders.fingers(quick=False, kinematics="finite")
    assert orders_hold([row])
    assert row.errors[-1] < 2e-3


def test_the_slope_is_that_of_the_errors_and_not_of_their_size():
    assert orders.slope([0.4, 0.2, 0.1], [7e-3, 7e-3 / 8, 7e-3 / 64]) == pytest.approx(3.0)
    assert orders.slope([1.0, 0.5], [1.0, 1.0]) == 0.0
