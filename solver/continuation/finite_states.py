"""Settled states at finite strain on one mesh, at a given depth or under given forces, and bodies under dead loads."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from solver.arrays import Array
from solver.body.finite import FiniteBody
from solver.body.skin import SkinCompression, crosses_itself
from solver.body.validation import check_loads
from solver.constitutive import Law
from solver.contact import ForceLoad, LoadState
from solver.continuation import LARGEST_MU, Continuation, critical_stretch, jumped_branch
from solver.continuation.existence import BEYOND_LIMIT, ContinuationLimit, depth_limit, is_on_branch, slide_on_branch
from solver.equilibrium import BY_DEPTH, BY_FRICTION, EquilibriumState, Newton, Termination, load_stepping
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.load_path import march_scene, slide_or_hold
from solver.equilibrium.load_stepping import slide_from_limited_skin, sliding_load, solve_under_forces
from solver.failures import NoSteadyState, NotConverged
from solver.progress import report_progress
from solver.scene import Scene


@dataclass(frozen=True, slots=True)
class ForceSearch:
    """Control of the search for a nearby state, and for the depth under a given normal force."""

    intermediate_tolerance: float = 1e-4  # of displacements, relative to the length scale of the body
    depth_factor: float = 1.5  # ratio of the largest depth searched to the depth at which force control failed
    force_tolerance: float = 1e-9  # of the normal force, relative
    max_searches: int = 20  # Newton steps for the depth
    max_depth_change: float = 0.25  # relative, in a step
    min_det: float = 0.3  # det F below which the mesh, and not the body, ends a branch


FORCE_SEARCH = ForceSearch()
# Iterations on a nested mesh start from the solution on the coarser mesh, so that their first step is the difference
# of both meshes, which estimates the error. They end once a twentieth of it remains. In 48 scenes at finite strain, a
# tolerance of 1e-10 mm takes half as long again, and changes estimates by 2e-5 in the median and 7 % at most. Half or
# double the part changes no more.
ON_NESTED_MESH = Termination(relative_to_first=0.05, max_iterations=10)


def settled_state(
    finger: FiniteFinger, scene: Scene, start: EquilibriumState | None = None, step_factor: float = 1.0
) -> EquilibriumState:
    """Return the settled state of a scene; the search begins at `start`, a proven state nearby.

    A state that depends on its load path takes `step_factor` times the usual load steps, and its load has sense 0.
    Raises NoSteadyState, NotConverged, Cancelled.
    """
    if scene.loading.direction == 0 and scene.friction.mu > 0.0:
        return march_scene(scene, finger, step_factor).last
    if scene.normal_force is not None:
        return _state_under_force(finger, scene, scene.normal_force, start, step_factor)
    return slide_on_branch(finger, sliding_load(scene), start=start)


def slide_near(finger: FiniteFinger, scene: Scene, start: EquilibriumState) -> EquilibriumState | None:
    """Return full slip after a few iterations from `start`; None where they fail or the state is unproven."""
    newton, force = finger.newton, scene.normal_force
    try:
        if force is None:
            state = newton.solve(start, sliding_load(scene), ON_NESTED_MESH)
        else:
            near = replace(start, load=sliding_load(scene)._replace(depth=start.load.depth, travel=start.load.travel))
            state = solve_under_forces(newton, near, ForceLoad(force, None), ON_NESTED_MESH)
            state = newton.solve(state, state.load, ON_NESTED_MESH)
        return state if is_on_branch(finger, state) else None
    except NotConverged:
        return None


def rough_state(finger: FiniteFinger, scene: Scene, near: EquilibriumState | None = None) -> EquilibriumState:
    """Return an approximate settled state, from which others may start if it `is_sound`. Raises as `settled_state`.

    The search begins at `near`, the settled state of another surface, if that slides in the same direction.
    """
    if near is not None:
        same_direction = near.load.sense == -(scene.loading.direction or 1)
        near = replace(near, iterations=0) if same_direction else None
    if scene.normal_force is not None or (scene.loading.direction == 0 and scene.friction.mu > 0.0):
        return settled_state(finger, scene, near)
    load = sliding_load(scene)
    if near is not None:
        with suppress(NotConverged):
            return load_stepping.solve_full_slip(finger.newton, load, near, FORCE_SEARCH.intermediate_tolerance)
    return load_stepping.solve_full_slip(finger.newton, load, None, FORCE_SEARCH.intermediate_tolerance)


def _state_under_force(
    finger: FiniteFinger, scene: Scene, force: float, start: EquilibriumState | None, step_factor: float
) -> EquilibriumState:
    """Return the settled state under given forces, with unknown depth and travel. Raises as `settled_state`."""
    if start is not None and start.load.sense == 0:  # the end of a load path, no start for a slide
        start = None
        with suppress(NotConverged):
            return march_scene(scene, finger, step_factor).last
    try:
        return slide_or_hold(scene, finger, lambda: _sliding_under(finger, scene, force, start), step_factor)
    except NoSteadyState as failure:
        raise failure if scene.loading.dragged else _under_force(scene, force, failure) from failure


def _under_force(scene: Scene, force: float, failure: NoSteadyState) -> NoSteadyState:
    """Return the failure of a scene under a normal force, from the `failure` at a depth, without a limit of mu."""
    depth, most = failure.limit_indentation, failure.limit_normal_force
    far = [] if most is None else [f"{most:.3g} N/mm"]
    far += [] if depth is None else [f"{depth:.3g} mm of indentation"]
    ends = f": with this friction there is settled sliding up to {', '.join(far)}" if far else ""
    return NoSteadyState(
        f"No settled sliding at mu = {float(scene.friction.mu):.3g} was found under a normal force of {force:.4g} "
        f"N/mm{ends}; ask for less force, less friction or small strain.",
        limit_indentation=depth,
        limit_normal_force=most,
    )


def _sliding_under(
    finger: FiniteFinger, scene: Scene, force: float, start: EquilibriumState | None
) -> EquilibriumState:
    """Return full slip under the normal force of a scene, from `start` or by a growing force."""
    newton = finger.newton
    load = sliding_load(scene)
    at_bound = load.mostly_shear_limited
    if start is not None:
        near = replace(start, load=load._replace(depth=start.load.depth, travel=start.load.travel))
        with suppress(NotConverged):
            state = (
                _at_force(newton, near, force) if at_bound else solve_under_forces(newton, near, ForceLoad(force, None))
            )
            return slide_on_branch(finger, state.load, start=state)
    if at_bound:
        with suppress(NotConverged):
            *_, frictionless = _increase_force(newton, load._replace(mu=0.0), force)
            begin = slide_from_limited_skin(
                newton, load._replace(depth=frictionless.load.depth), FORCE_SEARCH.intermediate_tolerance
            )
            state = _at_force(newton, begin, force)
            return slide_on_branch(finger, state.load, start=state)
    states: list[EquilibriumState] = []
    try:
        for state in _increase_force(newton, load, force):
            states.append(state)  # states before a failure count
    except NotConverged as failure:
        if states:
            return _slide_deeper(finger, states[-1], force)
        proof = depth_limit(scene, load._replace(depth=scene.finger.bone_depth()))
        if proof.is_certain and proof.numbers[1] < force:  # even the deepest slide carries less
            raise _beyond(proof.value, float(proof.numbers[1])) from failure
        raise
    *before, last = states
    try:
        return slide_on_branch(finger, last.load, start=last)
    except NoSteadyState:  # beyond a limit, which has a force as well as a depth
        return _slide_deeper(finger, before[-1], force)


def _increase_force(newton: Newton, load: LoadState, force: float) -> Iterator[EquilibriumState]:
    """Yield slides with the friction of `load` as the normal force grows to `force`. Raises NotConverged."""
    begin = EquilibriumState.undeformed(newton.condensed, LoadState(0.0, load.mu, load.tau, load.sense))
    grows = [ForceLoad(force * part, None) for part in (0.02, 0.1, 0.25, 0.5, 0.75, 1.0)]
    return load_stepping.march(newton, grows, begin)


def _at_force(newton: Newton, start: EquilibriumState, force: float) -> EquilibriumState:
    """Return full slip under a normal `force` [N/mm], by Newton's method for its depth. Raises NotConverged."""
    state, depth = start, start.load.depth
    for _ in range(FORCE_SEARCH.max_searches):
        state = load_stepping.solve_full_slip(newton, state.load._replace(depth=depth), state)
        if abs(state.force[1] / force - 1.0) < FORCE_SEARCH.force_tolerance:
            return state
        if not newton.linearise(state, newton.skin_x):
            break
        stiffness = float(newton.force_changes(newton.steps)[1, BY_DEPTH])
        if not stiffness > 0.0:
            break
        largest = FORCE_SEARCH.max_depth_change * depth
        depth += float(np.clip((force - state.force[1]) / stiffness, -largest, largest))
    raise NotConverged(f"No depth was found at which the finger presses with {force:.4g} N/mm: give a depth instead.")


