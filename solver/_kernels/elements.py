"""Elements: forces, tangents and energies of all of them. e elements of nine nodes, q = 9 quadrature points."""

import numpy as np

from solver._kernels.compiling import compiled
from solver.arrays import Array, BodyState, ElementArrays, ElementSystem, ElementWork, Indices, Narrow, ProbeArrays

PLAIN = 2.0  # exponent of tissue that does not stiffen


@compiled
def stiffened(exponent: float, excess: float) -> tuple[float, float]:
    """Return by how much the shear modulus has grown, and how fast it grows: `hyperelastic.slopes`."""
    if excess > 0.04:
        s = np.arcsinh(0.5 * np.sqrt(excess))
        two = np.sinh(2.0 * s)
        grown = 2.0 / exponent * np.sinh(exponent * s) / two
        return grown, (np.cosh(exponent * s) - grown * np.cosh(2.0 * s)) / (2.0 * two * two)
    x, grown, growth, term = -excess / 4.0, 1.0, 0.0, 1.0
    for n in range(14):
        factor = (1.0 + exponent / 2.0 + n) * (1.0 - exponent / 2.0 + n) / ((1.5 + n) * (n + 1.0))
        growth -= (n + 1.0) / 4.0 * factor * term
        term *= factor * x
        grown += term
    return grown, growth


@compiled
def displacement_gradient(ux: Array, uy: Array, gx: Array, gy: Array) -> tuple[float, float, float, float]:
    """Return du/dX at a point, xx, xy, yx, yy, of nodal displacements `ux`, `uy` (9,) and gradients `gx`, `gy` (9,)."""
    xx, xy, yx, yy = 0.0, 0.0, 0.0, 0.0
    for i in range(9):
        xx += ux[i] * gx[i]
        xy += ux[i] * gy[i]
        yx += uy[i] * gx[i]
        yy += uy[i] * gy[i]
    return xx, xy, yx, yy


@compiled
def volume_growth(xx: float, xy: float, yx: float, yy: float) -> float:
    """Return det F - 1 of a displacement gradient, to its own digits: stiff tissue multiplies them."""
    return xx + yy + xx * yy - xy * yx


@compiled
def excess_of(xx: float, xy: float, yx: float, yy: float, log: float) -> float:
    """Return F:F - 2 - 2 ln J of a displacement gradient and `log` J, to its own digits."""
    return 2.0 * (xx + yy - log) + xx * xx + xy * xy + yx * yx + yy * yy


@compiled
def gather(u: Array, nodes: Narrow | Indices, e: int, ux: Array, uy: Array) -> None:
    """Fill `ux`, `uy` (9,) with the displacements of the nodes of an element."""
    for i in range(9):
        ux[i], uy[i] = u[nodes[e, i], 0], u[nodes[e, i], 1]


@compiled
def assemble(u: Array, pressure: Array, elements: ElementArrays, system: ElementSystem) -> float:
    """Fill the elements' `system` at displacements `u` (nodes, 2); return the least det F.

    `pressure` (e, 3) are the pressure modes that the tangent sees (the linearised prediction), while the forces follow
    from `u` alone. Where det F is not positive, the system is left half filled.
    """
    system.force[:] = 0.0
    least = np.inf
    ux, uy = np.empty(9), np.empty(9)
    work = ElementWork(
        np.empty((9, 18)), np.empty((9, 18)), np.empty((9, 3)), np.empty(9), np.empty(9), np.empty(9),
        np.empty((3, 18)), np.empty(18), np.empty((9, 16)), np.empty((9, 16)), np.empty((9, 9)), np.empty((18, 5)),
        np.empty((5, 16)), np.empty((16, 16)),
    )  # fmt: skip
    for e in range(elements.nodes.shape[0]):
        gather(u, elements.nodes, e, ux, uy)
        least = min(least, strain_points(e, ux, uy, pressure, elements, work, system.volume))
        if not least > 0.0:
            return least
        stiffens = elements.stiffening[e] != PLAIN
        sum_points(e, elements.lame[e], work, system)
        even = elements.laplace[e]
        if stiffens:
            even = work.laplace
            sum_laplace(e, elements, work)
        sum_geometric(work)
        eliminate_centre(e, even, stiffens, work, system)
        write_tangent(e, even, stiffens, work, system)
        add_forces(e, elements.unknown, work, system)
    return least


