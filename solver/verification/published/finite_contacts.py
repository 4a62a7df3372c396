"""The contacts of the theory at finite strain: a half-plane pressed so lightly that small-strain theory holds."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from solver._kernels.compiling import STICK
from solver.arrays import Array
from solver.body.finite import FiniteBody
from solver.constitutive import NeoHooke
from solver.equilibrium import EquilibriumState, LoadState, Newton
from solver.equilibrium.load_stepping import march, solve_full_slip
from solver.verification.published.bodies import grade, mirror, mound
from solver.verification.published.zones import half_above, half_width

ELEMENT = 1 / 10  # by the expected half-width
RADIUS = 1000.0  # in half-widths
WIDE = 30.0  # of the body to each side, in half-widths: forces and widths do not depend on it, depths would
YOUNG, NU = 0.08, 0.4999  # nearly incompressible, so that normal and shear do not couple
DEPTH = 2.3e-3  # in half-widths: gives a contact of about half-width 1
STEP = 5e-5  # of the surface along x, in half-widths


@dataclass(frozen=True, slots=True, eq=False)
class LightFinite:
    """A half-plane at finite strain under a light press."""

    newton: Newton
    pressed: EquilibriumState
    load: float  # [N/mm]

    @property
    def half_width(self) -> float:
        """The theoretical half-width under this load."""
        return float(np.sqrt(4 * self.load * RADIUS * (1 - NU**2) / (np.pi * YOUNG)))

    @property
    def peak(self) -> float:
        """The theoretical peak pressure under this load [MPa]."""
        return 2 * self.load / (np.pi * self.half_width)

    @property
    def x(self) -> Array:
        """Positions of the undeformed skin's nodes (k,)."""
        return self.newton.skin_x

    @property
    def length(self) -> Array:
        """Tributary lengths of the skin's nodes (k,): 1/6, 4/6, 1/6 of an edge."""
        out = np.zeros(len(self.x))
        ends = self.x[::2]
        for number, (low, high) in enumerate(pairwise(ends)):
            out[2 * number : 2 * number + 3] += (high - low) * np.array([1.0, 4.0, 1.0]) / 6.0
        return out

    def found_width(self) -> float:
        """Return the half-width from the pressure's second moment, a = 2 sqrt(<x^2>)."""
        return 2 * float(np.sqrt(self.pressed.reaction[:, 1] @ self.x**2 / self.load))

    def found_peak(self) -> float:
        """Return the pressure in the middle [MPa]."""
        middle = len(self.x) // 2
        return float(self.pressed.reaction[middle, 1] / self.length[middle])

    def slide_at_bound(self, mu: float, k: float) -> tuple[float, float]:
        """Return Q/(mu P) in full slip under the bound k mu p0, and half the width of mu p above the bound, by a."""
        load = self.pressed.load._replace(mu=mu, tau=k * mu * self.peak, sense=1)
        state = solve_full_slip(self.newton, load)
        drag = float(state.force[0]) / (mu * float(state.force[1]))
        width = half_above(self.x, state.reaction[:, 1] / self.length - k * self.peak)
        return drag, width / self.half_width

    def shear(self, mu: float, part: float) -> tuple[float, float, float]:
        """Return Q/(mu P) of at least `part`, half the width of the stick zone by a, and q(0)/(mu p0).

        The surface moves in steps until `part` is reached. At the ends of the stick zone mu p - q falls to zero.
        """
        load = self.pressed.load._replace(mu=mu, sense=0)
        (state,) = march(self.newton, [load])
        travel = 0.0
        while float(state.force[0]) < part * mu * float(state.force[1]):
            travel += STEP
            (state,) = march(self.newton, [load._replace(travel=travel)], state)
        spare, middle = mu * state.reaction[:, 1] - state.reaction[:, 0], len(self.x) // 2
        sticks = half_width(self.x, spare, state.state == STICK)
        traction = float(state.reaction[middle, 0] / self.length[middle]) / (mu * self.peak)
        drag = float(state.force[0]) / (mu * float(state.force[1]))
        return drag, sticks / self.half_width, traction


@cache
def light_finite() -> LightFinite:
    """Return the half-plane, pressed without friction."""
    x = mirror(grade(ELEMENT, 0.3, 1.2, WIDE))
    y = grade(ELEMENT, 0.3, 0.0, WIDE)
    newton = Newton(FiniteBody.of(mound(x, y, RADIUS, 3.0), [NeoHooke(YOUNG, NU)]).condensed)
    pressed = solve_full_slip(newton, LoadState(DEPTH, 0.0, np.inf, 1), tolerance=1e-12)
    return LightFinite(newton, pressed, float(pressed.force[1]))
