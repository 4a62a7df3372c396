"""Settled sliding at finite strain on a mesh whose lines follow the edges of contact, and on a coarser one beside it.

No element can follow a skin that touches with one half and not with the other: where contact ends inside an element,
the energy below is wrong by some tenths of a per cent, up or down. So the edges are found on a rough mesh, and the
meshes that count have lines there. From the rough state they are a few iterations away. Where skin slips at the
traction bound up to an edge, its force is the bound times a length, and lines a third of an element off make it wrong
by a per cent: there the lines are moved once more, to the edges that the fine mesh itself finds.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

from solver.accuracy.finite_ends import steps_asked
from solver.body.tissues import strains_the_cut
from solver.continuation.existence import refuse_far_beyond, steep
from solver.continuation.finite_states import course, nearby, roughly, settled
from solver.continuation.limit_point import folded, sound
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.loads import sliding_pull
from solver.equilibrium.newton import EquilibriumState
from solver.equilibrium.step_error import Steps
from solver.failures import NoSteadyState, NotConverged, SolveFailure
from solver.mesh.mesher import AT_CUT, SHORT_AT_CUT, Sizing, sharing, still_sharing
from solver.scene import Scene

ROUGH = 3.0  # fineness of the mesh that finds the edges
BESIDE = 1.05  # times as fine is a mesh whose nodes lie elsewhere
NEARLY = 0.98  # of the friction limit, from which contact is where it is when the finger slides
MARGIN = 3.0  # how far above the indentation the undeformed skin may lie and still be looked at for contact
WIDER = 6.0  # the same where contact was met at the end of that skin
UNSQUEEZED = 0.78  # least det F at the cut on the rough mesh, from which elements there are shortest
DOUBLED = 0.07  # by how much it lies below where they are twice as long
COLLAPSED = 0.4  # least det F at the cut, below which short elements have several states


Maker = Callable[[Scene, Sizing], FiniteFinger]  # of meshes; whoever wants may keep what it makes


@dataclass(frozen=True, slots=True, eq=False)
class MeshSolution:
    """A settled state on the mesh made for it."""

    finger: FiniteFinger
    shape: EquilibriumState
    setup_s: float  # meshes and tables [s]
    at_cut: float | None = None  # of finer meshes made from here, as in `Sizing`


@dataclass(frozen=True, slots=True, eq=False)
class NestedSolution:
    """What a scene was solved by: the state that found the edges of contact, and the one that counts."""

    coarse: MeshSolution
    top: MeshSolution
    first: MeshSolution | None = None  # of the top's fineness, before its lines were moved to the edges found on it
    steps: Steps | None = None  # those that the course takes, where the state depends on its way


def nested_solution(
    scene: Scene,
    expected: float,
    fineness: float,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    before: NestedSolution | None = None,
) -> NestedSolution:
    """Return the settled state of a scene on a mesh made for it; for the arguments see `coarse_solution`.

    It is begun at the undeformed finger, or at `before`, the ascent of a surface that shares the rough mesh: from there
    the rough state is two systems away, and what it has changed by leads to a state as near on the finer mesh. Raises
    NoSteadyState, NotConverged, Cancelled.
    """
    low = coarse_solution(scene, expected, fineness, stop, make, None if before is None else before.coarse)
    return refine(scene, fineness, low, stop, make, before)


def coarse_solution(
    scene: Scene,
    expected: float,
    fineness: float,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    near: MeshSolution | None = None,
) -> MeshSolution:
    """Return the settled state on a mesh that does not know the edges of contact, from which others can be climbed.

    `expected` is the depth [mm], or about it where forces are given. For a drag near the limit of friction, which lies
    a little elsewhere on each mesh, it is the slide. A rough mesh will do where its state is sound.
    Near a limit, only a mesh of `fineness` itself can tell. From `near`, where it is of the same mesh, it is begun.
    Raises NoSteadyState, NotConverged, Cancelled.
    """
    depth = expected if scene.normal_force is not None else scene.loading.depth
    margin = MARGIN
    beyond = False
    try:
        low = _rough(scene, depth, margin, stop, make, near)
        if low.finger.runs_out(low.shape):
            margin = WIDER
            low = _rough(scene, depth, margin, stop, make, near)
        if sound(low.finger, low.shape):
            return low
        depth = low.shape.pull.depth
        beyond = folded(low.finger, low.shape)
    except NoSteadyState:
        if scene.normal_force is not None and not scene.loading.dragged:
            raise  # told on a mesh of its own, whatever this one is
    except NotConverged:
        beyond = True
    except SolveFailure:
        pass
    if beyond and scene.normal_force is None and scene.loading.direction != 0:
        refuse_far_beyond(scene, sliding_pull(scene), stop)
    sizing = Sizing(fineness, depth, margin=margin, at_cut=_usual_at_cut(scene))
    try:
        return _plain(scene, sizing, stop, make)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return _plain(scene.undragged(), sizing, stop, make)


def _rough(
    scene: Scene, depth: float, margin: float, stop: Callable[[], bool], make: Maker, near: MeshSolution | None
) -> MeshSolution:
    begun = perf_counter()
    finger = make(scene, Sizing(ROUGH, depth, margin=margin, at_cut=_usual_at_cut(scene)))
    setup = perf_counter() - begun
    shape = _on_rough(finger, scene, stop, near.shape if near is not None and near.finger is finger else None)
    return MeshSolution(finger, shape, setup, _at_cut(scene, finger, shape))


def _plain(scene: Scene, sizing: Sizing, stop: Callable[[], bool], make: Maker) -> MeshSolution:
    begun = perf_counter()
    finger = make(scene, sizing)
    setup = perf_counter() - begun
    shape = settled(finger, scene, stop)
    if sizing.margin < WIDER and finger.runs_out(shape):
        return _plain(scene, replace(sizing, margin=WIDER), stop, make)
    return MeshSolution(finger, shape, setup, sizing.at_cut)


def _on_rough(
    finger: FiniteFinger, scene: Scene, stop: Callable[[], bool], near: EquilibriumState | None
) -> EquilibriumState:
    """Return the state on the rough mesh, or the slide where a given drag nearly makes the finger slide there."""
    drag = scene.tangential_force
    if drag is None:
        return roughly(finger, scene, stop, near)
    try:
        slide = roughly(finger, scene.undragged(), stop, near)
    except SolveFailure:
        return course(scene, finger, stop).last  # the drag may be met before sliding would fold the skin
    return slide if drag >= NEARLY * abs(slide.force[0]) else course(scene, finger, stop).last


def refine(
    scene: Scene,
    fineness: float,
    low: MeshSolution,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    before: NestedSolution | None = None,
    sizing: Sizing | None = None,
) -> NestedSolution:
    """Return the settled state refined from `low`, the scene's coarse solution; for arguments see `solution_on`."""
    sizing = sizing or sized(fineness, low)
    steps = steps_asked(scene, low.finger, low.shape, stop)
    slides = scene.undragged() if scene.loading.dragged and low.shape.pull.sense != 0 else scene
    top = solution_on(slides, fineness, low, stop, make, before, sizing, 1 if steps is None else steps.times)
    if top.shape.pull.sense == 0 or not top.finger.bounded_at_an_edge(top.shape):
        if slides is not scene:  # a drag near the limit of friction, which the slide has told the edges of
            top = solution_on(scene, fineness, low, stop, make, None, sizing)
        return NestedSolution(low, top, steps=steps)
    again = still_sharing(scene.finger, scene.receptor, sized(fineness, top), sizing)
    return NestedSolution(low, solution_on(scene, fineness, top, stop, make, None, again), top)


