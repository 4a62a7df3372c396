"""The skin's system of contact for its forces, where the compliance of the linearised body is known."""

from solver._kernels.arguments import CondensedArrays, ContactStates, ContactSystem, LoadArguments, Skin, SkinPosition
from solver._kernels.compiling import HELD_X, OPEN, SHEAR_LIMITED, SLIP, STICK, compiled
from solver.arrays import Array, Narrow


@compiled
def assemble_force_system(
    body: CondensedArrays,
    skin: Skin,
    states: ContactStates,
    load: LoadArguments,
    position: SkinPosition,
    untouched: Array,
    system: ContactSystem,
    forces: Array,
) -> int:
    """Write down the skin's system of contact for its forces: return its size f, and fill its `matrix` and `right`.

    That is what `assemble_contact_system` writes down for steps, where the compliance is known. Unknown are the push on
    what touches, the drag on what sticks, and the parts of the body's m motions, listed in `free` (f,). `untouched`
    (2 k,) is the step without contact. `forces` (2 k + m, 4) is filled where they are known; no column is by mu.
    """
    known = list_forces(skin.held, states, load.tau, system, forces)
    f = known + body.motions.shape[1]
    square, right = system.matrix[: f * f].reshape(f, f), system.right
    right[:f] = 0.0
    for r in range(known):
        row = system.free[r]
        i = row // 2
        mine = body.compliance[row]
        with_drag(mine, system.free[:known], states.state, states.sense, load.mu, square[r])
        right[r, 0] = -untouched[row] - (position.above[i] if row % 2 == 1 else position.x[i] - position.anchor[i])
        right[r, 1 if row % 2 == 1 else 3] = 1.0
        for j in range(states.state.shape[0]):
            if states.state[j] == SHEAR_LIMITED:
                right[r, 0] -= mine[2 * j] * forces[2 * j, 0]
    balance_motions(known, body, states, load.mu, system, square, forces)
    return f


@compiled
def list_forces(held: Narrow, states: ContactStates, tau: float, system: ContactSystem, forces: Array) -> int:
    """List the unknown forces in `free`, fill those `forces` that are known; return how many are unknown."""
    state, sense, _ = states
    forces[:, :] = 0.0
    f = 0
    for i in range(state.shape[0]):
        if state[i] != OPEN:
            system.free[f] = 2 * i + 1
            f += 1
        if state[i] == SHEAR_LIMITED:
            forces[2 * i, 0] = sense[i] * tau * system.length[i]
    for i in range(state.shape[0]):
        if state[i] == STICK and held[i] & HELD_X == 0:
            system.free[f] = 2 * i
            f += 1
    return f


@compiled
def with_drag(numbers: Array, free: Narrow, state: Narrow, sense: Narrow, mu: float, out: Array) -> None:
    """Fill `out` with those of `numbers` (2 k,) that are `free`, plus what drag adds to the push of what slips."""
    for c in range(free.shape[0]):
        unknown = free[c]
        value = numbers[unknown]
        if unknown % 2 == 1 and state[unknown // 2] == SLIP:
            value += sense[unknown // 2] * mu * numbers[unknown - 1]
        out[c] = value


@compiled
def balance_motions(
    known: int, body: CondensedArrays, states: ContactStates, mu: float, system: ContactSystem, square: Array,
    forces: Array,
) -> None:  # fmt: skip
    """Write down the last rows and columns: along motions of the whole body forces balance, and steps are free."""
    motions = body.motions
    for m in range(motions.shape[1]):
        along = motions[:, m].copy()
        system.free[known + m] = motions.shape[0] + m
        for i in range(motions.shape[0]):
            system.right[known + m, 0] += along[i] * (body.force[i] - forces[i, 0])
        for c in range(known):
            square[c, known + m] = along[system.free[c]]
        with_drag(along, system.free[:known], states.state, states.sense, mu, square[known + m])
        square[known + m, known:] = 0.0
