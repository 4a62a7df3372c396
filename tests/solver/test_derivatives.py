# ruff: noqa: N806 - the letters of the literature
"""Derivatives from the converged tangent: against differences of tight solves, complex steps and closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Scene, Solve
from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.body import CondensedLinear, Endings, Probes
from solver.body.finite import FiniteBody, FinitePatches
from solver.constitutive import NeoHooke, Ogden
from solver.constitutive import shape as grown
from solver.contact import ForceLoad, LoadState
from solver.continuation.small_states import settled_state
from solver.equilibrium import Newton, Termination
from solver.equilibrium.finger import FiniteFinger, LinearFinger
from solver.equilibrium.load_stepping import solve_full_slip, solve_under_forces
from solver.mesh.mesher import Sizing
from solver.quantities import QUANTITIES
from solver.response.nearby import Nearby, response_derivatives, skin_derivatives
from tests.solver.finite_examples import block

NAMES = ("mu", "tau_max", "press")


def scene(mu, tau_max, loading, kinematics="small"):
    return Scene(friction=Friction(mu, tau_max), loading=loading, solve=Solve(kinematics))


def vary(scene, name, by):
    """Return the scene with one parameter changed by so much; "press" is the depth, or the force where that drives."""
    friction, loading = scene.friction, scene.loading
    if name == "press" and loading.normal_force is None:
        return replace(scene, loading=replace(loading, indentation=loading.indentation + by))
    if name == "press":
        return replace(scene, loading=replace(loading, normal_force=loading.normal_force + by))
    return replace(scene, friction=replace(friction, **{name: getattr(friction, name) + by}))


def derivative_table(slopes):
    """Return derivatives as a table: SED, normal force, drag, depth, then each quantity, by mu, tau_max and press."""
    rows = (slopes.sed, slopes.normal, slopes.tangential, slopes.indentation, *slopes.responses.values())
    return np.array([[number for number in row if number is not None] for row in rows])


def differences(numbers, scene, steps):
    """Return the same table from central differences of solves; `numbers` gives its rows' numbers of a scene."""
    zeros = np.zeros(4 + len(QUANTITIES))
    columns = [(numbers(vary(scene, n, h)) - numbers(vary(scene, n, -h))) / (2 * h) if h else zeros
               for n, h in zip(NAMES, steps, strict=True)]  # fmt: skip
    return np.stack(columns, axis=1)


def assert_tables_agree(table, expected, scale):
    """Assert that tables agree to 1e-6 of each entry; `scale` are the numbers, to whose round-off 0 is known."""
    for row, expected_row, number in zip(table, expected, scale, strict=True):
        np.testing.assert_allclose(row, expected_row, rtol=1e-6, atol=1e-8 * abs(number))


# Small strain


@pytest.fixture(scope="module")
def small():
    return LinearFinger.of(scene(0.0, None, Loading(2.0)), Sizing(5.0, 2.0))


def small_numbers(finger, scene, states):
    """Return SED, normal force, drag, depth and each quantity of a settled slide, which must have these states."""
    contact = settled_state(scene, finger)
    assert (contact.state == states).all()
    depth = contact.load.depth
    sed, normal, tangential, *rest = finger.all_numbers([contact])[0]
    return np.array([sed, normal, -scene.loading.direction * tangential, depth, *rest[-len(QUANTITIES) :]])


SMALL = {
    "without a bound": scene(0.3, None, Loading(1.2)),
    "beside its limit": scene(0.67, 0.05, Loading(2.0)),
    "at the bound, slid back": scene(0.6, 0.01, Loading(1.5, "-x")),
    "under a force": scene(0.4, None, Loading(normal_force=0.12)),
    "under a force, at the bound": scene(0.6, 0.005, Loading(normal_force=0.12, slide="-x")),
}


@pytest.mark.parametrize("name", SMALL)
def test_at_small_strain_they_are_the_differences_of_solves_within_one_set_of_states(small, name):
    slide = SMALL[name]
    contact = settled_state(slide, small)
    assert ("at the bound" in name) == (contact.state == SHEAR_LIMITED).any()

    def numbers(changed_scene):
        return small_numbers(small, changed_scene, contact.state)

    steps = (2e-5, 2e-7 if slide.friction.tau_max else 0.0, 2e-5)
    table = derivative_table(Nearby(slide, contact, small).derivatives())
    assert_tables_agree(table, differences(numbers, slide, steps), numbers(slide))


