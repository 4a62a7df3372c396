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

from solver import _kernels as kernels
from solver._kernels import SHEAR_LIMITED, STICK
from solver._kernels.arguments import ContactStates, SkinPosition
from solver.arrays import Array
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.newton import BY_DEPTH, BY_FRICTION, EquilibriumState, Newton, load_state
from solver.scene import Scene

MU, TAU_MAX, DEPTH = range(3)


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


def of_contact(finger: FingerModel, scene: Scene, state: EquilibriumState) -> Derivatives:
    """Return the derivatives at a settled slide at small strain, whatever drives it.

    Raises ValueError where points stick: such a state depends on the way to it, and so do its derivatives.
    """
    skin = of_skin(finger.newton, state)
    along, up = finger.newton.follows(skin)
    moved = np.concatenate([state.u.reshape(-1, 1), skin], axis=1).reshape(*state.u.shape, -1)
    u, *steps = np.moveaxis(finger.body.displacement(moved, only=finger.ending.nodes(finger.geometry.mesh)), 2, 0)
    sed = [_bent(finger, u, step) for step in steps]
    return driven(scene, sed, up, drag_along(scene) * along)


def of_skin(newton: Newton, state: EquilibriumState) -> Array:
    """Return how the skin (2 k, 3) of a slide follows mu, tau_max and depth, its contact linearised as Newton does.

    Raises ValueError where a state is no slide, or has no tangent: it lies at a limit.
    """
    pull, size = state.pull, len(state.state)
    if pull.sense == 0 or (state.state == STICK).any():
        raise ValueError("a state with sticking points depends on the way to it, which its tangent does not know")
    if not newton.linearise(state, pull, newton.skin_x):
        raise ValueError("the state has no tangent")
    x = np.ascontiguousarray(state.place(newton.condensed)[:, 0])
    position = SkinPosition(x, np.zeros(size), x)  # on the surface, and nowhere else than where it sticks
    system = newton.system
    kernels.bounded_length(x, newton.skin, state.state, pull.mu, system.length)
    count = kernels.assemble_contact_system(
        newton.arrays(), newton.skin, ContactStates(state.state, state.sense, state.reaction), load_state(pull),
        position, system,
    )  # fmt: skip
    free, by = system.free[:count], np.zeros((count, 3))
    by[:, MU], by[:, DEPTH] = system.right[:count, BY_FRICTION], system.right[:count, BY_DEPTH]
    at, along = np.divmod(free, 2)
    capped = (state.state[at] == SHEAR_LIMITED) & (along == 0)
    by[:, TAU_MAX] = np.where(capped, state.sense[at] * system.length[at], 0.0)
    out = np.zeros((2 * size, 3))
    out[:, DEPTH] = newton.steps[:, BY_DEPTH]
    out[free] = np.linalg.solve(system.matrix[: count * count].reshape(count, count), by)
    return out


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