@compiled
def strain_points(
    e: int, ux: Array, uy: Array, pressure: Array, elements: ElementArrays, work: ElementWork, volume: Array
) -> float:
    """Fill what sums over an element's quadrature points are made of, and `volume`; return its least det F."""
    h, s, wide, push, more, bend = work.h, work.s, work.wide, work.push, work.more, work.bend
    v0 = v1 = v2 = 0.0
    p0, p1, p2 = pressure[e, 0], pressure[e, 1], pressure[e, 2]
    exponent, shear = elements.stiffening[e], elements.shear[e]
    least = np.inf
    for q in range(9):
        gx, gy = elements.grad_x[e, q], elements.grad_y[e, q]
        h00, f01, f10, h11 = displacement_gradient(ux, uy, gx, gy)
        grown = volume_growth(h00, f01, f10, h11)
        f00, f11, j = 1.0 + h00, 1.0 + h11, 1.0 + grown
        least = min(least, j)
        if not j > 0.0:
            break
        w = elements.weight[e, q]
        w0, w1, w2 = w * elements.modes[e, q, 0], w * elements.modes[e, q, 1], w * elements.modes[e, q, 2]
        wide[q, 0], wide[q, 1], wide[q, 2] = w0, w1, w2
        log = np.log1p(grown)
        v0 += w0 * log
        v1 += w1 * log
        v2 += w2 * log
        wg = w * shear
        if exponent != PLAIN:
            factor, growth = stiffened(exponent, excess_of(h00, f01, f10, h11, log))
            more[q] = 2.0 * growth * wg
            wg *= factor
        push[q] = wg
        bend[q] = wg - (w0 * p0 + w1 * p1 + w2 * p2)
        over = 1.0 / j
        a00, a01, a10, a11 = f11 * over, -f10 * over, -f01 * over, f00 * over  # inverse transposed
        b00, b11 = (h00 - h11 + grown * f00) * over, (h11 - h00 + grown * f11) * over  # F less it, as exactly
        b01, b10 = f01 - a01, f10 - a10
        for i in range(8):
            h[q, i], h[q, 8 + i] = a00 * gx[i] + a01 * gy[i], a10 * gx[i] + a11 * gy[i]
            s[q, i], s[q, 8 + i] = b00 * gx[i] + b01 * gy[i], b10 * gx[i] + b11 * gy[i]
        h[q, 16], h[q, 17] = a00 * gx[8] + a01 * gy[8], a10 * gx[8] + a11 * gy[8]
        s[q, 16], s[q, 17] = b00 * gx[8] + b01 * gy[8], b10 * gx[8] + b11 * gy[8]
    volume[e, 0], volume[e, 1], volume[e, 2] = v0, v1, v2
    return least


@compiled
def sum_points(e: int, lam: float, work: ElementWork, system: ElementSystem) -> None:
    """Fill the derivatives of an element's volume modes, its forces, and what its pressure makes of the tangent."""
    h, s, wide, push, d, f = work.h, work.s, work.wide, work.push, work.d, work.f
    left, right, dilate = work.left, work.right, system.dilate
    v0, v1, v2 = system.volume[e, 0], system.volume[e, 1], system.volume[e, 2]
    for c in range(18):
        d0 = d1 = d2 = total = 0.0
        for q in range(9):
            d0 += wide[q, 0] * h[q, c]
            d1 += wide[q, 1] * h[q, c]
            d2 += wide[q, 2] * h[q, c]
            total += push[q] * s[q, c]
        d[0, c], d[1, c], d[2, c] = d0, d1, d2
        f[c] = total + lam * (d0 * v0 + d1 * v1 + d2 * v2)
    for m in range(3):
        for c in range(8):
            dilate[e, m, 2 * c], dilate[e, m, 2 * c + 1] = d[m, c], d[m, 8 + c]
        dilate[e, m, 16], dilate[e, m, 17] = d[m, 16], d[m, 17]
        for c in range(16):
            right[m, c] = d[m, c]
        for c in range(18):
            left[c, m] = lam * d[m, c]


