"""Forces and tangents of elements from the overstress of relaxing tissue."""

import numpy as np

from solver._kernels.compiling import compile_loop
from solver._kernels.elements import displacement_gradient, gather
from solver.arrays import Array, ElementArrays


@compile_loop
def overstress(u: Array, tensor: Array, elements: ElementArrays, force: Array, tangent: Array, points: Array) -> None:
    """Fill `force` (e, 18) and `tangent` (e, 18, 18) of W = 1/2 J^-2/3 T:C at displacements `u` (nodes, 2).

    `tensor` (e, q, 4) is T: xx, yy, xy, zz [MPa]. Both are ordered as in `ElementWork`. The tangent is filled only
    where the column's node does not come after the row's. `points` (4, 9) is memory for F T and F^-T times the
    gradients.
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
