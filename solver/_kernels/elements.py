"""Forces and tangents of e nine-node elements with q = 9 quadrature points."""

import numpy as np

from solver._kernels import compile_loop, subroutine
from solver.arrays import NEO_HOOKEAN, Array, BodyState, ElementArrays, ElementSystem, ElementWork, Narrow


@subroutine
def shear_growth(exponent: float, excess: float) -> tuple[float, float]:
    """Return the growth factor f of the shear modulus and df/dQ at Q = `excess`, as `constitutive.slopes` does."""
    if excess > 0.04:
        s = np.arcsinh(0.5 * np.sqrt(excess))
        two = np.sinh(2.0 * s)
        value = 2.0 / exponent * np.sinh(exponent * s) / two
        return value, (np.cosh(exponent * s) - value * np.cosh(2.0 * s)) / (2.0 * two * two)
    x, value, slope, term = -excess / 4.0, 1.0, 0.0, 1.0
    for n in range(14):
        factor = (1.0 + exponent / 2.0 + n) * (1.0 - exponent / 2.0 + n) / ((1.5 + n) * (n + 1.0))
        slope -= (n + 1.0) / 4.0 * factor * term
        term *= factor * x
        value += term
    return value, slope


@subroutine
def displacement_gradient(ux: Array, uy: Array, gx: Array, gy: Array) -> tuple[float, float, float, float]:
    """Return du/dX at a point, xx, xy, yx, yy, from nodal values `ux`, `uy` (9,) and gradients `gx`, `gy` (9,)."""
    xx, xy, yx, yy = 0.0, 0.0, 0.0, 0.0
    for i in range(9):
        xx += ux[i] * gx[i]
        xy += ux[i] * gy[i]
        yx += uy[i] * gx[i]
        yy += uy[i] * gy[i]
    return xx, xy, yx, yy


@subroutine
def volume_growth(xx: float, xy: float, yx: float, yy: float) -> float:
    """Return det F - 1 of a displacement gradient without cancellation, since stiff tissue multiplies its error."""
    return xx + yy + xx * yy - xy * yx


@subroutine
def excess_of(xx: float, xy: float, yx: float, yy: float, log: float) -> float:
    """Return F:F - 2 - 2 ln J of a displacement gradient and `log` = ln J, without cancellation."""
    return 2.0 * (xx + yy - log) + xx * xx + xy * xy + yx * yx + yy * yy


@subroutine
def gather(u: Array, nodes: Narrow, e: int, ux: Array, uy: Array) -> None:
    """Fill `ux`, `uy` (9,) with the nodal displacements of element `e`."""
    for i in range(9):
        ux[i], uy[i] = u[nodes[e, i], 0], u[nodes[e, i], 1]


@compile_loop
def assemble(u: Array, pressure: Array, new_tangent: bool, elements: ElementArrays, system: ElementSystem) -> float:
    """Fill the elements' `system` at displacements `u` (nodes, 2); return the least det F.

    `pressure` (e, 3) are the pressure modes in the tangent (the linearised prediction); the forces depend on `u` alone.
    Without `new_tangent`, the tangent of an earlier call is kept. Where det F is not positive, the system is
    incomplete.
    """
    system.force[:] = 0.0
    least = np.inf
    ux, uy = np.empty(9), np.empty(9)
    work = ElementWork(
        np.empty((9, 4)), np.empty((9, 4)), np.empty((9, 18)), np.empty((9, 18)), np.empty((9, 3)), np.empty(9),
        np.empty(9), np.empty(9), np.empty((3, 18)), np.empty(18), np.empty((9, 16)), np.empty((9, 16)),
        np.empty((9, 9)), np.empty((18, 5)), np.empty((5, 16)), np.zeros((18, 18)), np.empty((16, 16)),
    )  # fmt: skip
    relaxes, filled = system.overstress_tangent.shape[0] > 0, False
    for e in range(elements.nodes.shape[0]):
        gather(u, elements.nodes, e, ux, uy)
        least = min(least, strain_points(e, ux, uy, elements, work, system.volume))
        if not least > 0.0:
            return least
        sum_forces(e, elements, work, system)
        if new_tangent:
            stiffens = elements.stiffening[e] != NEO_HOOKEAN
            deform_gradients(e, stiffens, pressure, elements, work)
            if stiffens:
                sum_laplace(elements.grad_x[e], elements.grad_y[e], work.push, work.laplace)
            else:
                for i in range(9):
                    for c in range(9):
                        work.laplace[i, c] = elements.shear[e] * elements.laplace[e, i, c]
            sum_geometric(work)
            if stiffens or relaxes or filled:
                filled = stiffens or relaxes
                sum_dyads(e, stiffens, work, system)
            eliminate_centre(e, work, system)
            write_tangent(e, work, system)
        add_forces(e, elements.unknown, work.f, system)
    return least