def test_between_changes_of_state_forces_are_straight_in_the_depth_and_the_sed_a_parabola(small):
    # Closed form: a slope of a straight line and of a parabola are those of their chords, however long.
    slide = SMALL["beside its limit"]
    contact = settled_state(slide, small)
    derivatives = Nearby(slide, contact, small).derivatives()
    chord_ends = [small_numbers(small, vary(slide, "press", by), contact.state) for by in (-5e-3, 5e-3)]
    assert (chord_ends[1] - chord_ends[0])[:3] / 1e-2 == pytest.approx(derivative_table(derivatives)[:3, 2], rel=1e-9)


def test_a_given_force_drags_with_mu_times_it(small):
    slide = SMALL["under a force"]
    derivatives = Nearby(slide, settled_state(slide, small), small).derivatives()
    assert derivatives.tangential.mu == pytest.approx(0.12, rel=1e-12)
    assert derivatives.tangential.normal_force == pytest.approx(0.4, rel=1e-12)
    assert derivatives.normal == (0.0, 0.0, None, 1.0)


def springs(coupling):
    """Two points that may touch, the second higher than any depth, of compliance 3 along y and 5 along x."""
    stiffness = np.kron(np.eye(2), np.linalg.inv([[5.0, coupling], [coupling, 3.0]]))
    rest = np.array([[0.0, 0.0], [1.0, 9.0]])
    return Newton(CondensedLinear(rest, stiffness, np.zeros(4), np.array([0.7, 0.7]), np.zeros(2, np.int32)))


def test_one_point_on_springs_answers_as_its_formula_says():
    """N = d / (3 + s mu b), and at the bound N = (d - s b tau L) / 3, with s = -1 for a slide along +x."""
    d, b, mu, tau, length = 0.6, 0.8, 0.5, 0.04, 0.7
    newton, load = springs(b), LoadState(d, mu, sense=-1)
    drag_slopes, push_slopes = newton.force_changes(skin_derivatives(newton, solve_full_slip(newton, load)))
    soft = 3.0 - mu * b
    assert push_slopes == pytest.approx([b * d / soft**2, 0.0, 1.0 / soft], rel=1e-13)
    assert drag_slopes == pytest.approx([-d / soft - mu * b * d / soft**2, 0.0, -mu / soft], rel=1e-13)
    bounded = solve_full_slip(newton, load._replace(tau=tau))
    assert bounded.state.tolist() == [SHEAR_LIMITED, OPEN]
    drag_slopes, push_slopes = newton.force_changes(skin_derivatives(newton, bounded))
    assert push_slopes == pytest.approx([0.0, b * length / 3.0, 1.0 / 3.0], rel=1e-13)
    assert drag_slopes == pytest.approx([0.0, -length, 0.0], rel=1e-13)


def test_at_a_kink_each_side_has_the_slope_of_its_own_states(small):
    # A depth at which one more point comes to touch, found by halving.
    slide = SMALL["without a bound"]

    def solve_at(depth):
        return settled_state(vary(slide, "press", depth - 1.2), small)

    low, high = 1.2, 1.3
    assert solve_at(low).touching.sum() < solve_at(high).touching.sum()
    while high - low > 1e-11:
        middle = (low + high) / 2.0
        low, high = (middle, high) if solve_at(middle).touching.sum() == solve_at(1.2).touching.sum() else (low, middle)
    slopes = []
    for side, depth in ((-1.0, low), (1.0, high)):
        far, near = (small.numbers([solve_at(depth + side * by)])[0, 0] for by in (1e-3, 0.0))
        slope, far_slope = (
            Nearby(vary(slide, "press", touch_depth - 1.2), solve_at(touch_depth), small).derivatives().sed.indentation
            for touch_depth in (depth, depth + side * 1e-3)
        )
        assert side * (far - near) / 1e-3 == pytest.approx((slope + far_slope) / 2.0, rel=1e-6)  # a parabola's chord
        slopes.append(slope)
    assert abs(slopes[1] / slopes[0] - 1.0) > 1e-4
    assert small.numbers([solve_at(low)])[0, 0] == pytest.approx(small.numbers([solve_at(high)])[0, 0], rel=1e-9)


def test_a_state_that_sticks_has_no_derivatives_of_its_own(small):
    contact = settled_state(SMALL["without a bound"], small)
    sticking_state = replace(contact, state=np.where(contact.state == SLIP, STICK, contact.state).astype(np.int32))
    with pytest.raises(ValueError, match="depends on its load path"):
        Nearby(SMALL["without a bound"], sticking_state, small).derivatives()


# Finite strain


@pytest.fixture(scope="module")
def finite():
    return FiniteFinger.of(scene(0.0, None, Loading(1.2), "finite"), Sizing(5.0, 1.2, margin=3.0))


def load_of(scene, depth):
    return LoadState(depth, scene.friction.mu, scene.friction.cap, -scene.loading.direction)


