"""Every contact law of the list, in every state, wherever contact is looked for: plain, in loops, by forces, finite."""

from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from solver._kernels import active_set, compile_loop
from solver.arrays import ContactStates, LoadArguments, StateChanges
from solver.body import CondensedLinear
from solver.body.finite import FiniteBody
from solver.constitutive import NeoHooke
from solver.contact import FRICTION_LAWS, OPEN, SHEAR_LIMITED, SLIP, STATE_NAMES, STICK, FrictionLaw, LoadState
from solver.equilibrium import BY_DEPTH, BY_FRICTION, BY_TRAVEL, EquilibriumState, Newton, Termination
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh import block
from solver.response.stepper import SmallStepper
from tests.solver.oracle import finite as oracle
from tests.solver.oracle.active_set import ContactSolver, condense_surface, undeformed_contact
from tests.solver.oracle.laws import frictionless

FREE, BOUND = FrictionLaw(0.5, np.inf), FrictionLaw(0.5, 0.02)
STEEP, HIGH_BOUND = FrictionLaw(1000.0, 0.02), FrictionLaw(0.5, 1e9)
SLIPPERY, UNBOUND, NO_BOND = FrictionLaw(0.0, 0.02), FrictionLaw(0.0, np.inf), FrictionLaw(0.5, 0.0)
HARDLY, HARDLY_BOUND = FrictionLaw(1e-9, np.inf), FrictionLaw(0.5, 1e-12)
BOUND_OF_CUSHION = FrictionLaw(0.5, 0.0025)
MEMBERS = [FREE, BOUND, STEEP, HIGH_BOUND, SLIPPERY, UNBOUND, NO_BOND, HARDLY, HARDLY_BOUND, BOUND_OF_CUSHION]

LENGTH = np.array([0.4, 0.7, 1.0, 0.7, 0.4])
COMPLIANCE = 3.0, 0.6, 5.0  # of each point: along y by N, along y by T and back, along x by T [mm per N/mm]
# depth and travel [mm]: pressed, rubbed until all slips, turned round, let up, pressed while sliding, lifted off
DRIVES = [(0.1, 0.0), (0.3, 0.0), (0.3, 0.02), (0.3, 0.1), (0.3, 0.15), (0.3, 1.0), (0.3, 0.97), (0.3, 0.5),
          (0.05, 0.5), (0.28, 0.8), (-0.1, 0.8)]  # fmt: skip


@dataclass(frozen=True)
class PointStates:
    """Points after a step, each (k,)."""

    state: np.ndarray
    sense: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    gap: np.ndarray
    slip: np.ndarray  # over the surface along +x within the step
    length: np.ndarray


def springs(coupling=COMPLIANCE[1]):
    """Five points that do not feel each other, the outer two above any depth."""
    along_y, _, along_x = COMPLIANCE
    rest = np.stack([np.linspace(-1.0, 1.0, 5), [9.0, 0.0, 0.02, 0.15, 9.0]], axis=1)
    stiffness = np.kron(np.eye(5), np.linalg.inv([[along_x, coupling], [coupling, along_y]]))
    return CondensedLinear(rest, stiffness, np.zeros(10), LENGTH, np.zeros(5, np.int32))


def points_after(body, state, last_state):
    place, bone_travel = state.skin_positions(body), state.load.travel - last_state.load.travel
    slip = place[:, 0] - last_state.skin_positions(body)[:, 0] - bone_travel
    gap = place[:, 1] - state.load.depth
    return PointStates(state.state, state.sense.astype(float), state.normal, state.tangential, gap, slip, LENGTH)


def drive(law):
    body = springs()
    newton, states = Newton(body), [EquilibriumState.undeformed(body)]
    for depth, travel in DRIVES:
        states.append(newton.solve(states[-1], LoadState(depth, law.mu, law.tau_max, travel=-travel)))
    return [points_after(body, state, last_state) for last_state, state in pairwise(states)]


def drive_oracle(law):
    body = condense_surface(springs())
    contact_solver, contacts = ContactSolver(body, law), [undeformed_contact(body)]
    for depth, travel in DRIVES:
        contacts.append(contact_solver.step(contacts[-1], depth, travel))
    return [
        PointStates(c.state, c.sense, c.normal, c.tangential, c.gap, c.shift - last.shift, LENGTH)
        for last, c in pairwise(contacts)
    ]


def slide_at_once(law):
    """Settled slides either way, which know no way there: what slips does so against its force."""
    body, points = springs(), []
    for direction in (1, -1):
        state = solve_full_slip(Newton(body), LoadState(0.3, law.mu, law.tau_max, -direction))
        points.append(replace(points_after(body, state, state), slip=np.full(5, 100.0 * direction)))
    return points


