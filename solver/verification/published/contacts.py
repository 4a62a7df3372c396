"""Cylinders on a flat rigid surface: Hertz, Smith and Liu, Cattaneo and Mindlin, Coulomb with a bound.

K. L. Johnson, Contact Mechanics, Cambridge 1985, chapters 4, 5 and 7. Half-plane problems run in units of the
half-width a, on a block so wide that its sides have no effect; whole cylinders have their own lengths.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from solver.arrays import Array
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import Hooke
from solver.contact import OPEN, STICK, FrictionLaw
from solver.equilibrium import EquilibriumState, ForceLoad, LoadState, Newton
from solver.equilibrium.load_stepping import slide_from_guess, solve_full_slip, solve_under_forces
from solver.verification.published.bodies import chain, disc, grade, mirror, mound, stress, touching_within
from solver.verification.published.zones import half_above, half_width

ELEMENT = 1 / 30  # of the half-width
RADIUS = 1000.0  # in half-widths: the theory's limit of light loads
NONE = LoadState(0.0, 0.0, sense=-1)


def half_plane(half_width: float, radius: float, law: Hooke, wide: float = 100.0) -> LinearBody:
    """Return a half-plane with elements of 1/30 of the half-width in the contact; an infinite `radius` is flat."""
    x = mirror(grade(ELEMENT, 0.3, 1.2, wide)) * half_width
    y = grade(ELEMENT, 0.3, 0.0, wide) * half_width
    return LinearBody.of(mound(x, y, radius, 3.0 * half_width), [law])


def press_under_load(newton: Newton, load: float, half_width: float) -> EquilibriumState:
    """Return the contact of a body pressed by `load` [N/mm]."""
    return slide_from_guess(newton, NONE, touching_within(newton, 1.05 * half_width), load)


def press(finest: float, nu: float) -> float:
    """Return the force [N/mm] on a half-plane with elements of size `finest`, pressed lightly, by 1e-3 half-widths."""
    x, y = mirror(grade(finest, 0.3, 1.2, 20.0)), grade(finest, 0.3, 0.0, 20.0)
    body = LinearBody.of(mound(x, y, RADIUS, 3.0), [Hooke(0.08, nu)])
    return float(solve_full_slip(Newton(body.condensed), NONE._replace(depth=1e-3)).force[1])


@dataclass(frozen=True, slots=True)
class Hertz:
    """Results of a half-plane pressed under the gap of a parabola."""

    load: float  # [N/mm]
    half_width: float  # from the pressure's second moment, a = 2 sqrt(<x^2>) [mm]
    touched: float  # half the distance from the first to the last touching node [mm]
    peak: float  # pressure in the middle [MPa]
    worst: float  # largest difference of the pressure from the ellipse inside 0.9 a, by the peak


def hertz(young: float, nu: float, radius: float, load: float, half_width: float, peak: float) -> Hertz:
    """Return the results for a load whose closed form has `half_width` [mm] and `peak` [MPa]."""
    body = half_plane(half_width, np.inf, Hooke(young, nu))
    x = body.mesh.nodes[body.mesh.skin, 0]
    body.condensed.rest[:, 1] = x**2 / (2 * radius)
    slide = press_under_load(Newton(body.condensed), load, half_width)
    pressure = slide.normal / body.condensed.fixed_length
    inside = np.abs(x) < 0.9 * half_width
    ellipse = peak * np.sqrt(1 - (x[inside] / half_width) ** 2)
    return Hertz(
        float(slide.normal.sum()), 2 * float(np.sqrt(slide.normal @ x**2 / load)),
        float(np.ptp(x[slide.touching])) / 2, float(pressure[len(x) // 2]),
        float(np.abs(pressure[inside] - ellipse).max()) / peak,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Results of a whole cylinder between two plates."""

    approach: float  # of the plate to the centre [mm]
    load: float
    half_width: float
    peak: float


def whole_cylinder(load: float, half_width: float, peak: float) -> Cylinder:
    """Return the results of a cylinder of radius 5 mm under `load`, pressed from above by Hertz's pressure."""
    mesh = disc(5.0, 0.05, 1.0)
    x, y = (mesh.nodes - [0.0, 5.0]).T
    top = chain(np.isclose(np.hypot(x, y), 5.0) & (y > -1e-9), x)
    traction = np.zeros((len(top), 2))
    traction[:, 1] = -peak * np.sqrt(np.clip(1 - (mesh.nodes[top, 0] / half_width) ** 2, 0, None))
    loads = edge_load(mesh, top, traction)
    body = LinearBody.of(mesh, [Hooke(0.08, 0.48)], loads * (load / -loads.sum()), free=("y", "turn"))
    newton = Newton(body.condensed)
    slide = slide_from_guess(newton, NONE, touching_within(newton, 0.9 * half_width))
    displacement = body.displacement(slide.u)
    centre = int(np.argmin(np.hypot(x, y)))
    at = mesh.nodes[mesh.skin, 0]
    return Cylinder(
        -float(displacement[centre, 1]), float(slide.normal.sum()), 2 * float(np.sqrt(slide.normal @ at**2 / load)),
        float((slide.normal / body.condensed.fixed_length).max()),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A light contact of half-width 1 and its load; the body is nearly incompressible, so nothing couples."""

    body: LinearBody
    load: float
    peak: float
    x: Array  # (k,) of the skin's nodes
    length: Array  # (k,)
    newton: Newton
    press: EquilibriumState

    def stress(self, state: EquilibriumState, points: Array) -> Array:
        """Return the stress (p, 2, 2) at `points` (p, 2), by the peak pressure."""
        return stress(self.body, self.body.displacement(state.u), points) / self.peak

    def shear(self, law: FrictionLaw, part: float) -> EquilibriumState:
        """Return the state after a tangential force `part` mu P along -x on the far side of the pressed state."""
        stuck = np.where(self.press.touching, STICK, OPEN).astype(np.int32)
        before = replace(self.press, state=stuck, load=LoadState(self.press.load.depth, law.mu, law.tau_max))
        return solve_under_forces(self.newton, before, ForceLoad(self.load, -part * law.mu * self.load))

    def slip(self, law: FrictionLaw, direction: int = 1) -> EquilibriumState:
        """Return the state of full slip; the body moves along `direction` x."""
        load = LoadState(0.0, law.mu, law.tau_max, -direction)
        return slide_from_guess(self.newton, load, self.press.state, self.load)


@cache
def light(nu: float = 0.4999, wide: float = 100.0) -> Light:
    """Return the light contact; `wide` half-widths of body to each side."""
    plane = 0.08 / (1 - nu**2)
    load = np.pi * plane / (4 * RADIUS)
    body = half_plane(1.0, RADIUS, Hooke(0.08, nu), wide)
    x = body.mesh.nodes[body.mesh.skin, 0]
    newton = Newton(body.condensed)
    return Light(
        body, load, 2 * load / np.pi, x, body.condensed.fixed_length, newton, press_under_load(newton, load, 1.0)
    )


def stick_width(light: Light, state: EquilibriumState, mu: float) -> float:
    """Return half the width of the stick zone, at whose ends mu p - q falls to zero."""
    return half_width(light.x, mu * state.normal + state.tangential, state.state == STICK)


def capped_width(light: Light, state: EquilibriumState, law: FrictionLaw) -> float:
    """Return half the width of the zone at the traction bound, at whose ends mu p crosses it."""
    return half_above(light.x, law.mu * state.normal / light.length - law.tau_max)
