"""The order of elimination of a body's inner unknowns, down to those of its skin: nested dissection.

Elements are halved again and again by their position; the unknowns inside each part are eliminated, the parts are
joined, and so on up the tree (George 1973, SIAM J. Numer. Anal. 10, 345; Duff and Reid 1983, ACM TOMS 9, 302). What
is left is the stiffness of the skin alone (Schur complement), exact, and contact is solved with that small dense
matrix. The work grows like unknowns^1.5.
"""

from dataclasses import dataclass

import numpy as np

from solver.arrays import Array, Indices
from solver.mesh import distinct


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A part of the body: which unknowns it eliminates, which it passes on, and where its children's go."""

    inner: Indices  # (k,) unknowns eliminated here
    border: Indices  # (b,) unknowns passed on
    children: tuple[int, ...]  # numbers of parts joined here, none for a leaf
    elements: slice  # leaf: its elements, in the order of `Tree.order`


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """The order of elimination of one mesh."""

    order: Indices  # (e,) elements, leaf after leaf
    parts: tuple[Part, ...]  # children before parents; the last one is the whole body
    kept: Indices  # (m,) unknowns never eliminated, in the order asked for
    size: int  # number of unknowns, fixed ones included

    @staticmethod
    def of(elements: Indices, centres: Array, fixed: Indices, kept: Indices, leaf: int) -> "Tree":
        """Plan the elimination for `elements` (e, n) of unknowns at `centres` (e, 2), at most `leaf` in a leaf.

        Unknowns in `fixed` take no part (their displacement is zero); those in `kept` are passed on to the end.
        """
        order, ranges, children = _halved(centres, leaf)
        position = np.empty(len(order), np.int64)
        position[order] = np.arange(len(order))
        size = int(elements.max()) + 1
        first = np.full(size, len(order))
        last = np.full(size, -1)
        spread = np.repeat(position, elements.shape[1])
        np.minimum.at(first, elements.ravel(), spread)
        np.maximum.at(last, elements.ravel(), spread)
        last[kept] = len(order)  # never complete
        free = np.ones(size, bool)
        free[fixed] = False
        parts: list[Part] = []
        for (low, high), below in zip(ranges, children, strict=True):
            mine = elements[order[low:high]]
            met = mine.ravel() if not below else np.concatenate([parts[c].border for c in below])
            met = distinct(met)
            met = met[free[met]]
            complete = (first[met] >= low) & (last[met] < high)
            inner, border = met[complete], met[~complete]
            if high - low == len(order):
                border = kept
            parts.append(Part(inner, border, below, slice(low, high)))
        return Tree(order, tuple(parts), kept, size)


def _halved(centres: Array, leaf: int) -> tuple[Indices, list[tuple[int, int]], list[tuple[int, ...]]]:
    """Return an order of elements, the range of each part in it, and each part's children; children come first."""
    order = np.arange(len(centres))
    ranges: list[tuple[int, int]] = []
    children: list[tuple[int, ...]] = []

    def halve(low: int, high: int) -> int:
        below: tuple[int, ...] = ()
        if high - low > leaf:
            mine = order[low:high]
            along = int(np.argmax(np.ptp(centres[mine], axis=0)))
            order[low:high] = mine = mine[np.argsort(centres[mine, along], kind="stable")]
            # between two rows or columns: a cut with a step in it runs past more nodes
            cuts = low + 1 + np.flatnonzero(np.diff(centres[mine, along]))
            middle = int(cuts[np.abs(2 * cuts - low - high).argmin()]) if len(cuts) else (low + high) // 2
            below = (halve(low, middle), halve(middle, high))
        ranges.append((low, high))
        children.append(below)
        return len(ranges) - 1

    halve(0, len(centres))
    return order, ranges, children


def places(elements: Indices) -> Array:
    """Return where elements (e, 9) stand in rows and columns (e, 2), read off their neighbours.

    In a body much longer than it is thick, or bent like a finger, halves cut by rows and columns share far fewer nodes
    than halves cut along x or y. Where a mesh has no rows and columns the numbers still say what lies near what.
    """
    count = len(elements)
    sides = elements[:, 4:8].ravel()  # each mid-side node is met by two elements at most
    order = np.argsort(sides, kind="stable")
    twice = np.flatnonzero(sides[order][1:] == sides[order][:-1])
    beside = np.full(4 * count, -1)
    beside[order[twice]], beside[order[twice + 1]] = order[twice + 1] // 4, order[twice] // 4
    beside = beside.reshape(count, 4)
    ways = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    out = np.full((count, 2), np.nan)
    for seed in range(count):
        if not np.isnan(out[seed, 0]):
            continue
        out[seed] = 0.0
        edge = np.array([seed])
        while len(edge):
            near = beside[edge]
            new = (near >= 0) & np.isnan(out[near, 0])
            out[near[new]] = (out[edge][:, None] + ways)[new]
            edge = distinct(near[new])
    return out
