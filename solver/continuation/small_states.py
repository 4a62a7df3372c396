"""Settled states of a scene at small strain on one mesh, the states beside them, and what is estimated of them."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from solver.accuracy.step_error import HALF
from solver.body.tissues import relaxing_laws
from solver.contact.active_set import SHEAR_LIMITED, STICK, Contact, ContactLost, Course, forced
from solver.contact.law import STEEP, FrictionLaw
from solver.continuation.wedging import followed
from solver.equilibrium.expected_depth import DEEPEST, within_reach
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.load_path import PRESSING_STEPS, PRESSING_TIME, March, Progress, march
from solver.equilibrium.pressing import depth_of, sliding_under
from solver.equilibrium.relaxation import RelaxingBody, RelaxingWay, march_relaxing
from solver.failures import NoSteadyState, beyond_friction
from solver.mesh import Array
from solver.scene import Scene

ALL_SLIPS = 1e-6  # part of the friction limit within which a given drag is that of sliding
NUDGE = 1e-4  # of the coefficient of friction, or of the bound of a settled slide, to see what it does
FURTHER = 1e-2  # of the traction bound, to see what it does on a whole course


def law_of(scene: Scene) -> FrictionLaw:
    """Return the friction of a scene."""
    cap = scene.friction.cap
    return FrictionLaw(float(scene.friction.mu) if cap > 0.0 else 0.0, cap)  # no friction is sought as such


def settled(scene: Scene, finger: FingerModel, times: float = 1.0) -> Contact:
    """Return the settled state, without its history where it has none left, else in `times` the usual load steps.

    Raises ContactLost, NotConverged, and NoSteadyState where a given drag is more than friction carries.
    """
    law, touch, loading = law_of(scene), finger.body.touchable, scene.loading_per_mm
    if loading.direction == 0 and not law.frictionless:
        return march(touch, law, loading, times=times).instants[-1].contact
    if loading.normal_force is None:
        return Course(touch, law).sliding(loading.depth, loading.direction or 1)
    deepest = DEEPEST * scene.finger.pulp_thickness()
    try:
        found = sliding_under(touch, law, loading.normal_force, loading.direction or 1, deepest)
    except ContactLost:
        if loading.tangential_force is None:
            raise
        # the drag may be met where sliding would wedge
        return march(touch, law, loading, times=times).instants[-1].contact
    if loading.tangential_force is None:
        return found
    most = float(np.abs(found.tangential.sum()))
    if loading.tangential_force > most * (1.0 + 1e-9):
        raise beyond_friction(loading.tangential_force, most, loading.normal_force)
    if loading.tangential_force >= most * (1.0 - ALL_SLIPS):
        return found
    return march(touch, law, loading, times=times).instants[-1].contact


def followed_under(scene: Scene, finger: FingerModel) -> tuple[Contact | None, float]:
    """Return settled sliding under the normal force of a scene, followed from mu = 0, as `wedging.followed` does.

    Raises NoSteadyState where that force presses the finger to its bone.
    """
    law, touch, force = law_of(scene), finger.body.touchable, scene.normal_force or 0.0
    direction, deepest = scene.loading.direction, DEEPEST * scene.finger.pulp_thickness()
    try:
        first = sliding_under(touch, replace(law, mu=0.0), force, direction, deepest)
    except ContactLost:
        return None, 0.0
    reached, limit = followed(forced(touch, force), law, 0.0, direction, first)
    if limit == 0.0:
        in_tissue(scene, finger, depth_of(first))
    return reached, limit


def gives_way(scene: Scene, finger: FingerModel, contact: Contact) -> bool:
    """Return whether a settled slide under a given force would be less deep under a little more force."""
    direction, force = scene.loading.direction, scene.normal_force
    if force is None or direction == 0 or (contact.state == STICK).any():
        return False
    more = forced(finger.body.touchable, (1.0 + NUDGE) * force)
    try:
        beside = Course(more, law_of(scene)).sliding(0.0, direction, contact.state)
    except ContactLost:
        return False
    return depth_of(beside) < depth_of(contact)


def in_tissue(scene: Scene, finger: FingerModel, depth: float) -> None:
    """Raise SolveFailure where a given force has led to a `depth` [mm] that means nothing, as beyond the bone."""
    room, most = scene.finger.pulp_thickness(), None
    if depth >= room:
        with suppress(ContactLost):
            slide = Course(finger.body.touchable, law_of(scene)).sliding(room, scene.loading.direction or 1)
            most = float(slide.normal.sum())
    within_reach(scene, depth, most)


def depends_on_way(scene: Scene, contact: Contact) -> bool:
    """Return whether a state is the end of a course and not a settled slide."""
    pressed = scene.loading.direction == 0 and not law_of(scene).frictionless
    return pressed or bool((contact.state == STICK).any())


def marched(
    scene: Scene, finger: FingerModel, progress: Progress | None = None, times: float = 1.0
) -> tuple[March, Array | None]:
    """Return the whole way, and where tissues relax the SED of ending and point at each instant (m, 2) [MPa]."""
    law, loading = law_of(scene), scene.loading_per_mm
    if not scene.materials.relax:
        return march(finger.body.touchable, law, loading, progress, times), None
    laws = relaxing_laws(scene.materials)
    body = RelaxingBody(finger.geometry.mesh, laws, checked=True)
    first = PRESSING_TIME / round(PRESSING_STEPS * times)
    way = RelaxingWay(body, law, loading, finger.ending, finger.point, first)
    march_relaxing(way, loading, scene.materials.longest_creep, progress, times)
    return way.march(), np.array(way.sed)


def end(scene: Scene, finger: FingerModel, times: float = 1.0) -> Contact:
    """Return the end of a course that it depends on. Raises NotConverged."""
    if scene.materials.relax and scene.solve.course == "history":
        return marched(scene, finger, times=times)[0].instants[-1].contact
    return march(finger.body.touchable, law_of(scene), scene.loading_per_mm, times=times).instants[-1].contact


def indentation(scene: Scene, contact: Contact) -> float:
    """Return the depth [mm] of a state of `scene`: the one asked for, or the one found under a given force."""
    return scene.loading.depth if scene.normal_force is None else depth_of(contact)


def laid(
    finger: FingerModel, law: FrictionLaw, contact: Contact, depth: float, displacement: Array
) -> tuple[Contact, Array]:
    """Return a settled slide and its displacement once more, with less round-off: balanced, the skin on the surface.

    The elimination leaves some 1e-13 of the forces unbalanced, which falls by processor. What balancing them has moved
    the skin by is taken as displaced before any contact; the states stay if they can.
    """
    body = finger.body
    displacement = finger.balanced(contact, displacement)
    normal, tangential = np.split(finger.skin_displacement(contact)[:, 0], 2)
    skin, touch = displacement[finger.geometry.mesh.skin], body.touchable
    free = {"normal_free": skin[:, 1] - normal, "tangential_free": skin[:, 0] - tangential}
    direction = -int(np.sign(contact.sense[contact.touching][0]))
    try:
        again = Course(replace(touch, **free), law).sliding(depth, direction, contact.state)
    except ContactLost:
        return contact, displacement
    change = np.concatenate([again.normal - contact.normal, again.tangential - contact.tangential])[:, None]
    return again, displacement + body.displacement(body.skin_displacement(change))[:, :, 0]


def rubbed_more(scene: Scene, finger: FingerModel, contact: Contact) -> Contact | None:
    """Return the state beside a settled slide, its coefficient of friction a little larger; None where there is none.

    Nor is there one where forces are given, since those do not grow without bound.
    """
    law, direction = law_of(scene), scene.loading.direction
    if law.frictionless or direction == 0 or scene.normal_force is not None:
        return None
    more = replace(law, mu=(1.0 + NUDGE) * law.mu)
    try:
        return Course(finger.body.touchable, more).sliding(scene.loading.depth, direction, contact.state)
    except ContactLost:
        return None


def bounded_more(scene: Scene, finger: FingerModel, contact: Contact) -> Contact | None:
    """Return the state beside a settled slide, its bound a little larger; None where there is none, or it matters not.

    It does where friction is so steep that skin slips at the bound up to an edge of contact.
    """
    law, direction, force = law_of(scene), scene.loading.direction, scene.normal_force
    on = np.flatnonzero(contact.touching)
    last = contact.state[np.concatenate([on[:2], on[-2:]])]
    if law.mu <= STEEP or direction == 0 or not (last == SHEAR_LIMITED).any():
        return None
    touch = finger.body.touchable
    touch, depth = (touch, scene.loading.depth) if force is None else (forced(touch, force), 0.0)
    try:
        return Course(touch, replace(law, tau_max=(1.0 + NUDGE) * law.tau_max)).sliding(depth, direction, contact.state)
    except ContactLost:
        return None


def nearest(scene: Scene, finger: FingerModel) -> Contact:
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
        touch, loading = finger.body.touchable, scene.loading
        reached, _ = followed(touch, law_of(scene), loading.depth, loading.direction)
        if reached is None:
            raise
        return reached


def numbers_on(finger: FingerModel, contacts: Sequence[Contact]) -> Array:
    """Return what errors are estimated of (c, 3): SED of the ending, normal and tangential force along +x."""
    forces = [(c.normal.sum(), c.tangential.sum()) for c in contacts]
    return np.column_stack([finger.sed_endings(contacts), forces])


def all_numbers(scene: Scene, finger: FingerModel, contact: Contact) -> Array:
    """Return them, indentation, shift (0 where there is none) and contact width (6,) of one state."""
    shift = shift_of(scene, contact)
    width = finger.contact_width(contact, np.concatenate([contact.gap, contact.shift]))
    found = indentation(scene, contact), 0.0 if shift is None else shift, width
    return np.concatenate([numbers_on(finger, [contact])[0], found])


def shift_of(scene: Scene, contact: Contact) -> float | None:
    """Return how far the bone was shifted along +x [mm] by a given drag; None where it slides or is only pressed."""
    return float(contact.motion[-1]) if scene.loading.dragged and len(contact.motion) > 1 else None


def felt_of_bound(scene: Scene, finger: FingerModel, half: Contact) -> Array:
    """Return how the numbers (6,) at the end of a course answer to the traction bound: relative change by its own.

    `half` is the end in half the usual steps. Zero where nothing slips at the bound. Raises as `end`.
    """
    bound = scene.friction.tau_max
    if bound is None or not (half.state == SHEAR_LIMITED).any():
        return np.zeros(6)
    more = replace(scene, friction=replace(scene.friction, tau_max=(1.0 + FURTHER) * bound))
    here, beside = (all_numbers(scene, finger, state) for state in (half, end(more, finger, HALF)))
    return (beside - here) / np.where(here == 0.0, 1.0, here) / FURTHER
