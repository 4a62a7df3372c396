# ruff: noqa: C901 - a compiled loop is flat: calls inside it would cost more than they explain
"""The one search for contact states: a primal-dual active set on the condensed skin of a linearised body.

Alart and Curnier 1991, Comput. Meth. Appl. Mech. Eng. 92, 353; Hüeber and Wohlmuth 2005, ibid. 194, 3147. States that
contradict the solution change all at once; where that goes round in circles, the worst one changes alone.
"""

import numpy as np

from solver._kernels.arguments import (
    CondensedArrays,
    ContactStates,
    ContactSystem,
    ForceControl,
    LoadArguments,
    Skin,
    SkinPosition,
    StateChanges,
)
from solver._kernels.compiling import HELD_X, OPEN, SHEAR_LIMITED, SLIP, STICK, compiled
from solver._kernels.skin import COLUMNS, STEEP, assemble_contact_system, bounded_length, solve
from solver.arrays import Array

SLACK = 1e-12  # a contradiction smaller than this, relative to the largest of its kind, is round-off
DEPTH_GIVEN, PUSH_GIVEN, DRAG_GIVEN = 0, 1, 2  # what drives the body: its depth, its normal force, its drag too
UNSETTLED, SINGULAR = 0, -1  # what `solve_active_set` returns in place of the number of systems it solved


@compiled
def contradictions(
    states: ContactStates, above: Array, slip: Array, length: Array, load: LoadArguments, changes: StateChanges
) -> int:
    """Fill the `changes` of state and sense that a solution calls for; return how many nodes contradict it.

    `above` (k,) are heights over the surface, `slip` (k,) is how far each node went along +x relative to the surface
    since the last step, `length` (k,) as in `bounded_length`. Where the load has a sense every touching node slips, the
    friction force pointing there; else nodes stick, slip and turn round. Where friction is steep, slip is a bad guess
    of a node that comes to touch: its own drag may lift it off by more than it is pressed.
    """
    state, sense, reaction = states
    mu, tau, direction = load.mu, load.tau, load.sense
    wanted, turned, badness = changes
    changed = 0
    size = state.shape[0]
    force = height = 0.0
    for i in range(size):
        force = max(force, abs(reaction[i, 1]))
        height = max(height, abs(above[i]))
    slack, small = SLACK * force, SLACK * height
    by_height = force / height if height > 0.0 else 0.0
    for i in range(size):
        was, way = state[i], sense[i]
        now, bad = was, 0.0
        if was == OPEN:
            if above[i] < -small:
                now = STICK if direction == 0 and mu > 0.0 and tau > 0.0 else SLIP
                if direction != 0 and mu > STEEP and tau < np.inf:
                    now = SHEAR_LIMITED
                way = direction if direction != 0 else way
                bad = -above[i] * by_height
        elif reaction[i, 1] < -slack:
            now, bad = OPEN, -reaction[i, 1]
        else:
            coulomb, bound = mu * max(reaction[i, 1], 0.0), tau * max(length[i], 0.0)
            most = min(coulomb, bound)
            slips = (
                SHEAR_LIMITED
                if bound < coulomb - slack or (was == SHEAR_LIMITED and bound <= coulomb + slack)
                else SLIP
            )
            if direction != 0:
                way, now, bad = direction, slips, reaction[i, 1]
            elif was == STICK:
                if abs(reaction[i, 0]) > most + slack:
                    way = 1 if reaction[i, 0] > 0.0 else -1
                    now, bad = SHEAR_LIMITED if bound < coulomb else SLIP, abs(reaction[i, 0]) - most
            elif slip[i] * sense[i] > small and most > 0.0:
                now, bad = STICK, slip[i] * sense[i] * by_height
            else:
                now, bad = slips, reaction[i, 1]
        if now != was or (now >= SLIP and way != sense[i]):
            changed += 1
        else:
            bad = -1.0
        wanted[i], turned[i], badness[i] = now, way, bad
    return changed


@compiled
def update_contact_states(states: ContactStates, above: Array, slip: Array, length: Array, load: LoadArguments) -> int:
    """Change `states` in place where the solution contradicts them; return how many were changed."""
    size = above.shape[0]
    changes = StateChanges(np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size))
    changed = contradictions(states, above, slip, length, load, changes)
    for i in range(size):
        states.state[i], states.sense[i] = changes.state[i], changes.sense[i]
    return changed