def _slide_deeper(finger: FiniteFinger, state: EquilibriumState, force: float) -> EquilibriumState:
    """Return full slip under `force` [N/mm] deeper than `state`, beyond which force control failed.

    `depth_limit` finds the largest depth and its force. Where a slightly deeper state exists nevertheless, the search
    continues from this state. Raises as `settled_state`.
    """
    proof = depth_limit(finger.scene, state.load._replace(depth=FORCE_SEARCH.depth_factor * state.load.depth))
    if proof.is_certain and proof.numbers[1] < force:
        state = _slide_reaching_force(finger, state, proof, force)
    state = _at_force(finger.newton, state, force)
    return slide_on_branch(finger, state.load, start=state)


def _slide_reaching_force(
    finger: FiniteFinger, state: EquilibriumState, proof: ContinuationLimit, force: float
) -> EquilibriumState:
    """Return a slide beyond the limit depth of `proof` with a normal force of `force` [N/mm] or more.

    Depths grow by the difference of limits between two meshes. Raises NoSteadyState at the first depth without a state,
    NotConverged where existence is unknown.
    """
    depth, most = proof.value, float(proof.numbers[1])
    while most < force:
        report_progress("searching for deeper slides", most / force)
        try:
            state = slide_on_branch(finger, state.load._replace(depth=(1.0 + BEYOND_LIMIT) * depth), start=state)
        except NoSteadyState as failure:
            raise _beyond(depth, most) from failure
        depth, most = state.load.depth, float(state.force[1])
    return state


