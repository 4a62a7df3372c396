"""What relaxing tissue adds to the forces and tangents of elements that `solver._kernels.elements` has assembled."""

import numpy as np

from solver._kernels.compiling import compiled
from solver._kernels.elements import displacement_gradient, gather
from solver.arrays import Array, ElementArrays, ElementSystem, Narrow, OverstressWork


@compiled
def add_overstress(u: Array, tensor: Array, elements: ElementArrays, system: ElementSystem, anew: bool) -> None:
    """Add the forces of W = 1/2 J^-2/3 T:C at displacements `u`, and where `anew` its tangent.

    `tensor` (e, q, 4) is T: xx, yy, xy, zz [MPa]. The `system` was filled by `assemble` or `forces`, with the centre of
    each element eliminated. Where `anew`, it is eliminated again with what is added; otherwise the tangent is one kept
    from another state.
    """
    ux, uy = np.empty(9), np.empty(9)
    work = OverstressWork(np.empty((18, 18)), np.empty(18), np.empty((4, 9)), np.empty((2, 17)))
    for e in range(elements.nodes.shape[0]):
        gather(u, elements.nodes, e, ux, uy)
        integrate(e, ux, uy, tensor, elements, work, anew)
        if anew:
            restore_centre(e, elements.unknown, work, system)
            eliminate_again(e, elements.unknown, work, system)
        else:
            add_own(e, elements.unknown, work.own, system)


@compiled
def integrate(
    e: int, ux: Array, uy: Array, tensor: Array, elements: ElementArrays, work: OverstressWork, anew: bool
) -> None:
    """Fill an element's own forces, and where `anew` the lower half of its tangent by nodes."""
    full, own = work.full, work.own
    mx, my, hx, hy = work.points[0], work.points[1], work.points[2], work.points[3]
    full[:, :] = 0.0
    own[:] = 0.0
    for q in range(9):
        gx, gy = elements.grad_x[e, q], elements.grad_y[e, q]
        f00, f01, f10, f11 = displacement_gradient(ux, uy, gx, gy)
        f00, f11 = 1.0 + f00, 1.0 + f11
        j = f00 * f11 - f01 * f10
        c = elements.weight[e, q] * j ** (-2.0 / 3.0)
        t0, t1, t2 = tensor[e, q, 0], tensor[e, q, 1], tensor[e, q, 2]
        m00, m01 = f00 * t0 + f01 * t2, f00 * t2 + f01 * t1
        m10, m11 = f10 * t0 + f11 * t2, f10 * t2 + f11 * t1
        whole = f00 * m00 + f01 * m01 + f10 * m10 + f11 * m11 + tensor[e, q, 3]
        a00, a01, a10, a11 = f11 / j, -f10 / j, -f01 / j, f00 / j  # inverse transposed
        for i in range(9):
            hx[i] = a00 * gx[i] + a01 * gy[i]
            hy[i] = a10 * gx[i] + a11 * gy[i]
            mx[i] = m00 * gx[i] + m01 * gy[i]
            my[i] = m10 * gx[i] + m11 * gy[i]
            own[2 * i] += c * (mx[i] - whole / 3.0 * hx[i])
            own[2 * i + 1] += c * (my[i] - whole / 3.0 * hy[i])
        if anew:
            dyadic, part, third = c * 2.0 / 9.0 * whole, c * 2.0 / 3.0, c * whole / 3.0
            for i in range(9):
                px, py = c * (t0 * gx[i] + t2 * gy[i]), c * (t2 * gx[i] + t1 * gy[i])
                for k in range(i + 1):
                    laplace = px * gx[k] + py * gy[k]
                    xx, yy = mx[i] * hx[k] + hx[i] * mx[k], my[i] * hy[k] + hy[i] * my[k]
                    xy, yx = mx[i] * hy[k] + hx[i] * my[k], my[i] * hx[k] + hy[i] * mx[k]
                    full[2 * i, 2 * k] += laplace - part * xx + (dyadic + third) * hx[i] * hx[k]
                    full[2 * i + 1, 2 * k + 1] += laplace - part * yy + (dyadic + third) * hy[i] * hy[k]
                    full[2 * i, 2 * k + 1] += dyadic * hx[i] * hy[k] + third * hy[i] * hx[k] - part * xy
                    full[2 * i + 1, 2 * k] += dyadic * hy[i] * hx[k] + third * hx[i] * hy[k] - part * yx


