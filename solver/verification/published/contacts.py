"""Cylinders on a flat rigid surface: Hertz, Smith and Liu, Cattaneo and Mindlin, Coulomb with a bound.

K. L. Johnson, Contact Mechanics, Cambridge 1985, chapters 4, 5 and 7. Half-plane problems are in units of the
half-width a, on a block so wide that its sides have no effect; whole cylinders are in mm.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from solver.arrays import Array
from solver.body.finite import FiniteBody
from solver.body.linear import LinearBody, edge_load
from solver.constitutive import Hooke, NeoHooke
from solver.contact import OPEN, STICK, ForceLoad, FrictionLaw, LoadState
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.load_stepping import slide_from_guess, solve_full_slip, solve_under_forces
from solver.mesh import Mesh
from solver.verification.methods import Kinematics
from solver.verification.published.bodies import (
    chain,
    disc,
    grade,
    half_above,
    half_width,
    locate,
    mirror,
    mound,
    stress,
    touching_within,
)

ELEMENT: dict[Kinematics, float] = {"small": 1 / 30, "finite": 1 / 10}  # of the half-width
_WIDE: dict[Kinematics, float] = {"small": 100.0, "finite": 30.0}  # of the block to each side, in half-widths
RADIUS = 1000.0  # in half-widths: the theory's limit of light loads
DEPTH = 2.3e-3  # of the light contact at finite strain, which gives a half-width of 1.1
_YOUNG = 0.08  # [MPa]
_NONE = LoadState(0.0, 0.0, sense=-1)


def _half_plane(finest: float, wide: float, radius: float, unit: float = 1.0) -> Mesh:
    """Return a half-plane with elements of size `finest` in the contact; an infinite `radius` is flat."""
    x, y = mirror(grade(finest, 0.3, 1.2, wide)), grade(finest, 0.3, 0.0, wide)
    return mound(x * unit, y * unit, radius, 3.0 * unit)


def press(finest: float, nu: float) -> float:
    """Return the force [N/mm] on a half-plane with elements of size `finest`, lightly pressed by 1e-3 half-widths."""
    body = LinearBody.of(_half_plane(finest, 20.0, RADIUS), [Hooke(_YOUNG, nu)])
    return float(solve_full_slip(Newton(body.condensed), _NONE._replace(depth=1e-3)).force[1])


@dataclass(frozen=True, slots=True)
class Hertz:
    """Results of a half-plane pressed under the gap of a parabola, or of a whole cylinder between two plates."""

    load: float  # [N/mm]
    half_width: float  # from the pressure's second moment, a = 2 sqrt(<x^2>) [mm]
    half_extent: float  # half the distance from the first to the last touching node [mm]
    peak: float  # pressure in the middle [MPa]
    worst: float  # largest difference of the pressure from the ellipse inside 0.9 a, relative to the peak
    approach: float = 0.0  # of the plate to the cylinder's centre [mm]


def _compare(body: LinearBody, slide: EquilibriumState, half_width: float, peak: float) -> Hertz:
    """Return the results of a pressed body whose closed form has `half_width` [mm] and `peak` [MPa]."""
    x, load = body.mesh.nodes[body.mesh.skin, 0], float(slide.normal.sum())
    pressure = slide.normal / body.condensed.fixed_length
    inside = np.abs(x) < 0.9 * half_width
    ellipse = peak * np.sqrt(1 - (x[inside] / half_width) ** 2)
    return Hertz(
        load, 2 * float(np.sqrt(slide.normal @ x**2 / load)), float(np.ptp(x[slide.touching])) / 2,
        float(pressure[len(x) // 2]), float(np.abs(pressure[inside] - ellipse).max()) / peak,
    )  # fmt: skip


def hertz(young: float, nu: float, radius: float, load: float, half_width: float, peak: float) -> Hertz:
    """Return the results for a load whose closed form has `half_width` [mm] and `peak` [MPa]."""
    mesh = _half_plane(ELEMENT["small"], _WIDE["small"], np.inf, half_width)
    body = LinearBody.of(mesh, [Hooke(young, nu)])
    body.condensed.rest[:, 1] = mesh.nodes[mesh.skin, 0] ** 2 / (2 * radius)
    newton = Newton(body.condensed)
    slide = slide_from_guess(newton, _NONE, touching_within(newton, 1.05 * half_width), load)
    return _compare(body, slide, half_width, peak)


def whole_cylinder(load: float, half_width: float, peak: float) -> Hertz:
    """Return the results of a cylinder of radius 5 mm under `load`, pressed from above by Hertz's pressure."""
    mesh = disc(5.0, 0.05, 1.0)
    x, y = (mesh.nodes - [0.0, 5.0]).T
    top = chain(np.isclose(np.hypot(x, y), 5.0) & (y > -1e-9), x)
    traction = np.zeros((len(top), 2))
    traction[:, 1] = -peak * np.sqrt(np.clip(1 - (mesh.nodes[top, 0] / half_width) ** 2, 0, None))
    loads = edge_load(mesh, top, traction)
    body = LinearBody.of(mesh, [Hooke(_YOUNG, 0.48)], loads * (load / -loads.sum()), free=("y", "turn"))
    newton = Newton(body.condensed)
    slide = slide_from_guess(newton, _NONE, touching_within(newton, 0.9 * half_width))
    approach = -float(body.displacement(slide.u)[np.argmin(np.hypot(x, y)), 1])
    return replace(_compare(body, slide, half_width, peak), approach=approach)


