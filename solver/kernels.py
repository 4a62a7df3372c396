# ruff: noqa: C901 - a compiled loop is flat: calls inside it would cost more than they explain
"""The compiled loops of the finite-strain solver, and the only module that is compiled (numba, cached on disk).

`solver.kernels_numpy` says the same in plain NumPy; the tests compare the two. Shapes: e elements of nine nodes, q = 9
quadrature points, n unknowns after the centre nodes are condensed, h half the bandwidth, k skin nodes that may touch.
Bands are stored row by row: entry (r, c) of the matrix is band[r, c - r + h]; four columns of zeros follow, so that
rows can be read four at a time.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Narrow = NDArray[np.int32]
Compiled = TypeVar("Compiled", bound=Callable[..., Any])

OPEN, STICK, SLIP, CAP = 0, 1, 2, 3
_FAST = {"contract", "reassoc", "arcp", "nsz"}  # nan and infinity keep their meaning


def compiled(function: Compiled) -> Compiled:
    """Return `function` compiled when first called, kept on disk; numba itself declares no types."""
    return numba.njit(cache=True, fastmath=_FAST)(function)  # pyright: ignore


@compiled
def assemble(
    u: Array,
    pressure: Array,
    grad_x: Array,
    grad_y: Array,
    weight: Array,
    modes: Array,
    shear: Array,
    stiffening: Array,
    lame: Array,
    nodes: Narrow,
    unknown: Narrow,
    band: Array,
    force: Array,
    fold: Array,
    dilate: Array,
    volume: Array,
) -> float:
    """Fill the tangent and the internal forces at displacements `u` (nodes, 2); return the least det F.

    `pressure` (e, 3) are the pressure modes that the tangent sees (the linearised prediction), while the forces follow
    from `u` alone. `grad_x`, `grad_y` (e, q, 9), `weight` (e, q), `modes` (e, q, 3, orthonormal over the element);
    `shear`, `stiffening`, `lame` (e,); `nodes` (e, 9), `unknown` (e, 8, 2), -1 where fixed.
    Filled: `band` (n, 2 h + 5), `force` (n,), `fold` (e, 2, 17) (centre = -(fold @ (outer unknowns, 1))),
    `dilate` (e, 3, 18) derivative of the modes of ln J, `volume` (e, 3) those modes.
    Where det F is not positive, the arrays are left half filled.
    """
    half = (band.shape[1] - 5) // 2
    band[:, :] = 0.0
    force[:] = 0.0
    least = np.inf
    xx, yy, xy = np.empty((9, 9)), np.empty((9, 9)), np.empty((9, 9))
    full, b = np.empty((18, 18)), np.empty((18, 3))
    hx, hy, sx, sy = np.empty(9), np.empty(9), np.empty(9), np.empty(9)
    fx, fy = np.empty(9), np.empty(9)
    ux, uy = np.empty(9), np.empty(9)
    for e in range(nodes.shape[0]):
        for i in range(9):
            ux[i], uy[i] = u[nodes[e, i], 0], u[nodes[e, i], 1]
        xx[:, :] = 0.0
        yy[:, :] = 0.0
        xy[:, :] = 0.0
        b[:, :] = 0.0
        fx[:] = 0.0
        fy[:] = 0.0
        v0 = v1 = v2 = 0.0
        for q in range(9):
            gx, gy = grad_x[e, q], grad_y[e, q]
            f00, f01, f10, f11 = 1.0, 0.0, 0.0, 1.0
            for i in range(9):
                f00 += ux[i] * gx[i]
                f01 += ux[i] * gy[i]
                f10 += uy[i] * gx[i]
                f11 += uy[i] * gy[i]
            j = f00 * f11 - f01 * f10
            least = min(least, j)
            if not j > 0.0:
                return least
            w = weight[e, q]
            m0, m1, m2 = modes[e, q, 0], modes[e, q, 1], modes[e, q, 2]
            log = np.log(j)
            v0 += w * m0 * log
            v1 += w * m1 * log
            v2 += w * m2 * log
            g = shear[e]
            if stiffening[e] > 0.0:
                excess = f00 * f00 + f01 * f01 + f10 * f10 + f11 * f11 - 2.0 - 2.0 * log
                g *= np.exp(stiffening[e] * excess)
            wg = w * g
            geometric = wg - w * (m0 * pressure[e, 0] + m1 * pressure[e, 1] + m2 * pressure[e, 2])
            a00, a01, a10, a11 = f11 / j, -f10 / j, -f01 / j, f00 / j  # inverse transposed
            for i in range(9):
                hx[i] = a00 * gx[i] + a01 * gy[i]
                hy[i] = a10 * gx[i] + a11 * gy[i]
                sx[i] = f00 * gx[i] + f01 * gy[i] - hx[i]
                sy[i] = f10 * gx[i] + f11 * gy[i] - hy[i]
                fx[i] += wg * sx[i]
                fy[i] += wg * sy[i]
                b[2 * i, 0] += w * m0 * hx[i]
                b[2 * i, 1] += w * m1 * hx[i]
                b[2 * i, 2] += w * m2 * hx[i]
                b[2 * i + 1, 0] += w * m0 * hy[i]
                b[2 * i + 1, 1] += w * m1 * hy[i]
                b[2 * i + 1, 2] += w * m2 * hy[i]
            for i in range(9):
                px, py = wg * gx[i], wg * gy[i]
                qx, qy = geometric * hx[i], geometric * hy[i]
                for k in range(9):
                    laplace = px * gx[k] + py * gy[k]
                    xx[i, k] += laplace + qx * hx[k]
                    yy[i, k] += laplace + qy * hy[k]
                    xy[i, k] += qy * hx[k]
            if stiffening[e] > 0.0:
                more = 2.0 * stiffening[e] * wg
                for i in range(9):
                    for k in range(9):
                        xx[i, k] += more * sx[i] * sx[k]
                        yy[i, k] += more * sy[i] * sy[k]
                        xy[i, k] += more * sx[i] * sy[k]
        lam = lame[e]
        volume[e, 0], volume[e, 1], volume[e, 2] = v0, v1, v2
        for i in range(18):
            b0, b1, b2 = b[i, 0], b[i, 1], b[i, 2]
            dilate[e, 0, i], dilate[e, 1, i], dilate[e, 2, i] = b0, b1, b2
            c0, c1, c2 = lam * b0, lam * b1, lam * b2
            for k in range(i + 1):
                full[i, k] = c0 * b[k, 0] + c1 * b[k, 1] + c2 * b[k, 2]
            push = c0 * v0 + c1 * v1 + c2 * v2
            if i % 2 == 0:
                fx[i // 2] += push
            else:
                fy[i // 2] += push
        for i in range(9):
            for k in range(i + 1):
                full[2 * i, 2 * k] += xx[i, k]
                full[2 * i + 1, 2 * k + 1] += yy[i, k]
                full[2 * i + 1, 2 * k] += xy[k, i]
                if k < i:
                    full[2 * i, 2 * k + 1] += xy[i, k]
        # the centre node meets no other element: rows 16 and 17 are eliminated
        det = full[16, 16] * full[17, 17] - full[17, 16] * full[17, 16]
        k00, k01, k11 = full[17, 17] / det, -full[17, 16] / det, full[16, 16] / det
        for i in range(16):
            fold[e, 0, i] = k00 * full[16, i] + k01 * full[17, i]
            fold[e, 1, i] = k01 * full[16, i] + k11 * full[17, i]
        fold[e, 0, 16] = k00 * fx[8] + k01 * fy[8]
        fold[e, 1, 16] = k01 * fx[8] + k11 * fy[8]
        for i in range(16):
            row = unknown[e, i // 2, i % 2]
            if row < 0:
                continue
            mine = fx[i // 2] if i % 2 == 0 else fy[i // 2]
            force[row] += mine - full[16, i] * fold[e, 0, 16] - full[17, i] * fold[e, 1, 16]
            for k in range(i + 1):
                column = unknown[e, k // 2, k % 2]
                if column < 0:
                    continue
                value = full[i, k] - full[16, i] * fold[e, 0, k] - full[17, i] * fold[e, 1, k]
                band[row, column - row + half] += value
                if k < i:
                    band[column, row - column + half] += value
    return least


@compiled
def advance(
    u: Array,
    pressure: Array,
    step: Array,
    scale: float,
    nodes: Narrow,
    unknown: Narrow,
    lame: Array,
    fold: Array,
    dilate: Array,
    volume: Array,
    u_new: Array,
    pressure_new: Array,
) -> float:
    """Fill `u_new`, `pressure_new` after `scale` times the `step` (n,) of the unknowns; return the largest move.

    The pressure is the linearised prediction at the end of the full step, approached by `scale`: the mixed
    integration points of Magisano, Leonetti and Garcea (2017), Int. J. Numer. Meth. Eng. 109, 1237.
    """
    largest = 0.0
    u_new[:, :] = u
    move = np.empty(18)
    for e in range(nodes.shape[0]):
        for i in range(16):
            row = unknown[e, i // 2, i % 2]
            move[i] = step[row] if row >= 0 else 0.0
        for a in range(2):
            centre = fold[e, a, 16]
            for i in range(16):
                centre += fold[e, a, i] * move[i]
            move[16 + a] = -centre
        for i in range(18):
            largest = max(largest, abs(move[i]))
            u_new[nodes[e, i // 2], i % 2] = u[nodes[e, i // 2], i % 2] + scale * move[i]
        for m in range(3):
            change = volume[e, m]
            for i in range(18):
                change += dilate[e, m, i] * move[i]
            pressure_new[e, m] = pressure[e, m] + scale * (lame[e] * change - pressure[e, m])
    return largest


@compiled
def tributary(x: Array, at: Narrow, out: Array) -> None:
    """Fill `out` (k,) with the length of skin each node stands for, `x` (k,) being positions along the surface.

    Simpson's rule on edges of three nodes; `at` (k,) is 0 at edge ends, 1 in the middle. The lengths are linear in x.
    """
    out[:] = 0.0
    for i in range(at.shape[0]):
        if at[i] == 1:
            a, m, b = x[i - 1], x[i], x[i + 1]
            out[i - 1] += (-1.5 * a + 2.0 * m - 0.5 * b) / 3.0
            out[i] += 2.0 * (b - a) / 3.0
            out[i + 1] += (0.5 * a - 2.0 * m + 1.5 * b) / 3.0


@compiled
def impose(
    band: Array,
    force: Array,
    skin: Narrow,
    at: Narrow,
    state: Narrow,
    sense: Narrow,
    mu: float,
    tau: float,
    above: Array,
    behind: Array,
    length: Array,
    rows: Array,
    right: Array,
) -> None:
    """Turn equilibrium rows of touching nodes into contact rows; fill the right-hand sides.

    `skin` (k, 2) unknowns, `above` (k,) heights over the surface, `behind` (k,) distances of stuck nodes from where
    they stick, `length` from `tributary`. Saved in `rows` (k, 2, 2 h + 5): the rows before. Filled in `right` (n, 4):
    the step to equilibrium, and its derivatives with respect to depth, mu and travel of the surface along +x.
    """
    half = (band.shape[1] - 5) // 2
    right[:, :] = 0.0
    right[:, 0] = -force
    for i in range(skin.shape[0]):
        rows[i, 0, :] = band[skin[i, 0]]
        rows[i, 1, :] = band[skin[i, 1]]
    for i in range(skin.shape[0]):
        if state[i] == OPEN:
            continue
        x, y = skin[i, 0], skin[i, 1]
        band[y, :] = 0.0
        band[y, half] = 1.0
        right[y, 0] = -above[i]
        right[y, 1] = 1.0
        if state[i] == STICK:
            band[x, :] = 0.0
            band[x, half] = 1.0
            right[x, 0] = -behind[i]
            right[x, 3] = 1.0
        elif state[i] == SLIP:
            drag = sense[i] * mu
            low, high = max(0, half - x), min(2 * half + 1, band.shape[0] + half - x)
            for c in range(low, high):  # the y row's entries, moved to the x row's place
                from_y = c + x - y
                if 0 <= from_y <= 2 * half:
                    band[x, c] -= drag * rows[i, 1, from_y]
            right[x, 0] = -(force[x] - drag * force[y])
            right[x, 2] = sense[i] * force[y]
        else:
            drag = sense[i] * tau
            right[x, 0] = -(force[x] - drag * length[i])
            for edge in range(max(i - 1, 0), min(i + 2, at.shape[0])):
                if at[edge] != 1:
                    continue
                if edge == i:
                    band[x, skin[i + 1, 0] - x + half] -= drag * 2.0 / 3.0
                    band[x, skin[i - 1, 0] - x + half] += drag * 2.0 / 3.0
                else:
                    side = 1.0 if edge == i + 1 else -1.0  # the edge lies ahead or behind
                    other = i + 2 if edge == i + 1 else i - 2
                    band[x, half] += drag * side * 0.5
                    band[x, skin[edge, 0] - x + half] -= drag * side * 2.0 / 3.0
                    band[x, skin[other, 0] - x + half] += drag * side * 0.5 / 3.0


@compiled
def reactions(force: Array, skin: Narrow, rows: Array, step: Array, out: Array) -> None:
    """Fill `out` (k, 2) with the surface's forces on the skin at the end of `step`, linearised."""
    half = (rows.shape[2] - 5) // 2
    size = force.shape[0]
    for i in range(skin.shape[0]):
        for a in range(2):
            row = skin[i, a]
            total = force[row]
            for c in range(max(0, half - row), min(2 * half + 1, size + half - row)):
                total += rows[i, a, c] * step[row + c - half]
            out[i, a] = total


