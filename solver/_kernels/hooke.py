"""A body at small strain: stiffness, elimination, displacements. e elements of nine nodes, q = 9 quadrature points."""

import numpy as np

from solver._kernels.compiling import compiled
from solver._kernels.elements import displacement_gradient, gather
from solver._kernels.multifrontal import back_substitute_part
from solver.arrays import (
    Array,
    Factors,
    Flags,
    Indices,
    LinearElements,
    LinearMesh,
    LinearWork,
    Narrow,
    RecoveryArrays,
    ShapeFunctions,
    SymbolicFactorization,
)


@compiled
def stiffen(mesh: LinearMesh, shapes: ShapeFunctions, elastic: LinearElements, outer: Array) -> bool:
    """Fill the `elastic` elements and what is left of their stiffness for their outer nodes; False where one is folded.

    `outer` (e, 16, 16), lower half, is ordered x, y, x, y, ...
    """
    work = LinearWork(
        np.empty((9, 18)), np.empty((9, 18)), np.empty((9, 3)), np.empty((3, 18)), np.empty((3, 3))
    )  # fmt: skip
    px, py = np.empty(9), np.empty(9)
    for e in range(mesh.nodes.shape[0]):
        gather(mesh.place, mesh.nodes, e, px, py)
        if not integrate(px, py, mesh.shear[e], shapes, work, elastic.centre[e]):
            return False
        orthonormalise(work, elastic.dilatation[e])
        write_stiffness(mesh.lame[e], work, elastic.stiffness[e])
        eliminate_centre(elastic.stiffness[e], elastic.recovery_matrix[e], outer[e])
    return True


@compiled
def integrate(px: Array, py: Array, shear: float, shapes: ShapeFunctions, work: LinearWork, centre: Array) -> bool:
    """Fill gradients, modes and the root of their mass, of an element with nodes at `px`, `py` (9,); False if folded.

    `centre` (2,) is filled with the mean of the quadrature points, from which x and y are counted.
    """
    values, along, up, weights = shapes
    h, bent, modes, root = work.h, work.bent, work.modes, work.root
    centre[0] = centre[1] = 0.0
    for q in range(9):
        for i in range(9):
            centre[0] += values[q, i] * px[i] / 9.0
            centre[1] += values[q, i] * py[i] / 9.0
    m00 = m01 = m02 = m11 = m12 = m22 = 0.0
    for q in range(9):
        x_xi, x_eta, y_xi, y_eta = displacement_gradient(px, py, along[q], up[q])
        det = x_xi * y_eta - x_eta * y_xi
        if not det > 0.0:
            return False
        a00, a01, a10, a11 = y_eta / det, -y_xi / det, -x_eta / det, x_xi / det
        w = det * weights[q]
        x, y = -centre[0], -centre[1]
        for i in range(9):
            x += values[q, i] * px[i]
            y += values[q, i] * py[i]
            h[q, i], h[q, 9 + i] = a00 * along[q, i] + a01 * up[q, i], a10 * along[q, i] + a11 * up[q, i]
            bent[q, i], bent[q, 9 + i] = w * shear * h[q, i], w * shear * h[q, 9 + i]
        modes[q, 0], modes[q, 1], modes[q, 2] = w, w * x, w * y
        m00 += w
        m01 += w * x
        m02 += w * y
        m11 += w * x * x
        m12 += w * x * y
        m22 += w * y * y
    root[0, 0] = np.sqrt(m00)
    root[1, 0], root[2, 0] = m01 / root[0, 0], m02 / root[0, 0]
    root[1, 1] = np.sqrt(m11 - root[1, 0] * root[1, 0])
    root[2, 1] = (m12 - root[2, 0] * root[1, 0]) / root[1, 1]
    root[2, 2] = np.sqrt(m22 - root[2, 0] * root[2, 0] - root[2, 1] * root[2, 1])
    return True


@compiled
def orthonormalise(work: LinearWork, dilatation: Array) -> None:
    """Fill the volume strain by orthonormal modes, and `dilatation` (3, 18) by 1, x - xc, y - yc."""
    h, modes, d, root = work.h, work.modes, work.d, work.root
    l00, l10, l11, l20, l21, l22 = root[0, 0], root[1, 0], root[1, 1], root[2, 0], root[2, 1], root[2, 2]
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
        d2 /= l22
        d1 = (d1 - l21 * d2) / l11
        to = 2 * (c % 9) + c // 9
        dilatation[1, to], dilatation[2, to] = d1, d2
        dilatation[0, to] = (d0 - l10 * d1 - l20 * d2) / l00


