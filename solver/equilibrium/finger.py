"""The finger on one mesh: its body, Newton's method on it, and its receptor endings; one finger serves many surfaces.

States are transferred to another mesh of the finger, where Newton's method then needs few iterations.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import get_ident
from time import perf_counter
from typing import Any, Generic, Self, TypeVar, cast
from weakref import WeakKeyDictionary

import numpy as np
from numpy.linalg import LinAlgError

from solver._kernels import SLIP, STICK
from solver._kernels.contact_system import tributary
from solver.arrays import Array, Indices
from solver.body import Body, Endings, Patches
from solver.body.finite import FiniteBody, FinitePatches
from solver.body.linear import LinearBody, LinearPatches
from solver.body.receptor import endings, join, middle
from solver.body.skin import SkinCompression, crosses_itself
from solver.constitutive import Law, Moduli, NeoHooke, Ogden, Prony
from solver.contact import width
from solver.equilibrium import EquilibriumState, Newton
from solver.failures import MIXED, NotConverged
from solver.mesh import Q2P1, MeshError, distinct, line, with_middles
from solver.mesh.mesher import FingerMesh, Sizing, finger_mesh
from solver.prediction import ROW
from solver.scene import Scene
from solver.scene.tables import Material, Materials, SceneError

NO_ENERGY = 1e-14  # relative eigenvalue of an energy form below which it is left out [-]

FingerKind = TypeVar("FingerKind", bound="Finger[Any]")
PatchKind = TypeVar("PatchKind", bound=Patches, covariant=True)  # averages over endings at one kinematics


@dataclass(frozen=True, eq=False)  # without slots, for cached properties
class Finger(ABC, Generic[PatchKind]):
    """A finger on one mesh. In its frame the bone rests and the surface rises by the indentation."""

    scene: Scene  # for finger, materials and receptor; its friction and load may belong to another surface
    geometry: FingerMesh
    newton: Newton
    body: Body

    @classmethod
    def of(cls, scene: Scene, sizing: Sizing) -> Self:
        """Return the finger of `scene` on a new mesh, which does not depend on its friction and loading.

        Raises SceneError where the outline cannot be meshed, NotConverged where the stiffness is lost in round-off.
        """
        try:
            return cls.on(scene, finger_mesh(scene.finger, scene.receptor, sizing))
        except MeshError as bad:
            radius = scene.finger.tip_radius
            raise SceneError("finger.tip_radius", radius, f"no mesh fits this finger ({bad})") from bad
        except LinAlgError as bad:
            raise NotConverged(f"The finger's stiffness is lost in round-off ({bad}), as with {MIXED[:-1]}.") from bad

    @classmethod
    @abstractmethod
    def on(cls, scene: Scene, geometry: FingerMesh) -> Self:
        """Return the finger of `scene` on an existing mesh."""

    @abstractmethod
    def patches(self, endings: Endings) -> PatchKind:
        """Return averages over `endings` on the mesh."""

    def endings(self, arcs: Array) -> PatchKind:
        """Return averages over endings of the scene's size at arc positions `arcs` (r,) [mm]."""
        return self.patches(endings(self.geometry, self.body.centre, self.scene.receptor, arcs))

    @cached_property
    def ending(self) -> PatchKind:
        """The reference ending."""
        return self.endings(np.zeros(1))

    @cached_property
    def ending_and_midpoint(self) -> PatchKind:
        """The reference ending, then its midpoint."""
        midpoint = middle(self.geometry, self.body.centre, self.scene.receptor)
        return self.patches(join(self.ending.endings, midpoint))

    @cached_property
    def row(self) -> PatchKind:
        """The row of receptors."""
        return self.endings(ROW)

    def displacement(self, state: EquilibriumState) -> Array:
        """Return the displacement (nodes, 2) of all nodes relative to the bone [mm]."""
        return self.body.displacement(state.u)

    def displacements(self, states: Sequence[EquilibriumState], only: Indices | None = None) -> Array:
        """Return the displacements (nodes, 2, c) of all nodes relative to the bone [mm] in c states.

        With `only` (node numbers), other nodes may be left at 0.
        """
        return self.body.displacement(np.stack([state.u for state in states], axis=2), only)

    def sed_ending(self, displacement: Array) -> float:
        """Return the SED averaged over the reference ending [MPa] for displacements (nodes, 2)."""
        return float(self.ending.average(displacement)[0])

    def ending_and_middle(self, states: Sequence[EquilibriumState]) -> Array:
        """Return every quantity at the reference ending and at its midpoint (c, q, 2) of several states."""
        patches = self.ending_and_midpoint
        return np.moveaxis(patches.responses(self.recover(states, patches)), 2, 0)

    def numbers(self, states: Sequence[EquilibriumState]) -> Array:
        """Return the ending's SED [MPa], the normal and the tangential force along +x [N/mm] (c, 3) of c states."""
        sed = self.ending.average(self.recover(states, self.ending))[0]
        return np.column_stack([sed, [state.force[::-1] for state in states]])

    def all_numbers(self, states: Sequence[EquilibriumState]) -> Array:
        """Return the `COUNT` results of each state (c, COUNT) whose errors are estimated.

        They are the SED, both forces, the depth, the bone's shift along +x, the contact width, the SED at the ending's
        midpoint, and every quantity at the ending.
        """
        return self.numbers_and_row(states, [])

    def numbers_and_row(self, states: Sequence[EquilibriumState], rows: Sequence[Patches] | None = None) -> Array:
        """Return `all_numbers`, then the SED of each ending of the row (c, COUNT + r); nan beyond the finger."""
        rows = [self.row] if rows is None else rows
        displacement = self.recover(states, self.ending_and_midpoint, *rows)
        responses = self.ending_and_midpoint.responses(displacement)  # (q, 2, c)
        columns = [(*s.force[::-1], s.load.depth, 0.0 - s.load.travel, self.contact_width(s)) for s in states]
        numbers = np.column_stack([responses[0, 0], columns, responses[0, 1], responses[:, 0].T])
        return np.hstack([numbers, *(row.average(displacement).T for row in rows)])

    def recover(self, states: Sequence[EquilibriumState], *patches: Patches) -> Array:
        """Return the displacements (nodes, 2, c) of states, at least at the nodes of `patches`."""
        return self.displacements(states, distinct(np.concatenate([patch.nodes() for patch in patches])))

    def contact_width(self, state: EquilibriumState) -> float:
        """Return the width of the contact along the surface [mm]."""
        x = state.skin_positions(self.newton.condensed)[:, 0]
        return width(self.geometry.skin_arcs, x, state.normal, state.touching)