@compiled
def factorise(band: Array, first: Narrow, last: Narrow) -> float:
    """Replace `band` by its factors L and U without pivoting, four rows at a time; return the least |pivot|.

    `first` (n,) is the first column of each row that is not zero, `last` (n,) the last row of each column; the
    pattern is symmetric. No fill comes outside it. Contact and friction rows sit in a matrix that is otherwise the
    tangent of a stable body, whose pivots stay away from zero; where one is zero, so is what is returned.
    """
    size, half = band.shape[0], (band.shape[1] - 5) // 2
    least = np.inf
    k = 0
    while k < size:
        block = min(4, size - k)
        end = k
        for p in range(k, k + block):
            end = max(end, last[p])
        end += 1
        for p in range(k, k + block):
            pivot = band[p, half]
            least = min(least, abs(pivot))
            if pivot == 0.0:
                return 0.0
            for r in range(p + 1, k + block):
                factor = band[r, p - r + half] / pivot
                band[r, p - r + half] = factor
                if factor != 0.0:
                    from_p, from_r = half - p, half - r
                    for c in range(p + 1, min(end, p + half + 1)):
                        band[r, c + from_r] -= factor * band[p, c + from_p]
        if block < 4:
            break
        i0, i1, i2, i3 = half - k, half - k - 1, half - k - 2, half - k - 3
        p0, p1, p2, p3 = band[k, half], band[k + 1, half], band[k + 2, half], band[k + 3, half]
        u01, u02, u03 = band[k, half + 1], band[k, half + 2], band[k, half + 3]
        u12, u13, u23 = band[k + 1, half + 1], band[k + 1, half + 2], band[k + 2, half + 1]
        row0, row1, row2, row3 = band[k], band[k + 1], band[k + 2], band[k + 3]
        width = end - k - 4
        for r in range(k + 4, end):
            if first[r] > k + 3:
                continue
            row = band[r]
            ir = half - r
            f0 = row[k + ir] / p0 if k + ir >= 0 else 0.0
            f1 = ((row[k + 1 + ir] if k + 1 + ir >= 0 else 0.0) - f0 * u01) / p1
            f2 = ((row[k + 2 + ir] if k + 2 + ir >= 0 else 0.0) - f0 * u02 - f1 * u12) / p2
            f3 = ((row[k + 3 + ir] if k + 3 + ir >= 0 else 0.0) - f0 * u03 - f1 * u13 - f2 * u23) / p3
            if k + ir >= 0:
                row[k + ir] = f0
            if k + 1 + ir >= 0:
                row[k + 1 + ir] = f1
            if k + 2 + ir >= 0:
                row[k + 2 + ir] = f2
            if k + 3 + ir >= 0:
                row[k + 3 + ir] = f3
            target = row[k + 4 + ir : k + 4 + ir + width]
            s0 = row0[k + 4 + i0 : k + 4 + i0 + width]
            s1 = row1[k + 4 + i1 : k + 4 + i1 + width]
            s2 = row2[k + 4 + i2 : k + 4 + i2 + width]
            s3 = row3[k + 4 + i3 : k + 4 + i3 + width]
            for c in range(width):
                target[c] -= f0 * s0[c] + f1 * s1[c] + f2 * s2[c] + f3 * s3[c]
        k += 4
    return least


