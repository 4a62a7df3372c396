"""A structured body: a grid of points becomes a mesh of nine-node quadrilaterals, its quality checked."""

import numpy as np

from solver.arrays import Array, Indices
from solver.element import Q2P1
from solver.mesh import Mesh

# offsets along the grid's two directions of an element's nodes, for grids whose first direction turns to the second
# clockwise (as from proximal to distal, then outwards to the skin)
_ALONG = np.array([0, 0, 2, 2, 0, 1, 2, 1, 1])
_OUT = np.array([0, 2, 2, 0, 1, 2, 1, 0, 1])


class MeshError(ValueError):
    """A mesh that cannot carry a solution: an element is folded or far too thin."""


def grid_mesh(points: Array, layers: Indices, skin: slice, held: Indices) -> Mesh:
    """Return the mesh of `points` (2 a + 1, 2 b + 1, 2), whose second direction ends on the skin.

    `layers` (b,) is the region of each layer of elements, `skin` the range of points along the first direction that
    may touch (from an even one to an even one), `held` node numbers. Node (i, j) has number i (2 b + 1) + j.
    """
    long, wide = points.shape[0], points.shape[1]
    number: Indices = np.arange(long * wide, dtype=np.int64).reshape(long, wide)
    first = number[: long - 1 : 2, : wide - 1 : 2].ravel()  # lowest node of each element
    elements = first[:, None] + _ALONG * wide + _OUT
    region = np.tile(layers, (long - 1) // 2)
    mesh = Mesh(points.reshape(-1, 2), elements, region, number[skin, -1].copy(), held)
    quality(mesh)
    return mesh


def quality(mesh: Mesh) -> dict[str, float]:
    """Return the least ratio of smallest to largest Jacobian in an element, and the largest aspect of an element.

    Raises MeshError where an element is folded (its Jacobian is not positive at every corner and quadrature point).
    """
    jacobian, det = jacobians(mesh, np.concatenate([Q2P1.points, Q2P1.corners]))
    sides = np.linalg.norm(jacobian, axis=-2)  # lengths of the two tangents
    aspect = np.maximum(sides[..., 0] / sides[..., 1], sides[..., 1] / sides[..., 0])
    return {"jacobian_ratio": float((det.min(axis=1) / det.max(axis=1)).min()), "aspect": float(aspect.max())}


def jacobians(mesh: Mesh, at: Array) -> tuple[Array, Array]:
    """Return the Jacobians (e, p, 2, 2) of all elements at local coordinates `at` (p, 2), and their determinants.

    Raises MeshError where one is not positive: the element is folded there.
    """
    jacobian = np.swapaxes(mesh.nodes[mesh.elements], 1, 2)[:, None] @ Q2P1.shape(at)[1]
    det = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]
    if not det.min() > 0.0:
        worst = mesh.nodes[mesh.elements[int(det.min(axis=1).argmin()), 8]]
        raise MeshError(f"an element of the mesh is folded, near x = {worst[0]:.3g}, y = {worst[1]:.3g} mm")
    return jacobian, det
