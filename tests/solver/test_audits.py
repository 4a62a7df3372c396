"""Audits show each fault that was planted in a solved state, with its size."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, NotConverged
from solver._kernels import SLIP
from solver.accuracy.audits import audits, force_residuals
from solver.continuation.small_states import settled_state
from solver.equilibrium.finger import LinearFinger
from solver.mesh.mesher import Sizing
from solver.scene.published import STICKINESS, scene

PART = 1e-3  # of what is spoilt
SAMPLE = scene(STICKINESS[0])


@pytest.fixture(scope="module")
def solution():
    """Return a finger, a slide with friction and its displacement."""
    finger = LinearFinger.of(SAMPLE, Sizing(4.0, SAMPLE.loading.depth))
    state = settled_state(SAMPLE, finger)
    return finger, state, finger.displacement(state)


def with_reaction(state, number, force):
    """Return the state with other forces of the surface on nodes of the skin."""
    reaction = state.reaction.copy()
    reaction[number] = force
    return replace(state, reaction=reaction)


def test_a_solved_state_passes(solution):
    checks = audits(*solution)
    assert checks.pop("smallest_det_F") > 0.0
    assert max(checks.values()) < 1e-9


@pytest.mark.parametrize(("axis", "name"), [(0, "equilibrium_x"), (1, "equilibrium_y")])
def test_a_force_that_the_bone_does_not_feel_is_missing_by_its_share_of_the_contact_force(solution, axis, name):
    finger, state, displacement = solution
    spoilt = replace(state, reaction=state.reaction * np.where(np.arange(2) == axis, 1.0 + PART, 1.0))
    assert audits(finger, spoilt, displacement)[name] == pytest.approx(
        PART * abs(state.force[axis]) / spoilt.force[1], rel=1e-6
    )


def test_a_body_displaced_too_far_stores_too_much_and_is_out_of_balance_at_its_skin(solution):
    finger, state, displacement = solution
    checks = audits(finger, state, (1.0 + PART) * displacement)
    # The stored energy grows with the square of the displacement, the work of given forces in proportion to it.
    assert checks["work_balance"] == pytest.approx(PART / (1.0 + PART), rel=1e-6)
    assert checks["inner_forces"] == pytest.approx(PART * np.abs(state.reaction).max() / state.force[1], rel=1e-6)


def test_skin_below_the_surface_is_a_penetration_by_the_indentation(solution):
    finger, state, displacement = solution
    raised = replace(state, load=state.load._replace(depth=(1.0 + PART) * state.load.depth))
    assert audits(finger, raised, displacement)["penetration"] == pytest.approx(PART / (1.0 + PART), rel=1e-6)


def test_skin_that_sticks_to_the_surface_is_under_tension(solution):
    finger, state, displacement = solution
    largest, node = state.normal.max(), int(np.flatnonzero(state.touching)[0])
    spoilt = with_reaction(state, node, (state.tangential[node], -PART * largest))
    assert audits(finger, spoilt, displacement)["tension"] == pytest.approx(PART, rel=1e-9)


def test_drag_on_skin_that_slips_lies_outside_the_friction_cone(solution):
    finger, state, displacement = solution
    largest, node = state.normal.max(), int(np.flatnonzero(state.state == SLIP)[0])
    beyond = np.sign(state.tangential[node]) * PART * largest
    spoilt = with_reaction(state, node, (state.tangential[node] + beyond, state.normal[node]))
    assert audits(finger, spoilt, displacement)["cone_violation"] == pytest.approx(PART, rel=1e-6)


def test_prescribed_forces_are_missed_by_their_own_and_by_what_friction_could_carry_and_not_by_much():
    held = replace(SAMPLE, friction=Friction(0.4), loading=Loading(slide="+x", normal_force=0.1, tangential_force=0.02))
    missed = force_residuals(held, 0.1 * (1.0 + 1e-9), -0.02 + 4e-11)
    assert missed == pytest.approx({"normal_force_missed": 1e-9, "drag_missed": 1e-9}, rel=1e-5)
    assert force_residuals(SAMPLE, 0.1, 0.02) == {}
    for normal, drag in ((0.1001, -0.02), (0.1, 0.02)):
        with pytest.raises(NotConverged, match="No state with the given forces was found"):
            force_residuals(held, normal, drag)
