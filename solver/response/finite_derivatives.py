"""The derivatives of a settled slide at finite strain: the last Newton tangent, once more for each parameter."""

import numpy as np

from solver.arrays import Array
from solver.body.finite import FiniteBody, FiniteProbes
from solver.constitutive.hyperelastic import slopes
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.newton import EquilibriumState, FiniteNewton
from solver.response.derivatives import Derivatives, driven, of_skin
from solver.scene import Scene


def of_shape(finger: FiniteFinger, scene: Scene, shape: EquilibriumState) -> Derivatives:
    """Return the derivatives at a settled slide, whatever drives it; `solver.response.derivatives` says what they are.

    Raises ValueError where a state is no slide, or has no tangent: it lies at a limit.
    """
    newton = finger.newton
    skin = of_skin(newton, shape)
    along, up = newton.follows(skin)
    moved = [newton.finite.inside.back_substitute(one, still=True) for one in skin.T.copy()]
    inner = _spread(newton, np.stack(moved, axis=1))
    sed = slope(finger.ending, newton.body, shape.u, inner)[0]
    return driven(scene, sed, up, shape.pull.sense * along)


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
