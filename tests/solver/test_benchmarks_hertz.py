"""Cylinders on a flat rigid surface: Hertz, Smith and Liu, Cattaneo and Mindlin, Coulomb with a bound.

K. L. Johnson, Contact Mechanics, Cambridge 1985, chapters 4, 5 and 7. The bodies are those of the accuracy page.
"""

import numpy as np
import pytest

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP
from solver.contact import FrictionLaw
from solver.verification.published import contacts, problems
from solver.verification.published.contacts import ELEMENT
from solver.verification.published.problems import BELOW, CAPPED, HERTZ_PROBLEMS, TANGENTIAL_LOADS
from solver.verification.request import Request


@pytest.fixture(scope="module")
def light():
    return contacts.light()


@pytest.mark.parametrize("case", HERTZ_PROBLEMS, ids=lambda case: case[0])
def test_half_width_and_pressure_are_those_of_hertz(case):
    """With a/R up to 0.4 the theory is one of a half-plane under the gap of a parabola: so is the body here."""
    _, young, nu, radius, load, half_width, peak = case
    contact = contacts.hertz(young, nu, radius, load, half_width, peak)
    assert contact.load == pytest.approx(load, rel=1e-10)
    assert contact.half_width == pytest.approx(half_width, rel=1e-3)
    assert contact.half_extent == pytest.approx(half_width, abs=0.51 * ELEMENT["small"] * half_width)
    assert contact.peak == pytest.approx(peak, rel=1e-3)
    assert contact.worst < 2e-3


def test_a_round_body_touches_and_presses_as_hertz_says(light):
    assert light.half_width == pytest.approx(1.0, rel=1e-10)
    assert light.width(light.press) == pytest.approx(1.0, rel=1e-3)
    assert light.at_middle(light.press.normal) == pytest.approx(light.peak, rel=1e-3)
    assert np.ptp(light.x[light.press.touching]) / 2 == pytest.approx(1.0, abs=0.01)


def test_a_whole_cylinder_between_two_plates_approaches_them_as_in_johnson_5_57():
    """delta = P/(pi E*) [2 ln(4R/a) - 1]; a/R = 0.16, whose square is what the theory neglects."""
    contact = contacts.whole_cylinder(0.01, 0.782578, 0.008135)
    assert contact.approach == pytest.approx(0.167860, rel=0.005)
    assert contact.load == pytest.approx(0.01, rel=1e-10)
    assert contact.half_width == pytest.approx(0.782578, rel=0.01)
    assert contact.peak == pytest.approx(0.008135, rel=0.01)


def test_pressed_to_a_third_of_its_radius_a_cylinder_differs_from_johnson_5_57_by_what_that_neglects():
    contact = contacts.whole_cylinder(0.05, 1.749897, 0.018190)
    next_term = (1.749897 / 5.0 / 2.0) ** 2  # the next term of the circle's outline: 3 %
    assert contact.approach == pytest.approx(0.592884, rel=next_term)
    assert contact.half_width == pytest.approx(1.749897, rel=next_term)
    assert contact.peak == pytest.approx(0.018190, rel=next_term)


AXIS = np.array([0.25, 0.5, 0.786, 1.0, 1.5])


def test_on_the_axis_the_stresses_are_those_of_hertz_and_the_largest_shear_is_below_the_surface():
    light = contacts.light(wide=300.0)
    stress = light.stress(light.press, np.stack([0 * AXIS, AXIS], axis=1))
    root = np.sqrt(1 + AXIS**2)
    assert np.abs(stress[:, 0, 0] + (1 + 2 * AXIS**2) / root - 2 * AXIS).max() < 0.005
    assert np.abs(stress[:, 1, 1] + 1 / root).max() < 0.005
    depths = np.linspace(0.6, 1.0, 41)
    stress = light.stress(light.press, np.stack([0 * depths, depths], axis=1))
    shear = (stress[:, 0, 0] - stress[:, 1, 1]) / 2
    assert shear.max() == pytest.approx(0.300, rel=0.01)
    assert np.interp(0.786, depths, shear) == pytest.approx(0.300, rel=0.01)


