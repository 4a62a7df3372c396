"""From scenes at finite strain to predictions: one mesh for all that share a finger, and an error estimate with each.

The law is neo-Hookean (`solver.hyperelastic.NeoHooke`). Settled sliding is found directly and refused where it does not
exist (`solver.existence`); the course is marched.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.linalg import LinAlgError

from solver import evidence, finite_forced, kernels_numpy
from solver.existence import steady
from solver.failures import Cancelled, NoSteadyState, NotConverged, SolveFailure, beyond_friction
from solver.finite_body import FiniteBody, FiniteProbes
from solver.finite_forced import Given
from solver.grid import MeshError
from solver.kernels import CAP, OPEN, SLIP, STICK
from solver.march import march
from solver.mesher import FingerMesh, Sizing, finger_mesh
from solver.newton import Newton, Pull, Shape
from solver.prediction import History, Prediction, Row, Skin
from solver.receptor import ROW, endings, middle
from solver.scene import Scene, SceneError
from solver.stiffness import Elastic
from solver.tissues import finite_laws, settled_moduli

MARGIN = 3.0  # how far above the indentation the undeformed skin may lie and still be looked at for contact
SAFETY = 1.0  # of the error estimate; see docs/solver.md for what was measured
PRESSES = 40  # steps of the pre-indentation, and of a drag that grows
SEARCHES = 60  # steps of a search for the depth at which a force is met
MET = 1e-9  # relative difference within which it is
ALL_SLIPS = 1e-6  # part of the friction limit within which a given drag is that of sliding
COARSE = 5.0  # mesh on which it is looked how deep a given force presses
STRIDE = 0.1  # of the bone while it slides, by the indentation [-]
LONGEST = 8.0  # slide after which a course that has not settled is given up, by the indentation [-]
SETTLED = 1e-10  # relative change of the ending's SED in a step, with every touching point slipping
NAMES = {OPEN: "open", STICK: "stick", SLIP: "slip", CAP: "cap"}

Answer = Prediction | SolveFailure
Progress = Callable[[float], bool]


@dataclass(frozen=True, slots=True, eq=False)
class FiniteFinger:
    """A finger on one mesh, ready for any surface."""

    geometry: FingerMesh
    newton: Newton
    ending: FiniteProbes
    point: FiniteProbes
    row: FiniteProbes

    @staticmethod
    def of(scene: Scene, sizing: Sizing) -> "FiniteFinger":
        """Mesh the finger of `scene`. Raises SceneError where its outline cannot be meshed."""
        try:
            made = finger_mesh(scene.finger, scene.receptor, sizing)
            elastic = Elastic.of(made.mesh, settled_moduli(scene.materials))
            body = FiniteBody.of(made.mesh, finite_laws(scene.materials))
        except (MeshError, LinAlgError) as bad:
            raise SceneError("finger", scene.finger, f"no mesh fits it ({bad})") from bad
        return FiniteFinger(
            made,
            Newton(body),
            FiniteProbes.of(body, endings(made, elastic, scene.receptor, np.zeros(1))),
            FiniteProbes.of(body, middle(made, elastic, scene.receptor)),
            FiniteProbes.of(body, endings(made, elastic, scene.receptor, ROW)),
        )

    def sed_ending(self, shape: Shape) -> float:
        """Return the SED averaged over the reference ending [MPa]."""
        return float(self.ending.average(self.newton.body, shape.u)[0])

    def settled(self, scene: Scene, stop: Callable[[], bool]) -> Shape:
        """Return the settled state of a scene. Raises NoSteadyState, NotConverged, Cancelled."""
        if scene.normal_force is not None:
            return self._settled_under(scene, scene.normal_force, stop)
        pull = _pull(scene)
        if scene.loading.direction == 0 and scene.friction.mu > 0.0:
            press = [pull._replace(depth=pull.depth * (i + 1) / PRESSES) for i in range(PRESSES)]
            return list(march(self.newton, press, stop=stop))[-1]
        return steady(self.newton, pull._replace(sense=-(scene.loading.direction or 1)), self.geometry.whole, stop=stop)

    def _settled_under(self, scene: Scene, force: float, stop: Callable[[], bool]) -> Shape:
        """Return the settled state under the forces of a scene, depth and shift found. Raises as `settled`."""
        direction, drag = scene.loading.direction, scene.tangential_force
        if direction == 0 and scene.friction.mu > 0.0:
            return _course(scene, self, stop)[-1]
        try:
            sliding = self._sliding_under(scene, force, stop)
        except SolveFailure:
            if drag is None:
                raise
            return _course(scene, self, stop)[-1]  # the drag may be met before sliding would fold the skin
        most = abs(float(sliding.force[0]))
        if drag is None or most * (1.0 - ALL_SLIPS) <= drag <= most * (1.0 + ALL_SLIPS):
            return sliding
        if drag > most:
            raise beyond_friction(drag, most, force)
        return _course(scene, self, stop)[-1]

    def _sliding_under(self, scene: Scene, force: float, stop: Callable[[], bool]) -> Shape:
        """Return settled sliding under the normal force of a scene, reached as the force grows."""
        start = finite_forced.untouched(self.newton, float(scene.friction.mu), scene.friction.cap)
        start = replace(start, pull=start.pull._replace(sense=-(scene.loading.direction or 1)))
        grows = [Given(force * part, None) for part in (0.02, 0.1, 0.25, 0.5, 0.75, 1.0)]
        shape = start
        try:
            for reached in finite_forced.march(self.newton, start, Given(0.0, None), grows, stop):
                shape = reached
        except NotConverged:
            return self._deeper(shape, force, stop)
        return steady(self.newton, shape.pull, self.geometry.whole, start=shape, stop=stop)

    def _deeper(self, shape: Shape, force: float, stop: Callable[[], bool]) -> Shape:
        """Return settled sliding under `force` [N/mm], looked for by depth from `shape` on. Raises as `settled`."""
        outline = self.geometry.whole
        step = 0.1 * max(shape.pull.depth, 0.1)
        low = shape
        for _ in range(SEARCHES):  # deeper until it presses as hard
            begin = low if low.touching.any() else None
            high = steady(self.newton, low.pull._replace(depth=low.pull.depth + step), outline, start=begin, stop=stop)
            if high.force[1] >= force:
                break
            low, step = high, 1.5 * step
        else:
            raise NotConverged(f"No depth was found at which the finger presses with {force:.4g} N/mm.")
        for _ in range(SEARCHES):  # regula falsi, held inside by bisection
            part = (force - low.force[1]) / (high.force[1] - low.force[1])
            depth = low.pull.depth + float(np.clip(part, 0.05, 0.95)) * (high.pull.depth - low.pull.depth)
            found = steady(self.newton, low.pull._replace(depth=depth), outline, start=high, stop=stop)
            if abs(found.force[1] / force - 1.0) < MET or high.pull.depth - low.pull.depth < 1e-12:
                return found
            low, high = (low, found) if found.force[1] > force else (found, high)
        raise NotConverged(f"No depth was found at which the finger presses with {force:.4g} N/mm.")


def answers(
    scenes: Sequence[Scene], expected: float, fineness: float, progress: Progress | None = None
) -> list[Answer]:
    """Return the predictions of scenes that share a finger, or why there is none, on a mesh of that fineness.

    `expected` is the depth [mm] that they reach, or about it where forces are given. Raises SceneError where the finger
    cannot be meshed, Cancelled where `progress` (told the part done) says so.
    """
    begun = perf_counter()
    depth = max((_depth_reached(scene, expected) for scene in scenes), default=expected)
    fine = FiniteFinger.of(scenes[0], Sizing(fineness, depth, margin=MARGIN))
    setup = perf_counter() - begun
    coarse = [FiniteFinger.of(scenes[0], Sizing(fineness / 2.0, depth, s, margin=MARGIN)) for s in (False, True)]
    found: list[Answer] = []
    for number, scene in enumerate(scenes):
        part = number / len(scenes)

        def stop(part: float = part) -> bool:
            return progress is not None and not progress(part)

        if stop():
            raise Cancelled
        try:
            found.append(_predicted(scene, fine, coarse, setup, stop))
        except SolveFailure as failure:
            found.append(failure)
    return found


def _depth_reached(scene: Scene, expected: float) -> float:
    """Return the depth [mm] of a scene; under a given force, where a coarse mesh finds it, else what was expected."""
    if scene.normal_force is None:
        return scene.loading.depth
    never = scene.undragged()
    try:
        return FiniteFinger.of(scene, Sizing(COARSE, expected, margin=MARGIN)).settled(never, lambda: False).pull.depth
    except SolveFailure:
        return expected


def _pull(scene: Scene) -> Pull:
    return Pull(scene.loading.depth, float(scene.friction.mu), scene.friction.cap)


def _predicted(
    scene: Scene, finger: FiniteFinger, coarse: Sequence[FiniteFinger], setup: float, stop: Callable[[], bool]
) -> Prediction:
    begun = perf_counter()
    shape = direct = finger.settled(scene, stop)
    way: list[Shape] = []
    if scene.solve.course == "history":
        way = _course(scene, finger, stop)
        shape = way[-1]
    sed = finger.sed_ending(shape)
    driven = scene.driven(shape.pull.depth)
    body = finger.newton.body
    skin = _skin(finger, shape)
    force = shape.force
    row = Row(ROW, finger.row.average(body, shape.u))
    checks = _audits(driven, finger, shape)
    if way:
        checks["course_against_direct"] = abs(finger.sed_ending(direct) / sed - 1.0)
    solved = perf_counter()
    drag = _drag(scene, float(force[0]))
    sed_error, normal_error, tangential_error = _errors(scene, coarse, (sed, float(force[1]), drag), stop)
    width = _contact_width(skin)
    model = evidence.finite_model(
        driven, force=force, width=width, sticking=_sticking(shape), slide=_slide(finger, shape)
    )
    return Prediction(
        scene=scene,
        sed_ending=sed,
        sed_point=float(finger.point.average(body, shape.u)[0]),
        normal_force=float(force[1]),
        tangential_force=drag,
        contact_width=width,
        indentation=shape.pull.depth,
        shift=-shape.pull.travel if scene.loading.dragged else None,
        error_estimate=sed_error,
        normal_force_error=normal_error,
        tangential_force_error=tangential_error,
        dofs=body.dofs,
        newton_iterations=shape.iterations,
        wall_s=solved - begun,
        setup_s=setup,
        estimate_s=perf_counter() - solved,
        row=row,
        model=model,
        audits=checks,
        skin=skin,
        mesh=finger.geometry.mesh,
        displacement=shape.u,
        history=_history(scene, finger, way) if way else None,
        warnings=evidence.warnings(driven, model["left_out"]),
    )


def _course(scene: Scene, finger: FiniteFinger, stop: Callable[[], bool]) -> list[Shape]:
    """Return the states from first touch to the last settled slide, or to the end of the press or drag."""
    drag = scene.tangential_force
    if scene.normal_force is None:
        for direction in set(scene.loading.directions[:-1]):  # a slide that never settles is refused with its limits
            steady(finger.newton, _pull(scene)._replace(sense=-direction), finger.geometry.whole, stop=stop)
        way = _Driven(scene, finger, stop)
    else:
        way = _Forced(scene, scene.normal_force, finger, stop)
        if drag is not None:
            way.drag(-scene.loading.direction * drag)
            return way.shapes
    for direction in scene.loading.directions:
        _settle(way, scene, direction)
    return way.shapes


def _settle(way: "_Driven | _Forced", scene: Scene, direction: int) -> None:
    """Slide until the response does not change any more. Raises NotConverged where it still does."""
    depth = way.shapes[-1].pull.depth
    sed = way.finger.sed_ending(way.shapes[-1])
    for _ in range(int(LONGEST / STRIDE)):
        way.slide(direction * STRIDE * depth)
        before, sed = sed, way.finger.sed_ending(way.shapes[-1])
        if not (way.shapes[-1].state == STICK).any() and abs(sed - before) <= SETTLED * sed:
            return
    raise NotConverged(
        f"After {LONGEST * depth:.3g} mm of sliding at {depth:.3g} mm of indentation and mu = {scene.friction.mu:.3g} "
        "the response still changes: no settled state was reached."
    )


class _Driven:
    """A course driven by depth and travel, pressed when made."""

    def __init__(self, scene: Scene, finger: FiniteFinger, stop: Callable[[], bool]) -> None:
        self.finger, self._stop = finger, stop
        self._pull = _pull(scene)
        pulls = [self._pull._replace(depth=self._pull.depth * (i + 1) / PRESSES) for i in range(PRESSES)]
        self.shapes = list(march(self.finger.newton, pulls, stop=self._stop))

    def slide(self, distance: float) -> None:
        """Move the bone by `distance` along +x [mm]."""
        self._pull = self._pull._replace(travel=self._pull.travel - distance)
        self.shapes += march(self.finger.newton, [self._pull], self.shapes[-1], stop=self._stop)


class _Forced:
    """A course under a given normal force, and a given travel or drag; pressed when made."""

    def __init__(self, scene: Scene, normal: float, finger: FiniteFinger, stop: Callable[[], bool]) -> None:
        self.finger, self._stop = finger, stop
        self._given = Given(0.0, 0.0 if scene.loading.dragged else None)
        self.shapes = [finite_forced.untouched(finger.newton, float(scene.friction.mu), scene.friction.cap)]
        self._go([self._given._replace(normal=normal * (i + 1) / PRESSES) for i in range(PRESSES)])
        del self.shapes[0]

    def _go(self, aims: list[Given]) -> None:
        self.shapes += finite_forced.march(self.finger.newton, self.shapes[-1], self._given, aims, self._stop)
        self._given = aims[-1]

    def slide(self, distance: float) -> None:
        """Move the bone by `distance` along +x [mm]."""
        self._go([self._given._replace(travel=self._given.travel - distance)])

    def drag(self, pull: float) -> None:
        """Let the surface's pull along +x grow to `pull` [N/mm]."""
        self._go([self._given._replace(tangential=pull * (i + 1) / PRESSES) for i in range(PRESSES)])


