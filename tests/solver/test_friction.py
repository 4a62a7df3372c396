"""Every contact law of the list, in every state, wherever contact is looked for: plain, in loops, by forces, finite."""

from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from solver._kernels import active_set
from solver._kernels.compiling import compile_loop
from solver.arrays import ContactStates, LoadArguments, StateChanges
from solver.body import CondensedLinear
from solver.body.finite import FiniteBody
from solver.constitutive import NeoHooke
from solver.contact import LAWS, OPEN, SHEAR_LIMITED, SLIP, STATE_NAMES, STICK, FrictionLaw
from solver.equilibrium import (
    BY_DEPTH,
    BY_FRICTION,
    BY_TRAVEL,
    EquilibriumState,
    LoadState,
    Newton,
)
from solver.equilibrium.load_stepping import solve_full_slip
from solver.mesh import block
from solver.response.stepper import SmallStepper
from tests.solver.oracle import finite as oracle
from tests.solver.oracle.active_set import Course, touchable, untouched
from tests.solver.oracle.laws import friction_slopes, frictionless

FREE, BOUND = FrictionLaw(0.5, np.inf), FrictionLaw(0.5, 0.02)
STEEP, NEVER_FELT = FrictionLaw(1000.0, 0.02), FrictionLaw(0.5, 1e9)
SLIPPERY, UNBOUND, NO_BOND = FrictionLaw(0.0, 0.02), FrictionLaw(0.0, np.inf), FrictionLaw(0.5, 0.0)
HARDLY, HARDLY_BOUND = FrictionLaw(1e-9, np.inf), FrictionLaw(0.5, 1e-12)
BOUND_OF_CUSHION = FrictionLaw(0.5, 0.0025)
MEMBERS = [FREE, BOUND, STEEP, NEVER_FELT, SLIPPERY, UNBOUND, NO_BOND, HARDLY, HARDLY_BOUND, BOUND_OF_CUSHION]

LENGTH = np.array([0.4, 0.7, 1.0, 0.7, 0.4])
COMPLIANCE = 3.0, 0.6, 5.0  # of each point: along y by N, along y by T and back, along x by T [mm per N/mm]
# depth and travel [mm]: pressed, rubbed until all slips, turned round, let up, pressed while sliding, lifted off
DRIVES = [(0.1, 0.0), (0.3, 0.0), (0.3, 0.02), (0.3, 0.1), (0.3, 0.15), (0.3, 1.0), (0.3, 0.97), (0.3, 0.5),
          (0.05, 0.5), (0.28, 0.8), (-0.1, 0.8)]  # fmt: skip


@dataclass(frozen=True)
class Told:
    """Points after a step, each (k,)."""

    state: np.ndarray
    sense: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    gap: np.ndarray
    slip: np.ndarray  # over the surface along +x within the step
    length: np.ndarray


def springs(across=COMPLIANCE[1]):
    """Five points that do not feel each other, the outer two above any depth."""
    along_y, _, along_x = COMPLIANCE
    rest = np.stack([np.linspace(-1.0, 1.0, 5), [9.0, 0.0, 0.02, 0.15, 9.0]], axis=1)
    stiffness = np.kron(np.eye(5), np.linalg.inv([[along_x, across], [across, along_y]]))
    return CondensedLinear(rest, stiffness, np.zeros(10), LENGTH, np.zeros(5, np.int32))


def told(body, now, before):
    place, moved = now.place(body), now.load.travel - before.load.travel
    slip = place[:, 0] - before.place(body)[:, 0] - moved
    gap = place[:, 1] - now.load.depth
    return Told(now.state, now.sense.astype(float), now.normal, now.tangential, gap, slip, LENGTH)


def driven(law):
    body = springs()
    newton, states = Newton(body), [EquilibriumState.undeformed(body)]
    for depth, travel in DRIVES:
        states.append(newton.settle(states[-1], LoadState(depth, law.mu, law.tau_max, travel=-travel)))
    return [told(body, now, before) for before, now in pairwise(states)]


