# ruff: noqa: C901 - a compiled loop is flat: calls inside it would cost more than they explain
"""The one search for contact states: a primal-dual active set on the condensed skin of a linearised body.

Alart and Curnier 1991, Comput. Meth. Appl. Mech. Eng. 92, 353; Hüeber and Wohlmuth 2005, ibid. 194, 3147. States that
contradict the solution change all at once; where that goes round in circles, the worst one changes alone.
"""

import numpy as np

from solver._kernels.compiling import CAP, HELD_X, OPEN, SLIP, STICK, Array, Narrow, compiled
from solver._kernels.skin import COLUMNS, STEEP, impose, rubbed, solve

SLACK = 1e-12  # a contradiction smaller than this, relative to the largest of its kind, is round-off
DEPTH_GIVEN, PUSH_GIVEN, DRAG_GIVEN = 0, 1, 2  # what drives the body: its depth, its normal force, its drag too
UNSETTLED, SINGULAR = 0, -1  # what `solve_active_set` returns in place of the number of systems it solved


@compiled
def contradictions(
    state: Narrow,
    sense: Narrow,
    reaction: Array,
    above: Array,
    slid: Array,
    length: Array,
    mu: float,
    tau: float,
    direction: int,
    wanted: Narrow,
    turned: Narrow,
    badness: Array,
) -> int:
    """Fill the states and senses (k,) that a solution calls for, and how badly each node contradicts its own (k,).

    Return how many do. `reaction` (k, 2) forces on the skin, `above` (k,) heights over the surface, `slid` (k,) how far
    each node went along +x relative to the surface since the last step. With `direction` -1 or +1 every touching node
    slips, the friction force pointing there; with 0 nodes stick, slip and turn round. Where friction is steep, slip is
    a bad guess of a node that comes to touch: its own drag may lift it off by more than it is pressed.
    """
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
                    now = CAP
                way = direction if direction != 0 else way
                bad = -above[i] * by_height
        elif reaction[i, 1] < -slack:
            now, bad = OPEN, -reaction[i, 1]
        else:
            coulomb, bound = mu * max(reaction[i, 1], 0.0), tau * max(length[i], 0.0)
            most = min(coulomb, bound)
            slips = CAP if bound < coulomb - slack or (was == CAP and bound <= coulomb + slack) else SLIP
            if direction != 0:
                way, now, bad = direction, slips, reaction[i, 1]
            elif was == STICK:
                if abs(reaction[i, 0]) > most + slack:
                    way = 1 if reaction[i, 0] > 0.0 else -1
                    now, bad = CAP if bound < coulomb else SLIP, abs(reaction[i, 0]) - most
            elif slid[i] * sense[i] > small and most > 0.0:
                now, bad = STICK, slid[i] * sense[i] * by_height
            else:
                now, bad = slips, reaction[i, 1]
        if now != was or (now >= SLIP and way != sense[i]):
            changed += 1
        else:
            bad = -1.0
        wanted[i], turned[i], badness[i] = now, way, bad
    return changed


@compiled
def restate(
    state: Narrow,
    sense: Narrow,
    reaction: Array,
    above: Array,
    slid: Array,
    length: Array,
    mu: float,
    tau: float,
    direction: int,
) -> int:
    """Change `state` and `sense` (k,) in place where the solution contradicts them; return how many were changed."""
    wanted, turned, badness = np.empty_like(state), np.empty_like(sense), np.empty_like(above)
    changed = contradictions(state, sense, reaction, above, slid, length, mu, tau, direction, wanted, turned, badness)
    state[:], sense[:] = wanted, turned
    return changed