@compiled
def sum_laplace(e: int, elements: ElementArrays, work: ElementWork) -> None:
    """Fill the integrals of the shear modulus, as it has grown, times grad N_i . grad N_j."""
    grad_x, grad_y, push, out = elements.grad_x, elements.grad_y, work.push, work.laplace
    for i in range(9):
        out[i] = 0.0
        for q in range(9):
            x, y = push[q] * grad_x[e, q, i], push[q] * grad_y[e, q, i]
            for c in range(9):
                out[i, c] += x * grad_x[e, q, c] + y * grad_y[e, q, c]


@compiled
def sum_geometric(work: ElementWork) -> None:
    """Fill the products of deformed gradients: each node's x, then its y, by all of the outer nodes.

    Rows of the one go with columns of the other.
    """
    h, bend, by_x, by_y = work.h, work.bend, work.by_x, work.by_y
    for i in range(9):
        a, b = i + 8 * (i == 8), i + 8 + (i == 8)
        for c in range(16):
            x = y = 0.0
            for q in range(9):
                x += bend[q] * h[q, a] * h[q, c]
                y += bend[q] * h[q, b] * h[q, c]
            by_x[i, c], by_y[i, c] = x, y


@compiled
def eliminate_centre(e: int, even: Array, stiffens: bool, work: ElementWork, system: ElementSystem) -> None:
    """Fill what eliminates an element's centre, which meets no other element: in the `system`, `left` and `right`."""
    h, s, more, bend, d = work.h, work.s, work.more, work.bend, work.d
    by_x, by_y, left, right = work.by_x, work.by_y, work.left, work.right
    xx, yy, xy = even[8, 8], even[8, 8], 0.0
    for q in range(9):
        x, y = bend[q] * h[q, 16], bend[q] * h[q, 17]
        xx += x * h[q, 16]
        xy += x * h[q, 17]
        yy += y * h[q, 17]
    for m in range(3):
        xx += left[16, m] * d[m, 16]
        xy += left[16, m] * d[m, 17]
        yy += left[17, m] * d[m, 17]
    if stiffens:
        for q in range(9):
            xx += more[q] * s[q, 16] * s[q, 16]
            xy += more[q] * s[q, 16] * s[q, 17]
            yy += more[q] * s[q, 17] * s[q, 17]
    det = xx * yy - xy * xy
    k00, k01, k11 = yy / det, -xy / det, xx / det
    system.condensed_inverse[e, 0], system.condensed_inverse[e, 1], system.condensed_inverse[e, 2] = k00, k01, k11
    for c in range(16):
        i = c % 8
        if c < 8:
            x, y = by_x[8, i] + even[8, i], by_x[8, 8 + i]
        else:
            x, y = by_y[8, i], by_y[8, 8 + i] + even[8, i]
        for m in range(3):
            x += left[16, m] * d[m, c]
            y += left[17, m] * d[m, c]
        if stiffens:
            for q in range(9):
                x += more[q] * s[q, 16] * s[q, c]
                y += more[q] * s[q, 17] * s[q, c]
        left[c, 3], left[c, 4] = -x, -y
        right[3, c], right[4, c] = k00 * x + k01 * y, k01 * x + k11 * y


