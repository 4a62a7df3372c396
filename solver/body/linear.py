"""A body at small strain reduced to its skin: assembled and eliminated by the compiled loops."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod
from threading import Lock
from typing import Literal

import numpy as np
from numpy.linalg import LinAlgError

from solver._kernels import hooke, multifrontal
from solver._kernels.compiling import HELD_X, HELD_Y
from solver.arrays import (
    Array,
    Indices,
    LinearElements,
    LinearMesh,
    RecoveryArrays,
    ShapeFunctions,
    determinant,
    inverse,
)
from solver.body import CondensedLinear, Endings, Probes
from solver.body.validation import check_body, check_held, check_loads, loose
from solver.constitutive import PLAIN, Elasticity
from solver.linalg import factors_of, symbolic_factorization
from solver.mesh import GAUSS_4, Q2P1, Mesh, distinct, jacobians, line
from solver.quantities import QUANTITIES, SED, LocalState

_Q_VALUES, _GRADIENTS = Q2P1.shape(Q2P1.points)  # (9 points, 9 nodes), (9, 9, 2)
_SHAPES = ShapeFunctions(
    _Q_VALUES, np.ascontiguousarray(_GRADIENTS[..., 0]), np.ascontiguousarray(_GRADIENTS[..., 1]), Q2P1.weights
)
_ALONE = Lock()  # held while the memory of `_memory` is in use


Carried = tuple[Array, Array]  # a load condensed on the unknowns (n,), and the moves (e, 2) of centres under it alone


@dataclass(frozen=True, slots=True, eq=False)
class Elastic:
    """Elements made of Hooke materials: e of them, displacements ordered x, y, x, y, ... within each."""

    stiffness: Array  # (e, 18, 18) [N/mm per mm]
    dilatation: Array  # (e, 3, 18): displacements to the volume strain's modes 1, x - xc, y - yc
    centre: Array  # (e, 2) xc, yc of the modes [mm]
    shear: Array  # (e,) [MPa]
    lame: Array  # (e,) [MPa]

    @staticmethod
    def of(mesh: Mesh, materials: Sequence[Elasticity]) -> "Elastic":
        """Integrate the stiffness of every element with 3 x 3 Gauss points; `materials` by region.

        K = integral of 2 G eps:eps + lambda theta^2, where theta is the best fit of the volume strain by 1, x, y. That
        is the mixed form with pressure lambda theta, its three pressure modes eliminated (exact for Hooke). Raises
        LinAlgError where an element is folded.
        """
        return condensed_elements(mesh, materials, np.empty((len(mesh.elements), 16, 16)))[0]

    def state(self, mesh: Mesh, probes: Probes, displacement: Array, tangent: Array | None = None) -> LocalState:
        """Return what is known of the places for displacements (nodes, 2, ...): arrays (p, ...).

        `tangent` (p, 2) are the skin's directions there; the x axis where none are given.
        """
        gradient = probes.displacement_gradient(mesh, displacement)
        held, place = np.unique(probes.element, return_inverse=True)
        local = displacement[mesh.elements[held]]
        local = (local - local[:, 8:]).reshape(len(local), 18, -1)
        volume = (probes.modes[:, None] @ (self.dilatation[held] @ local)[place])[:, 0]
        wide = (slice(None), *([None] * (displacement.ndim - 2)))
        half = (gradient[:, 0, 1] + gradient[:, 1, 0]) / 2.0
        along = np.array([[1.0, 0.0]]) if tangent is None else tangent
        return LocalState(
            xx=gradient[:, 0, 0],
            xy=half,
            yx=half,
            yy=gradient[:, 1, 1],
            dilatation=volume.reshape(half.shape),
            shear=self.shear[probes.element][wide],
            lame=self.lame[probes.element][wide],
            stiffening=np.array(PLAIN),
            tangent=(along[:, 0][wide], along[:, 1][wide]),
        )

    def energy(self, mesh: Mesh, probes: Probes, displacement: Array) -> Array:
        """Return the SED (p, ...) [MPa] for displacements (nodes, 2, ...)."""
        return SED.small(self.state(mesh, probes, displacement))


def condensed_elements(mesh: Mesh, materials: Sequence[Elasticity], outer: Array) -> tuple[Elastic, Array]:
    """Return the elements of `mesh`, and the matrices (e, 2, 16) that recover their centre nodes.

    Filled: `outer` (e, 16, 16), lower half, their stiffness when the centre nodes are eliminated. Raises LinAlgError
    where an element is folded.
    """
    count = len(mesh.elements)
    shear = np.array([m.shear for m in materials])[mesh.region]
    lame = np.array([m.lame for m in materials])[mesh.region]
    filled = LinearElements(
        np.empty((count, 18, 18)), np.empty((count, 3, 18)), np.empty((count, 2)), np.empty((count, 2, 16))
    )
    if not hooke.stiffen(LinearMesh(mesh.nodes, mesh.elements, shear, lame), _SHAPES, filled, outer):
        raise LinAlgError("an element is folded")
    stiffness, dilatation, centre, recovery_matrix = filled
    return Elastic(stiffness, dilatation, centre, shear, lame), recovery_matrix


class LinearElimination:
    """A body at small strain reduced to the displacements of its k nodes of skin: x, y of one, x, y of the next."""

    def __init__(self, mesh: Mesh, materials: Sequence[Elasticity]) -> None:
        """Assemble `mesh` of `materials` by region, and eliminate all but its skin.

        Raises LinAlgError where an element is folded, or the inner stiffness is not positive definite.
        """
        plan = symbolic_factorization(mesh)
        count, width = len(mesh.elements), int(plan.border[-1])
        values = np.empty(plan.factors)
        self.stiffness = np.empty((width, width))  # of the skin
        with _ALONE:
            memory = _memory(256 * count + plan.waiting)
            outer, waiting = memory[: 256 * count].reshape(count, 16, 16), memory[256 * count :]
            self.elastic, self._recovery_matrix = condensed_elements(mesh, materials, outer)
            regular = multifrontal.eliminate(outer, plan, values, waiting, self.stiffness)
        self._factors = factors_of(plan, values)
        if not regular or not hooke.definite(self._factors):
            raise LinAlgError("the stiffness inside the body is not positive definite")
        self._mesh, self._plan = mesh, plan
        self.unloaded: Carried = np.zeros(plan.size), np.zeros((count, 2))

    def condense(self, loads: Array) -> Carried:
        """Return dead `loads` (nodes, 2) as the factors carry them."""
        mesh, plan = self._mesh, self._plan
        centre = loads[mesh.elements[:, 8], :, None]
        own: Array = np.asarray(np.linalg.solve(self.elastic.stiffness[:, 16:, 16:], centre)[:, :, 0], np.float64)
        passed = (np.swapaxes(self._recovery_matrix, 1, 2) @ centre)[:, :, 0]  # (e, 16)
        free = plan.unknown >= 0
        force = np.zeros(plan.size)
        force[plan.unknown[free]] = -loads[mesh.elements[:, :8]].reshape(-1, 16)[free]
        np.add.at(force, plan.unknown[free], passed[free])
        multifrontal.condense(force, self._factors)
        return force, own

    def skin_load(self, carried: Carried) -> Array:
        """Return what the skin feels (2 k,) of a load; nothing where it is held."""
        force = -carried[0][self._plan.size - len(self.stiffness) :]
        return np.where(self._mesh.driven[self._mesh.skin].ravel(), 0.0, force)

    def displacement(self, skin: Array, carried: Carried, only: Indices | None = None) -> Array:
        """Return the displacements (nodes, 2, c) that go with those of the skin (2 k, c) under a load.

        With `only` (node numbers), other nodes may be left at 0.
        """
        needed = np.full(len(self._mesh.nodes), only is None)
        if only is not None:
            needed[only] = True
        out = np.zeros((*self._mesh.nodes.shape, skin.shape[1]))
        recovery = RecoveryArrays(self._mesh.elements, self._recovery_matrix)
        hooke.displace(np.ascontiguousarray(skin.T), *carried, needed, self._plan, self._factors, recovery, out)
        return out


@lru_cache(maxsize=1)
def _memory(size: int) -> Array:
    """Return memory for what is forgotten at once, always the same: to be given new takes as long as the work."""
    return np.empty(size)


Motion = Literal["x", "y", "turn"]
_POINTS, _WEIGHTS = GAUSS_4
_VALUES, _SLOPES = line(_POINTS)  # (q, 3)


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class LinearBody:
    """An elastic body whose skin may touch a flat rigid surface that lies below it along y = 0."""

    mesh: Mesh
    elastic: Elastic
    elimination: LinearElimination
    carried: Carried  # its dead loads
    condensed: CondensedLinear
    prescribed: Array  # (nodes, 2) displacement of what is held relative to the drive, 0 elsewhere [mm]

    @staticmethod
    def of(
        mesh: Mesh,
        materials: Sequence[Elasticity],
        loads: Array | None = None,
        prescribed: Array | None = None,
        free: Sequence[Motion] = (),
        *,
        checked: bool = False,
    ) -> "LinearBody":
        """Reduce a body of `materials` by region under dead `loads` (nodes, 2) [N/mm].

        What is held moves with the drive, and by `prescribed` (nodes, 2) [mm] relative to it. A body that nothing holds
        names in `free` the motions along which the surface alone balances the loads. Raises BodyError and MeshError,
        unless `checked` before, and LinAlgError where what is held or free leaves it a motion.
        """
        if not checked:
            check_body(mesh, materials)
            check_loads(mesh, loads, prescribed)
            check_held(mesh, free)
        whole = LinearElimination(mesh, materials)
        moved = np.zeros(mesh.nodes.shape) if prescribed is None else np.array(prescribed, np.float64)
        force = np.zeros(mesh.nodes.shape) if loads is None else np.array(loads, np.float64)
        if prescribed is not None:
            pushed = whole.elastic.stiffness @ moved[mesh.elements].reshape(-1, 18, 1)
            force -= mesh.assemble(pushed)
        carried = whole.condense(force) if force.any() else whole.unloaded
        condensed = _condensed(mesh, whole.stiffness, whole.skin_load(carried), free)
        if not checked and len(mesh.skin):
            _ = condensed.compliance  # which is none where the body can move
        return LinearBody(mesh, whole.elastic, whole, carried, condensed, moved)

    @property
    def dofs(self) -> int:
        """Return the number of unknown displacements."""
        return 2 * len(self.mesh.nodes) - len(self.mesh.fixed)

    def displacement(self, u: Array, only: Indices | None = None) -> Array:
        """Return the displacement (nodes, 2, ...) of all nodes for that of the skin `u` (k, 2, ...), one or several.

        With `only` (node numbers), other nodes may be left at 0.
        """
        skin = u.reshape(2 * len(self.mesh.skin), prod(u.shape[2:]))
        out = self.elimination.displacement(skin, self.carried, only) + self.prescribed[:, :, None]
        return out.reshape(*self.mesh.nodes.shape, *u.shape[2:])

    @property
    def centre(self) -> Array:
        """Do as `Body` says."""
        return self.elastic.centre

    def every_step(self) -> Array:
        """Return the displacements (nodes, 2, 2 k) that one of the skin's unknowns after the other makes."""
        k = len(self.mesh.skin)
        return self.displacement(np.eye(2 * k).reshape(k, 2, 2 * k)) - self.displacement(np.zeros((k, 2, 1)))

    def linearised(self, displacement: Array) -> tuple[CondensedLinear, Callable[[Array], Array]]:
        """Return the body about a `displacement` (nodes, 2), and what makes displacements of its skin's steps (k, 2).

        The forces it leaves over are those of the elements, so that a step from it takes round-off out of a state: one
        step of iterative refinement (Wilkinson 1963). For held bodies without dead loads.
        """
        inner = self.forces(displacement)
        inner[self.mesh.driven] = 0.0
        about, recover = self.under(-inner)
        about.rest = self.mesh.nodes[self.mesh.skin] + displacement[self.mesh.skin]
        return about, lambda step: displacement + recover(step)

    def under(self, loads: Array) -> tuple[CondensedLinear, Callable[[Array], Array]]:
        """Return the body under dead `loads` (nodes, 2) in place of its own, and what recovers displacements there.

        That makes those of all nodes (nodes, 2) of the skin's (k, 2) [mm], what is held staying where it is.
        """
        carried = self.elimination.condense(loads)

        def recover(u: Array) -> Array:
            return self.elimination.displacement(u.reshape(-1, 1), carried)[:, :, 0]

        return self.condensed.loaded(self.elimination.skin_load(carried)), recover

    def following(self, skin: Array) -> Array:
        """Do as `Body` says."""
        return self.displacement(skin.reshape(len(skin) // 2, 2, -1))

    def forces(self, displacement: Array) -> Array:
        """Do as `Body` says."""
        return self.mesh.assemble(self.elastic.stiffness @ self._local(displacement).reshape(-1, 18, 1))

    def energy_growth(self, displacement: Array) -> float:
        """Do as `Body` says."""
        local = self._local(displacement).reshape(-1, 18, 1)
        return float(np.sum(local * (self.elastic.stiffness @ local)))

    def _local(self, displacement: Array) -> Array:
        """Return the displacements (e, 9, 2) of the elements' nodes beyond that of the centre.

        What moves an element as a whole strains nothing, but would drown small strains in round-off.
        """
        local = displacement[self.mesh.elements]
        return local - local[:, 8:]

    def smallest_det(self, displacement: Array) -> float:
        """Do as `Body` says, of the corners of elements, where strains are largest."""
        return float(determinant(self._at_corners(displacement)).min())

    def stretches(self, displacement: Array) -> Array:
        """Return the smallest and largest in-plane stretch (2, p) at every corner of every element.

        They are the singular values of F = 1 + du/dX; a folded place has a negative smallest one.
        """
        f = self._at_corners(displacement)
        det = determinant(f)
        total = np.sum(f * f, axis=(1, 2))
        plus, minus = np.sqrt(total + 2.0 * det), np.sqrt(np.maximum(total - 2.0 * det, 0.0))
        return np.stack([(plus - minus) / 2.0, (plus + minus) / 2.0])

    def _at_corners(self, displacement: Array) -> Array:
        """Return F transposed (p, 2, 2) at every corner of every element."""
        return (self._corners @ self._local(displacement)).reshape(-1, 2, 2) + np.eye(2)

    @cached_property
    def _corners(self) -> Array:
        """The gradients (e, 8, 9) of shape functions, along x and y at each corner of each element."""
        slopes = Q2P1.shape(Q2P1.corners)[1]  # (4, 9, 2)
        gradient = slopes @ inverse(jacobians(self.mesh, Q2P1.corners)[0])
        return np.ascontiguousarray(np.swapaxes(gradient, 2, 3).reshape(-1, 8, 9))


@dataclass(frozen=True, eq=False)  # without slots: the energy forms are made when they are first needed
class LinearPatches:
    """Endings of an elastic body at small strain."""

    mesh: Mesh
    elastic: Elastic
    endings: Endings

    def nodes(self) -> Indices:
        """Do as `Patches` says."""
        return distinct(self.mesh.elements[distinct(self.endings.probes.element)])

    def average(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        element, patch, form = self._energy_forms
        local = displacement[self.mesh.elements[element]]
        local = (local - local[:, 8:]).reshape(len(local), 18, -1)  # moved as a whole, strains would drown in round-off
        energy = np.einsum("mic,mic->mc", local, form @ local)
        total, first = np.zeros((self.endings.count, energy.shape[1])), np.flatnonzero(np.diff(patch, prepend=-1))
        total[patch[first]] = np.add.reduceat(energy, first)
        return (total / self.endings.areas[:, None]).reshape(-1, *displacement.shape[2:])

    @cached_property
    def _energy_forms(self) -> tuple[Indices, Indices, Array]:
        """The parts of patches within one element (m,): element, patch, and the energy as a quadratic form (m, 18, 18).

        Each form is of the displacements of the element's nodes [N/mm per mm2].
        """
        probes, patch = self.endings.probes, self.endings.patch
        order = np.lexsort((probes.element, patch))
        element, patch = probes.element[order], patch[order]
        starts = (np.diff(element, prepend=-1) != 0) | (np.diff(patch, prepend=-1) != 0)
        part, first = np.cumsum(starts) - 1, np.flatnonzero(starts)
        place = np.arange(len(part)) - first[part]
        roots = np.zeros((len(first), int(place.max(initial=0)) + 1, 21))  # d/dx and d/dy of shape functions, modes
        sizes = np.sqrt(self.endings.weights[order])[:, None]
        roots[part, place, :18] = np.swapaxes(probes.gradient[order], 1, 2).reshape(-1, 18) * sizes
        roots[part, place, 18:] = probes.modes[order] * sizes
        sums = np.swapaxes(roots, 1, 2) @ roots
        xx, yx, yy, element = sums[:, :9, :9], sums[:, 9:18, :9], sums[:, 9:18, 9:18], element[first]
        form = np.empty((len(first), 9, 2, 9, 2))  # of eps:eps
        form[:, :, 0, :, 0], form[:, :, 0, :, 1] = xx + yy / 2.0, yx / 2.0
        form[:, :, 1, :, 0], form[:, :, 1, :, 1] = np.swapaxes(yx, 1, 2) / 2.0, yy + xx / 2.0
        theta = self.elastic.dilatation[element]
        volume = np.swapaxes(theta, 1, 2) @ sums[:, 18:, 18:] @ theta
        shear, lame = (modulus[element, None, None] for modulus in (self.elastic.shear, self.elastic.lame))
        # W = G eps:eps + lambda/2 theta^2
        return element, patch[first], shear * form.reshape(-1, 18, 18) + lame / 2.0 * volume

    def responses(self, displacement: Array) -> Array:
        """Do as `Patches` says."""
        state = self.elastic.state(self.mesh, self.endings.probes, displacement, self.endings.tangent)
        return np.stack([self.endings.means(quantity.small(state)) for quantity in QUANTITIES])


def _condensed(mesh: Mesh, stiffness: Array, load: Array, free: Sequence[Motion]) -> CondensedLinear:
    """Return the skin of a body by its `stiffness` (2 k, 2 k) and dead `load` (2 k,)."""
    held = (mesh.driven[mesh.skin] @ np.array([HELD_X, HELD_Y])).astype(np.int32)
    place = mesh.nodes[mesh.skin]
    (x, y), one, zero = place.T, np.ones(len(place)), np.zeros(len(place))
    shapes = {"x": np.c_[one, zero].ravel(), "y": np.c_[zero, one].ravel(), "turn": np.c_[-y, x].ravel()}
    rigid = np.stack(list(shapes.values()), axis=1) @ loose(mesh)
    skin = CondensedLinear(place, stiffness, load, skin_lengths(mesh), held)
    skin.springs = np.linalg.qr(rigid)[0] if rigid.shape[1] else rigid
    skin.motions = np.stack([shapes[name] for name in free], axis=1) if free else np.zeros((2 * len(place), 0))
    return skin


def skin_lengths(mesh: Mesh) -> Array:
    """Return the length of skin (k,) [mm] that each point of it stands for: 1/6, 4/6, 1/6 of a straight edge."""
    return edge_load(mesh, mesh.skin, np.ones((len(mesh.skin), 1)))[mesh.skin, 0]


def edge_load(mesh: Mesh, chain: Indices, traction: Array) -> Array:
    """Return the nodal forces (nodes, c) of a traction (2 k + 1, c) [MPa] along a chain of edges (2 k + 1,)."""
    out = np.zeros((len(mesh.nodes), traction.shape[1]))
    edges = np.arange(0, len(chain) - 2, 2)[:, None] + np.arange(3)
    tangent = _SLOPES @ mesh.nodes[chain[edges]]  # (e, q, 2)
    length = _WEIGHTS * np.hypot(tangent[..., 0], tangent[..., 1])
    local = _VALUES.T @ (length[:, :, None] * (_VALUES @ traction[edges]))
    np.add.at(out, chain[edges], local)
    return out
