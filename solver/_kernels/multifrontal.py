"""Elimination of a symmetric body down to its skin, part by part of a `SymbolicFactorization`.

n unknowns are numbered in the order of their elimination, the m of the skin last. A part's front is a symmetric matrix
of its inner unknowns (k, eliminated in it) and its border (b, passed on to its parent). The inner rows of its factor
U = D L^T are kept, (k, k + b) numbers each part, upper half; the border's rows (b, b) wait in `waiting` for the parent.
"""

import numpy as np

from solver._kernels.compiling import compile_loop
from solver.arrays import Array, Factors, Flags, Narrow, SymbolicFactorization

UNSOLVABLE, INDEFINITE, DEFINITE = 0, 1, 2  # what `eliminate` returns


@compile_loop
def eliminate(tangent: Array, plan: SymbolicFactorization, factors: Array, waiting: Array, skin: Array) -> int:
    """Fill `factors` and the skin's stiffness `skin` (m, m); return UNSOLVABLE where a pivot is zero, else the sign.

    That is DEFINITE where every pivot is positive, as those of a stable body are, else INDEFINITE.

    `tangent` (e, 16, 16), lower half, of the elements; `factors` and `waiting` are memory as large as `plan` says.
    There is no pivoting: with its skin held, the tissue inside is stable but for what its pressure adds on the way to
    an equilibrium.
    """
    inner, border, factor_at, wait_at = plan.inner, plan.border, plan.factor_at, plan.wait_at
    sign = DEFINITE
    for p in range(inner.shape[0]):
        k, b = inner[p], border[p]
        wide = k + b
        top = factors[factor_at[p] : factor_at[p] + k * wide].reshape(k, wide)
        rest = waiting[wait_at[p] : wait_at[p] + b * b].reshape(b, b)
        top[:, :] = 0.0
        rest[:, :] = 0.0
        for n in range(plan.leaf[p, 0], plan.leaf[p, 1]):
            _add_element(tangent[plan.order[n]], plan.at[n], top, rest)
        for child in plan.children[p]:
            if child >= 0:
                size, first = border[child], plan.border_at[child]
                below = waiting[wait_at[child] : wait_at[child] + size * size].reshape(size, size)
                _add_child(below, plan.place[first : first + size], plan.run[first : first + size], top, rest)
        if not _factorised(top, rest):
            return UNSOLVABLE
        for i in range(k):
            if not top[i, i] > 0.0:
                sign = INDEFINITE
    m = skin.shape[0]
    last = waiting[wait_at[-1] : wait_at[-1] + m * m].reshape(m, m)
    for i in range(m):
        for j in range(i, m):
            skin[i, j] = skin[j, i] = last[i, j]
    return sign


@compile_loop
def _add_element(own: Array, at: Narrow, top: Array, rest: Array) -> None:
    """Add an element's tangent `own` (16, 16), lower half, to a front in which its unknowns stand `at` (16,)."""
    k = top.shape[0]
    for i in range(16):
        for j in range(i + 1):
            low, high = min(at[i], at[j]), max(at[i], at[j])
            if 0 <= low < k:
                top[low, high] += own[i, j]
            elif low >= k:
                rest[low - k, high - k] += own[i, j]


@compile_loop
def _add_child(below: Array, where: Narrow, ends: Narrow, top: Array, rest: Array) -> None:
    """Add what a child passes on, `below` (b, b), to the front in which its border stands `where` (b,).

    Neighbours stay neighbours for long runs, of which `ends` (b,) are the ends.
    """
    k, size = top.shape[0], below.shape[0]
    for i in range(size):
        r = where[i]
        if r < k:
            target, offset = top[r], 0
        else:
            target, offset = rest[r - k], k
        j = i
        while j < size:
            first, count = where[j] - offset, ends[j] - j
            into, part = target[first : first + count], below[i, j : j + count]
            for c in range(count):
                into[c] += part[c]
            j += count


