"""Cylinders on a flat rigid surface: Hertz, Smith and Liu, Cattaneo and Mindlin, Coulomb with a bound.

K. L. Johnson, Contact Mechanics, Cambridge 1985, chapters 4, 5 and 7. Half-plane problems run on a block so wide that
its sides are not felt, in units of the half-width a; whole cylinders run as they are.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from daq_app.accuracy.published.bodies import (
    chain,
    disc,
    graded,
    mirrored,
    mound,
    skin_motion,
    stress,
    touching_within,
)
from daq_app.accuracy.published.zones import half_above, half_width
from solver.body.linear import Body, edge_load
from solver.constitutive.linear import Hooke
from solver.contact.active_set import OPEN, STICK, Contact, Course, Touchable, forced
from solver.contact.law import FrictionLaw
from solver.mesh import Array

ELEMENT = 1 / 30  # of the half-width
RADIUS = 1000.0  # in half-widths: the theory's limit of light loads
NONE = FrictionLaw(0.0, np.inf)


def half_plane(half_width: float, radius: float, law: Hooke, wide: float = 100.0) -> Body:
    """Return a half-plane with elements of 1/30 of the half-width where it touches; radius inf: flat."""
    x = mirrored(graded(ELEMENT, 0.3, 1.2, wide)) * half_width
    y = graded(ELEMENT, 0.3, 0.0, wide) * half_width
    return Body.of(mound(x, y, radius, 3.0 * half_width), [law])


def pressed(body: Body, load: float, half_width: float) -> Contact:
    """Return the contact of a body pressed by `load` [N/mm]."""
    return Course(forced(body.touchable, load), NONE).sliding(0.0, 1, touching_within(body, 1.05 * half_width))


def press(finest: float, nu: float) -> float:
    """Return the force [N/mm] of a light half-plane on elements of that size, pressed by 1e-3 half-widths."""
    x, y = mirrored(graded(finest, 0.3, 1.2, 20.0)), graded(finest, 0.3, 0.0, 20.0)
    body = Body.of(mound(x, y, RADIUS, 3.0), [Hooke(0.08, nu)])
    return float(Course(body.touchable, NONE).sliding(1e-3, 1).normal.sum())


@dataclass(frozen=True, slots=True)
class Hertz:
    """What a pressed half-plane under the gap of a parabola shows."""

    load: float  # [N/mm]
    half_width: float  # from the pressure's second moment, a = 2 sqrt(<x^2>) [mm]
    touched: float  # half the distance from the first to the last touching node [mm]
    peak: float  # pressure in the middle [MPa]
    worst: float  # largest difference of the pressure from the ellipse inside 0.9 a, by the peak


def hertz(young: float, nu: float, radius: float, load: float, half_width: float, peak: float) -> Hertz:
    """Return what is found for a load whose closed form has `half_width` [mm] and `peak` [MPa]."""
    body = half_plane(half_width, np.inf, Hooke(young, nu))
    x = body.mesh.nodes[body.mesh.skin, 0]
    body = replace(body, touchable=replace(body.touchable, gap=x**2 / (2 * radius)))
    found = pressed(body, load, half_width)
    pressure = found.normal / body.touchable.length
    inside = np.abs(x) < 0.9 * half_width
    ellipse = peak * np.sqrt(1 - (x[inside] / half_width) ** 2)
    return Hertz(
        float(found.normal.sum()), 2 * float(np.sqrt(found.normal @ x**2 / load)),
        float(np.ptp(x[found.touching])) / 2, float(pressure[len(x) // 2]),
        float(np.abs(pressure[inside] - ellipse).max()) / peak,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Cylinder:
    """What a whole cylinder between two plates shows."""

    approach: float  # of the plate to the centre [mm]
    load: float
    half_width: float
    peak: float


def whole_cylinder(load: float, half_width: float, peak: float) -> Cylinder:
    """Return what is found for a cylinder of radius 5 mm under `load`, pressed from above as Hertz says."""
    mesh = disc(5.0, 0.05, 1.0)
    x, y = (mesh.nodes - [0.0, 5.0]).T
    top = chain(np.isclose(np.hypot(x, y), 5.0) & (y > 0), x)
    traction = np.zeros((len(top), 2))
    traction[:, 1] = -peak * np.sqrt(np.clip(1 - (mesh.nodes[top, 0] / half_width) ** 2, 0, None))
    loads = edge_load(mesh, top, traction)
    body = Body.of(mesh, [Hooke(0.08, 0.48)], loads * (load / -loads.sum()), free=("y", "turn"))
    found = Course(body.touchable, NONE).sliding(0.0, 1, touching_within(body, 0.9 * half_width))
    moved = body.displacement(skin_motion(body, found)[:, None])[:, :, 0]
    centre = int(np.argmin(np.hypot(x, y)))
    at = mesh.nodes[mesh.skin, 0]
    return Cylinder(
        -float(moved[centre, 1]), float(found.normal.sum()), 2 * float(np.sqrt(found.normal @ at**2 / load)),
        float((found.normal / body.touchable.length).max()),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A light contact of half-width 1 and the load that makes it, nearly incompressible so that nothing couples."""

    body: Body
    load: float
    peak: float
    x: Array  # (k,) of the skin's nodes
    length: Array  # (k,)
    free: Touchable  # the body under its load
    found: Contact

    def displacement(self, state: Contact) -> Array:
        """Return the displacement (nodes, 2) of the whole body."""
        forces = np.concatenate([state.normal, state.tangential])
        return self.body.displacement(self.body.skin_displacement(forces[:, None]))[:, :, 0]

    def stress(self, state: Contact, points: Array) -> Array:
        """Return the stress (p, 2, 2) at `points` (p, 2), by the peak pressure."""
        return stress(self.body, self.displacement(state), points) / self.peak

    def sheared(self, law: FrictionLaw, part: float) -> Contact:
        """Return the state after a tangential force `part` mu P along -x on the far side of what only pressed."""
        count = len(self.x)
        along = np.concatenate([np.zeros(count), np.ones(count)])[:, None]
        body = replace(
            self.free,
            motions=np.hstack([self.free.motions, along]),
            resultants=np.append(self.free.resultants, -part * law.mu * self.load),
        )
        before = replace(self.found, state=np.where(self.found.touching, STICK, OPEN).astype(np.int8))
        return Course(body, law).step(before, 0.0, 0.0)

    def slid(self, law: FrictionLaw, direction: int = 1) -> Contact:
        """Return the state of full slip; the body moves along `direction` x."""
        return Course(self.free, law).sliding(0.0, direction, self.found.state)


@cache
def light(nu: float = 0.4999, wide: float = 100.0) -> Light:
    """Return the light contact; `wide` half-widths of body to each side."""
    plane = 0.08 / (1 - nu**2)
    load = np.pi * plane / (4 * RADIUS)
    body = half_plane(1.0, RADIUS, Hooke(0.08, nu), wide)
    x = body.mesh.nodes[body.mesh.skin, 0]
    return Light(
        body, load, 2 * load / np.pi, x, body.touchable.length, forced(body.touchable, load), pressed(body, load, 1.0)
    )


def stick_width(light: Light, state: Contact, mu: float) -> float:
    """Return half the width of the stick: what friction could carry and does not, mu p - q, falls to nothing there."""
    return half_width(light.x, mu * state.normal + state.tangential, state.state == STICK)


def capped_width(light: Light, state: Contact, law: FrictionLaw) -> float:
    """Return half the width of what slips at the bound: where mu p crosses it."""
    return half_above(light.x, law.mu * state.normal / light.length - law.tau_max)
