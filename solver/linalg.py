"""Elimination order of a body's inner unknowns, down to those of its skin: nested dissection.

Elements are bisected by position again and again. The unknowns inside each part are eliminated, then the parts are
joined, and so on up the tree (George 1973, SIAM J. Numer. Anal. 10, 345; Duff and Reid 1983, ACM TOMS 9, 302). The
result is the exact Schur complement, the stiffness condensed to the skin. Contact is solved with this small dense
matrix. The work grows like unknowns^1.5.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from solver._kernels import multifrontal
from solver._kernels.compiling import bind_arguments
from solver.arrays import Array, Factors, Flags, Indices, Narrow, SymbolicFactorization
from solver.mesh import Mesh, distinct


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A part of the body: the unknowns that it eliminates and those that it passes on."""

    inner: Indices  # (k,) unknowns eliminated here
    border: Indices  # (b,) unknowns passed on
    children: tuple[int, ...]  # numbers of the parts joined here, none for a leaf
    elements: slice  # of a leaf: its elements, in the order of `Tree.order`


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """Elimination order of one mesh."""

    order: Indices  # (e,) elements, leaf after leaf
    parts: tuple[Part, ...]  # children before parents; the last one is the whole body
    interface: Indices  # (m,) unknowns never eliminated, in the order given
    size: int  # number of unknowns, fixed ones included

    @staticmethod
    def of(elements: Indices, centres: Array, fixed: Indices, interface: Indices, leaf: int) -> "Tree":
        """Plan the elimination for `elements` (e, n) of unknowns at `centres` (e, 2), at most `leaf` elements a leaf.

        Unknowns in `fixed` have zero displacement and take no part. Those in `interface` are passed on to the end.
        """
        order, ranges, children = _bisect(centres, leaf)
        position = np.empty(len(order), np.int64)
        position[order] = np.arange(len(order))
        size = int(elements.max()) + 1
        first = np.full(size, len(order))
        last = np.full(size, -1)
        spread = np.repeat(position, elements.shape[1])
        np.minimum.at(first, elements.ravel(), spread)
        np.maximum.at(last, elements.ravel(), spread)
        last[interface] = len(order)  # never complete
        free = np.ones(size, bool)
        free[fixed] = False
        parts: list[Part] = []
        for (low, high), below in zip(ranges, children, strict=True):
            own = elements[order[low:high]]
            unknowns = own.ravel() if not below else np.concatenate([parts[c].border for c in below])
            unknowns = distinct(unknowns)
            unknowns = unknowns[free[unknowns]]
            complete = (first[unknowns] >= low) & (last[unknowns] < high)
            inner, border = unknowns[complete], unknowns[~complete]
            if high - low == len(order):
                border = interface
            parts.append(Part(inner, border, below, slice(low, high)))
        return Tree(order, tuple(parts), interface, size)


def _bisect(centres: Array, leaf: int) -> tuple[Indices, list[tuple[int, int]], list[tuple[int, ...]]]:
    """Return an order of elements, the range of each part in it, and each part's children; children come first."""
    order = np.arange(len(centres))
    ranges: list[tuple[int, int]] = []
    children: list[tuple[int, ...]] = []

    def halve(low: int, high: int) -> int:
        below: tuple[int, ...] = ()
        if high - low > leaf:
            subset = order[low:high]
            along = int(np.argmax(np.ptp(centres[subset], axis=0)))
            order[low:high] = subset = subset[np.argsort(centres[subset, along], kind="stable")]
            # cut between two rows or columns: the line of a stepped cut has more nodes
            cuts = low + 1 + np.flatnonzero(np.diff(centres[subset, along]))
            middle = int(cuts[np.abs(2 * cuts - low - high).argmin()]) if len(cuts) else (low + high) // 2
            below = (halve(low, middle), halve(middle, high))
        ranges.append((low, high))
        children.append(below)
        return len(ranges) - 1

    halve(0, len(centres))
    return order, ranges, children


