"""Quantities along a row of receptors at any depth: for predictions with error estimates, for surveys without."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from solver.accuracy.adaptivity import FingerState
from solver.accuracy.convergence_order import refuse_folds
from solver.accuracy.error_estimate import PARTS, Steps, edge_changes, edge_errors, half_width, largest_nearby
from solver.arrays import Array
from solver.body import Patches
from solver.body.finite import FiniteBody, FinitePatches
from solver.body.linear import Elastic, LinearPatches
from solver.body.receptor import endings
from solver.continuation.existence import is_sound
from solver.continuation.finite_states import rough_state
from solver.continuation.small_states import WIDE_MARGIN, expected_depth, nearest_state, state_on_branch
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import KINDS, Finger, FiniteFinger, LinearFinger, finite_laws, settled_moduli
from solver.equilibrium.load_path import end_of_path
from solver.equilibrium.load_stepping import forces_of
from solver.failures import NotConverged, SolveFailure
from solver.mesh.mesher import Sizing
from solver.prediction import ROW, Prediction
from solver.quantities import NAMES
from solver.response import FIRST_FINENESS
from solver.response.finite_answers import WIDER, Meshes, coarse_solution, solution_on
from solver.scene import Scene
from solver.scene.tables import Receptor


class Row(NamedTuple):
    """Every quantity of `solver.quantities` (q, r) along a row of endings, each in its unit."""

    values: Array  # nan for endings outside the finger
    errors: Array  # estimated; nan for endings outside the finger, all nan where unknown


def responses_along(predictions: Sequence[Prediction], arcs: Array = ROW, receptor: Receptor | None = None) -> Array:
    """Return every quantity of `solver.quantities` (n, q, r) at arc positions (r,) [mm] of n predictions.

    Each is averaged over an ending like that of `receptor`, by default the scene's: SA-I and RA endings are shallower
    than SA-II endings. Values are nan for endings outside the finger. `row_along` returns their errors too.
    """
    out: list[Array] = []
    for _, run in groupby(predictions, lambda prediction: (id(prediction.geometry), prediction.scene.solve.kinematics)):
        group = list(run)
        along = _row_patches(group[0], arcs, receptor or group[0].scene.receptor)
        out += [along.responses(prediction.displacement) for prediction in group]
    return np.array(out)


def row_along(prediction: Prediction, arcs: Array = ROW, receptor: Receptor | None = None) -> Row:
    """Return `responses_along` of one prediction with error estimates, for which its nested mesh is solved again."""
    values = responses_along([prediction], arcs, receptor)[0]
    try:
        errors = _row_errors(prediction, values, arcs, receptor or prediction.scene.receptor)
    except SolveFailure:
        errors = np.full(values.shape, np.nan)
    return Row(values, errors)


def _row_errors(prediction: Prediction, values: Array, arcs: Array, receptor: Receptor) -> Array:
    """Return the errors of a row (q, r). Raises SolveFailure where the nested mesh has no such state."""
    scene = prediction.scene

    def row_numbers(finger: Finger[Any]) -> Callable[[Sequence[EquilibriumState]], Array]:
        row = finger.patches(endings(finger.geometry, finger.body.centre, receptor, arcs))
        return lambda states: np.moveaxis(row.responses(finger.recover(states, row)), -1, 0).reshape(len(states), -1)

    answer, nested, coarse = _solve_again(prediction)
    in_steps = nested[1].load.path_dependent
    if in_steps:
        answer, nested = ((finger, end_of_path(scene, finger)) for finger, _ in (answer, nested))
    refuse_folds(*nested)
    (_, on_mesh), (finer, on_nested) = (
        edge_changes(finger.newton, state, forces_of(scene, state.load), row_numbers(finger))
        for finger, state in (answer, nested)
    )
    change = largest_nearby(finer.reshape(values.shape) - values, arcs, prediction.geometry.lines)
    errors = half_width(change.ravel(), edge_errors(on_mesh, on_nested))
    if in_steps:
        usual, *fewer = row_numbers(coarse)([end_of_path(scene, coarse, times) for times in (1.0, *PARTS.tolist())])
        errors += Steps.of(usual, np.array(fewer), scene.solve.target).bound
    excess = prediction.nested.relative_excess if prediction.nested else np.nan
    return errors.reshape(values.shape) + excess * np.abs(values)


def _solve_again(prediction: Prediction) -> tuple[FingerState, FingerState, Finger[Any]]:
    """Return the state, that on the nested mesh, and the finger on which load paths in fewer steps are judged."""
    scene, sizing, meshes = prediction.scene, prediction.geometry.sizing, Meshes()
    halved = replace(sizing, halved=True)
    if scene.solve.kinematics == "small":
        finger, nested = LinearFinger.on(scene, prediction.geometry), LinearFinger.of(scene, halved)
        return (finger, nearest_state(scene, finger)), (nested, nearest_state(scene, nested)), finger
    low = coarse_solution(scene, expected_depth(scene), sizing.fineness, meshes)
    top = solution_on(scene, sizing, low, meshes)
    fine = solution_on(scene, halved, top, meshes)
    return (top.finger, top.state), (fine.finger, fine.state), low.finger


def _row_patches(prediction: Prediction, arcs: Array, receptor: Receptor) -> Patches:
    """Return endings like that of `receptor` on the mesh of a prediction."""
    mesh, materials = prediction.geometry.mesh, prediction.scene.materials
    elastic = Elastic.of(mesh, settled_moduli(materials))
    row = endings(prediction.geometry, elastic.centre, receptor, arcs)
    if prediction.scene.solve.kinematics == "small":
        return LinearPatches(elastic, row)
    return FinitePatches(FiniteBody.of(mesh, finite_laws(materials), checked=True), row)


_FINENESS = 6.0  # elements per tip radius, at small strain


def rough_responses(scenes: Sequence[Scene], arcs: Sequence[float] = (0.0,)) -> Array:
    """Return every quantity (n, q, r) in full slip at endings at arc positions [mm]; nan where it does not exist.

    All scenes have one finger and one kinematics. At small strain all share a mesh; at finite strain those of one
    loading do, and each starts from the one with less friction. Raises as `Finger.of`.
    """
    out = np.full((len(scenes), len(NAMES), len(arcs)), np.nan)
    if not scenes:
        return out
    finite = scenes[0].solve.kinematics == "finite"
    order = sorted(range(len(scenes)), key=lambda n: (scenes[n].loading_group, float(scenes[n].friction.mu)))
    for _, numbers in groupby(order, lambda n: scenes[n].loading_group if finite else None):
        group = list(numbers)
        depth = max(expected_depth(scenes[number]) for number in group)
        sizing = Sizing(FIRST_FINENESS, depth, margin=WIDER) if finite else Sizing(_FINENESS, depth, margin=WIDE_MARGIN)
        finger = KINDS[scenes[0].solve.kinematics].of(scenes[group[0]], sizing)
        states: dict[int, EquilibriumState] = {}
        near: EquilibriumState | None = None
        for number in group:
            with suppress(SolveFailure):
                near = _sound_state(finger, scenes[number], near)
                states[number] = near
        if states:
            row = finger.endings(np.asarray(arcs, np.float64))
            out[list(states)] = np.moveaxis(row.responses(finger.displacements(list(states.values()))), 2, 0)
    return out


def _sound_state(finger: Finger[Any], scene: Scene, near: EquilibriumState | None) -> EquilibriumState:
    """Return full slip, at finite strain started from `near`. Raises SolveFailure, also where it is unsound."""
    if isinstance(finger, FiniteFinger):
        state = rough_state(finger, scene, near)
        usable = is_sound(finger, state)
    else:
        assert isinstance(finger, LinearFinger)
        state = state_on_branch(scene, finger)
        usable = not finger.reaches_out(state, finger.displacement(state))
    if usable:
        return state
    raise NotConverged("no sound state was found")
