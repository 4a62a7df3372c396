"""Checks that a result carries with it: what must balance, and what must not be exceeded. Perfect is 0."""

from collections.abc import Mapping, Sequence

import numpy as np

from solver.arrays import Array
from solver.contact.law import FrictionLaw
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.load_path import Instant
from solver.equilibrium.newton import EquilibriumState
from solver.failures import NotConverged
from solver.scene import Scene

MISSED = 1e-5  # of forces that are given, by which a state may miss them
UNSOUND = 1e-4  # unbalanced part of the forces from which round-off has spoilt the answer [-]
DOUBTED = 1e-8  # and from which it is told
PIERCED = 1e-7  # part of the indentation by which skin may lie too low without it being told [-]
MIXED = "nearly incompressible tissues, or ones whose stiffnesses differ by many orders of magnitude,"


def audits(
    model: FingerModel, law: FrictionLaw, contact: EquilibriumState, depth: float, displacement: Array
) -> dict[str, float]:
    """Return the checks of one state of contact; `displacement` (nodes, 2) relative to the bone [mm].

    `equilibrium_x`, `equilibrium_y`: bone reaction plus contact force, by the contact force.
    `inner_forces`: largest unbalanced force on a node that is not held, the surface's own on skin that touches
    included, by the contact force.
    `work_balance`: work of the contact forces against the elements' stored energy (Clapeyron), relative.
    `penetration`: of any skin node, by the indentation. `tension`: largest pull on a touching point, by the largest
    push. `cone_violation`: |t| beyond min(mu p, tau_max), by the largest push. `smallest_det_F`: of the displacements.
    """
    mesh, body = model.geometry.mesh, model.body
    inner = body.reactions(displacement[:, :, None])[:, :, 0]
    total = max(float(contact.normal.sum()), np.finfo(float).tiny)
    bone = inner[mesh.held].sum(axis=0)
    forces = np.stack([contact.tangential, contact.normal], axis=1)
    left = inner.copy()
    left[mesh.skin] -= forces
    left[mesh.held] = 0.0
    work = 0.5 * float(np.sum(forces * displacement[mesh.skin]))
    stored = 0.5 * float(np.sum(inner * displacement))
    whole = model.geometry.whole
    height = mesh.nodes[whole, 1] + displacement[whole, 1] - depth
    push = max(float(contact.normal.max(initial=0.0)), np.finfo(float).tiny)
    beyond = np.abs(contact.tangential) - law.limit(contact.normal, body.condensed.fixed_length)
    return {
        "equilibrium_x": abs(float(bone[0] + contact.tangential.sum())) / total,
        "equilibrium_y": abs(float(bone[1] + contact.normal.sum())) / total,
        "inner_forces": float(np.abs(left).max()) / total,
        "work_balance": abs(work - stored) / max(stored, np.finfo(float).tiny),
        "penetration": max(-float(height.min()), 0.0) / depth,
        "tension": max(-float(contact.normal.min(initial=0.0)), 0.0) / push,
        "cone_violation": max(float(beyond.max(initial=0.0)), 0.0) / push,
        "smallest_det_F": float(np.prod(model.stretches(displacement), axis=0).min()),
    }


def forces_missed(scene: Scene, normal: float, tangential: float) -> dict[str, float]:
    """Return by how much a state with these forces [N/mm] misses those that `scene` gives; nothing where it gives none.

    `normal_force_missed` by the force given, `drag_missed` by what friction could carry under it. Raises NotConverged
    where that is more than a state found leaves over.
    """
    given, drag = scene.normal_force, scene.tangential_force
    if given is None:
        return {}
    missed = {"normal_force_missed": abs(normal / given - 1.0)}
    if drag is not None and scene.friction.mu > 0.0:
        missed["drag_missed"] = abs(tangential + scene.loading.direction * drag) / (float(scene.friction.mu) * given)
    if max(missed.values()) > MISSED:
        raise NotConverged("No state was found that has the forces given: give others, or a depth.")
    return missed


def unbalanced(checks: Mapping[str, float]) -> float:
    """Return what `audits` leave unbalanced at most, of forces and of work."""
    return max(checks[name] for name in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance"))


def refuse_unsound(checks: Mapping[str, float], depth: float) -> None:
    """Raise NotConverged where round-off has spoilt the answer at `depth` [mm]."""
    if (left := unbalanced(checks)) > UNSOUND:
        raise NotConverged(
            f"Forces balance to {left:.1g} only at {depth:g} mm indentation: round-off has swallowed the answer; "
            f"contacts far smaller than the mesh, {MIXED} do that."
        )


def rounding(checks: Mapping[str, float]) -> tuple[str, ...]:
    """Return a sentence for each of `audits` that shows more round-off than answers usually have."""
    told: list[str] = []
    if (left := unbalanced(checks)) > DOUBTED:
        told.append(f"Forces balance to {left:.1g} only: {MIXED} magnify round-off.")
    if (low := checks["penetration"]) > PIERCED:
        told.append(f"The skin lies {low:.1g} of the indentation too low: stiff layers magnify round-off.")
    return tuple(told)


def inside_out(checks: Mapping[str, float]) -> str:
    """Return a sentence where `audits` say that tissue is turned inside out, else "".

    Small strain goes on there as if nothing were, with a stiffness and an energy that no tissue has.
    """
    if checks["smallest_det_F"] > 0.0:
        return ""
    return (
        f"Tissue is turned inside out somewhere (a volume of {checks['smallest_det_F']:.2g} of what it was): no finger "
        "can be pressed or dragged so far, and the numbers are those of a formula beyond its range."
    )


def course_audits(model: FingerModel, way: Sequence[Instant]) -> dict[str, float]:
    """Return the checks of a whole march, relative to the bone's work.

    `course_work_balance`: bone work less stored energy less dissipation. `course_step_work`: the part of it that points
    did on their way to the surface within a step, which vanishes with the step. `course_least_dissipation`: the least
    work that friction took in a step (never negative).
    """
    normal = np.array([i.state.normal for i in way])
    tangential = np.array([i.state.tangential for i in way])
    depth = np.array([i.depth for i in way])
    travel = np.array([i.travel for i in way])
    u = np.array([i.state.u for i in way])
    gap = u[:, :, 1] - depth[:, None]  # but for what does not change
    shift = u[:, :, 0] + travel[:, None]
    stored = 0.5 * float(np.sum(way[-1].state.reaction * model.relaxed(way[-1].state).u))
    mean_n, mean_t = (normal[1:] + normal[:-1]) / 2.0, (tangential[1:] + tangential[:-1]) / 2.0
    bone = float(np.sum(mean_n.sum(axis=1) * np.diff(depth)) - np.sum(mean_t.sum(axis=1) * np.diff(travel)))
    lost = -float(np.sum(mean_t * np.diff(shift, axis=0)))
    closing = -float(np.sum(mean_n * np.diff(gap, axis=0)))
    friction = -np.sum(tangential[1:] * np.diff(shift, axis=0), axis=1)
    scale = max(abs(bone), np.finfo(float).tiny)
    return {
        "course_work_balance": abs(bone - stored - lost - closing) / scale,
        "course_step_work": abs(closing) / scale,
        "course_least_dissipation": float(friction.min()) / scale,
    }
