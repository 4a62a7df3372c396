# ruff: noqa: C901 - a compiled loop is flat: calls inside it would cost more than they explain
"""Contact of a reduced body with the surface: k points that may touch, r free motions of the body as a whole.

`active_set.Course` says the same in plain NumPy, and the tests compare the two. Arguments that occur everywhere:
`gap`, `length` (k,); `by_normal`, `across`, `by_tangential` (k, k), the compliances of `Touchable`; `up`, `along` (k,),
displacements by dead loads alone; `mu`, `tau`, the friction law. Filled: `state`, `normal`, `tangential`, `shift`,
`above` (k,), as `Contact` names them, `above` being its gap.
"""

import numpy as np

from solver._kernels.compiling import OPEN, SHEAR_LIMITED, SLIP, STICK, Array, States, compiled
from solver._kernels.following import SMALL, solve

LOST, AMBIGUOUS = 0, -1  # what these loops return in place of the number of linear systems they solved


@compiled
def slide(
    gap: Array,
    length: Array,
    by_normal: Array,
    across: Array,
    by_tangential: Array,
    up: Array,
    along: Array,
    mu: float,
    tau: float,
    depth: float,
    sense: float,
    rounds: int,
    first: float,
    state: States,
    normal: Array,
    tangential: Array,
    shift: Array,
    above: Array,
) -> int:
    """Find the settled slide whose friction forces point along `sense`; LOST where `rounds` systems do not do it.

    Skin that would lie deeper than `first` times the `depth` in the surface is first thought to touch.
    """
    k = gap.shape[0]
    at, lifted, answer = np.empty(k, np.int64), np.empty(k), np.empty(k)
    highest = gap.max()
    for i in range(k):
        state[i] = SLIP if gap[i] + up[i] - depth < -first * depth else OPEN
    for turn in range(1, rounds + 1):
        count = 0
        for i in range(k):
            lifted[i] = gap[i] + up[i] - depth
            normal[i] = tangential[i] = 0.0
            if state[i] != OPEN:
                at[count] = i
                count += 1
        if count == 0:
            return LOST
        matrix, right = np.empty((count, count)), answer[:count]
        for c in range(count):
            j = at[c]
            if state[j] == SHEAR_LIMITED:
                tangential[j] = sense * tau * length[j]
                for i in range(k):
                    lifted[i] += across[i, j] * tangential[j]
            drag = sense * mu if state[j] == SLIP else 0.0
            for r in range(count):
                matrix[r, c] = by_normal[at[r], j] + drag * across[at[r], j]
        for r in range(count):
            right[r] = -lifted[at[r]]
        if not solve(matrix, right):
            return LOST
        push, high = 0.0, highest
        for c in range(count):
            j = at[c]
            normal[j] = right[c]
            push = max(push, abs(right[c]))
            if state[j] == SLIP:
                tangential[j] = sense * mu * right[c]
        for i in range(k):
            total = lifted[i]
            for c in range(count):
                j = at[c]
                drag = sense * mu if state[j] == SLIP else 0.0
                total += (by_normal[i, j] + drag * across[i, j]) * right[c]
            above[i] = total
            high = max(high, total)
        slack, changed = SMALL * push, False
        for i in range(k):
            was, now = state[i], SLIP
            if was == OPEN:
                now = SLIP if above[i] < -SMALL * high else OPEN
            elif normal[i] < -slack:
                now = OPEN
            elif mu * normal[i] > tau * length[i] + (-slack if was == SHEAR_LIMITED else slack):
                now = SHEAR_LIMITED
            changed |= now != was
            state[i] = now
        if not changed:
            for i in range(k):
                total = along[i]
                for c in range(count):
                    total += by_tangential[i, at[c]] * tangential[at[c]] + across[at[c], i] * normal[at[c]]
                shift[i] = total
            return turn
    return LOST