@subroutine
def strain_points(e: int, ux: Array, uy: Array, elements: ElementArrays, work: ElementWork, volume: Array) -> float:
    """Fill the deformation at an element's quadrature points, and its modes of `volume`; return its least det F."""
    f_inv_t, f_diff, modes, push, shear_slope = (
        work.f_inv_t,
        work.f_diff,
        work.weighted_modes,
        work.push,
        work.shear_slope,
    )
    v0 = v1 = v2 = 0.0
    exponent, shear = elements.stiffening[e], elements.shear[e]
    least = np.inf
    for q in range(9):
        h00, f01, f10, h11 = displacement_gradient(ux, uy, elements.grad_x[e, q], elements.grad_y[e, q])
        dilation = volume_growth(h00, f01, f10, h11)
        f00, f11, j = 1.0 + h00, 1.0 + h11, 1.0 + dilation
        least = min(least, j)
        if not j > 0.0:
            break
        w = elements.weight[e, q]
        w0, w1, w2 = w * elements.modes[e, q, 0], w * elements.modes[e, q, 1], w * elements.modes[e, q, 2]
        modes[q, 0], modes[q, 1], modes[q, 2] = w0, w1, w2
        log = np.log1p(dilation)
        v0 += w0 * log
        v1 += w1 * log
        v2 += w2 * log
        wg = w * shear
        if exponent != NEO_HOOKEAN:
            factor, growth = shear_growth(exponent, excess_of(h00, f01, f10, h11, log))
            shear_slope[q] = 2.0 * growth * wg
            wg *= factor
        push[q] = wg
        over = 1.0 / j
        a00, a01, a10, a11 = f11 * over, -f10 * over, -f01 * over, f00 * over
        f_inv_t[q, 0], f_inv_t[q, 1], f_inv_t[q, 2], f_inv_t[q, 3] = a00, a01, a10, a11
        f_diff[q, 0], f_diff[q, 1] = (h00 - h11 + dilation * f00) * over, f01 - a01  # without cancellation
        f_diff[q, 2], f_diff[q, 3] = f10 - a10, (h11 - h00 + dilation * f11) * over
    volume[e, 0], volume[e, 1], volume[e, 2] = v0, v1, v2
    return least


@subroutine
def sum_forces(e: int, elements: ElementArrays, work: ElementWork, system: ElementSystem) -> None:
    """Fill an element's internal forces `f` (18,)."""
    f_inv_t, f_diff, modes, push, f = work.f_inv_t, work.f_diff, work.weighted_modes, work.push, work.f
    lam, relaxes = elements.lame[e], system.overstress_force.shape[0] > 0
    v0, v1, v2 = lam * system.volume[e, 0], lam * system.volume[e, 1], lam * system.volume[e, 2]
    for c in range(18):
        f[c] = system.overstress_force[e, c] if relaxes else 0.0
    for q in range(9):
        gx, gy, g = elements.grad_x[e, q], elements.grad_y[e, q], push[q]
        pressure = modes[q, 0] * v0 + modes[q, 1] * v1 + modes[q, 2] * v2
        p00, p01 = g * f_diff[q, 0] + pressure * f_inv_t[q, 0], g * f_diff[q, 1] + pressure * f_inv_t[q, 1]
        p10, p11 = g * f_diff[q, 2] + pressure * f_inv_t[q, 2], g * f_diff[q, 3] + pressure * f_inv_t[q, 3]
        for i in range(8):
            f[i] += p00 * gx[i] + p01 * gy[i]
            f[8 + i] += p10 * gx[i] + p11 * gy[i]
        f[16] += p00 * gx[8] + p01 * gy[8]
        f[17] += p10 * gx[8] + p11 * gy[8]