def slip(finger, scene, start=None):
    depth = scene.loading.indentation or 0.6
    state = solve_full_slip(finger.newton, load_of(scene, depth), start, 1e-13)
    if scene.normal_force is None:
        return state
    return solve_under_forces(finger.newton, state, ForceLoad(scene.normal_force, None), Termination(1e-12))


def finite_numbers(finger, scene, start):
    state = slip(finger, scene, replace(start, load=load_of(scene, start.load.depth)))
    assert (state.state == start.state).all()
    sed, normal, tangential, *rest = finger.all_numbers([state])[0]
    return np.array([sed, normal, -scene.loading.direction * tangential, state.load.depth, *rest[-len(QUANTITIES) :]])


FINITE = {
    "without a bound": scene(0.3, None, Loading(1.2), "finite"),
    "at the bound, slid back": scene(0.4, 0.008, Loading(1.2, "-x"), "finite"),
    "under a force, at the bound": scene(0.4, 0.005, Loading(normal_force=0.06), "finite"),
}


@pytest.mark.parametrize("name", FINITE)
def test_at_finite_strain_they_are_the_differences_of_solves_within_one_set_of_states(finite, name):
    slide = FINITE[name]
    state = slip(finite, slide)
    assert ("at the bound" in name) == (state.state == SHEAR_LIMITED).any()

    def numbers(changed_scene):
        return finite_numbers(finite, changed_scene, state)

    steps = (1e-5, 1e-7 if slide.friction.tau_max else 0.0, 1e-5)
    table = derivative_table(Nearby(slide, state, finite).derivatives())
    assert_tables_agree(table, differences(numbers, slide, steps), numbers(slide))


@pytest.mark.parametrize("law", [NeoHooke(0.08, 0.48), Ogden(0.08, 0.48)], ids=str)
def test_how_the_sed_of_a_patch_bends_is_a_complex_step_of_its_energy(law):
    mesh = block(distortion=0.06)
    body = FiniteBody.of(mesh, [law])
    elements = np.repeat(np.arange(len(mesh.elements)), 2)
    local = np.random.default_rng(1).uniform(-0.9, 0.9, (len(elements), 2))
    places = Probes.at(mesh, body.centre, elements, local)
    count = len(elements)
    probes = FinitePatches(
        body,
        Endings(
            places, np.linspace(1.0, 2.0, count), np.arange(count) * 3 // count, 3, np.tile([1.0, 0.0], (count, 1))
        ),
    )
    rng = np.random.default_rng(2)
    u, steps = rng.uniform(-0.015, 0.015, mesh.nodes.shape), rng.normal(size=(*mesh.nodes.shape, 2))
    slopes = response_derivatives(probes, u, steps)[0]
    for column in range(2):
        expected = average(body, probes, u + 1e-30j * steps[..., column])
        assert np.real(expected) == pytest.approx(probes.average(u), rel=1e-12)
        assert slopes[:, column] == pytest.approx(np.imag(expected) / 1e-30, rel=1e-12)


def average(body, probes, u):
    """Return the SED of patches as `FinitePatches.average` does, of displacements that may be complex."""
    gradients = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1)
    log = np.log(determinant(np.eye(2) + np.einsum("eia,eqiA->eqaA", u[body.elements.nodes], gradients)))
    volume = np.einsum("eq,eqm,eq->em", body.elements.weight, body.elements.modes, log)
    places = probes.endings.probes
    F = np.eye(2) + np.einsum("pia,pAi->paA", u[body.elements.nodes[places.element]], places.gradient)
    Q = np.sum(F * F, axis=(-2, -1)) - 2.0 - 2.0 * np.log(determinant(F))
    shear, lame = body.elements.shear[places.element], body.elements.lame[places.element]
    stretch_energy = Q if body.elements.stiffening[0] == 2.0 else grown(body.elements.stiffening[places.element], Q)
    modes = np.einsum("pml,pl->pm", body.combination[places.element], places.modes)
    energy = shear / 2.0 * stretch_energy + lame / 2.0 * np.sum(modes * volume[places.element], axis=1) ** 2
    totals = [np.sum((energy * probes.endings.weights)[probes.endings.patch == n]) for n in range(3)]
    return np.array(totals) / np.bincount(probes.endings.patch, probes.endings.weights)


def determinant(f):
    return f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]


def test_a_state_that_is_no_slide_has_no_derivatives_of_its_own(finite):
    slide = FINITE["without a bound"]
    state = slip(finite, slide)
    with pytest.raises(ValueError, match="depends on its load path"):
        Nearby(slide, replace(state, load=state.load._replace(sense=0)), finite).derivatives()