def press_by_forces(law):
    """Press and drag by forces, up to 0.9 of what the law allows: with friction something always sticks."""
    finger = SimpleNamespace(newton=Newton(springs()), ending_by_skin=np.zeros((1, 10)))
    stepper, steps = SmallStepper(finger, law.mu, law.tau_max), []
    for normal, part in [(0.02, 0.0), (0.1, 0.0), (0.1, 0.5), (0.1, 0.9), (0.1, -0.9), (0.05, -0.8), (0.15, 0.0)]:
        last_state = stepper.state
        limit = law.limit(last_state.normal * normal / max(last_state.normal.sum(), 1e-300), LENGTH).sum()
        assert np.isfinite(stepper.step(normal, part * limit if part else 0.0))
        points = points_after(finger.newton.condensed, stepper.state, last_state)
        # what slides does so against its force, and how far forces do not tell
        sliding = STICK not in stepper.state.state
        steps.append(replace(points, slip=np.full(5, -np.sign(points.tangential.sum()))) if sliding else points)
    return steps


@pytest.fixture(scope="module")
def cushion():
    """A round cushion of skin at finite strain."""
    half_x = np.array([0.0, 0.1, 0.2, 0.35, 0.6, 1.2])
    mesh = block(np.r_[-half_x[:0:-1], half_x], np.array([0.0, 0.2, 0.5, 1.0]), 2.0)
    return Newton(FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)]).condensed)


def rub(newton, law, drives=((0.02, 0.0), (0.06, 0.0), (0.06, 0.004), (0.06, 0.015), (0.06, 0.1), (0.06, 0.098),
                                 (0.06, 0.05), (0.03, 0.05), (-0.1, 0.05))):  # fmt: skip
    states = [EquilibriumState.undeformed(newton.condensed)]
    for depth, travel in drives:
        states.append(newton.solve(states[-1], LoadState(depth, law.mu, law.tau_max, 0, travel), Termination(1e-13)))
    return states


def drive_finite(law, newton):
    points, states = [], rub(newton, law)
    for last_state, state in pairwise(states):
        place, bone_travel = state.skin_positions(newton.condensed), state.load.travel - last_state.load.travel
        length = np.maximum(oracle.tributary(place[:, 0]), 0.0)
        slip = place[:, 0] - last_state.skin_positions(newton.condensed)[:, 0] - bone_travel
        drag, push = state.reaction.T
        touching = state.state != OPEN  # elsewhere the body's own unbalanced forces, round-off of the iterations
        drag, push = np.where(touching, drag, 0.0), np.where(touching, push, 0.0)
        points.append(PointStates(state.state, state.sense, push, drag, place[:, 1] - state.load.depth, slip, length))
    return points


SEARCHES = [drive, drive_oracle, slide_at_once, press_by_forces, drive_finite]


@pytest.fixture(params=SEARCHES, ids=lambda search: search.__name__)
def points_by_law(request, cushion):
    search = request.param
    return (lambda law: search(law, cushion)) if search is drive_finite else search


def test_every_law_of_the_list_is_tested_here():
    assert {type(law) for law in MEMBERS} == set(FRICTION_LAWS)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_wherever_contact_is_looked_for_what_is_found_is_what_the_law_says(points_by_law, law):
    """The law as two equations (Alart and Curnier 1991), and what follows from it, at every point of every step."""
    states = set()
    for points in points_by_law(law):
        push = max(points.normal.max(), 1e-3)
        tolerance = 1e-9 * push
        limit = np.minimum(law.mu * points.normal, np.inf if law.tau_max == np.inf else law.tau_max * points.length)
        gap_scale, slip_scale = push / np.abs(points.gap).max(), push / max(np.abs(points.slip).max(), 1e-6)
        assert np.abs(points.normal - np.maximum(points.normal - gap_scale * points.gap, 0.0)).max() < tolerance
        projected = np.clip(points.tangential - slip_scale * points.slip, -limit, limit)
        is_open = points.state == OPEN  # skin in the air has no traction, wherever it goes
        assert np.abs(np.where(is_open, points.tangential, points.tangential - projected)).max() < tolerance
        # and so: it only pushes, keeps within cone and bound, takes work, and pulls against the slip
        assert points.normal.min() >= -tolerance
        assert (np.abs(points.tangential) - limit).max() < tolerance
        assert (points.tangential * points.slip).max() < tolerance * np.abs(points.slip).max() + 1e-300
        slips = points.state >= SLIP
        assert (points.tangential * points.sense)[slips].min(initial=0.0) >= -tolerance
        for state, force in ((SLIP, law.mu * points.normal), (SHEAR_LIMITED, law.tau_max * points.length)):
            mask = points.state == state
            np.testing.assert_allclose(np.abs(points.tangential)[mask], force[mask], atol=tolerance)
        states |= set(points.state.tolist())
    possible = {OPEN, SLIP} if frictionless(law) else {OPEN, STICK, SLIP, SHEAR_LIMITED}
    assert states <= possible | {SHEAR_LIMITED}
    assert OPEN in states
    if frictionless(law):
        assert STICK not in states


def test_every_state_is_met_in_every_course(cushion):
    courses = [drive(BOUND), drive_oracle(BOUND), press_by_forces(BOUND), drive_finite(BOUND_OF_CUSHION, cushion)]
    for course in courses:
        assert {STATE_NAMES[int(state)] for points in course for state in points.state} == set(STATE_NAMES.values())


