"""Multifrontal elimination of a symmetric body down to its skin, part by part of a `SymbolicFactorization`.

The n unknowns are numbered in elimination order, the m of the skin last. A part's front is a symmetric matrix of its
inner unknowns (k, eliminated here) and its border (b, passed on to the parent). The inner rows of its factor U = D L^T
are stored: (k, k + b), upper half. The border's Schur complement (b, b) stays in `waiting` for the parent.
"""

import numpy as np

from solver._kernels import compile_loop, subroutine
from solver.arrays import Array, Factors, Flags, Narrow, SymbolicFactorization

UNSOLVABLE, INDEFINITE, DEFINITE = 0, 1, 2  # results of `eliminate`


@compile_loop
def eliminate(tangent: Array, plan: SymbolicFactorization, factors: Array, waiting: Array, skin: Array) -> int:
    """Fill `factors` and the skin's condensed stiffness `skin` (m, m); return the sign of the pivots.

    It is UNSOLVABLE where a pivot is zero, DEFINITE where all are positive, as in a stable body, else INDEFINITE.
    `tangent` (e, 16, 16) are the element tangents, lower half. `plan` gives the sizes of `factors` and `waiting`. There
    is no pivoting: while the skin is held, only the pressure of iterations before equilibrium can make the inside
    unstable.
    """
    inner, border, factor_at, wait_at = plan.inner, plan.border, plan.factor_at, plan.wait_at
    sign = DEFINITE
    for p in range(inner.shape[0]):
        k, b = inner[p], border[p]
        width = k + b
        top = factors[factor_at[p] : factor_at[p] + k * width].reshape(k, width)
        complement = waiting[wait_at[p] : wait_at[p] + b * b].reshape(b, b)
        top[:, :] = 0.0
        complement[:, :] = 0.0
        for n in range(plan.leaf[p, 0], plan.leaf[p, 1]):
            _add_element(tangent[plan.order[n]], plan.position[n], top, complement)
        for child in plan.children[p]:
            if child >= 0:
                size, first = border[child], plan.border_at[child]
                below = waiting[wait_at[child] : wait_at[child] + size * size].reshape(size, size)
                _add_child(below, plan.place[first : first + size], plan.run[first : first + size], top, complement)
        if not _factorise(top, complement):
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
def _add_element(element: Array, position: Narrow, top: Array, complement: Array) -> None:
    """Add the tangent of an `element` (16, 16), lower half, to a front where its unknowns have a `position` (16,)."""
    k = top.shape[0]
    for i in range(16):
        for j in range(i + 1):
            low, high = min(position[i], position[j]), max(position[i], position[j])
            if 0 <= low < k:
                top[low, high] += element[i, j]
            elif low >= k:
                complement[low - k, high - k] += element[i, j]


@compile_loop
def _add_child(below: Array, where: Narrow, ends: Narrow, top: Array, complement: Array) -> None:
    """Add a child's Schur complement `below` (b, b) to the front in which its border has positions `where` (b,).

    Positions are consecutive over long runs; `ends` (b,) are the ends of these runs.
    """
    k, size = top.shape[0], below.shape[0]
    for i in range(size):
        r = where[i]
        if r < k:
            target, offset = top[r], 0
        else:
            target, offset = complement[r - k], k
        j = i
        while j < size:
            first, count = where[j] - offset, ends[j] - j
            into, part = target[first : first + count], below[i, j : j + count]
            for c in range(count):
                into[c] += part[c]
            j += count


@compile_loop
def _factorise(top: Array, complement: Array) -> bool:
    """Factorise a front in place, upper halves only; return False where a pivot is zero.

    The inner rows `top` (k, k + b) become their factor, and `complement` (b, b) the Schur complement. Rows are updated
    and finished two at a time, by four finished rows at a time, which keeps most data in registers and the nearest
    cache. Of two rows updated together, the entry of the second before its diagonal has no meaning.
    """
    k, b = top.shape[0], complement.shape[0]
    over = np.empty(k)  # reciprocal pivots
    for r in range(0, k - 1, 2):
        upper, lower = top[r, r:], top[r + 1, r:]
        _update_two(top, over, r, r, upper, lower)
        if upper[0] == 0.0:
            return False
        over[r] = 1.0 / upper[0]
        factor = upper[1] * over[r]
        for c in range(1, upper.shape[0]):
            lower[c] -= factor * upper[c]
        if lower[1] == 0.0:
            return False
        over[r + 1] = 1.0 / lower[1]
    if k % 2 == 1:
        _update_one(top, over, k - 1, k - 1, top[k - 1, k - 1 :])
        if top[k - 1, k - 1] == 0.0:
            return False
        over[k - 1] = 1.0 / top[k - 1, k - 1]
    for r in range(0, b - 1, 2):
        _update_two(top, over, k, k + r, complement[r, r:], complement[r + 1, r:])
    if b % 2 == 1:
        _update_one(top, over, k, k + b - 1, complement[b - 1, b - 1 :])
    return True


