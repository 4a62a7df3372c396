"""Derivatives of the numbers of a settled slide by friction and load, from the tangent at convergence.

The last system is solved once more for each parameter, every contact state kept. That is exact as long as no state
changes. At a kink, where a node is about to change its state, the derivatives are those of the side on which the states
stay. Differences across a kink lie between the derivatives of both sides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, cast

import numpy as np

from solver import _kernels as kernels
from solver._kernels import SHEAR_LIMITED, STICK
from solver._kernels.arguments import ContactStates, SkinPosition
from solver.arrays import Array
from solver.body.receptor import Patches
from solver.equilibrium.finger import Finger, LinearFinger
from solver.equilibrium.newton import BY_DEPTH, BY_FRICTION, EquilibriumState, Newton, load_arguments
from solver.quantities import NAMES, SED
from solver.scene.scene import Scene
from solver.scene.tables import TISSUES
from solver.tolerances import IMAGINARY

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
    responses: Mapping[str, By]  # of every quantity at the ending, by its name


def of_slide(finger: Finger[Patches], scene: Scene, state: EquilibriumState) -> Derivatives:
    """Return the derivatives at a settled slide, driven by depth or by force.

    Raises ValueError where points stick, since such a state depends on the way to it, and where it has no tangent.
    """
    skin = of_skin(finger.newton, state)
    along, up = finger.newton.follows(skin)
    ending = slope(finger.ending, finger.displacement(state), finger.body.following(skin))[:, 0]
    rows = np.array([*ending, up, drag_along(scene) * along, [0.0, 0.0, 1.0]]) + 0.0  # never -0
    if scene.normal_force is None:
        return _derivatives([By(mu, tau, depth, None) for mu, tau, depth in rows.tolist()])
    rows[:, 2] /= up[2]  # the depth makes up for what friction changes of the force
    rows[:, :2] -= rows[:, 2:] * up[:2]
    found = _derivatives([By(mu, tau, None, force) for mu, tau, force in rows.tolist()])
    return replace(found, normal=By(0.0, 0.0, None, 1.0))


def _derivatives(rows: Sequence[By]) -> Derivatives:
    """Return the derivatives of every quantity, both forces and the indentation by their names."""
    of = dict(zip(NAMES, rows, strict=False))
    return Derivatives(of[SED.name], *rows[len(NAMES) :], responses=of)


def of_skin(newton: Newton, state: EquilibriumState) -> Array:
    """Return how the skin (2 k, 3) of a slide follows mu, tau_max and depth, its contact linearised as Newton does.

    Raises ValueError where a state is no slide, or has no tangent: it lies at a limit.
    """
    load, size = state.load, len(state.state)
    if load.sense == 0 or (state.state == STICK).any():
        raise ValueError("a state with sticking points depends on the way to it, which its tangent does not know")
    if not newton.linearise(state, load, newton.skin_x):
        raise ValueError("the state has no tangent")
    x = np.ascontiguousarray(state.place(newton.condensed)[:, 0])
    position = SkinPosition(x, np.zeros(size), x)  # on the surface, and nowhere else than where it sticks
    system = newton.system
    kernels.bounded_length(x, newton.skin, state.state, load.mu, system.length)
    count = kernels.assemble_contact_system(
        newton.arrays(), newton.skin, ContactStates(state.state, state.sense, state.reaction), load_arguments(load),
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


def by_stiffness(finger: LinearFinger, state: EquilibriumState) -> Array:
    """Return how the normal force of a frictionless press follows each tissue's stiffness (r,): d log N / d log E.

    Regions stand in the order of the mesh; a rigid bone has 0. With u the displacements, w their derivative by the
    depth and K the stiffness of one tissue, dN / d log E is w K u: without friction the contact's forces do no work on
    w but by the depth. The sum is 1, since N is linear in all stiffnesses together. Raises ValueError with friction.
    """
    if state.load.mu != 0.0:
        raise ValueError("with friction the normal force is no derivative of an energy")
    mesh = finger.geometry.mesh
    by_depth = finger.body.following(of_skin(finger.newton, state)[:, DEPTH, None])[:, :, 0]
    moved, slope = (
        field[mesh.elements].reshape(len(mesh.elements), 18) for field in (finger.displacement(state), by_depth)
    )
    work = np.einsum("ei,eij,ej->e", slope, finger.body.elastic.stiffness, moved)
    return np.bincount(mesh.region, work, minlength=len(TISSUES)) / float(state.normal.sum())


def slope(endings: Patches, displacement: Array, steps: Array) -> Array:
    """Return how the responses of endings change (q, r, c) at a `displacement` (nodes, 2) along `steps` (nodes, 2, c).

    By steps in imaginary direction (Squire and Trapp 1998, SIAM Rev. 40, 110), exact to round-off.
    """
    beside = cast("Array", displacement[:, :, None] + 1j * IMAGINARY * steps)
    return endings.responses(beside).imag / IMAGINARY


def drag_along(scene: Scene) -> int:
    """Return the sign along +x of the drag that opposes the slide of a scene."""
    return -(scene.loading.direction or 1)
