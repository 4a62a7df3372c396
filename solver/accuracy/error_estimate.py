"""Estimate the errors of a scene's results from its nested mesh and from moving the edges of contact.

The scene is solved on the mesh H of the answer and on its nested mesh h, which divides every element into four. Errors
of quadratic elements beneath a contact fall at least with the square of the element size, so that the error on H is at
most 4/3 of the change from H to h. The error on h is a quarter of that. Parts of the mesh may cancel in the change of a
result, but not in its error. Where trials show this, a bound from these parts counts, if it is larger
(`convergence_order`).

Two meshes may agree by chance on where contact states change: an edge of contact, of stick or of slip at the bound lies
anywhere between two nodes. On H and on h, each edge is moved by one node to either side at otherwise fixed contact
states, and the linearised body is solved again. A result is a parabola of an edge's position about the true one, so
that a share of the larger change bounds the error by this edge (`edge_errors`).

Much of the error is common to all surfaces of one finger and cancels in their differences. The rest is estimated in the
same way for the worst pair of surfaces. Only the edges differ: those of two surfaces err independently, so that their
changes add as squares.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import ceil
from typing import NamedTuple

import numpy as np

from solver._kernels.active_set import SINGULAR
from solver.accuracy.convergence_order import RICHARDSON
from solver.arrays import Array
from solver.contact import ForceLoad
from solver.equilibrium import EquilibriumState, Newton
from solver.failures import NotConverged
from solver.mesh import Lines
from solver.prediction import COUNT, FORCES_AND_PLACES, ROW, NestedNumbers, Prediction, Response, percent
from solver.quantities import NAMES
from solver.scene import Scene
from solver.scene.tables import USUAL_TOLERANCE

SHIFT, WIDTH, POINT = 4, 5, 6  # indices in `all_numbers`; those from POINT on are at the receptor


def half_width(change: Array, edges: Array) -> Array:
    """Return the errors of results (...) from their `change` to the nested mesh and their `edge_errors` (2, m, ...)."""
    return RICHARDSON * np.abs(change) + edges.sum(axis=1).max(axis=0)


def edge_errors(on_mesh: Array, on_nested: Array, linear: Sequence[int] = ()) -> Array:
    """Return bounds (2, m + k, n) of the parts of n errors that m edges of contact add on H, and k edges on h.

    `on_mesh` (m, n) and `on_nested` (k, n) are the results' changes as each edge moves by a node of its mesh. A result
    is a parabola of the edge's position about the true one, which is at most half a node away. So the error by an edge
    lies between 0 and a quarter of the change. The errors E_H and E_h have one sign and add r E_h - (r - 1) E_H to the
    extrapolated error, r being `RICHARDSON`. So the larger of both terms counts, of the sums over the second
    axis. The results `linear` are linear in the position, to either side of the true one. Then errors are at most half
    the change, and both terms add.

    >>> edge_errors(np.array([[0.12]]), np.array([[0.03]])).sum(axis=1).max(axis=0).round(9)
    array([0.01])
    """
    on_mesh, on_nested = (RICHARDSON - 1.0) / 4.0 * on_mesh, RICHARDSON / 4.0 * on_nested
    out = np.zeros((2, len(on_mesh) + len(on_nested), on_mesh.shape[1]))
    out[0, : len(on_mesh)], out[1, len(on_mesh) :] = on_mesh, on_nested
    out[:, :, list(linear)] = 2.0 * out[:, :, list(linear)].sum(axis=0)
    return out


PARTS = np.array([0.48, 0.68])  # of the usual steps: 12 and 17 of 25, about a half and two thirds
MAX_STEP_FACTOR = 16  # times the usual steps: one second on a coarse mesh at small strain
STEP_ERROR_SHARE = 0.3  # of a tolerance, for the error of the steps; the mesh, which costs more, gets the rest


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """The load steps of one path and the error by them, for the c results of `all_numbers`.

    A press with friction, or a drag below the friction limit, depends on its load path: a point sticks where it first
    touches, which is known to within a step. On average the error is inversely proportional to the number of steps, but
    it falls irregularly. It is nearly the same on every mesh, and is measured on a coarse one by two paths of fewer
    steps. With an error c after the usual steps and c/p after a part p of them, the end changes by c (1/p - 1). Either
    path may agree with the usual one by chance, so that both estimates of c are added. Full slip has no such error.
    """

    factor: int  # ratio of their number to the usual number
    excess: Array  # (c,) results after the usual steps less those after many
    bound: Array  # (c,) of the magnitude of `excess`

    @staticmethod
    def of(usual: Array, fewer: Array, tolerance: float | None) -> "Steps":
        """Return the fewest steps that meet a tolerance.

        `usual` (c,) and `fewer` (2, c) are results after the usual steps and after PARTS of them, on a coarse mesh.
        """
        excess = (fewer - usual) / (1.0 / PARTS - 1.0)[:, None]
        bound = np.abs(excess).sum(axis=0)
        relative_error = float(bound[0]) / max(abs(float(usual[0])), np.finfo(float).tiny)
        factor = min(
            max(1, ceil(relative_error / (STEP_ERROR_SHARE * (tolerance or USUAL_TOLERANCE)))), MAX_STEP_FACTOR
        )
        return Steps(factor, excess.mean(axis=0), bound)

    @property
    def error(self) -> Array:
        """Error of the results (c,) by the finite number of steps."""
        return self.bound / self.factor

    def extrapolate(self, usual: Array) -> Array:
        """Extrapolate results (c,) after the usual steps to the steps of this path."""
        return usual - (1.0 - 1.0 / self.factor) * self.excess


class Errors(NamedTuple):
    """Error estimates, by the fields of `Prediction`; None for results that are given or do not exist."""

    error_estimate: float
    corrected_error: float
    sed_point_error: float
    normal_force_error: float | None
    tangential_force_error: float | None
    indentation_error: float | None
    shift_error: float | None
    contact_width_error: float | None
    responses: Mapping[str, Response]


def edge_changes(
    newton: Newton,
    state: EquilibriumState,
    forces: ForceLoad | None,
    numbers: Callable[[Sequence[EquilibriumState]], Array],
) -> tuple[Array, Array]:
    """Return the results (n,) of one state and their changes (m, n), as `edge_changes_of_all`."""
    (values,), (changes,) = edge_changes_of_all(newton, [(state, forces)], numbers)
    return values, changes


def edge_changes_of_all(
    newton: Newton,
    states: Sequence[tuple[EquilibriumState, ForceLoad | None]],
    numbers: Callable[[Sequence[EquilibriumState]], Array],
) -> tuple[Array, list[Array]]:
    """Return the results (c, n) of states, and for each state their changes (m, n) as each of its m edges moves.

    An edge of contact moves by one node to either side, and the larger change counts. `states` are equilibria with
    their forces, or None for a given depth. `numbers` returns (c, n) for c states. A change is infinite where no
    equilibrium exists with the edge moved.
    """
    variants = [_move_edges(newton, state, forces) for state, forces in states]
    solutions = [state for edges in variants for sides in edges for state in sides if state is not None]
    values = numbers([*(state for state, _ in states), *solutions])
    base, variant_values = values[: len(states)], iter(values[len(states) :])
    size = base.shape[1]

    def change(sides: list[EquilibriumState | None], before: Array) -> Array:
        changes = [np.full(size, np.inf) if state is None else np.abs(next(variant_values) - before) for state in sides]
        return np.max(changes, axis=0)

    return base, [
        np.array([change(sides, before) for sides in edges]).reshape(-1, size)
        for edges, before in zip(variants, base, strict=True)
    ]


NO_NESTED_STATE = NotConverged("the nested mesh has no such state: ask for less friction or depth")


def _move_edges(
    newton: Newton, state: EquilibriumState, forces: ForceLoad | None
) -> list[list[EquilibriumState | None]]:
    """Return for each edge of contact the equilibria with it moved by a node to either side.

    A single touching node stays, since there is no contact without it.
    """
    x = np.ascontiguousarray(state.skin_positions(newton.condensed)[:, 0])
    edges = np.flatnonzero(np.diff(state.state)).tolist()
    reuse = newton.condensed.equilibrium is state.u  # the last iteration's tangent is still in memory
    solvable = newton.linearise(state, x, 0, forces, reuse=reuse)
    is_single = np.count_nonzero(state.touching) == 1
    return [
        [
            _move_edge(newton, state, forces, x, *pair) if solvable else None
            for pair in ((edge, edge + 1), (edge + 1, edge))
            if not (is_single and state.touching[pair[0]])
        ]
        for edge in edges
    ]


def _move_edge(
    newton: Newton, state: EquilibriumState, forces: ForceLoad | None, x: Array, node: int, neighbour: int
) -> EquilibriumState | None:
    """Return the equilibrium of the body linearised at `state`, with `node` in the contact state of its `neighbour`.

    `x` (k,) are the positions of the skin's nodes along the surface. None where no such equilibrium exists.
    """
    states, senses = state.state.copy(), state.sense.copy()
    states[node], senses[node] = states[neighbour], senses[neighbour]
    start = replace(state, state=states, sense=senses)
    if newton.solve_contact(start, x, 0, forces) == SINGULAR:
        return None
    after = newton.correct(start, lambda _load: x)[0]
    return replace(after, state=states, sense=senses)  # the prescribed states, not those that would follow


def errors(scene: Scene, numbers: Array, nested: NestedNumbers | None, steps: Steps | None) -> Errors:
    """Return the error estimates of `numbers` (COUNT,) of `all_numbers`.

    `nested` is None where the nested mesh has no such state, so that the errors are unknown. `steps` are the load steps
    of a state that depends on its load path.
    """
    if nested is None:
        error, relative, corrected = np.full(COUNT, np.nan), np.ones(COUNT), 1.0
    else:
        change = nested.numbers - numbers
        error = half_width(change, nested.edge_errors) + nested.excess
        if steps is not None:
            error += steps.error
        relative = error / np.maximum(np.abs(numbers), np.finfo(float).tiny)
        corrected = float(error[0] - abs(change[0])) / max(abs(float(nested.numbers[0])), np.finfo(float).tiny)
    sed, normal, tangential, depth, _, width, point = relative[:FORCES_AND_PLACES].tolist()
    by_force, by_drag = scene.normal_force is not None, scene.loading.dragged
    quantities = np.stack([numbers, error], axis=1)[FORCES_AND_PLACES:].tolist()
    return Errors(
        error_estimate=sed,
        corrected_error=corrected,
        sed_point_error=point,
        normal_force_error=None if by_force else normal,
        tangential_force_error=None if by_drag else 0.0 if scene.friction.frictionless else tangential,
        indentation_error=depth if by_force else None,
        shift_error=float(error[SHIFT]) if by_drag and nested is not None else None,
        contact_width_error=width,
        responses={name: Response(*row) for name, row in zip(NAMES, quantities, strict=True)},
    )


def row_errors(row: Array, nested: NestedNumbers | None, lines: Lines) -> Array:
    """Return the relative errors (r,) of the SED of a row of receptors `row` (r,) at `ROW`; nan where unknown.

    `lines` are those of the mesh.
    """
    if nested is None:
        return np.full(len(row), np.nan)
    change = largest_nearby(nested.row - row, ROW, lines)
    error = half_width(change, nested.row_edge_errors) + nested.relative_excess * np.abs(row)
    return error / np.maximum(row, np.finfo(float).tiny)


def largest_nearby(changes: Array, arcs: Array, lines: Lines) -> Array:
    """Return for each receptor of a row the largest of the `changes` (..., r) at most the width of its column away.

    Along a row the error of a mesh varies from element to element, and passes zero elsewhere than the change to the
    nested mesh. `arcs` (r,) are the receptors' positions [mm]. A change that is nan stays so.
    """
    near = np.abs(arcs[:, None] - arcs) <= np.diff(lines.arcs)[lines.columns(arcs)][:, None]
    largest = np.fmax.reduce(np.where(near, np.abs(changes)[..., None, :], 0.0), axis=-1)
    return np.where(np.isnan(changes), np.nan, largest)


COMPARED = ("SED", "normal force", "drag", "indentation")  # the first four of `all_numbers`
WARNING_SHARE = 0.05  # error of differences relative to their range, from which a warning is given
LEAST_RANGE = 1e-5  # smallest range relative to the values: smaller errors of differences give no warning
SENSOR_RESOLUTION = 1e-3  # relative, of a force or depth


def compared_sets(scenes: Mapping[int, Scene]) -> list[list[int]]:
    """Return the sets of scenes that are compared: two or more surfaces under the same loading.

    Scenes with quick evidence belong to no set. They are variants of one surface, whose differences come from
    `solver.response.nearby`.
    """
    sets: dict[object, list[int]] = {}
    for number, scene in scenes.items():
        if scene.solve.evidence != "quick":
            sets.setdefault(scene.loading_group, []).append(number)
    return [numbers for numbers in sets.values() if len({scenes[n] for n in numbers}) > 1]


class ContrastError(NamedTuple):
    """The error estimate of differences between surfaces, relative to their range."""

    share: float  # of the SED, for the worst pair [-]
    warning: str = ""  # a sentence where the share of the SED, a force or the depth is too large


def contrast_error(predictions: Sequence[Prediction]) -> ContrastError:
    """Return the error estimate of differences between surfaces.

    For forces and depth, only errors above the resolution of sensors give a warning. A surface without a state on the
    nested mesh is left out, since its error is unknown.
    """
    with_estimate = [(prediction, prediction.nested) for prediction in predictions if prediction.nested is not None]
    if len(with_estimate) < 2:
        return ContrastError(0.0)
    count = len(COMPARED)
    numbers = np.abs([(o.sed_ending, o.normal_force, o.tangential_force, o.indentation) for o, _ in with_estimate])
    change = np.abs([nested.numbers[:count] for _, nested in with_estimate]) - numbers
    edges = np.stack([np.linalg.norm(nested.edge_errors[..., :count], axis=1) for _, nested in with_estimate], axis=1)
    pairs = np.array(list(combinations(range(len(with_estimate)), 2))).T
    apart = change[pairs[0]] - change[pairs[1]]
    worst = half_width(apart, np.hypot(edges[:, pairs[0]], edges[:, pairs[1]])[:, None])
    off_by, mean = worst.max(axis=0), numbers.mean(axis=0)
    shares = off_by / np.maximum(
        np.maximum(np.ptp(numbers, axis=0), LEAST_RANGE * mean / WARNING_SHARE), np.finfo(float).tiny
    )
    noticeable = off_by > SENSOR_RESOLUTION * mean
    noticeable[0] = True
    excess = np.where((shares > WARNING_SHARE) & noticeable, shares, 0.0)
    first = int(excess.argmax())
    part = percent(float(excess[first])) if excess[first] < 1.0 else "more than all"
    small = f"Differences in {COMPARED[first]} from the surfaces solved with this one are small"
    warning = f"{small}, and may be off by {part} of their range." if excess.any() else ""
    return ContrastError(float(shares[0]), warning)


Numbers = Callable[[Newton, EquilibriumState], Array]


class ErrorInterval(NamedTuple):
    """Results (n,) of a state, each in its unit."""

    value: Array
    corrected: Array  # value on the nested mesh, the best one
    error: Array  # half width of the interval about either


def estimate_errors(
    numbers: Numbers,
    newton: Newton,
    state: EquilibriumState,
    nested: tuple[Newton, EquilibriumState],
    forces: ForceLoad | None = None,
    fewer: Sequence[EquilibriumState] = (),
) -> ErrorInterval:
    """Return the `numbers` (n,) of a state with the error estimate of each.

    `nested` is the same state on the halved mesh (`solver.mesh`), `forces` the forces it is under, if any. Where
    the state is the end of a load path on which skin sticks, `fewer` are its ends on the same mesh after `PARTS` of
    the load steps. Errors are infinite where contact with a moved edge has no equilibrium.
    """
    (value, on_mesh), (corrected, on_nested) = (
        edge_changes(body, equilibrium, forces, lambda states, body=body: np.array([numbers(body, s) for s in states]))
        for body, equilibrium in ((newton, state), nested)
    )
    error = half_width(corrected - value, edge_errors(on_mesh, on_nested))
    if fewer:
        if len(fewer) != len(PARTS):
            raise ValueError(f"fewer has {len(fewer)} states; give one after each of {PARTS.tolist()} of the steps")
        error += Steps.of(value, np.array([numbers(newton, state) for state in fewer]), None).bound
    return ErrorInterval(value, corrected, error)