@dataclass(frozen=True, slots=True, eq=False)
class LightContact:
    """A nearly incompressible half-plane under a light frictionless press: pressure and traction do not couple."""

    body: LinearBody | FiniteBody
    newton: Newton
    press: EquilibriumState
    load: float  # [N/mm]
    half_width: float  # from theory, under this load
    x: Array  # (k,) of the undeformed skin's nodes
    length: Array  # (k,) tributary lengths of these nodes: 1/6, 4/6, 1/6 of an edge

    @property
    def peak(self) -> float:
        """The theoretical peak pressure under this load [MPa]."""
        return 2 * self.load / (np.pi * self.half_width)

    def at_middle(self, forces: Array) -> float:
        """Return the traction in the middle [MPa] of `forces` (k,) [N/mm] on the nodes."""
        return float(forces[len(self.x) // 2] / self.length[len(self.x) // 2])

    def width(self, state: EquilibriumState) -> float:
        """Return the half-width of the contact from the pressure's second moment, a = 2 sqrt(<x^2>)."""
        return 2 * float(np.sqrt(state.normal @ self.x**2 / state.normal.sum()))

    def stress(self, state: EquilibriumState, points: Array) -> Array:
        """Return the stress (p, 2, 2) at `points` (p, 2), relative to the peak pressure, at small strain."""
        if not isinstance(self.body, LinearBody):
            raise TypeError("stresses are compared at small strain")
        return stress(self.body, self.body.displacement(state.u), *locate(self.body.mesh, points)) / self.peak

    def shear(self, mu: float, part: float) -> EquilibriumState:
        """Return the state after a tangential force `part` mu P along -x is applied to the pressed state."""
        sticks = np.where(self.press.touching, STICK, OPEN).astype(np.int32)
        before = replace(self.press, state=sticks, load=LoadState(self.press.load.depth, mu))
        return solve_under_forces(self.newton, before, ForceLoad(self.load, -part * mu * self.load))

    def slip(self, law: FrictionLaw, direction: int = 1) -> EquilibriumState:
        """Return the state of full slip at the same depth; the body moves along `direction` x."""
        load = LoadState(self.press.load.depth, law.mu, law.tau_max, -direction)
        return solve_full_slip(self.newton, load, tolerance=1e-13)

    def stick_width(self, state: EquilibriumState, mu: float) -> float:
        """Return half the width of the stick zone relative to a; at its ends mu p - q falls to zero."""
        spare = mu * state.normal - np.abs(state.tangential)
        return half_width(self.x, spare, state.state == STICK) / self.half_width

    def capped_width(self, state: EquilibriumState, law: FrictionLaw) -> float:
        """Return half the width of the zone at the traction bound relative to a; at its ends mu p crosses the bound."""
        return half_above(self.x, law.mu * state.normal / self.length - law.tau_max) / self.half_width


@cache
def light(kinematics: Kinematics = "small", nu: float = 0.4999, wide: float | None = None) -> LightContact:
    """Return the light contact; the body extends by `wide` half-widths to each side."""
    mesh = _half_plane(ELEMENT[kinematics], wide or _WIDE[kinematics], RADIUS)
    x, plane = mesh.nodes[mesh.skin, 0], _YOUNG / (1 - nu**2)
    if kinematics == "small":
        body = LinearBody.of(mesh, [Hooke(_YOUNG, nu)])
        newton = Newton(body.condensed)
        state = slide_from_guess(newton, _NONE, touching_within(newton, 1.05), np.pi * plane / (4 * RADIUS))
    else:
        body = FiniteBody.of(mesh, [NeoHooke(_YOUNG, nu)])
        newton = Newton(body.condensed)
        state = solve_full_slip(newton, LoadState(DEPTH, 0.0, sense=1), tolerance=1e-13)
    load, length = float(state.normal.sum()), np.zeros(len(x))
    for first in range(0, len(x) - 1, 2):
        length[first : first + 3] += (x[first + 2] - x[first]) * np.array([1.0, 4.0, 1.0]) / 6.0
    return LightContact(body, newton, state, load, float(np.sqrt(4 * load * RADIUS / (np.pi * plane))), x, length)
