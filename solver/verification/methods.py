"""Every way of solving a scene that the project keeps, behind one face, so that all are measured alike."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from time import perf_counter
from typing import Any, Literal, Protocol

import numpy as np

from solver.accuracy.adaptivity import (
    MARGIN,
    MeshSolution,
    NestedSolution,
    coarse_solution,
    refine,
    sized,
    sized_together,
    solution_on,
)
from solver.arrays import Array
from solver.body.linear import LinearBody
from solver.body.tissues import settled_moduli
from solver.continuation.existence import steady
from solver.continuation.finite_states import nearby
from solver.continuation.small_states import settled
from solver.element import Q2P1
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.newton import EquilibriumState, FiniteNewton, Pull
from solver.mesh.mesher import AT_CUT, Sizing
from solver.response.finite_solution import alike
from solver.scene import Friction, Scene
from solver.verification.asked import clock

SHORTEST = 0.02  # of truths, elements where the cut meets the bone, by tip radius, below which none are asked for
HALF, LITTLE_LESS = 0.5, 0.7  # each by the one before; the second where the first leads nowhere
FALLS = 0.8  # with the power of that length what is left there falls (docs/explanation/solver-model.md)
LEAST = 0.35  # det F there, below which such states are no longer one row
Kinematics = Literal["small", "finite"]
State = Any  # of contact at small strain, of the body, with its mesh or not, at finite strain; only handed back


class Meshed(Protocol):
    """One finger on one mesh."""

    dofs: int
    setup_s: float  # mesh and tables
    prepared_s: float  # assembly and factorisation that all surfaces share; 0 where each surface has its own

    def solve(self, scene: Scene, before: State | None = None) -> State:
        """Return the settled state of `scene`, from the undeformed finger or from a state of a similar surface.

        Raises SolveFailure where there is none.
        """
        ...

    def share(self, scenes: Sequence[Scene]) -> None:
        """Make what surfaces solved together share; those that are not among `scenes` stay as they were."""
        ...

    def numbers(self, state: State) -> Array:
        """Return SED of the ending [MPa], normal force and drag [N/mm] (3,)."""
        ...

    def numbers_together(self, states: Sequence[State]) -> Array:
        """Return them for several states (n, 3)."""
        ...

    def floor(self) -> float:
        """Return the time of one assembly, factorisation and solve of this system [s]."""
        ...


@dataclass(frozen=True, slots=True)
class Method:
    """One way of solving."""

    name: str
    kinematics: Kinematics
    element: str
    order: int  # of the displacements
    linear_solver: str
    start: str  # from what a surface is begun
    meshed: Callable[[Scene, float, bool], Meshed]  # scene, fineness, whether moved by half an element


class SmallMeshed:
    """Small strain: all but the skin eliminated once, contact on what remains."""

    def __init__(self, scene: Scene, fineness: float, shift: bool) -> None:
        """Mesh and reduce the finger of `scene`."""
        self._moduli = settled_moduli(scene.materials)
        begun, passing = clock(), perf_counter()
        self.finger = FingerModel.of(scene, Sizing(fineness, scene.loading.depth, shift, margin=4.0))
        took, passed = clock() - begun, perf_counter() - passing
        self.prepared_s = took * self.finger.solve_s / passed  # which it tells by the time that passes
        self.setup_s = took - self.prepared_s
        self.dofs = self.finger.body.dofs

    def solve(self, scene: Scene, before: State | None = None) -> State:
        """Return the state of contact; every surface begins at the same guess, so `before` is not used."""
        del before
        return settled(scene, self.finger)

    def share(self, scenes: Sequence[Scene]) -> None:
        """Do nothing: all surfaces share one mesh."""

    def numbers(self, state: State) -> Array:
        """Return SED, normal force and drag."""
        return self.numbers_together([state])[0]

    def numbers_together(self, states: Sequence[State]) -> Array:
        """Return them for several states (n, 3)."""
        return np.abs(self.finger.numbers(states))

    def floor(self) -> float:
        """Return what assembling, eliminating and unfolding once took."""
        skin = np.ones(self.finger.body.condensed.rest.shape)
        begun = clock()
        LinearBody.of(self.finger.geometry.mesh, self._moduli).displacement(skin)
        return clock() - begun


class ClimbingMeshed:
    """Finite strain as answers are made: a rough mesh finds the edges of contact, a mesh with lines there counts.

    Meshes are kept, so that solving the same surface again makes none. Surfaces that `share` have one mesh, its lines
    moved to the edges of each.
    """

    prepared_s = 0.0

    def __init__(self, scene: Scene, fineness: float, shift: bool) -> None:
        """Make the meshes of the finger of `scene` without friction, which stand for those of all surfaces."""
        self._fineness, self._shift = fineness, shift
        self._made: dict[Sizing, FiniteFinger] = {}
        self._shared: dict[Scene, Sizing] = {}
        self._last: FiniteFinger | None = None
        self.setup_s = 0.0
        finger = self.solve(replace(scene, friction=Friction(0.0))).top.finger
        self._newton = finger.newton
        self.dofs = finger.newton.body.dofs

    def _make(self, scene: Scene, sizing: Sizing) -> FiniteFinger:
        if self._shift:
            sizing = replace(sizing, shift=True)
        if sizing not in self._made:
            begun = clock()
            beside = None if sizing.edges is None else self._last
            self._made[sizing] = made = FiniteFinger.of(scene, sizing, beside)
            self._last = beside if sizing.edges is None else made
            self.setup_s += clock() - begun
        return self._made[sizing]

    def share(self, scenes: Sequence[Scene]) -> None:
        """Find the edges of contact of surfaces, and one mesh for those of them that are pressed alike."""
        for _, group in groupby(sorted(scenes, key=alike), lambda scene: scene.pressed):
            together = list(group)
            feet = [coarse_solution(s, s.loading.depth, self._fineness, _going_on, self._make) for s in together]
            sizings = sized_together(together[0], self._fineness, feet)
            self._shared |= zip(together, sizings, strict=True)
            newton = self._make(together[0], sizings[0]).newton
            if newton.body.dofs >= self.dofs:
                self._newton, self.dofs = newton, newton.body.dofs

    def solve(self, scene: Scene, before: State | None = None) -> NestedSolution:
        """Return the settled state, from undeformed or from `before`, of another surface at the same depth."""
        below = coarse_solution(
            scene, scene.loading.depth, self._fineness, _going_on, self._make, None if before is None else before.coarse
        )
        sizing = sized(self._fineness, below)  # what it costs to find the edges is counted
        return refine(scene, self._fineness, below, _going_on, self._make, before, self._shared.get(scene, sizing))

    def numbers(self, state: State) -> Array:
        """Return SED, normal force and drag."""
        return np.abs(state.top.finger.numbers(state.top.shape))

    def numbers_together(self, states: Sequence[NestedSolution]) -> Array:
        """Return them for several states (n, 3)."""
        return np.array([self.numbers(state) for state in states])

    def floor(self) -> float:
        """Return what one assembly, factorisation and solve takes."""
        return _system(self._newton)


class FiniteMeshed:
    """Finite strain on one plain mesh, that does not know where contact ends: what climbing is compared with."""

    prepared_s = 0.0

    def __init__(self, scene: Scene, fineness: float, shift: bool) -> None:
        """Mesh the finger of `scene`."""
        begun = clock()
        self.finger = FiniteFinger.of(scene, Sizing(fineness, scene.loading.depth, shift, margin=MARGIN))
        self.setup_s = clock() - begun
        self.dofs = self.finger.newton.body.dofs

    def solve(self, scene: Scene, before: State | None = None) -> State:
        """Return the settled shape, from `before` where it is given."""
        return steady(self.finger, pull_of(scene), start=before)

    def share(self, scenes: Sequence[Scene]) -> None:
        """Do nothing: all surfaces share one mesh."""

    def numbers(self, state: State) -> Array:
        """Return SED, normal force and drag."""
        return np.array([self.finger.sed_ending(state), state.force[1], abs(state.force[0])])

    def numbers_together(self, states: Sequence[State]) -> Array:
        """Return them for several states (n, 3)."""
        return np.array([self.numbers(state) for state in states])

    def floor(self) -> float:
        """Return what one assembly, factorisation and solve takes."""
        return _system(self.finger.newton)


@dataclass(frozen=True, slots=True, eq=False)
class Overkill:
    """A state on a fine mesh, and what its numbers tend to as elements where the cut meets the bone get shorter."""

    at: MeshSolution
    numbers: Array  # (3,)
    at_cut: float  # the shortest of those elements, by tip radius


def overkill(scene: Scene, sizing: Sizing, below: MeshSolution | None = None) -> Overkill:
    """Return the state on a fine mesh, found from one `below`, and where its numbers tend to.

    Where the cut meets the bone, and a slide along +x squeezes tissue, errors fall with the power 0.8 of an element's
    length, and solver and truth would have them in common. So that corner's elements are shortened in steps, as long as
    one state leads to the next, and the numbers of the last two are carried on. Raises NoSteadyState, NotConverged.
    """
    sizing = replace(sizing, at_cut=AT_CUT)
    if below is None:
        finger = FiniteFinger.of(scene, sizing)
        first = MeshSolution(finger, steady(finger, pull_of(scene)), 0.0)
    else:
        first = solution_on(scene, sizing.fineness, below, _going_on, sizing=sizing)
    length, last, numbers = AT_CUT, first, first.finger.numbers(first.shape)
    tends, part = numbers, HALF
    while length > SHORTEST and scene.loading.direction > 0:
        finger = FiniteFinger.of(scene, replace(sizing, at_cut=part * length))
        shape = nearby(finger, scene, finger.transfer(last.shape, last.finger))
        if shape is None or finger.least_at_cut(shape) < LEAST:
            if part == LITTLE_LESS:
                break
            part = LITTLE_LESS
            continue
        before, numbers = numbers, finger.numbers(shape)
        tends = numbers + (numbers - before) / (part**-FALLS - 1.0)
        length, last = part * length, MeshSolution(finger, shape, 0.0)
    return Overkill(first, tends, length)


def fine_solutions(scene: Scene, finenesses: Sequence[float]) -> list[Overkill]:
    """Return a plain mesh's solution, and those of meshes with lines at the edges of contact that the one before finds.

    Raises NoSteadyState, NotConverged.
    """
    found = [overkill(scene, Sizing(finenesses[0], scene.loading.depth, margin=MARGIN))]
    for fineness in finenesses[1:]:
        below = found[-1].at
        found.append(overkill(scene, sized(fineness, below), below))
    return found


def _system(newton: FiniteNewton) -> float:
    shape = EquilibriumState.undeformed(newton.body)
    begun = clock()
    newton.linearise(shape, Pull(0.1, 0.0), newton.skin_x)
    return clock() - begun


def _going_on() -> bool:
    return False


def pull_of(scene: Scene) -> Pull:
    """Return what the surface does in a scene of settled sliding."""
    friction, loading = scene.friction, scene.loading
    return Pull(loading.depth, float(friction.mu), friction.cap, -(loading.direction or 1))


_ELIMINATION = "nested dissection in compiled loops"
SMALL = Method("small strain", "small", Q2P1.name, Q2P1.order, _ELIMINATION, "one guess", SmallMeshed)
FINITE = Method("finite strain", "finite", Q2P1.name, Q2P1.order, _ELIMINATION, "rough state", ClimbingMeshed)
PLAIN = Method("finite strain, plain mesh", "finite", Q2P1.name, Q2P1.order, _ELIMINATION, "undeformed", FiniteMeshed)
METHODS = (SMALL, FINITE, PLAIN)
MAIN: dict[Kinematics, Method] = {"small": SMALL, "finite": FINITE}  # the one an answer comes from
