"""Every way of solving a scene that the project keeps, behind one face, so that all are measured alike."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Literal, Protocol

import numpy as np

from solver.accuracy.adaptivity import COARSE, MARGIN
from solver.arrays import Array
from solver.body.linear import LinearBody
from solver.body.tissues import settled_moduli
from solver.continuation.existence import steady
from solver.continuation.finite_states import roughly
from solver.continuation.small_states import settled
from solver.element import Q2P1
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.linear_finger import LinearFinger
from solver.equilibrium.load_stepping import never
from solver.equilibrium.newton import EquilibriumState, FiniteNewton, LoadState
from solver.failures import SolveFailure
from solver.mesh.mesher import Sizing
from solver.scene import Scene
from solver.verification.asked import clock

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
        self.finger = LinearFinger.of(scene, Sizing(fineness, scene.loading.depth, shift, margin=4.0))
        took, passed = clock() - begun, perf_counter() - passing
        self.prepared_s = took * self.finger.solve_s / passed  # which it tells by the time that passes
        self.setup_s = took - self.prepared_s
        self.dofs = self.finger.body.dofs

    def solve(self, scene: Scene, before: State | None = None) -> State:
        """Return the state of contact; every surface begins at the same guess, so `before` is not used."""
        del before
        return settled(scene, self.finger)

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


class FiniteMeshed:
    """Finite strain on one mesh, begun on a coarse one. Meshes are kept, so that another surface makes none."""

    prepared_s = 0.0

    def __init__(self, scene: Scene, fineness: float, shift: bool) -> None:
        """Mesh the finger of `scene`."""
        begun, sizing = clock(), Sizing(fineness, scene.loading.depth, shift, margin=MARGIN)
        self.finger = FiniteFinger.of(scene, sizing)
        self._coarse = FiniteFinger.of(scene, Sizing(min(COARSE, fineness), scene.loading.depth, margin=MARGIN))
        self.setup_s = clock() - begun
        self.dofs = self.finger.newton.body.dofs

    def solve(self, scene: Scene, before: State | None = None) -> State:
        """Return the settled shape, from `before` where it is given."""
        if before is None:
            with suppress(SolveFailure):  # a steep slide may fold the skin of a coarse mesh alone
                before = self.finger.transfer(roughly(self._coarse, scene, never), self._coarse)
        return steady(self.finger, load_of(scene), start=before)

    def numbers(self, state: State) -> Array:
        """Return SED, normal force and drag."""
        return np.array([self.finger.sed_ending(state.u), state.force[1], abs(state.force[0])])

    def numbers_together(self, states: Sequence[State]) -> Array:
        """Return them for several states (n, 3)."""
        return np.array([self.numbers(state) for state in states])

    def floor(self) -> float:
        """Return what one assembly, factorisation and solve takes."""
        return _system(self.finger.newton)


def _system(newton: FiniteNewton) -> float:
    shape = EquilibriumState.undeformed(newton.body)
    begun = clock()
    newton.linearise(shape, LoadState(0.1, 0.0), newton.skin_x)
    return clock() - begun


def load_of(scene: Scene) -> LoadState:
    """Return what the surface does in a scene of settled sliding."""
    friction, loading = scene.friction, scene.loading
    return LoadState(loading.depth, float(friction.mu), friction.cap, -(loading.direction or 1))


_ELIMINATION = "nested dissection in compiled loops"
SMALL = Method("small strain", "small", Q2P1.name, Q2P1.order, _ELIMINATION, "one guess", SmallMeshed)
FINITE = Method("finite strain", "finite", Q2P1.name, Q2P1.order, _ELIMINATION, "coarse state", FiniteMeshed)
METHODS = (SMALL, FINITE)
MAIN: dict[Kinematics, Method] = {"small": SMALL, "finite": FINITE}  # the one an answer comes from
