"""Audits of a state and of a load path: residuals and violated constraints, 0 where perfect."""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from solver._kernels import SHEAR_LIMITED
from solver._kernels.contact_system import bounded_length
from solver.arrays import Array
from solver.body import Patches
from solver.contact import FrictionLaw
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.finger import Finger
from solver.failures import MIXED, NoSteadyState, NotConverged
from solver.scene import Scene

FORCE_RESIDUAL = 1e-5  # largest relative difference from given forces
MAX_RESIDUAL = 1e-4  # relative residual from which a state is refused
WARNING_RESIDUAL = 1e-8  # relative residual from which a warning is given
WARNING_PENETRATION = 1e-7  # penetration relative to the indentation, from which a warning is given
State = TypeVar("State")  # a state, or one with its displacement


def audits(
    finger: Finger[Patches], state: EquilibriumState, displacement: Array, overstress: Array | None = None
) -> dict[str, float]:
    """Return the audits of one state, 0 where perfect, except for `smallest_det_F`.

    `displacement` (nodes, 2) is relative to the bone [mm]; `overstress` (nodes, 2) are the nodal forces of relaxing
    terms [N/mm].

    `equilibrium_x`, `equilibrium_y`: bone reaction plus contact force, relative to the contact force. `inner_forces`:
    largest residual at a free node, with the surface's force on nodes in contact, relative to the contact force.
    `work_balance`: relative difference between the derivatives of the stored energy and of the contact forces' work
    with respect to a factor on the displacement (Clapeyron's theorem at small strain). The load path has no part in it.
    `penetration`: of any node of the skin, relative to the indentation. `tension`: largest tension at a node in
    contact, relative to the largest normal force. `cone_violation`: |t| beyond min(mu p, tau_max) on the deformed
    length, relative to the largest normal force.
    """
    mesh, condensed = finger.geometry.mesh, finger.newton.condensed
    inner, growth = finger.body.forces(displacement), finger.body.internal_work(displacement)
    if overstress is not None:
        inner = inner + overstress
        growth += float(np.sum(overstress * displacement))
    total = max(float(state.force[1]), np.finfo(float).tiny)
    bone = inner[mesh.held].sum(axis=0) + state.force
    residual = inner.copy()
    residual[mesh.skin] -= state.reaction
    residual[mesh.held] = 0.0
    work = float(np.sum(state.reaction * displacement[mesh.skin]))
    skin = finger.geometry.all_skin
    height = mesh.nodes[skin, 1] + displacement[skin, 1] - state.load.depth
    push = max(float(state.normal.max(initial=0.0)), np.finfo(float).tiny)
    length = np.empty(len(state.state))
    x = np.ascontiguousarray(state.skin_positions(condensed)[:, 0])
    bounded_length(x, finger.newton.skin, length)
    # Open skin may overhang, with a negative length along the surface, which has no friction limit.
    limit = FrictionLaw(float(state.load.mu), state.load.tau).limit(state.normal, np.maximum(length, 0.0))
    return {
        "equilibrium_x": abs(float(bone[0])) / total,
        "equilibrium_y": abs(float(bone[1])) / total,
        "inner_forces": float(np.abs(residual).max()) / total,
        "work_balance": abs(work - growth) / max(abs(growth), np.finfo(float).tiny),
        "penetration": max(-float(height.min()), 0.0) / state.load.depth,
        "tension": max(-float(state.normal.min(initial=0.0)), 0.0) / push,
        "cone_violation": max(float((np.abs(state.tangential) - limit).max(initial=0.0)), 0.0) / push,
        "smallest_det_F": finger.body.smallest_det(displacement),
    }


def force_residuals(scene: Scene, normal: float, tangential: float) -> dict[str, float]:
    """Return the relative errors of a state's forces [N/mm] against those that `scene` prescribes; empty without any.

    `normal_force_missed` is relative to the given force, `drag_missed` to the friction limit under it. Raises
    NotConverged where either exceeds `FORCE_RESIDUAL`.
    """
    force, drag = scene.normal_force, scene.tangential_force
    if force is None:
        return {}
    residuals = {"normal_force_missed": abs(normal / force - 1.0)}
    if drag is not None and scene.friction.mu > 0.0:
        residuals["drag_missed"] = abs(tangential + scene.loading.direction * drag) / (float(scene.friction.mu) * force)
    if max(residuals.values()) > FORCE_RESIDUAL:
        raise NotConverged("No state with the given forces was found: change them, or give a depth.")
    return residuals


