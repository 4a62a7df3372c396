"""Elements and meshes: nodes, nine-node quadrilaterals, regions, the skin that may touch, and driven nodes.

Any mesh can be halved: each element is divided in four by its quadratic geometry, so the meshes nest.
"""

import math
from dataclasses import dataclass, field, fields
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array, Flags, Indices, determinant, inverse

# Gauss points and weights on a line from -1 to 1, in closed form: NumPy's polynomials take longer to import
GAUSS_3 = np.array([-(0.6**0.5), 0.0, 0.6**0.5]), np.array([5.0, 8.0, 5.0]) / 9.0
_FAR, _NEAR = (3.0 / 7.0 + 2.0 / 7.0 * 1.2**0.5) ** 0.5, (3.0 / 7.0 - 2.0 / 7.0 * 1.2**0.5) ** 0.5
GAUSS_4 = np.array([-_FAR, -_NEAR, _NEAR, _FAR]), 0.5 + np.array([-1.0, 1.0, 1.0, -1.0]) * 30.0**0.5 / 36.0
_ACROSS = np.array([0, 2, 2, 0, 1, 2, 1, 0, 1])  # position of each node among -1, 0, +1 along xi
_UP = np.array([0, 0, 2, 2, 0, 1, 2, 1, 1])  # along eta


def line(s: Array) -> tuple[Array, Array]:
    """Return the three quadratic shape functions of a line at `s` (...), and their slopes, each (..., 3).

    >>> line(np.array(0.5))
    (array([-0.125,  0.75 ,  0.375]), array([ 0., -1.,  1.]))
    """
    values = np.stack([s * (s - 1.0) / 2.0, 1.0 - s * s, s * (s + 1.0) / 2.0], axis=-1)
    slopes = np.stack([s - 0.5, -2.0 * s, s + 0.5], axis=-1)
    return values, slopes


class Q2P1:
    """The nine-node quadrilateral: biquadratic displacements, and a pressure linear in x and y inside each element.

    Pressure is discontinuous between elements and condensed in each. The element is stable and of optimal order up to
    the incompressible limit (Boffi and Gastaldi 2002, Computing 69, 1-10, with the pressure in true coordinates).
    """

    name = "Q2/P-1"
    order = 2  # of the displacements
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    positions = np.stack([_ACROSS - 1.0, _UP - 1.0], axis=-1)  # (9, 2) of the nodes
    points = np.stack([np.tile(GAUSS_3[0], 3), np.repeat(GAUSS_3[0], 3)], axis=-1)  # (9, 2) quadrature
    weights = np.tile(GAUSS_3[1], 3) * np.repeat(GAUSS_3[1], 3)  # (9,)

    @staticmethod
    def shape(points: Array) -> tuple[Array, Array]:
        """Return the shape functions (..., 9) at local points (..., 2), and their gradients (..., 9, 2).

        >>> values, gradients = Q2P1.shape(np.array([1.0, 1.0]))
        >>> values
        array([0., 0., 1., 0., 0., 0., 0., 0., 0.])
        """
        (nx, dx), (ny, dy) = line(points[..., 0]), line(points[..., 1])
        across, up = nx[..., _ACROSS], ny[..., _UP]
        gradients = np.stack([dx[..., _ACROSS] * up, across * dy[..., _UP]], axis=-1)
        return across * up, gradients


Numbers = TypeVar("Numbers", bound=np.generic)
_NONE: Indices = np.empty(0, np.int64)


def distinct(numbers: NDArray[Numbers]) -> NDArray[Numbers]:
    """Return the distinct numbers in ascending order.

    >>> distinct(np.array([3, 1, 3]))
    array([1, 3])
    """
    # several times as fast for a few numbers as np.unique, which imports masked arrays
    numbers = np.sort(numbers, axis=None)
    new = np.ones(len(numbers), bool)
    new[1:] = numbers[1:] != numbers[:-1]
    return numbers[new]