@compiled
def add_own(e: int, unknown: Narrow, own: Array, system: ElementSystem) -> None:
    """Add an element's `own` forces (18,) for the tangent that is there."""
    recovery_matrix, condensed_inverse, force = system.recovery_matrix, system.condensed_inverse, system.force
    for m in range(2):
        recovery_matrix[e, m, 16] += condensed_inverse[e, m] * own[16] + condensed_inverse[e, m + 1] * own[17]
    for i in range(16):
        row = unknown[e, i // 2, i % 2]
        if row >= 0:
            force[row] += own[i] - recovery_matrix[e, 0, i] * own[16] - recovery_matrix[e, 1, i] * own[17]


@compiled
def restore_centre(e: int, unknown: Narrow, work: OverstressWork, system: ElementSystem) -> None:
    """Bring back the centre of an element, and give it its share: `across` is what it has to do with the others."""
    full, own, across = work.full, work.own, work.across
    tangent, force, recovery_matrix, inverse = (
        system.tangent, system.force, system.recovery_matrix, system.condensed_inverse
    )  # fmt: skip
    det = inverse[e, 0] * inverse[e, 2] - inverse[e, 1] * inverse[e, 1]
    k00, k01, k11 = inverse[e, 2] / det, -inverse[e, 1] / det, inverse[e, 0] / det
    for i in range(17):
        across[0, i] = k00 * recovery_matrix[e, 0, i] + k01 * recovery_matrix[e, 1, i]
        across[1, i] = k01 * recovery_matrix[e, 0, i] + k11 * recovery_matrix[e, 1, i]
    for i in range(16):
        row = unknown[e, i // 2, i % 2]
        if row >= 0:
            force[row] += own[i] + across[0, i] * recovery_matrix[e, 0, 16] + across[1, i] * recovery_matrix[e, 1, 16]
        for k in range(i + 1):
            shared = across[0, i] * recovery_matrix[e, 0, k] + across[1, i] * recovery_matrix[e, 1, k]
            tangent[e, i, k] += full[i, k] + shared
    k00, k01, k11 = k00 + full[16, 16], k01 + full[17, 16], k11 + full[17, 17]
    det = k00 * k11 - k01 * k01
    inverse[e, 0], inverse[e, 1], inverse[e, 2] = k11 / det, -k01 / det, k00 / det


@compiled
def eliminate_again(e: int, unknown: Narrow, work: OverstressWork, system: ElementSystem) -> None:
    """Eliminate the centre of an element that was brought back."""
    full, own, across = work.full, work.own, work.across
    tangent, force, recovery_matrix, inverse = (
        system.tangent, system.force, system.recovery_matrix, system.condensed_inverse
    )  # fmt: skip
    for i in range(17):
        across[0, i] += own[16] if i == 16 else full[16, i]
        across[1, i] += own[17] if i == 16 else full[17, i]
        recovery_matrix[e, 0, i] = inverse[e, 0] * across[0, i] + inverse[e, 1] * across[1, i]
        recovery_matrix[e, 1, i] = inverse[e, 1] * across[0, i] + inverse[e, 2] * across[1, i]
    for i in range(16):
        row = unknown[e, i // 2, i % 2]
        if row >= 0:
            force[row] -= across[0, i] * recovery_matrix[e, 0, 16] + across[1, i] * recovery_matrix[e, 1, 16]
        for k in range(i + 1):
            tangent[e, i, k] -= across[0, i] * recovery_matrix[e, 0, k] + across[1, i] * recovery_matrix[e, 1, k]