@pytest.mark.parametrize("mu", BELOW)
def test_below_a_sliding_cylinder_the_stresses_are_those_of_smith_and_liu(mu):
    """The surface drags the body along +x. The block is 600 half-widths wide; what that leaves out is 0.3 % of p0."""
    light = contacts.light(wide=300.0)
    table = np.array(BELOW[mu])
    stress = light.stress(light.slip(FrictionLaw(mu, np.inf), -1), table[:, :2])
    assert np.abs(stress[:, 0, 0] - table[:, 2]).max() < 0.005
    assert np.abs(stress[:, 1, 1] - table[:, 3]).max() < 0.005
    assert np.abs(stress[:, 0, 1] - table[:, 4]).max() < 0.005
    shear = np.hypot((stress[:, 0, 0] - stress[:, 1, 1]) / 2, stress[:, 0, 1])
    expected = np.hypot((table[:, 2] - table[:, 3]) / 2, table[:, 4])
    assert np.abs(shear - expected).max() < 0.005


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_the_stress_along_a_sliding_surface_is_the_closed_form_and_pulls_behind_the_contact(mu):
    light = contacts.light(wide=300.0)
    state = light.slip(FrictionLaw(mu, np.inf), -1)
    inside, outside = np.linspace(-0.9, 0.9, 7), np.array([-2.0, -1.5, -1.2, 1.2, 1.5, 2.0])
    x = np.concatenate([inside, outside])
    # Johnson 1985, sections 4.1 and 7.1: sigma_x by p0 along a surface pulled along +x, behind which it is stretched
    closed_form = np.concatenate([
        -np.sqrt(1.0 - inside**2) - 2.0 * mu * inside,
        -2.0 * mu * (outside - np.sign(outside) * np.sqrt(outside**2 - 1.0)),
    ])  # fmt: skip
    stress = light.stress(state, np.stack([x, 0.0 * x], axis=1))
    np.testing.assert_allclose(stress[:, 0, 0], closed_form, atol=0.005)
    shear = np.hypot((stress[:7, 0, 0] - stress[:7, 1, 1]) / 2.0, stress[:7, 0, 1])
    np.testing.assert_allclose(shear, mu, atol=0.005)  # all along the contact: from 0.3 on the largest there is


@pytest.mark.parametrize("part", TANGENTIAL_LOADS["small"])
@pytest.mark.parametrize("mu", [0.01, 0.3])
def test_partial_slip_is_that_of_cattaneo_and_mindlin(light, mu, part):
    """Stick for |x| < c = sqrt(1 - Q/(mu P)); q = mu p less mu p0 c sqrt(1 - x^2/c^2) inside."""
    state = light.shear(mu, part)
    x, c, top = light.x, np.sqrt(1 - part), mu * light.peak
    assert -state.tangential.sum() == pytest.approx(part * mu * light.load, rel=1e-10)
    assert light.stick_width(state, mu) == pytest.approx(c, rel=0.02)
    traction = -state.tangential / light.length
    closed_form = np.sqrt(np.clip(1 - x**2, 0, None)) - c * np.sqrt(np.clip(1 - (x / c) ** 2, 0, None))
    assert traction[len(x) // 2] == pytest.approx(top * (1 - c), rel=0.005)
    # the closed form has an upright tangent at both edges, which the elements there can only round
    element = ELEMENT["small"]
    smooth = (np.abs(x) < 1 - element) & (np.abs(np.abs(x) - c) > element)
    assert np.abs(traction - top * closed_form)[smooth].max() < 0.01 * top


@pytest.mark.parametrize(("k", "force"), CAPPED)
def test_a_bound_on_a_hertz_pressure_carries_the_elementary_integral(light, k, force):
    """Q/(mu P) for k = tau_max/(mu p0); the bound acts for |x| < sqrt(1 - k^2)."""
    mu = 0.3
    law = FrictionLaw(mu, k * mu * light.peak)
    state = light.slip(law)
    assert -state.tangential.sum() / (mu * light.load) == pytest.approx(force, rel=0.005)
    assert light.capped_width(state, law) == pytest.approx(
        np.sqrt(1 - k**2), rel=0.005, abs=ELEMENT["small"] if k == 1.0 else 0.0
    )
    assert set(state.state.tolist()) <= {OPEN, SLIP, SHEAR_LIMITED}


def test_every_published_problem_of_the_page_is_met():
    rows = list(problems.measure(Request(quick=False, until=np.inf)))
    assert len(rows) > 60
    assert [f"{row.problem}, {row.quantity}: off by {row.off:.2g}" for row in rows if not row.agrees] == []
