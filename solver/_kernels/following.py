# ruff: noqa: C901 - a compiled loop is flat: calls inside it would cost more than they explain
"""The compiled loop of the small-strain stepper: contact of a condensed body under given forces, one reading at a time.

`active_set.Course` on a body free to move along x and y says the same in plain NumPy; the tests compare the two.
Shapes: k points that may touch. Displacements and forces are (2 k,), those along y first.
"""

import numpy as np

from solver._kernels.compiling import OPEN, SHEAR_LIMITED, SLIP, STICK, Array, Narrow, compiled

SMALL = 1e-11  # a contradiction smaller than this, relative to the largest of its kind, is round-off
LOST, STICKING, SLIDING = -1, 0, 1  # what `follow` returns


@compiled
def solve(matrix: Array, right: Array) -> bool:
    """Replace `right` (n,) by the solution, `matrix` (n, n) by its factors (Gauss, largest pivot); False where none."""
    size = right.shape[0]
    for p in range(size):
        best = p
        for r in range(p + 1, size):
            if abs(matrix[r, p]) > abs(matrix[best, p]):
                best = r
        if matrix[best, p] == 0.0:
            return False
        if best != p:
            for c in range(p, size):
                matrix[p, c], matrix[best, c] = matrix[best, c], matrix[p, c]
            right[p], right[best] = right[best], right[p]
        for r in range(p + 1, size):
            factor = matrix[r, p] / matrix[p, p]
            if factor != 0.0:
                for c in range(p + 1, size):
                    matrix[r, c] -= factor * matrix[p, c]
                right[r] -= factor * right[p]
    for r in range(size - 1, -1, -1):
        total = right[r]
        for c in range(r + 1, size):
            total -= matrix[r, c] * right[c]
        right[r] = total / matrix[r, r]
    return True