@compiled
def solve_active_set(
    gap: Array,
    length: Array,
    by_normal: Array,
    across: Array,
    by_tangential: Array,
    up: Array,
    along: Array,
    motions: Array,
    resultants: Array,
    mu: float,
    tau: float,
    depth: float,
    travel: float,
    anchor: Array,
    free: bool,
    entering: int,
    patience: int,
    state: States,
    sense: Array,
    normal: Array,
    tangential: Array,
    shift: Array,
    above: Array,
    motion: Array,
) -> int:
    """Change `state` and `sense` (k,) until they contradict nothing; with `free`, points may stick and turn round.

    `motions` (2 k, r), `resultants` (r,) are the body's, `motion` (r,) is filled; points stick at `anchor` (k,), and
    one that comes to touch is first thought to be `entering`. LOST after `patience` systems, AMBIGUOUS where the
    touching points have no unique forces.
    """
    k, r = gap.shape[0], resultants.shape[0]
    number = np.empty(2 * k, np.int64)  # of each force in the system, -1 where it is no unknown
    lifted, moved, badness = np.empty(k), np.empty(k), np.empty(k)
    wanted, turned = np.empty(k, np.int8), np.empty(k)
    seen, seen_sense, known = np.empty((patience, k), np.int8), np.empty((patience, k)), 0
    frictionless = mu == 0.0 or tau == 0.0
    one_by_one = resticked = False
    for turn in range(1, patience + 1):
        size = stuck = 0
        for i in range(k):
            number[i] = number[k + i] = -1
            if state[i] != OPEN:
                number[i] = size
                size += 1
        touching = size
        for i in range(k):
            if state[i] == STICK:
                number[k + i] = size
                size += 1
                stuck += 1
        matrix, right = np.zeros((size + r, size + r)), np.empty(size + r)
        for i in range(k):
            tangential[i] = sense[i] * tau * length[i] if state[i] == SHEAR_LIMITED else 0.0
        for i in range(k):
            lifted[i], moved[i] = gap[i] + up[i] - depth, along[i] + travel
            for j in range(k):
                if state[j] == SHEAR_LIMITED:
                    lifted[i] += across[i, j] * tangential[j]
                    moved[i] += by_tangential[i, j] * tangential[j]
        for a in range(2 * k):
            row = number[a]
            if row < 0:
                continue
            i = a if a < k else a - k
            right[row] = -lifted[i] if a < k else anchor[i] - moved[i]
            for j in range(k):
                if state[j] == OPEN:
                    continue
                value = by_normal[i, j] if a < k else across[j, i]
                other = across[i, j] if a < k else by_tangential[i, j]
                if state[j] == SLIP:
                    value += sense[j] * mu * other
                elif state[j] == STICK:
                    matrix[row, number[k + j]] = other
                matrix[row, number[j]] = value
            for m in range(r):
                matrix[row, size + m] = motions[a, m]
        for m in range(r):
            right[size + m] = resultants[m]
            for j in range(k):
                if state[j] == SHEAR_LIMITED:
                    right[size + m] -= motions[k + j, m] * tangential[j]
                if state[j] != OPEN:
                    drag = sense[j] * mu if state[j] == SLIP else 0.0
                    matrix[size + m, number[j]] = motions[j, m] + motions[k + j, m] * drag
                if state[j] == STICK:
                    matrix[size + m, number[k + j]] = motions[k + j, m]
        if not solve(matrix, right):
            if not free or resticked or stuck > 0 or touching == 0:
                return AMBIGUOUS
            # a body that is free along x needs a point that holds it: all are asked again, one by one
            for i in range(k):
                if state[i] != OPEN:
                    state[i] = STICK
            resticked = one_by_one = True
            continue
        force, height = 0.0, 0.0
        for i in range(k):
            normal[i] = right[number[i]] if number[i] >= 0 else 0.0
            force = max(force, abs(normal[i]))
            if state[i] == SLIP:
                tangential[i] = sense[i] * mu * normal[i]
            elif state[i] == STICK:
                tangential[i] = right[number[k + i]]
        for m in range(r):
            motion[m] = right[size + m]
        for i in range(k):
            high, far = gap[i] + up[i] - depth, along[i] + travel
            for j in range(k):
                high += by_normal[i, j] * normal[j] + across[i, j] * tangential[j]
                far += across[j, i] * normal[j] + by_tangential[i, j] * tangential[j]
            for m in range(r):
                high += motions[i, m] * motion[m]
                far += motions[k + i, m] * motion[m]
            above[i], shift[i] = high, far
            height = max(height, abs(gap[i]), abs(high), abs(far))
        height = max(height, 2.2250738585072014e-308)
        # states that contradict the solution
        slack, changed, worst = SMALL * force, 0, -1
        for i in range(k):
            now, way, bad = state[i], sense[i], 0.0
            coulomb, bound = mu * normal[i], tau * length[i]
            if state[i] == OPEN:
                if above[i] < -SMALL * height:
                    now, bad = entering, -above[i] * force / height
                    if free:
                        way = -1.0 if shift[i] > anchor[i] else 1.0
            elif normal[i] < -slack:
                now, bad = OPEN, -normal[i]
                if free and not frictionless and state[i] == STICK and abs(tangential[i]) > slack:
                    way = 1.0 if tangential[i] > 0.0 else -1.0
            elif state[i] == STICK:
                over = abs(tangential[i]) - min(max(coulomb, 0.0), bound)
                if free and not frictionless and over > slack:
                    way = 1.0 if tangential[i] > 0.0 else -1.0
                    now, bad = SHEAR_LIMITED if coulomb > bound else SLIP, over
            elif state[i] == SLIP and coulomb > bound + slack:
                now, bad = SHEAR_LIMITED, normal[i]
            elif state[i] == SHEAR_LIMITED and coulomb < bound - slack:
                now, bad = SLIP, normal[i]
            elif free and not frictionless:
                forward = (shift[i] - anchor[i]) * sense[i]
                if forward > SMALL * height:
                    now, bad = STICK, forward * force / height
            wanted[i], turned[i], badness[i] = now, way, bad
            if now != state[i] or way != sense[i]:
                changed += 1
                if worst < 0 or bad > badness[worst]:
                    worst = i
        if changed == 0:
            return turn
        if one_by_one:
            state[worst], sense[worst] = wanted[worst], turned[worst]
        else:
            state[:], sense[:] = wanted, turned
        before = False
        for n in range(known):
            before |= np.all(seen[n] == state) and np.all(seen_sense[n] == sense)
        if before:
            one_by_one, known = True, 0
        seen[known], seen_sense[known] = state, sense
        known += 1
    return LOST