@compiled
def solve_active_set(
    body: CondensedArrays,
    skin: Skin,
    states: ContactStates,
    load: LoadArguments,
    position: SkinPosition,
    control: ForceControl,
    rounds: int,
    system: ContactSystem,
) -> int:
    """Solve the skin's system of contact, changing `states` up to `rounds` times until none contradicts the solution.

    That is the contact of the linearised body, exact where the rounds suffice. Where the compliance is known, what is
    unknown are forces, fewer than steps. Filled: the reactions of `states`, and `system` with its `steps`, the first
    that to equilibrium, the others where steps are unknown. Returns the number of systems solved, UNSETTLED or
    SINGULAR.
    """
    stiffness, force, compliance, motions = body
    state, sense, reaction = states
    x, above, anchor = position
    length, free, matrix, right, steps, motion = system
    mu, tau, kind = load.mu, load.tau, control.kind
    size, by_forces = state.shape[0], compliance.shape[0] > 0
    slip = np.empty(size)
    sums = np.zeros((2, 2 * size))  # how the force of the surface along x and y follows steps, or forces
    loads, answer, untouched = np.zeros(2), steps, np.zeros(2 * size)
    if by_forces:
        answer = np.zeros((2 * size + motions.shape[1], COLUMNS))
        for i in range(2 * size):
            sums[i % 2, i] = 1.0
            for c in range(2 * size):
                untouched[c] -= force[i] * compliance[i, c]
    elif kind != DEPTH_GIVEN:
        for i in range(2 * size):
            loads[i % 2] += force[i]
            for c in range(2 * size):
                sums[i % 2, c] += stiffness[i, c]
    entered = np.zeros(size, np.int32)  # how often each node came to touch
    changes = StateChanges(np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size))
    wanted, turned, badness = changes
    seen, seen_sense, known = np.empty((rounds + 1, size), np.int32), np.empty((rounds + 1, size), np.int32), 0
    ahead, reached = np.empty(size), np.empty(size)
    one_by_one = held_again = False
    for turn in range(rounds + 1):
        bounded_length(x, skin, state, mu, length)
        if by_forces:
            count = assemble_force_system(body, skin, states, load, position, untouched, system, answer)
        else:
            count = assemble_contact_system(body, skin, states, load, position, system)
        if not solve(matrix, right, count):
            return SINGULAR
        for r in range(count):
            for c in range(COLUMNS):
                answer[free[r], c] = right[r, c]
        if by_forces:
            for i in range(size):
                if state[i] == SLIP:
                    for c in range(COLUMNS):
                        answer[2 * i, c] = sense[i] * mu * answer[2 * i + 1, c]
        motion[0] = motion[1] = 0.0
        loose = False  # whether nothing holds the body along x: then it may have gone anywhere
        if kind != DEPTH_GIVEN:
            stuck = touching = False
            for i in range(size):
                touching |= state[i] != OPEN
                stuck |= state[i] == STICK
            if kind == DRAG_GIVEN and not stuck and turn < rounds and not held_again and mu > 0.0 and tau > 0.0:
                # a body that is free along x needs a node that holds it: all are asked again, one by one
                for i in range(size):
                    if state[i] != OPEN:
                        state[i] = STICK
                held_again = one_by_one = True
                continue
            loose = kind == DRAG_GIVEN and not stuck
            by_drag = kind == DRAG_GIVEN and stuck
            if not touching or not balance(sums, loads, answer, control, by_drag, motion):
                return SINGULAR
        if by_forces:
            for i in range(2 * size):
                reaction[i // 2, i % 2] = answer[i, 0]
                steps[i, 0] = untouched[i]
                for m in range(motions.shape[1]):
                    steps[i, 0] += motions[i, m] * answer[2 * size + m, 0]
            for i in range(2 * size):
                if answer[i, 0] != 0.0:
                    for c in range(2 * size):
                        steps[c, 0] += answer[i, 0] * compliance[i, c]
        else:
            for i in range(2 * size):
                total = force[i]
                for c in range(2 * size):
                    total += stiffness[i, c] * steps[c, 0]
                reaction[i // 2, i % 2] = total
        whole = 0.0
        for i in range(size):
            whole += reaction[i, 0] + reaction[i, 1]
        if not np.isfinite(whole):
            return SINGULAR
        if turn == rounds:
            break
        for i in range(size):
            ahead[i], reached[i] = x[i] + steps[2 * i, 0], above[i] + steps[2 * i + 1, 0] - motion[0]
            slip[i] = 0.0 if loose else ahead[i] - anchor[i] - motion[1]
        bounded_length(ahead, skin, state, mu, length)
        if contradictions(states, reached, slip, length, load, changes) == 0:
            return turn + 1
        worst = 0
        for i in range(size):
            if badness[i] > badness[worst]:
                worst = i
        for i in range(size):
            if one_by_one and i != worst:
                continue
            if state[i] == OPEN and (wanted[i] == SHEAR_LIMITED or wanted[i] == STICK):
                entered[i] += 1  # a node that comes to touch again and again slips every other time
                if entered[i] % 2 == 0:
                    if wanted[i] == STICK:
                        turned[i] = -1 if slip[i] > 0.0 else 1
                    wanted[i] = SLIP
            state[i], sense[i] = wanted[i], turned[i]
        before = False
        for n in range(known):
            same = True
            for i in range(size):
                same &= seen[n, i] == state[i] and seen_sense[n, i] == sense[i]
            before |= same
        if before:
            one_by_one, known = True, 0
        for i in range(size):
            seen[known, i], seen_sense[known, i] = state[i], sense[i]
        known += 1
    return UNSETTLED


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
    compliance, motions, force = body.compliance, body.motions, body.force
    state, sense = states.state, states.sense
    x, above, anchor = position
    length, free, matrix, right, _, _ = system
    mu, tau, held = load.mu, load.tau, skin.held
    size = state.shape[0]
    for i in range(forces.shape[0]):
        for c in range(COLUMNS):
            forces[i, c] = 0.0
    f = 0
    for i in range(size):
        if state[i] != OPEN:
            free[f] = 2 * i + 1
            f += 1
        if state[i] == SHEAR_LIMITED:
            forces[2 * i, 0] = sense[i] * tau * length[i]
    for i in range(size):
        if state[i] == STICK and held[i] & HELD_X == 0:
            free[f] = 2 * i
            f += 1
    known, moving = f, motions.shape[1]
    f += moving
    square = matrix[: f * f].reshape(f, f)
    for r in range(f):
        for c in range(COLUMNS):
            right[r, c] = 0.0
    for m in range(moving):
        free[known + m] = 2 * size + m
        for i in range(2 * size):
            right[known + m, 0] += motions[i, m] * (force[i] - forces[i, 0])
        for c in range(known):
            other = free[c]
            value = motions[other, m]
            square[c, known + m] = value
            if other % 2 == 1 and state[other // 2] == SLIP:
                value += sense[other // 2] * mu * motions[other - 1, m]
            square[known + m, c] = value
        for c in range(moving):
            square[known + m, known + c] = 0.0
    for r in range(known):
        row = free[r]
        i = row // 2
        mine = compliance[row]
        for c in range(known):
            other = free[c]
            value = mine[other]
            if other % 2 == 1 and state[other // 2] == SLIP:
                value += sense[other // 2] * mu * mine[other - 1]
            square[r, c] = value
        right[r, 0] = -untouched[row] - (above[i] if row % 2 == 1 else x[i] - anchor[i])
        right[r, 1 if row % 2 == 1 else 3] = 1.0
        for j in range(size):
            if state[j] == SHEAR_LIMITED:
                right[r, 0] -= mine[2 * j] * forces[2 * j, 0]
    return f


@compiled
def balance(sums: Array, loads: Array, answer: Array, control: ForceControl, by_drag: bool, motion: Array) -> bool:
    """Add to the first of `answer` (2 k, 4) the change of depth, `by_drag` of travel too, that meets given forces.

    `sums` (2, 2 k) is how the surface's force along x and y follows the answer, beside `loads` (2,). Fills `motion`
    (2,) with both changes, at most its stride. False where nothing meets them.
    """
    drag, push = np.zeros(COLUMNS), np.zeros(COLUMNS)
    for c in range(sums.shape[1]):
        for s in range(COLUMNS):
            drag[s] += sums[0, c] * answer[c, s]
            push[s] += sums[1, c] * answer[c, s]
    less, lack = control.drag - loads[0] - drag[0], control.push - loads[1] - push[0]
    deeper = along = 0.0
    if by_drag:
        det = push[1] * drag[3] - push[3] * drag[1]
        if det == 0.0:
            return False
        deeper = (lack * drag[3] - less * push[3]) / det
        along = (push[1] * less - drag[1] * lack) / det
    elif push[1] != 0.0:
        deeper = lack / push[1]
    most = max(abs(deeper), abs(along))
    if not np.isfinite(most):
        return False
    if most > control.stride:
        deeper, along = deeper * control.stride / most, along * control.stride / most
    for c in range(answer.shape[0]):
        answer[c, 0] += deeper * answer[c, 1] + along * answer[c, 3]
    motion[0], motion[1] = deeper, along
    return True


@compiled
def meet(states: ContactStates, position: SkinPosition, load: LoadArguments, skin: Skin, length: Array) -> int:
    """Change `states` where the forces on the skin, or its position, contradict them; return how many were changed.

    The anchors are positions that nodes have slid from. Filled: `length` (k,), of skin on which a bound acts.
    """
    bounded_length(position.x, skin, states.state, load.mu, length)
    slip = np.empty(length.shape[0])
    for i in range(length.shape[0]):
        slip[i] = position.x[i] - position.anchor[i]
    return update_contact_states(states, position.above, slip, length, load)