@compiled
def follow(
    gap: Array,
    length: Array,
    compliance: Array,
    mu: float,
    tau: float,
    normal: float,
    tangential: float,
    slides: bool,
    anchor: Array,
    state: Narrow,
    sense: Narrow,
    force: Array,
    moved: Array,
    motion: Array,
) -> int:
    """Bring `state`, `sense` (k,), `force`, `moved` (2 k,) and `motion` (2,) to balance with the two forces.

    `gap`, `length` (k,), `compliance` (2 k, 2 k) [mm per N/mm]; `anchor` (k,) where points would stick, relative to
    where they would be undeformed, in the surface's frame [mm]. `motion` is depth and travel. Where `slides`, or where
    no point can stick, all slip along the tangential force, and the travel stays as it was. Returns STICKING, SLIDING,
    or LOST where no states were found that contradict nothing.
    """
    k = gap.shape[0]
    turned = 1 if tangential > 0.0 else -1
    patience = 12 + k
    number = np.empty(2 * k, np.int64)  # of each force in the system, -1 where it is no unknown
    came = np.zeros(k, np.int64)  # how often a point came to touch: it is first thought to stick, then to slip, ...
    for round in range(patience):
        touching = stuck = 0
        for i in range(k):
            if slides and state[i] == STICK:
                state[i] = SLIP
            if slides:
                sense[i] = turned
            touching += state[i] != OPEN
            stuck += state[i] == STICK
        if touching == 0:
            lowest = 0
            for i in range(k):
                if gap[i] < gap[lowest]:
                    lowest = i
            state[lowest] = SLIP if slides else STICK
            touching, stuck = 1, 0 if slides else 1
        if stuck == 0:  # nothing holds the body along x: the friction force is what the law gives
            for i in range(k):
                sense[i] = turned
        size = touching + stuck + 1 + (1 if stuck > 0 else 0)
        row = 0
        for i in range(k):
            number[i] = -1
            if state[i] != OPEN:
                number[i] = row
                row += 1
        for i in range(k):
            number[k + i] = -1
            if state[i] == STICK:
                number[k + i] = row
                row += 1
        matrix = np.zeros((size, size))
        right = np.zeros(size)
        depth, travel = touching + stuck, touching + stuck + 1
        right[depth] = normal
        if stuck > 0:
            right[travel] = tangential
        for a in range(2 * k):
            r = number[a]
            if r < 0:
                continue
            right[r] = -gap[a] if a < k else anchor[a - k]
            for j in range(k):
                if state[j] == OPEN:
                    continue
                value = compliance[a, j]
                if state[j] == SLIP:
                    value += sense[j] * mu * compliance[a, k + j]
                elif state[j] == STICK:
                    matrix[r, number[k + j]] = compliance[a, k + j]
                else:
                    right[r] -= sense[j] * tau * length[j] * compliance[a, k + j]
                matrix[r, number[j]] = value
            if a < k:
                matrix[r, depth] = -1.0
                matrix[depth, r] = 1.0
            else:
                matrix[r, travel] = 1.0
                matrix[travel, r] = 1.0
        if stuck > 0:
            for j in range(k):
                if state[j] == SLIP:
                    matrix[travel, number[j]] = sense[j] * mu
                elif state[j] == SHEAR_LIMITED:
                    right[travel] -= sense[j] * tau * length[j]
        if not solve(matrix, right):
            return LOST
        answer = right
        push = 0.0
        for i in range(k):
            force[i] = answer[number[i]] if number[i] >= 0 else 0.0
            push = max(push, abs(force[i]))
            if state[i] == STICK:
                force[k + i] = answer[number[k + i]]
            elif state[i] == SLIP:
                force[k + i] = sense[i] * mu * force[i]
            elif state[i] == SHEAR_LIMITED:
                force[k + i] = sense[i] * tau * length[i]
            else:
                force[k + i] = 0.0
        for a in range(2 * k):
            total = 0.0
            for j in range(2 * k):
                total += compliance[a, j] * force[j]
            moved[a] = total
        motion[0] = answer[depth]
        if stuck > 0:
            motion[1] = answer[travel]
        # states that contradict the solution
        height = 0.0
        for i in range(k):
            height = max(height, abs(gap[i]), abs(moved[i]), abs(moved[k + i] + motion[1]))
        changed = 0
        one_by_one = round > 8
        worst, who, worst_state, worst_sense = 0.0, -1, 0, 0
        for i in range(k):
            now, along, bad = state[i], sense[i], 0.0
            if state[i] == OPEN:
                above = gap[i] + moved[i] - motion[0]
                if above < -SMALL * height:
                    now = SLIP if slides or mu == 0.0 or tau == 0.0 or came[i] % 2 == 1 else STICK
                    along = -1 if moved[k + i] + motion[1] > anchor[i] else 1
                    came[i] += 1
                    bad = -above * push / height
            elif force[i] < -SMALL * push:
                now = OPEN
                bad = -force[i]
            else:
                coulomb, bound = mu * max(force[i], 0.0), tau * length[i]
                slipped = moved[k + i] + motion[1] - anchor[i]
                if state[i] == STICK:
                    if abs(force[k + i]) > min(coulomb, bound) + SMALL * push:
                        along = 1 if force[k + i] > 0.0 else -1
                        now = SHEAR_LIMITED if coulomb > bound else SLIP
                        bad = abs(force[k + i]) - min(coulomb, bound)
                elif state[i] == SLIP and coulomb > bound + SMALL * push:
                    now, bad = SHEAR_LIMITED, force[i]
                elif state[i] == SHEAR_LIMITED and coulomb < bound - SMALL * push:
                    now, bad = SLIP, force[i]
                elif stuck > 0 and mu > 0.0 and tau > 0.0 and slipped * sense[i] > SMALL * height:
                    now, bad = STICK, slipped * sense[i] * push / height
            if now == state[i] and along == sense[i]:
                continue
            changed += 1
            if not one_by_one:
                state[i], sense[i] = now, along
            elif who < 0 or bad > worst:
                worst, who, worst_state, worst_sense = bad, i, now, along
        if changed == 0:
            return SLIDING if stuck == 0 else STICKING
        if one_by_one:
            state[who], sense[who] = worst_state, worst_sense
    return LOST
