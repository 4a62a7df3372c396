"""The contact law of a point, with Coulomb friction and a traction bound, and the loads of a flat rigid surface.

For a point, g is the gap, N >= 0 the normal force of the surface along y, and T the force along x. v is its slip
relative to the surface along x within a step, and L its tributary length of skin:

    g >= 0, N >= 0, N g = 0          (Signorini 1959, Rend. Mat. Appl. 18, 95)
    |T| <= min(mu N, tau_max L)      (Coulomb; bounded: Orowan 1943, Proc. Inst. Mech. Eng. 150, 140)
    T v <= 0, v = 0 where |T| is less (a step of backward Euler)

or as one equation each, for any r > 0 (Alart and Curnier 1991, Comput. Meth. Appl. Mech. Eng. 92, 353):

    N = max(0, N - r g),  T = T - r v projected onto the range from -min(mu N, tau_max L) to +min(mu N, tau_max L).

A point is in one of four states, s = +1 or -1 being the sense of the friction force on the skin:

    open    N = T = 0                 until g < 0
    stick   g = 0, v = 0              until N < 0 or |T| > min(mu N, tau_max L)
    slip    g = 0, T = s mu N         until N < 0, mu N > tau_max L or s v > 0
    cap     g = 0, T = s tau_max L    until N < 0, mu N < tau_max L or s v > 0

`solver._kernels.active_set` searches for consistent states, at both kinematics. At finite strain L is the deformed
length. `FRICTION_LAWS` lists the laws; one test checks the states of every law.

Contact ends between two nodes. The end is located to about a tenth of an element, because pressure falls there like
the square root of the distance: the force beyond a line between elements has its centre at 2/5 of the way to the end.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver._kernels.contact_system import SHEAR_LIMITED_MU
from solver.arrays import Array
from solver.body.validation import finite

STATE_NAMES = {OPEN: "open", STICK: "stick", SLIP: "slip", SHEAR_LIMITED: "cap"}


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """|T| <= min(mu N, tau_max L) in unilateral contact."""

    mu: float  # coefficient of friction [-]
    tau_max: float  # traction bound [MPa], infinite without one

    def __post_init__(self) -> None:
        """Raise ValueError for friction that is negative or not a number."""
        if not 0.0 <= self.mu < np.inf:
            raise ValueError(f"mu = {self.mu} is not allowed: a coefficient of friction is 0 or more")
        if not self.tau_max >= 0.0:
            raise ValueError(f"tau_max = {self.tau_max} is not allowed: a bound is 0 or more, or infinite")
        object.__setattr__(self, "mu", float(self.mu))  # also from integers: the kernels take floats
        object.__setattr__(self, "tau_max", float(self.tau_max))

    def limit(self, force: Array, length: Array) -> Array:
        """Return the largest tangential force (n,) [N/mm] at points with the normal `force` (n,) [N/mm].

        `length` (n,) [mm] is the tributary length of each point: the bound on its force is tau_max times it.

        >>> FrictionLaw(0.5, 0.02).limit(np.array([0.01, 0.1, 0.0]), np.array([1.0, 1.0, 1.0]))
        array([0.005, 0.02 , 0.   ])
        """
        return np.minimum(self.mu * np.maximum(force, 0.0), self.bound(length))

    def bound(self, length: Array) -> Array:
        """Return the traction bound as a force (n,) [N/mm] on the tributary `length` (n,) [mm] of points."""
        return np.full(length.shape, np.inf) if self.tau_max == np.inf else self.tau_max * length


class LoadState(NamedTuple):
    """Position of the surface relative to the bone, and its friction."""

    depth: float  # indentation: travel of the bone towards the surface [mm]
    mu: float  # [-]
    tau: float = np.inf  # traction bound [MPa]
    sense: int = 0  # of the friction force on the skin in full slip, +1 or -1; 0: nodes may stick or slip
    travel: float = 0.0  # of the surface along +x relative to the bone [mm]

    @property
    def frictionless(self) -> bool:
        """Whether no tangential force is possible."""
        return self.mu == 0.0 or self.tau == 0.0

    @property
    def path_dependent(self) -> bool:
        """Whether a state depends on its load path: friction on each node then opposes the node's last motion."""
        return self.sense == 0 and not self.frictionless

    @property
    def mostly_shear_limited(self) -> bool:
        """Whether mu is so large that nearly all skin in contact is shear-limited."""
        return self.mu > SHEAR_LIMITED_MU and self.tau < np.inf

    def towards(self, target: "LoadState", part: float) -> "LoadState":
        """Return the load state a `part` of the way to `target`; a bound that is new applies in full."""
        if part == 1.0:
            return target
        tau = self.tau + part * (target.tau - self.tau) if max(self.tau, target.tau) < np.inf else target.tau
        depth, mu, travel = (
            begin + part * (end - begin)
            for begin, end in ((self.depth, target.depth), (self.mu, target.mu), (self.travel, target.travel))
        )
        return LoadState(depth, mu, tau, target.sense, travel)

    def validate(self) -> "LoadState":
        """Return a copy with floats, for the kernels. Raises ValueError for values that are not allowed."""
        law = FrictionLaw(float(self.mu), float(self.tau))
        if self.sense not in (-1, 0, 1):
            raise ValueError(f"sense = {self.sense} is not allowed: give +1 or -1, or 0 to let the solver find it")
        depth, travel = finite("depth", self.depth), finite("travel", self.travel)
        return LoadState(depth, law.mu, law.tau_max, int(self.sense), travel)


