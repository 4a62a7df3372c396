"""The contact law, point by point: a flat surface that only pushes, and Coulomb friction that a bound cuts off.

With g the gap of a point, N >= 0 the surface's push on it along y, T the force along x, v how far it slid over the
surface along x within a step, L the skin it stands for:

    g >= 0, N >= 0, N g = 0          (Signorini 1959, Rend. Mat. Appl. 18, 95)
    |T| <= min(mu N, tau_max L)      (Coulomb; bounded: Orowan 1943, Proc. Inst. Mech. Eng. 150, 140)
    T v <= 0, v = 0 where |T| is less (a step of backward Euler)

or as one equation each, for any r > 0 (Alart and Curnier 1991, Comput. Meth. Appl. Mech. Eng. 92, 353):

    N = max(0, N - r g),  T = T - r v brought back to between -min(mu N, tau_max L) and +min(mu N, tau_max L).

A point is in one of four states, s = +1 or -1 being the sense of the friction force on the skin:

    open    N = T = 0                 until g < 0
    stick   g = 0, v = 0              until N < 0 or |T| > min(mu N, tau_max L)
    slip    g = 0, T = s mu N         until N < 0, mu N > tau_max L or s v > 0
    cap     g = 0, T = s tau_max L    until N < 0, mu N < tau_max L or s v > 0

`solver._kernels.active_set` looks for the states that contradict nothing, at both kinematics; at finite strain L is
that of the deformed skin. The list of laws is at the foot; one test holds each way to each law.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array

OPEN, STICK, SLIP, SHEAR_LIMITED = 0, 1, 2, 3  # as the compiled loops number them, which a plain solve does not load
STEEP = 1.0  # coefficient from which skin that slips at a bound does so up to where contact ends, likewise
STATE_NAMES = {OPEN: "open", STICK: "stick", SLIP: "slip", SHEAR_LIMITED: "cap"}


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """|T| <= min(mu N, tau_max L) on a surface that only pushes."""

    mu: float  # coefficient of friction [-]
    tau_max: float  # traction bound [MPa], infinite where there is none

    def __post_init__(self) -> None:
        """Raise ValueError for friction that is negative or no number."""
        if not 0.0 <= self.mu < np.inf:
            raise ValueError(f"mu = {self.mu} is not allowed: a coefficient of friction is a number from 0 on")
        if not self.tau_max >= 0.0:
            raise ValueError(f"tau_max = {self.tau_max} is not allowed: a bound is a traction from 0 on, or infinite")
        object.__setattr__(self, "mu", float(self.mu))  # whole numbers too: loops are compiled for one kind
        object.__setattr__(self, "tau_max", float(self.tau_max))

    def limit(self, force: Array, length: Array) -> Array:
        """Return the largest tangential force (n,) [N/mm] at points pressed with `force` (n,) [N/mm].

        `length` (n,) [mm] is the skin that each point stands for: the bound on a point's force is tau_max times it.

        >>> FrictionLaw(0.5, 0.02).limit(np.array([0.01, 0.1, 0.0]), np.array([1.0, 1.0, 1.0]))
        array([0.005, 0.02 , 0.   ])
        """
        return np.minimum(self.mu * np.maximum(force, 0.0), self.bound(length))

    def bound(self, length: Array) -> Array:
        """Return the largest tangential force (n,) [N/mm] whatever the pressure, on `length` (n,) [mm] of skin."""
        return np.full(length.shape, np.inf) if self.tau_max == np.inf else self.tau_max * length

    def slopes(self, state: NDArray[np.integer], sense: Array) -> tuple[Array, Array]:
        """Return how friction forces grow with the normal force (n,) [-] and with the skin's length (n,) [MPa].

        Of points in `state` (n,), with friction forces along `sense` (n,), +1 along +x. Open and sticking points have
        none: the first bear no force, and that of the others is unknown. The forces are the slopes times force and
        length, so that this is the law's consistent tangent too.

        >>> one, other = FrictionLaw(0.5, 0.02).slopes(np.arange(4), np.array([1, 1, 1, -1.0]))
        >>> one.tolist(), other.tolist()
        ([0.0, 0.0, 0.5, 0.0], [0.0, 0.0, 0.0, -0.02])
        """
        return np.where(state == SLIP, sense * self.mu, 0.0), np.where(
            state == SHEAR_LIMITED, sense * self.tau_max, 0.0
        )

    @property
    def frictionless(self) -> bool:
        """True where no tangential force is possible."""
        return self.mu == 0.0 or self.tau_max == 0.0


LAWS = (FrictionLaw,)