@compile_loop
def _factorised(top: Array, rest: Array) -> bool:
    """Replace the inner rows `top` (k, k + b) by their factor, and `rest` (b, b) by what it leaves; upper halves.

    Rows are finished two at a time, and those of `rest` updated four at a time, by four finished rows at a time: that
    keeps most numbers in registers and the nearest cache. What rows updated together hold before their diagonals is of
    no meaning.
    """
    k, b = top.shape[0], rest.shape[0]
    over = np.empty(k)  # one over the pivots
    for r in range(0, k - 1, 2):
        one, two = top[r, r:], top[r + 1, r:]
        _update_two(top, over, r, r, one, two)
        if one[0] == 0.0:
            return False
        over[r] = 1.0 / one[0]
        factor = one[1] * over[r]
        for c in range(1, one.shape[0]):
            two[c] -= factor * one[c]
        if two[1] == 0.0:
            return False
        over[r + 1] = 1.0 / two[1]
    if k % 2 == 1:
        _update_one(top, over, k - 1, k - 1, top[k - 1, k - 1 :])
        if top[k - 1, k - 1] == 0.0:
            return False
        over[k - 1] = 1.0 / top[k - 1, k - 1]
    for r in range(0, b - 3, 4):
        _update_four(top, over, k + r, rest[r, r:], rest[r + 1, r:], rest[r + 2, r:], rest[r + 3, r:])
    for r in range(b - b % 4, b):
        _update_one(top, over, k, k + r, rest[r, r:])
    return True


@compile_loop
def _update_two(top: Array, over: Array, count: int, r: int, one: Array, two: Array) -> None:
    """Take from rows r and r + 1 of a front, both given from column r on, what the first `count` rows hold of them."""
    size = one.shape[0]
    p = 0
    while p + 4 <= count:
        d0, d1, d2, d3 = over[p], over[p + 1], over[p + 2], over[p + 3]
        s0, s1, s2, s3 = top[p, r:], top[p + 1, r:], top[p + 2, r:], top[p + 3, r:]
        a0, a1, a2, a3 = s0[0] * d0, s1[0] * d1, s2[0] * d2, s3[0] * d3
        b0, b1, b2, b3 = s0[1] * d0, s1[1] * d1, s2[1] * d2, s3[1] * d3
        for c in range(size):
            x0, x1, x2, x3 = s0[c], s1[c], s2[c], s3[c]
            one[c] -= a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3
            two[c] -= b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3
        p += 4
    while p < count:
        s0 = top[p, r:]
        a0, b0 = s0[0] * over[p], s0[1] * over[p]
        for c in range(size):
            one[c] -= a0 * s0[c]
            two[c] -= b0 * s0[c]
        p += 1


@compile_loop
def _update_four(top: Array, over: Array, r: int, one: Array, two: Array, three: Array, four: Array) -> None:
    """Take from rows r to r + 3 of a front, all given from column r on, what the rows of `top` hold of them."""
    p, count = 0, top.shape[0]
    while p + 4 <= count:
        d0, d1, d2, d3 = over[p], over[p + 1], over[p + 2], over[p + 3]
        s0, s1, s2, s3 = top[p, r:], top[p + 1, r:], top[p + 2, r:], top[p + 3, r:]
        a0, a1, a2, a3 = s0[0] * d0, s1[0] * d1, s2[0] * d2, s3[0] * d3
        b0, b1, b2, b3 = s0[1] * d0, s1[1] * d1, s2[1] * d2, s3[1] * d3
        c0, c1, c2, c3 = s0[2] * d0, s1[2] * d1, s2[2] * d2, s3[2] * d3
        e0, e1, e2, e3 = s0[3] * d0, s1[3] * d1, s2[3] * d2, s3[3] * d3
        for c in range(one.shape[0]):
            x0, x1, x2, x3 = s0[c], s1[c], s2[c], s3[c]
            one[c] -= a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3
            two[c] -= b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3
            three[c] -= c0 * x0 + c1 * x1 + c2 * x2 + c3 * x3
            four[c] -= e0 * x0 + e1 * x1 + e2 * x2 + e3 * x3
        p += 4
    while p < count:
        s0 = top[p, r:]
        a0, b0, c0, e0 = s0[0] * over[p], s0[1] * over[p], s0[2] * over[p], s0[3] * over[p]
        for c in range(one.shape[0]):
            x0 = s0[c]
            one[c] -= a0 * x0
            two[c] -= b0 * x0
            three[c] -= c0 * x0
            four[c] -= e0 * x0
        p += 1