@compiled
def substitute(band: Array, first: Narrow, last: Narrow, right: Array) -> None:
    """Solve in place for the right-hand sides `right` (n, c), `band` holding the factors."""
    size, half = band.shape[0], (band.shape[1] - 5) // 2
    count = right.shape[1]
    for r in range(size):
        row = band[r]
        for c in range(max(first[r], r - half), r):
            factor = row[c - r + half]
            for s in range(count):
                right[r, s] -= factor * right[c, s]
    for r in range(size - 1, -1, -1):
        row = band[r]
        for c in range(r + 1, min(size, last[r] + 1)):
            factor = row[c - r + half]
            for s in range(count):
                right[r, s] -= factor * right[c, s]
        for s in range(count):
            right[r, s] /= row[half]


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
    """Change `state` and `sense` (k,) in place where the solution contradicts them; return how many were changed.

    `reaction` (k, 2) forces on the skin, `above` (k,) heights over the surface, `slid` (k,) how far each node went
    along +x relative to the surface since the last step. With `direction` -1 or +1 every touching node slips, the
    friction force pointing there; with 0 nodes stick, slip and turn round.
    """
    changed = 0
    size = state.shape[0]
    force = reach = 0.0
    for i in range(size):
        force = max(force, abs(reaction[i, 1]))
        reach = max(reach, abs(above[i]))
    slack, small = 1e-12 * force, 1e-13 * reach
    for i in range(size):
        was, turned = state[i], sense[i]
        now = was
        if was == OPEN:
            if above[i] < -small:
                now = STICK if direction == 0 and mu > 0.0 and tau > 0.0 else SLIP
                turned = direction if direction != 0 else turned
        elif reaction[i, 1] < -slack:
            now = OPEN
        else:
            coulomb, bound = mu * max(reaction[i, 1], 0.0), tau * max(length[i], 0.0)
            most = min(coulomb, bound)
            if direction != 0:
                turned = direction
                now = CAP if bound < coulomb - slack or (was == CAP and bound <= coulomb + slack) else SLIP
            elif was == STICK:
                if abs(reaction[i, 0]) > most + slack:
                    turned = 1 if reaction[i, 0] > 0.0 else -1
                    now = CAP if bound < coulomb else SLIP
            elif slid[i] * sense[i] > small and most > 0.0:
                now = STICK
            else:
                now = CAP if bound < coulomb - slack or (was == CAP and bound <= coulomb + slack) else SLIP
        if now != was or (now >= SLIP and turned != sense[i]):
            changed += 1
        state[i], sense[i] = now, turned
    return changed