@dataclass(frozen=True, eq=False)  # no slots: cached properties need a dictionary
class Mesh:
    """A body as read-only arrays. Nodes of an element: corners, then mid-sides, then centre.

    Corners run counter-clockwise, mid-side k lies between corners k and k+1:

        3 - 6 - 2
        7   8   5
        0 - 4 - 1
    """

    nodes: Array  # (n, 2) undeformed positions [mm]
    elements: Indices  # (e, 9)
    region: Indices  # (e,) number of the material of each element
    skin: Indices  # (2 k + 1,) nodes that may touch, along k edges: end, middle, end, middle, ... end
    held: Indices  # (h,) nodes driven in both directions
    held_x: Indices = field(default_factory=lambda: _NONE)  # nodes driven along x and free along y
    held_y: Indices = field(default_factory=lambda: _NONE)  # nodes driven along y: rollers, planes of symmetry

    def __post_init__(self) -> None:
        """Copy the arrays, read-only, with lengths and integers in the types of the kernels.

        Other types stay unchanged; `solver.body.validation` refuses them when a body is made.
        """
        for f in fields(self):
            array = np.array(getattr(self, f.name))
            kinds, dtype = ("fiu", np.float64) if f.name == "nodes" else ("iu", np.int64)
            if array.dtype.kind in kinds or not array.size:
                array = np.ascontiguousarray(array, dtype)
            array.flags.writeable = False
            object.__setattr__(self, f.name, array)

    @cached_property
    def fixed(self) -> Indices:
        """Numbers of the driven unknowns in ascending order: x of node n is 2 n, y is 2 n + 1."""
        along = np.concatenate([self.held, self.held_x]), np.concatenate([self.held, self.held_y])
        return distinct(np.concatenate([2 * along[0], 2 * along[1] + 1]))

    @cached_property
    def length_scale(self) -> float:
        """Length relative to which displacements are small or large: the root of the area [mm].

        >>> two_by_half = np.moveaxis(np.mgrid[:9, :3], 0, -1) / [4.0, -4.0]
        >>> round(grid_mesh(two_by_half, np.zeros(1), slice(0, 1), np.zeros(0)).length_scale, 3)
        1.0
        """
        corners = self.nodes[self.elements[:, :4]]
        across = corners[:, 2:] - corners[:, :2]
        return math.sqrt(abs(float(determinant(across).sum())) / 2.0)

    @property
    def dofs(self) -> int:
        """Number of unknown displacements."""
        return 2 * len(distinct(self.elements)) - len(self.fixed)

    @cached_property
    def driven(self) -> Flags:
        """Flags (n, 2) of the driven components of nodes."""
        out = np.zeros(2 * len(self.nodes), bool)
        out[self.fixed] = True
        return out.reshape(-1, 2)

    def local(self, field: Array, element: Indices | None = None) -> Array:
        """Return the nodal values (e, 9, ...) of a `field` (n, ...) in all elements, or in those numbered `element`."""
        nodes = self.elements if element is None else self.elements.take(element, axis=0)
        return field.take(nodes, axis=0)  # ten times as fast as indexing with an array

    def about_centre(self, field: Array, element: Indices | None = None) -> Array:
        """Return `local` less the value at the centre: a translation would drown small strains in round-off."""
        local = self.local(field, element)
        return local - local[:, 8:]

    def assemble(self, local: Array) -> Array:
        """Return the nodal sums (n, 2) of `local` (e, 18): x, y of each node of an element in turn."""
        node, along = self.elements.ravel(), local.reshape(-1, 2).T
        return np.stack(
            [np.bincount(node, component, len(self.nodes)) for component in along], axis=1, dtype=np.float64
        )


# node offsets of an element along the grid's two directions; the second is clockwise from the first
# (for example, from proximal to distal, and outwards to the skin)
ALONG = np.array([0, 0, 2, 2, 0, 1, 2, 1, 1])
OUT = np.array([0, 2, 2, 0, 1, 2, 1, 0, 1])


class MeshError(ValueError):
    """A mesh that cannot carry a solution: an element is folded or far too thin."""