@dataclass(frozen=True, eq=False)
class LinearFinger(Finger[LinearPatches]):
    """A finger at small strain on one mesh."""

    body: LinearBody
    solve_s: float  # duration of assembly and condensation [s]

    @classmethod
    def on(cls, scene: Scene, geometry: FingerMesh) -> Self:
        """Assemble and condense the finger of `scene` on an existing mesh."""
        start = perf_counter()
        body = LinearBody.of(geometry.mesh, settled_moduli(scene.materials), checked=True)
        return cls(scene, geometry, Newton(body.condensed), body, perf_counter() - start)

    def patches(self, endings: Endings) -> LinearPatches:
        """Return averages over `endings` on the mesh."""
        return LinearPatches(self.body.elastic, endings)

    @cached_property
    def ending_by_skin(self) -> Array:
        """A matrix B (a, 2 k) with which the reference ending's SED is |B u|^2 for displacements u of the skin."""
        endings, elastic = self.ending.endings, self.body.elastic
        local = elastic.state(elastic.probe_data(endings.probes), self.body.unit_displacements())  # (p, 2 k)
        weights = np.sqrt(endings.weights / endings.areas)[:, None]
        strain = np.sqrt(local.shear) * np.stack([local.xx, local.yy, local.engineering_shear / np.sqrt(2.0)])
        lines = np.vstack([*(weights * strain), weights * np.sqrt(local.lame / 2.0) * local.dilatation])
        _, sizes, turns = np.linalg.svd(lines, full_matrices=False)
        large = sizes**2 > NO_ENERGY * sizes[0] ** 2
        return sizes[large, None] * turns[large]

    def reaches_out(self, state: EquilibriumState, displacement: Array) -> bool:
        """Return whether skin touches outside the part that may, so that this part must be larger."""
        skin = self.geometry.all_skin
        below = self.geometry.mesh.nodes[skin, 1] + displacement[skin, 1] < state.load.depth * (1.0 - 1e-9)
        may = np.zeros(len(displacement), bool)
        may[self.geometry.mesh.skin] = True
        may = may[skin]
        ends = bool(state.touching[0] and not may[0]) or bool(state.touching[-1] and not may[-1])
        return ends or bool((below & ~may).any())


