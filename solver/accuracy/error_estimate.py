"""How far the numbers of a scene may be off: what halving every element changes, and where contact may end.

The answer's mesh H and its nested mesh h (every element in four) are solved. What a number J changes between them holds
the error of all that both resolve. Errors of quadratic elements beneath a contact fall at least with the square of the
element, so that the error on H is at most 1 + 1/4 + 1/16 + ... = 4/3 of the change (Roache 1994).
What two meshes may agree on by chance is where contact states change: an edge of contact, or of skin that sticks or
slips at the bound, lies anywhere between two nodes. Each edge is moved by one node of h to either side, every other
state kept, and the linearised body is solved again. The true edge lies within half that distance, so half the larger
change counts. Edges err independently: their changes are added as squares.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from solver._kernels.active_set import SINGULAR
from solver.arrays import Array
from solver.equilibrium.load_path import Steps
from solver.equilibrium.newton import EQUILIBRIUM, EquilibriumState, Given, Newton
from solver.prediction import COUNT, FORCES_AND_PLACES, NestedNumbers, Response
from solver.quantities import NAMES
from solver.scene.scene import Scene

FROM_HALVING = 4.0 / 3.0  # error on a mesh by what halving its elements changes: errors fall with their square
FROM_EDGES = 0.5  # of what a number changes by when an edge of contact moves by one node
SHIFT = 4  # place of the bone's shift among the numbers


class Errors(NamedTuple):
    """How far numbers may be off: relative, but for the shift. None for what was given, or is not there."""

    sed: float
    normal: float | None
    tangential: float | None  # 0 where nothing rubs
    indentation: float | None
    shift: float | None  # [mm]
    width: float | None  # of the contact
    point: float  # of the SED in the ending's middle
    responses: Array  # (q,) of each quantity at the ending, in its own unit; nan where nothing is known


def edge_changes(
    newton: Newton,
    states: Sequence[tuple[EquilibriumState, Given | None]],
    numbers: Callable[[Sequence[EquilibriumState]], Array],
) -> tuple[Array, Array]:
    """Return the numbers (c, n) of states, and what each changes by when its edges of contact move by a node (c, n).

    The latter is the root of the sum of squares over a state's edges. `states` are equilibria, each with the forces it
    is under or None for its depth; `numbers` makes (c, n) of c states. Infinite where contact with a moved edge has no
    equilibrium.
    """
    moved = [_with_moved_edges(newton, state, given) for state, given in states]
    known = [one for ones in moved for one in ones if one is not None]
    values = numbers([*(state for state, _ in states), *known])
    here, there = values[: len(states)], iter(values[len(states) :])
    out = np.zeros_like(here)
    for number, ones in enumerate(moved):
        changes = [np.full_like(here[0], np.inf) if one is None else np.abs(next(there) - here[number]) for one in ones]
        worst = np.max(np.reshape(changes, (len(ones) // 2, 2, -1)), axis=1) if ones else np.zeros((1, 1))
        out[number] = np.sqrt(np.sum(worst**2, axis=0))
    return here, out


def nested_numbers(values: Array, changes: Array, steps: Steps | None) -> NestedNumbers | None:
    """Return what a nested mesh has of one scene: its `values` (COUNT + r,) and what edges of contact change of them.

    `steps` are those taken where its state depends on its way. None where contact with a moved edge has no equilibrium,
    as at a limit of friction.
    """
    if np.isinf(changes).any():
        return None
    numbers = values[:COUNT] if steps is None else steps.taken(values[:COUNT])
    return NestedNumbers(numbers, changes[:COUNT], values[COUNT:], changes[COUNT:])


def _with_moved_edges(newton: Newton, state: EquilibriumState, given: Given | None) -> list[EquilibriumState | None]:
    """Return the equilibria with each edge of contact moved by a node to one side and to the other, edge after edge."""
    x = np.ascontiguousarray(state.place(newton.condensed)[:, 0])
    edges = np.flatnonzero(np.diff(state.state)).tolist()
    pairs = [pair for edge in edges for pair in ((edge, edge + 1), (edge + 1, edge))]
    kept = newton.condensed.found is state.u  # the tangent of the last iteration is there still
    linearise = newton.relinearise if kept else newton.linearise
    found = linearise(state, state.load, x, 0, given)
    return [_moved(newton, state, given, x, *pair) if found else None for pair in pairs]


def _moved(
    newton: Newton, state: EquilibriumState, given: Given | None, x: Array, node: int, other: int
) -> EquilibriumState | None:
    """Return the equilibrium of the body, linearised at `state`, with `node` in the contact state of the `other`.

    `x` (k,) are the positions of the skin's nodes along the surface. None where there is no such equilibrium.
    """
    states, senses = state.state.copy(), state.sense.copy()
    states[node], senses[node] = states[other], senses[other]
    begin = replace(state, state=states, sense=senses)
    if newton.solve_contact(begin, state.load, x, 0, given) == SINGULAR:
        return None
    deeper, along = newton.system.motion.tolist() if given is not None else (0.0, 0.0)
    load = state.load._replace(depth=state.load.depth + deeper, travel=state.load.travel + along)
    after = newton.moved(begin, load, newton.steps[:, EQUILIBRIUM].copy(), x)[0]
    return replace(after, state=states, sense=senses)  # and not those that the moved edge would call for


def errors(scene: Scene, numbers: Array, nested: NestedNumbers | None, steps: Steps | None) -> Errors:
    """Return the errors of the `numbers` (COUNT,) of `all_numbers`.

    `nested` is None where the nested mesh has no such state, so that nothing is known of them; `steps` are those that a
    course has taken whose end depends on its way.
    """
    if nested is None:
        return _without_given(scene, Errors(1.0, 1.0, 1.0, 1.0, None, 1.0, 1.0, np.full(len(NAMES), np.nan)))
    off = FROM_HALVING * np.abs(nested.numbers - numbers) + FROM_EDGES * nested.of_edges
    if steps is not None:
        off += steps.error
    relative = off / np.maximum(np.abs(numbers), np.finfo(float).tiny)
    sed, normal, tangential, depth, _, width, point = relative[:FORCES_AND_PLACES].tolist()
    found = Errors(sed, normal, tangential, depth, float(off[SHIFT]), width, point, off[FORCES_AND_PLACES:])
    return _without_given(scene, found)


def responses(numbers: Array, errors: Errors) -> dict[str, Response]:
    """Return the quantities at the ending among `numbers` (COUNT,), each with its error, by name."""
    pairs = zip(NAMES, numbers[FORCES_AND_PLACES:].tolist(), errors.responses.tolist(), strict=True)
    return {name: Response(value, error) for name, value, error in pairs}


def row_errors(row: Array, nested: NestedNumbers | None) -> Array:
    """Return the errors of the SED of a row of receptors `row` (r,), relative (r,); nan where nothing is known."""
    if nested is None:
        return np.full(len(row), np.nan)
    off = FROM_HALVING * np.abs(nested.row - row) + FROM_EDGES * nested.row_of_edges
    return off / np.maximum(row, np.finfo(float).tiny)


def _without_given(scene: Scene, found: Errors) -> Errors:
    """Return the errors without those of what the scene gives, and of the drag where nothing rubs."""
    by_force, dragged = scene.normal_force is not None, scene.loading.dragged
    rubs = scene.friction.mu > 0.0 and scene.friction.cap > 0.0
    return found._replace(
        normal=None if by_force else found.normal,
        tangential=None if dragged else found.tangential if rubs else 0.0,
        indentation=found.indentation if by_force else None,
        shift=found.shift if dragged else None,
    )