def grid_mesh(points: Array, layers: Indices, skin: slice, held: Indices) -> Mesh:
    """Return the mesh of `points` (2 a + 1, 2 b + 1, 2), whose second direction ends on the skin.

    `layers` (b,) is the region of each layer of elements. `skin` is the range of points along the first direction that
    may touch; it starts and ends at an even one. `held` are node numbers. Node (i, j) has number i (2 b + 1) + j.
    """
    long, wide = points.shape[0], points.shape[1]
    number: Indices = np.arange(long * wide, dtype=np.int64).reshape(long, wide)
    first = number[: long - 1 : 2, : wide - 1 : 2].ravel()  # lowest node of each element
    elements = first[:, None] + ALONG * wide + OUT
    region = np.tile(layers, (long - 1) // 2)
    mesh = Mesh(points.reshape(-1, 2), elements, region, number[skin, -1].copy(), held)
    jacobians(mesh, _CHECKED)  # raises where an element is folded
    return mesh


_CHECKED = np.concatenate([Q2P1.points, Q2P1.corners])


def quality(mesh: Mesh) -> dict[str, float]:
    """Return the least ratio of smallest to largest Jacobian in an element, and the largest aspect ratio.

    Raises MeshError where the Jacobian is not positive at a corner or quadrature point: the element is folded.
    """
    jacobian, det = jacobians(mesh, _CHECKED)
    sides = np.linalg.norm(jacobian, axis=-2)  # lengths of the two tangents
    aspect = np.maximum(sides[..., 0] / sides[..., 1], sides[..., 1] / sides[..., 0])
    return {"jacobian_ratio": float((det.min(axis=1) / det.max(axis=1)).min()), "aspect": float(aspect.max())}


def jacobians(mesh: Mesh, points: Array) -> tuple[Array, Array]:
    """Return the Jacobians (e, p, 2, 2) of all elements at local `points` (p, 2), and their determinants.

    Raises MeshError where a determinant is not positive: the element is folded there.
    """
    jacobian = np.swapaxes(np.tensordot(mesh.local(mesh.nodes), Q2P1.shape(points)[1], axes=(1, 1)), 1, 2)
    det = determinant(jacobian)
    if not det.min() > 0.0:
        worst = mesh.nodes[mesh.elements[int(det.min(axis=1).argmin()), 8]]
        raise MeshError(f"an element of the mesh is folded, near x = {worst[0]:.3g}, y = {worst[1]:.3g} mm")
    return jacobian, det


@lru_cache(maxsize=4)  # consecutive bodies often share a mesh and differ in materials
def integrals(mesh: Mesh) -> tuple[Array, ...]:
    """Return gradients along x and y, weights, modes, Laplacian, centre and combination of the elements of `mesh`.

    The first five are as in `arrays.ElementArrays`. The centre (e, 2) and combination (e, 3, 3) define the modes: 1, x,
    y about the centre, made orthonormal by the Cholesky factor of their mass matrix. Raises MeshError where an element
    is folded.
    """
    jacobian, det = jacobians(mesh, Q2P1.points)
    values, slopes = Q2P1.shape(Q2P1.points)
    by_local = inverse(jacobian)[..., None]  # (e, q, 2, 2, 1) derivatives of local coordinates: d/dx, d/dy
    xi, eta = np.ascontiguousarray(np.moveaxis(slopes, 2, 0))  # (9, 9) each
    grad_x, grad_y = (by_local[:, :, 0, k] * xi + by_local[:, :, 1, k] * eta for k in (0, 1))
    points = values @ mesh.local(mesh.nodes)
    weight, centre = det * Q2P1.weights, points.mean(axis=1)
    affine = np.concatenate([np.ones((*det.shape, 1)), points - centre[:, None]], axis=2)  # (e, q, 3)
    weights = weight[:, :, None]
    mass: Array = np.swapaxes(affine, 1, 2) @ (weights * affine)
    combination = np.asarray(np.linalg.inv(np.linalg.cholesky(mass)), np.float64)
    laplace = np.swapaxes(grad_x, 1, 2) @ (weights * grad_x) + np.swapaxes(grad_y, 1, 2) @ (weights * grad_y)
    return grad_x, grad_y, weight, affine @ np.swapaxes(combination, 1, 2), laplace, centre, combination


def local_coordinates(corners: Array, points: Array, start: Array) -> Array:
    """Return the local coordinates (p, 2) of `points` (p, 2) in elements with nodes `corners` (p, 9, 2), by Newton."""
    local: NDArray[np.float64] = start.copy()
    for _ in range(8):
        values, slopes = Q2P1.shape(local)
        residual = points - (values[:, None] @ corners)[:, 0]
        step = np.einsum("pab,pb->pa", inverse(np.swapaxes(corners, 1, 2) @ slopes), residual)
        local += step
        if np.abs(step).max(initial=0.0) < 1e-7:  # the remaining error is of the order of this step squared
            break
    return local


def block(x_lines: Array, y_lines: Array, radius: float = np.inf, *, held: bool = True) -> Mesh:
    """Return a block on the surface, with lines between elements at `x_lines` and `y_lines` (from 0 up) [mm].

    Its underside may touch: it is flat, or a circle of `radius` [mm] that touches the surface at x = 0. With `held`,
    its top is driven, otherwise no node is.
    """
    x, y = with_middles(x_lines), with_middles(y_lines)[::-1]
    bottom = 0.0 * x if np.isinf(radius) else radius - np.sqrt(radius**2 - x**2)
    part = y / y[0]
    points = np.empty((len(x), len(y), 2))
    points[..., 0] = x[:, None]
    points[..., 1] = bottom[:, None] * (1.0 - part) + y[0] * part
    top = np.arange(len(x)) * len(y)
    return grid_mesh(points, np.zeros(len(y) // 2, np.int64), slice(0, len(x)), top if held else top[:0])


def with_middles(lines: Array) -> Array:
    """Return the lines with an additional one in the middle of each gap."""
    out = np.empty(2 * len(lines) - 1)
    out[::2], out[1::2] = lines, (lines[1:] + lines[:-1]) / 2.0
    return out


@dataclass(frozen=True, slots=True)
class Lines:
    """Positions of the lines between a finger's elements, in the order of nodes: proximal to distal, and outwards."""

    arcs: tuple[float, ...]  # arc positions of the lines across the tissue [mm]
    bone: tuple[float, ...]  # radii of the lines along a meshed bone, from the core to 1, the bone's radius; or empty
    fat: tuple[float, ...]  # heights in the fat, from 0 on the bone to 1
    skin: tuple[float, ...]  # depths in the skin, the outermost last [mm]

    @property
    def rows(self) -> int:
        """Number of elements across the tissue."""
        return max(len(self.bone) - 1, 0) + len(self.fat) + len(self.skin) - 2

    def columns(self, arcs: Array) -> Indices:
        """Return the number of the column that holds each of the `arcs` [mm]; beyond the tissue, of the one next to it.

        >>> Lines((0.0, 1.0, 3.0), (), (0.0, 1.0), (1.0, 0.0)).columns(np.array([-1.0, 0.5, 2.0, 4.0]))
        array([0, 0, 1, 1])
        """
        return np.searchsorted(self.arcs[1:-1], arcs)

    def divide(self, columns: Indices, rows: Indices) -> "Lines":
        """Return the lines with each gap divided equally: into `columns` (a,) and `rows` (b,) parts."""
        bone, fat = max(len(self.bone) - 1, 0), len(self.fat) - 1
        return Lines(
            _divide(self.arcs, columns),
            _divide(self.bone, rows[:bone]),
            _divide(self.fat, rows[bone : bone + fat]),
            _divide(self.skin, rows[bone + fat :]),
        )


Fineness = float | Lines  # of a finger's mesh: elements per tip radius, or the lines themselves


def _divide(lines: tuple[float, ...], parts: Indices) -> tuple[float, ...]:
    gaps = zip(pairwise(lines), parts.tolist(), strict=True)
    return (*(a + (b - a) * part / count for (a, b), count in gaps for part in range(count)), *lines[-1:])


# A divided element has 5 x 5 nodes, numbered along its first direction, then up: positions of its original nine
_OWN: Indices = np.round(2.0 * (Q2P1.positions + 1.0) @ [1.0, 5.0]).astype(np.int64)
_LOCAL = np.stack([np.tile(np.linspace(-1.0, 1.0, 5), 5), np.repeat(np.linspace(-1.0, 1.0, 5), 5)], axis=-1)
_SIDES: Indices = np.array([[0, 4, 1], [1, 5, 2], [2, 6, 3], [3, 7, 0]])  # end, middle and end of an element's sides
_QUARTERS: Indices = np.array([[0, 2, 10, 12]]).T + _OWN // 5 // 2 * 5 + _OWN % 5 // 2  # (4, 9) of the 5 x 5 nodes
_VALUES = Q2P1.shape(_LOCAL)[0]  # (25, 9)


@dataclass(frozen=True, slots=True, eq=False)
class HalvedMesh:
    """A mesh nested in a coarse one, whose nodes keep their numbers."""

    mesh: Mesh
    _coarse: Mesh
    _pairs: Indices  # (q,) keys of the half sides with a new node, from its end and middle, in ascending order
    _new: Array  # (m, 9) coarse shape functions at each new node
    _of: Indices  # (m,) coarse element of each new node

    @staticmethod
    def of(mesh: Mesh) -> "HalvedMesh":
        """Divide every element of a mesh in four."""
        count, elements = len(mesh.nodes), mesh.elements
        grid: Indices = np.full((len(elements), 25), -1, np.int64)
        grid[:, _OWN] = elements
        ends = [(side[end], side[1]) for side in _SIDES for end in (0, 2)]
        places: Indices = np.array([(_OWN[end_node] + _OWN[middle]) // 2 for end_node, middle in ends])
        keys = np.stack([_pair(elements[:, end_node], elements[:, middle], count) for end_node, middle in ends], axis=1)
        pairs, first, number = np.unique(keys, return_index=True, return_inverse=True)
        grid[:, places] = count + number.reshape(keys.shape)
        inner = np.flatnonzero(grid[0] < 0)
        grid[:, inner] = count + len(pairs) + np.arange(grid[:, inner].size).reshape(len(elements), -1)
        host = np.concatenate([first // len(ends), np.repeat(np.arange(len(elements)), len(inner))])
        local_number = np.concatenate([places[first % len(ends)], np.tile(inner, len(elements))])
        new = _VALUES[local_number]
        # A new node is driven if all nodes of its side, or of its element, are.
        held = mesh.driven[elements[host]] | (new == 0.0)[..., None]
        x, y = np.concatenate([mesh.driven, held.all(axis=1)]).T
        nodes = np.concatenate([mesh.nodes, np.einsum("mn,mnd->md", new, mesh.nodes[elements[host]])])
        halved = Mesh(
            nodes,
            grid[:, _QUARTERS].reshape(-1, 9),
            np.repeat(mesh.region, 4),
            _refine_chain(mesh.skin, pairs, count),
            *(np.flatnonzero(which) for which in (x & y, x & ~y, y & ~x)),
        )
        return HalvedMesh(halved, mesh, pairs, new, host)

    def chain(self, nodes: Indices) -> Indices:
        """Return a chain of edges (2 k + 1,) of the coarse mesh, end, middle, ... end, with its new nodes."""
        return _refine_chain(nodes, self._pairs, len(self._coarse.nodes))

    def between(self, values: Array) -> Array:
        """Return nodal values (n, ...) of the coarse mesh, then those interpolated at the new nodes."""
        local = values[self._coarse.elements[self._of]]
        return np.concatenate([values, np.einsum("mn,mn...->m...", self._new, local)])


def _pair(end: Indices, middle: Indices, count: int) -> Indices:
    return end * count + middle


def _refine_chain(nodes: Indices, pairs: Indices, count: int) -> Indices:
    """Return a chain of nodes (2 k + 1,) with the new nodes between them."""
    ends, middles = nodes[:-1].copy(), nodes[1:].copy()
    ends[1::2], middles[1::2] = nodes[2::2], nodes[1::2]
    out = np.empty(max(2 * len(nodes) - 1, 0), np.int64)
    out[::2], out[1::2] = nodes, count + np.searchsorted(pairs, _pair(ends, middles, count))
    return out


ELEMENTS = (Q2P1,)