def driven_plainly(law):
    body = touchable(springs())
    course, states = Course(body, law), [untouched(body)]
    for depth, travel in DRIVES:
        states.append(course.step(states[-1], depth, travel))
    return [
        Told(now.state, now.sense, now.normal, now.tangential, now.gap, now.shift - before.shift, LENGTH)
        for before, now in pairwise(states)
    ]


def slid_at_once(law):
    """Settled slides either way, which know no way there: what slips does so against its force."""
    body, rubbed = springs(), []
    for direction in (1, -1):
        found = solve_full_slip(Newton(body), LoadState(0.3, law.mu, law.tau_max, -direction))
        rubbed.append(replace(told(body, found, found), slip=np.full(5, 100.0 * direction)))
    return rubbed


def pressed_by_forces(law):
    """Forces given, the drag up to 0.9 of what the law allows: something always sticks where friction is."""
    finger = SimpleNamespace(newton=Newton(springs()), ending_by_skin=np.zeros((1, 10)))
    points, out = SmallStepper(finger, law.mu, law.tau_max), []
    for normal, part in [(0.02, 0.0), (0.1, 0.0), (0.1, 0.5), (0.1, 0.9), (0.1, -0.9), (0.05, -0.8), (0.15, 0.0)]:
        before = points.state
        most = law.limit(before.normal * normal / max(before.normal.sum(), 1e-300), LENGTH).sum()
        assert np.isfinite(points.step(normal, part * most if part else 0.0))
        now = told(finger.newton.condensed, points.state, before)
        # what slides does so against its force, and how far forces do not tell
        sliding = STICK not in points.state.state
        out.append(replace(now, slip=np.full(5, -np.sign(now.tangential.sum()))) if sliding else now)
    return out


@pytest.fixture(scope="module")
def cushion():
    """A round cushion of skin at finite strain."""
    across = np.array([0.0, 0.1, 0.2, 0.35, 0.6, 1.2])
    mesh = block(np.r_[-across[:0:-1], across], np.array([0.0, 0.2, 0.5, 1.0]), 2.0)
    return Newton(FiniteBody.of(mesh, [NeoHooke(0.08, 0.48)]).condensed)


def dragged(newton, law, drives=((0.02, 0.0), (0.06, 0.0), (0.06, 0.004), (0.06, 0.015), (0.06, 0.1), (0.06, 0.098),
                                 (0.06, 0.05), (0.03, 0.05), (-0.1, 0.05))):  # fmt: skip
    shapes = [EquilibriumState.undeformed(newton.condensed)]
    for depth, travel in drives:
        shapes.append(newton.settle(shapes[-1], LoadState(depth, law.mu, law.tau_max, 0, travel), 1e-13))
    return shapes


def finite(law, newton):
    out, shapes = [], dragged(newton, law)
    for before, now in pairwise(shapes):
        place, moved = now.place(newton.condensed), now.load.travel - before.load.travel
        length = np.maximum(oracle.rubbed(place[:, 0], now.touching, law.mu), 0.0)
        slip = place[:, 0] - before.place(newton.condensed)[:, 0] - moved
        drag, push = now.reaction.T
        touching = now.state != OPEN  # elsewhere the body's own unbalanced forces, round-off of the iterations
        drag, push = np.where(touching, drag, 0.0), np.where(touching, push, 0.0)
        out.append(Told(now.state, now.sense, push, drag, place[:, 1] - now.load.depth, slip, length))
    return out


WAYS = [driven, driven_plainly, slid_at_once, pressed_by_forces, finite]


@pytest.fixture(params=WAYS, ids=lambda way: way.__name__)
def course(request, cushion):
    way = request.param
    return (lambda law: way(law, cushion)) if way is finite else way


