# ruff: noqa: N806 - the letters of the literature
"""Derivatives from the converged tangent: against differences of tight solves, complex steps and closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Scene, Solve
from solver._kernels.compiling import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.body import CondensedLinear, Endings, Probes
from solver.body.finite import FiniteBody, FinitePatches
from solver.constitutive import NeoHooke, Ogden
from solver.constitutive import shape as grown
from solver.continuation.small_states import settled_state
from solver.equilibrium import LoadState, Newton, load_stepping
from solver.equilibrium import load_stepping as sliding
from solver.equilibrium.finger import FiniteFinger, LinearFinger
from solver.mesh.mesher import Sizing
from solver.quantities import QUANTITIES
from solver.response.nearby import of_skin, of_slide, slope
from tests.solver.finite_examples import block

NAMES = ("mu", "tau_max", "press")


def scene(mu, tau_max, loading, kinematics="small"):
    return Scene(friction=Friction(mu, tau_max), loading=loading, solve=Solve(kinematics))


def moved(scene, name, by):
    """Return the scene with one parameter changed by so much; "press" is the depth, or the force where that drives."""
    friction, loading = scene.friction, scene.loading
    if name == "press" and loading.normal_force is None:
        return replace(scene, loading=replace(loading, indentation=loading.indentation + by))
    if name == "press":
        return replace(scene, loading=replace(loading, normal_force=loading.normal_force + by))
    return replace(scene, friction=replace(friction, **{name: getattr(friction, name) + by}))


def told(found):
    """Return derivatives as a table: SED, normal force, drag, depth, then each quantity, by mu, tau_max and press."""
    rows = (found.sed, found.normal, found.tangential, found.indentation, *found.responses.values())
    return np.array([[one for one in by if one is not None] for by in rows])


def differences(numbers, scene, steps):
    """Return the same table from central differences of solves; `numbers` gives its rows' numbers of a scene."""
    none = np.zeros(4 + len(QUANTITIES))
    columns = [(numbers(moved(scene, n, h)) - numbers(moved(scene, n, -h))) / (2 * h) if h else none
               for n, h in zip(NAMES, steps, strict=True)]  # fmt: skip
    return np.stack(columns, axis=1)


def assert_alike(found, expected, scale):
    """Assert that tables agree to 1e-6 of each entry; `scale` are the numbers, to whose round-off 0 is known."""
    for row, other, number in zip(found, expected, scale, strict=True):
        np.testing.assert_allclose(row, other, rtol=1e-6, atol=1e-8 * abs(number))


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
    here = SMALL[name]
    contact = settled_state(here, small)
    assert ("at the bound" in name) == (contact.state == SHEAR_LIMITED).any()

    def numbers(one):
        return small_numbers(small, one, contact.state)

    steps = (2e-5, 2e-7 if here.friction.tau_max else 0.0, 2e-5)
    assert_alike(told(of_slide(small, here, contact)), differences(numbers, here, steps), numbers(here))


def test_between_changes_of_state_forces_are_straight_in_the_depth_and_the_sed_a_parabola(small):
    # Closed form: a slope of a straight line and of a parabola are those of their chords, however long.
    here = SMALL["beside its limit"]
    contact = settled_state(here, small)
    found = of_slide(small, here, contact)
    wide = [small_numbers(small, moved(here, "press", by), contact.state) for by in (-5e-3, 5e-3)]
    assert (wide[1] - wide[0])[:3] / 1e-2 == pytest.approx(told(found)[:3, 2], rel=1e-9)


def test_a_given_force_drags_with_mu_times_it(small):
    here = SMALL["under a force"]
    found = of_slide(small, here, settled_state(here, small))
    assert found.tangential.mu == pytest.approx(0.12, rel=1e-12)
    assert found.tangential.normal_force == pytest.approx(0.4, rel=1e-12)
    assert found.normal == (0.0, 0.0, None, 1.0)


