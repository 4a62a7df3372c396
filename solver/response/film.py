"""The way of a finger as pictures: from first touch, or as far as a solve that failed had come."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.arrays import Array
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import SMALL, Instant, follow, way_of
from solver.equilibrium.newton import EquilibriumState
from solver.failures import SolveFailure
from solver.prediction import Skin
from solver.progress import Progress, report_part
from solver.response.answer import skin_of
from solver.response.fields import Fields, Sketch
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Still:
    """One state of the way, at small strain."""

    instant: Instant
    fields: Fields
    skin: Skin
    row: Array  # (r,) SED of the row of receptors [MPa]
    sed: float  # averaged over the ending [MPa]


def stills(finger: LinearFinger, instants: Sequence[Instant], sketch: Sketch) -> tuple[Still, ...]:
    """Return the pictures of states that `finger` was in; tissues at rest, so for ways on which nothing relaxes."""
    displacement = finger.body.displacement(np.stack([instant.state.u for instant in instants], axis=2))
    values = sketch.values(displacement)
    rows = finger.row.average(displacement)
    ending = finger.ending.average(displacement)[0]
    return tuple(
        Still(
            instant,
            sketch.fields(displacement[:, :, number], instant.depth, values[:, :, number]),
            skin_of(finger, instant.state),
            rows[:, number],
            float(ending[number]),
        )
        for number, instant in enumerate(instants)
    )


def way_until(
    scene: Scene, finger: LinearFinger, progress: Progress | None = None
) -> tuple[tuple[Instant, ...], SolveFailure | None]:
    """Return the states from first touch on, and why there are no more where they end before the finger settles.

    They end before tissue folds: states beyond solve the equations of small strain and are none of a finger's. Raises
    Cancelled where `progress` says so.
    """
    way = way_of(scene, finger)
    try:
        follow(way, finger, scene.loading_per_mm, SMALL, 1.0, lambda _, part: report_part(progress, part))
    except SolveFailure as failure:
        return _unfolded(finger, way.instants), failure
    return tuple(way.instants), None


def _unfolded(finger: LinearFinger, instants: Sequence[Instant]) -> tuple[Instant, ...]:
    """Return the states before the first in which tissue is turned inside out; what folds stays folded."""

    def folds(instant: Instant) -> bool:
        return finger.body.smallest_det(finger.displacement(instant.state)) <= 0.0

    return tuple(instants[: max(bisect_left(instants, True, key=folds), 1)])


def most_squeezed(finger: LinearFinger, state: EquilibriumState, depth: float) -> tuple[float, float]:
    """Return the place [mm] in the world where tissue is squeezed most: the corner that stretches least."""
    displacement = finger.displacement(state)
    mesh = finger.geometry.mesh
    corner = int(np.argmin(finger.body.stretches(displacement)[0]))
    node = mesh.elements[corner // 4, corner % 4]
    x, y = mesh.nodes[node] + displacement[node]
    return float(x), float(y - depth)
