"""What an iteration of Newton does beside its tangent, as few loops: each call from Python takes time of its own.

There are n unknowns and k nodes of skin.
"""

import numpy as np

from solver._kernels.arguments import (
    BodyState,
    ContactStates,
    ElementArrays,
    ElementSystem,
    Factors,
    LoadState,
    Skin,
    SkinPosition,
)
from solver._kernels.compiling import Array, compiled
from solver._kernels.elements import advance
from solver._kernels.multifrontal import back_substitute, condense
from solver._kernels.skin import rubbed, update_contact_states


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


@compiled
def meet(states: ContactStates, position: SkinPosition, load: LoadState, skin: Skin, length: Array) -> int:
    """Change `states` where the forces on the skin, or its position, contradict them; return how many were changed.

    Filled: `length` (k,), of skin on which a bound acts.
    """
    rubbed(position.x, skin.middle, states.state, load.mu, length)
    return update_contact_states(states, position.x, position.above, position.anchor, length, load)
