"""Elimination of a body's inner unknowns by nested dissection, down to the unknowns of its skin.

Elements are halved again and again by their position; the unknowns inside each part are eliminated, the parts are
joined, and so on up the tree (George 1973, SIAM J. Numer. Anal. 10, 345; Duff and Reid 1983, ACM TOMS 9, 302). What
is left is the stiffness of the skin alone (Schur complement), exact, and from it contact is solved with a small dense
matrix. The work grows like unknowns^1.5. Only dense LAPACK is used, no pivoting between parts: the inner stiffness of
an elastic body whose skin is kept is positive definite.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError

from solver.linalg.lapack import dposv, dpotrs
from solver.mesh import Array, Indices, distinct

LEAF = 12  # elements in a part that is not halved any more: fewer means more Python, more means more arithmetic


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A part of the body: which unknowns it eliminates, which it passes on, and where its children's go."""

    inner: Indices  # (k,) unknowns eliminated here
    border: Indices  # (b,) unknowns passed on
    children: tuple[int, ...]  # numbers of parts joined here, none for a leaf
    places: tuple[Indices, ...]  # for each child: position in (inner, border) of each of its border unknowns
    spots: tuple[Indices, ...]  # for each child: flat positions in the (k + b)^2 matrix of what it passes on
    entries: Indices  # leaf: flat positions in the (k + b)^2 matrix of its elements' entries; trash at the end
    elements: slice  # leaf: its elements, in the order of `Tree.order`


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """The order of elimination of one mesh."""

    order: Indices  # (e,) elements, leaf after leaf
    parts: tuple[Part, ...]  # children before parents; the last one is the whole body
    kept: Indices  # (m,) unknowns never eliminated, in the order asked for
    size: int  # number of unknowns, fixed ones included

    @staticmethod
    def of(
        elements: Indices, centres: Array, fixed: Indices, kept: Indices, leaf: int = LEAF, *, flat: bool = True
    ) -> "Tree":
        """Plan the elimination for `elements` (e, n) of unknowns at `centres` (e, 2), at most `leaf` in a leaf.

        Unknowns in `fixed` take no part (their displacement is zero); those in `kept` are passed on to the end. Without
        `flat` the flat positions that `Reduced` needs are left out.
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
        where = np.empty(size, np.int64)
        for (low, high), below in zip(ranges, children, strict=True):
            mine = elements[order[low:high]]
            met = mine.ravel() if not below else np.concatenate([parts[c].border for c in below])
            met = distinct(met)
            met = met[free[met]]
            complete = (first[met] >= low) & (last[met] < high)
            inner, border = met[complete], met[~complete]
            if high - low == len(order):
                border = kept
            total = len(inner) + len(border)
            where[inner] = np.arange(len(inner))
            where[border] = np.arange(len(inner), total)
            places = tuple(where[parts[c].border] for c in below)
            spots = tuple((place[:, None] * total + place).ravel() for place in places) if flat else ()
            entries = np.empty(0, np.int64)
            if flat and not below:
                at = np.where(free[mine], where[mine], -1)
                both = (at[:, :, None] >= 0) & (at[:, None, :] >= 0)
                entries = np.where(both, at[:, :, None] * total + at[:, None, :], total * total).ravel()
            parts.append(Part(inner, border, below, places, spots, entries, slice(low, high)))
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


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """A body reduced to its kept unknowns."""

    tree: Tree
    stiffness: Array  # (m, m) of the kept unknowns
    load: Array  # (m, l) dead loads as the kept unknowns feel them
    _follow: tuple[Array, ...]  # per part (k, b): inner unknowns = own - follow @ border unknowns
    _own: tuple[Array, ...]  # per part (k, l): inner unknowns under the loads alone
    _factors: tuple[Array, ...]  # per part (k, k): Cholesky factor of the inner unknowns' stiffness

    @staticmethod
    def of(tree: Tree, stiffness: Array, loads: Array | None = None) -> "Reduced":
        """Eliminate, given the elements' `stiffness` (e, n, n) and `loads` (size, l) on the unknowns.

        Raises LinAlgError where the inner stiffness is not positive definite.
        """
        loaded = loads is not None
        loads = np.zeros((tree.size, 0)) if loads is None else loads
        follow: list[Array] = []
        own: list[Array] = []
        factors: list[Array] = []
        passed: list[tuple[Array, Array] | None] = []
        for part in tree.parts:
            k, total = len(part.inner), len(part.inner) + len(part.border)
            force = np.zeros((total, loads.shape[1]))
            force[:k] = loads[part.inner]
            if part.children:
                flat = np.zeros(total * total)
                for child, place, spots in zip(part.children, part.places, part.spots, strict=True):
                    below = passed[child]
                    assert below is not None  # children come first, and each has one parent
                    flat[spots] += below[0].ravel()
                    if loaded:
                        force[place] += below[1]
                    passed[child] = None
            else:
                values = stiffness[tree.order[part.elements]].ravel()
                flat = np.bincount(part.entries, values, total * total + 1).astype(np.float64, copy=False)[:-1]
            matrix = flat.reshape(total, total)
            right = np.concatenate([matrix[:k, k:], force[:k]], axis=1) if loaded else matrix[:k, k:]
            factor, solution = _solved(matrix[:k, :k], right)
            factors.append(factor)
            own.append(solution[:, total - k :])
            follow.append(solution[:, : total - k])
            left = force[k:] - matrix[k:, :k] @ own[-1] if loaded else force[k:]
            passed.append((matrix[k:, k:] - matrix[k:, :k] @ follow[-1], left))
        assert passed[-1] is not None
        root, load = passed[-1]
        return Reduced(tree, (root + root.T) / 2.0, load + loads[tree.kept], tuple(follow), tuple(own), tuple(factors))

    def all_unknowns(self, kept: Array, loaded: bool = False, only: Indices | None = None) -> Array:
        """Return all unknowns (size, c) for the kept ones (m, c): fixed ones 0; with the dead loads where `loaded`.

        With `only` (unknowns), parts that these do not need are left at 0.
        """
        out = np.zeros((self.tree.size, kept.shape[1]))
        out[self.tree.kept] = kept
        needed = self._needed(only)
        for number in range(len(self.tree.parts) - 1, -1, -1):
            if needed is not None and not needed[number]:
                continue
            part = self.tree.parts[number]
            inner = -(self._follow[number] @ out[part.border])
            out[part.inner] = inner + self._own[number].sum(axis=1, keepdims=True) if loaded else inner
        return out

    def condensed(self, load: Array) -> tuple[Array, Callable[[Array], Array]]:
        """Return what the kept unknowns feel (m,) of a `load` (size,), and what makes all unknowns of them.

        Those (size,) are then under that load.
        """
        passed = load.copy()
        for part, follow in zip(self.tree.parts, self._follow, strict=True):
            passed[part.border] -= follow.T @ passed[part.inner]
        return passed[self.tree.kept], lambda kept: self._recovered(kept, passed)

    def _recovered(self, kept: Array, passed: Array) -> Array:
        """Return all unknowns (size,) for the kept ones (m,), under the load that was condensed to `passed`."""
        out = np.zeros(self.tree.size)
        out[self.tree.kept] = kept
        for number in range(len(self.tree.parts) - 1, -1, -1):
            part, factor = self.tree.parts[number], self._factors[number]
            if len(part.inner):
                own = dpotrs(factor, passed[part.inner][:, None])[0][:, 0]
                out[part.inner] = own - self._follow[number] @ out[part.border]
        return out

    def _needed(self, only: Indices | None) -> list[bool] | None:
        """Return which parts must be unfolded to know the unknowns `only`; None for all."""
        if only is None:
            return None
        wanted = np.zeros(self.tree.size, bool)
        wanted[only] = True
        needed: list[bool] = []
        for part in self.tree.parts:
            needed.append(any(needed[c] for c in part.children) or bool(wanted[part.inner].any()))
        return needed


def _solved(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Return the Cholesky factor (k, k) and the solution (k, c) of a symmetric positive definite system."""
    if not len(matrix):
        return matrix, right
    factor, solution, bad = dposv(matrix.T, right)
    if bad:
        raise LinAlgError("the stiffness inside the body is not positive definite")
    return np.asarray(factor, np.float64), np.asarray(solution, np.float64)
