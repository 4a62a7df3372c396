"""Cylinders on a flat rigid surface: Hertz, Smith and Liu, Cattaneo and Mindlin, Coulomb with a bound.

K. L. Johnson, Contact Mechanics, Cambridge 1985, chapters 4, 5 and 7. Half-plane problems run on a block so wide that
its sides are not felt, in units of the half-width a; whole cylinders run as they are.
"""

from dataclasses import replace

import numpy as np
import pytest

from daq_app.accuracy.published.bodies import chain, disc, graded, mirrored, mound, skin_motion, stress, touching_within
from solver.body import Body, edge_load
from solver.contact import CAP, OPEN, SLIP, STICK, Course, forced
from solver.friction import FrictionLaw
from solver.materials import Hooke

ELEMENT = 1 / 30  # of the half-width
RADIUS = 1000.0  # in half-widths: theirs is the limit of light loads
NONE = FrictionLaw(0.0, np.inf)


def half_plane(half_width, radius, law, wide=100.0):
    """A half-plane with elements of 1/30 of the half-width where it touches; radius inf: flat."""
    x = mirrored(graded(ELEMENT, 0.3, 1.2, wide)) * half_width
    y = graded(ELEMENT, 0.3, 0.0, wide) * half_width
    return Body.of(mound(x, y, radius, 3.0 * half_width), [law])


def pressed(body, load, half_width):
    return Course(forced(body.touchable, load), NONE).sliding(0.0, 1, touching_within(body, 1.05 * half_width))


class Light:
    """Half-width 1, p0 = 1 in the numbers returned, nearly incompressible so that normal and shear do not couple."""

    def __init__(self, nu=0.4999, wide=100.0):
        plane = 0.08 / (1 - nu**2)
        self.load = np.pi * plane / (4 * RADIUS)
        self.peak = 2 * self.load / np.pi
        self.body = half_plane(1.0, RADIUS, Hooke(0.08, nu), wide)
        self.x = self.body.mesh.nodes[self.body.mesh.skin, 0]
        self.length = self.body.touchable.length
        self.free = forced(self.body.touchable, self.load)
        self.found = pressed(self.body, self.load, 1.0)


@pytest.fixture(scope="module")
def light():
    return Light()


# E, nu, R, P, a, p0: the closed forms; the last is two metals, as one body of their common stiffness
# (FENET-UNOTT-DLE-09, Konter 2005: 6.21 mm, 3585 MPa)
CASES = [
    (0.08, 0.48, 5.0, 0.01, 0.782578, 0.008135),
    (0.08, 0.48, 5.0, 0.05, 1.749897, 0.018190),
    (0.034, 0.48, 5.0, 0.02, 1.697650, 0.007500),
    (0.136, 0.48, 5.0, 0.1, 1.898030, 0.033541),
    (57692.3 * (1 - 0.3**2), 0.3, 50.0, 35000.0, 6.2146, 3585.4),
]