@subroutine
def deform_gradients(e: int, stiffens: bool, pressure: Array, elements: ElementArrays, work: ElementWork) -> None:
    """Fill the deformed gradients of shape functions, the derivatives of an element's volume modes, and `bend`."""
    h, s, modes, bend, d, left = work.h, work.s, work.weighted_modes, work.bend, work.d, work.left
    lam = elements.lame[e]
    p0, p1, p2 = pressure[e, 0], pressure[e, 1], pressure[e, 2]
    for q in range(9):
        bend[q] = work.push[q] - (modes[q, 0] * p0 + modes[q, 1] * p1 + modes[q, 2] * p2)
        push_forward(elements.grad_x[e, q], elements.grad_y[e, q], work.f_inv_t[q], h[q])
        if stiffens:
            push_forward(elements.grad_x[e, q], elements.grad_y[e, q], work.f_diff[q], s[q])
    for c in range(18):
        d0 = d1 = d2 = 0.0
        for q in range(9):
            d0 += modes[q, 0] * h[q, c]
            d1 += modes[q, 1] * h[q, c]
            d2 += modes[q, 2] * h[q, c]
        d[0, c], d[1, c], d[2, c] = d0, d1, d2
        left[c, 0], left[c, 1], left[c, 2] = lam * d0, lam * d1, lam * d2


@subroutine
def push_forward(gx: Array, gy: Array, matrix: Array, out: Array) -> None:
    """Fill `out` (18,) with a `matrix` (xx, xy, yx, yy) times each node's gradient, ordered as in `ElementWork`."""
    for i in range(8):
        out[i], out[8 + i] = matrix[0] * gx[i] + matrix[1] * gy[i], matrix[2] * gx[i] + matrix[3] * gy[i]
    out[16], out[17] = matrix[0] * gx[8] + matrix[1] * gy[8], matrix[2] * gx[8] + matrix[3] * gy[8]


@subroutine
def sum_laplace(grad_x: Array, grad_y: Array, push: Array, out: Array) -> None:
    """Fill `out` (9, 9) with integrals of grad N_i . grad N_j times a modulus; `push` (q,) is weight times modulus."""
    for i in range(9):
        for c in range(9):
            out[i, c] = 0.0
        for q in range(9):
            x, y = push[q] * grad_x[q, i], push[q] * grad_y[q, i]
            for c in range(9):
                out[i, c] += x * grad_x[q, c] + y * grad_y[q, c]


@subroutine
def sum_geometric(work: ElementWork) -> None:
    """Fill the products of deformed gradients: of each node's x, then its y, with those of all outer nodes.

    For a row along x and a column along y, the tangent takes y of the row's node and x of the column's node.
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


@subroutine
def sum_dyads(e: int, stiffens: bool, work: ElementWork, system: ElementSystem) -> None:
    """Fill `dyads` (18, 18) with the stiffening term of an element's tangent and the tangent of the overstress."""
    s, shear_slope, dyads = work.s, work.shear_slope, work.dyads
    for i in range(18):
        for c in range(18):
            dyads[i, c] = system.overstress_tangent[e, i, c] if system.overstress_tangent.shape[0] > 0 else 0.0
        for q in range(9 if stiffens else 0):
            x = shear_slope[q] * s[q, i]
            for c in range(18):
                dyads[i, c] += x * s[q, c]


