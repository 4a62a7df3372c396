"""Derivatives of the numbers of a settled slide by friction and load, from the tangent at convergence.

The last system is solved once more for each parameter, every contact state kept. That is exact as long as no state
changes. At a kink, where a node is about to change its state, the derivatives are those of the side on which the states
stay. Differences across a kink lie between the derivatives of both sides.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from solver import _kernels as kernels
from solver._kernels import SHEAR_LIMITED, STICK
from solver._kernels.arguments import ContactStates, SkinPosition
from solver.arrays import Array
from solver.body.finite import FiniteBody, FiniteProbes
from solver.constitutive.hyperelastic import slopes
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.newton import BY_DEPTH, BY_FRICTION, EquilibriumState, FiniteNewton, Newton, load_state
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


def of_slide(finger: FingerModel | FiniteFinger, scene: Scene, state: EquilibriumState) -> Derivatives:
    """Return the derivatives at a settled slide, driven by depth or by force.

    Raises ValueError where points stick, since such a state depends on the way to it, and where it has no tangent.
    """
    skin = of_skin(finger.newton, state)
    along, up = finger.newton.follows(skin)
    sed = _of_sed(finger, state, skin) if isinstance(finger, FingerModel) else _of_finite_sed(finger, state, skin)
    rows = np.array([sed, up, drag_along(scene) * along, [0.0, 0.0, 1.0]]) + 0.0  # never -0
    if scene.normal_force is None:
        return Derivatives(*(By(mu, tau, depth, None) for mu, tau, depth in rows.tolist()))
    rows[:, 2] /= up[2]  # the depth makes up for what friction changes of the force
    rows[:, :2] -= rows[:, 2:] * up[:2]
    found = Derivatives(*(By(mu, tau, None, force) for mu, tau, force in rows.tolist()))
    return replace(found, normal=By(0.0, 0.0, None, 1.0))


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


def _of_sed(finger: FingerModel, state: EquilibriumState, skin: Array) -> Array:
    """Return the derivatives (3,) of the ending's SED at small strain, for those of the skin (2 k, 3).

    The SED is a square of the displacements u, so that (W(u + s) - W(u - s)) / 2 is its derivative along any step s.
    """
    moved = np.concatenate([state.u.reshape(-1, 1), skin], axis=1).reshape(*state.u.shape, -1)
    moved = finger.body.displacement(moved, only=finger.ending.nodes(finger.geometry.mesh))
    u, steps = moved[:, :, :1], moved[:, :, 1:]
    longest = np.abs(steps).max(axis=(0, 1))
    size = np.abs(u).max() / np.where(longest > 0.0, longest, np.inf)  # steps as large as u: less drowns in round-off
    both = np.concatenate([u + size * steps, u - size * steps], axis=2)
    ahead, behind = finger.ending.average(finger.geometry.mesh, finger.body.elastic, both)[0].reshape(2, -1)
    return (ahead - behind) / 2.0 / np.where(size > 0.0, size, 1.0)


def _of_finite_sed(finger: FiniteFinger, state: EquilibriumState, skin: Array) -> Array:
    """Return the derivatives (3,) of the ending's SED at finite strain, for those of the skin (2 k, 3)."""
    newton = finger.newton
    moved = [newton.finite.inside.back_substitute(one, still=True) for one in skin.T.copy()]
    return slope(finger.ending, newton.body, state.u, _spread(newton, np.stack(moved, axis=1)))[0]


def _spread(newton: FiniteNewton, unknowns: Array) -> Array:
    """Return the displacements (nodes, 2, c) for the unknowns (n, c), the centres of elements following."""
    body = newton.body
    out = np.zeros((*body.mesh.nodes.shape, unknowns.shape[1]))
    outer = np.where((body.unknown >= 0)[..., None], unknowns[body.unknown], 0.0)  # (e, 8, 2, c)
    out[body.nodes[:, :8]] = outer
    out[body.nodes[:, 8]] = -newton.finite.system.recovery_matrix[:, :, :16] @ outer.reshape(len(outer), 16, -1)
    return out


def slope(probes: FiniteProbes, body: FiniteBody, displacement: Array, steps: Array) -> Array:
    """Return how the SED averaged over each patch (r, c) [MPa] changes along `steps` (nodes, 2, c) of displacements."""
    e = probes.element
    local, moves = displacement[body.nodes[e]], steps[body.nodes[e]]
    F, dF = _gradients(local, moves, np.stack([body.grad_x, body.grad_y], axis=-1)[e])  # at quadrature points
    fit, dfit = (
        np.einsum("pm,pqm,pq,pq...->p...", probes.modes, body.modes[e], body.weight[e], one)
        for one in _logarithm(F, dF)
    )
    f, df = _gradients(local, moves, np.stack([probes.grad_x, probes.grad_y], axis=-1)[:, None])
    log, dlog = _logarithm(f, df)
    excess = np.sum(f * f, axis=(-2, -1)) - 2.0 - 2.0 * log
    stiff = body.shear[e] * slopes(body.stiffening[e], excess[:, 0])[0]
    energy = stiff[:, None] * (np.einsum("pqaA,pqcaA->pqc", f, df) - dlog)[:, 0]
    energy += (body.lame[e] * fit)[:, None] * dfit
    total = np.zeros((len(probes.areas), energy.shape[1]))
    np.add.at(total, probes.patch, energy * probes.weights[:, None])
    return total / probes.areas[:, None]


def _gradients(local: Array, steps: Array, gradient: Array) -> tuple[Array, Array]:
    """Return F (p, q, 2, 2) and its changes (p, q, c, 2, 2) from those of nodes (p, 9, 2, c)."""
    return np.eye(2) + np.einsum("pia,pqiA->pqaA", local, gradient), np.einsum("piac,pqiA->pqcaA", steps, gradient)


def _logarithm(F: Array, dF: Array) -> tuple[Array, Array]:
    """Return ln J (p, q) and its changes F^-T : dF (p, q, c)."""
    return np.log(np.linalg.det(F)), np.einsum("pqAa,pqcaA->pqc", np.linalg.inv(F), dF)


def drag_along(scene: Scene) -> int:
    """Return the sign along +x of the drag that opposes the slide of a scene."""
    return -(scene.loading.direction or 1)