@pytest.mark.parametrize(("young", "nu", "radius", "load", "half_width", "peak"), CASES)
def test_half_width_and_pressure_are_those_of_hertz(young, nu, radius, load, half_width, peak):
    """With a/R up to 0.4 the theory is one of a half-plane under the gap of a parabola: so is the body here."""
    body = half_plane(half_width, np.inf, Hooke(young, nu))
    x = body.mesh.nodes[body.mesh.skin, 0]
    body = replace(body, touchable=replace(body.touchable, gap=x**2 / (2 * radius)))
    found = pressed(body, load, half_width)
    pressure = found.normal / body.touchable.length
    assert found.normal.sum() == pytest.approx(load, rel=1e-10)
    # the half-width that the pressure's second moment tells, a = 2 sqrt(<x^2>), and the touching nodes themselves
    assert 2 * np.sqrt(found.normal @ x**2 / load) == pytest.approx(half_width, rel=1e-3)
    assert np.ptp(x[found.touching]) / 2 == pytest.approx(half_width, abs=0.51 * ELEMENT * half_width)
    assert pressure[len(x) // 2] == pytest.approx(peak, rel=1e-3)
    inside = np.abs(x) < 0.9 * half_width
    hertz = peak * np.sqrt(1 - (x[inside] / half_width) ** 2)
    assert np.abs(pressure[inside] - hertz).max() < 2e-3 * peak


def whole_cylinder(load, a, peak):
    mesh = disc(5.0, 0.05, 1.0)
    above = mesh.nodes - [0.0, 5.0]
    top = chain(np.isclose(np.hypot(*above.T), 5.0) & (above[:, 1] > 0), above[:, 0])
    traction = np.zeros((len(top), 2))
    traction[:, 1] = -peak * np.sqrt(np.clip(1 - (mesh.nodes[top, 0] / a) ** 2, 0, None))
    loads = edge_load(mesh, top, traction)
    body = Body.of(mesh, [Hooke(0.08, 0.48)], loads * (load / -loads.sum()), free=("y", "turn"))
    found = Course(body.touchable, NONE).sliding(0.0, 1, touching_within(body, 0.9 * a))
    return body, found


def test_a_round_body_touches_and_presses_as_hertz_says(light):
    pressure = light.found.normal / light.length
    assert 2 * np.sqrt(light.found.normal @ light.x**2 / light.load) == pytest.approx(1.0, rel=1e-3)
    assert pressure[len(light.x) // 2] == pytest.approx(light.peak, rel=1e-3)
    assert np.ptp(light.x[light.found.touching]) / 2 == pytest.approx(1.0, abs=0.01)


def test_a_whole_cylinder_between_two_plates_approaches_them_as_in_johnson_5_57():
    """delta = P/(pi E*) [2 ln(4R/a) - 1]; a/R = 0.16, whose square is what the theory neglects."""
    load, a, peak = 0.01, 0.782578, 0.008135
    body, found = whole_cylinder(load, a, peak)
    mesh, touch = body.mesh, body.touchable
    moved = body.displacement(skin_motion(body, found)[:, None])[:, :, 0]
    centre = np.argmin(np.hypot(*(mesh.nodes - [0.0, 5.0]).T))
    assert -moved[centre, 1] == pytest.approx(0.167860, rel=0.005)
    x = mesh.nodes[mesh.skin, 0]
    assert found.normal.sum() == pytest.approx(load, rel=1e-10)
    assert 2 * np.sqrt(found.normal @ x**2 / load) == pytest.approx(a, rel=0.01)
    assert (found.normal / touch.length).max() == pytest.approx(peak, rel=0.01)


AXIS = np.array([0.25, 0.5, 0.786, 1.0, 1.5])


def test_on_the_axis_the_stresses_are_those_of_hertz_and_the_largest_shear_is_below_the_surface():
    light = Light(wide=300.0)
    moved = unfolded(light, light.found)
    found = stress(light.body, moved, np.stack([0 * AXIS, AXIS], axis=1)) / light.peak
    root = np.sqrt(1 + AXIS**2)
    assert np.abs(found[:, 0, 0] + (1 + 2 * AXIS**2) / root - 2 * AXIS).max() < 0.005
    assert np.abs(found[:, 1, 1] + 1 / root).max() < 0.005
    depths = np.linspace(0.6, 1.0, 41)
    found = stress(light.body, moved, np.stack([0 * depths, depths], axis=1)) / light.peak
    shear = (found[:, 0, 0] - found[:, 1, 1]) / 2
    assert shear.max() == pytest.approx(0.300, rel=0.01)
    assert np.interp(0.786, depths, shear) == pytest.approx(0.300, rel=0.01)


def unfolded(light, found):
    forces = np.concatenate([found.normal, found.tangential])
    return light.body.displacement(light.body.skin_displacement(forces[:, None]))[:, :, 0]


# x, z, sigma_x, sigma_z, tau_xz by p0 in units of a (quadrature of the Flamant kernels)
BELOW = {
    0.0: [
        (0.0, 0.25, -0.59141, -0.97014, 0.0),
        (0.0, 0.786, -0.18564, -0.78621, 0.0),
        (0.5, 0.5, -0.31352, -0.74465, -0.17579),
        (1.0, 0.5, -0.29741, -0.30308, -0.23664),
    ],
    0.25: [
        (0.0, 0.5, -0.34164, -0.89443, -0.08541),
        (0.5, 0.5, -0.39810, -0.78860, -0.25417),
        (-0.5, 0.5, -0.22893, -0.70071, 0.09741),
        (1.0, 0.5, -0.42584, -0.36224, -0.31099),
    ],
}


@pytest.mark.parametrize("mu", BELOW)
def test_below_a_sliding_cylinder_the_stresses_are_those_of_smith_and_liu(mu):
    """The surface drags the body along +x. The block is 600 half-widths wide; what that leaves out is 0.3 % of p0."""
    light = Light(wide=300.0)
    found = Course(light.free, FrictionLaw(mu, np.inf)).sliding(0.0, -1, light.found.state)
    table = np.array(BELOW[mu])
    got = stress(light.body, unfolded(light, found), table[:, :2]) / light.peak
    assert np.abs(got[:, 0, 0] - table[:, 2]).max() < 0.005
    assert np.abs(got[:, 1, 1] - table[:, 3]).max() < 0.005
    assert np.abs(got[:, 0, 1] - table[:, 4]).max() < 0.005
    largest = np.hypot((got[:, 0, 0] - got[:, 1, 1]) / 2, got[:, 0, 1])
    told = np.hypot((table[:, 2] - table[:, 3]) / 2, table[:, 4])
    assert np.abs(largest - told).max() < 0.005


def sheared(light, law, part):
    """The state after a tangential force `part` mu P along -x on the body's far side was put on what only pressed."""
    count = len(light.x)
    along = np.concatenate([np.zeros(count), np.ones(count)])[:, None]
    body = replace(
        light.free,
        motions=np.hstack([light.free.motions, along]),
        resultants=np.append(light.free.resultants, -part * law.mu * light.load),
    )
    before = replace(light.found, state=np.where(light.found.touching, STICK, OPEN).astype(np.int8))
    return Course(body, law).step(before, 0.0, 0.0)


@pytest.mark.parametrize("part", [0.1, 0.25, 0.5, 0.75, 0.9, 0.99])
@pytest.mark.parametrize("mu", [0.01, 0.3])
def test_partial_slip_is_that_of_cattaneo_and_mindlin(light, mu, part):
    """Stick for |x| < c = sqrt(1 - Q/(mu P)); q = mu p less mu p0 c sqrt(1 - x^2/c^2) inside."""
    found = sheared(light, FrictionLaw(mu, np.inf), part)
    x, c, top = light.x, np.sqrt(1 - part), mu * light.peak
    assert -found.tangential.sum() == pytest.approx(part * mu * light.load, rel=1e-10)
    sticks = x[found.state == STICK]
    assert np.ptp(sticks) / 2 == pytest.approx(c, abs=0.02)
    traction = -found.tangential / light.length
    closed = np.sqrt(np.clip(1 - x**2, 0, None)) - c * np.sqrt(np.clip(1 - (x / c) ** 2, 0, None))
    assert traction[len(x) // 2] == pytest.approx(top * (1 - c), rel=0.02)
    # the closed form has an upright tangent at both edges, which the elements there can only round
    smooth = (np.abs(x) < 1 - ELEMENT) & (np.abs(np.abs(x) - c) > ELEMENT)
    assert np.abs(traction - top * closed)[smooth].max() < 0.01 * top


@pytest.mark.parametrize(("k", "force"), [(1.0, 1.0), (0.8, 0.895912), (0.6, 0.715243), (0.4, 0.495368)])
def test_a_bound_on_a_hertz_pressure_carries_the_elementary_integral(light, k, force):
    """Q/(mu P) for k = tau_max/(mu p0); the bound acts for |x| < sqrt(1 - k^2)."""
    mu = 0.3
    found = Course(light.free, FrictionLaw(mu, k * mu * light.peak)).sliding(0.0, 1, light.found.state)
    assert -found.tangential.sum() / (mu * light.load) == pytest.approx(force, rel=0.005)
    capped = light.x[found.state == CAP]
    assert (np.ptp(capped) / 2 if len(capped) else 0.0) == pytest.approx(np.sqrt(1 - k**2), abs=0.03)
    assert set(found.state.tolist()) <= {OPEN, SLIP, CAP}
