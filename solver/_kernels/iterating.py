"""What an iteration of Newton does beside its tangent, as few loops: each call from Python takes time of its own.

There are n unknowns and k nodes of skin.
"""

import numpy as np

from solver._kernels.arguments import BodyState, ElementArrays, ElementSystem, Factors
from solver._kernels.compiling import compiled
from solver._kernels.elements import advance
from solver._kernels.multifrontal import back_substitute, condense
from solver.arrays import Array


@compiled
def condense_forces(force: Array, dead: Array, carried: Array, factors: Factors) -> None:
    """Take the `dead` loads (n,) from the body's `force` (n,), and fill `carried` (n,) with what `condense` makes."""
    for i in range(force.shape[0]):
        force[i] -= dead[i]
        carried[i] = force[i]
    condense(carried, factors)


@compiled
def move(
    before: BodyState,
    step: Array,
    scale: float,
    after: BodyState,
    carried: Array,
    factors: Factors,
    elements: ElementArrays,
    system: ElementSystem,
) -> float:
    """Take `scale` times the skin's `step` (2 k,), and the body's with it; return the largest move of the full step.

    Filled is the state `after` going there from `before`.
    """
    every = np.empty(carried.shape[0])
    back_substitute(carried, step, factors, every)
    return advance(before, every, scale, after, elements, system)
