"""Settled states of a scene at small strain on one mesh, or why there is none and how far there would be one.

Also the depth to which a normal force presses the finger, for which meshes are made.

As the coefficient of friction grows, so does the force with which the drag presses the finger down, until the finger
yields less than it is pressed: the forces of the settled state grow without bound at a finite coefficient, and beyond
it there is no settled state: the drag wedges the finger into the surface. The limit is reached by following the state
as the coefficient grows.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from math import log2, sqrt

import numpy as np

from solver.arrays import Array
from solver.equilibrium import EquilibriumState, LoadState, Newton
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import march, slide_or_hold
from solver.equilibrium.load_stepping import forces_of, slide_from_guess, slide_under, sliding_load
from solver.equilibrium.load_stepping import solve_full_slip as full_slip
from solver.failures import ContactLost, NoSteadyState, NotConverged
from solver.mesh.mesher import Sizing
from solver.scene import Scene
from solver.scene.tables import SHALLOW, Friction, SceneError

WIDE = 16.0  # margin at which nearly all the palmar skin may touch
FINENESS = 7.0  # of the meshes on which limits of depth and force are looked for: they hardly depend on the mesh
ROUGH = 6.0  # of the mesh on which depths under a force are looked for, good to some tenths of a per cent of the depth
COVERED = 0.9  # of the highest skin that touches: a mesh for that depth looks for contact up to 1.25 times of it
NEARLY = 0.5  # of what makes it slide, from which a finger that is dragged is about as deep as one that slides
DEEPEST = 0.85  # of the tissue between first touch and bone: beyond, a small-strain depth means nothing


@dataclass(frozen=True, slots=True)
class LimitSearch:
    """How a limit of friction, depth or force is looked for."""

    finer: float = 1.6  # times as fine is the mesh on which a limit of depth is looked at once more
    beyond: float = 2.0  # times the largest depth met as a force grew, up to which the largest is looked for
    patience: int = 15  # corrections of states that a small step may take
    least: float = 1e-3  # part of a depth or force below which no limit of it is looked for
    close: float = 0.005  # relative step of mu below which a limit is taken as found
    nudge: float = 1e-4  # of a given force, to see whether the finger gives way


LIMIT_SEARCH = LimitSearch()


def continue_in_friction(
    newton: Newton, load: LoadState, force: float | None = None, first: EquilibriumState | None = None
) -> tuple[EquilibriumState | None, float]:
    """Return the settled sliding state under `load` reached by following it from mu = 0, and the largest mu with one.

    The state is None where that mu falls short of the one of `load`. Under a normal `force`, `first` is the state at
    mu = 0; the mu is then 0 where contact grew beyond the skin that may touch: nothing is known.
    """
    reached, step, unknown = 0.0, load.mu, False
    try:
        state = full_slip(newton, load._replace(mu=0.0)) if first is None else first
    except ContactLost:
        return None, 0.0
    while reached < load.mu and step > LIMIT_SEARCH.close * max(reached, min(0.01, load.mu)):
        aim = min(reached + step, load.mu)
        try:
            further = slide_from_guess(newton, load._replace(mu=aim), state.state, force, LIMIT_SEARCH.patience)
        except ContactLost:
            step /= 2.0
            continue
        under_force = first is not None
        if further.reaches_end:  # the skin that may touch ends: what lies beyond is not known
            step, unknown = step / 2.0, under_force
        elif under_force and not further.load.depth > 0.0:  # pressed by a surface that it does not reach
            step /= 2.0
        else:
            state, reached, step = further, aim, 2.0 * step
    if reached == load.mu:
        return state, reached
    return None, 0.0 if unknown else reached


class Bodies:
    """Meshes of one finger, each for depths around a power of two."""

    def __init__(self, scene: Scene) -> None:
        """Make none yet."""
        self._scene = scene
        self._by_power: dict[int, Newton] = {}

    def at(self, depth: float) -> Newton:
        """Return a body whose mesh serves `depth` [mm], from 0.7 to 1.4 times the one it was made for."""
        power = round(log2(depth))
        if power not in self._by_power:
            self._by_power[power] = self.build_for(2.0**power, FINENESS)
        return self._by_power[power]

    def build_for(self, depth: float, fineness: float) -> Newton:
        """Return a body with a mesh of its own."""
        return LinearFinger.of(self._scene, Sizing(fineness, depth, margin=WIDE)).newton


def limits(scene: Scene, load: LoadState) -> tuple[float | None, float | None]:
    """Return the largest normal force [N/mm] and depth [mm] with settled sliding under `load`, to 3 and 4 %.

    Below those of the scene; the force is None where the scene gives none, and either where it is not known.
    """
    bodies = Bodies(scene)
    if scene.normal_force is None:
        return None, _deepest(bodies, load, scene.loading.depth)
    strongest = _strongest(bodies, scene, scene.normal_force, load)
    if strongest is None:
        return None, None
    return strongest[0], _deepest(bodies, load, LIMIT_SEARCH.beyond * strongest[1], strongest[1])


def _deepest(bodies: Bodies, load: LoadState, high: float, low: float | None = None) -> float | None:
    """Return the largest indentation [mm] below `high`, and above `low` where that is known, with settled sliding.

    None where there is none, or where a finer mesh puts it elsewhere, as it does at coefficients far beyond the limit.
    """

    def slides(depth: float) -> bool:
        return continue_in_friction(bodies.at(depth), load._replace(depth=depth))[0] is not None

    least = LIMIT_SEARCH.least * high
    while low is None:
        if high < least:
            return None
        low, high = (high / 2.0, high) if slides(high / 2.0) else (None, high / 2.0)
    deepest = _largest(slides, low, high)
    finer = bodies.build_for(deepest, LIMIT_SEARCH.finer * FINENESS)
    ends = [continue_in_friction(finer, load._replace(depth=part * deepest))[0] is None for part in (0.97, 1.03)]
    return deepest if ends == [False, True] else None


def _strongest(bodies: Bodies, scene: Scene, force: float, load: LoadState) -> tuple[float | None, float] | None:
    """Return the largest normal force [N/mm] below `force` with settled sliding, and the largest depth [mm] on the way.

    The force is None where a finer mesh puts it elsewhere; all is None where there is no sliding.
    """
    depths, bone = [0.0], scene.finger.pulp_thickness()
    bare = load._replace(mu=0.0)

    def reached(newton: Newton, force: float) -> EquilibriumState | None:
        return continue_in_friction(newton, load, force, slide_under(newton, bare, force, bone))[0]

    def rubless(force: float) -> float:
        return slide_under(bodies.at(bone / 2.0), bare, force, bone).load.depth

    def slides(force: float) -> bool:
        with suppress(ContactLost):
            state = reached(bodies.at(rubless(force)), force)
            if state is not None:
                depths.append(state.load.depth)
            return state is not None
        return False

    if not slides(LIMIT_SEARCH.least * force):
        return None
    most = _largest(slides, LIMIT_SEARCH.least * force, force)
    finer = bodies.build_for(rubless(most), LIMIT_SEARCH.finer * FINENESS)
    ends = [reached(finer, part * most) is None for part in (0.97, 1.03)]
    return most if ends == [False, True] else None, max(depths)


def _largest(exists: Callable[[float], bool], low: float, high: float) -> float:
    """Return up to where between `low`, which does, and `high` there is what `exists`, within 1 %."""
    while high > 1.02 * low:
        middle = sqrt(low * high)
        low, high = (middle, high) if exists(middle) else (low, middle)
    return sqrt(low * high)


def settled_state(scene: Scene, finger: LinearFinger, times: float = 1.0) -> EquilibriumState:
    """Return the settled state, without its history where it has none left, else in `times` the usual load steps.

    Raises NotConverged, ContactLost where no slide was found, and NoSteadyState where a given drag is more than
    friction carries.
    """
    load, loading, newton = sliding_load(scene), scene.loading_per_mm, finger.newton
    if loading.direction == 0 and not load.frictionless:
        return march(scene, finger, times).last
    if loading.normal_force is None:
        return full_slip(newton, load)
    force, deepest = loading.normal_force, DEEPEST * scene.finger.pulp_thickness()
    return slide_or_hold(
        scene, lambda: slide_under(newton, load, force, deepest), lambda: march(scene, finger, times).last
    )


def follow_friction(scene: Scene, finger: LinearFinger) -> tuple[EquilibriumState | None, float]:
    """Return full slip at the depth or normal force of a scene, as `continue_in_friction` does from mu = 0.

    Raises NoSteadyState where that force presses the finger to its bone.
    """
    load, force = sliding_load(scene), scene.normal_force
    if force is None:
        return continue_in_friction(finger.newton, load)
    deepest = DEEPEST * scene.finger.pulp_thickness()
    try:
        first = slide_under(finger.newton, load._replace(mu=0.0), force, deepest)
    except ContactLost:
        return None, 0.0
    reached, limit = continue_in_friction(finger.newton, load, force, first)
    if limit == 0.0:
        in_tissue(scene, finger, first.load.depth)
    return reached, limit


def gives_way(scene: Scene, finger: LinearFinger, state: EquilibriumState) -> bool:
    """Return whether a settled slide under a given force would be less deep under a little more force."""
    force = scene.normal_force
    if force is None or scene.loading.direction == 0 or state.sticking > 0.0:
        return False
    try:
        harder = slide_from_guess(finger.newton, sliding_load(scene), state.state, (1.0 + LIMIT_SEARCH.nudge) * force)
    except ContactLost:
        return False
    return harder.load.depth < state.load.depth


def in_tissue(scene: Scene, finger: LinearFinger, depth: float) -> None:
    """Raise SolveFailure where a given force has led to a `depth` [mm] that means nothing, as beyond the bone."""
    room, most = scene.finger.pulp_thickness(), None
    if depth >= room:
        with suppress(ContactLost):
            most = float(full_slip(finger.newton, sliding_load(scene)._replace(depth=room)).force[1])
    within_reach(scene, depth, most)


def remove_round_off(
    scene: Scene, finger: LinearFinger, state: EquilibriumState, displacement: Array
) -> tuple[EquilibriumState, Array]:
    """Return a state and its displacement (nodes, 2) once more, with less round-off: balanced, the skin on the surface.

    The elimination leaves some 1e-13 of the forces unbalanced, which falls by processor: a Newton step from the forces
    of the elements takes it out. The contact states stay if they can.
    """
    about, recover = finger.body.linearise_about(displacement)
    newton = Newton(about)
    try:
        again = newton.solve_linear(
            replace(state, u=np.zeros_like(state.u)), state.load, newton.skin_x, forces_of(scene, state.load)
        )
    except ContactLost:
        return state, displacement
    return replace(again, u=state.u + again.u, iterations=state.iterations), recover(again.u)


def nearest(scene: Scene, finger: LinearFinger) -> EquilibriumState:
    """Return the settled state on a coarser mesh, whose friction limit may lie just below the drag asked for.

    Where no guess leads to it, as with large coefficients, it is followed from mu = 0. Raises as `settled_state`.
    """
    try:
        return settled_state(scene, finger)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return settled_state(scene.without_drag(), finger)
    except ContactLost:
        if scene.normal_force is not None or scene.loading.direction == 0:
            raise
        reached, _ = follow_friction(scene, finger)
        if reached is None:
            raise
        return reached


def direct(scene: Scene, finger: LinearFinger, times: float = 1.0) -> EquilibriumState:
    """Return the settled state; where it depends on its way, after so many `times` the usual load steps.

    Near a limit, or beyond it, guesses can end in states that no sliding leads to. Where none was found, or one that is
    folded, only what is reached by following the state from mu = 0 counts. Raises NoSteadyState, NotConverged.
    """
    direction = scene.loading.direction
    try:
        state = settled_state(scene, finger, times)
        # in states that no sliding leads to tissue is turned inside out somewhere
        if direction == 0 or state.load.path_dependent or finger.body.smallest_det(finger.displacement(state)) > 0.0:
            return state
        why = "the state found is folded"
    except ContactLost as lost:
        why = str(lost)
    if direction == 0:
        raise _no_answer(scene, why, 0.0)
    reached, limit = follow_friction(scene, finger)
    if reached is None:
        raise _no_answer(scene, why, limit)
    return reached


def _no_answer(scene: Scene, why: str, limit_mu: float) -> NoSteadyState | NotConverged:
    """Return the failure that says what is known."""
    force = scene.normal_force
    at = f"{scene.loading.depth:g} mm indentation" if force is None else f"a normal force of {force:g} N/mm"
    at += f" and mu = {float(scene.friction.mu):g}"
    if scene.friction.tau_max is not None:
        at += f" with tau_max = {scene.friction.tau_max:g} MPa"
    if scene.loading.direction == 0 or limit_mu <= 0.0:
        return NotConverged(
            f"No settled state was found at {at}, from any first guess: {why}; ask for less friction or depth."
        )
    limit_force = limit_depth = None
    with suppress(NotConverged):  # stiffnesses that a mesh for less depth does not stand
        limit_force, limit_depth = limits(scene, sliding_load(scene))
    known = ((limit_force, "N/mm"), (limit_depth, "mm"))
    elsewhere = " and ".join(f"{limit:.3g} {unit}" for limit, unit in known if limit is not None)
    along = "+x" if scene.loading.direction > 0 else "-x"
    where = "at this depth" if force is None else "under this force"
    message = (
        f"There is no steady sliding along {along} at {at}: the drag presses the finger against the surface faster "
        f"than it yields, so it wedges; followed from mu = 0, steady sliding {where} ends at mu = {limit_mu:.3g}"
    )
    if elsewhere:
        message += f", and with this friction at {elsewhere}"
    return NoSteadyState(
        f"{message}.", limit_mu=limit_mu, limit_indentation=limit_depth, limit_normal_force=limit_force
    )


def matching_depths(scenes: Sequence[Scene], normal_forces: Sequence[float]) -> tuple[float | None, ...]:
    """Return for each scene the indentation [mm] at which its settled normal force is the given one [N/mm].

    Found directly, with the depth as an unknown and the force given. All scenes share the finger, materials and
    receptor of the first. None where the finger would be pressed to its bone, or has no such settled state.
    """
    if not scenes:
        return ()
    deepest = DEEPEST * scenes[0].finger.pulp_thickness()
    finger = _finger(scenes[0].frictionless_press(deepest))
    pressed = [_pressed(finger, scene, force, deepest) for scene, force in zip(scenes, normal_forces, strict=True)]
    return tuple(None if state is None else state.load.depth for state in pressed)


def expected_depth(scene: Scene) -> float:
    """Return the indentation [mm], or about what a given force will lead to, for which meshes are made."""
    force = scene.normal_force
    if force is None:
        return scene.loading.depth
    deepest = DEEPEST * scene.finger.pulp_thickness()
    try:
        finger = _finger(scene.frictionless_press(deepest))
    except (SceneError, NotConverged):  # who makes the meshes that count will tell
        return deepest
    state = _pressed(finger, scene, force, deepest)
    drag = scene.tangential_force or 0.0
    held = scene.loading.direction == 0 or scene.loading.dragged
    if held and (state is None or drag < NEARLY * abs(state.force[0])):
        # Then it goes about as deep as one that slides with so much drag and no more.
        friction = Friction(min(drag / force, float(scene.friction.mu)), scene.friction.tau_max)
        state = _pressed(finger, replace(scene, friction=friction), force, deepest)
    if state is None:
        return deepest
    # A strong drag lifts the bone while it lays ever more skin on the surface, which the mesh must be made for.
    highest = float(finger.body.condensed.rest[state.touching, 1].max())
    return max(state.load.depth, COVERED * highest, SHALLOW)


def within_reach(scene: Scene, depth: float, most: float | None = None) -> None:
    """Raise SolveFailure where a given force has led to a `depth` [mm] that no model of the tissue reaches.

    `most` is the normal force [N/mm] that the tissue carries down to the bone, where that is known.
    """
    force, room = scene.normal_force, scene.finger.pulp_thickness()
    if force is None or SHALLOW <= depth < room:
        return
    if depth < 0.0:
        raise NotConverged(
            f"Under a normal force of {force:.3g} N/mm the drag holds the bone {-depth:.3g} mm above first touch: ask "
            "for more force, or less friction or drag."
        )
    if depth < SHALLOW:
        raise NotConverged(
            f"A normal force of {force:.3g} N/mm presses the finger {depth:.1g} mm deep only: below {SHALLOW:g} mm "
            "round-off is as large as what there is to find; ask for more."
        )
    carried = "" if most is None else f": with this friction the {room:.3g} mm of tissue carry up to {most:.3g} N/mm"
    raise NoSteadyState(
        f"A normal force of {force:.3g} N/mm would press the finger {depth:.3g} mm deep, to its bone{carried}; "
        "ask for less."
    )


@lru_cache(maxsize=1)
def _finger(bare: Scene) -> LinearFinger:
    """Return the finger on a rough mesh: surfaces of one finger follow each other and share it."""
    return LinearFinger.of(bare, Sizing(ROUGH, bare.loading.depth))


def _pressed(finger: LinearFinger, scene: Scene, normal_force: float, deepest: float) -> EquilibriumState | None:
    """Return the settled slide under a normal force [N/mm], None where none is less deep than `deepest` [mm]."""
    try:
        state = slide_under(finger.newton, sliding_load(scene), normal_force, deepest)
    except ContactLost:
        return None
    return None if state.reaches_end or state.load.depth > deepest else state
