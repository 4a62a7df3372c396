"""Settled states at small strain on one mesh, limits of their existence, and the depth under a normal force.

The drag of a slide presses the finger down, the more so the larger the coefficient of friction. At a finite coefficient
the forces of full slip grow without bound. Beyond it full slip does not exist: the drag wedges the finger into the
surface. The limit is found by following full slip from mu = 0.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from math import log2, sqrt
from typing import Any

from solver.arrays import Array
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.finger import Finger, LinearFinger, cached_finger
from solver.equilibrium.load_path import march_scene, slide_or_hold
from solver.equilibrium.load_stepping import forces_of, slide_from_guess, slide_under, sliding_load
from solver.equilibrium.load_stepping import solve_full_slip as full_slip
from solver.failures import ContactLost, NoSteadyState, NotConverged
from solver.mesh.mesher import Sizing
from solver.scene import Scene
from solver.scene.tables import SHALLOW, Friction, SceneError

WIDE_MARGIN = 16.0  # margin with which nearly all the palmar skin may touch
_FINENESS = 7.0  # of the meshes for limits of depth and force, which hardly depend on the mesh
COARSE_FINENESS = 6.0  # of the mesh for depths under a force, accurate to some tenths of a per cent
COVERED_SHARE = 0.9  # design depth of a mesh relative to the highest skin in contact: it covers 1.25 times this depth
NEAR_SLIDING = 0.5  # ratio of drag to friction limit from which a dragged finger is about as deep as a sliding one
MAX_DEPTH_SHARE = 0.85  # of the tissue between first contact and bone: beyond, small strain is meaningless


@dataclass(frozen=True, slots=True)
class LimitSearch:
    """Control of the search for a limit of friction, depth or force."""

    fineness_ratio: float = 1.6  # of the mesh that confirms a limit of depth
    depth_factor: float = 2.0  # ratio of the largest depth searched to the largest that occurred under growing forces
    max_systems: int = 15  # for the contact states of a step
    min_fraction: float = 1e-3  # of the given depth or force, from which the search begins
    mu_tolerance: float = 0.005  # relative, at which the search for the limit of mu ends
    force_increment: float = 1e-4  # relative, for the sign of the change of depth with force


LIMIT_SEARCH = LimitSearch()


def continue_in_friction(
    newton: Newton, load: LoadState, force: float | None = None, first: EquilibriumState | None = None
) -> tuple[EquilibriumState | None, float]:
    """Return full slip under `load`, followed from mu = 0, and the largest mu that has a state.

    The state is None where this mu is less than that of `load`. Under a normal `force`, `first` is the state at mu = 0,
    and the mu returned is 0 (unknown) where contact grew beyond the skin that may touch.
    """
    mu, step, unknown = 0.0, load.mu, False
    try:
        state = full_slip(newton, load._replace(mu=0.0)) if first is None else first
    except ContactLost:
        return None, 0.0
    while mu < load.mu and step > LIMIT_SEARCH.mu_tolerance * max(mu, min(0.01, load.mu)):
        aim = min(mu + step, load.mu)
        try:
            further = slide_from_guess(newton, load._replace(mu=aim), state.state, force, LIMIT_SEARCH.max_systems)
        except ContactLost:
            step /= 2.0
            continue
        under_force = first is not None
        if further.reaches_end:  # contact beyond the skin that may touch is unknown
            step, unknown = step / 2.0, under_force
        elif under_force and not further.load.depth > 0.0:  # the surface would pull
            step /= 2.0
        else:
            state, mu, step = further, aim, 2.0 * step
    if mu == load.mu:
        return state, mu
    return None, 0.0 if unknown else mu


def limits(scene: Scene, load: LoadState) -> tuple[float | None, float | None]:
    """Return the largest normal force [N/mm] and depth [mm] with full slip under `load`, to 3 and 4 %.

    Both are less than the scene's. The force is None where the scene prescribes a depth; unknown limits are None.
    """

    @cache
    def newton_for(depth: float, fineness_ratio: float = 1.0) -> Newton:
        return LinearFinger.of(scene, Sizing(fineness_ratio * _FINENESS, depth, margin=WIDE_MARGIN)).newton

    if scene.normal_force is None:
        return None, _deepest(newton_for, load, scene.loading.depth)
    strongest = _strongest(newton_for, scene, scene.normal_force, load)
    if strongest is None:
        return None, None
    return strongest[0], _deepest(newton_for, load, LIMIT_SEARCH.depth_factor * strongest[1], strongest[1])


NewtonFor = Callable[..., Newton]  # takes the depth [mm] for which a mesh is made, and a factor on its fineness


def _rounded(depth: float) -> float:
    """Return the power of two next to a `depth`, so that depths within a factor of 1.4 share a mesh."""
    return 2.0 ** round(log2(depth))


def _deepest(newton_for: NewtonFor, load: LoadState, high: float, low: float | None = None) -> float | None:
    """Return the largest indentation [mm] between `low` and `high` with full slip.

    None where none has full slip, or where a finer mesh disagrees, as it does at coefficients far beyond the limit.
    """

    def slides(depth: float) -> bool:
        return continue_in_friction(newton_for(_rounded(depth)), load._replace(depth=depth))[0] is not None

    least = LIMIT_SEARCH.min_fraction * high
    while low is None:
        if high < least:
            return None
        low, high = (high / 2.0, high) if slides(high / 2.0) else (None, high / 2.0)
    deepest = _largest(slides, low, high)
    finer = newton_for(deepest, LIMIT_SEARCH.fineness_ratio)
    ends = [continue_in_friction(finer, load._replace(depth=part * deepest))[0] is None for part in (0.97, 1.03)]
    return deepest if ends == [False, True] else None


def _strongest(newton_for: NewtonFor, scene: Scene, force: float, load: LoadState) -> tuple[float | None, float] | None:
    """Return the largest normal force [N/mm] below `force` with full slip, and the largest depth [mm] reached.

    The force is None where a finer mesh disagrees; the result is None where no force has full slip.
    """
    depths, bone = [0.0], scene.finger.pulp_thickness()
    frictionless = load._replace(mu=0.0)

    def slide_at(newton: Newton, force: float) -> EquilibriumState | None:
        return continue_in_friction(newton, load, force, slide_under(newton, frictionless, force, bone))[0]

    def frictionless_depth(force: float) -> float:
        return slide_under(newton_for(_rounded(bone / 2.0)), frictionless, force, bone).load.depth

    def slides(force: float) -> bool:
        with suppress(ContactLost):
            state = slide_at(newton_for(_rounded(frictionless_depth(force))), force)
            if state is not None:
                depths.append(state.load.depth)
            return state is not None
        return False

    if not slides(LIMIT_SEARCH.min_fraction * force):
        return None
    most = _largest(slides, LIMIT_SEARCH.min_fraction * force, force)
    finer = newton_for(frictionless_depth(most), LIMIT_SEARCH.fineness_ratio)
    ends = [slide_at(finer, part * most) is None for part in (0.97, 1.03)]
    return most if ends == [False, True] else None, max(depths)


def _largest(exists: Callable[[float], bool], low: float, high: float) -> float:
    """Return the largest value between `low` and `high` for which `exists` is true, to 1 %, by bisection."""
    while high > 1.02 * low:
        middle = sqrt(low * high)
        low, high = (middle, high) if exists(middle) else (low, middle)
    return sqrt(low * high)


def settled_state(scene: Scene, finger: Finger[Any], step_factor: float = 1.0) -> EquilibriumState:
    """Return the settled state: full slip directly, a path-dependent state in `step_factor` times the usual load steps.

    Raises NotConverged, ContactLost where no state was found, NoSteadyState where a drag exceeds the friction limit.
    """
    load, force, newton = sliding_load(scene), scene.normal_force, finger.newton
    if scene.loading.direction == 0 and not load.frictionless:
        return march_scene(scene, finger, step_factor).last
    if force is None:
        return full_slip(newton, load)
    return slide_or_hold(scene, finger, lambda: slide_under(newton, load, force, _deepest_press(scene)), step_factor)


def follow_friction(scene: Scene, finger: LinearFinger) -> tuple[EquilibriumState | None, float]:
    """Return full slip at the depth or normal force of a scene, as `continue_in_friction` does from mu = 0.

    Raises NoSteadyState where that force presses the finger to its bone.
    """
    load, force = sliding_load(scene), scene.normal_force
    if force is None:
        return continue_in_friction(finger.newton, load)
    try:
        first = slide_under(finger.newton, load._replace(mu=0.0), force, _deepest_press(scene))
    except ContactLost:
        return None, 0.0
    state, limit = continue_in_friction(finger.newton, load, force, first)
    if limit == 0.0:
        refuse_beyond_tissue(scene, finger, first.load.depth)
    return state, limit


def is_unstable_under_force(scene: Scene, finger: LinearFinger, state: EquilibriumState) -> bool:
    """Return whether full slip under a given force would be less deep under a little more force."""
    force = scene.normal_force
    if force is None or scene.loading.direction == 0 or state.sticking > 0.0:
        return False
    try:
        more = (1.0 + LIMIT_SEARCH.force_increment) * force
        harder = slide_from_guess(finger.newton, sliding_load(scene), state.state, more)
    except ContactLost:
        return False
    return harder.load.depth < state.load.depth


def refuse_beyond_tissue(scene: Scene, finger: LinearFinger, depth: float) -> None:
    """Raise SolveFailure where a given force leads to a meaningless `depth` [mm], for example beyond the bone."""
    room, most = scene.finger.bone_depth(), None
    if depth >= room:
        with suppress(ContactLost):
            most = float(full_slip(finger.newton, sliding_load(scene)._replace(depth=room)).force[1])
    check_depth(scene, depth, most)


def remove_round_off(
    scene: Scene, finger: LinearFinger, state: EquilibriumState, displacement: Array
) -> tuple[EquilibriumState, Array]:
    """Return a state and its displacement (nodes, 2) after one step of iterative refinement.

    The elimination leaves residuals of some 1e-13 of the forces, which differ between processors. A step from the
    residual of the elements removes them. Contact states change only where they contradict the solution.
    """
    about, recover = finger.body.linearise_about(displacement)
    newton = Newton(about)
    try:
        correction = newton.solve_linear(state, newton.skin_x, forces_of(scene, state.load))
    except ContactLost:
        return state, displacement
    return replace(correction, u=state.u + correction.u, iterations=state.iterations), recover(correction.u)


def nearest_state(scene: Scene, finger: LinearFinger) -> EquilibriumState:
    """Return the settled state, or full slip where the friction limit of this mesh lies just below the given drag.

    Where no first guess converges, as for large coefficients, the state is followed from mu = 0. Raises as
    `settled_state`.
    """
    try:
        return settled_state(scene, finger)
    except NoSteadyState:
        if not scene.loading.dragged:
            raise
        return settled_state(scene.without_drag(), finger)
    except ContactLost:
        if scene.normal_force is not None or scene.loading.direction == 0:
            raise
        state, _ = follow_friction(scene, finger)
        if state is None:
            raise
        return state


def state_on_branch(scene: Scene, finger: LinearFinger, step_factor: float = 1.0) -> EquilibriumState:
    """Return the settled state, a path-dependent one after `step_factor` times the usual load steps.

    Near or beyond a limit, guesses can converge to states to which no slide leads. Where they fail, or lead to a folded
    state, only the state followed from mu = 0 counts. Raises NoSteadyState, NotConverged.
    """
    direction = scene.loading.direction
    try:
        state = settled_state(scene, finger, step_factor)
        # a state to which no slide leads has an element turned inside out
        if direction == 0 or state.load.path_dependent or finger.body.smallest_det(finger.displacement(state)) > 0.0:
            return state
        why = "the state found is folded"
    except ContactLost as lost:
        why = str(lost)
    if direction == 0:
        raise _no_slide(scene, why, 0.0)
    state, limit = follow_friction(scene, finger)
    if state is None:
        raise _no_slide(scene, why, limit)
    return state


def _no_slide(scene: Scene, why: str, limit_mu: float) -> NoSteadyState | NotConverged:
    """Return the failure of a scene without full slip, with the limits that are known."""
    force = scene.normal_force
    conditions = f"{scene.loading.depth:g} mm indentation" if force is None else f"a normal force of {force:g} N/mm"
    conditions += f" and mu = {float(scene.friction.mu):g}"
    if scene.friction.tau_max is not None:
        conditions += f" with tau_max = {scene.friction.tau_max:g} MPa"
    if scene.loading.direction == 0 or limit_mu <= 0.0:
        return NotConverged(
            f"No settled state was found at {conditions}, from any first guess: {why}; ask for less friction or depth."
        )
    limit_force = limit_depth = None
    with suppress(NotConverged):  # stiffnesses that are lost in round-off on a mesh for less depth
        limit_force, limit_depth = limits(scene, sliding_load(scene))
    pairs = ((limit_force, "N/mm"), (limit_depth, "mm"))
    elsewhere = " and ".join(f"{limit:.3g} {unit}" for limit, unit in pairs if limit is not None)
    along = "+x" if scene.loading.direction > 0 else "-x"
    where = "at this depth" if force is None else "under this force"
    message = (
        f"There is no steady sliding along {along} at {conditions}: the drag presses the finger against the surface "
        f"faster than it yields, so it wedges; followed from mu = 0, steady sliding {where} ends at mu = {limit_mu:.3g}"
    )
    if elsewhere:
        message += f", and with this friction at {elsewhere}"
    return NoSteadyState(
        f"{message}.", limit_mu=limit_mu, limit_indentation=limit_depth, limit_normal_force=limit_force
    )


def matching_depths(scenes: Sequence[Scene], normal_forces: Sequence[float]) -> tuple[float | None, ...]:
    """Return the indentation [mm] of each scene under the given normal force [N/mm] in full slip.

    The depth is an unknown of one solve. All scenes share the finger, materials and receptor of the first. None where
    the finger would be pressed to its bone, or has no full slip.
    """
    if not scenes:
        return ()
    finger = _coarse_finger(scenes[0])
    states = [_rough_slide(finger, scene, force) for scene, force in zip(scenes, normal_forces, strict=True)]
    return tuple(None if state is None else state.load.depth for state in states)


def expected_depth(scene: Scene) -> float:
    """Return the indentation [mm] for which a mesh is made: the given depth, or an estimate under a given force."""
    force = scene.normal_force
    if force is None:
        return scene.loading.depth
    try:
        finger = _coarse_finger(scene)
    except (SceneError, NotConverged):  # the solve itself will report it
        return _deepest_press(scene)
    state = _rough_slide(finger, scene, force)
    drag = scene.tangential_force or 0.0
    is_static = scene.loading.direction == 0 or scene.loading.dragged
    if is_static and (state is None or drag < NEAR_SLIDING * abs(state.force[0])):
        # The finger is then about as deep as one that slides under the same drag.
        friction = Friction(min(drag / force, float(scene.friction.mu)), scene.friction.tau_max)
        state = _rough_slide(finger, replace(scene, friction=friction), force)
    if state is None:
        return _deepest_press(scene)
    # A strong drag lifts the bone but brings more skin into contact, which the mesh must cover.
    highest = float(finger.body.condensed.rest[state.touching, 1].max())
    return max(state.load.depth, COVERED_SHARE * highest, SHALLOW)


def check_depth(scene: Scene, depth: float, most: float | None = None) -> None:
    """Raise SolveFailure where a given force leads to a `depth` [mm] outside the tissue.

    `most` is the normal force [N/mm] at the depth of the bone, where known.
    """
    force, room = scene.normal_force, scene.finger.bone_depth()
    if force is None or SHALLOW <= depth < room:
        return
    if depth < 0.0:
        raise NotConverged(
            f"Under a normal force of {force:.3g} N/mm the drag holds the bone {-depth:.3g} mm above first touch: ask "
            "for more force, or less friction or drag."
        )
    if depth < SHALLOW:
        raise NotConverged(
            f"A normal force of {force:.3g} N/mm presses the finger {depth:.1g} mm deep only: below {SHALLOW:g} mm "
            "round-off is as large as what there is to find; ask for more."
        )
    capacity = "" if most is None else f": with this friction the {room:.3g} mm of tissue carry up to {most:.3g} N/mm"
    raise NoSteadyState(
        f"A normal force of {force:.3g} N/mm would press the finger {depth:.3g} mm deep, to its bone{capacity}; "
        "ask for less."
    )


def _deepest_press(scene: Scene) -> float:
    """Return the depth [mm] beyond which small strain is meaningless."""
    return MAX_DEPTH_SHARE * scene.finger.pulp_thickness()


def _coarse_finger(scene: Scene) -> LinearFinger:
    """Return the finger of a scene on a coarse mesh for the deepest press."""
    depth = _deepest_press(scene)
    return cached_finger(LinearFinger, scene.frictionless_press(depth), Sizing(COARSE_FINENESS, depth))


def _rough_slide(finger: LinearFinger, scene: Scene, normal_force: float) -> EquilibriumState | None:
    """Return full slip under a normal force [N/mm]; None where it is too deep."""
    deepest = _deepest_press(scene)
    try:
        state = slide_under(finger.newton, sliding_load(scene), normal_force, deepest)
    except ContactLost:
        return None
    return None if state.reaches_end or state.load.depth > deepest else state