class ForceLoad(NamedTuple):
    """Given forces on the skin: the normal force, and the tangential force along +x or the surface's travel."""

    normal: float  # [N/mm]
    tangential: float | None  # [N/mm]; None: `travel` is given instead
    travel: float = 0.0  # of the surface along +x relative to the bone [mm]

    def validate(self) -> "ForceLoad":
        """Return a copy with floats, for the kernels. Raises ValueError for a value that is not finite."""
        drag = None if self.tangential is None else finite("tangential", self.tangential)
        return ForceLoad(finite("normal", self.normal), drag, finite("travel", self.travel))

    def towards(self, target: "ForceLoad", part: float) -> "ForceLoad":
        """Return the forces a `part` of the way to `target`, which prescribes the same quantities."""
        start, drag = self.tangential or 0.0, target.tangential
        normal, travel = self.normal + part * (target.normal - self.normal), target.travel - self.travel
        return ForceLoad(normal, None if drag is None else start + part * (drag - start), self.travel + part * travel)


FRICTION_LAWS = (FrictionLaw,)


_FEWEST = 5  # touching nodes needed to locate the ends of contact


def edges(arcs: Array, force: Array, touching: NDArray[np.bool_]) -> tuple[float, float] | None:
    """Return the arc positions [mm] of both ends of contact; None where contact is too short to locate them.

    `force` (k,) [N/mm] are the normal forces on the nodes that may touch, which lie at `arcs` (k,).
    """
    high, low = last_edge(arcs, force, touching), last_edge(-arcs[::-1], force[::-1], touching[::-1])
    return None if high is None or low is None or high <= -low else (-low, high)


def width(arcs: Array, x: Array, force: Array, touching: NDArray[np.bool_]) -> float:
    """Return the width of the contact along the surface [mm], 0 without contact.

    `x` (k,) are deformed positions along the surface [mm]. Where contact is too short to locate its ends, it reaches
    from the outermost touching nodes halfway to their open neighbours.
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
    """Return the end of contact towards the last of the `arcs` (k,) [mm]; None where contact is too short to locate it.

    `force` (k,) is a nodal quantity that falls to zero at that end like the square root of the distance. Nodes
    alternate between ends and middles of edges, an end first.
    """
    on = [number for number, touches in enumerate(touching.tolist()) if touches]  # few: lists are fast
    if len(on) < _FEWEST:
        return None
    last = on[-1]
    line = last - 2 if last % 2 == 0 else last - 1  # the last line between elements with contact on both sides
    place, forces = arcs.tolist(), force[line : last + 1].tolist()
    gaps = place[line] - place[line - 2], place[line + 2] - place[line]
    forces[0] *= gaps[1] / (gaps[0] + gaps[1])  # the share of the line's force that acts beyond it
    moment = sum(push * (position - place[line]) for push, position in zip(forces, place[line : last + 1], strict=True))
    # A force that falls like the square root of the distance has its centre two fifths of the way to its end. This end
    # lies nearer to the last touching node than to the one before.
    end, least = place[line] + 2.5 * moment / sum(forces), (place[last - 1] + place[last]) / 2.0
    return min(max(end, least), place[min(last + 1, len(place) - 1)])