def sized(fineness: float, below: MeshSolution) -> Sizing:
    """Return the sizing of a mesh of `fineness` whose lines follow the edges of contact found `below`."""
    edges = below.finger.edges(below.shape)
    return Sizing(fineness, below.shape.pull.depth, margin=MARGIN, edges=edges, at_cut=below.at_cut)


def _usual_at_cut(scene: Scene) -> float | None:
    """Return how long the elements are where the cut meets the bone, on a mesh that finds how tissue is squeezed there.

    Sliding along +x squeezes it. Under stiff skin short elements collapse, and Newton's iterations lose their way,
    sooner than they bring anything.
    """
    return AT_CUT if scene.loading.direction > 0 and not strains_the_cut(scene.materials) else None


def _at_cut(scene: Scene, finger: FiniteFinger, shape: EquilibriumState) -> float | None:
    """Return the same for the meshes above a rough one: the shorter, the less this squeezes that corner.

    Where it is squeezed far, short elements collapse, and have more states than one. Ends of courses are not found from
    a state nearby, that could show it.
    """
    usual = _usual_at_cut(scene)
    if usual is None or scene.loading.dragged or shape.pull.sense == 0:
        return usual
    squeezed = max(UNSQUEEZED - finger.least_at_cut(shape), 0.0)
    return min(SHORT_AT_CUT * 2.0 ** (squeezed / DOUBLED), usual)


