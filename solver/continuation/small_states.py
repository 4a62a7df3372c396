"""Settled states of a scene at small strain on one mesh, the states beside them, and what is estimated of them."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from solver._kernels import STICK
from solver.arrays import Array
from solver.continuation.wedging import continue_branch
from solver.equilibrium.expected_depth import DEEPEST, within_reach
from solver.equilibrium.finger import LinearFinger, forces_of, load_of, sliding_load
from solver.equilibrium.full_slip import settled as full_slip
from solver.equilibrium.full_slip import slide_beside, slide_under
from solver.equilibrium.load_path import Instant, RelaxingWay, march
from solver.equilibrium.newton import EquilibriumState, Newton
from solver.failures import ContactLost, NoSteadyState, beyond_friction
from solver.progress import Progress, report_part
from solver.scene.scene import Scene

ALL_SLIPS = 1e-6  # part of the friction limit within which a given drag is that of sliding
NUDGE = 1e-4  # of a given force, to see whether the finger gives way


def settled(scene: Scene, finger: LinearFinger, times: float = 1.0) -> EquilibriumState:
    """Return the settled state, without its history where it has none left, else in `times` the usual load steps.

    Raises NotConverged, ContactLost where no slide was found, and NoSteadyState where a given drag is more than
    friction carries.
    """
    load, loading, newton = sliding_load(scene), scene.loading_per_mm, finger.newton
    if loading.direction == 0 and not load.frictionless:
        return march(scene, finger, times).last
    if loading.normal_force is None:
        return full_slip(newton, load)
    deepest = DEEPEST * scene.finger.pulp_thickness()
    try:
        found = slide_under(newton, load, loading.normal_force, deepest)
    except ContactLost:
        if loading.tangential_force is None:
            raise
        # the drag may be met where sliding would wedge
        return march(scene, finger, times).last
    if loading.tangential_force is None:
        return found
    most = abs(float(found.force[0]))
    if loading.tangential_force > most * (1.0 + 1e-9):
        raise beyond_friction(loading.tangential_force, most, loading.normal_force)
    if loading.tangential_force >= most * (1.0 - ALL_SLIPS):
        return found
    return march(scene, finger, times).last


def followed_under(scene: Scene, finger: LinearFinger) -> tuple[EquilibriumState | None, float]:
    """Return full slip under the normal force of a scene, continued from mu = 0 as `wedging.continue_branch` does.

    Raises NoSteadyState where that force presses the finger to its bone.
    """
    load, force = sliding_load(scene), scene.normal_force or 0.0
    deepest = DEEPEST * scene.finger.pulp_thickness()
    try:
        first = slide_under(finger.newton, load._replace(mu=0.0), force, deepest)
    except ContactLost:
        return None, 0.0
    reached, limit = continue_branch(finger.newton, load, force, first)
    if limit == 0.0:
        in_tissue(scene, finger, first.load.depth)
    return reached, limit


def gives_way(scene: Scene, finger: LinearFinger, state: EquilibriumState) -> bool:
    """Return whether a settled slide under a given force would be less deep under a little more force."""
    force = scene.normal_force
    if force is None or scene.loading.direction == 0 or (state.state == STICK).any():
        return False
    try:
        beside = slide_beside(finger.newton, sliding_load(scene), state.state, (1.0 + NUDGE) * force)
    except ContactLost:
        return False
    return beside.load.depth < state.load.depth


def in_tissue(scene: Scene, finger: LinearFinger, depth: float) -> None:
    """Raise SolveFailure where a given force has led to a `depth` [mm] that means nothing, as beyond the bone."""
    room, most = scene.finger.pulp_thickness(), None
    if depth >= room:
        with suppress(ContactLost):
            most = float(full_slip(finger.newton, sliding_load(scene)._replace(depth=room)).force[1])
    within_reach(scene, depth, most)


def depends_on_way(scene: Scene, state: EquilibriumState) -> bool:
    """Return whether a state is the end of a course and not a settled slide."""
    pressed = scene.loading.direction == 0 and not load_of(scene).frictionless
    return pressed or bool((state.state == STICK).any())


def marched(
    scene: Scene, finger: LinearFinger, progress: Progress | None = None, times: float = 1.0
) -> tuple[tuple[Instant, ...], Array | None]:
    """Return the whole way, and where tissues relax the SED of ending and point at each instant (m, 2) [MPa]."""
    way = march(
        scene, finger, times, relaxing=scene.materials.relax, report=lambda _, part: report_part(progress, part)
    )
    over_time = np.array([(0.0, 0.0), *way.energies]) if isinstance(way, RelaxingWay) else None
    return tuple(way.instants), over_time


def end(scene: Scene, finger: LinearFinger, times: float = 1.0) -> EquilibriumState:
    """Return the end of a course that it depends on. Raises NotConverged."""
    return march(scene, finger, times, relaxing=scene.materials.relax and scene.solve.course == "history").last


def refined(
    scene: Scene, finger: LinearFinger, state: EquilibriumState, displacement: Array
) -> tuple[EquilibriumState, Array]:
    """Return a state and its displacement (nodes, 2) once more, with less round-off: balanced, the skin on the surface.

    The elimination leaves some 1e-13 of the forces unbalanced, which falls by processor: a Newton step from the forces
    of the elements takes it out. The contact states stay if they can.
    """
    about, recover = finger.body.linearised(displacement)
    newton = Newton(about)
    try:
        again = newton.solved(
            replace(state, u=np.zeros_like(state.u)), state.load, newton.skin_x, forces_of(scene, state.load)
        )
    except ContactLost:
        return state, displacement
    return replace(again, u=state.u + again.u, iterations=state.iterations), recover(again.u)


def nearest(scene: Scene, finger: LinearFinger) -> EquilibriumState:
    """Return the settled state on a coarser mesh, whose friction limit may lie just below the drag asked for.

    Where no guess leads to it, as with large coefficients, it is followed from mu = 0. Raises as `settled`.
    """
    try:
        return settled(scene, finger)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return settled(scene.undragged(), finger)
    except ContactLost:
        if scene.normal_force is not None or scene.loading.direction == 0:
            raise
        reached, _ = continue_branch(finger.newton, sliding_load(scene))
        if reached is None:
            raise
        return reached