@subroutine
def eliminate_centre(e: int, work: ElementWork, system: ElementSystem) -> None:
    """Eliminate an element's centre node, which no other element shares; fill the `system`, `left` and `right`."""
    h, bend, d, dyads, by_x, by_y = work.h, work.bend, work.d, work.dyads, work.by_x, work.by_y
    left, right, even, inverse = work.left, work.right, work.laplace, system.condensed_inverse
    xx, yy, xy = even[8, 8] + dyads[16, 16], even[8, 8] + dyads[17, 17], dyads[17, 16]
    for q in range(9):
        x, y = bend[q] * h[q, 16], bend[q] * h[q, 17]
        xx += x * h[q, 16]
        xy += x * h[q, 17]
        yy += y * h[q, 17]
    for m in range(3):
        xx += left[16, m] * d[m, 16]
        xy += left[16, m] * d[m, 17]
        yy += left[17, m] * d[m, 17]
    det = xx * yy - xy * xy
    k00, k01, k11 = yy / det, -xy / det, xx / det
    inverse[e, 0], inverse[e, 1], inverse[e, 2] = k00, k01, k11
    for c in range(16):
        i, a = c % 8, c // 8
        products = by_x if a == 0 else by_y
        x = dyads[16, c] + products[8, i] + (1 - a) * even[8, i]
        y = dyads[17, c] + products[8, 8 + i] + a * even[8, i]
        for m in range(3):
            x += left[16, m] * d[m, c]
            y += left[17, m] * d[m, c]
            right[m, c] = d[m, c]
        left[c, 3], left[c, 4] = -x, -y
        right[3, c], right[4, c] = k00 * x + k01 * y, k01 * x + k11 * y
        system.recovery_matrix[e, 0, 2 * i + a], system.recovery_matrix[e, 1, 2 * i + a] = right[3, c], right[4, c]