@subroutine
def _update_two(top: Array, over: Array, count: int, r: int, upper: Array, lower: Array) -> None:
    """Subtract the contributions of the first `count` rows from rows r and r + 1 of a front, given from column r on."""
    size = upper.shape[0]
    p = 0
    while p + 4 <= count:
        d0, d1, d2, d3 = over[p], over[p + 1], over[p + 2], over[p + 3]
        s0, s1, s2, s3 = top[p, r:], top[p + 1, r:], top[p + 2, r:], top[p + 3, r:]
        a0, a1, a2, a3 = s0[0] * d0, s1[0] * d1, s2[0] * d2, s3[0] * d3
        b0, b1, b2, b3 = s0[1] * d0, s1[1] * d1, s2[1] * d2, s3[1] * d3
        for c in range(size):
            x0, x1, x2, x3 = s0[c], s1[c], s2[c], s3[c]
            upper[c] -= a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3
            lower[c] -= b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3
        p += 4
    while p < count:
        s0 = top[p, r:]
        a0, b0 = s0[0] * over[p], s0[1] * over[p]
        for c in range(size):
            upper[c] -= a0 * s0[c]
            lower[c] -= b0 * s0[c]
        p += 1


@subroutine
def _update_one(top: Array, over: Array, count: int, r: int, row: Array) -> None:
    """Subtract the contributions of the first `count` rows from row r of a front, given from column r on."""
    for p in range(count):
        s0 = top[p, r:]
        a0 = s0[0] * over[p]
        for c in range(row.shape[0]):
            row[c] -= a0 * s0[c]


@compile_loop
def condense(force: Array, factors: Factors) -> None:
    """Replace `force` (n,) by L^-1 force inside the body and, at its end, by the force condensed to the skin."""
    start, inner, border, border_at, numbers, factor_at, values, near = factors
    for p in range(start.shape[0]):
        k, b, first = inner[p], border[p], start[p]
        top = values[factor_at[p] : factor_at[p] + k * (k + b)].reshape(k, k + b)
        border_force = near[:b]
        border_force[:] = 0.0
        for i in range(k):
            row = top[i]
            part = force[first + i] / row[i]
            target, across = force[first + i + 1 : first + k], row[i + 1 : k]
            for j in range(k - i - 1):
                target[j] -= across[j] * part
            across = row[k:]
            for j in range(b):
                border_force[j] += across[j] * part
        for j in range(b):
            force[numbers[border_at[p] + j]] -= border_force[j]


@subroutine
def back_substitute_part(p: int, condensed_force: Array, factors: Factors, out: Array) -> None:
    """Fill `out` (n,) with the displacements that part `p` of the body eliminates, from those of its border."""
    start, inner, border, border_at, numbers, factor_at, values, near = factors
    k, b, first = inner[p], border[p], start[p]
    width = k + b
    top = values[factor_at[p] : factor_at[p] + k * width].reshape(k, width)
    beyond = numbers[border_at[p] : border_at[p] + b]
    for j in range(b):
        near[k + j] = out[beyond[j]]
    i = k
    while i >= 2:  # two rows at a time share the reads of `solution`
        i -= 2
        upper, lower, solution = top[i, i:], top[i + 1, i:], near[i:width]
        x, y = condensed_force[first + i], condensed_force[first + i + 1]
        for j in range(2, width - i):
            x += upper[j] * solution[j]
            y += lower[j] * solution[j]
        y = -y / lower[1]
        near[i], near[i + 1] = -(x + upper[1] * y) / upper[0], y
    if i == 1:
        upper, x = top[0], condensed_force[first]
        for j in range(1, width):
            x += upper[j] * near[j]
        near[0] = -x / upper[0]
    for i in range(k):
        out[first + i] = near[i]


@compile_loop
def back_substitute(condensed_force: Array, skin: Array, parts: Flags, out: Array, factors: Factors) -> None:
    """Fill `out` (n,) with all displacements for the skin's, `skin` (m,), under the loads of -`condensed_force` (n,).

    `condensed_force` is the result of `condense`. Only the `parts` (p,) of the body that are true are solved.
    """
    first = out.shape[0] - skin.shape[0]
    for i in range(skin.shape[0]):
        out[first + i] = skin[i]
    for p in range(parts.shape[0] - 1, -1, -1):
        if parts[p]:
            back_substitute_part(p, condensed_force, factors, out)


@compile_loop
def displace(
    condensed_force: Array,
    skin: Array,
    parts: Flags,
    nodes: Narrow,
    unknown: Narrow,
    recovery_matrix: Array,
    out: Array,
    factors: Factors,
) -> None:
    """Fill `out` (n, 2, c) with the displacements of `nodes` (e, 9) for the skin's (c, m).

    `unknown` (e, 8, 2) are the unknowns of the outer nodes, -1 where fixed. The displacement of a centre follows from
    those of its outer nodes by `recovery_matrix` (e, 2, 16).
    """
    inside = np.zeros(condensed_force.shape[0])
    for c in range(skin.shape[0]):
        back_substitute(condensed_force, skin[c], parts, inside, factors)
        for e in range(nodes.shape[0]):
            x = y = 0.0
            for i in range(16):
                row = unknown[e, i // 2, i % 2]
                move = inside[row] if row >= 0 else 0.0
                out[nodes[e, i // 2], i % 2, c] = move
                x -= recovery_matrix[e, 0, i] * move
                y -= recovery_matrix[e, 1, i] * move
            out[nodes[e, 8], 0, c], out[nodes[e, 8], 1, c] = x, y
