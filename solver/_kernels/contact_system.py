"""The linear system of contact on the skin, in displacement steps or, where the compliance is known, in forces.

The first functions compute the tributary lengths of skin nodes.
"""

import numpy as np

from solver._kernels import HELD_X, HELD_Y, OPEN, SHEAR_LIMITED, SLIP, STICK, compile_loop, subroutine
from solver.arrays import (
    Array,
    CondensedArrays,
    ContactStates,
    ContactSystem,
    Indices,
    LoadArguments,
    Narrow,
    Skin,
    SkinPosition,
)

RIGHT_SIDES = 4  # right-hand sides that are solved together
ZERO = 1e-15  # a pivot below this, relative to the largest diagonal entry, is round-off

# tributary lengths of an edge's first, middle and last node from the positions of the three: Simpson's rule
_LENGTHS = np.array([[-3.0, 4.0, -1.0], [-4.0, 0.0, 4.0], [1.0, -4.0, 3.0]]) / 6.0

SHEAR_LIMITED_MU = 1.0  # with more friction, the first guess for a node that comes into contact is shear-limited


@compile_loop
def tributary(x: Array, middle: Narrow, out: Array) -> None:
    """Fill `out` (k,) with the tributary length of skin of each node, `x` (k,) being positions along the surface.

    Simpson's rule on edges of three nodes; `middle` (k,) is 1 in the middle, 0 at ends. Lengths are linear in x.
    """
    out[:] = 0.0
    for i in range(middle.shape[0]):
        if middle[i] == 1:
            for n in range(3):
                row = _LENGTHS[n]
                out[i - 1 + n] += row[0] * x[i - 1] + row[1] * x[i] + row[2] * x[i + 1]


@compile_loop
def bounded_length(x: Array, skin: Skin, out: Array) -> None:
    """Fill `out` (k,) with the length of skin on which the traction bound acts at each node, `x` as for `tributary`.

    Contact ends anywhere between two nodes. The bound acts on the whole tributary length of a touching node.
    """
    tributary(x, skin.middle, out)
    for i in range(out.shape[0]):
        out[i] += skin.fixed_length[i]


@compile_loop
def assemble_contact_system(
    body: CondensedArrays,
    skin: Skin,
    states: ContactStates,
    load: LoadArguments,
    position: SkinPosition,
    system: ContactSystem,
) -> int:
    """Assemble the skin's system of contact in displacement steps; return its size f.

    Fills `matrix` (f f,), `right` (f, 4), the list of unknowns `free` (f,), and `steps` (2 k, 4) where contact
    conditions prescribe displacements. The columns are the step to equilibrium, and its derivatives with respect to
    depth, mu and travel of the surface along +x. `length` must come from `bounded_length`.
    """
    state, sense, _ = states
    free, steps, force = system.free, system.steps, body.force
    f = prescribe(skin, state, position, system)
    position_of = np.full(steps.shape[0], -1)
    for r in range(f):
        position_of[free[r]] = r
    matrix = system.matrix[: f * f].reshape(f, f)
    for r in range(f):
        i: int = free[r] // 2
        right, sense_of_slip, drag = system.right[r], 0.0, 0.0
        if state[i] == SLIP:  # T = s mu N, with the normal force N from the row for y
            sense_of_slip, drag = sense[i], sense[i] * load.mu
        row, push = body.stiffness[free[r]], body.stiffness[2 * i + 1]
        right[0], right[1] = drag * force[2 * i + 1] - force[free[r]], 0.0
        right[2], right[3] = sense_of_slip * force[2 * i + 1], 0.0
        for j in range(position_of.shape[0]):
            value = row[j] - drag * push[j]
            if position_of[j] >= 0:
                matrix[r, position_of[j]] = value
            else:
                for s in range(RIGHT_SIDES):
                    right[s] -= value * steps[j, s]
        if state[i] == SHEAR_LIMITED:
            add_bound(i, sense[i] * load.tau, skin.middle, position_of, system, matrix[r])
    return f


@subroutine
def prescribe(skin: Skin, state: Narrow, position: SkinPosition, system: ContactSystem) -> int:
    """Fill the `steps` that contact states prescribe, and list the `free` unknowns; return the number of unknowns."""
    free, steps, held = system.free, system.steps, skin.held
    steps[:, :] = 0.0
    f = 0
    for i in range(state.shape[0]):
        x, y = 2 * i, 2 * i + 1
        if held[i] & HELD_X == 0:
            if state[i] == STICK:
                steps[x, 0], steps[x, 3] = position.anchor[i] - position.x[i], 1.0
            else:
                free[f] = x
                f += 1
        if held[i] & HELD_Y == 0:
            if state[i] == OPEN:
                free[f] = y
                f += 1
            else:
                steps[y, 0], steps[y, 1] = -position.above[i], 1.0
    return f


@subroutine
def add_bound(i: int, drag: float, middle: Narrow, position_of: Indices, system: ContactSystem, row: Array) -> None:
    """Add the traction bound to the `row` (f,) of node i: `drag` [MPa] times the node's length of skin.

    `position_of` (2 k,) is the position of each skin unknown in the system, -1 for a prescribed step.
    """
    r, steps = position_of[2 * i], system.steps
    right = system.right[r]
    right[0] += drag * system.length[i]
    for edge in range(max(i - 1, 0), min(i + 2, middle.shape[0])):
        if middle[edge] != 1:
            continue
        for n in range(3):
            x = 2 * (edge - 1 + n)
            slope = drag * _LENGTHS[i - edge + 1, n]
            if position_of[x] >= 0:
                row[position_of[x]] -= slope
            else:
                right[0] += slope * steps[x, 0]
                right[3] += slope * steps[x, 3]