def test_every_law_of_the_list_is_tested_here():
    assert {type(law) for law in MEMBERS} == set(LAWS)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_wherever_contact_is_looked_for_what_is_found_is_what_the_law_says(course, law):
    """The law as two equations (Alart and Curnier 1991), and what follows from it, at every point of every step."""
    met = set()
    for at in course(law):
        push = max(at.normal.max(), 1e-3)
        close = 1e-9 * push
        limit = np.minimum(law.mu * at.normal, np.inf if law.tau_max == np.inf else law.tau_max * at.length)
        lifted, rubbed = push / np.abs(at.gap).max(), push / max(np.abs(at.slip).max(), 1e-6)
        assert np.abs(at.normal - np.maximum(at.normal - lifted * at.gap, 0.0)).max() < close
        projected = np.clip(at.tangential - rubbed * at.slip, -limit, limit)
        stays = at.state == OPEN  # skin in the air has no traction, wherever it goes
        assert np.abs(np.where(stays, at.tangential, at.tangential - projected)).max() < close
        # and so: it only pushes, keeps within cone and bound, takes work, and pulls against the slip
        assert at.normal.min() >= -close
        assert (np.abs(at.tangential) - limit).max() < close
        assert (at.tangential * at.slip).max() < close * np.abs(at.slip).max() + 1e-300
        slips = at.state >= SLIP
        assert (at.tangential * at.sense)[slips].min(initial=0.0) >= -close
        for state, force in ((SLIP, law.mu * at.normal), (SHEAR_LIMITED, law.tau_max * at.length)):
            np.testing.assert_allclose(np.abs(at.tangential)[at.state == state], force[at.state == state], atol=close)
        met |= set(at.state.tolist())
    possible = {OPEN, SLIP} if frictionless(law) else {OPEN, STICK, SLIP, SHEAR_LIMITED}
    assert met <= possible | {SHEAR_LIMITED}
    assert OPEN in met
    if frictionless(law):
        assert STICK not in met


def test_every_state_is_met_in_every_course(cushion):
    courses = [driven(BOUND), driven(BOUND), pressed_by_forces(BOUND), finite(BOUND_OF_CUSHION, cushion)]
    for points in courses:
        assert {STATE_NAMES[int(state)] for at in points for state in at.state} == set(STATE_NAMES.values())


@pytest.mark.parametrize(
    ("law", "as_good_as"),
    [(HARDLY, UNBOUND), (HARDLY_BOUND, NO_BOND), (SLIPPERY, UNBOUND), (NO_BOND, UNBOUND), (NEVER_FELT, FREE)],
    ids=str,
)
def test_friction_that_vanishes_is_none_and_a_bound_that_is_never_felt_is_none(course, law, as_good_as):
    for one, other in zip(course(law), course(as_good_as), strict=True):
        np.testing.assert_allclose(one.normal, other.normal, atol=1e-8 * max(other.normal.max(), 1e-3))
        np.testing.assert_allclose(one.tangential, other.tangential, atol=1e-8 * max(other.normal.max(), 1e-3))


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_points_on_springs_carry_what_their_springs_and_the_law_say(law):
    """No point feels another, and without coupling N = (d - g)/a; T is the springs' pull, cut off."""
    body = springs(across=0.0)
    newton, before = Newton(body), EquilibriumState.undeformed(body)
    for depth, travel in DRIVES:
        normal = np.maximum(depth - body.rest[:, 1], 0.0) / COMPLIANCE[0]
        limit = np.minimum(law.mu * normal, law.tau_max * LENGTH if law.tau_max < np.inf else np.inf)
        drag = np.clip((before.u[:, 0] - before.load.travel - travel) / COMPLIANCE[2], -limit, limit)
        before = newton.settle(before, LoadState(depth, law.mu, law.tau_max, travel=-travel))
        np.testing.assert_allclose(before.normal, normal, atol=1e-11 * 0.1)  # round-off, by the largest force
        np.testing.assert_allclose(before.tangential, drag, atol=1e-11 * 0.1)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_compiled_loops_find_the_states_and_forces_that_plain_numpy_finds(law):
    for plain, found in zip(driven_plainly(law), driven(law), strict=True):
        np.testing.assert_array_equal(found.state, plain.state)
        for name in ("normal", "tangential", "gap", "slip"):
            np.testing.assert_allclose(getattr(found, name), getattr(plain, name), atol=1e-13)