def springs(coupling):
    """Two points that may touch, the second higher than any depth, of compliance 3 along y and 5 along x."""
    stiffness = np.kron(np.eye(2), np.linalg.inv([[5.0, coupling], [coupling, 3.0]]))
    rest = np.array([[0.0, 0.0], [1.0, 9.0]])
    return Newton(CondensedLinear(rest, stiffness, np.zeros(4), np.array([0.7, 0.7]), np.zeros(2, np.int32)))


def test_one_point_on_springs_answers_as_its_formula_says():
    """N = d / (3 + s mu b), and at the bound N = (d - s b tau L) / 3, with s = -1 for a slide along +x."""
    d, b, mu, tau, length = 0.6, 0.8, 0.5, 0.04, 0.7
    newton, load = springs(b), LoadState(d, mu, sense=-1)
    along, up = newton.follows(of_skin(newton, sliding.solve_full_slip(newton, load)))
    soft = 3.0 - mu * b
    assert up == pytest.approx([b * d / soft**2, 0.0, 1.0 / soft], rel=1e-13)
    assert along == pytest.approx([-d / soft - mu * b * d / soft**2, 0.0, -mu / soft], rel=1e-13)
    capped = sliding.solve_full_slip(newton, load._replace(tau=tau))
    assert capped.state.tolist() == [SHEAR_LIMITED, OPEN]
    along, up = newton.follows(of_skin(newton, capped))
    assert up == pytest.approx([0.0, b * length / 3.0, 1.0 / 3.0], rel=1e-13)
    assert along == pytest.approx([0.0, -length, 0.0], rel=1e-13)


def test_at_a_kink_each_side_has_the_slope_of_its_own_states(small):
    # A depth at which one more point comes to touch, found by halving.
    here = SMALL["without a bound"]

    def at(depth):
        return settled_state(moved(here, "press", depth - 1.2), small)

    low, high = 1.2, 1.3
    assert at(low).touching.sum() < at(high).touching.sum()
    while high - low > 1e-11:
        middle = (low + high) / 2.0
        low, high = (middle, high) if at(middle).touching.sum() == at(1.2).touching.sum() else (low, middle)
    slopes = []
    for side, depth in ((-1.0, low), (1.0, high)):
        far, near = (small.numbers([at(depth + side * by)])[0, 0] for by in (1e-3, 0.0))
        begun, ended = (
            of_slide(small, moved(here, "press", one - 1.2), at(one)).sed.indentation
            for one in (depth, depth + side * 1e-3)
        )
        assert side * (far - near) / 1e-3 == pytest.approx((begun + ended) / 2.0, rel=1e-6)  # a parabola's chord
        slopes.append(begun)
    assert abs(slopes[1] / slopes[0] - 1.0) > 1e-4
    assert small.numbers([at(low)])[0, 0] == pytest.approx(small.numbers([at(high)])[0, 0], rel=1e-9)


def test_a_state_that_sticks_has_no_derivatives_of_its_own(small):
    contact = settled_state(SMALL["without a bound"], small)
    stuck = replace(contact, state=np.where(contact.state == SLIP, STICK, contact.state).astype(np.int32))
    with pytest.raises(ValueError, match="depends on the way"):
        of_slide(small, SMALL["without a bound"], stuck)


# Finite strain


@pytest.fixture(scope="module")
def finite():
    return FiniteFinger.of(scene(0.0, None, Loading(1.2), "finite"), Sizing(5.0, 1.2, margin=3.0))


def load_of(scene, depth):
    return LoadState(depth, scene.friction.mu, scene.friction.cap, -scene.loading.direction)


def slip(finger, scene, start=None):
    depth = scene.loading.indentation or 0.6
    shape = sliding.solve_full_slip(finger.newton, load_of(scene, depth), start, 1e-12)
    if scene.normal_force is None:
        return shape
    return load_stepping.solve_under_forces(
        finger.newton, shape, load_stepping.ForceLoad(scene.normal_force, None), 1e-12
    )


def finite_numbers(finger, scene, here):
    shape = slip(finger, scene, replace(here, load=load_of(scene, here.load.depth)))
    assert (shape.state == here.state).all()
    sed, normal, tangential, *rest = finger.all_numbers([shape])[0]
    return np.array([sed, normal, -scene.loading.direction * tangential, shape.load.depth, *rest[-len(QUANTITIES) :]])


