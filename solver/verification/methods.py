"""A finger on one mesh, with one interface for measurements in both kinematics."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from time import perf_counter
from typing import Any, Generic, Literal, TypeVar

import numpy as np

from solver.arrays import Array
from solver.body.linear import LinearBody
from solver.contact import LoadState
from solver.continuation.existence import slide_on_branch
from solver.continuation.finite_states import rough_state
from solver.continuation.small_states import settled_state
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import Finger, FiniteFinger, LinearFinger, settled_moduli
from solver.equilibrium.load_stepping import sliding_load
from solver.failures import SolveFailure
from solver.mesh.mesher import Sizing
from solver.response import FIRST_FINENESS
from solver.response.finite_answers import CONTACT_MARGIN
from solver.scene import Scene
from solver.verification.request import clock

Kinematics = Literal["small", "finite"]
AnyFinger = TypeVar("AnyFinger", bound=Finger[Any])


class MeshMethod(Generic[AnyFinger]):
    """One finger on one mesh; `fineness` is elements per tip radius, `shift` moves the lines by half an element.

    A method has `solve` and `floor` too: see `SmallMethod`.
    """

    finger: AnyFinger
    setup_s: float  # mesh and tables
    prepared_s = 0.0  # assembly and factorisation that all surfaces share; 0 where they are part of each solve

    @property
    def dofs(self) -> int:
        """Number of unknown displacements."""
        return self.finger.body.mesh.dofs

    def numbers(self, state: EquilibriumState) -> Array:
        """Return SED of the ending [MPa], normal force and drag [N/mm] (3,)."""
        return self.numbers_together([state])[0]

    def numbers_together(self, states: Sequence[EquilibriumState]) -> Array:
        """Return `numbers` of several states (n, 3)."""
        return np.abs(self.finger.numbers(states))


class SmallMethod(MeshMethod[LinearFinger]):
    """Small strain: the inside is condensed once, contact is solved on the skin."""

    def __init__(self, scene: Scene, fineness: float, shift: bool) -> None:
        start, wall_start = clock(), perf_counter()
        self.finger = LinearFinger.of(scene, Sizing(fineness, scene.loading.depth, shift, margin=4.0))
        elapsed_s, wall_s = clock() - start, perf_counter() - wall_start
        self.prepared_s = elapsed_s * self.finger.solve_s / wall_s  # `solve_s` is elapsed time
        self.setup_s = elapsed_s - self.prepared_s

    def solve(self, scene: Scene, before: EquilibriumState | None = None) -> EquilibriumState:
        """Return the settled state of `scene`. Raises SolveFailure where no state exists.

        Every surface starts from the same guess, so `before`, the state of a similar surface, is not used.
        """
        del before
        return settled_state(scene, self.finger)

    def floor(self) -> float:
        """Return the time of one assembly, factorisation and solve of this system [s]."""
        skin, moduli = np.ones(self.finger.body.condensed.rest.shape), settled_moduli(self.finger.scene.materials)
        start = clock()
        LinearBody.of(self.finger.geometry.mesh, moduli).displacement(skin)
        return clock() - start


class FiniteMethod(MeshMethod[FiniteFinger]):
    """Finite strain on one mesh, started from a coarse mesh, which is kept for other surfaces."""

    def __init__(self, scene: Scene, fineness: float, shift: bool) -> None:
        start, sizing = clock(), Sizing(fineness, scene.loading.depth, shift, margin=CONTACT_MARGIN)
        self.finger = FiniteFinger.of(scene, sizing)
        self._coarse = FiniteFinger.of(
            scene, Sizing(min(FIRST_FINENESS, fineness), scene.loading.depth, margin=CONTACT_MARGIN)
        )
        self.setup_s = clock() - start

    def solve(self, scene: Scene, before: EquilibriumState | None = None) -> EquilibriumState:
        """Return the settled state of `scene`, from the coarse mesh or from `before`, the state of a similar surface.

        Raises SolveFailure where no state exists.
        """
        if before is None:
            with suppress(SolveFailure):  # with steep friction the skin may fold on the coarse mesh alone
                before = self.finger.transfer(rough_state(self._coarse, scene), self._coarse)
        return slide_on_branch(self.finger, sliding_load(scene), start=before)

    def floor(self) -> float:
        """Return the time of one assembly, factorisation and solve of this system [s]."""
        newton = self.finger.newton
        shape = EquilibriumState.undeformed(newton.condensed, LoadState(0.1, 0.0))
        start = clock()
        newton.linearise(shape, newton.skin_x)
        return clock() - start


MESHED: Mapping[Kinematics, type[SmallMethod | FiniteMethod]] = {"small": SmallMethod, "finite": FiniteMethod}
