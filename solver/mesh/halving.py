"""Any mesh with every element divided in four, by its own quadratic geometry: the finer mesh is nested in it."""

from dataclasses import dataclass

import numpy as np

from solver.arrays import Array, Flags, Indices
from solver.element import Q2P1
from solver.mesh.mesh import Mesh

# A divided element has 5 x 5 nodes, numbered along its first direction, then up: here those of the element's own nine
_OWN: Indices = np.round(2.0 * (Q2P1.positions + 1.0) @ [1.0, 5.0]).astype(np.int64)
_LOCAL = np.stack([np.tile(np.linspace(-1.0, 1.0, 5), 5), np.repeat(np.linspace(-1.0, 1.0, 5), 5)], axis=-1)
_SIDES: Indices = np.array([[0, 4, 1], [1, 5, 2], [2, 6, 3], [3, 7, 0]])  # end, middle and end of an element's sides
_QUARTERS: Indices = np.array([[0, 2, 10, 12]]).T + _OWN // 5 // 2 * 5 + _OWN % 5 // 2  # (4, 9) of the 5 x 5 nodes
_VALUES = Q2P1.shape(_LOCAL)[0]  # (25, 9)


@dataclass(frozen=True, slots=True, eq=False)
class HalvedMesh:
    """A mesh, nested in the one that it was made of; nodes of that keep their numbers."""

    mesh: Mesh
    _coarse: Mesh
    _pairs: Indices  # (q,) end and middle of the half sides that have a new node, as one number, in order
    _new: Array  # (m, 9) shape functions of each new node's element there
    _of: Indices  # (m,) that element

    @staticmethod
    def of(mesh: Mesh) -> "HalvedMesh":
        """Divide every element of a mesh."""
        count, elements = len(mesh.nodes), mesh.elements
        grid: Indices = np.full((len(elements), 25), -1, np.int64)
        grid[:, _OWN] = elements
        ends = [(side[end], side[1]) for side in _SIDES for end in (0, 2)]
        places: Indices = np.array([(_OWN[one] + _OWN[other]) // 2 for one, other in ends])
        keys = np.stack([_pair(elements[:, one], elements[:, other], count) for one, other in ends], axis=1)
        pairs, first, number = np.unique(keys, return_index=True, return_inverse=True)
        grid[:, places] = count + number.reshape(keys.shape)
        inner = np.flatnonzero(grid[0] < 0)
        grid[:, inner] = count + len(pairs) + np.arange(grid[:, inner].size).reshape(len(elements), -1)
        of = np.concatenate([first // len(ends), np.repeat(np.arange(len(elements)), len(inner))])
        at = np.concatenate([places[first % len(ends)], np.tile(inner, len(elements))])
        new = _VALUES[at]
        # A new node is held where all nodes are that it lies between: of its side, or of its element.
        held = mesh.driven[elements[of]] | (new == 0.0)[..., None]
        driven = np.concatenate([mesh.driven, held.all(axis=1)])
        nodes = np.concatenate([mesh.nodes, np.einsum("mn,mnd->md", new, mesh.nodes[elements[of]])])
        made = Mesh(
            nodes,
            grid[:, _QUARTERS].reshape(-1, 9),
            np.repeat(mesh.region, 4),
            _chained(mesh.skin, pairs, count),
            *_by_axis(driven),
        )
        return HalvedMesh(made, mesh, pairs, new, of)

    def chain(self, nodes: Indices) -> Indices:
        """Return a chain of edges (2 k + 1,) of the coarse mesh, end, middle, ... end, with its new nodes."""
        return _chained(nodes, self._pairs, len(self._coarse.nodes))

    def between(self, values: Array) -> Array:
        """Return nodal values (n, ...) of the coarse mesh with those of new nodes, interpolated in their elements."""
        local = values[self._coarse.elements[self._of]]
        return np.concatenate([values, np.einsum("mn,mn...->m...", self._new, local)])


def _pair(end: Indices, middle: Indices, count: int) -> Indices:
    return end * count + middle


def _chained(nodes: Indices, pairs: Indices, count: int) -> Indices:
    """Return a chain of nodes (2 k + 1,) with the new one between each two of them."""
    ends, middles = nodes[:-1].copy(), nodes[1:].copy()
    ends[1::2], middles[1::2] = nodes[2::2], nodes[1::2]
    out = np.empty(max(2 * len(nodes) - 1, 0), np.int64)
    out[::2], out[1::2] = nodes, count + np.searchsorted(pairs, _pair(ends, middles, count))
    return out


def _by_axis(driven: Flags) -> tuple[Indices, Indices, Indices]:
    """Return the nodes held both ways, along x alone and along y alone, of flags (n, 2)."""
    x, y = driven.T
    return np.flatnonzero(x & y), np.flatnonzero(x & ~y), np.flatnonzero(y & ~x)