@compile_loop
def _update_one(top: Array, over: Array, count: int, r: int, one: Array) -> None:
    """Take from row r of a front, given from column r on, what the first `count` rows hold of it."""
    for p in range(count):
        s0 = top[p, r:]
        a0 = s0[0] * over[p]
        for c in range(one.shape[0]):
            one[c] -= a0 * s0[c]


@compile_loop
def condense(force: Array, factors: Factors) -> None:
    """Replace `force` (n,) by L^-1 force inside the body, and at its end by the force that the skin feels."""
    start, inner, border, border_at, numbers, factor_at, values, near = factors
    for p in range(start.shape[0]):
        k, b, first = inner[p], border[p], start[p]
        top = values[factor_at[p] : factor_at[p] + k * (k + b)].reshape(k, k + b)
        passed = near[:b]
        passed[:] = 0.0
        for i in range(k):
            row = top[i]
            part = force[first + i] / row[i]
            mine, across = force[first + i + 1 : first + k], row[i + 1 : k]
            for j in range(k - i - 1):
                mine[j] -= across[j] * part
            across = row[k:]
            for j in range(b):
                passed[j] += across[j] * part
        for j in range(b):
            force[numbers[border_at[p] + j]] -= passed[j]


@compile_loop
def back_substitute_part(p: int, carried: Array, factors: Factors, out: Array) -> None:
    """Fill the displacements of `out` (n,) which part `p` of the body eliminates; those of its border are there."""
    start, inner, border, border_at, numbers, factor_at, values, near = factors
    k, b, first = inner[p], border[p], start[p]
    wide = k + b
    top = values[factor_at[p] : factor_at[p] + k * wide].reshape(k, wide)
    beyond = numbers[border_at[p] : border_at[p] + b]
    for j in range(b):
        near[k + j] = out[beyond[j]]
    i = k
    while i >= 2:  # two rows at a time, which share what they ask for
        i -= 2
        one, two, known = top[i, i:], top[i + 1, i:], near[i:wide]
        x, y = carried[first + i], carried[first + i + 1]
        for j in range(2, wide - i):
            x += one[j] * known[j]
            y += two[j] * known[j]
        y = -y / two[1]
        near[i], near[i + 1] = -(x + one[1] * y) / one[0], y
    if i == 1:
        one, x = top[0], carried[first]
        for j in range(1, wide):
            x += one[j] * near[j]
        near[0] = -x / one[0]
    for i in range(k):
        out[first + i] = near[i]


@compile_loop
def back_substitute(carried: Array, skin: Array, needed: Flags, out: Array, factors: Factors) -> None:
    """Fill `out` (n,) with the displacements under -`carried` (n,), of `condense`, when the skin's are `skin` (m,).

    Parts of the body that are not `needed` (p,) are left out.
    """
    first = out.shape[0] - skin.shape[0]
    for i in range(skin.shape[0]):
        out[first + i] = skin[i]
    for p in range(needed.shape[0] - 1, -1, -1):
        if needed[p]:
            back_substitute_part(p, carried, factors, out)


@compile_loop
def displace(
    carried: Array,
    skin: Array,
    needed: Flags,
    nodes: Narrow,
    unknown: Narrow,
    recovery_matrix: Array,
    out: Array,
    factors: Factors,
) -> None:
    """Fill the displacements `out` (n, 2, c) of `nodes` (e, 9) by their `unknown` (e, 8, 2), for the skin's (c, m).

    Those of the centres follow from the others by `recovery_matrix` (e, 2, 16).
    """
    inside = np.zeros(carried.shape[0])
    for c in range(skin.shape[0]):
        back_substitute(carried, skin[c], needed, inside, factors)
        for e in range(nodes.shape[0]):
            x = y = 0.0
            for i in range(16):
                row = unknown[e, i // 2, i % 2]
                move = inside[row] if row >= 0 else 0.0
                out[nodes[e, i // 2], i % 2, c] = move
                x -= recovery_matrix[e, 0, i] * move
                y -= recovery_matrix[e, 1, i] * move
            out[nodes[e, 8], 0, c], out[nodes[e, 8], 1, c] = x, y
