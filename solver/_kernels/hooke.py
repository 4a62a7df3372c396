# ruff: noqa: C901 - a compiled loop is flat: calls inside it would cost more than they explain
"""A body at small strain: stiffness, elimination, displacements. e elements of nine nodes, q = 9 quadrature points."""

import numpy as np

from solver._kernels.arguments import (
    Factors,
    LinearElements,
    LinearMesh,
    RecoveryArrays,
    ShapeFunctions,
    SymbolicFactorization,
)
from solver._kernels.compiling import compiled
from solver._kernels.multifrontal import back_substitute_part
from solver.arrays import Array, Flags


@compiled
def stiffen(mesh: LinearMesh, shapes: ShapeFunctions, elastic: LinearElements, outer: Array) -> bool:
    """Fill the `elastic` elements and what is left of their stiffness for their outer nodes; False where one is folded.

    `outer` (e, 16, 16), lower half, is ordered x, y, x, y, ...
    """
    place, nodes, shear, lame = mesh
    values, along, up, weights = shapes
    stiffness, dilatation, centre, recovery_matrix = elastic
    # columns by direction, as in `solver._kernels.elements`: x of nine nodes, then y
    h, bent = np.empty((9, 18)), np.empty((9, 18))
    spot, modes = np.empty((9, 2)), np.empty((9, 3))
    d, by_x, by_y = np.empty((3, 18)), np.empty(18), np.empty(18)
    px, py = np.empty(9), np.empty(9)
    for e in range(nodes.shape[0]):
        for i in range(9):
            px[i], py[i] = place[nodes[e, i], 0], place[nodes[e, i], 1]
        xc = yc = 0.0
        m00 = m01 = m02 = m11 = m12 = m22 = 0.0
        for q in range(9):
            x = y = 0.0
            for i in range(9):
                x += values[q, i] * px[i]
                y += values[q, i] * py[i]
            spot[q, 0], spot[q, 1] = x, y
            xc += x / 9.0
            yc += y / 9.0
        for q in range(9):
            x_xi = x_eta = y_xi = y_eta = 0.0
            for i in range(9):
                x_xi += px[i] * along[q, i]
                x_eta += px[i] * up[q, i]
                y_xi += py[i] * along[q, i]
                y_eta += py[i] * up[q, i]
            det = x_xi * y_eta - x_eta * y_xi
            if not det > 0.0:
                return False
            a00, a01, a10, a11 = y_eta / det, -y_xi / det, -x_eta / det, x_xi / det
            w = det * weights[q]
            stiff = w * shear[e]
            for i in range(9):
                x, y = a00 * along[q, i] + a01 * up[q, i], a10 * along[q, i] + a11 * up[q, i]
                h[q, i], h[q, 9 + i] = x, y
                bent[q, i], bent[q, 9 + i] = stiff * x, stiff * y
            x, y = spot[q, 0] - xc, spot[q, 1] - yc
            modes[q, 0], modes[q, 1], modes[q, 2] = w, w * x, w * y
            m00 += w
            m01 += w * x
            m02 += w * y
            m11 += w * x * x
            m12 += w * x * y
            m22 += w * y * y
        # modes that are orthonormal over the element: L of the Cholesky factor of their mass, inverted
        l00 = np.sqrt(m00)
        l10, l20 = m01 / l00, m02 / l00
        l11 = np.sqrt(m11 - l10 * l10)
        l21 = (m12 - l20 * l10) / l11
        l22 = np.sqrt(m22 - l20 * l20 - l21 * l21)
        for c in range(18):
            d0 = d1 = d2 = 0.0
            for q in range(9):
                d0 += modes[q, 0] * h[q, c]
                d1 += modes[q, 1] * h[q, c]
                d2 += modes[q, 2] * h[q, c]
            d0 /= l00
            d1 = (d1 - l10 * d0) / l11
            d2 = (d2 - l20 * d0 - l21 * d1) / l22
            d[0, c], d[1, c], d[2, c] = d0, d1, d2
        for i in range(9):
            for a in range(2):
                c = 2 * i + a
                d0, d1, d2 = d[0, 9 * a + i], d[1, 9 * a + i], d[2, 9 * a + i]
                d2 /= l22
                d1 = (d1 - l21 * d2) / l11
                dilatation[e, 1, c], dilatation[e, 2, c] = d1, d2
                dilatation[e, 0, c] = (d0 - l10 * d1 - l20 * d2) / l00
        centre[e, 0], centre[e, 1] = xc, yc
        full = stiffness[e]
        lam = lame[e]
        for i in range(9):
            for c in range(18):
                x = y = 0.0
                for q in range(9):
                    x += bent[q, i] * h[q, c]
                    y += bent[q, 9 + i] * h[q, c]
                by_x[c], by_y[c] = x, y
            x0, x1, x2 = lam * d[0, i], lam * d[1, i], lam * d[2, i]
            y0, y1, y2 = lam * d[0, 9 + i], lam * d[1, 9 + i], lam * d[2, 9 + i]
            for c in range(9):
                even = by_x[c] + by_y[9 + c]
                full[2 * i, 2 * c] = even + by_x[c] + x0 * d[0, c] + x1 * d[1, c] + x2 * d[2, c]
                full[2 * i, 2 * c + 1] = by_y[c] + x0 * d[0, 9 + c] + x1 * d[1, 9 + c] + x2 * d[2, 9 + c]
                full[2 * i + 1, 2 * c] = by_x[9 + c] + y0 * d[0, c] + y1 * d[1, c] + y2 * d[2, c]
                full[2 * i + 1, 2 * c + 1] = even + by_y[9 + c] + y0 * d[0, 9 + c] + y1 * d[1, 9 + c] + y2 * d[2, 9 + c]
        # the centre node meets no other element: rows 16 and 17 are eliminated
        det = full[16, 16] * full[17, 17] - full[17, 16] * full[17, 16]
        k00, k01, k11 = full[17, 17] / det, -full[17, 16] / det, full[16, 16] / det
        for i in range(16):
            recovery_matrix[e, 0, i] = k00 * full[16, i] + k01 * full[17, i]
            recovery_matrix[e, 1, i] = k01 * full[16, i] + k11 * full[17, i]
        for i in range(16):
            c0, c1 = full[16, i], full[17, i]
            for k in range(i + 1):
                outer[e, i, k] = full[i, k] - c0 * recovery_matrix[e, 0, k] - c1 * recovery_matrix[e, 1, k]
    return True