def _errors(
    scene: Scene, coarse: Sequence[FiniteFinger], answer: tuple[float, float, float], stop: Callable[[], bool]
) -> tuple[float, float, float]:
    """Return how far SED, normal and tangential force may be off, relative: from two meshes of elements twice as long.

    One of the two is moved along the skin by half an element, so that the edges of contact fall differently between
    nodes: the larger difference from the answer plus the difference of the two.
    """
    try:
        shapes = [(finger, _nearest(scene, finger, stop)) for finger in coarse]
    except SolveFailure:
        return 1.0, 1.0, 1.0  # so near a limit that a coarser mesh has no state: nothing is known of the error
    seen = np.array([[f.sed_ending(s), s.force[1], _drag(scene, float(s.force[0]))] for f, s in shapes])
    found = np.array(answer)
    differences = np.abs(seen - found).max(axis=0) + np.abs(seen[0] - seen[1])
    sed, normal, tangential = (SAFETY * differences / np.where(found != 0.0, np.abs(found), 1.0)).tolist()
    return sed, normal, tangential


def _nearest(scene: Scene, finger: FiniteFinger, stop: Callable[[], bool]) -> Shape:
    """Return the settled state on a coarser mesh, whose friction limit may lie just below the drag asked for."""
    try:
        return finger.settled(scene, stop)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return finger.settled(scene.undragged(), stop)


