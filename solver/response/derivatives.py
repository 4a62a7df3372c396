"""How the numbers of a settled slide answer to its friction and to what presses it: derivatives from its own tangent.

The system that was solved last is solved once more for each parameter, every point staying open, slipping or slipping
at the bound as it is. That is exact as long as none of them changes its state. Where one is about to (a kink: a point
that touches with no force, or slips with just the bound), the numbers go on straight to either side, but not along the
same line: what is told then is the truth of that side on which the states stay as they are, and no more of the other
than that the numbers do not jump. Differences across a kink lie between both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from solver.contact.active_set import SHEAR_LIMITED, SLIP, STICK, Contact, System, Touchable
from solver.contact.law import FrictionLaw
from solver.continuation.small_states import law_of
from solver.equilibrium.finger import FingerModel
from solver.mesh import Array
from solver.scene import Scene


class By(NamedTuple):
    """The derivatives of one number, by the unit of what is named."""

    mu: float  # coefficient of friction [-]
    tau_max: float  # traction bound [MPa]; 0 where nothing slips at the bound
    indentation: float | None  # [mm]; None where a force presses the finger
    normal_force: float | None  # [N/mm]; None where a depth is given


@dataclass(frozen=True, slots=True)
class Derivatives:
    """Those of the numbers of one settled slide."""

    sed: By  # averaged over the ending [MPa]
    normal: By  # force of the surface on the finger along +y [N/mm]
    tangential: By  # drag opposing the slide [N/mm]
    indentation: By  # [mm]


def of_contact(finger: FingerModel, scene: Scene, contact: Contact) -> Derivatives:
    """Return the derivatives at a settled slide at small strain, whatever drives it.

    Raises ValueError where points stick: such a state depends on the way to it, and so do its derivatives.
    """
    normal, tangential = of_forces(finger.body.touchable, law_of(scene), contact)
    here = np.concatenate([contact.normal, contact.tangential])[:, None]
    skin = finger.body.skin_displacement(np.concatenate([here, np.concatenate([normal, tangential])], axis=1))
    u, *steps = np.moveaxis(finger.body.displacement(skin, only=finger.ending.nodes(finger.geometry.mesh)), 2, 0)
    sed = [_bent(finger, u, step) for step in steps]
    return driven(scene, sed, normal.sum(axis=0), drag_along(scene) * tangential.sum(axis=0))


def of_forces(body: Touchable, law: FrictionLaw, contact: Contact) -> tuple[Array, Array]:
    """Return how normal and tangential forces (k, 3) at the points of a slide change with mu, tau_max and depth.

    Raises ValueError where points stick.
    """
    if (contact.state == STICK).any():
        raise ValueError("a state with sticking points depends on the way to it, which its tangent does not know")
    slips, capped = contact.state == SLIP, contact.state == SHEAR_LIMITED
    normal, tangential = np.zeros((2, len(contact.state), 3))
    tangential[slips, 0] = (contact.sense * contact.normal)[slips]  # what friction changes by itself
    tangential[capped, 1] = (contact.sense * body.length)[capped]
    lifted = body.normal_by_tangential @ tangential - [0.0, 0.0, 1.0]
    system = System(replace(body, motions=np.zeros((2 * len(normal), 0))), law, contact.state, contact.sense)
    normal[system.on] = system.solve(-lifted[system.on])
    tangential[system.on] += system.drag[:, None] * normal[system.on]
    return normal, tangential


def _bent(finger: FingerModel, u: Array, step: Array) -> float:
    """Return how the ending's SED changes along a `step` of the displacements `u` (nodes, 2).

    It is a square of them, so that (W(u + s) - W(u - s)) / 2 is its derivative along s, of whatever size.
    """
    longest = float(np.abs(step).max())
    if longest == 0.0:
        return 0.0
    size = float(np.abs(u).max()) / longest  # as large as they are: less would drown in round-off
    both = np.stack([u + size * step, u - size * step], axis=2)
    ahead, behind = finger.ending.average(finger.geometry.mesh, finger.body.elastic, both)[0]
    return float(ahead - behind) / 2.0 / size


def driven(scene: Scene, sed: Sequence[float] | Array, normal: Array, tangential: Array) -> Derivatives:
    """Return derivatives from those at a given depth, by mu, tau_max and depth (3,); under a given force, under that.

    `tangential` is that of the drag. The depth then makes up for what friction changes of the force.
    """
    rows = np.array([sed, normal, tangential, [0.0, 0.0, 1.0]]) + 0.0  # never -0
    if scene.normal_force is None:
        return Derivatives(*(By(mu, tau, depth, None) for mu, tau, depth in rows.tolist()))
    rows[:, 2] /= normal[2]
    rows[:, :2] -= rows[:, 2:] * normal[:2]
    found = Derivatives(*(By(mu, tau, None, force) for mu, tau, force in rows.tolist()))
    return replace(found, normal=By(0.0, 0.0, None, 1.0))


def drag_along(scene: Scene) -> int:
    """Return the sign along +x of the drag that opposes the slide of a scene."""
    return -(scene.loading.direction or 1)
