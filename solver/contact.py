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

Contact ends between two nodes, known to about a tenth of an element from how the pressure falls: near its edge like the
square root of the distance. The force beyond a line between elements then has its centre at 2/5 of the way from there
to the edge.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver._kernels.compiling import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver.arrays import Array

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


LAWS = (FrictionLaw,)


FEWEST = 5  # touching nodes for which the force can tell


def edges(arcs: Array, force: Array, touching: NDArray[np.bool_]) -> tuple[float, float] | None:
    """Return the arc positions [mm] where contact ends; None where it is too short to tell.

    `force` (k,) [N/mm] are the normal forces on the nodes that may touch, which lie at `arcs` (k,).
    """
    high, low = last_edge(arcs, force, touching), last_edge(-arcs[::-1], force[::-1], touching[::-1])
    return None if high is None or low is None or high <= -low else (-low, high)


def width(arcs: Array, x: Array, force: Array, touching: NDArray[np.bool_]) -> float:
    """Return the distance along the surface from where contact begins to where it ends [mm], 0 where nothing touches.

    `x` (k,) are the deformed positions along the surface [mm]. Where contact is too short to tell its edges, a touching
    node stands for half the way to its open neighbours.
    """
    ends = edges(arcs, force, touching)
    if ends is not None:
        low, high = np.interp(ends, arcs, x)
        return float(high - low)
    on = np.flatnonzero(touching)
    if not len(on):
        return 0.0
    first, last = int(on[0]), int(on[-1])
    low = (x[first] + x[max(first - 1, 0)]) / 2.0
    high = (x[last] + x[min(last + 1, len(x) - 1)]) / 2.0
    return float(high - low)


def last_edge(arcs: Array, force: Array, touching: NDArray[np.bool_]) -> float | None:
    """Return where contact ends towards the last of the nodes at `arcs` (k,) [mm]; None where it is too short to tell.

    `force` (k,) is what falls to nothing there like the square root of the distance; nodes alternate between ends and
    middles of edges, an end first.
    """
    on = [number for number, touches in enumerate(touching.tolist()) if touches]  # few numbers: quicker one by one
    if len(on) < FEWEST:
        return None
    last = on[-1]
    line = last - 2 if last % 2 == 0 else last - 1  # the last line with contact on both sides
    place, pressed = arcs.tolist(), force[line : last + 1].tolist()
    gaps = place[line] - place[line - 2], place[line + 2] - place[line]
    pressed[0] *= gaps[1] / (gaps[0] + gaps[1])  # the part of the line's own force that stems from beyond
    moment = sum(one * (at - place[line]) for one, at in zip(pressed, place[line : last + 1], strict=True))
    least = place[last] - 0.35 * (place[last] - place[last - 1])
    return min(max(place[line] + 2.5 * moment / sum(pressed), least), place[min(last + 1, len(place) - 1)])


class SkinCompression(NamedTuple):
    """How far the skin is squeezed where it is, and whether it has a crease.

    A neo-Hookean half-space in plane strain wrinkles at a stretch of 0.544 (Biot 1963, Appl. Sci. Res. A 12, 168).
    """

    least: float  # ratio of deformed to undeformed length of a half of an element's side
    place: int  # the element that it belongs to
    lowest: float  # stretch, at the ends of elements too: nearer the truth where elements are large
    kink: float  # largest jump of the tangent, by undeformed length, from one element to the next: a crease has one.
    # Where skin touches or is drawn out at an edge of contact, jumps are the mesh's: open, squeezed skin is asked.