FINITE = {
    "without a bound": scene(0.3, None, Loading(1.2), "finite"),
    "at the bound, slid back": scene(0.4, 0.008, Loading(1.2, "-x"), "finite"),
    "under a force, at the bound": scene(0.4, 0.005, Loading(normal_force=0.06), "finite"),
}


@pytest.mark.parametrize("name", FINITE)
def test_at_finite_strain_they_are_the_differences_of_solves_within_one_set_of_states(finite, name):
    here = FINITE[name]
    shape = slip(finite, here)
    assert ("at the bound" in name) == (shape.state == SHEAR_LIMITED).any()

    def numbers(one):
        return finite_numbers(finite, one, shape)

    steps = (1e-5, 1e-7 if here.friction.tau_max else 0.0, 1e-5)
    found = told(of_slide(finite, here, shape))
    assert_alike(found, differences(numbers, here, steps), numbers(here))


@pytest.mark.parametrize("law", [NeoHooke(0.08, 0.48), Ogden(0.08, 0.48)], ids=str)
def test_how_the_sed_of_a_patch_bends_is_a_complex_step_of_its_energy(law):
    mesh = block(distortion=0.06)
    body = FiniteBody.of(mesh, [law])
    elements = np.repeat(np.arange(len(mesh.elements)), 2)
    local = np.random.default_rng(1).uniform(-0.9, 0.9, (len(elements), 2))
    places = Probes.at(mesh, body.centre, elements, local)
    count = len(elements)
    probes = FinitePatches(
        body, Endings(places, np.linspace(1.0, 2.0, count), np.arange(count) % 3, 3, np.tile([1.0, 0.0], (count, 1)))
    )
    draw = np.random.default_rng(2)
    u, steps = draw.uniform(-0.015, 0.015, mesh.nodes.shape), draw.normal(size=(*mesh.nodes.shape, 2))
    found = slope(probes, u, steps)[0]
    for column in range(2):
        expected = average(body, probes, u + 1e-30j * steps[..., column])
        assert np.real(expected) == pytest.approx(probes.average(u), rel=1e-12)
        assert found[:, column] == pytest.approx(np.imag(expected) / 1e-30, rel=1e-12)


def average(body, probes, u):
    """Return the SED of patches as `FinitePatches.average` does, of displacements that may be complex."""
    inside = np.stack([body.elements.grad_x, body.elements.grad_y], axis=-1)
    log = np.log(determinant(np.eye(2) + np.einsum("eia,eqiA->eqaA", u[body.elements.nodes], inside)))
    volume = np.einsum("eq,eqm,eq->em", body.elements.weight, body.elements.modes, log)
    at = probes.endings.probes
    F = np.eye(2) + np.einsum("pia,piA->paA", u[body.elements.nodes[at.element]], at.gradient)
    Q = np.sum(F * F, axis=(-2, -1)) - 2.0 - 2.0 * np.log(determinant(F))
    shear, lame = body.elements.shear[at.element], body.elements.lame[at.element]
    stretched = Q if body.elements.stiffening[0] == 2.0 else grown(body.elements.stiffening[at.element], Q)
    modes = np.einsum("pml,pl->pm", body.combination[at.element], at.modes)
    energy = shear / 2.0 * stretched + lame / 2.0 * np.sum(modes * volume[at.element], axis=1) ** 2
    totals = [np.sum((energy * probes.endings.weights)[probes.endings.patch == n]) for n in range(3)]
    return np.array(totals) / np.bincount(probes.endings.patch, probes.endings.weights)


def determinant(f):
    return f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]


def test_a_state_that_is_no_slide_has_no_derivatives_of_its_own(finite):
    here = FINITE["without a bound"]
    shape = slip(finite, here)
    with pytest.raises(ValueError, match="depends on the way"):
        of_slide(finite, here, replace(shape, load=shape.load._replace(sense=0)))
