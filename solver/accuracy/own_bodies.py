"""How far numbers of a body handed in as a mesh may be off: as those of a finger, from its nested mesh."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from solver.accuracy.error_estimate import FROM_EDGES, FROM_HALVING, edge_changes
from solver.arrays import Array
from solver.equilibrium.load_path import PARTS, Steps
from solver.equilibrium.newton import EquilibriumState, Given, Newton

Numbers = Callable[[Newton, EquilibriumState], Array]


class Estimated(NamedTuple):
    """Numbers (n,) of a state, each in its own unit."""

    value: Array
    corrected: Array  # the same on the nested mesh, the best value there is
    error: Array  # half width of the interval about either


def estimated(
    numbers: Numbers,
    newton: Newton,
    state: EquilibriumState,
    nested: tuple[Newton, EquilibriumState],
    given: Given | None = None,
    fewer: Sequence[EquilibriumState] = (),
) -> Estimated:
    """Return the `numbers` (n,) of a state and how far each may be off.

    `nested` is the same state on the halved mesh (`solver.mesh.halving`), `given` the forces it is under, if any. Where
    the state is the end of a load path on which skin sticks, `fewer` are its ends on the same mesh after `PARTS` of
    the load steps. Errors are infinite where contact with a moved edge has no equilibrium.
    """
    value = numbers(newton, state)
    finer, there = nested
    (corrected,), (edges,) = edge_changes(
        finer, [(there, given)], lambda states: np.array([numbers(finer, one) for one in states])
    )
    error = FROM_HALVING * np.abs(corrected - value) + FROM_EDGES * edges
    if fewer:
        if len(fewer) != len(PARTS):
            raise ValueError(f"fewer has {len(fewer)} states; give one after each of {PARTS.tolist()} of the steps")
        error += Steps.of(value, np.array([numbers(newton, one) for one in fewer]), None).bound
    return Estimated(value, corrected, error)
