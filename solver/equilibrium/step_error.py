"""How many load steps a course takes, and by how much its end may be off for not taking more.

A press with friction, or a drag that friction carries, depends on its way: where in a step a point comes to touch is
where it is held from then on. The error so falls with the number of steps, on average, and irregularly: each point
touches at some part of its step. It is nearly the same on every mesh, so that it is measured on a coarse one, by two
courses of fewer steps. With an error c of the usual steps and c/p of a part p of them, the end changes by c (1/p - 1).
Either course may agree with the usual one by chance, which is why both estimates of c are added. A settled slide has no
such error.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from solver.arrays import Array
from solver.equilibrium.loads import load_of
from solver.equilibrium.newton import EquilibriumState
from solver.scene.scene import Scene

PARTS = np.array([0.48, 0.68])  # of the usual steps: 12 and 17 of 25, about a half and two thirds
MOST = 16  # times the usual steps, at most: a second's work on a coarse mesh at small strain
USUAL = 0.003  # tolerance that steps are chosen for where none is asked for, as the default meshes' errors
SHARE = 0.3  # part of a tolerance that the error of the steps may take: the mesh, which costs more, has the rest


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """The steps of one course. Numbers are those of `all_numbers` (c,)."""

    times: int  # the usual ones
    excess: Array  # (c,) of the numbers after the usual steps over those after many
    bound: Array  # (c,) of its size

    @staticmethod
    def of(usual: Array, fewer: Array, tolerance: float | None) -> "Steps":
        """Return the fewest that a tolerance asks for.

        `usual` (c,) and `fewer` (2, c) are numbers after the usual steps and after PARTS of them, on a coarse mesh.
        """
        excess = (fewer - usual) / (1.0 / PARTS - 1.0)[:, None]
        bound = np.abs(excess).sum(axis=0)
        off = float(bound[0]) / max(abs(float(usual[0])), np.finfo(float).tiny)
        times = min(max(1, ceil(off / (SHARE * (tolerance or USUAL)))), MOST)
        return Steps(times, excess.mean(axis=0), bound)

    @staticmethod
    def asked(
        end: Callable[[float], EquilibriumState],
        numbers: Callable[[Sequence[EquilibriumState]], Array],
        tolerance: float | None,
    ) -> "Steps":
        """Return those that a tolerance asks for; `end` returns that of the course in so many times the usual steps."""
        usual, *fewer = numbers([end(times) for times in (1.0, *PARTS.tolist())])
        return Steps.of(usual, np.array(fewer), tolerance)

    @property
    def error(self) -> Array:
        """By how much numbers may be off for not taking more steps (c,)."""
        return self.bound / self.times

    def taken(self, usual: Array) -> Array:
        """Return what the numbers (c,) after the usual steps would be after these."""
        return usual - (1.0 - 1.0 / self.times) * self.excess


def times_on_way(scene: Scene, asked: Callable[[Scene], Steps | None]) -> int:
    """Return how many times the usual load steps a history takes whose end does not depend on them.

    Those that a tolerance asks for at the end of its press; `asked` returns the steps of that. Raises as it does.
    """
    if scene.solve.course == "steady" or scene.solve.tolerance is None or load_of(scene).frictionless:
        return 1
    steps = asked(scene.pressed_only())
    return 1 if steps is None else steps.times