@compiled
def write_stiffness(lam: float, work: LinearWork, full: Array) -> None:
    """Fill an element's stiffness `full` (18, 18)."""
    h, bent, d = work.h, work.bent, work.d
    by_x, by_y = np.empty(18), np.empty(18)
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


@compiled
def eliminate_centre(full: Array, recovery_matrix: Array, outer: Array) -> None:
    """Eliminate rows 16 and 17 of a stiffness `full` (18, 18): the centre node meets no other element."""
    det = full[16, 16] * full[17, 17] - full[17, 16] * full[17, 16]
    k00, k01, k11 = full[17, 17] / det, -full[17, 16] / det, full[16, 16] / det
    for i in range(16):
        recovery_matrix[0, i] = k00 * full[16, i] + k01 * full[17, i]
        recovery_matrix[1, i] = k01 * full[16, i] + k11 * full[17, i]
    for i in range(16):
        c0, c1 = full[16, i], full[17, i]
        for k in range(i + 1):
            outer[i, k] = full[i, k] - c0 * recovery_matrix[0, k] - c1 * recovery_matrix[1, k]


@compiled
def displace(
    skin: Array,
    carried: Array,
    own: Array,
    wanted_nodes: Flags,
    plan: SymbolicFactorization,
    factors: Factors,
    body: RecoveryArrays,
    out: Array,
) -> None:
    """Fill `out` (nodes, 2, c) with the displacements of a reduced body when those of its skin are `skin` (c, m).

    Added are those of the forces `carried` (n,), from `condense`, with the skin held, and `own` (e, 2) of the centres
    alone. Only `wanted_nodes` (nodes,) are sure to be filled.
    """
    nodes, recovery_matrix = body
    size = carried.shape[0]
    used, needed = np.zeros(nodes.shape[0], np.bool_), np.zeros(plan.start.shape[0], np.bool_)
    need(wanted_nodes, nodes, plan, size, used, needed)
    inside = np.zeros(size)
    for c in range(skin.shape[0]):
        for i in range(skin.shape[1]):
            inside[size - skin.shape[1] + i] = skin[c, i]
        for p in range(needed.shape[0] - 1, -1, -1):
            if needed[p]:
                back_substitute_part(p, carried, factors, inside)
        for e in range(nodes.shape[0]):
            if used[e]:
                place(e, plan.unknown[e], inside, nodes, recovery_matrix, own, out[:, :, c])


@compiled
def place(
    e: int, unknown: Narrow, inside: Array, nodes: Indices, recovery_matrix: Array, own: Array, out: Array
) -> None:
    """Fill the displacements `out` (nodes, 2) of an element's nodes from those of its unknowns (16,)."""
    centre = nodes[e, 8]
    out[centre, 0], out[centre, 1] = own[e, 0], own[e, 1]
    for i in range(16):
        move = inside[unknown[i]] if unknown[i] >= 0 else 0.0
        out[nodes[e, i // 2], i % 2] = move
        out[centre, 0] -= recovery_matrix[e, 0, i] * move
        out[centre, 1] -= recovery_matrix[e, 1, i] * move


@compiled
def need(
    wanted_nodes: Flags, nodes: Indices, plan: SymbolicFactorization, size: int, used: Flags, needed: Flags
) -> None:
    """Mark the elements (e,) `used` and the parts (p,) `needed` for the displacements of `wanted_nodes` (nodes,)."""
    wanted = np.zeros(size, np.bool_)
    for e in range(nodes.shape[0]):
        whole = wanted_nodes[nodes[e, 8]]
        for i in range(16):
            if whole or wanted_nodes[nodes[e, i // 2]]:
                used[e] = True
                if plan.unknown[e, i] >= 0:
                    wanted[plan.unknown[e, i]] = True
    for p in range(needed.shape[0]):
        for child in plan.children[p]:
            needed[p] |= child >= 0 and needed[child]
        for i in range(plan.start[p], plan.start[p] + plan.inner[p]):
            needed[p] |= wanted[i]


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
