"""How far the numbers of a scene may be off: what halving every element changes, and where contact may end.

The answer's mesh H and its nested mesh h (every element in four) are solved. What a number J changes between them holds
the error of all that both resolve. Errors of quadratic elements beneath a contact fall at least with the square of the
element, so that the error on H is at most 1 + 1/4 + 1/16 + ... = 4/3 of the change (Roache 1994).
What two meshes may agree on by chance is where contact states change: an edge of contact, or of skin that sticks or
slips at the bound, lies anywhere between two nodes. Each edge is moved by one node of h to either side, every other
state kept, and the linearised body is solved again. A third of the larger change counts, since numbers follow an edge
by a parabola about its true place. Edges err independently: their changes are added as squares.

Much of what a mesh makes wrong is the same for all surfaces of one finger and falls out of their differences. What is
left in a difference is estimated in the same way: each surface has its edges of contact elsewhere.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import ceil
from typing import NamedTuple

import numpy as np

from solver._kernels.active_set import SINGULAR
from solver.arrays import Array
from solver.body import Patches
from solver.equilibrium import EQUILIBRIUM, EquilibriumState, ForceLoad, Newton
from solver.equilibrium.finger import Finger
from solver.equilibrium.load_path import end
from solver.prediction import COUNT, FORCES_AND_PLACES, NestedNumbers, Prediction, Response, percent
from solver.quantities import NAMES
from solver.scene import Scene

FROM_HALVING = 4.0 / 3.0  # error on a mesh by what halving its elements changes: errors fall with their square
# Of what a number changes by when an edge of contact moves by one node. Numbers follow an edge's place by a parabola
# about the true one, half a node away at most; the width follows it by a line.
FROM_EDGES, WIDTH_FROM_EDGES = 1.0 / 3.0, 0.5
SHIFT, WIDTH = 4, 5  # places of the bone's shift and of the contact's width among the numbers
_PARTS_OF_EDGES = np.where(np.arange(COUNT) == WIDTH, WIDTH_FROM_EDGES, FROM_EDGES)


def half_width(change: Array, edges: Array, part: Array | float = FROM_EDGES) -> Array:
    """Return how far numbers may be off which change by so much on the nested mesh.

    `edges` is what they change by there when edges of contact move by a node, of which a `part` counts.
    """
    return FROM_HALVING * np.abs(change) + part * edges


PARTS = np.array([0.48, 0.68])  # of the usual steps: 12 and 17 of 25, about a half and two thirds
MOST = 16  # times the usual steps, at most: a second's work on a coarse mesh at small strain
USUAL = 0.003  # tolerance that steps are chosen for where none is asked for, as the default meshes' errors
SHARE = 0.3  # part of a tolerance that the error of the steps may take: the mesh, which costs more, has the rest


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """The steps of one course. Numbers are those of `all_numbers` (c,).

    A press with friction, or a drag that friction carries, depends on its way: where in a step a point comes to touch
    is where it is held from then on. The error so falls with the number of steps, on average, and irregularly: each
    point touches at some part of its step. It is nearly the same on every mesh, so that it is measured on a coarse one,
    by two courses of fewer steps. With an error c of the usual steps and c/p of a part p of them, the end changes by
    c (1/p - 1). Either course may agree with the usual one by chance, which is why both estimates of c are added. A
    settled slide has no such error.
    """

    times: int  # the usual ones
    excess: Array  # (c,) of the numbers after the usual steps over those after many
    bound: Array  # (c,) of its size

    @staticmethod
    def of(usual: Array, fewer: Array, tolerance: float | None) -> "Steps":
        """Return the fewest that a tolerance asks for.

        `usual` (c,) and `fewer` (2, c) are numbers after the usual steps and after PARTS of them, on a coarse mesh.
        """
        excess = (fewer - usual) / (1.0 / PARTS - 1.0)[:, None]
        bound = np.abs(excess).sum(axis=0)
        off = float(bound[0]) / max(abs(float(usual[0])), np.finfo(float).tiny)
        times = min(max(1, ceil(off / (SHARE * (tolerance or USUAL)))), MOST)
        return Steps(times, excess.mean(axis=0), bound)

    @property
    def error(self) -> Array:
        """By how much numbers may be off for not taking more steps (c,)."""
        return self.bound / self.times

    def extrapolate(self, usual: Array) -> Array:
        """Return what the numbers (c,) after the usual steps would be after these."""
        return usual - (1.0 - 1.0 / self.times) * self.excess


def choose_steps(scene: Scene, finger: Finger[Patches], settled: EquilibriumState | None = None) -> Steps | None:
    """Return the load steps that a scene asks for, judged on one mesh, whose `settled` state may be known.

    None where that does not depend on its way. Raises SolveFailure, Cancelled.
    """
    if settled is not None and not settled.load.path_dependent:
        return None
    ends = [end(scene, finger, 1.0) if settled is None or scene.viscoelastic else settled]
    usual, *fewer = finger.all_numbers(ends + [end(scene, finger, part) for part in PARTS.tolist()])
    return Steps.of(usual, np.array(fewer), scene.solve.tolerance)


def steps_of_press(scene: Scene, finger: Finger[Patches]) -> int:
    """Return how many times the usual load steps a history takes whose end does not depend on them.

    Those that a tolerance asks for at the end of its press. Raises as `choose_steps`.
    """
    if scene.solve.course == "steady" or scene.solve.tolerance is None or scene.friction.frictionless:
        return 1
    steps = choose_steps(scene.press_only(), finger)
    return 1 if steps is None else steps.times


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
    states: Sequence[tuple[EquilibriumState, ForceLoad | None]],
    numbers: Callable[[Sequence[EquilibriumState]], Array],
) -> tuple[Array, list[Array]]:
    """Return the numbers (c, n) of states, and of each what they change by as each of its m edges of contact moves.

    That is (m, n), by a node to the worse side. `states` are equilibria, each with the forces it is under or None for
    its depth; `numbers` makes (c, n) of c states. Infinite where contact with a moved edge has no equilibrium.
    """
    moved = [_move_edges(newton, state, forces) for state, forces in states]
    known = [one for edges in moved for sides in edges for one in sides if one is not None]
    values = numbers([*(state for state, _ in states), *known])
    here, there = values[: len(states)], iter(values[len(states) :])
    size = here.shape[1]

    def change(sides: list[EquilibriumState | None], before: Array) -> Array:
        changes = [np.full(size, np.inf) if one is None else np.abs(next(there) - before) for one in sides]
        return np.max(changes, axis=0)

    return here, [
        np.array([change(sides, before) for sides in edges]).reshape(-1, size)
        for edges, before in zip(moved, here, strict=True)
    ]


class NestedState(NamedTuple):
    """A scene on its nested mesh."""

    numbers: NestedNumbers
    finger: Finger[Patches]
    state: EquilibriumState
    edges: Array  # (m,) what its SED changes by as each edge of contact moves by a node [MPa]


def nested_state(
    finger: Finger[Patches], state: EquilibriumState, values: Array, changes: Array, steps: Steps | None
) -> NestedState | None:
    """Return a state of the nested mesh with its numbers, of `values` (COUNT + r,) and `changes` (m, COUNT + r).

    `steps` are those taken where it depends on its way. None where contact with a moved edge has no equilibrium, as at
    a limit of friction.
    """
    of_edges = np.linalg.norm(changes, axis=0)
    if np.isinf(of_edges).any():
        return None
    numbers = values[:COUNT] if steps is None else steps.extrapolate(values[:COUNT])
    nested = NestedNumbers(numbers, of_edges[:COUNT], values[COUNT:], of_edges[COUNT:])
    return NestedState(nested, finger, state, changes[:, 0])


def _move_edges(
    newton: Newton, state: EquilibriumState, forces: ForceLoad | None
) -> list[list[EquilibriumState | None]]:
    """Return the equilibria with each edge of contact moved by a node to one side and to the other, edge by edge.

    The only node that touches stays: without it there is no contact, and no edge.
    """
    x = np.ascontiguousarray(state.place(newton.condensed)[:, 0])
    edges = np.flatnonzero(np.diff(state.state)).tolist()
    kept = newton.condensed.equilibrium is state.u  # the tangent of the last iteration is there still
    solvable = newton.linearise(state, state.load, x, 0, forces, kept=kept)
    alone = np.count_nonzero(state.touching) == 1
    return [
        [
            _move_edge(newton, state, forces, x, *pair) if solvable else None
            for pair in ((edge, edge + 1), (edge + 1, edge))
            if not (alone and state.touching[pair[0]])
        ]
        for edge in edges
    ]


def _move_edge(
    newton: Newton, state: EquilibriumState, forces: ForceLoad | None, x: Array, node: int, other: int
) -> EquilibriumState | None:
    """Return the equilibrium of the body, linearised at `state`, with `node` in the contact state of the `other`.

    `x` (k,) are the positions of the skin's nodes along the surface. None where there is no such equilibrium.
    """
    states, senses = state.state.copy(), state.sense.copy()
    states[node], senses[node] = states[other], senses[other]
    begin = replace(state, state=states, sense=senses)
    if newton.solve_contact(begin, state.load, x, 0, forces) == SINGULAR:
        return None
    deeper, along = newton.system.motion.tolist() if forces is not None else (0.0, 0.0)
    load = state.load._replace(depth=state.load.depth + deeper, travel=state.load.travel + along)
    after = newton.moved(begin, load, newton.steps[:, EQUILIBRIUM].copy(), x)[0]
    return replace(after, state=states, sense=senses)  # and not those that the moved edge would call for


def errors(scene: Scene, numbers: Array, nested: NestedNumbers | None, steps: Steps | None) -> Errors:
    """Return the errors of the `numbers` (COUNT,) of `all_numbers`.

    `nested` is None where the nested mesh has no such state, so that nothing is known of them; `steps` are those that a
    course has taken whose end depends on its way.
    """
    if nested is None:
        return _without_prescribed(scene, Errors(1.0, 1.0, 1.0, 1.0, None, 1.0, 1.0, np.full(len(NAMES), np.nan)))
    off = half_width(nested.numbers - numbers, nested.of_edges, _PARTS_OF_EDGES)
    if steps is not None:
        off += steps.error
    relative = off / np.maximum(np.abs(numbers), np.finfo(float).tiny)
    sed, normal, tangential, depth, _, width, point = relative[:FORCES_AND_PLACES].tolist()
    estimates = Errors(sed, normal, tangential, depth, float(off[SHIFT]), width, point, off[FORCES_AND_PLACES:])
    return _without_prescribed(scene, estimates)


def responses(numbers: Array, errors: Errors) -> dict[str, Response]:
    """Return the quantities at the ending among `numbers` (COUNT,), each with its error, by name."""
    pairs = zip(NAMES, numbers[FORCES_AND_PLACES:].tolist(), errors.responses.tolist(), strict=True)
    return {name: Response(value, error) for name, value, error in pairs}


def row_errors(row: Array, nested: NestedNumbers | None) -> Array:
    """Return the errors of the SED of a row of receptors `row` (r,), relative (r,); nan where nothing is known."""
    if nested is None:
        return np.full(len(row), np.nan)
    off = half_width(nested.row - row, nested.row_of_edges)
    return off / np.maximum(row, np.finfo(float).tiny)


def _without_prescribed(scene: Scene, estimates: Errors) -> Errors:
    """Return the errors without those of what the scene gives, and of the drag where nothing rubs."""
    by_force, dragged = scene.normal_force is not None, scene.loading.dragged
    rubs = not scene.friction.frictionless
    return estimates._replace(
        normal=None if by_force else estimates.normal,
        tangential=None if dragged else estimates.tangential if rubs else 0.0,
        indentation=estimates.indentation if by_force else None,
        shift=estimates.shift if dragged else None,
    )


COMPARED = ("SED", "normal force", "drag", "indentation")  # what is compared: the first four of all numbers
WARNED = 0.05  # part of their range from which on a warning says how far differences may be off
LEAST = 1e-5  # part of the numbers below which nobody minds
NOTICED = 1e-3  # part of a force or depth that a sensor may tell


def compared_sets(scenes: Sequence[Scene]) -> list[list[int]]:
    """Return the sets of scenes that are compared: two or more surfaces of one finger, pressed and moved alike.

    Scenes asked for with quick evidence are variants of one surface, whose differences have their own ways
    (`solver.response.nearby`), and belong to none.
    """
    sets: dict[object, list[int]] = {}
    for number, scene in enumerate(scenes):
        if scene.solve.evidence != "quick":
            sets.setdefault(scene.loading_group, []).append(number)
    return [numbers for numbers in sets.values() if len({scenes[n] for n in numbers}) > 1]


class ContrastError(NamedTuple):
    """By how much of their range differences between surfaces may be off."""

    share: float  # in SED, at worst [-]
    warning: str = ""  # a sentence where that is too much of it, or of a force or depth


def contrast_error(predictions: Sequence[Prediction]) -> ContrastError:
    """Return what differences between these surfaces may be off by.

    Of forces and depth only what is off by more than sensors tell is warned of. A surface that has no state on the
    nested mesh is left out: nothing is known of it.
    """
    known = [(one, one.nested) for one in predictions if one.nested is not None]
    if len(known) < 2:
        return ContrastError(0.0)
    count = len(COMPARED)
    numbers = np.abs([(o.sed_ending, o.normal_force, o.tangential_force, o.indentation) for o, _ in known])
    change = np.abs([nested.numbers[:count] for _, nested in known]) - numbers
    edges = np.array([nested.of_edges[:count] for _, nested in known])
    pairs = np.array(list(combinations(range(len(known)), 2))).T
    worst = half_width(change[pairs[0]] - change[pairs[1]], np.hypot(edges[pairs[0]], edges[pairs[1]]))
    off_by, mean = worst.max(axis=0), numbers.mean(axis=0)
    shares = off_by / np.maximum(np.maximum(np.ptp(numbers, axis=0), LEAST * mean / WARNED), np.finfo(float).tiny)
    minded = off_by > NOTICED * mean
    minded[0] = True
    warned = np.where((shares > WARNED) & minded, shares, 0.0)
    first = int(warned.argmax())
    return ContrastError(
        float(shares[0]), _in_a_sentence(COMPARED[first], float(warned[first])) if warned.any() else ""
    )


def _in_a_sentence(name: str, share: float) -> str:
    part = percent(share) if share < 1.0 else "more than all"
    small = f"Differences in {name} from the surfaces solved with this one are small"
    return f"{small}, and may be off by {part} of their range."


Numbers = Callable[[Newton, EquilibriumState], Array]


class ErrorInterval(NamedTuple):
    """Numbers (n,) of a state, each in its own unit."""

    value: Array
    corrected: Array  # the same on the nested mesh, the best value there is
    error: Array  # half width of the interval about either


def estimate_errors(
    numbers: Numbers,
    newton: Newton,
    state: EquilibriumState,
    nested: tuple[Newton, EquilibriumState],
    forces: ForceLoad | None = None,
    fewer: Sequence[EquilibriumState] = (),
) -> ErrorInterval:
    """Return the `numbers` (n,) of a state and how far each may be off.

    `nested` is the same state on the halved mesh (`solver.mesh`), `forces` the forces it is under, if any. Where
    the state is the end of a load path on which skin sticks, `fewer` are its ends on the same mesh after `PARTS` of
    the load steps. Errors are infinite where contact with a moved edge has no equilibrium.
    """
    value = numbers(newton, state)
    finer, there = nested
    (corrected,), (edges,) = edge_changes(
        finer, [(there, forces)], lambda states: np.array([numbers(finer, one) for one in states])
    )
    error = half_width(corrected - value, np.linalg.norm(edges, axis=0))
    if fewer:
        if len(fewer) != len(PARTS):
            raise ValueError(f"fewer has {len(fewer)} states; give one after each of {PARTS.tolist()} of the steps")
        error += Steps.of(value, np.array([numbers(newton, one) for one in fewer]), None).bound
    return ErrorInterval(value, corrected, error)
