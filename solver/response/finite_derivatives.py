"""The derivatives of a settled slide at finite strain: the last Newton tangent, once more for each parameter."""

import numpy as np

from solver import _kernels as kernels
from solver._kernels import SHEAR_LIMITED
from solver._kernels.arguments import ContactStates, ContactSystem, SkinPosition
from solver.body.finite import FiniteBody, FiniteProbes
from solver.constitutive.hyperelastic import slopes
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.newton import BY_DEPTH, BY_FRICTION, Newton, Shape, load_state
from solver.mesh import Array
from solver.response.derivatives import Derivatives, driven
from solver.scene import Scene

MU, TAU_MAX, DEPTH = range(3)


def of_shape(finger: FiniteFinger, scene: Scene, shape: Shape) -> Derivatives:
    """Return the derivatives at a settled slide, whatever drives it; `solver.response.derivatives` says what they are.

    Raises ValueError where a state is no slide, or has no tangent: it lies at a limit.
    """
    newton, pull = finger.newton, shape.pull
    if pull.sense == 0:
        raise ValueError("a state that is no settled slide depends on the way to it, which its tangent does not know")
    if not newton.linearise(shape, pull, newton.skin_x):
        raise ValueError("the state has no tangent")
    skin = _followed(newton, shape)
    along, up = newton.follows(skin.T)
    inner = _spread(newton, np.stack([newton.inside.back_substitute(one, still=True) for one in skin], axis=1))
    sed = slope(finger.ending, newton.body, shape.u, inner)[0]
    return driven(scene, sed, up, pull.sense * along)


def _followed(newton: Newton, shape: Shape) -> Array:
    """Return how the skin (3, 2 k) follows mu, tau_max and depth, its contact linearised as Newton does."""
    body, pull, size = newton.body, shape.pull, len(shape.state)
    x = np.ascontiguousarray(shape.place(body)[:, 0])
    position = SkinPosition(x, np.zeros(size), x)  # on the surface, and nowhere else than where it sticks
    length, free, matrix = np.empty(size), np.zeros(2 * size, np.int32), np.zeros(4 * size * size)
    right, steps = np.zeros((2 * size, 4)), np.zeros((2 * size, 4))
    kernels.rubbed(x, body.middle, shape.state, pull.mu, length)
    count = kernels.assemble_contact_system(
        newton.inside.stiffness, newton.inside.felt, body.contact_skin,
        ContactStates(shape.state, shape.sense, shape.reaction), load_state(pull), position,
        ContactSystem(length, free, matrix, right, steps),
    )  # fmt: skip
    free, by = free[:count], np.zeros((count, 3))
    by[:, MU], by[:, DEPTH] = right[:count, BY_FRICTION], right[:count, BY_DEPTH]
    at, along = np.divmod(free, 2)
    by[:, TAU_MAX] = np.where((shape.state[at] == SHEAR_LIMITED) & (along == 0), shape.sense[at] * length[at], 0.0)
    out = np.zeros((3, 2 * size))
    out[DEPTH] = steps[:, BY_DEPTH]
    out[:, free] = np.linalg.solve(matrix[: count * count].reshape(count, count), by).T
    return out


def _spread(newton: Newton, unknowns: Array) -> Array:
    """Return the displacements (nodes, 2, c) for the unknowns (n, c), the centres of elements following."""
    body = newton.body
    out = np.zeros((*body.mesh.nodes.shape, unknowns.shape[1]))
    outer = np.where((body.unknown >= 0)[..., None], unknowns[body.unknown], 0.0)  # (e, 8, 2, c)
    out[body.nodes[:, :8]] = outer
    out[body.nodes[:, 8]] = -newton.system.recovery_matrix[:, :, :16] @ outer.reshape(len(outer), 16, -1)
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