@compiled
def displace(
    skin: Array,
    carried: Array,
    own: Array,
    asked: Flags,
    plan: SymbolicFactorization,
    factors: Factors,
    body: RecoveryArrays,
    out: Array,
) -> None:
    """Fill `out` (nodes, 2, c) with the displacements of a reduced body when those of its skin are `skin` (c, m).

    Added are those of the forces `carried` (n,), from `condense`, with the skin held, and `own` (e, 2) of the centres
    alone. Only nodes `asked` for (nodes,) are sure to be filled.
    """
    start, inner, children, unknown = plan.start, plan.inner, plan.children, plan.unknown
    nodes, recovery_matrix = body
    parts, size = start.shape[0], carried.shape[0]
    wanted, needed = np.zeros(size, np.bool_), np.zeros(parts, np.bool_)
    used = np.zeros(nodes.shape[0], np.bool_)
    for e in range(nodes.shape[0]):
        whole = asked[nodes[e, 8]]
        for i in range(16):
            if whole or asked[nodes[e, i // 2]]:
                used[e] = True
                if unknown[e, i] >= 0:
                    wanted[unknown[e, i]] = True
    for p in range(parts):
        for child in children[p]:
            needed[p] |= child >= 0 and needed[child]
        for i in range(start[p], start[p] + inner[p]):
            needed[p] |= wanted[i]
    inside, move = np.zeros(size), np.empty(16)
    for c in range(skin.shape[0]):
        for i in range(skin.shape[1]):
            inside[size - skin.shape[1] + i] = skin[c, i]
        for p in range(parts - 1, -1, -1):
            if not needed[p]:
                continue
            back_substitute_part(p, carried, factors, inside)
        for e in range(nodes.shape[0]):
            if not used[e]:
                continue
            for i in range(16):
                move[i] = inside[unknown[e, i]] if unknown[e, i] >= 0 else 0.0
                out[nodes[e, i // 2], i % 2, c] = move[i]
            if asked[nodes[e, 8]]:
                for a in range(2):
                    total = own[e, a]
                    for i in range(16):
                        total -= recovery_matrix[e, a, i] * move[i]
                    out[nodes[e, 8], a, c] = total


@compiled
def definite(factors: Factors) -> bool:
    """Return whether every pivot of an elimination is positive, as those of a stable body are."""
    start, inner, border, factor_at, values = (
        factors.start, factors.inner, factors.border, factors.factor_at, factors.values
    )  # fmt: skip
    for p in range(start.shape[0]):
        for i in range(inner[p]):
            if not values[factor_at[p] + i * (inner[p] + border[p] + 1)] > 0.0:
                return False
    return True