def places(elements: Indices) -> Array:
    """Return the row and column (e, 2) of each of the `elements` (e, 9), from their neighbours.

    In a body much longer than it is thick, or bent like a finger, cuts between rows and columns share far fewer nodes
    than cuts along x or y. In a mesh without rows and columns, close elements still get close numbers.
    """
    count = len(elements)
    sides = elements[:, 4:8].ravel()  # at most two elements share a mid-side node
    order = np.argsort(sides, kind="stable")
    twice = np.flatnonzero(sides[order][1:] == sides[order][:-1])
    neighbours = np.full(4 * count, -1)
    neighbours[order[twice]], neighbours[order[twice + 1]] = order[twice + 1] // 4, order[twice] // 4
    neighbours = neighbours.reshape(count, 4)
    ways = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    out = np.full((count, 2), np.nan)
    for seed in range(count):
        if not np.isnan(out[seed, 0]):
            continue
        out[seed] = 0.0
        edge = np.array([seed])
        while len(edge):
            near = neighbours[edge]
            new = (near >= 0) & np.isnan(out[near, 0])
            out[near[new]] = (out[edge][:, None] + ways)[new]
            edge = distinct(near[new])
    return out


LEAF: Final = 8  # most elements in a part that is not bisected


def symbolic_factorization(mesh: Mesh) -> SymbolicFactorization:
    """Plan the elimination of `mesh`, whose element centres are condensed before.

    The plan does not depend on nodal positions: the last plans are kept for meshes that differ only in these.
    """
    return _plan(len(mesh.nodes), mesh.elements.tobytes(), mesh.skin.tobytes(), mesh.fixed.tobytes())


@lru_cache(maxsize=16)  # a search for a tolerance makes 8 plans; room for 4 makes each anew, for 32 gains nothing
def _plan(count: int, *numbers: bytes) -> SymbolicFactorization:
    """Return the plan for `count` nodes; `numbers` are bytes: element nodes (e, 9), skin nodes, fixed unknowns."""
    elements, skin_nodes, fixed = (np.frombuffer(part, np.int64) for part in numbers)
    elements = elements.reshape(-1, 9)
    raw = (2 * elements[:, :8, None] + np.arange(2)).reshape(-1, 16)
    skin = (2 * skin_nodes[:, None] + np.arange(2)).ravel()
    tree = Tree.of(raw, places(elements), fixed, skin, LEAF)
    number = np.full(2 * count, -1)
    sequence = np.concatenate([*(part.inner for part in tree.parts), skin])
    number[sequence] = np.arange(len(sequence))
    total = len(sequence)
    borders = [np.sort(number[part.border]) for part in tree.parts]
    inner = np.array([len(part.inner) for part in tree.parts])
    border = np.array([len(b) for b in borders])
    start = np.concatenate([[0], np.cumsum(inner)[:-1]])
    border_at = np.concatenate([[0], np.cumsum(border)[:-1]])
    place = np.zeros(int(border.sum()), np.int32)
    children = np.full((len(border), 2), -1)
    leaf = np.zeros((len(border), 2), np.int64)
    at = np.full((len(tree.order), 16), -1)
    where = np.full(total + 1, -1)  # index -1, the number of fixed unknowns, is the last place
    number[fixed] = -1
    for p, part in enumerate(tree.parts):
        where[start[p] : start[p] + inner[p]] = np.arange(inner[p])
        where[borders[p]] = inner[p] + np.arange(border[p])
        if part.children:
            children[p] = part.children
            for child in part.children:
                place[border_at[child] : border_at[child] + border[child]] = where[borders[child]]
        else:
            leaf[p] = part.elements.start, part.elements.stop
            at[part.elements] = where[number[raw[tree.order[part.elements]]]]
    sizes = inner * (inner + border)
    wait_at, waiting = _waiting(children, border)
    return SymbolicFactorization(
        unknown=_narrow(number[raw]),
        size=total,
        start=_narrow(start),
        inner=_narrow(inner),
        border=_narrow(border),
        children=_narrow(children),
        border_at=_narrow(border_at),
        numbers=_narrow(np.concatenate(borders)),
        place=place,
        run=_narrow(_runs(place, border)),
        factor_at=np.cumsum(sizes) - sizes,
        wait_at=wait_at,
        leaf=_narrow(leaf),
        order=_narrow(tree.order),
        at=_narrow(at),
        factors=int(sizes.sum()),
        waiting=waiting,
    )


def _narrow(numbers: Indices) -> Narrow:
    return numbers.astype(np.int32)