def _beyond(depth: float, force: float) -> NoSteadyState:
    """Return the failure of a force beyond the deepest slide, which has a `depth` [mm] and a `force` [N/mm]."""
    return NoSteadyState("There is none so deep.", limit_indentation=depth, limit_normal_force=force)


def solve_dead_load(
    body: FiniteBody,
    loads: Array | None = None,
    prescribed: Array | None = None,
    load: LoadState | None = None,
    start: EquilibriumState | None = None,
    steps: int = 4,
) -> EquilibriumState:
    """Return the equilibrium under dead `loads` (nodes, 2) [N/mm], with held nodes displaced by `prescribed` [mm].

    `prescribed` (nodes, 2) is 0 at free nodes. The path begins at `start` or the undeformed state, and has `steps`
    equal steps; a step that fails is halved. `load` is constant, by default without depth and friction. The loads stay
    on the body. Raises BodyError for arrays of another shape, ValueError for a load on the centre of an element and for
    a load state that is not allowed, NotConverged where no equilibrium is found.
    """
    newton, condensed = Newton(body.condensed), body.condensed
    check_loads(body.mesh, loads, prescribed)
    loads, prescribed = (None if array is None else np.asarray(array, np.float64) for array in (loads, prescribed))
    state = EquilibriumState.undeformed(condensed) if start is None else start
    load = (state.load if load is None else load).validate()
    state = replace(state, load=load)
    vector = np.zeros(body.size) if loads is None else _on_unknowns(body, loads)
    driven = body.mesh.driven
    held_at = state.u[driven]
    motion = 0.0 if prescribed is None else prescribed[driven] - held_at
    present = condensed.load.copy()

    def step(part: float) -> None:
        nonlocal state
        condensed.load[:] = present + part * (vector - present)
        u = state.u.copy()
        u[driven] = held_at + part * motion
        state = newton.solve(replace(state, u=u), load)

    def refusal(fraction: float, _part: float, reason: NotConverged) -> NotConverged:
        return NotConverged(f"no equilibrium was found beyond {fraction:.3g} of the loads: {reason}")

    load_stepping.advance(step, refusal, load_stepping.StepControl(first_step=1.0 / steps))
    return state