@compiled
def energies(
    u: Array,
    grad_x: Array,
    grad_y: Array,
    weight: Array,
    modes: Array,
    shear: Array,
    stiffening: Array,
    lame: Array,
    nodes: Narrow,
    at_element: Narrow,
    at_x: Array,
    at_y: Array,
    at_modes: Array,
    out: Array,
) -> None:
    """Fill `out` (p,) with the strain-energy density at probes; ln J is the element's best fit by its three modes.

    `at_element` (p,), `at_x`, `at_y` (p, 9) gradients of the shape functions there, `at_modes` (p, 3) the modes there.
    """
    seen = -1
    v0 = v1 = v2 = 0.0
    for p in range(at_element.shape[0]):
        e = at_element[p]
        if e != seen:
            v0 = v1 = v2 = 0.0
            for q in range(9):
                f00, f01, f10, f11 = 1.0, 0.0, 0.0, 1.0
                for i in range(9):
                    x, y = u[nodes[e, i], 0], u[nodes[e, i], 1]
                    f00 += x * grad_x[e, q, i]
                    f01 += x * grad_y[e, q, i]
                    f10 += y * grad_x[e, q, i]
                    f11 += y * grad_y[e, q, i]
                log = weight[e, q] * np.log(f00 * f11 - f01 * f10)
                v0 += log * modes[e, q, 0]
                v1 += log * modes[e, q, 1]
                v2 += log * modes[e, q, 2]
            seen = e
        f00, f01, f10, f11 = 1.0, 0.0, 0.0, 1.0
        for i in range(9):
            x, y = u[nodes[e, i], 0], u[nodes[e, i], 1]
            f00 += x * at_x[p, i]
            f01 += x * at_y[p, i]
            f10 += y * at_x[p, i]
            f11 += y * at_y[p, i]
        fit = at_modes[p, 0] * v0 + at_modes[p, 1] * v1 + at_modes[p, 2] * v2
        excess = f00 * f00 + f01 * f01 + f10 * f10 + f11 * f11 - 2.0 - 2.0 * np.log(f00 * f11 - f01 * f10)
        if stiffening[e] > 0.0:
            excess = np.expm1(stiffening[e] * excess) / stiffening[e]
        out[p] = 0.5 * shear[e] * excess + 0.5 * lame[e] * fit * fit