def _drag(scene: Scene, tangential: float) -> float:
    """Return the drag opposing the slide [N/mm]; without a slide, the size of the tangential force."""
    return abs(tangential) if scene.loading.direction == 0 else 0.0 - scene.loading.direction * tangential  # never -0


def _sticking(shape: Shape) -> float:
    touching = int(shape.touching.sum())
    return int((shape.state == STICK).sum()) / touching if touching else 0.0


def _slide(finger: FiniteFinger, shape: Shape) -> float:
    """Return the largest sideways displacement of the skin that may touch [mm]."""
    return float(np.abs(shape.u[finger.geometry.mesh.skin, 0]).max())


def _skin(finger: FiniteFinger, shape: Shape) -> Skin:
    place = shape.place(finger.newton.body)
    touching = shape.touching
    length = np.where(touching, kernels_numpy.tributary(place[:, 0]), 1.0)
    return Skin(
        x=place[:, 0],
        gap=np.where(touching, 0.0, place[:, 1] - shape.pull.depth),
        pressure=shape.reaction[:, 1] / length,
        traction=shape.reaction[:, 0] / length,
        state=tuple(NAMES[int(state)] for state in shape.state),
    )


def _contact_width(skin: Skin) -> float:
    """Return the distance along the surface from the first to the last touching point, half an edge added [mm]."""
    touching = np.flatnonzero(np.array(skin.state) != "open")
    if not len(touching):
        return 0.0
    first, last, count = int(touching[0]), int(touching[-1]), len(skin.x)
    low = (skin.x[first] + skin.x[max(first - 1, 0)]) / 2.0
    high = (skin.x[last] + skin.x[min(last + 1, count - 1)]) / 2.0
    return float(high - low)