@compiled
def write_tangent(e: int, even: Array, stiffens: bool, work: ElementWork, system: ElementSystem) -> None:
    """Fill an element's tangent, lower half, its centre eliminated."""
    s, more, left, right, own = work.s, work.more, work.left, work.right, work.own
    by_x, by_y, tangent = work.by_x, work.by_y, system.tangent
    for i in range(16):
        for c in range(16):
            total = 0.0
            for m in range(5):
                total += left[i, m] * right[m, c]
            own[i, c] = total
    if stiffens:
        for i in range(16):
            for q in range(9):
                x = more[q] * s[q, i]
                for c in range(16):
                    own[i, c] += x * s[q, c]
    for i in range(8):
        for c in range(i + 1):
            tangent[e, 2 * i, 2 * c] = own[i, c] + by_x[i, c] + even[i, c]
            tangent[e, 2 * i, 2 * c + 1] = own[i, 8 + c] + by_y[i, c]
            tangent[e, 2 * i + 1, 2 * c] = own[8 + i, c] + by_x[i, 8 + c]
            tangent[e, 2 * i + 1, 2 * c + 1] = own[8 + i, 8 + c] + by_y[i, 8 + c] + even[i, c]


@compiled
def add_forces(e: int, unknown: Narrow, work: ElementWork, system: ElementSystem) -> None:
    """Add an element's forces, its centre eliminated, and fill what recovers the centre."""
    f, right, force, recovery_matrix = work.f, work.right, system.force, system.recovery_matrix
    for m in range(2):
        for c in range(8):
            recovery_matrix[e, m, 2 * c], recovery_matrix[e, m, 2 * c + 1] = right[3 + m, c], right[3 + m, 8 + c]
        k0, k1 = system.condensed_inverse[e, m], system.condensed_inverse[e, m + 1]
        recovery_matrix[e, m, 16] = k0 * f[16] + k1 * f[17]
    for c in range(16):
        row = unknown[e, c % 8, c // 8]
        if row >= 0:
            force[row] += f[c] - right[3, c] * f[16] - right[4, c] * f[17]


@compiled
def forces(u: Array, elements: ElementArrays, system: ElementSystem) -> float:
    """Fill the internal forces at displacements `u` for a tangent assembled elsewhere; return the least det F.

    Of that tangent are `recovery_matrix` and `condensed_inverse`, by which the centres are eliminated. Filled: `force`,
    the last column of `recovery_matrix`, and `volume`.
    """
    grad_x, grad_y, weight, modes, _, shear, stiffening, lame, nodes, unknown = elements
    _, force, recovery_matrix, condensed_inverse, _, volume = system
    force[:] = 0.0
    least = np.inf
    ux, uy = np.empty(9), np.empty(9)
    fx, fy = np.empty(9), np.empty(9)
    inverse, stress = np.empty((9, 4)), np.empty((9, 4))  # transposed, and without the pressure, at quadrature points
    for e in range(nodes.shape[0]):
        gather(u, nodes, e, ux, uy)
        v0 = v1 = v2 = 0.0
        for q in range(9):
            h00, f01, f10, h11 = displacement_gradient(ux, uy, grad_x[e, q], grad_y[e, q])
            grown = volume_growth(h00, f01, f10, h11)
            f00, f11, j = 1.0 + h00, 1.0 + h11, 1.0 + grown
            least = min(least, j)
            if not j > 0.0:
                return least
            w = weight[e, q]
            log = np.log1p(grown)
            v0 += w * modes[e, q, 0] * log
            v1 += w * modes[e, q, 1] * log
            v2 += w * modes[e, q, 2] * log
            g = w * shear[e]
            if stiffening[e] != PLAIN:
                g *= stiffened(stiffening[e], excess_of(h00, f01, f10, h11, log))[0]
            a00, a01, a10, a11 = f11 / j, -f10 / j, -f01 / j, f00 / j
            inverse[q, 0], inverse[q, 1], inverse[q, 2], inverse[q, 3] = a00, a01, a10, a11
            stress[q, 0], stress[q, 1] = g * (h00 - h11 + grown * f00) / j, g * (f01 - a01)  # as exactly
            stress[q, 2], stress[q, 3] = g * (f10 - a10), g * (h11 - h00 + grown * f11) / j
        volume[e, 0], volume[e, 1], volume[e, 2] = v0, v1, v2
        fx[:] = 0.0
        fy[:] = 0.0
        for q in range(9):
            gx, gy = grad_x[e, q], grad_y[e, q]
            push = lame[e] * weight[e, q] * (modes[e, q, 0] * v0 + modes[e, q, 1] * v1 + modes[e, q, 2] * v2)
            p00, p01 = stress[q, 0] + push * inverse[q, 0], stress[q, 1] + push * inverse[q, 1]
            p10, p11 = stress[q, 2] + push * inverse[q, 2], stress[q, 3] + push * inverse[q, 3]
            for i in range(9):
                fx[i] += p00 * gx[i] + p01 * gy[i]
                fy[i] += p10 * gx[i] + p11 * gy[i]
        recovery_matrix[e, 0, 16] = condensed_inverse[e, 0] * fx[8] + condensed_inverse[e, 1] * fy[8]
        recovery_matrix[e, 1, 16] = condensed_inverse[e, 1] * fx[8] + condensed_inverse[e, 2] * fy[8]
        for i in range(16):
            row = unknown[e, i // 2, i % 2]
            if row >= 0:
                mine = fx[i // 2] if i % 2 == 0 else fy[i // 2]
                force[row] += mine - recovery_matrix[e, 0, i] * fx[8] - recovery_matrix[e, 1, i] * fy[8]
    return least


@compiled
def advance(
    before: BodyState, step: Array, scale: float, after: BodyState, elements: ElementArrays, system: ElementSystem
) -> float:
    """Fill the state `after` going `scale` times the `step` (n,) of the unknowns; return the largest move.

    The pressure is the linearised prediction at the end of the full step, approached by `scale`: the mixed
    integration points of Magisano, Leonetti and Garcea (2017), Int. J. Numer. Meth. Eng. 109, 1237.
    """
    nodes, unknown, lame = elements.nodes, elements.unknown, elements.lame
    recovery_matrix, dilate, volume = system.recovery_matrix, system.dilate, system.volume
    u, pressure, u_new, pressure_new = before.u, before.pressure, after.u, after.pressure
    largest = 0.0
    for n in range(u.shape[0]):
        u_new[n, 0], u_new[n, 1] = u[n, 0], u[n, 1]
    move = np.empty(18)
    for e in range(nodes.shape[0]):
        for i in range(16):
            row = unknown[e, i // 2, i % 2]
            move[i] = step[row] if row >= 0 else 0.0
        for a in range(2):
            centre = recovery_matrix[e, a, 16]
            for i in range(16):
                centre += recovery_matrix[e, a, i] * move[i]
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
def energies(u: Array, elements: ElementArrays, probes: ProbeArrays, out: Array) -> None:
    """Fill `out` (p,) with the strain-energy density at probes; ln J is the element's best fit by its three modes."""
    modes, nodes = elements.modes, elements.nodes
    ux, uy = np.empty(9), np.empty(9)
    seen = -1
    v0 = v1 = v2 = 0.0
    for p in range(probes.element.shape[0]):
        e = probes.element[p]
        if e != seen:
            gather(u, nodes, e, ux, uy)
            v0 = v1 = v2 = 0.0
            for q in range(9):
                xx, xy, yx, yy = displacement_gradient(ux, uy, elements.grad_x[e, q], elements.grad_y[e, q])
                log = elements.weight[e, q] * np.log1p(volume_growth(xx, xy, yx, yy))
                v0 += log * modes[e, q, 0]
                v1 += log * modes[e, q, 1]
                v2 += log * modes[e, q, 2]
            seen = e
        xx, xy, yx, yy = displacement_gradient(ux, uy, probes.grad_x[p], probes.grad_y[p])
        fit = probes.modes[p, 0] * v0 + probes.modes[p, 1] * v1 + probes.modes[p, 2] * v2
        excess = excess_of(xx, xy, yx, yy, np.log1p(volume_growth(xx, xy, yx, yy)))
        exponent = elements.stiffening[e]
        if exponent != PLAIN:
            half = np.sinh(exponent / 2.0 * np.arcsinh(0.5 * np.sqrt(max(excess, 0.0))))
            excess = 16.0 / exponent**2 * half * half
        out[p] = 0.5 * elements.shear[e] * excess + 0.5 * elements.lame[e] * fit * fit
