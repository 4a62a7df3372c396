"""A state of one mesh taken to another: displacements by the elements' own functions, pressures by their elements."""

from solver._kernels.arguments import MeshTransferArrays
from solver._kernels.compiling import compiled
from solver.arrays import Array


@compiled
def carry(u: Array, pressure: Array, transfer: MeshTransferArrays, u_new: Array, pressure_new: Array) -> None:
    """Fill `u_new` (n, 2) and `pressure_new` (e, 3) of a new mesh from `u` and `pressure` of an old one.

    A node in line i and row j of the new mesh takes its part of three old lines from `along[i]` on, and of three rows
    from `across[j]` on. The pressure at a quadrature point is that of the old element it lies in.
    """
    combination, centre, along, along_parts, across, across_parts, station, layer, points, weight, modes = transfer
    lines, rows = along.shape[0], across.shape[0]
    old_rows = across[rows - 1] + 3
    for i in range(lines):
        for j in range(rows):
            x = y = 0.0
            for a in range(3):
                first = (along[i] + a) * old_rows + across[j]
                for b in range(3):
                    part = along_parts[i, a] * across_parts[j, b]
                    x += part * u[first + b, 0]
                    y += part * u[first + b, 1]
            u_new[i * rows + j, 0], u_new[i * rows + j, 1] = x, y
    layers, old_layers = layer.shape[0], old_rows // 2
    for e in range(weight.shape[0]):
        p0 = p1 = p2 = 0.0
        for q in range(9):
            host = station[e // layers, q // 3] * old_layers + layer[e % layers, q % 3]
            x, y = points[e, q, 0] - centre[host, 0], points[e, q, 1] - centre[host, 1]
            field = 0.0
            for m in range(3):
                c = combination[host, m]
                field += pressure[host, m] * (c[0] + c[1] * x + c[2] * y)
            field *= weight[e, q]
            p0 += field * modes[e, q, 0]
            p1 += field * modes[e, q, 1]
            p2 += field * modes[e, q, 2]
        pressure_new[e, 0], pressure_new[e, 1], pressure_new[e, 2] = p0, p1, p2
