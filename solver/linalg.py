"""The order of elimination of a body's inner unknowns, down to those of its skin: nested dissection.

Elements are halved again and again by their position; the unknowns inside each part are eliminated, the parts are
joined, and so on up the tree (George 1973, SIAM J. Numer. Anal. 10, 345; Duff and Reid 1983, ACM TOMS 9, 302). What
is left is the stiffness of the skin alone (Schur complement), exact, and contact is solved with that small dense
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
        order, ranges, children = _bisect(centres, leaf)
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


def _bisect(centres: Array, leaf: int) -> tuple[Indices, list[tuple[int, int]], list[tuple[int, ...]]]:
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


LEAF: Final = 8  # elements in a part that is not halved any more


def symbolic_factorization(mesh: Mesh) -> SymbolicFactorization:
    """Plan the elimination of `mesh`, the centres of its elements already eliminated inside them.

    It does not depend on where nodes lie, so the last ones are kept for meshes that differ in nothing else.
    """
    return _plan(len(mesh.nodes), mesh.elements.tobytes(), mesh.skin.tobytes(), mesh.fixed.tobytes())


@lru_cache(maxsize=16)  # a search for a tolerance plans 8 meshes: 4 made each anew, 32 gain nothing more
def _plan(count: int, *numbers: bytes) -> SymbolicFactorization:
    """Return the plan for `count` nodes and the numbers of elements' nodes (e, 9), the skin's, and unknowns held."""
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
    where = np.full(total + 1, -1)  # the last place is that of fixed unknowns, whose number is -1
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
    """Return for each unknown of each border where in that border the run of consecutive places it lies in ends."""
    number = np.arange(len(place))
    owner = np.repeat(np.arange(len(border)), border)
    last = np.ones(len(place), bool)
    last[:-1] = (np.diff(place) != 1) | (np.diff(owner) != 0)
    ends = np.flatnonzero(last)
    return ends[np.searchsorted(ends, number)] + 1 - np.repeat(np.cumsum(border) - border, border)


def _waiting(children: Indices, border: Indices) -> tuple[Indices, int]:
    """Return where each part's border waits for its parent: a place for each generation's first and second child."""
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


class Some(NamedTuple):
    """Elements whose displacements are wanted."""

    parts: Flags  # (p,) of the elimination that hold their unknowns
    nodes: Narrow  # (e, 9)
    unknown: Narrow  # (e, 8, 2)
    recovery_matrix: Array  # (e, 2, 16): displacement of the centre = -(recovery_matrix @ outer displacements)


class Elimination:
    """One body's tangent, eliminated down to its skin; the memory is set aside once."""

    def __init__(self, plan: SymbolicFactorization, waiting: Array | None = None) -> None:
        """Set memory aside for `plan`, but for what is `waiting` where that is given."""
        skin = int(plan.border[-1])
        self.plan = plan
        self.stiffness = np.zeros((skin, skin))  # what is left of the tangent for the skin
        values, near = np.empty(plan.factors), np.empty(int((plan.inner + plan.border).max()))
        waiting = np.empty(plan.waiting) if waiting is None else waiting
        factors = Factors(
            plan.start, plan.inner, plan.border, plan.border_at, plan.numbers, plan.factor_at, values, near
        )
        self._every = np.ones(len(plan.start), bool)
        self._eliminate = bind_arguments(multifrontal.eliminate, plan, values, waiting, self.stiffness)
        self._condense = bind_arguments(multifrontal.condense, factors)
        self._back_substitute = bind_arguments(multifrontal.back_substitute, factors)
        self._displace = bind_arguments(multifrontal.displace, factors)

    def factorise(self, tangent: Array) -> int:
        """Eliminate the elements' tangents (e, 16, 16), lower halves; return UNSOLVABLE, INDEFINITE or DEFINITE."""
        return self._eliminate(tangent)

    def condense(self, force: Array) -> Array:
        """Replace `force` (n,) by what `back_substitute` needs of it, and return its end (m,): what the skin feels."""
        self._condense(force)
        return force[self.plan.size - len(self.stiffness) :]

    def parts_holding(self, unknowns: Narrow) -> Flags:
        """Return which parts (p,) hold the displacements of some `unknowns`, -1 being those of none."""
        plan = self.plan
        part = np.full(plan.size + 1, len(plan.inner))  # the last stands for no part
        part[: -len(self.stiffness) - 1] = np.repeat(np.arange(len(plan.inner)), plan.inner)
        out = np.zeros(len(plan.inner) + 1, bool)
        out[part[unknowns]] = True
        out[-1] = False
        for p, (one, other) in enumerate(plan.children.tolist()):
            out[p] |= out[one] or out[other]
        return out[:-1]

    def back_substitute(self, carried: Array, skin: Array) -> Array:
        """Return all displacements (n,) for the skin's (m,) under a force that was condensed, `carried` (n,)."""
        out = np.empty(self.plan.size)
        self._back_substitute(carried, np.ascontiguousarray(skin), self._every, out)
        return out

    def displace(self, carried: Array, skin: Array, some: Some, out: Array) -> None:
        """Fill the displacements `out` (nodes, 2, c) of some elements for the skin's (c, m) under a condensed force."""
        self._displace(carried, np.ascontiguousarray(skin), *some, out)
