"""Elimination order of a body's inner unknowns, down to those of its skin: nested dissection.

Elements are bisected by position, recursively. The unknowns inside each part are eliminated, then the parts are
joined, and so on up the tree (George 1973, SIAM J. Numer. Anal. 10, 345; Duff and Reid 1983, ACM TOMS 9, 302). The
result is the exact Schur complement, the stiffness condensed to the skin. Contact is solved with this small dense
matrix. The work grows like unknowns^1.5.
"""

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from solver._kernels import bind_arguments, multifrontal
from solver.arrays import Array, ElementSystem, Factors, Flags, Indices, Narrow, SymbolicFactorization
from solver.mesh import Mesh, distinct


class _Tree(NamedTuple):
    """Parts of a mesh by nested dissection: p of them, children before parents; the last is the whole body."""

    order: Indices  # (e,) elements, leaf after leaf
    low: Indices  # (p,) first position of each part in `order`
    high: Indices  # (p,) position after its last
    children: Indices  # (p, 2) child parts, -1 in a leaf
    level: Indices  # (p,) number of bisections above each part
    parent: Indices  # (p,) of each part, 0 for the whole body
    leaf: Indices  # (e,) part that holds each position of `order` and is not bisected


def _halve(order: Indices, centres: Array, low: Indices, high: Indices) -> Indices:
    """Sort each part `low` to `high` of `order` along its longer side; return the first position of its upper half."""
    size = high - low
    begins = np.cumsum(size) - size
    part = np.repeat(np.arange(len(size)), size)
    position = np.arange(len(part)) + (low - begins)[part]
    x = centres[order[position]]
    along = np.argmax(np.maximum.reduceat(x, begins) - np.minimum.reduceat(x, begins), axis=1)
    x = x[np.arange(len(x)), along[part]]
    ascending = np.lexsort((x, part))
    order[position], x = order[position][ascending], x[ascending]
    between = np.append(False, x[1:] != x[:-1]) & (position != low[part])
    ends = (low + high)[part]  # a part whose elements all have the same x is cut in its middle
    distance = np.where(between, np.abs(2 * position - ends), 2 * len(order) + (position != ends // 2))
    nearest = np.flatnonzero(distance == np.minimum.reduceat(distance, begins)[part])
    return position[nearest[np.searchsorted(part[nearest], np.arange(len(size)))]]


def _bisect(centres: Array, most: int) -> _Tree:
    """Return the parts of elements at `centres` (e, 2), at most `most` elements in a part that is not bisected.

    All parts of one level are bisected together, each along its longer side and between the two rows or columns next to
    its middle, since a stepped cut has more nodes.
    """
    order, count = np.arange(len(centres)), len(centres)
    low, high = np.array([0]), np.array([count])
    lows, highs, levels = [low], [high], [np.zeros(1, np.int64)]
    branches = [np.empty(0, np.int64)]  # parts that are bisected, numbered level by level
    while (large := high - low > most).any():
        branches.append(sum(map(len, lows)) - len(low) + np.flatnonzero(large))
        low, high = low[large], high[large]
        middle = _halve(order, centres, low, high)
        low, high = np.stack([low, middle], axis=1).ravel(), np.stack([middle, high], axis=1).ravel()
        lows.append(low)
        highs.append(high)
        levels.append(np.full(len(low), len(levels)))
    low, high = np.concatenate(lows), np.concatenate(highs)
    children_first = np.lexsort((-low, high))
    number = np.argsort(children_first)
    children = np.full((len(low), 2), -1)
    children[branch := number[np.concatenate(branches)]] = number[1:].reshape(-1, 2)
    parent = np.zeros(len(low), np.int64)
    parent[number[1:]] = np.repeat(branch, 2)
    low, high, level = low[children_first], high[children_first], np.concatenate(levels)[children_first]
    leaf = np.flatnonzero(children[:, 0] < 0)
    return _Tree(order, low, high, children, level, parent, np.repeat(leaf, (high - low)[leaf]))


def _assign_unknowns(tree: _Tree, elements: Indices, free: Flags, interface: Indices) -> tuple[Indices, Indices]:
    """Return the unknowns that every part eliminates, and those that it passes on, as ascending pairs.

    A pair is the part times the number of all unknowns, plus the unknown. `elements` (e, n) hold unknowns, in the order
    of `tree`.

    Unknowns that are not `free` have zero displacement and take no part. Those in `interface` are never eliminated.
    """
    count, size = len(elements), len(free)
    first, last = np.full(size, count), np.full(size, -1)
    position = np.repeat(np.arange(count), elements.shape[1])
    np.minimum.at(first, elements.ravel(), position)
    np.maximum.at(last, elements.ravel(), position)
    last[interface] = count
    inner: list[Indices] = []
    border: list[Indices] = [np.empty(0, np.int64)]
    for level in range(int(tree.level.max()), -1, -1):
        in_leaves = tree.level[tree.leaf] == level
        of_leaves = (tree.leaf[in_leaves, None] * size + elements[in_leaves])[free[elements[in_leaves]]]
        part, unknown = np.divmod(border[-1], size)
        pairs = distinct(np.concatenate([of_leaves, tree.parent[part] * size + unknown]))
        part, unknown = np.divmod(pairs, size)
        complete = (first[unknown] >= tree.low[part]) & (last[unknown] < tree.high[part])
        inner.append(pairs[complete])
        border.append(pairs[~complete])
    border[-1] = (len(tree.low) - 1) * size + interface
    return np.sort(np.concatenate(inner)), np.sort(np.concatenate(border))


_SIDES = ((0, -1), (1, 0), (0, 1), (-1, 0))  # steps across the four sides of an element


def places(elements: Indices) -> Array:
    """Return the row and column (e, 2) of each of the `elements` (e, 9), from their neighbours.

    In a body much longer than it is thick, or bent like a finger, cuts between rows and columns share far fewer nodes
    than cuts along x or y. In a mesh without rows and columns, close elements still get close numbers.
    """
    count = len(elements)
    sides = elements[:, 4:8].ravel()  # at most two elements share a mid-side node
    order = np.argsort(sides, kind="stable")
    twice = np.flatnonzero(sides[order][1:] == sides[order][:-1])
    across = np.full(4 * count, -1)
    across[order[twice]], across[order[twice + 1]] = order[twice + 1] // 4, order[twice] // 4
    neighbours = across.reshape(count, 4).tolist()
    place: dict[int, tuple[int, int]] = {}
    for seed in range(count):
        if seed in place:
            continue
        place[seed] = 0, 0
        connected = [seed]
        for element in connected:  # the loop appends neighbours
            row, column = place[element]
            for (down, right), neighbour in zip(_SIDES, neighbours[element], strict=True):
                if neighbour >= 0 and neighbour not in place:
                    place[neighbour] = row + down, column + right
                    connected.append(neighbour)
    return np.array([place[element] for element in range(count)], np.float64)


_LEAF: Final = 8  # most elements in a part that is not bisected


def symbolic_factorization(mesh: Mesh) -> SymbolicFactorization:
    """Plan the elimination of `mesh`, whose element centres are condensed beforehand.

    The plan does not depend on nodal positions, so meshes that differ only in these share a cached plan.
    """
    return _plan(len(mesh.nodes), mesh.elements.tobytes(), mesh.skin.tobytes(), mesh.fixed.tobytes())


@lru_cache(maxsize=16)  # a refinement makes 8 plans: a cache of 4 misses them all, one of 32 gains nothing
def _plan(count: int, *numbers: bytes) -> SymbolicFactorization:
    """Return the plan for `count` nodes; `numbers` are bytes: element nodes (e, 9), skin nodes, fixed unknowns."""
    elements, skin_nodes, fixed = (np.frombuffer(part, np.int64) for part in numbers)
    elements = elements.reshape(-1, 9)
    raw = (2 * elements[:, :8, None] + np.arange(2)).reshape(-1, 16)
    skin = (2 * skin_nodes[:, None] + np.arange(2)).ravel()
    tree = _bisect(places(elements), _LEAF)
    free = np.ones(2 * count, bool)
    free[fixed] = False
    inner_pairs, border_pairs = _assign_unknowns(tree, raw[tree.order], free, skin)
    parts = len(tree.low)
    part, eliminated = np.divmod(inner_pairs, len(free))
    inner = np.bincount(part, minlength=parts)
    start = np.cumsum(inner) - inner
    number = np.full(2 * count, -1)
    sequence = np.concatenate([eliminated, skin])
    number[sequence] = np.arange(len(sequence))
    owner, passed_on = np.divmod(border_pairs, len(free))
    keys = np.sort(owner * len(sequence) + number[passed_on])  # borders part by part, each in ascending order
    owner, entry = np.divmod(keys, len(sequence))
    border = np.bincount(owner, minlength=parts)
    border_at = np.cumsum(border) - border

    def position(part: Indices, unknown: Indices) -> Indices:
        """Return the positions of unknowns in the front of a part: its eliminated unknowns, then its border."""
        in_border = np.searchsorted(keys, part * len(sequence) + unknown) - border_at[part]
        in_inner = unknown - start[part]
        return np.where(in_inner < inner[part], in_inner, inner[part] + in_border)

    number[fixed] = -1
    joined = owner < parts - 1
    place = np.zeros(len(keys), np.int32)
    place[joined] = position(tree.parent[owner[joined]], entry[joined])
    unknown = number[raw]
    of_leaves = unknown[tree.order]
    sizes = inner * (inner + border)
    wait_at, waiting = _waiting(tree, border)
    return SymbolicFactorization(
        unknown=_narrow(unknown),
        size=len(sequence),
        start=_narrow(start),
        inner=_narrow(inner),
        border=_narrow(border),
        children=_narrow(tree.children),
        border_at=_narrow(border_at),
        numbers=_narrow(entry),
        place=place,
        run=_narrow(_runs(place, border)),
        factor_at=np.cumsum(sizes) - sizes,
        wait_at=wait_at,
        leaf=_narrow(np.where(tree.children[:, :1] < 0, np.stack([tree.low, tree.high], axis=1), 0)),
        order=_narrow(tree.order),
        position=_narrow(np.where(of_leaves < 0, -1, position(tree.leaf[:, None], of_leaves))),
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


def _waiting(tree: _Tree, border: Indices) -> tuple[Indices, int]:
    """Return the offset at which each part's Schur complement waits for its parent, and the size of that memory.

    Each level of the tree has a place for a first and a second child.
    """
    slot = 2 * tree.level
    slot[tree.children[tree.children[:, 1] >= 0, 1]] += 1
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
    """Elimination of one body's tangent down to its skin, and the memory for it."""

    def __init__(self, plan: SymbolicFactorization) -> None:
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


CondensedLoad = tuple[Array, Array]  # a load after forward elimination (n,), and centres' displacements (e, 2) under it


class StaticCondensation:
    """A body's tangent, condensed to x, y of the k nodes of its skin; valid until it is factorised again."""

    def __init__(self, mesh: Mesh, inside: Elimination, system: ElementSystem) -> None:
        """Store the factors `inside`, and the elimination of the elements' centres in `system`."""
        self.mesh, self._inside, self.stiffness = mesh, inside, inside.stiffness
        self._inverse, self._recovery_matrix = system.condensed_inverse, system.recovery_matrix[:, :, :16].copy()
        self.no_load: CondensedLoad = np.zeros(inside.plan.size), np.zeros((len(self._inverse), 2))
        self._subsets: dict[bytes | None, tuple[Indices, ElementSubset]] = {}

    def condense(self, loads: Array) -> CondensedLoad:
        """Return dead `loads` (nodes, 2) after forward elimination."""
        mesh, plan = self.mesh, self._inside.plan
        centre = loads[mesh.elements[:, 8], :, None]
        of_centres = (self._inverse[:, [[0, 1], [1, 2]]] @ centre)[:, :, 0]
        from_centre = (np.swapaxes(self._recovery_matrix, 1, 2) @ centre)[:, :, 0]  # (e, 16)
        free = plan.unknown >= 0
        force = np.zeros(plan.size)
        force[plan.unknown[free]] = -loads[mesh.elements[:, :8]].reshape(-1, 16)[free]
        np.add.at(force, plan.unknown[free], from_centre[free])
        self._inside.condense(force)
        return force, of_centres

    def skin_load(self, load: CondensedLoad) -> Array:
        """Return a load condensed to the skin (2 k,), 0 where the skin is held."""
        return np.where(self.mesh.driven[self.mesh.skin].ravel(), 0.0, -load[0][len(load[0]) - len(self.stiffness) :])

    def displacement(self, skin: Array, load: CondensedLoad, only: Indices | None = None) -> Array:
        """Return the displacements (nodes, 2, c) by back substitution of the skin's (2 k, c) under a load.

        With `only` (node numbers), other nodes may be left at 0.
        """
        elements, subset = self._elements_of(only)
        out = np.zeros((*self.mesh.nodes.shape, skin.shape[1]))
        self._inside.displace(load[0], skin.T, subset, out)
        out[subset.nodes[:, 8]] += load[1][elements, :, None]
        return out

    def _elements_of(self, only: Indices | None) -> tuple[Indices, ElementSubset]:
        """Return the elements that hold the nodes `only`, or all elements."""
        key = None if only is None else only.tobytes()
        if key not in self._subsets:
            flags = np.full(len(self.mesh.nodes), only is None)
            flags[only] = True
            elements = np.flatnonzero(flags[self.mesh.elements].any(axis=1))
            nodes = self.mesh.elements[elements].astype(np.int32)
            unknown = self._inside.plan.unknown[elements].reshape(-1, 8, 2)
            every = np.ones(len(self._inside.plan.start), bool)
            parts = every if only is None else self._inside.parts_holding(unknown)
            self._subsets[key] = elements, ElementSubset(parts, nodes, unknown, self._recovery_matrix[elements])
        return self._subsets[key]
