"""Settled states of a scene at small strain on one mesh, the states beside them, and what is estimated of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.contact import Contact, ContactLost, Course
from solver.failures import NoSteadyState, beyond_friction
from solver.finger import FingerModel
from solver.friction import FrictionLaw
from solver.matching import DEEPEST
from solver.mesh import Array
from solver.pressing import depth_of, sliding_under
from solver.scene import Scene
from solver.stepping import march
from solver.wedging import followed

ALL_SLIPS = 1e-6  # part of the friction limit within which a given drag is that of sliding
NUDGE = 1e-4  # of the coefficient of friction, to see what it does


def law_of(scene: Scene) -> FrictionLaw:
    """Return the friction of a scene."""
    return FrictionLaw(float(scene.friction.mu), scene.friction.cap)


def settled(scene: Scene, finger: FingerModel) -> Contact:
    """Return the settled state, without its history where it has none left.

    Raises ContactLost, NotConverged, and NoSteadyState where a given drag is more than friction carries.
    """
    law, touch, loading = law_of(scene), finger.body.touchable, scene.loading_per_mm
    if loading.direction == 0 and not law.frictionless:
        return march(touch, law, loading).instants[-1].contact
    if loading.normal_force is None:
        return Course(touch, law).sliding(loading.depth, loading.direction or 1)
    deepest = DEEPEST * scene.finger.pulp_thickness()
    try:
        found = sliding_under(touch, law, loading.normal_force, loading.direction or 1, deepest)
    except ContactLost:
        if loading.tangential_force is None:
            raise
        return march(touch, law, loading).instants[-1].contact  # the drag may be met where sliding would wedge
    if loading.tangential_force is None:
        return found
    most = float(np.abs(found.tangential.sum()))
    if loading.tangential_force > most * (1.0 + 1e-9):
        raise beyond_friction(loading.tangential_force, most, loading.normal_force)
    if loading.tangential_force >= most * (1.0 - ALL_SLIPS):
        return found
    return march(touch, law, loading).instants[-1].contact


def indentation(scene: Scene, contact: Contact) -> float:
    """Return the depth [mm] of a state of `scene`: the one asked for, or the one found under a given force."""
    return scene.loading.depth if scene.normal_force is None else depth_of(contact)


def laid(
    finger: FingerModel, law: FrictionLaw, contact: Contact, depth: float, displacement: Array
) -> tuple[Contact, Array]:
    """Return a settled slide once more, the skin on the surface where its refined `displacement` puts it.

    What refinement has moved the skin by is taken as displaced before any contact; the states stay if they can.
    """
    body = finger.body
    normal, tangential = np.split(finger.skin_displacement(contact)[:, 0], 2)
    skin, touch = displacement[finger.geometry.mesh.skin], body.touchable
    free = {"normal_free": skin[:, 1] - normal, "tangential_free": skin[:, 0] - tangential}
    direction = -int(np.sign(contact.sense[contact.touching][0]))
    try:
        again = Course(replace(touch, **free), law).sliding(depth, direction, contact.state)
    except ContactLost:
        return contact, displacement
    change = np.concatenate([again.normal - contact.normal, again.tangential - contact.tangential])[:, None]
    moved = displacement[:, :, None] + body.displacement(body.skin_displacement(change))
    forces = np.concatenate([again.normal, again.tangential])[:, None]
    return again, body.balanced(moved, forces)[:, :, 0]


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