def imbalance(checks: Mapping[str, float]) -> float:
    """Return the largest residual of forces and work among `checks`."""
    return max(checks[name] for name in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance"))


def balance(
    state: State,
    checks: dict[str, float],
    target: float,
    correct: Callable[[State, dict[str, float]], tuple[State, dict[str, float]] | None],
) -> tuple[State, dict[str, float]]:
    """Return a state and its audits after corrections until its imbalance is below `target`.

    `correct` returns a corrected state with its audits, or None. The first correction that does not halve the imbalance
    is discarded, and ends the loop (Higham 2002, Accuracy and Stability of Numerical Algorithms, chapter 12).
    """
    while (before := imbalance(checks)) > target:
        corrected = correct(state, checks)
        if corrected is None or imbalance(corrected[1]) > before / 2.0:
            break
        state, checks = corrected
    return state, checks


def refuse_unsound(checks: Mapping[str, float], depth: float) -> None:
    """Raise NotConverged where residuals at `depth` [mm] are too large, because of round-off."""
    if (residual := imbalance(checks)) > MAX_RESIDUAL:
        raise NotConverged(
            f"Forces balance to {residual:.1g} only at {depth:g} mm indentation: the answer is lost in round-off, "
            f"as with contacts far smaller than the mesh, {MIXED[:-1]}."
        )


def refuse_beyond_finger(finger: Finger[Patches], state: EquilibriumState, displacement: Array) -> None:
    """Raise NoSteadyState where skin is displaced farther than the length of the finger, and only a bound holds it.

    At small strain a wedging slide has a state under any bound, however high.
    """
    farthest, length = float(np.abs(displacement).max()), float(np.ptp(finger.geometry.mesh.nodes, axis=0).max())
    if farthest > length and (state.state == SHEAR_LIMITED).any():
        raise NoSteadyState(
            f"This slide would displace skin by {farthest:.3g} mm, farther than the finger is long ({length:.3g} mm): "
            "ask for less friction or depth, or a lower tau_max."
        )


def round_off_warnings(checks: Mapping[str, float]) -> tuple[str, ...]:
    """Return a warning for each of `checks` with unusual round-off."""
    warnings: list[str] = []
    if (residual := imbalance(checks)) > WARNING_RESIDUAL:
        warnings.append(f"Forces balance to {residual:.1g} only: {MIXED} magnify round-off.")
    if (low := checks["penetration"]) > WARNING_PENETRATION:
        warnings.append(f"The skin lies {low:.1g} of the indentation too low: stiff layers magnify round-off.")
    return tuple(warnings)


def inside_out_warning(checks: Mapping[str, float]) -> str:
    """Return a warning where tissue is turned inside out, else "".

    Unlike tissue, the small-strain model has finite stiffness and energy there.
    """
    if checks["smallest_det_F"] > 0.0:
        return ""
    return (
        f"Tissue is turned inside out somewhere (a volume of −{abs(checks['smallest_det_F']):.2g} of what it was): no "
        "finger can be pressed or dragged so far, and the numbers are those of a formula beyond its range."
    )


def course_audits(newton: Newton, states: Sequence[EquilibriumState], *, relaxing: bool = False) -> dict[str, float]:
    """Return the audits of a load path from the undeformed state, relative to the work of the bone.

    The work of the bone and of friction uses the mean of the forces at both ends of a step.
    `course_work_balance`: work of the forces on the skin less the stored energy. At small strain the mean is exact; at
    finite strain the internal forces within a step are integrated by Simpson's rule.
    `course_step_work`: bone work less stored energy less dissipation. It vanishes with the square of the step, or in
    proportion to it where points come into contact within a step.
    `course_least_dissipation`: smallest dissipation by friction in a step, never negative.

    Relaxing tissues dissipate too, and forces within a step depend on the past. There `course_viscous_work` takes the
    place of the first two: bone work less friction less the energy stored at the end. It is positive, up to the error
    of the steps.
    """
    reaction = np.array([state.reaction for state in states])  # (m, k, 2)
    skin = np.array([state.skin_positions(newton.condensed) for state in states])
    load = np.array([[state.load.travel, state.load.depth] for state in states])
    mean, motion = (reaction[1:] + reaction[:-1]) / 2.0, np.diff(skin, axis=0)
    slip = motion - np.diff(load, axis=0)[:, None]  # relative to the surface; negative along y towards it
    bone = float(np.sum(mean.sum(axis=1) * np.diff(load, axis=0)))
    dissipation = -float(np.sum(mean[..., 0] * slip[..., 0]))
    friction = -np.sum(reaction[1:, :, 0] * slip[..., 0], axis=1)
    scale = max(abs(bone), np.finfo(float).tiny)
    energy = newton.condensed.stored_energy(states[-1].u, states[-1].reaction)
    least = {"course_least_dissipation": float(friction.min()) / scale}
    if relaxing:
        return {"course_viscous_work": (bone - dissipation - energy) / scale} | least
    elastic = newton.condensed.work([state.u for state in states], float(np.sum(mean * motion)))
    return {
        "course_work_balance": abs(elastic - energy) / scale,
        "course_step_work": abs(bone - energy - dissipation) / scale,
    } | least