@compiled
def solve_active_set(
    stiffness: Array,
    compliance: Array,
    motions: Array,
    force: Array,
    held: Narrow,
    middle: Narrow,
    fixed_length: Array,
    place: Array,
    anchor: Array,
    depth: float,
    mu: float,
    tau: float,
    direction: int,
    control: int,
    wanted_force: Array,
    stride: float,
    rounds: int,
    state: Narrow,
    sense: Narrow,
    length: Array,
    free: Narrow,
    matrix: Array,
    right: Array,
    steps: Array,
    reaction: Array,
    motion: Array,
) -> int:
    """Solve the skin's system of contact, changing states up to `rounds` times until none contradicts the solution.

    That is the contact of the linearised body, exact where the rounds suffice. `stiffness` (2 k, 2 k) and `force`
    (2 k,) are the body's as its skin feels them, `place` (k, 2) where the skin lies, `anchor` (k,) where nodes stick.
    Where the inverse `compliance` (2 k, 2 k) is known, else (0, 0), what is unknown are forces, fewer than steps;
    beside it stand m `motions` (2 k, m) of the body as a whole that cost no energy, along which forces balance. The
    length of skin that bounds a node's friction is `fixed_length` (k,) plus `rubbed`. `control` says whether depth and
    travel are given or follow from `wanted_force` (2,), along x and y; they then change by at most `stride`, and
    `motion` (2,) is by how much. Filled beside it: `steps` (2 k, 4), the first that to equilibrium, the others as
    `impose` has them where steps are unknown; `reaction` (k, 2), `length` (k,). Returns the number of systems solved,
    UNSETTLED or SINGULAR.
    """
    size, by_forces = state.shape[0], compliance.shape[0] > 0
    x, above, slid = place[:, 0].copy(), place[:, 1] - depth, np.empty(size)
    sums = np.zeros((2, 2 * size))  # how the force of the surface along x and y follows steps, or forces
    loads, answer, untouched = np.zeros(2), steps, np.zeros(2 * size)
    if by_forces:
        answer = np.zeros((2 * size + motions.shape[1], COLUMNS))
        for i in range(2 * size):
            sums[i % 2, i] = 1.0
            if force[i] != 0.0:
                untouched -= force[i] * compliance[i]
    elif control != DEPTH_GIVEN:
        for i in range(2 * size):
            loads[i % 2] += force[i]
            for c in range(2 * size):
                sums[i % 2, c] += stiffness[i, c]
    entered = np.zeros(size, np.int32)  # how often each node came to touch
    wanted, turned, badness = np.empty_like(state), np.empty_like(sense), np.empty(size)
    seen, seen_sense, known = np.empty((rounds + 1, size), np.int8), np.empty((rounds + 1, size), np.int8), 0
    one_by_one = held_again = False
    for turn in range(rounds + 1):
        rubbed(x, middle, state, mu, length)
        for i in range(size):
            length[i] += fixed_length[i]
        if by_forces:
            count = impose_forces(
                compliance, motions, force, untouched, held, state, sense, mu, tau, above, x - anchor, length, free,
                matrix, right, answer,
            )  # fmt: skip
        else:
            count = impose(
                stiffness, force, held, middle, state, sense, mu, tau, above, x - anchor, length, free, matrix, right,
                steps,
            )  # fmt: skip
        if not solve(matrix, right[:count], count):
            return SINGULAR
        for r in range(count):
            for c in range(COLUMNS):
                answer[free[r], c] = right[r, c]
        if by_forces:
            for i in range(size):
                if state[i] == SLIP:
                    for c in range(COLUMNS):
                        answer[2 * i, c] = sense[i] * mu * answer[2 * i + 1, c]
        motion[:] = 0.0
        loose = False  # whether nothing holds the body along x: then it may have gone anywhere
        if control != DEPTH_GIVEN:
            stuck = touching = False
            for i in range(size):
                touching |= state[i] != OPEN
                stuck |= state[i] == STICK
            if control == DRAG_GIVEN and not stuck and turn < rounds and not held_again and mu > 0.0 and tau > 0.0:
                # a body that is free along x needs a node that holds it: all are asked again, one by one
                for i in range(size):
                    if state[i] != OPEN:
                        state[i] = STICK
                held_again = one_by_one = True
                continue
            loose = control == DRAG_GIVEN and not stuck
            by_drag = control == DRAG_GIVEN and stuck
            if not touching or not balance(sums, loads, answer, wanted_force, by_drag, stride, motion):
                return SINGULAR
        if by_forces:
            steps[:, 0] = untouched
            for i in range(2 * size):
                reaction[i // 2, i % 2] = answer[i, 0]
                for m in range(motions.shape[1]):
                    steps[i, 0] += motions[i, m] * answer[2 * size + m, 0]
                if answer[i, 0] != 0.0:
                    steps[:, 0] += answer[i, 0] * compliance[i]
        else:
            for i in range(2 * size):
                total = force[i]
                for c in range(2 * size):
                    total += stiffness[i, c] * steps[c, 0]
                reaction[i // 2, i % 2] = total
        if not np.isfinite(reaction.sum()):
            return SINGULAR
        if turn == rounds:
            break
        ahead, reached = x + steps[::2, 0], above + steps[1::2, 0] - motion[0]
        slid[:] = ahead - anchor - motion[1]
        if loose:
            slid[:] = 0.0
        rubbed(ahead, middle, state, mu, length)
        for i in range(size):
            length[i] += fixed_length[i]
        if (
            contradictions(state, sense, reaction, reached, slid, length, mu, tau, direction, wanted, turned, badness)
            == 0
        ):
            return turn + 1
        worst = np.argmax(badness)
        for i in range(size):
            if one_by_one and i != worst:
                continue
            if state[i] == OPEN and (wanted[i] == CAP or wanted[i] == STICK):
                entered[i] += 1  # a node that comes to touch again and again slips every other time
                if entered[i] % 2 == 0:
                    if wanted[i] == STICK:
                        turned[i] = -1 if slid[i] > 0.0 else 1
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
def impose_forces(
    compliance: Array,
    motions: Array,
    force: Array,
    untouched: Array,
    held: Narrow,
    state: Narrow,
    sense: Narrow,
    mu: float,
    tau: float,
    above: Array,
    behind: Array,
    length: Array,
    free: Narrow,
    matrix: Array,
    right: Array,
    forces: Array,
) -> int:
    """Write down the skin's system of contact for its forces: return its size f, and fill `matrix` (f f,), `right`.

    That is what `impose` writes down for steps, where the inverse `compliance` of the stiffness is known: unknown are
    the push on what touches and the drag on what sticks, and the parts of the `motions` (2 k, m), listed in `free`
    (f,). `untouched` (2 k,) is the step without contact. `forces` (2 k + m, 4) is filled where they are known, and
    `right` (f, 4) as `impose` has it but for mu.
    """
    size = state.shape[0]
    forces[:, :] = 0.0
    f = 0
    for i in range(size):
        if state[i] != OPEN:
            free[f] = 2 * i + 1
            f += 1
        if state[i] == CAP:
            forces[2 * i, 0] = sense[i] * tau * length[i]
    for i in range(size):
        if state[i] == STICK and held[i] & HELD_X == 0:
            free[f] = 2 * i
            f += 1
    known, moving = f, motions.shape[1]
    f += moving
    square = matrix[: f * f].reshape(f, f)
    right[:, :] = 0.0
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
        right[r, 0] = -untouched[row] - (above[i] if row % 2 == 1 else behind[i])
        right[r, 1 if row % 2 == 1 else 3] = 1.0
        for j in range(size):
            if state[j] == CAP:
                right[r, 0] -= mine[2 * j] * forces[2 * j, 0]
    return f


@compiled
def balance(
    sums: Array, loads: Array, answer: Array, wanted: Array, by_drag: bool, stride: float, motion: Array
) -> bool:
    """Add to the first of `answer` (2 k, 4) the change of depth, and `by_drag` of travel, that meets `wanted` forces.

    `sums` (2, 2 k) is how the surface's force along x and y follows the answer, beside `loads` (2,). Fills `motion`
    (2,) with both changes, at most `stride`. False where nothing meets them.
    """
    drag, push = np.zeros(COLUMNS), np.zeros(COLUMNS)
    for c in range(sums.shape[1]):
        for s in range(COLUMNS):
            drag[s] += sums[0, c] * answer[c, s]
            push[s] += sums[1, c] * answer[c, s]
    less, lack = wanted[0] - loads[0] - drag[0], wanted[1] - loads[1] - push[0]
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
    if most > stride:
        deeper, along = deeper * stride / most, along * stride / most
    for c in range(answer.shape[0]):
        answer[c, 0] += deeper * answer[c, 1] + along * answer[c, 3]
    motion[0], motion[1] = deeper, along
    return True


@compiled
def meet(
    place: Array,
    anchor: Array,
    depth: float,
    mu: float,
    tau: float,
    direction: int,
    state: Narrow,
    sense: Narrow,
    reaction: Array,
    middle: Narrow,
    fixed_length: Array,
    length: Array,
) -> int:
    """Change `state` and `sense` (k,) where the forces `reaction` (k, 2) on the skin, or its `place`, contradict them.

    Return how many were changed. `anchor` (k,) are the positions along x that nodes have slid from.
    """
    x, above = place[:, 0].copy(), place[:, 1] - depth
    rubbed(x, middle, state, mu, length)
    for i in range(x.shape[0]):
        length[i] += fixed_length[i]
    return restate(state, sense, reaction, above, x - anchor, length, mu, tau, direction)