@subroutine
def write_tangent(e: int, work: ElementWork, system: ElementSystem) -> None:
    """Fill an element's condensed tangent, lower half, and the displacement derivatives of its volume modes."""
    left, right, dyads, even, tangent = work.left, work.right, work.dyads, work.laplace, system.tangent
    by_x, by_y, product = work.by_x, work.by_y, work.product
    for m in range(3):
        for c in range(18):
            system.dilate[e, m, 2 * (c % 8) + c // 8 if c < 16 else c] = work.d[m, c]
    for i in range(16):
        for c in range(16):
            total = 0.0
            for m in range(5):
                total += left[i, m] * right[m, c]
            product[i, c] = total
    for i in range(8):
        for c in range(i + 1):
            tangent[e, 2 * i, 2 * c] = product[i, c] + dyads[i, c] + by_x[i, c] + even[i, c]
            tangent[e, 2 * i, 2 * c + 1] = product[i, 8 + c] + dyads[i, 8 + c] + by_y[i, c]
            tangent[e, 2 * i + 1, 2 * c] = product[8 + i, c] + dyads[8 + i, c] + by_x[i, 8 + c]
            tangent[e, 2 * i + 1, 2 * c + 1] = product[8 + i, 8 + c] + dyads[8 + i, 8 + c] + by_y[i, 8 + c] + even[i, c]


@subroutine
def add_forces(e: int, unknown: Narrow, f: Array, system: ElementSystem) -> None:
    """Add an element's condensed forces to the system, and fill the centre's displacement due to `f` (18,)."""
    recovery_matrix, inverse = system.recovery_matrix, system.condensed_inverse
    for m in range(2):
        recovery_matrix[e, m, 16] = inverse[e, m] * f[16] + inverse[e, m + 1] * f[17]
    for i in range(8):
        for a in range(2):
            row, column = unknown[e, i, a], 2 * i + a
            if row >= 0:
                centre = recovery_matrix[e, 0, column] * f[16] + recovery_matrix[e, 1, column] * f[17]
                system.force[row] += f[i + 8 * a] - centre


@compile_loop
def advance(
    before: BodyState, step: Array, scale: float, after: BodyState, elements: ElementArrays, system: ElementSystem
) -> float:
    """Fill the state `after` with `scale` times the `step` (n,); return the largest component of the full step.

    The pressure moves by the factor `scale` towards the linearised prediction at the end of the full step: the mixed
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


@compile_loop
def overstress(u: Array, tensor: Array, elements: ElementArrays, force: Array, tangent: Array, points: Array) -> None:
    """Fill `force` (e, 18) and `tangent` (e, 18, 18) of W = 1/2 J^-2/3 T:C at displacements `u` (nodes, 2).

    `tensor` (e, q, 4) is T: xx, yy, xy, zz [MPa]. `force` and `tangent` are ordered as in `ElementWork`. The tangent is
    filled only where the column's node does not come after the row's. `points` (4, 9) is memory for F T and F^-T times
    the gradients.
    """
    ux, uy = np.empty(9), np.empty(9)
    mx, my, hx, hy = points[0], points[1], points[2], points[3]
    for e in range(elements.nodes.shape[0]):
        gather(u, elements.nodes, e, ux, uy)
        for i in range(18):
            force[e, i] = 0.0
            for k in range(18):
                tangent[e, i, k] = 0.0
        for q in range(9):
            gx, gy = elements.grad_x[e, q], elements.grad_y[e, q]
            f00, f01, f10, f11 = displacement_gradient(ux, uy, gx, gy)
            f00, f11 = 1.0 + f00, 1.0 + f11
            j = f00 * f11 - f01 * f10
            c = elements.weight[e, q] * j ** (-2.0 / 3.0)
            t0, t1, t2 = tensor[e, q, 0], tensor[e, q, 1], tensor[e, q, 2]
            m00, m01 = f00 * t0 + f01 * t2, f00 * t2 + f01 * t1
            m10, m11 = f10 * t0 + f11 * t2, f10 * t2 + f11 * t1
            contraction = f00 * m00 + f01 * m01 + f10 * m10 + f11 * m11 + tensor[e, q, 3]
            a00, a01, a10, a11 = f11 / j, -f10 / j, -f01 / j, f00 / j  # F^-T
            part, third = c * 2.0 / 3.0, c * contraction / 3.0
            dyadic = part * contraction / 3.0
            for i in range(9):
                x, y = i + 8 * (i == 8), i + 8 + (i == 8)
                hx[i] = a00 * gx[i] + a01 * gy[i]
                hy[i] = a10 * gx[i] + a11 * gy[i]
                mx[i] = m00 * gx[i] + m01 * gy[i]
                my[i] = m10 * gx[i] + m11 * gy[i]
                force[e, x] += c * mx[i] - third * hx[i]
                force[e, y] += c * my[i] - third * hy[i]
                px, py = c * (t0 * gx[i] + t2 * gy[i]), c * (t2 * gx[i] + t1 * gy[i])
                for k in range(i + 1):
                    across, up = k + 8 * (k == 8), k + 8 + (k == 8)
                    laplace = px * gx[k] + py * gy[k]
                    xx, yy = mx[i] * hx[k] + hx[i] * mx[k], my[i] * hy[k] + hy[i] * my[k]
                    xy, yx = mx[i] * hy[k] + hx[i] * my[k], my[i] * hx[k] + hy[i] * mx[k]
                    tangent[e, x, across] += laplace - part * xx + (dyadic + third) * hx[i] * hx[k]
                    tangent[e, y, up] += laplace - part * yy + (dyadic + third) * hy[i] * hy[k]
                    tangent[e, x, up] += dyadic * hx[i] * hy[k] + third * hy[i] * hx[k] - part * xy
                    tangent[e, y, across] += dyadic * hy[i] * hx[k] + third * hx[i] * hy[k] - part * yx