@compile_loop
def contradictions(states, above, slip, length, load, changes):
    return active_set.contradictions(states, above, slip, length, load, changes)


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_the_loop_of_finite_strain_changes_the_states_that_its_plain_twin_changes(law):
    draw = np.random.default_rng(3)
    for number in range(60):
        state = draw.integers(0, 4, 9).astype(np.int32)
        sense = draw.choice([-1, 1], 9).astype(np.int32)
        push, above = draw.normal(0.5, 1.0, 9), np.where(state == OPEN, draw.normal(size=9), 0.0)
        length = draw.uniform(-0.2, 3.0, 9)
        drag = draw.normal(size=9) * law.limit(np.abs(push), np.abs(length))
        reaction, slip, direction = np.stack([drag, push], axis=1), draw.normal(size=9), number % 3 - 1
        expected = oracle.restated(state, sense, reaction, above, slip, length, law, direction)
        found, turned = state.copy(), sense.copy()
        states, load = ContactStates(state, sense, reaction), LoadArguments(0.0, law.mu, law.tau_max, direction)
        changed = contradictions(states, above, slip, length, load, StateChanges(found, turned, above.copy()))
        np.testing.assert_array_equal(found, expected[0])
        np.testing.assert_array_equal(turned, expected[1])
        assert changed == np.sum((found != state) | ((found >= SLIP) & (turned != sense)))


@pytest.mark.parametrize("law", MEMBERS, ids=str)
def test_its_slopes_are_the_derivatives_of_its_forces(law):
    """By a step in imaginary direction through s min(mu N, tau_max L)."""
    step, sense = 1e-30j, np.array([1.0, -1.0])
    state = np.array([SLIP, SHEAR_LIMITED])

    def forces(normal, length):
        return sense * np.array([law.mu * normal, law.tau_max * length if law.tau_max < np.inf else 0.0 * length])

    for found, ahead in zip(
        friction_slopes(law, state, sense), (forces(0.1 + step, 0.4), forces(0.1, 0.4 + step)), strict=True
    ):
        felt = state == SLIP if law.tau_max == np.inf else np.full(2, True)
        np.testing.assert_allclose(found[felt], ahead.imag[felt] / step.imag, rtol=1e-15)
    open_or_stuck = friction_slopes(law, np.array([OPEN, STICK]), sense)
    assert not np.any(open_or_stuck)


def test_a_state_of_all_kinds_at_finite_strain_moves_as_its_tangent_says(cushion):
    """By depth, friction and travel, against differences of whole solutions."""
    law = BOUND_OF_CUSHION
    start = dragged(cushion, law, ((0.06, 0.0), (0.06, 0.004)))[-1]
    here = LoadState(0.06, law.mu, law.tau_max, 0, 0.015)
    now = cushion.settle(start, here, 1e-13)
    assert set(now.state.tolist()) == {OPEN, STICK, SLIP, SHEAR_LIMITED}
    anchor = start.place(cushion.condensed)[:, 0] + here.travel - start.load.travel
    assert cushion.linearise(now, here, anchor)
    tangent, skin = cushion.steps.copy(), cushion.condensed.body.mesh.skin
    for column, name in ((BY_DEPTH, "depth"), (BY_FRICTION, "mu"), (BY_TRAVEL, "travel")):
        step = 1e-5
        ahead, behind = (
            cushion.settle(start, here._replace(**{name: getattr(here, name) + by}), 1e-13) for by in (step, -step)
        )
        np.testing.assert_array_equal(ahead.state, behind.state)
        slope = (ahead.u[skin] - behind.u[skin]).ravel() / (2.0 * step)
        np.testing.assert_allclose(tangent[:, column], slope, atol=1e-7 * np.abs(slope).max())