def _runs(place: Narrow, border: Indices) -> Indices:
    """Return, for each unknown of each border, where in that border its run of consecutive positions ends."""
    number = np.arange(len(place))
    owner = np.repeat(np.arange(len(border)), border)
    last = np.ones(len(place), bool)
    last[:-1] = (np.diff(place) != 1) | (np.diff(owner) != 0)
    ends = np.flatnonzero(last)
    return ends[np.searchsorted(ends, number)] + 1 - np.repeat(np.cumsum(border) - border, border)


def _waiting(children: Indices, border: Indices) -> tuple[Indices, int]:
    """Return where each part's Schur complement waits for its parent, and the size of the memory for all.

    Each level of the tree has a place for a first and a second child.
    """
    level = np.zeros(len(border), np.int64)
    second = np.zeros(len(border), np.int64)
    for p in range(len(border) - 1, -1, -1):
        for turn, child in enumerate(children[p]):
            if child >= 0:
                level[child], second[child] = level[p] + 1, turn
    slot = 2 * level + second
    room = np.zeros(int(slot.max()) + 1, np.int64)
    np.maximum.at(room, slot, border * border)
    return (np.cumsum(room) - room)[slot], int(room.sum())


class ElementSubset(NamedTuple):
    """Elements whose displacements are recovered."""

    parts: Flags  # (p,) of the elimination that hold their unknowns
    nodes: Narrow  # (e, 9)
    unknown: Narrow  # (e, 8, 2)
    recovery_matrix: Array  # (e, 2, 16): displacement of the centre = -(recovery_matrix @ outer displacements)


class Elimination:
    """Elimination of one body's tangent down to its skin, with its own memory."""

    def __init__(self, plan: SymbolicFactorization) -> None:
        """Allocate memory for `plan`."""
        skin = int(plan.border[-1])
        self.plan = plan
        self.stiffness = np.zeros((skin, skin))  # the tangent's Schur complement
        values, near = np.empty(plan.factors), np.empty(int((plan.inner + plan.border).max()))
        factors = Factors(
            plan.start, plan.inner, plan.border, plan.border_at, plan.numbers, plan.factor_at, values, near
        )
        self._every = np.ones(len(plan.start), bool)
        self._eliminate = bind_arguments(multifrontal.eliminate, plan, values, np.empty(plan.waiting), self.stiffness)
        self._condense = bind_arguments(multifrontal.condense, factors)
        self._back_substitute = bind_arguments(multifrontal.back_substitute, factors)
        self._displace = bind_arguments(multifrontal.displace, factors)

    def factorise(self, tangent: Array) -> int:
        """Eliminate the element tangents (e, 16, 16), lower halves; return UNSOLVABLE, INDEFINITE or DEFINITE."""
        return self._eliminate(tangent)

    def condense(self, force: Array) -> Array:
        """Condense `force` (n,) in place for `back_substitute`; return its end (m,), the force on the skin."""
        self._condense(force)
        return force[self.plan.size - len(self.stiffness) :]

    def parts_holding(self, unknowns: Narrow) -> Flags:
        """Return the parts (p,) that recover the displacements of some `unknowns`, where -1 stands for a fixed one."""
        plan = self.plan
        part = np.full(plan.size + 1, len(plan.inner))  # the last entry stands for no part
        part[: -len(self.stiffness) - 1] = np.repeat(np.arange(len(plan.inner)), plan.inner)
        out = np.zeros(len(plan.inner) + 1, bool)
        out[part[unknowns]] = True
        out[-1] = False
        for p, (first, second) in enumerate(plan.children.tolist()):
            out[p] |= out[first] or out[second]
        return out[:-1]

    def back_substitute(self, condensed_force: Array, skin: Array) -> Array:
        """Return all displacements (n,) for the skin's (m,) under a `condensed_force` (n,)."""
        out = np.empty(self.plan.size)
        self._back_substitute(condensed_force, np.ascontiguousarray(skin), self._every, out)
        return out

    def displace(self, condensed_force: Array, skin: Array, subset: ElementSubset, out: Array) -> None:
        """Fill `out` (nodes, 2, c) with the displacements of a `subset` of elements for the skin's (c, m).

        `condensed_force` (n,) is the result of `condense`.
        """
        self._displace(condensed_force, np.ascontiguousarray(skin), *subset, out)