@subroutine
def solve(matrix: Array, right: Array, size: int) -> bool:
    """Solve the system of contact, `matrix` (size size,), in place for `right` (size, 4).

    Returns False where a pivot is round-off. Pivoting is unnecessary: apart from its rows of contact and friction, the
    matrix is the tangent of a stable body.
    """
    a = matrix[: size * size].reshape(size, size)
    over = np.empty(size)  # reciprocal pivots
    least = 0.0
    for r in range(size):
        least = max(least, ZERO * abs(a[r, r]))
    for r in range(size):
        eliminate_row(r, a, right, over)
        if abs(a[r, r]) <= least:
            return False
        over[r] = 1.0 / a[r, r]
    for r in range(size - 1, -1, -1):
        for c in range(r + 1, size):
            for s in range(RIGHT_SIDES):
                right[r, s] -= a[r, c] * right[c, s]
        for s in range(RIGHT_SIDES):
            right[r, s] *= over[r]
    return True


@subroutine
def eliminate_row(r: int, a: Array, right: Array, over: Array) -> None:
    """Eliminate the previous rows from row r, four at a time; `over` (r,) contains their reciprocal pivots."""
    row = a[r]
    p = 0
    while p + 4 <= r:
        s0, s1, s2, s3 = a[p], a[p + 1], a[p + 2], a[p + 3]
        f0 = row[p] * over[p]
        f1 = (row[p + 1] - f0 * s0[p + 1]) * over[p + 1]
        f2 = (row[p + 2] - f0 * s0[p + 2] - f1 * s1[p + 2]) * over[p + 2]
        f3 = (row[p + 3] - f0 * s0[p + 3] - f1 * s1[p + 3] - f2 * s2[p + 3]) * over[p + 3]
        target = row[p + 4 :]
        s0, s1, s2, s3 = s0[p + 4 :], s1[p + 4 :], s2[p + 4 :], s3[p + 4 :]
        for c in range(target.shape[0]):
            target[c] -= f0 * s0[c] + f1 * s1[c] + f2 * s2[c] + f3 * s3[c]
        for s in range(RIGHT_SIDES):
            right[r, s] -= f0 * right[p, s] + f1 * right[p + 1, s] + f2 * right[p + 2, s] + f3 * right[p + 3, s]
        p += 4
    while p < r:
        factor = row[p] * over[p]
        for c in range(p + 1, row.shape[0]):
            row[c] -= factor * a[p, c]
        for s in range(RIGHT_SIDES):
            right[r, s] -= factor * right[p, s]
        p += 1


@subroutine
def assemble_force_system(
    compliance: Array,
    skin: Skin,
    states: ContactStates,
    load: LoadArguments,
    position: SkinPosition,
    unloaded_step: Array,
    system: ContactSystem,
    forces: Array,
) -> int:
    """Assemble the skin's system of contact in forces, with a known compliance; return its size f.

    Fills the arrays of `assemble_contact_system`. The unknowns are the normal forces on touching nodes, the tangential
    forces on sticking nodes, and the body's m rigid motions. `unloaded_step` (2 k + m,) is the step without contact.
    Known entries of `forces` (2 k + m, 4) are filled. The derivatives with respect to mu are not computed.
    """
    state, sense, _ = states
    pushes, f = list_forces(skin.held, states, load.tau, system, forces)
    free, right = system.free, system.right
    matrix = system.matrix[: f * f].reshape(f, f)
    right[:f] = 0.0
    for r in range(f):
        row = free[r]
        i, response = row // 2, compliance[row]
        for c in range(f):
            matrix[r, c] = response[free[c]]
        for c in range(pushes):
            j = free[c] // 2
            if state[j] == SLIP:
                matrix[r, c] += sense[j] * load.mu * response[2 * j]
        right[r, 0] = -unloaded_step[row]
        for j in range(state.shape[0]):
            if state[j] == SHEAR_LIMITED:
                right[r, 0] -= response[2 * j] * forces[2 * j, 0]
        if r < pushes:
            right[r, 0] -= position.above[i]
            right[r, 1] = 1.0
        elif i < state.shape[0]:
            right[r, 0] -= position.x[i] - position.anchor[i]
            right[r, 3] = 1.0
    return f


@subroutine
def list_forces(
    held: Narrow, states: ContactStates, tau: float, system: ContactSystem, forces: Array
) -> tuple[int, int]:
    """List the unknown forces in `free`, normal forces first, and fill the known `forces`.

    Returns the number of unknown normal forces, and the number of all unknowns.
    """
    state, sense, _ = states
    forces[:, :] = 0.0
    f = 0
    for i in range(state.shape[0]):
        if state[i] != OPEN:
            system.free[f] = 2 * i + 1
            f += 1
        if state[i] == SHEAR_LIMITED:
            forces[2 * i, 0] = sense[i] * tau * system.length[i]
    pushes = f
    for i in range(state.shape[0]):
        if state[i] == STICK and held[i] & HELD_X == 0:
            system.free[f] = 2 * i
            f += 1
    for m in range(2 * state.shape[0], forces.shape[0]):
        system.free[f] = m
        f += 1
    return pushes, f