def _on_unknowns(body: FiniteBody, loads: Array) -> Array:
    """Return the loads (n,) in the order of the unknowns."""
    if loads[body.elements.nodes[:, 8]].any():
        raise ValueError("a dead load on the centre of an element cannot be taken: put it on corners and mid-sides")
    out = np.zeros(body.size)
    free = body.elements.unknown >= 0
    out[body.elements.unknown[free]] = loads[body.elements.nodes[:, :8]][free]
    return out


def steady_body(
    body: FiniteBody, load: LoadState, skin: Law, start: EquilibriumState | None = None
) -> EquilibriumState:
    """Return full slip of a body under `load`, followed on its mesh from the frictionless state.

    The search for the frictionless state begins at `start` or the undeformed state. `skin` is the law of the tissue
    that may fold. Raises NoSteadyState with the largest friction on this mesh where the branch ends before `load`, at a
    limit point or a fold of the skin; NotConverged where the branch is lost, or has no first state.
    """
    newton = Newton(body.condensed)
    branch_body = _OwnBody(body, newton)
    frictionless = load_stepping.solve_full_slip(newton, load._replace(mu=0.0), start)
    continuation = Continuation(branch_body, BY_FRICTION, critical_stretch(skin))
    branch = continuation.branch(frictionless, min(load.mu, LARGEST_MU))
    where = f"at {load.depth:.4g} mm settled sliding was followed up to mu = {branch.value:.3g}"
    if branch.ends_early and (branch.corrector_failed or branch_body.is_unusable(branch.last)):
        raise NotConverged(f"{where} and lost there; whether there is any at mu = {load.mu:.3g} is not known")
    if branch.ends_early:
        raise NoSteadyState(f"{where}, where it ends on this mesh", limit_mu=branch.value)
    state = load_stepping.solve_full_slip(newton, load, branch.last)
    if jumped_branch(branch_body, branch.last, state):
        raise NotConverged(f"{where}, and beyond only with its skin folded")
    return state


@dataclass(frozen=True, slots=True, eq=False)
class _OwnBody:
    """A body whose skin is checked for folds in all parts that may touch."""

    body: FiniteBody
    newton: Newton

    def skin_compression(self, state: EquilibriumState) -> SkinCompression:
        """Return the compression of the skin, and its creases."""
        skin = self.body.mesh.skin
        every = np.ones(len(skin) // 2, bool)
        return SkinCompression.of(self.body.mesh.nodes[skin], state.u[skin], every, state.touching)

    def crosses(self, state: EquilibriumState) -> bool:
        """Return whether the skin crosses itself."""
        return crosses_itself(self.newton.condensed.skin_positions(state.u))

    def is_unusable(self, state: EquilibriumState) -> bool:
        """Return whether contact has reached an end of the skin, or an element is crushed."""
        return state.reaches_end or self.body.smallest_det(state.u) < FORCE_SEARCH.min_det