def sized_together(scene: Scene, fineness: float, feet: Sequence[MeshSolution]) -> list[Sizing]:
    """Return the same for surfaces that are pressed alike: one mesh for all, its lines moved to the edges of each.

    `scene` is that of any of them. Where contact is too short to tell its edges, a surface has a mesh of its own.
    """
    sizings = [sized(fineness, below) for below in feet]
    longest = max((sizing.at_cut for sizing in sizings if sizing.at_cut is not None), default=None)
    sizings = [sizing if sizing.at_cut is None else replace(sizing, at_cut=longest) for sizing in sizings]
    known = [number for number, sizing in enumerate(sizings) if sizing.edges is not None]
    if known:
        shared = sharing(scene.finger, scene.receptor, [sizings[number] for number in known])
        for number, sizing in zip(known, shared, strict=True):
            sizings[number] = sizing
    return sizings


def solution_on(
    scene: Scene,
    fineness: float,
    below: MeshSolution,
    stop: Callable[[], bool],
    make: Maker = FiniteFinger.of,
    before: NestedSolution | None = None,
    sizing: Sizing | None = None,
    times: int = 1,
) -> MeshSolution:
    """Return the settled state on a mesh of `fineness` whose lines follow the edges of contact found `below`.

    With `sizing` on the mesh of `sized_together`. It is begun at the state `below`, or at what that has changed by
    since `before`, of a surface that shares the rough mesh, added to the state found then; a
    course has so many `times` the usual load steps. Where friction is steep a mesh may have no state, its last node
    neither open nor touching: then one with nodes elsewhere is asked. Raises NoSteadyState, NotConverged, Cancelled.
    """
    near = before if before is not None and before.coarse.finger is below.finger else None
    sizing = sizing or sized(fineness, below)
    if sizing.at_cut is not None and sizing.at_cut < AT_CUT:
        begun = _begun(scene, sizing, below, make, near)
        shape = nearby(begun.finger, scene, begun.shape, stop)
        if shape is not None and begun.finger.least_at_cut(shape) >= COLLAPSED:
            return replace(begun, shape=shape)
        sizing = replace(sizing, at_cut=AT_CUT, sharing=None)
    begun = _begun(scene, sizing, below, make, near)
    try:
        return replace(begun, shape=settled(begun.finger, scene, stop, begun.shape, times))
    except NotConverged:
        if not steep(sliding_pull(scene)):
            raise
    begun = _begun(scene, replace(sized(BESIDE * fineness, below), at_cut=sizing.at_cut), below, make, None)
    return replace(begun, shape=settled(begun.finger, scene, stop, begun.shape, times))


def _begun(
    scene: Scene, sizing: Sizing, below: MeshSolution, make: Maker, before: NestedSolution | None
) -> MeshSolution:
    """Return a mesh above the state `below`, with the shape that a settled one is sought from."""
    begun = perf_counter()
    finger = make(scene, sizing)
    for other in (below, before.top if before is not None else None):
        if other is not None:
            finger.bridge(other.finger)
    setup = perf_counter() - begun
    if before is None:
        start = finger.transfer(below.shape, below.finger)
    else:
        start = finger.transfer_change(
            below.shape, before.coarse.shape, below.finger, before.top.shape, before.top.finger
        )
    return MeshSolution(finger, start, setup, sizing.at_cut)
