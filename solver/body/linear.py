"""A body of any shape: a mesh with its materials and loads, reduced to what the surface feels of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.linalg import LinAlgError

from solver.body.linear_elimination import LinearElimination
from solver.body.stiffness import Elastic, Isotropic
from solver.body.validation import check_body, check_held, check_loads, loose
from solver.contact.active_set import Touchable
from solver.element import GAUSS_4, line
from solver.mesh import Array, Indices, Mesh

Motion = Literal["x", "y", "turn"]
_POINTS, _WEIGHTS = GAUSS_4
_VALUES, _SLOPES = line(_POINTS)  # (q, 3)
RIGID = 1e-12  # compliance of the skin where it is held along the surface, by the largest elsewhere [-]
UNHELD = 1e14  # stiffness by its inverse, largest numbers, from which a body is taken to move freely [-]


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """An elastic body whose skin may touch a flat rigid surface that lies below it along y = 0."""

    mesh: Mesh
    elastic: Elastic
    reduced: LinearElimination
    touchable: Touchable
    prescribed: Array  # (nodes, 2) displacement of what is held relative to the drive, 0 elsewhere [mm]

    @staticmethod
    def of(
        mesh: Mesh,
        materials: Sequence[Isotropic],
        loads: Array | None = None,
        prescribed: Array | None = None,
        free: Sequence[Motion] = (),
        *,
        checked: bool = False,
    ) -> "Body":
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
        force = np.zeros(mesh.nodes.size) if loads is None else np.array(loads, np.float64).ravel()
        if prescribed is not None:
            unknowns = _unknowns(mesh)
            pushed = whole.elastic.stiffness @ moved.ravel()[unknowns][:, :, None]
            np.subtract.at(force, unknowns.ravel(), pushed.ravel())
        reduced = whole.loaded(force) if force.any() else whole
        touchable = _touchable(mesh, reduced.stiffness, reduced.load, free)
        return Body(mesh, reduced.elastic, reduced, touchable, moved)

    @property
    def dofs(self) -> int:
        """Return the number of unknown displacements."""
        return 2 * len(self.mesh.nodes) - len(self.mesh.fixed)

    def skin_displacement(self, forces: Array) -> Array:
        """Return the displacement (2 k, c) of the skin, normal first, by surface forces (2 k, c); held bodies only."""
        k = len(self.mesh.skin)
        t = self.touchable
        up = t.normal_by_normal @ forces[:k] + t.normal_by_tangential @ forces[k:] + t.normal_free[:, None]
        along = t.normal_by_tangential.T @ forces[:k] + t.tangential_by_tangential @ forces[k:]
        return np.concatenate([up, along + t.tangential_free[:, None]])

    def displacement(self, skin: Array, only: Indices | None = None) -> Array:
        """Return the displacement (nodes, 2, c) of all nodes for that of the skin (2 k, c), normal first.

        With `only` (node numbers), other nodes may be left at 0.
        """
        unknowns = None if only is None else np.concatenate([2 * only, 2 * only + 1])
        loaded = self.reduced.load.shape[1] > 0
        out = self.reduced.all_unknowns(skin, loaded, unknowns).reshape(*self.mesh.nodes.shape, -1)
        out += self.prescribed[:, :, None]
        return out

    def balanced(self, displacement: Array, forces: Array) -> Array:
        """Return `displacement` (nodes, 2, c) under surface forces (2 k, c), normal first, with less round-off in it.

        One step of iterative refinement (Wilkinson 1963): the forces that are left over are put on the body, and what
        they do is added. For held bodies without dead loads.
        """
        k, t = len(self.mesh.skin), self.touchable
        left = -self.reactions(displacement)
        left[self.mesh.skin, 1] += forces[:k]
        left[self.mesh.skin, 0] += forces[k:]
        left[self.mesh.driven] = 0.0
        compliance = np.block(
            [[t.normal_by_normal, t.normal_by_tangential], [t.normal_by_tangential.T, t.tangential_by_tangential]]
        )
        more = self.reduced.under(left.reshape(-1, left.shape[2]), compliance)
        return displacement + more.reshape(displacement.shape)

    def reactions(self, displacement: Array) -> Array:
        """Return the forces (nodes, 2, c) that hold all nodes where they are: the elements' inner forces [N/mm]."""
        count = len(self.mesh.elements)
        local = displacement[self.mesh.elements]
        # what moves an element as a whole strains nothing, but would drown small strains in round-off
        local = (local - local[:, 8:]).reshape(count, 18, -1)
        out = np.zeros(displacement.shape)
        np.add.at(out, self.mesh.elements, (self.elastic.stiffness @ local).reshape(count, 9, 2, -1))
        return out


def _unknowns(mesh: Mesh) -> Indices:
    """Return the numbers (e, 18) of the elements' unknowns: x of node n is 2 n, y is 2 n + 1."""
    return (2 * mesh.elements[:, :, None] + np.arange(2)).reshape(len(mesh.elements), 18)


def _touchable(mesh: Mesh, stiffness: Array, loads: Array, free: Sequence[Motion]) -> Touchable:
    """Turn the skin's `stiffness` (2 k, 2 k) into its compliance, split by direction; `loads` (2 k, l) it feels."""
    k = len(mesh.skin)
    x, y = mesh.nodes[mesh.skin].T
    one, zero = np.ones(k), np.zeros(k)
    rigid = np.stack([np.r_[zero, one], np.r_[one, zero], np.r_[x, -y]], axis=1) @ loose(mesh)
    if rigid.shape[1]:
        # Rigid motions cost no energy: a spring on each makes the matrix invertible, and stays unloaded, since the
        # surface's forces are asked to balance the loads along every motion that anything drives.
        rigid = np.linalg.qr(rigid)[0]
        stiffness = stiffness + np.trace(stiffness) / (2 * k) * rigid @ rigid.T
    load = loads.sum(axis=1)
    kept = np.flatnonzero(~np.r_[mesh.driven[mesh.skin, 1], mesh.driven[mesh.skin, 0]])
    compliance = np.linalg.inv(stiffness[np.ix_(kept, kept)])
    if k and not np.abs(stiffness).max() * np.abs(compliance).max() < UNHELD:
        raise LinAlgError("the body is neither held nor balanced")
    compliance = (compliance + compliance.T) / 2.0
    if len(kept) < 2 * k:  # what is held along the surface carries there whatever is asked of it, and hardly moves
        inside, compliance = compliance, RIGID * float(compliance.diagonal().max()) * np.eye(2 * k)
        compliance[np.ix_(kept, kept)] = inside
        load = np.where(np.isin(np.arange(2 * k), kept), load, 0.0)
    moved = compliance @ load
    shapes = {"x": np.r_[zero, one], "y": np.r_[one, zero], "turn": np.r_[x, -y]}
    motions = np.stack([shapes[name] for name in free], axis=1) if free else np.zeros((2 * k, 0))
    return Touchable(
        gap=y.copy(),
        length=skin_lengths(mesh),
        normal_by_normal=compliance[:k, :k].copy(),
        normal_by_tangential=compliance[:k, k:].copy(),
        tangential_by_tangential=compliance[k:, k:].copy(),
        normal_free=moved[:k],
        tangential_free=moved[k:],
        motions=motions,
        resultants=-motions.T @ load,
        carried=bool(free),
    )


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
