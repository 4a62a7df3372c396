"""Settled sliding at finite strain on a mesh whose lines follow the edges of contact, and on a coarser one beside it.

No element can follow a skin that touches with one half and not with the other: where contact ends inside an element,
the energy below is wrong by some tenths of a per cent, up or down. So the edges are found on a rough mesh, and the
meshes that count have lines there. From the rough state they are a few iterations away. Where skin slips at the
traction bound up to an edge, its force is the bound times a length, and lines a third of an element off make it wrong
by a per cent: there the lines are moved once more, to the edges that the fine mesh itself finds.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from solver.estimate import estimates
from solver.existence import sound
from solver.failures import NoSteadyState, NotConverged, SolveFailure
from solver.finite_finger import FiniteFinger
from solver.finite_states import roughly, settled
from solver.mesh import Array
from solver.mesher import Sizing, sharing, still_sharing
from solver.newton import Shape
from solver.scene import Scene

ROUGH = 3.0  # fineness of the mesh that finds the edges
COARSER = 0.6  # fineness of the mesh that the error is estimated from, by that of the answer
NUDGE = 1e-3  # of the traction bound, to see what it does
MARGIN = 3.0  # how far above the indentation the undeformed skin may lie and still be looked at for contact


Maker = Callable[[Scene, Sizing], FiniteFinger]  # of meshes; whoever wants may keep what it makes


@dataclass(frozen=True, slots=True, eq=False)
class Climbed:
    """A settled state on the mesh made for it."""

    finger: FiniteFinger
    shape: Shape
    setup_s: float  # meshes and tables [s]


@dataclass(frozen=True, slots=True, eq=False)
class Ascent:
    """What a scene was solved by: the state that found the edges of contact, and the one that counts."""

    foot: Climbed
    top: Climbed
    first: Climbed | None = None  # of the top's fineness, before its lines were moved to the edges found on it


def ascended(
    scene: Scene,
    expected: float,
    fineness: float,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    before: Ascent | None = None,
) -> Ascent:
    """Return the settled state of a scene on a mesh made for it; for the arguments see `foot`.

    It is begun at the undeformed finger, or at `before`, the ascent of a surface that shares the rough mesh: from there
    the rough state is two systems away, and what it has changed by leads to a state as near on the finer mesh. Raises
    NoSteadyState, NotConverged, Cancelled.
    """
    low = foot(scene, expected, fineness, stop, make, None if before is None else before.foot)
    return risen(scene, fineness, low, stop, make, before)


def foot(
    scene: Scene,
    expected: float,
    fineness: float,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    near: Climbed | None = None,
) -> Climbed:
    """Return the settled state on a mesh that does not know the edges of contact, from which others can be climbed.

    `expected` is the depth [mm], or about it where forces are given; a given drag is left for the mesh that counts,
    since the limit of friction lies a little elsewhere on each. A rough mesh will do where its state is sound.
    Near a limit, only a mesh of `fineness` itself can tell. From `near`, where it is of the same mesh, it is begun.
    Raises NoSteadyState, NotConverged, Cancelled.
    """
    depth = expected if scene.normal_force is not None else scene.loading.depth
    scene = scene.undragged() if scene.loading.dragged else scene
    begun = perf_counter()
    finger = make(scene, Sizing(ROUGH, depth, margin=MARGIN))
    setup = perf_counter() - begun
    try:
        shape = roughly(finger, scene, stop, near.shape if near is not None and near.finger is finger else None)
        if sound(finger.newton, shape, finger.geometry.whole):
            return Climbed(finger, shape, setup)
        depth = shape.pull.depth
    except SolveFailure:
        pass
    return _on(scene, Sizing(fineness, depth, margin=MARGIN), None, stop, make)


def risen(
    scene: Scene,
    fineness: float,
    low: Climbed,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    before: Ascent | None = None,
    sizing: Sizing | None = None,
) -> Ascent:
    """Return the settled state above `low`, `foot` of the same scene; for the arguments see `climbed`."""
    sizing = sizing or sized(fineness, low)
    top = climbed(scene, fineness, low, stop, make, before, sizing)
    if not top.finger.bounded_at_an_edge(top.shape):
        return Ascent(low, top)
    again = still_sharing(scene.finger, scene.receptor, sized(fineness, top), sizing)
    return Ascent(low, climbed(scene, fineness, top, stop, make, None, again), top)


def sized(fineness: float, below: Climbed) -> Sizing:
    """Return the sizing of a mesh of `fineness` whose lines follow the edges of contact found `below`."""
    edges = below.finger.edges(below.shape)
    return Sizing(fineness, below.shape.pull.depth, margin=MARGIN, edges=edges)


def sized_together(scene: Scene, fineness: float, feet: Sequence[Climbed]) -> list[Sizing]:
    """Return the same for surfaces that are pressed alike: one mesh for all, its lines moved to the edges of each.

    `scene` is that of any of them. Where contact is too short to tell its edges, a surface has a mesh of its own.
    """
    sizings = [sized(fineness, below) for below in feet]
    known = [number for number, sizing in enumerate(sizings) if sizing.edges is not None]
    if known:
        shared = sharing(scene.finger, scene.receptor, [sizings[number] for number in known])
        for number, sizing in zip(known, shared, strict=True):
            sizings[number] = sizing
    return sizings


def climbed(
    scene: Scene,
    fineness: float,
    below: Climbed,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    before: Ascent | None = None,
    sizing: Sizing | None = None,
) -> Climbed:
    """Return the settled state on a mesh of `fineness` whose lines follow the edges of contact found `below`.

    With `sizing` on the mesh of `sized_together`. It is begun at the state `below`, or at what that has changed by
    since `before`, of a surface that shares the rough mesh, added to the state found then. Raises NoSteadyState,
    NotConverged, Cancelled.
    """
    near = before if before is not None and before.foot.finger is below.finger else None
    return _on(scene, sizing or sized(fineness, below), below, stop, make, near)


def _on(
    scene: Scene,
    sizing: Sizing,
    below: Climbed | None,
    stop: Callable[[], bool],
    make: Maker,
    before: Ascent | None = None,
) -> Climbed:
    begun = perf_counter()
    finger = make(scene, sizing)
    for other in (below, before.top if before is not None else None):
        if other is not None:
            finger.bridge(other.finger)
    setup = perf_counter() - begun
    start = None
    if below is not None and before is None:
        start = finger.brought(below.shape, below.finger)
    elif below is not None and before is not None:
        low, top = before.foot.shape, before.top
        start = finger.brought_on(below.shape, low, below.finger, top.shape, top.finger)
    return Climbed(finger, settled(finger, scene, stop, start), setup)


def _nearest(scene: Scene, fineness: float, at: Climbed, stop: Callable[[], bool]) -> Climbed:
    """Return the settled state on a coarser mesh, whose friction limit may lie just below the drag asked for."""
    try:
        return climbed(scene, fineness, at, stop)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return climbed(scene.undragged(), fineness, at, stop)


def error_estimates(
    scene: Scene, fineness: float, way_up: Ascent, stop: Callable[[], bool]
) -> tuple[float, float, float]:
    """Return how far SED, normal and tangential force of the settled state at the top may be off, relative.

    The same scene is solved on a coarser mesh with lines at the same edges of contact.
    """
    found = estimates(*compared(scene, fineness, way_up, stop))
    return float(found[0]), float(found[1]), float(found[2])


def compared(
    scene: Scene, fineness: float, way_up: Ascent, stop: Callable[[], bool]
) -> tuple[Scene, float, Array, Array, Array]:
    """Return what `estimates` is asked with: numbers (3,) of the top, of other meshes (n, 3), and what is felt (3,).

    There are no others where one has no state.
    """
    at = way_up.top
    driven, numbers = scene.driven(at.shape.pull.depth), at.finger.numbers(at.shape)
    try:
        coarse = _nearest(scene, COARSER * fineness, at, stop)
    except SolveFailure:
        return driven, fineness, numbers, np.empty((0, 3)), np.zeros(3)
    others = np.array([other.finger.numbers(other.shape) for other in (coarse, way_up.first) if other is not None])
    felt = felt_of_bound(coarse) if at.finger.bounded_at_an_edge(at.shape) else np.zeros(3)
    return driven, fineness, numbers, others, felt


def felt_of_bound(at: Climbed) -> Array:
    """Return how SED, normal and tangential force (3,) answer to the traction bound: relative change by its own.

    Zero where no state lies beside this one.
    """
    newton, shape = at.finger.newton, at.shape
    if shape.pull.sense == 0:  # it does not slide as a whole, and depends on its way
        return np.zeros(3)
    try:
        beside = newton.settle(shape, shape.pull._replace(tau=(1.0 + NUDGE) * shape.pull.tau))
    except NotConverged:
        return np.zeros(3)
    before = at.finger.numbers(shape)
    return (at.finger.numbers(beside) / before - 1.0) / NUDGE
