"""Refine a mesh where its error comes from, and choose the load steps of a path.

A mesh is refined by the part of each column and row in the error of the ending's SED.

The lines of a mesh divide it into columns and rows. The solution u and the adjoint z of the SED are computed on the
nested mesh, which divides every element into four. A column does not resolve the differences between u and z and their
quadratic interpolants across it. The mutual shear energy of both differences is the column's part of the error
(dual-weighted residuals: Becker and Rannacher 2001, Acta Numerica 10, 1; by directions: Richter 2010, Int. J. Numer.
Meth. Fluids 62, 90). The same holds for rows. The volumetric energy is left out, because interpolants of nearly
incompressible tissue change volume and solutions do not. For refinement the parts are scaled to the estimate from two
meshes (`solver.accuracy.error_estimate`), which they bound where they cancel in the change.

The mutual energy is that of the undeformed body, at finite strain too.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP, STICK
from solver._kernels.contact_system import tributary
from solver.accuracy.convergence_order import RICHARDSON, local_excess, parts_may_cancel
from solver.accuracy.error_estimate import NO_NESTED_STATE, PARTS, POINT, WIDTH, Steps, edge_errors, errors
from solver.arrays import Array, Indices
from solver.body import Patches
from solver.body.linear import Elastic
from solver.constitutive import Moduli
from solver.contact import ForceLoad
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import Finger, settled_moduli
from solver.equilibrium.load_path import end_of_path
from solver.equilibrium.load_stepping import forces_of
from solver.failures import NotConverged
from solver.mesh import ALONG, OUT, Lines, line
from solver.mesh.mesher import FINEST, FingerMesh
from solver.prediction import COUNT, NestedNumbers
from solver.scene import Scene

MAX_UNKNOWNS = 25_000  # of a mesh: its nested mesh has 100,000, solved in 1 s at small strain and in 4 s at finite
# Measured on 23 scenes at tolerances of 0.3 and 0.05 %: halving or doubling one of the next four costs 1 to 18 % more
# work, except for a smaller growth, which costs 4 % less in more rounds.
MAX_DIVISION = 4  # of one gap in a round, at most: an error says little about elements many times smaller
GROWTH = 1.3  # of the unknowns in a round, at least
TARGET_ERROR = 0.6  # sum of the parts on the next mesh, relative to the tolerance
SHARE_ORDER = 4.0  # power of a gap's size with which its part falls, where solutions are smooth
_SCALES = 200  # scales to try, each a tenth smaller
CORNERS = np.ix_([0, -1], [0, -1])  # of a mesh, by column and row
QUADRATIC = line(np.linspace(-1.0, 1.0, 5))[0]  # (5, 3) from the nodes of one element to those of its two halves


@dataclass(frozen=True, slots=True, eq=False)
class NestedGrid:
    """A nested mesh, indexed by the a x b elements that it divides, with 5 x 5 nodes each."""

    finger: Finger[Any]
    nodes: Indices  # (a, b, 5, 5)
    shear: Array  # (a, 2, b, 2, 18, 18) stiffness of the quarters' shear moduli alone
    affine: Array  # (a, b, 25, 3) functions 1, x, y
    fit: Array  # (a, b, 3, 25) their least-squares fit to nodal values

    @staticmethod
    def of(finger: Finger[Any]) -> "NestedGrid":
        """Index the nested mesh of a finger."""
        mesh, columns = finger.geometry.mesh, (len(finger.geometry.arcs) - 1) // 2
        rows = len(mesh.elements) // columns // 4
        wide, five = 4 * rows + 1, np.arange(5)
        along = 4 * np.arange(columns)[:, None, None, None] + five[:, None]
        nodes = along * wide + 4 * np.arange(rows)[:, None, None] + five
        moduli = [Moduli(tissue.shear, 0.0) for tissue in settled_moduli(finger.scene.materials)]
        shear = Elastic.of(mesh, moduli).stiffness.reshape(columns, 2, rows, 2, 18, 18)
        place = mesh.nodes.take(nodes, axis=0).reshape(columns, rows, 25, 2)
        affine = np.concatenate([np.ones((*place.shape[:3], 1)), place - place.mean(axis=2, keepdims=True)], axis=3)
        transpose = np.swapaxes(affine, 2, 3)
        fit = np.asarray(np.linalg.solve(transpose @ affine, transpose), np.float64)
        return NestedGrid(finger, nodes, shear, affine, fit)

    def parts(
        self, displacement: Array, state: EquilibriumState, forces: ForceLoad | None = None
    ) -> tuple[Array, Array, Array]:
        """Return the signed parts of columns (a, ADJOINTS) and rows (b, ADJOINTS) in the changes to this mesh.

        They belong to the first results of `all_numbers`. The third array (ADJOINTS,) is the size of the parts of
        corners between a held and a free side. `displacement` (nodes, 2) and the contact states of `state`
        under `forces`, if any, are those on this mesh.
        """
        fields = (displacement, adjoints(self.finger, displacement, state, forces))
        u, z = (_differences(self._curvature(field)) for field in fields)
        by_column, by_row = (self._energy(*pair) for pair in zip(u, z, strict=True))
        corners = np.abs(by_column[CORNERS]) + np.abs(by_row[CORNERS])
        return by_column.sum(axis=1), by_row.sum(axis=0), corners[self.singular_corners()].sum(axis=0)

    def singular_corners(self) -> NDArray[np.bool_]:
        """Return which of the mesh's `CORNERS` (2, 2) lie between a held and a free side."""
        first, second, ends = np.array([[0], [1]]), np.array([[0, 1]]), 4 * np.arange(2)
        held = self.finger.geometry.mesh.driven[self.nodes[CORNERS], 0]
        return held[first, second, 2, ends] != held[first, second, ends[:, None], 2]

    def _curvature(self, values: Array) -> Array:
        """Return nodal values (nodes, 2, ...) by element (a, b, 5, 5, 2 c), less their best fit by 1, x, y.

        Nodes of the nested mesh lie on the outline, which the element that they divide only approximates.
        """
        local = values[self.nodes].reshape(*self.affine.shape[:3], -1)
        return (local - self.affine @ (self.fit @ local)).reshape(*self.nodes.shape, -1)

    def _energy(self, u: Array, v: Array) -> Array:
        """Return the mutual shear energies (a, b, c) of the fields `u` (a, b, 5, 5, 2) and `v` (a, b, 5, 5, 2 c)."""
        a, b = self.nodes.shape[:2]
        out = np.zeros((a, b, 1, v.shape[-1] // 2))
        for right in (0, 1):
            for up in (0, 1):
                first, second = (f[:, :, 2 * right + ALONG, 2 * up + OUT].reshape(a, b, 18, -1) for f in (u, v))
                out += np.swapaxes(first, 2, 3) @ self.shear[:, right, :, up] @ second
        return out[:, :, 0]


def _differences(field: Array) -> tuple[Array, Array]:
    """Return the differences of a `field` (a, b, 5, 5, c) from its quadratic interpolants across columns and rows."""
    a, b, _, _, c = field.shape
    across_columns = (QUADRATIC @ field[:, :, ::2].reshape(a, b, 3, 5 * c)).reshape(field.shape)
    return field - across_columns, field - QUADRATIC @ field[:, :, :, ::2]


ADJOINTS = 4  # results with an adjoint: the first of `Finger.all_numbers`, SED, both forces and depth


def adjoints(
    finger: Finger[Any], displacement: Array, state: EquilibriumState, forces: ForceLoad | None = None
) -> Array:
    """Return the derivatives (nodes, 2, ADJOINTS) of results with respect to nodal forces, at fixed contact states.

    `forces` are those that the state is under, or None for a given depth. A result that is given has zeros. They solve
    the transpose of the linearised contact problem.

    Where skin slips, its tangential force changes by mu times its normal force. So the adjoint's normal component plus
    mu times the tangential one, in the sense of the friction, is the same on all touching skin. At a given depth it is
    0, or -1 for the normal force. Under a given normal force the surface's forces on the adjoint sum to 0 instead, or 1
    for the depth. The same holds for the tangential component where skin sticks, and a given drag.
    """
    goal = finger.ending.gradient(displacement)
    goal[finger.geometry.mesh.driven] = 0.0
    tangent = finger.body.tangent(state.u, state.pressure)
    load, stiffness = tangent.condense(goal), tangent.stiffness.copy()
    movable = stiffness.diagonal() != 0.0
    stiffness[~movable, ~movable] = 1.0
    slopes = np.zeros((len(state.state), len(state.state)))
    if (at_bound := state.state == SHEAR_LIMITED).any():  # their forces change with the lengths of skin
        lengths = np.zeros((len(at_bound), len(at_bound)))
        for position, length in zip(np.eye(len(at_bound)), lengths, strict=True):
            tributary(position, finger.newton.skin.middle, length)
        slopes = state.load.tau * state.sense * np.where(at_bound, lengths, 0.0)  # of force i by position j, at [j, i]
        stiffness[::2, ::2] -= slopes
    free = movable.reshape(-1, 2).all(axis=1)
    touching, sticking = (np.flatnonzero(free & which) for which in (state.state != OPEN, state.state == STICK))
    y, x = 2 * touching + 1, 2 * sticking
    reactions, unit = np.concatenate([y, x]), np.eye(len(stiffness))
    lever = np.where(state.state == SLIP, state.load.mu * state.sense, 0.0)[touching, None]
    constraints = unit[reactions]
    constraints[: len(y)] += lever * unit[y - 1]
    motions = np.zeros((len(reactions), 2))  # of the surface along y and x
    motions[: len(y), :1], motions[: len(y), 1:], motions[len(y) :, 1] = 1.0, lever, 1.0
    by_force = [forces is not None and len(y) > 0, forces is not None and forces.tangential is not None and len(x) > 0]
    sums = np.stack([reactions % 2 == 1, reactions % 2 == 0])[by_force]
    system = np.block([
        [stiffness, -unit[:, reactions], np.zeros((len(stiffness), len(sums)))],
        [constraints, np.zeros((len(reactions), len(reactions))), -motions[:, by_force]],
        [np.zeros((len(sums), len(stiffness))), sums, np.zeros((len(sums), len(sums)))],
    ])  # fmt: skip
    right = np.zeros((len(system), ADJOINTS))
    right[: len(stiffness), 0], right[: len(stiffness) : 2, 2] = tangent.skin_load(load), slopes.sum(axis=1)
    right[len(stiffness) : len(stiffness) + len(reactions), 1:3] = -motions
    right[len(system) - len(sums) :, 3] = np.arange(len(sums)) == 0
    skin = np.asarray(np.linalg.solve(system, right)[: len(stiffness)], np.float64)
    of_forces = tangent.displacement(np.ascontiguousarray(skin[:, 1:]), tangent.no_load)
    return np.concatenate([tangent.displacement(skin[:, :1].copy(), load), of_forces], axis=2)


FingerState = tuple[Finger[Any], EquilibriumState]


def nested_numbers(
    scene: Scene,
    numbers: Array,
    answer: FingerState,
    nested: FingerState,
    values: Array,
    changes: tuple[Array, Array],
    steps: Steps | None,
) -> NestedNumbers | NotConverged:
    """Return the results of a nested state, with the shares of columns and rows where a finer mesh may be needed.

    `numbers` (COUNT,) are the scene's results in the `answer`. `values` (COUNT + r,) are the `numbers_and_row` of the
    `nested` state, and `changes` (m, COUNT + r) come from `edge_changes` in both. `steps` are the load steps where the
    state depends on its load path. Returns NO_NESTED_STATE where no equilibrium exists with an edge moved, as at a
    friction limit.
    """
    edges = edge_errors(*changes, linear=[WIDTH])
    if np.isinf(edges).any():
        return NO_NESTED_STATE
    results = values[:COUNT] if steps is None else steps.extrapolate(values[:COUNT])
    change, excess, relative_excess = np.abs(results - numbers), np.zeros(COUNT), 0.0
    local = _local_parts(scene, *nested) if parts_may_cancel(scene) else None
    if local is not None:
        excess[:ADJOINTS] = np.maximum(local_excess(*local) - (RICHARDSON - 1.0) * change[:ADJOINTS], 0.0)
        relative_excess = float(excess[0]) / max(float(results[0]), np.finfo(float).tiny)
        excess[POINT:] = relative_excess * np.abs(results[POINT:])
    outcome = NestedNumbers(results, edges[..., :COUNT], values[COUNT:], edges[..., COUNT:], excess, relative_excess)
    target = scene.solve.target
    misses_tolerance = target is not None and errors(scene, numbers, outcome, steps).error_estimate > target
    if not misses_tolerance and scene.solve.contrast_tolerance is None:
        return outcome
    parts = np.abs((_local_parts(scene, *nested) if local is None else local)[0][:, 0])
    parts *= (RICHARDSON * change[0] + excess[0]) / max(float(parts.sum()), np.finfo(float).tiny)
    columns = np.concatenate([_columns_of_edges(*state) for state in (answer, nested)])
    np.add.at(parts, columns, edges[edges[..., 0].sum(axis=1).argmax(), :, 0])
    whole = float(parts.sum())
    return replace(outcome, shares=parts / whole if whole > 0.0 else None)


def _local_parts(scene: Scene, finger: Finger[Any], state: EquilibriumState) -> tuple[Array, Array]:
    """Return `NestedGrid.parts` of a nested state: of columns and rows (a + b, ADJOINTS), of corners (ADJOINTS,)."""
    forces = forces_of(scene, state.load)
    columns, rows, corners = _grid(finger).parts(finger.displacement(state), state, forces)
    return np.concatenate([columns, rows]), corners


def _columns_of_edges(finger: Finger[Any], state: EquilibriumState) -> Indices:
    """Return the columns (m,) of the answer's mesh that hold the edges of contact of a state on it or nested in it."""
    edge = np.flatnonzero(np.diff(state.state))  # node before each edge of contact
    middle = (finger.geometry.skin_arcs[edge] + finger.geometry.skin_arcs[edge + 1]) / 2.0
    return finger.geometry.lines.columns(middle)


@lru_cache(maxsize=1)
def _grid(finger: Finger[Any]) -> NestedGrid:
    """Return the grid of a nested finger; consecutive surfaces of one mesh share it."""
    return NestedGrid.of(finger)


def refine_lines(mesh: FingerMesh, parts: Array | None) -> Lines | None:
    """Return the lines of a finer mesh, or None where no mesh may be finer.

    `parts` (a + b,) are the errors of the columns and rows of `mesh` relative to the tolerance, None where they are
    unknown. The fewest lines for a given sum of errors divide a gap into a number of parts that grows as its error per
    cost of a line to the power 1/(`SHARE_ORDER` + 1). Where errors fall more slowly, at edges and corners, another
    round follows.
    """
    lines = mesh.lines
    counts = np.array([len(lines.arcs) - 1, lines.rows])
    if parts is None:
        halves = np.full(counts.sum(), 2)
        return lines.divide(*np.split(halves, counts[:1])) if _unknowns(halves, counts) <= MAX_UNKNOWNS else None
    most = np.clip(_lengths(mesh) // (FINEST * mesh.outline.finger.tip_radius), 1.0, MAX_DIVISION)
    if parts[most == 1.0].sum() > 1.0:  # gaps too small to be divided miss the tolerance alone
        return None
    per_line = parts * np.repeat(counts, counts)
    least = GROWTH * _unknowns(np.ones(len(parts)), counts)
    best = None
    for scale in per_line.max() * np.geomspace(1.0, 1e-9, _SCALES):
        optimum = np.maximum(np.rint((per_line / scale) ** (1.0 / (SHARE_ORDER + 1.0))), 1.0)
        division = np.minimum(optimum, most)
        if (unknowns := _unknowns(division, counts)) > MAX_UNKNOWNS:
            break
        best = division
        if np.sum(parts / optimum**SHARE_ORDER) <= TARGET_ERROR and unknowns >= least:
            break
    if best is None or best.max() == 1.0:
        return None
    return lines.divide(*np.split(best.astype(np.int64), counts[:1]))


def _unknowns(parts: Array, counts: Indices) -> float:
    """Return the approximate number of unknowns once `counts` columns and rows are divided into `parts`."""
    columns, rows = (float(part.sum()) for part in np.split(parts, counts[:1]))
    return 2.0 * (2.0 * columns + 1.0) * (2.0 * rows + 1.0)


def _lengths(mesh: FingerMesh) -> Array:
    """Return the smallest width of each column and row (a + b,) [mm]."""
    lines, finger = mesh.lines, mesh.outline.finger
    fat = finger.pulp_thickness() - finger.epidermis - finger.dermis
    scales = ((lines.arcs, 1.0), (lines.bone, finger.bone_radius), (lines.fat, fat), (lines.skin, -1.0))
    return np.concatenate([scale * np.diff(part) for part, scale in scales])


def choose_steps(scene: Scene, finger: Finger[Patches], settled: EquilibriumState | None = None) -> Steps | None:
    """Return the load steps that a scene needs, judged on one mesh, of which `settled` is the state if known.

    None where the state does not depend on its load path. Raises SolveFailure, Cancelled.
    """
    if settled is not None and not settled.load.path_dependent:
        return None
    ends = [end_of_path(scene, finger, 1.0) if settled is None or scene.viscoelastic else settled]
    usual, *fewer = finger.all_numbers(ends + [end_of_path(scene, finger, part) for part in PARTS.tolist()])
    return Steps.of(usual, np.array(fewer), scene.solve.target)


def steps_of_press(scene: Scene, finger: Finger[Patches]) -> int:
    """Return the factor on the usual steps for a load path whose end does not depend on them.

    The end of its press determines it. Raises as `choose_steps`.
    """
    if scene.solve.course == "steady" or scene.friction.frictionless:
        return 1
    steps = choose_steps(scene.press_only(), finger)
    return 1 if steps is None else steps.factor