@dataclass(frozen=True, eq=False)
class FiniteFinger(Finger[FinitePatches]):
    """A finger at finite strain on one mesh."""

    body: FiniteBody

    @classmethod
    def on(cls, scene: Scene, geometry: FingerMesh) -> Self:
        """Return the finger of `scene` on an existing mesh."""
        body = FiniteBody.of(geometry.mesh, finite_laws(scene.materials), checked=True)
        return cls(scene, geometry, Newton(body.condensed), body)

    def patches(self, endings: Endings) -> FinitePatches:
        """Return averages over `endings` on the mesh."""
        return FinitePatches(self.body, endings)

    def transfer(self, state: EquilibriumState, source: "FiniteFinger") -> EquilibriumState:
        """Return `state`, a state on the mesh of `source`, interpolated to this mesh as a start."""
        if source not in self._bridges:
            self._bridges[source] = MeshTransfer.of(source.places, self.places)
        return self._bridges[source].transfer_state(state)

    @cached_property
    def _bridges(self) -> "WeakKeyDictionary[FiniteFinger, MeshTransfer]":
        return WeakKeyDictionary()

    @cached_property
    def places(self) -> "GridPositions":
        """Positions of nodes and quadrature points, for transfers."""
        return GridPositions.of(self.geometry, self.body)

    def skin_compression(self, state: EquilibriumState) -> SkinCompression:
        """Return the compression of the skin, with its least stretch and its kinks."""
        mesh, skin = self.geometry.mesh, self.geometry.all_skin
        touching = np.zeros(len(skin), bool)
        touching[np.searchsorted(skin, mesh.skin)] = state.touching
        return SkinCompression.of(mesh.nodes[skin], state.u[skin], self.geometry.away_from_held, touching)

    def crosses(self, state: EquilibriumState) -> bool:
        """Return whether the skin crosses itself."""
        return crosses_itself((self.geometry.mesh.nodes + state.u)[self.geometry.all_skin])


def cached_finger(kind: type[FingerKind], scene: Scene, sizing: Sizing) -> FingerKind:
    """Return the finger of `Finger.of`, cached for consecutive surfaces of one finger in one thread."""
    return cast("FingerKind", _cached_finger(kind, scene, sizing, get_ident()))


@lru_cache(maxsize=2)
def _cached_finger(kind: type["Finger[Any]"], scene: Scene, sizing: Sizing, _thread: int) -> "Finger[Any]":
    return kind.of(scene, sizing)


KINDS: Mapping[str, type[Finger[Any]]] = {"small": LinearFinger, "finite": FiniteFinger}  # by kinematics


def settled_moduli(materials: Materials) -> list[Moduli]:
    """Return the small-strain moduli of the settled response: those of relaxed tissues."""
    return [law.long_term_moduli for law in relaxing_laws(materials)]


def relaxing_laws(materials: Materials) -> list[Prony]:
    """Return the small-strain laws; a tissue that does not relax has no terms."""
    return [Prony(t.E, t.nu, tuple((term.g, term.tau) for term in t.prony)) for t in materials.by_region]


def finite_laws(materials: Materials) -> list[Law]:
    """Return the finite-strain laws of the settled response, with relaxed shear moduli; bulk moduli do not relax."""
    pairs = zip(materials.by_region, relaxing_laws(materials), strict=True)
    return [_finite(tissue, law.long_term_moduli) for tissue, law in pairs]


def _finite(tissue: Material, moduli: Moduli) -> Law:
    young, nu = moduli.engineering if tissue.prony else (tissue.E, tissue.nu)
    if tissue.law != "ogden":
        return NeoHooke(young, nu)
    return Ogden(young, nu) if tissue.stiffening is None else Ogden(young, nu, tissue.stiffening)


@dataclass(frozen=True, slots=True, eq=False)
class GridPositions:
    """Positions of the nodes and quadrature points of a mesh: arc positions [mm] and heights.

    Heights are 0 on the bone, 1 between fat and skin, 2 on the outside.
    """

    body: FiniteBody
    arcs: Array  # (2 a + 1,) of nodes along the skin
    heights: Array  # (2 b + 1,) of nodes across the tissue
    points: Array  # (e, 9, 2) quadrature points [mm]
    skin: Array  # (k,) arc positions of nodes that may touch
    lengths: Array  # (k,) their tributary lengths along the arc [mm]

    @staticmethod
    def of(finger: FingerMesh, body: FiniteBody) -> "GridPositions":
        """Return the positions of a mesh."""
        arcs, heights = with_middles(finger.arcs), _heights(finger)
        skin = finger.skin_arcs
        lengths = np.empty(len(skin))
        tributary(skin, body.middle, lengths)
        points = Q2P1.shape(Q2P1.points)[0] @ finger.mesh.local(finger.mesh.nodes)
        return GridPositions(body, arcs, heights, points, skin, lengths)


