"""Existence of full slip at finite strain: a proof for a state, or a refusal with its limits."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from solver._kernels import OPEN, SHEAR_LIMITED
from solver._kernels.contact_system import SHEAR_LIMITED_MU
from solver.contact import LoadState
from solver.continuation import Continuation
from solver.continuation.limit_point import LIMIT, ContinuationLimit, depth_limit, friction_limit, is_folded, is_sound
from solver.equilibrium import TO_ROUND_OFF, EquilibriumState, Newton
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.load_stepping import solve_full_slip
from solver.failures import NoSteadyState, NotConverged
from solver.scene import Scene

CERTAIN_SHARE = 0.9  # fraction of the given friction or depth below which a limit is certain
AGREEMENT = 0.1  # relative difference of SED and forces below which states of two meshes are the same
BEYOND_LIMIT = 0.06  # relative distance beyond a limit at which another path is tried: twice the 3 % accuracy of limits


def slide_on_branch(finger: FiniteFinger, load: LoadState, start: EquilibriumState | None = None) -> EquilibriumState:
    """Return full slip under `load` on the branch from the frictionless state or from a shallow press.

    The search begins at `start`. A state whose skin might have folded, or that is not found directly, is proven by
    following the branch on meshes made for it. Raises NoSteadyState with the limits where the branch ends before
    `load`, NotConverged where it has no first state, Cancelled.
    """
    candidates: list[EquilibriumState] = []
    for state in _direct_states(finger.newton, load, start):
        if is_sound(finger, state, LIMIT.safe_stretch):
            return state
        candidates.append(state)
    proof = _limit_towards(finger.scene, load)
    if proof.corrector_failed:
        raise _undecided(load, proof)
    if proof.ends_early:
        raise _no_slide(finger.scene, load, proof)
    for state in candidates:
        if _agrees(finger, state, proof):
            return state
    if is_mostly_shear_limited(load):
        raise NotConverged(
            f"At {load.depth:.3g} mm of indentation there is settled sliding at mu = {load.mu:.3g}, nearly all of the "
            "skin slipping at the bound, and this mesh does not find it: another tolerance has another mesh"
        )
    branch = Continuation(finger, proof.search.parameter, 0.0).trace(proof.search.start(finger), proof.search.target)
    if not branch.ends_early:
        state = solve_full_slip(finger.newton, load, branch.last)
        if _agrees(finger, state, proof):
            return state
    limit = "depth" if proof.by_depth else "friction"
    raise NotConverged(
        f"At {load.depth:.3g} mm of indentation and mu = {load.mu:.3g} there is settled sliding, but near the limit of "
        f"{limit}, and this mesh does not find it: ask for a little less {limit}, or another tolerance"
    )


def is_on_branch(finger: FiniteFinger, state: EquilibriumState) -> bool:
    """Return whether a state lies on the branch from the frictionless state, by following this branch if necessary."""
    if is_sound(finger, state, LIMIT.safe_stretch):
        return True
    if not is_sound(finger, state):
        return False
    proof = _limit_towards(finger.scene, state.load)
    return not proof.ends_early and _agrees(finger, state, proof)


def is_mostly_shear_limited(load: LoadState) -> bool:
    """Return whether mu is so large that nearly all skin in contact is shear-limited."""
    return load.mu > SHEAR_LIMITED_MU and load.tau < np.inf


def refuse_far_beyond(scene: Scene, load: LoadState) -> None:
    """Raise NoSteadyState where the branch ends far below the friction or depth of `load`.

    It serves a coarse mesh without a state, or with folded skin: a fine mesh that fails costs more than following the
    branch. It raises nothing where the branch ends so near that another mesh may have the state.
    """
    with suppress(NotConverged):
        proof = _limit_towards(scene, load)
        if proof.is_certain and proof.value < CERTAIN_SHARE * (load.depth if proof.by_depth else load.mu):
            raise _no_slide(scene, load, proof)


def _direct_states(newton: Newton, load: LoadState, start: EquilibriumState | None) -> Iterator[EquilibriumState]:
    """Yield the states found directly from `start`, from the undeformed state, and from shear-limited skin.

    Where nearly all skin is shear-limited, the undeformed state leads to no further state.
    """
    ways: list[Callable[[], EquilibriumState]] = []
    if not is_mostly_shear_limited(load):
        ways.append(lambda: solve_full_slip(newton, load))
    if load.tau < np.inf:
        ways.append(lambda: slide_from_limited_skin(newton, load))
    if start is not None:
        ways.insert(0, lambda: solve_full_slip(newton, load, start))
    for search in ways:
        with suppress(NotConverged):
            yield search()


def limit_warnings(finger: FiniteFinger, state: EquilibriumState) -> tuple[str, ...]:
    """Return a warning for full slip near a limit of friction or depth, else nothing."""
    if state.load.sense == 0 or is_sound(finger, state, LIMIT.safe_stretch):
        return ()
    proof = _limit_towards(finger.scene, state.load)
    if not proof.is_near_fold:
        return ()
    limit = "depth" if proof.by_depth else "friction"
    return (
        f"The skin is squeezed to {100 * proof.least_stretch:.0f} % of its length at one place and folds at "
        f"{100 * proof.search.critical_stretch:.0f} %: this is within some 2 % of the largest {limit} with settled "
        "sliding, which is known as well.",
    )


def _limit_towards(scene: Scene, load: LoadState) -> ContinuationLimit:
    """Return the range of the branch in friction, or in depth where only this branch reaches `load`.

    Where nearly all skin is shear-limited, states hardly depend on mu, so that its limit is ill-conditioned. Under very
    deep presses skin folds without friction, and slides with some: the branch in friction then has no first state.
    """
    if load.frictionless:
        return depth_limit(scene, load)
    try:
        proof = friction_limit(scene, load, load.mu)
    except NotConverged:
        return depth_limit(scene, load)
    if proof.ends_early:
        with suppress(NotConverged):
            deepest = depth_limit(scene, load)
            return proof if deepest.ends_early else deepest
    return proof


def _no_slide(scene: Scene, load: LoadState, proof: ContinuationLimit) -> NoSteadyState | NotConverged:
    """Return the failure with both limits, each only where no state lies a little beyond it.

    The end of a branch in depth counts as a limit only where the skin folds.
    """
    if proof.by_depth:
        if not proof.is_near_fold:
            return _undecided(load, proof)
        return NoSteadyState(
            f"At mu = {load.mu:.3g} there is settled sliding up to {proof.value:.4g} mm of indentation, but not at "
            f"{load.depth:.4g} mm: the skin folds; ask for less depth or small strain.",
            limit_indentation=proof.value,
        )
    largest, depth = proof.value, None
    if not _has_no_slide(scene, load._replace(mu=(1.0 + BEYOND_LIMIT) * largest), load):
        return _undecided(load, proof)
    ends = (
        "the skin behind the contact folds"
        if proof.is_near_fold or all(tissue.law != "ogden" for tissue in scene.meshed_tissues)
        else "friction is largest there, with the skin behind the contact squeezed to "
        f"{100 * proof.least_stretch:.0f} %"
    )
    beyond = ""
    with suppress(NotConverged):
        deepest = depth_limit(scene, load)
        further = load._replace(depth=(1.0 + BEYOND_LIMIT) * deepest.value)
        if deepest.is_certain and _has_no_slide(scene, further, load):
            depth = deepest.value
            beyond = f", and with this friction up to {depth:.4g} mm"
    return NoSteadyState(
        f"At {load.depth:.4g} mm of indentation there is settled sliding up to mu = {largest:.3g}{beyond}, but "
        f"not at mu = {load.mu:.3g}: {ends}; ask for less depth, less friction or small strain.",
        limit_mu=largest,
        limit_indentation=depth,
    )


def _undecided(load: LoadState, proof: ContinuationLimit) -> NotConverged:
    depth, mu = f"{load.depth:.3g} mm of indentation", f"mu = {load.mu:.3g}"
    there, end, here = (
        (mu, f"{proof.value:.3g} mm of indentation", depth)
        if proof.by_depth
        else (depth, f"mu = {proof.value:.3g}", mu)
    )
    return NotConverged(
        f"At {there} settled sliding was followed up to {end} and lost there; whether there is any at {here} is not "
        "known: ask for less friction or depth"
    )


def _has_no_slide(scene: Scene, further: LoadState, load: LoadState) -> bool:
    """Return whether `further`, a little beyond a limit, has no state along the other parameter's branch.

    A limit of depth is checked along the branch in friction, and vice versa. Loads beyond `load`, which has no state,
    are not checked.
    """
    if further.depth >= load.depth and further.mu >= load.mu:
        return True
    shallower = further.depth < load.depth
    proof = friction_limit(scene, further, load.mu) if shallower else depth_limit(scene, further)
    return proof.is_certain


def _agrees(finger: FiniteFinger, state: EquilibriumState, proof: ContinuationLimit) -> bool:
    """Return whether a state agrees with the end of the branch on another mesh, and is not folded."""
    if is_folded(finger, state):
        return False
    change, force = finger.numbers([state])[0] - proof.numbers, proof.numbers[1:]
    size = np.array([proof.numbers[0], *[np.hypot(*force)] * 2])  # a drag without friction is round-off
    return bool(np.all(np.abs(change) <= AGREEMENT * size))


def slide_from_limited_skin(
    newton: Newton, load: LoadState, tolerance: float = TO_ROUND_OFF.tolerance
) -> EquilibriumState:
    """Return full slip from the frictionless state, with all its contact shear-limited under a growing bound.

    Under a low bound and a large mu, skin is shear-limited even at small pressures, so that slip is a bad first guess.
    Raises NotConverged.
    """
    frictionless = solve_full_slip(newton, load._replace(mu=0.0), None, tolerance)
    state = np.where(frictionless.touching, SHEAR_LIMITED, OPEN).astype(frictionless.state.dtype)
    return solve_full_slip(newton, load, replace(frictionless, state=state, load=load._replace(tau=0.0)), tolerance)
