"""A body at small strain reduced to its skin: assembled and eliminated by the compiled loops."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod
from threading import Lock
from typing import Literal

import numpy as np
from numpy.linalg import LinAlgError

from solver._kernels import hooke, multifrontal
from solver._kernels.compiling import HELD_X, HELD_Y
from solver.arrays import Array, Indices, Narrow, RecoveryArrays
from solver.body.stiffness import Elastic, condensed_elements, inverse
from solver.body.validation import check_body, check_held, check_loads, loose
from solver.constitutive import Elasticity
from solver.linalg import factors_of, symbolic_factorization
from solver.mesh import GAUSS_4, Q2P1, Mesh, jacobians, line
from solver.tolerances import UNHELD

_ALONE = Lock()  # held while the memory of `_memory` is in use


Carried = tuple[Array, Array]  # a load condensed on the unknowns (n,), and the moves (e, 2) of centres under it alone


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


class CondensedLinear:
    """A body at small strain, whose states are those of its skin: u (k, 2) [mm] are the displacements of that alone."""

    def __init__(self, rest: Array, stiffness: Array, load: Array, length: Array, held: Narrow) -> None:
        """Take skin that lies at `rest` (k, 2), of a `length` (k,) at each node, `held` as CondensedBody has it.

        `stiffness` (2 k, 2 k) and dead `load` (2 k,) are those of x, y of one node, x, y of the next.
        """
        self.constant, self.bulk = True, 0.0
        self.rest, self.stiffness, self.load = rest, stiffness, load
        self.fixed_length, self.held = length, held
        self.middle = np.zeros(len(rest), np.int32)
        self.motions = np.zeros((2 * len(rest), 0))  # of the body as a whole that the surface alone balances
        self.springs = self.motions  # all that nothing holds, orthonormal
        self.force = -load
        self.equilibrium: Array | None = None
        self._compliance: Array | None = None

    @property
    def compliance(self) -> Array:
        """The inverse of the stiffness (2 k, 2 k), 0 for what is held. Raises LinAlgError where that is none."""
        if self._compliance is None:
            self._compliance = self._inverse()
        return self._compliance

    def _inverse(self) -> Array:
        free = np.flatnonzero(self.stiffness.diagonal() > 0.0)
        # Rigid motions cost no energy: a spring on each makes the matrix invertible, and stays unloaded, since the
        # surface's forces balance the loads along every motion.
        spring = self.stiffness.trace() / max(len(free), 1)
        inside = (self.stiffness + spring * self.springs @ self.springs.T)[np.ix_(free, free)]
        inverse = np.asarray(np.linalg.inv(inside), np.float64)
        if not np.abs(inside).max(initial=0.0) * np.abs(inverse).max(initial=0.0) < UNHELD:
            raise LinAlgError("the body is neither held nor balanced")
        out = np.zeros(self.stiffness.shape)
        out[np.ix_(free, free)] = (inverse + inverse.T) / 2.0
        return out

    def loaded(self, load: Array) -> "CondensedLinear":
        """Return the same body under another dead `load` (2 k,) [N/mm]."""
        other = copy(self)
        other.load, other.force, other._compliance = load, -load, self.compliance  # noqa: SLF001 - of its own kind
        return other

    def undeformed(self) -> tuple[Array, Array]:
        """Return displacements (k, 2) of the skin at rest, and no pressures."""
        return np.zeros(self.rest.shape), np.zeros((0, 3))

    def untouched(self) -> Array:
        """Return the displacements (k, 2) under the dead loads alone, motions left out that nothing holds."""
        return (self.compliance @ self.load).reshape(-1, 2)

    def held_by(self, reaction: Array) -> Array:
        """Return the displacements (k, 2) that forces `reaction` (k, 2) of the surface hold."""
        return (self.compliance @ (self.load + reaction.ravel())).reshape(-1, 2)

    def stored(self, u: Array, reaction: Array) -> float:  # noqa: ARG002 - tissues that relax may be elsewhere
        """Return the energy stored once forces `reaction` (k, 2) alone hold the body [N mm per mm]."""
        return 0.5 * float(np.sum(reaction * self.held_by(reaction)))

    def work(self, way: Sequence[Array], trapezoid: float) -> float:  # noqa: ARG002 - as every body is asked
        """Do as `CondensedBody` says: forces grow in proportion, so that the rule is exact."""
        return trapezoid

    def place(self, u: Array) -> Array:
        """Return where the skin's nodes are (k, 2) for displacements `u` (k, 2) [mm]."""
        return self.rest + u

    def linearise(self, u: Array, pressure: Array) -> bool:  # noqa: ARG002 - as every body is asked
        """Set the `force` at a state."""
        return self.relinearise(u)

    def relinearise(self, u: Array) -> bool:
        """Do the same: the stiffness is that of every state."""
        self.force = self.stiffness @ u.ravel() - self.load if u.any() else -self.load
        return True

    def recover(self, u: Array, pressure: Array, step: Array, scale: float) -> tuple[Array, Array, float]:
        """Return a state after `scale` times the skin's `step` (2 k,), and the largest move of the full step [mm]."""
        return u + scale * step.reshape(u.shape), pressure, float(np.abs(step).max(initial=0.0))


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
        return float(_determinant(self._at_corners(displacement)).min())

    def stretches(self, displacement: Array) -> Array:
        """Return the smallest and largest in-plane stretch (2, p) at every corner of every element.

        They are the singular values of F = 1 + du/dX; a folded place has a negative smallest one.
        """
        f = self._at_corners(displacement)
        det = _determinant(f)
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


def _determinant(f: Array) -> Array:
    """Return the determinants (p,) of matrices (p, 2, 2)."""
    return f[:, 0, 0] * f[:, 1, 1] - f[:, 0, 1] * f[:, 1, 0]


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
