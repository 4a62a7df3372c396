"""What an iteration of `newton` does beside its tangent: contact of the skin, and the step of the body.

The loops it is made of are tested one by one; here they are called as one, since each call from Python takes as long
as their work on a small mesh. The arguments are theirs, and n unknowns, k nodes of skin.
"""

import numpy as np

from solver._kernels.compiling import Array, Narrow, Wide, compiled
from solver._kernels.elements import advance
from solver._kernels.multifrontal import back_substitute, condense
from solver._kernels.skin import rubbed, solve_active_set, update_contact_states


@compiled
def touch(
    u: Array,
    anchor: Array,
    depth: float,
    mu: float,
    tau: float,
    direction: int,
    rounds: int,
    force: Array,
    load: Array,
    place: Array,
    skin: Wide,
    held: Narrow,
    at: Narrow,
    start: Narrow,
    inner: Narrow,
    border: Narrow,
    border_at: Narrow,
    numbers: Narrow,
    factor_at: Wide,
    factors: Array,
    near: Array,
    carried: Array,
    stiffness: Array,
    state: Narrow,
    sense: Narrow,
    length: Array,
    free: Narrow,
    matrix: Array,
    right: Array,
    steps: Array,
    reaction: Array,
) -> bool:
    """Condense the forces of displacements `u` (nodes, 2) onto the skin and solve_active_set its contact; False where it fails.

    The surface has risen by `depth`; `load` (n,) are dead loads, `place` (nodes, 2) undeformed positions, `skin` (k,)
    the skin's nodes. Left behind are `force` less its loads, `carried`, and what `solve_active_set` fills.
    """
    size, count = skin.shape[0], force.shape[0]
    for i in range(count):
        force[i] -= load[i]
        carried[i] = force[i]
    condense(carried, start, inner, border, border_at, numbers, factor_at, factors, near)
    x, above = np.empty(size), np.empty(size)
    _lie(u, depth, place, skin, x, above)
    if not solve_active_set(
        stiffness, carried[count - 2 * size :], held, at, state, sense, mu, tau, direction, x, above, anchor, rounds,
        length, free, matrix, right, steps, reaction,
    ):  # fmt: skip
        return False
    return bool(np.isfinite(steps[:, 0]).all())


@compiled
def move(
    u: Array,
    pressure: Array,
    step: Array,
    scale: float,
    anchor: Array,
    depth: float,
    mu: float,
    tau: float,
    direction: int,
    u_new: Array,
    pressure_new: Array,
    state: Narrow,
    sense: Narrow,
    reaction: Array,
    stiffness: Array,
    place: Array,
    skin: Wide,
    at: Narrow,
    start: Narrow,
    inner: Narrow,
    border: Narrow,
    border_at: Narrow,
    numbers: Narrow,
    factor_at: Wide,
    factors: Array,
    near: Array,
    carried: Array,
    every: Array,
    nodes: Narrow,
    unknown: Narrow,
    lame: Array,
    recovery_matrix: Array,
    dilate: Array,
    volume: Array,
    length: Array,
) -> tuple[float, int]:
    """Take `scale` times the skin's `step` (2 k,), and the body's with it; return the largest move and changed states.

    Filled: `u_new`, `pressure_new`, `reaction` (k, 2), the forces on the skin at the end of the full step, and `every`
    (n,), the step of all unknowns; `state` and `sense` (k,) are changed as `meet` has it.
    """
    size = step.shape[0]
    felt = carried[carried.shape[0] - size :]
    for i in range(size):
        total = felt[i]
        for c in range(size):
            total += stiffness[i, c] * step[c]
        reaction[i // 2, i % 2] = total
    back_substitute(carried, step, start, inner, border, border_at, numbers, factor_at, factors, near, every)
    largest = advance(
        u, pressure, every, scale, nodes, unknown, lame, recovery_matrix, dilate, volume, u_new, pressure_new
    )
    return largest, meet(u_new, anchor, depth, mu, tau, direction, state, sense, reaction, place, skin, at, length)


@compiled
def meet(
    u: Array,
    anchor: Array,
    depth: float,
    mu: float,
    tau: float,
    direction: int,
    state: Narrow,
    sense: Narrow,
    reaction: Array,
    place: Array,
    skin: Wide,
    at: Narrow,
    length: Array,
) -> int:
    """Change `state` and `sense` (k,) where the forces `reaction` (k, 2) on the skin, or its place, contradict them.

    Return how many were changed. `anchor` (k,) are the positions along x that nodes have slid from.
    """
    x, above = np.empty(skin.shape[0]), np.empty(skin.shape[0])
    _lie(u, depth, place, skin, x, above)
    rubbed(x, at, state, mu, length)
    return update_contact_states(state, sense, reaction, above, x - anchor, length, mu, tau, direction)


@compiled
def _lie(u: Array, depth: float, place: Array, skin: Wide, x: Array, above: Array) -> None:
    """Fill positions `x` (k,) of the skin along the surface and its heights `above` (k,) over it."""
    for i in range(skin.shape[0]):
        x[i] = place[skin[i], 0] + u[skin[i], 0]
        above[i] = place[skin[i], 1] + u[skin[i], 1] - depth