@pytest.mark.parametrize(
    ("law", "limit_law"),
    [(HARDLY, UNBOUND), (HARDLY_BOUND, NO_BOND), (SLIPPERY, UNBOUND), (NO_BOND, UNBOUND), (HIGH_BOUND, FREE)],
    ids=str,
)
def test_friction_that_vanishes_is_none_and_a_bound_that_is_never_felt_is_none(points_by_law, law, limit_law):
    for points, expected in zip(points_by_law(law), points_by_law(limit_law), strict=True):
        np.testing.assert_allclose(points.normal, expected.normal, atol=1e-8 * max(expected.normal.max(), 1e-3))
        np.testing.assert_allclose(points.tangential, expected.tangential, atol=1e-8 * max(expected.normal.max(), 1e-3))


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_points_on_springs_carry_what_their_springs_and_the_law_say(law):
    """No point feels another, and without coupling N = (d - g)/a; T is the springs' pull, cut off."""
    body = springs(coupling=0.0)
    newton, state = Newton(body), EquilibriumState.undeformed(body)
    for depth, travel in DRIVES:
        normal = np.maximum(depth - body.rest[:, 1], 0.0) / COMPLIANCE[0]
        limit = np.minimum(law.mu * normal, law.tau_max * LENGTH if law.tau_max < np.inf else np.inf)
        drag = np.clip((state.u[:, 0] - state.load.travel - travel) / COMPLIANCE[2], -limit, limit)
        state = newton.solve(state, LoadState(depth, law.mu, law.tau_max, travel=-travel))
        np.testing.assert_allclose(state.normal, normal, atol=1e-11 * 0.1)  # round-off, by the largest force
        np.testing.assert_allclose(state.tangential, drag, atol=1e-11 * 0.1)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_compiled_loops_find_the_states_and_forces_that_plain_numpy_finds(law):
    for expected, points in zip(drive_oracle(law), drive(law), strict=True):
        np.testing.assert_array_equal(points.state, expected.state)
        for name in ("normal", "tangential", "gap", "slip"):
            np.testing.assert_allclose(getattr(points, name), getattr(expected, name), atol=1e-13)


@compile_loop
def contradictions(states, above, slip, length, load, changes):
    return active_set.contradictions(states, above, slip, length, load, changes)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_the_loop_of_finite_strain_changes_the_states_that_its_plain_twin_changes(law):
    rng = np.random.default_rng(3)
    for number in range(60):
        state = rng.integers(0, 4, 9).astype(np.int32)
        sense = rng.choice([-1, 1], 9).astype(np.int32)
        push, above = rng.normal(0.5, 1.0, 9), np.where(state == OPEN, rng.normal(size=9), 0.0)
        length = rng.uniform(-0.2, 3.0, 9)
        drag = rng.normal(size=9) * law.limit(np.abs(push), np.abs(length))
        reaction, slip, direction = np.stack([drag, push], axis=1), rng.normal(size=9), number % 3 - 1
        expected = oracle.update_contact_states(state, sense, reaction, above, slip, length, law, direction)
        new_state, new_sense = state.copy(), sense.copy()
        states, load = ContactStates(state, sense, reaction), LoadArguments(0.0, law.mu, law.tau_max, direction)
        change_count = contradictions(
            states, above, slip, length, load, StateChanges(new_state, new_sense, above.copy())
        )
        np.testing.assert_array_equal(new_state, expected[0])
        np.testing.assert_array_equal(new_sense, expected[1])
        assert change_count == np.sum((new_state != state) | ((new_state >= SLIP) & (new_sense != sense)))


def test_a_state_of_all_kinds_at_finite_strain_moves_as_its_tangent_says(cushion):
    """By depth, friction and travel, against differences of whole solutions."""
    law = BOUND_OF_CUSHION
    start = rub(cushion, law, ((0.06, 0.0), (0.06, 0.004)))[-1]
    load = LoadState(0.06, law.mu, law.tau_max, 0, 0.015)
    state = cushion.solve(start, load, Termination(1e-13))
    assert set(state.state.tolist()) == {OPEN, STICK, SLIP, SHEAR_LIMITED}
    anchor = start.skin_positions(cushion.condensed)[:, 0] + load.travel - start.load.travel
    assert cushion.linearise(state, anchor)
    tangent, skin = cushion.steps.copy(), cushion.condensed.body.mesh.skin
    for column, name in ((BY_DEPTH, "depth"), (BY_FRICTION, "mu"), (BY_TRAVEL, "travel")):
        step = 1e-5
        ahead, behind = (
            cushion.solve(start, load._replace(**{name: getattr(load, name) + h}), Termination(1e-13))
            for h in (step, -step)
        )
        np.testing.assert_array_equal(ahead.state, behind.state)
        slope = (ahead.u[skin] - behind.u[skin]).ravel() / (2.0 * step)
        np.testing.assert_allclose(tangent[:, column], slope, atol=1e-7 * np.abs(slope).max())