@dataclass(frozen=True, slots=True, eq=False)
class MeshTransfer:
    """Interpolation from one mesh to another of the same finger."""

    old: GridPositions
    new: GridPositions
    along: Indices  # (2 a + 1,) first of the three old lines along the skin for each new one
    along_parts: Array  # (2 a + 1, 3) weights of the three lines
    across: Indices  # (2 b + 1,) first of the three old rows for each new one
    across_parts: Array  # (2 b + 1, 3) weights of the three rows
    station: Indices  # (a, 3) old columns that hold the new quadrature points
    layer: Indices  # (b, 3) old rows that hold them
    forces: Array  # (k, old k) maps the old skin's forces, whose line density is linear between nodes
    nearest: Indices  # (k,) nearest old node of the skin

    @staticmethod
    def of(old: GridPositions, new: GridPositions) -> "MeshTransfer":
        """Return the interpolation from the `old` to the `new` mesh."""
        along, across = _interpolation(old.arcs, new.arcs), _interpolation(old.heights, new.heights)
        station, layer = (
            _piece(old_lines[::2], _inner(lines[::2]))
            for old_lines, lines in ((old.arcs, new.arcs), (old.heights, new.heights))
        )
        hats = [np.interp(new.skin, old.skin, unit, 0.0, 0.0) for unit in np.eye(len(old.skin))]
        forces = new.lengths[:, None] * np.stack(hats, axis=1) / old.lengths
        nearest = np.abs(new.skin[:, None] - old.skin).argmin(axis=1)
        return MeshTransfer(old, new, *along, *across, station, layer, forces, nearest)

    def transfer_state(self, state: EquilibriumState) -> EquilibriumState:
        """Return `state`, a state on the old mesh, as a start on the new mesh."""
        u, pressure = self.fields(state.u, state.pressure)
        states, sense = state.state[self.nearest], state.sense[self.nearest]
        states[states == STICK] = SLIP
        return EquilibriumState(u, pressure, states, sense, self.forces @ state.reaction, state.load, state.iterations)

    def fields(self, u: Array, pressure: Array) -> tuple[Array, Array]:
        """Return displacements `u` [mm] (nodes, 2) and modes of `pressure` (e, 3) on the new mesh.

        Displacements are interpolated by the shape functions in arc position and height, so that the transfer of a mesh
        to itself is exact. Pressures are interpolated too, because in a nearly incompressible body the small volume
        changes of interpolated displacements would give large ones.
        """
        old, new, three = self.old.body, self.new.body, np.arange(3)
        grid = u.reshape(len(self.old.arcs), len(self.old.heights), 2)
        lines = np.einsum("ln,lnrc->lrc", self.along_parts, grid[self.along[:, None] + three])
        u_new = np.einsum("rn,lrnc->lrc", self.across_parts, lines[:, self.across[:, None] + three]).reshape(-1, 2)
        layers = (len(self.old.heights) - 1) // 2
        host = (layers * self.station[:, None, :, None] + self.layer[None, :, None, :]).reshape(-1, 9)
        slopes = np.einsum("em,emc->ec", pressure, old.combination)[host]  # (e, 9, 3) by 1, x, y
        away = self.new.points - old.centre[host]
        field = slopes[..., 0] + slopes[..., 1] * away[..., 0] + slopes[..., 2] * away[..., 1]
        pressure_new = np.einsum("eq,eq,eqm->em", new.elements.weight, field, new.elements.modes)
        u_new[new.mesh.driven] = 0.0
        return u_new, pressure_new


def _inner(lines: Array) -> Array:
    """Return the three quadrature points (n, 3) between consecutive `lines` (n + 1,)."""
    return lines[:-1, None] + np.diff(lines)[:, None] * (1.0 + Q2P1.points[:3, 0]) / 2.0


def _heights(finger: FingerMesh) -> Array:
    """Return the heights of the nodes of a column: 0 on the bone, 1 between fat and skin, 2 on the outside."""
    fat = finger.mesh.nodes[: 2 * finger.fat + 1]
    distance = np.linalg.norm(fat - fat[0], axis=1)
    outer = 2.0 - with_middles(finger.depths) / finger.depths[0]
    return np.concatenate([distance / distance[-1], outer[1:]])


def _piece(ends: Array, points: Array) -> Indices:
    """Return the interval between `ends` (n + 1,) that holds each of `points`."""
    return np.searchsorted(ends[1:-1], points, side="right")


def _interpolation(nodes: Array, points: Array) -> tuple[Indices, Array]:
    """Return the first of three `nodes` (n,) of quadratic line elements, and their weights, for `points` (p,)."""
    ends = nodes[::2]
    piece = _piece(ends, points)
    local = 2.0 * (points - ends[piece]) / (ends[piece + 1] - ends[piece]) - 1.0
    return 2 * piece, line(local)[0]