def _audits(scene: Scene, finger: FiniteFinger, shape: Shape) -> dict[str, float]:
    """Return the checks of one state. Perfect is 0, save for `smallest_det_F` (of displacement at quadrature points).

    `equilibrium_x`, `equilibrium_y`: bone reaction plus contact force, by the contact force. `inner_forces`: largest
    unbalanced force on a node that is neither held nor touching. `penetration`, `tension`, `cone_violation`: as at
    small strain, the bound on the deformed length.
    """
    body, mesh = finger.newton.body, finger.geometry.mesh
    element_forces, _ = kernels_numpy.forces_and_tangents(body, shape.u, np.zeros((len(body.nodes), 3)))
    inner = np.zeros(mesh.nodes.shape)
    np.add.at(inner, body.nodes, element_forces.reshape(-1, 9, 2))
    total = max(float(shape.force[1]), np.finfo(float).tiny)
    bone = inner[mesh.held].sum(axis=0)
    free = np.ones(len(mesh.nodes), bool)
    free[mesh.held] = free[mesh.skin] = False
    height = mesh.nodes[finger.geometry.whole, 1] + shape.u[finger.geometry.whole, 1] - shape.pull.depth
    normal, tangential = shape.reaction[:, 1], shape.reaction[:, 0]
    push = max(float(normal.max(initial=0.0)), np.finfo(float).tiny)
    # Open skin may hang over, its length along the surface negative: no limit of it is meant.
    length = np.maximum(kernels_numpy.tributary(shape.place(body)[:, 0]), 0.0)
    limit = scene.friction.mu * np.maximum(normal, 0.0)
    if scene.friction.tau_max is not None:
        limit = np.minimum(limit, scene.friction.tau_max * length)
    return {
        "equilibrium_x": abs(float(bone[0] + shape.force[0])) / total,
        "equilibrium_y": abs(float(bone[1] + shape.force[1])) / total,
        "inner_forces": float(np.abs(inner[free]).max()) / total,
        "penetration": max(-float(height.min()), 0.0) / scene.loading.depth,
        "tension": max(-float(normal.min(initial=0.0)), 0.0) / push,
        "cone_violation": max(float((np.abs(tangential) - limit).max(initial=0.0)), 0.0) / push,
        "smallest_det_F": float(np.linalg.det(kernels_numpy.deformation(body, shape.u)).min()),
    }


def _history(scene: Scene, finger: FiniteFinger, way: Sequence[Shape]) -> History:
    body, speed = finger.newton.body, scene.loading.speed
    travel = np.array([-shape.pull.travel for shape in way])
    depth = np.array([shape.pull.depth for shape in way])
    gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(travel)))])
    drags = scene.loading.dragged
    after = np.arange(1, len(way) - PRESSES + 1) / PRESSES if drags else gone[PRESSES:] / speed
    skins = [_skin(finger, shape) for shape in way]
    slipping = np.array([1.0 - _sticking(shape) if shape.touching.any() else 0.0 for shape in way])
    return History(
        time=np.concatenate([np.arange(1, PRESSES + 1) / PRESSES, 1.0 + after]),
        bone_x=travel,
        bone_y=-depth,
        sed_ending=np.array([finger.sed_ending(shape) for shape in way]),
        sed_point=np.array([float(finger.point.average(body, shape.u)[0]) for shape in way]),
        normal_force=np.array([float(shape.force[1]) for shape in way]),
        tangential_force=np.array([_drag(scene, float(shape.force[0])) for shape in way]),
        contact_width=np.array([_contact_width(skin) for skin in skins]),
        slipping=slipping,
    )
