"""Contact problems whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from solver import ContactLost
from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.body.linear import LinearBody
from solver.constitutive import Hooke
from solver.contact import ForceLoad, LoadState
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.load_stepping import slide_from_guess, slide_under, solve_full_slip, solve_under_forces
from solver.mesh import block

RADIUS = 5.0


def test_a_part_of_the_way_to_a_load_is_that_part_of_the_way_of_each_quantity():
    begin, end = LoadState(1.0, 0.2, 0.04, 0, 3.0), LoadState(2.0, 0.6, 0.08, 1, -1.0)
    assert begin.towards(end, 0.25) == pytest.approx((1.25, 0.3, 0.05, 1, 2.0))
    assert begin.towards(end, 1.0) == end
    assert begin._replace(tau=np.inf).towards(end, 0.25).tau == 0.08  # taken whole
    assert begin.towards(end._replace(tau=np.inf), 0.25).tau == np.inf
    pull = ForceLoad(0.1, None, 2.0).towards(ForceLoad(0.3, 0.08, 6.0), 0.25)
    assert pull == pytest.approx((0.15, 0.02, 3.0))
    assert ForceLoad(0.1, 0.04).towards(ForceLoad(0.3, 0.08), 0.5).tangential == pytest.approx(0.06)
    assert ForceLoad(0.1, 0.04).towards(ForceLoad(0.3, None), 0.5).tangential is None


@pytest.mark.parametrize(
    ("load", "frictionless", "path_dependent"),
    [
        (LoadState(1.0, 0.0), True, False),
        (LoadState(1.0, 0.3, 0.0), True, False),
        (LoadState(1.0, 0.3), False, True),
        (LoadState(1.0, 0.3, sense=1), False, False),
        (LoadState(1.0, 0.3, 0.01), False, True),
    ],
)
def test_only_a_slide_and_a_press_without_friction_depend_on_no_path(load, frictionless, path_dependent):
    assert (load.frictionless, load.path_dependent) == (frictionless, path_dependent)


def cylinder(half_width: float, finest: float, nu: float = 0.48, zone: float = 0.9) -> LinearBody:
    """A soft round body, wide and deep against its contact, fine where it touches."""
    steps = [0.0]
    while steps[-1] < half_width:
        steps.append(steps[-1] + max(finest, 0.25 * (steps[-1] - zone)))
    half_lines = np.array(steps) * half_width / steps[-1]
    lines = np.concatenate([-half_lines[:0:-1], half_lines])
    heights = [0.0]
    while heights[-1] < 14.0:
        heights.append(heights[-1] + finest + 0.25 * heights[-1])
    return LinearBody.of(block(lines, np.array(heights) * 14.0 / heights[-1], RADIUS), [Hooke(0.08, nu)])


@pytest.fixture(scope="module")
def hertz_contact():
    """P = 0.01 N/mm on R = 5, E = 0.08, nu = 0.48: a = 0.782578 mm, p0 = 0.008135 MPa (Johnson 1985, ch. 4)."""
    body = cylinder(4.5, 0.06)
    return body, slide_under(Newton(body.condensed), LoadState(0.0, 0.0, sense=-1), 0.01)


def start_state(body, half_width=0.7):
    return np.where(np.abs(body.mesh.nodes[body.mesh.skin, 0]) < half_width, SLIP, OPEN)


def test_a_pressed_cylinder_touches_and_presses_as_hertz_says(hertz_contact):
    body, state = hertz_contact
    x = body.mesh.nodes[body.mesh.skin, 0]
    assert state.normal.sum() == pytest.approx(0.01, rel=1e-12)
    touching = x[state.touching]
    assert np.ptp(touching) / 2 == pytest.approx(0.782578, abs=0.031)  # half an element
    pressure = state.normal / body.condensed.fixed_length
    inside = np.abs(x) < 0.7
    hertz = 0.008135 * np.sqrt(1 - (x[inside] / 0.782578) ** 2)
    assert np.abs(pressure[inside] - hertz).max() < 0.02 * 0.008135
    assert pressure[len(x) // 2] == pytest.approx(0.008135, rel=0.01)


@pytest.mark.parametrize("k", [0.8, 0.6, 0.4])
def test_friction_with_a_bound_on_a_hertz_pressure_carries_the_closed_form(hertz_contact, k):
    """t = min(mu p, tau_max), k = tau_max/(mu p0): Q/(mu P) = 0.895912, 0.715243, 0.495368."""
    body, frictionless = hertz_contact
    mu = 0.02  # so small that the drag does not move the pressure
    load = LoadState(0.0, mu, k * mu * 0.008135, -1)
    state = slide_from_guess(Newton(body.condensed), load, frictionless.state, 0.01)
    exact = {0.8: 0.895912, 0.6: 0.715243, 0.4: 0.495368}[k]
    assert -state.tangential.sum() / (mu * 0.01) == pytest.approx(exact, rel=0.005)
    x = body.mesh.nodes[body.mesh.skin, 0]
    bounded = x[state.state == SHEAR_LIMITED]
    assert np.ptp(bounded) / 2 == pytest.approx(0.782578 * np.sqrt(1 - k**2), abs=0.035)


@pytest.mark.parametrize("tau_max", [np.inf, 1e-4, 0.0])
def test_the_short_way_to_settled_sliding_ends_where_steps_from_another_guess_do(hertz_contact, tau_max):
    newton, load = Newton(hertz_contact[0].condensed), LoadState(0.01, 0.4, tau_max, -1)
    guess = np.where(hertz_contact[0].condensed.rest[:, 1] < 0.02, SLIP, OPEN)
    direct, stepwise = solve_full_slip(newton, load), slide_from_guess(newton, load, guess)
    assert np.array_equal(direct.state, stepwise.state)
    assert (direct.state == SHEAR_LIMITED).any() == (tau_max < np.inf)
    for name in ("normal", "tangential", "u"):
        numbers, expected = getattr(direct, name), getattr(stepwise, name)
        np.testing.assert_allclose(numbers, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max() + 1e-300)


@pytest.mark.parametrize("mu", [0.1, 0.4])
def test_what_slides_without_a_bound_drags_by_mu_times_the_normal_force(mu):
    body = cylinder(4.5, 0.2)
    state = solve_full_slip(Newton(body.condensed), LoadState(0.1, mu, sense=-1))
    assert -state.tangential.sum() / state.normal.sum() == pytest.approx(mu, rel=1e-13)


def test_sliding_the_other_way_mirrors_the_forces_of_a_mirrored_body():
    body = cylinder(4.5, 0.2)
    forwards = solve_full_slip(Newton(body.condensed), LoadState(0.1, 0.3, sense=-1))
    backwards = solve_full_slip(Newton(body.condensed), LoadState(0.1, 0.3, sense=1))
    assert np.allclose(forwards.normal, backwards.normal[::-1], atol=1e-15)
    assert np.allclose(forwards.tangential, -backwards.tangential[::-1], atol=1e-15)


@pytest.mark.parametrize("part", [0.25, 0.5, 0.75])
def test_partial_slip_sticks_inside_as_cattaneo_and_mindlin_say(part):
    """Constant P, then Q < mu P: stick for |x| < c, c/a = sqrt(1 - Q/(mu P)), q(0) = mu p0 (1 - c/a).

    Exact for an incompressible body on a rigid surface, where normal and shear do not couple.
    """
    mu, load, nu = 0.005, 0.001, 0.4999  # so light that the body hardly rolls and its slope is small
    stiffness = 0.08 / (1 - nu**2)
    a = np.sqrt(4 * load * RADIUS / (np.pi * stiffness))
    p0 = 2 * load / (np.pi * a)
    body = cylinder(4.5, 0.02, nu, zone=0.3)
    newton = Newton(body.condensed)
    state = slide_from_guess(newton, LoadState(0.0, 0.0, sense=-1), start_state(body, 0.2), load)
    # all that touches sticks where it is; then the drive moves along until the drag is the part asked for
    sticking = np.where(state.touching, STICK, OPEN).astype(np.int32)
    state = replace(state, state=sticking, load=LoadState(state.load.depth, mu))
    travel = 0.0
    while -state.force[0] < part * mu * load:
        travel -= 2e-6
        state = solve_under_forces(newton, state, ForceLoad(load, None, travel))
    drag_ratio = -state.tangential.sum() / (mu * load)
    x = body.mesh.nodes[body.mesh.skin, 0]
    assert np.ptp(x[state.state == STICK]) / 2 == pytest.approx(a * np.sqrt(1 - drag_ratio), abs=0.02)
    traction = -(state.tangential / body.condensed.fixed_length)[np.abs(x) < 0.03].mean()
    assert traction == pytest.approx(mu * p0 * (1 - np.sqrt(1 - drag_ratio)), rel=0.02)


def test_a_tyre_that_cannot_slide_is_reported_lost():
    body = cylinder(4.5, 0.4)
    with pytest.raises(ContactLost):
        solve_full_slip(Newton(body.condensed), LoadState(0.2, 50.0, sense=-1))


def test_before_first_touch_nothing_is_felt():
    body = cylinder(4.5, 0.4)
    before = Newton(body.condensed).solve(EquilibriumState.undeformed(body.condensed), LoadState(-0.01, 0.3))
    assert not before.normal.any()
    assert before.skin_positions(body.condensed)[:, 1].min() == pytest.approx(0.0, abs=1e-12)
