"""Checks that a result at finite strain carries with it, of its state and of its course. Perfect is 0."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from solver import _kernels as kernels
from solver.body.finite_measures import deformation, element_forces, energy, energy_slope
from solver.contact.law import FrictionLaw
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.finite_relaxation import RelaxingNewton
from solver.equilibrium.newton import EquilibriumState, FiniteNewton
from solver.scene import Scene


def audits(scene: Scene, finger: FiniteFinger, shape: EquilibriumState, newton: FiniteNewton) -> dict[str, float]:
    """Return the checks of one state. Perfect is 0, save for `smallest_det_F` (of displacement at quadrature points).

    `newton` is the finger's own, or that of its tissues as they relax.

    `equilibrium_x`, `equilibrium_y`: bone reaction plus contact force, by the contact force. `inner_forces`: largest
    unbalanced force on a node that is not held, the surface's own on skin that touches included. `work_balance`: were
    the displacement to grow by a part of itself, by how much the stored energy would grow (from the energy alone, but
    for terms that relax) against the work of the contact forces, relative. At small strain that is Clapeyron's theorem.
    It balances the state, not a way there: a state found directly has none. `penetration`, `tension`,
    `cone_violation`: as at small strain, the bound on the deformed length.
    """
    body, mesh = finger.newton.body, finger.geometry.mesh
    local = element_forces(body, shape.u)
    grown = energy_slope(body, shape.u, shape.u)
    if isinstance(newton, RelaxingNewton):
        excess = newton.excess(shape)
        local = local + excess
        grown += float(np.sum(excess * shape.u[body.nodes].reshape(excess.shape)))
    inner = np.zeros(mesh.nodes.shape)
    np.add.at(inner, body.nodes, local.reshape(-1, 9, 2))
    total = max(float(shape.force[1]), np.finfo(float).tiny)
    bone = inner[mesh.held].sum(axis=0)
    left = inner.copy()
    left[mesh.skin] -= shape.reaction
    left[mesh.held] = 0.0
    work = float(np.sum(shape.reaction * shape.u[mesh.skin]))
    height = mesh.nodes[finger.geometry.whole, 1] + shape.u[finger.geometry.whole, 1] - shape.pull.depth
    normal, tangential = shape.reaction[:, 1], shape.reaction[:, 0]
    push = max(float(normal.max(initial=0.0)), np.finfo(float).tiny)
    # Open skin may hang over, its length along the surface negative: no limit of it is meant.
    length = np.empty(len(shape.state))
    kernels.rubbed(np.ascontiguousarray(shape.place(body)[:, 0]), body.middle, shape.state, shape.pull.mu, length)
    length = np.maximum(length, 0.0)
    limit = FrictionLaw(float(scene.friction.mu), scene.friction.cap).limit(normal, length)
    return {
        "equilibrium_x": abs(float(bone[0] + shape.force[0])) / total,
        "equilibrium_y": abs(float(bone[1] + shape.force[1])) / total,
        "inner_forces": float(np.abs(left).max()) / total,
        "work_balance": abs(work - grown) / max(abs(grown), np.finfo(float).tiny),
        "penetration": max(-float(height.min()), 0.0) / scene.loading.depth,
        "tension": max(-float(normal.min(initial=0.0)), 0.0) / push,
        "cone_violation": max(float((np.abs(tangential) - limit).max(initial=0.0)), 0.0) / push,
        "smallest_det_F": float(np.linalg.det(deformation(body, shape.u)).min()),
    }


def course_audits(newton: FiniteNewton, way: Sequence[EquilibriumState]) -> dict[str, float]:
    """Return the checks of a whole march from first touch on, relative to the bone's work.

    The bone's work and friction's take the mean of the forces at both ends of a step.

    `course_step_work`: bone work less stored energy less what friction took; it vanishes as the square of the step,
    or in proportion to it where points come down on the surface within a step. `course_work_balance`: what is left of
    it once the curve of the elements' forces within a step is known, by Simpson's rule (from the energy at the mean
    displacement), and the work of points on their way to the surface. `course_least_dissipation`: the least work that
    friction took in a step (never negative).

    Where tissues relax they take work too, and no force within a step is known without its past: instead of the first
    two there is `course_viscous_work`, bone work less friction less what is stored at the end, the terms' part
    included. It is positive but for the error of the steps.
    """
    body = newton.body
    shapes = [EquilibriumState.undeformed(body), *way]
    reaction = np.array([shape.reaction for shape in shapes])  # (m, k, 2)
    skin = np.array([shape.u[body.skin] for shape in shapes])
    pull = np.array([[shape.pull.travel, shape.pull.depth] for shape in shapes])
    mean, moved = (reaction[1:] + reaction[:-1]) / 2.0, np.diff(skin, axis=0)
    slid = moved - np.diff(pull, axis=0)[:, None]  # relative to the surface; along y towards it, negative
    bone = float(np.sum(mean.sum(axis=1) * np.diff(pull, axis=0)))
    lost = -float(np.sum(mean[..., 0] * slid[..., 0]))
    friction = -np.sum(reaction[1:, :, 0] * slid[..., 0], axis=1)
    scale = max(abs(bone), np.finfo(float).tiny)
    stored = energy(body, shapes[-1].u)
    least = {"course_least_dissipation": float(friction.min()) / scale}
    if isinstance(newton, RelaxingNewton):
        return {"course_viscous_work": (bone - lost - stored - newton.excess_energy()) / scale} | least
    halfway = sum(energy_slope(body, (one.u + other.u) / 2.0, other.u - one.u) for one, other in pairwise(shapes))
    elastic = (float(np.sum(mean * moved)) + 2.0 * halfway) / 3.0
    return {
        "course_work_balance": abs(elastic - stored) / scale,
        "course_step_work": abs(bone - stored - lost) / scale,
    } | least
