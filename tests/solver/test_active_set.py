"""The one compiled search for contact states finds what the plain one on the inverse stiffness finds, to round-off."""

from dataclasses import replace

import numpy as np
import pytest

from solver import ContactLost, Finger, Loading, Receptor
from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.body.linear import LinearBody
from solver.constitutive import Hooke
from solver.contact import ForceLoad, FrictionLaw, LoadState
from solver.equilibrium import EquilibriumState, Newton, lower_onto_surface
from solver.equilibrium.load_path import LoadPath, LoadPoint
from solver.equilibrium.load_stepping import slide_from_guess, solve_full_slip, solve_under_forces
from solver.mesh.mesher import Sizing, finger_mesh
from tests.solver.oracle.active_set import (
    ContactSolver,
    condense_surface,
    lower_contact,
    undeformed_contact,
    under_forces,
)
from tests.solver.oracle.laws import frictionless

TISSUES = [Hooke(0.136, 0.48), Hooke(0.08, 0.48), Hooke(0.034, 0.3)]
LAWS = [FrictionLaw(0.0, np.inf), FrictionLaw(0.5, np.inf), FrictionLaw(0.9, 0.008), FrictionLaw(0.3, 0.0)]
STEPS = [(0.3, 0.0), (0.9, 0.0), (1.5, 0.0), (1.5, 0.05), (1.5, 0.2), (1.5, 1.0), (1.5, 3.0), (1.5, 2.9), (1.2, 1.0)]


@pytest.fixture(scope="module")
def body():
    mesh = finger_mesh(Finger(), Receptor(), Sizing(3, 2.0)).mesh
    return LinearBody.of(mesh, TISSUES)


@pytest.fixture(scope="module")
def newton(body):
    return Newton(body.condensed)


@pytest.fixture(scope="module")
def surface(body):
    return condense_surface(body.condensed)


def assert_same_contact(compiled, expected):
    np.testing.assert_array_equal(compiled.state, expected.state)
    drags = expected.tangential != 0.0
    np.testing.assert_array_equal(np.sign(compiled.tangential[drags]), np.sign(expected.tangential[drags]))
    for forces, expected_forces in ((compiled.normal, expected.normal), (compiled.tangential, expected.tangential)):
        np.testing.assert_allclose(forces, expected_forces, rtol=0.0, atol=1e-10 * max(expected.normal.max(), 1e-300))


@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("direction", [1, -1])
def test_settled_slides_are_the_plain_ones(newton, surface, law, direction):
    load = LoadState(1.5, law.mu, law.tau_max, -direction)
    state = solve_full_slip(newton, load)
    assert_same_contact(state, ContactSolver(surface, law).solve_full_slip(1.5, direction))
    assert_same_contact(
        solve_full_slip(newton, load._replace(depth=1.4), state),
        ContactSolver(surface, law).solve_full_slip(1.4, direction, state.state),
    )


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_course_of_stick_slip_and_turning_round_is_the_plain_one(newton, surface, law):
    contact_solver, contact = ContactSolver(surface, law), undeformed_contact(surface)
    state, states = EquilibriumState.undeformed(newton.condensed), set()
    for depth, travel in STEPS:
        contact = contact_solver.step(contact, depth, travel)
        state = newton.solve(state, LoadState(depth, law.mu, law.tau_max, travel=-travel))
        assert_same_contact(state, contact)
        states |= set(state.state.tolist())
    assert frictionless(law) or (states >= {STICK, SLIP} and (SHEAR_LIMITED in states) == np.isfinite(law.tau_max))


@pytest.mark.parametrize("tau", [np.inf, 0.004])
def test_a_body_pressed_and_dragged_by_forces_is_the_plain_one(newton, surface, tau):
    mu = 0.4
    state, contact = (
        replace(EquilibriumState.undeformed(newton.condensed), load=LoadState(0.0, mu, tau)),
        undeformed_contact(surface),
    )
    for n in range(1, 41):
        normal, drag = 0.002 * n, 0.0006 * max(n - 20, 0) * (1 if n < 35 else -1)
        contact_solver = ContactSolver(under_forces(surface, normal, drag), FrictionLaw(mu, tau))
        contact = contact_solver.step(lower_contact(contact_solver.law, contact), 0.0, 0.0)
        state = solve_under_forces(newton, lower_onto_surface(newton.condensed, state), ForceLoad(normal, drag))
        assert_same_contact(state, contact)
        np.testing.assert_allclose([-state.load.depth, -state.load.travel], contact.motion, atol=1e-10)
    assert (state.state == SHEAR_LIMITED).any() == (tau < np.inf)


def test_a_way_under_given_forces_ends_with_them(newton):
    loading = Loading(normal_force=0.1, tangential_force=0.02)
    path = LoadPath(newton, LoadState(0.0, 0.5, 0.01), loading)
    for n in range(1, 51):
        path.advance_to(LoadPoint(0.04 * n, 0.1 * min(n / 25, 1.0), -0.02 * max(n / 25 - 1.0, 0.0)))
    last = path.last
    np.testing.assert_allclose(last.force, [-0.02, 0.1], rtol=1e-9)
    assert (last.state == STICK).any()


def test_a_search_that_may_not_go_on_says_so(newton):
    all_open = np.full(len(newton.skin_x), OPEN)
    with pytest.raises(ContactLost, match="after 2 systems"):
        slide_from_guess(newton, LoadState(1.5, 0.5, sense=-1), all_open, rounds=2)
    with pytest.raises(ContactLost, match="no unique forces"):
        slide_from_guess(newton, LoadState(0.0, 0.5, sense=-1), all_open, force=0.1)
