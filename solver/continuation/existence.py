"""Existence of full slip at finite strain: a proof for a state, or a refusal with its limits of friction and depth.

For a limit a branch is followed on a coarse mesh almost to its end, which shows where the skin is compressed most. A
fold spans some tenths of a millimetre, so the branch is continued on a mesh with small elements there. `daq-app
accuracy` measures the accuracy of these limits.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from solver.arrays import Array
from solver.contact import LoadState
from solver.continuation import BRANCH, LARGEST_MU, Branch, Continuation, critical_stretch
from solver.equilibrium import BY_DEPTH, BY_FRICTION, EquilibriumState, Newton
from solver.equilibrium.finger import FiniteFinger, finite_laws
from solver.equilibrium.load_stepping import slide_from_limited_skin, solve_full_slip
from solver.failures import NoSteadyState, NotConverged
from solver.mesh.mesher import EPIDERMIS, Sizing
from solver.scene import Scene
from solver.scene.tables import SHALLOW

FINENESS = 7.0  # elements per tip radius of both meshes, except at a fold
_MARGIN = 6.0  # `Sizing.margin`: undeformed skin lower than 2.5 times the indentation may touch
CERTAIN_SHARE = 0.9  # fraction of the given friction or depth below which a limit is certain
AGREEMENT = 0.1  # relative difference of SED and forces below which states of two meshes are the same
BEYOND_LIMIT = 0.06  # relative distance beyond a limit at which another path is tried: twice the 3 % accuracy of limits


@dataclass(frozen=True, slots=True)
class LimitControl:
    """Criteria for states that begin or end a branch: least stretches of the skin, and fractions."""

    resolved_stretch: float = 0.66  # above it, states of the coarse mesh agree with those of the fine one
    sound_stretch: float = 0.65  # from it, other states may start here: neo-Hookean surfaces fold at 0.54
    safe_stretch: float = 0.71  # above it, a state needs no proof: states just below a limit have up to 0.70
    max_fold_shift: float = 0.1  # from its expected place, relative to the tip radius: beyond it, another mesh is made
    start_fractions: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01)  # of the target depth, at which a branch may begin
    near_fold: float = 0.02  # above the critical stretch: some 2 % of the friction


LIMIT = LimitControl()


def is_sound(finger: FiniteFinger, state: EquilibriumState, least: float = LIMIT.sound_stretch) -> bool:
    """Return whether the skin is stretched to more than `least` everywhere, without a crease or self-contact."""
    compression = finger.skin_compression(state)
    return compression.least_stretch >= least and compression.kink <= BRANCH.max_kink and not finger.crosses(state)


def is_folded(finger: FiniteFinger, state: EquilibriumState) -> bool:
    """Return whether the skin has a crease or crosses itself."""
    return finger.skin_compression(state).kink > BRANCH.max_kink or finger.crosses(state)


@dataclass(frozen=True, slots=True)
class BranchSearch:
    """A branch of full slip to be followed on meshes made for it."""

    scene: Scene  # unloaded
    load: LoadState  # at the beginning of a branch in friction, at the end of a branch in depth
    parameter: int  # BY_FRICTION or BY_DEPTH
    target: float  # last value of the parameter

    @property
    def critical_stretch(self) -> float:
        """The stretch at which the skin folds [-]."""
        return critical_stretch(finite_laws(self.scene.materials)[EPIDERMIS])

    def finger(self, fold: float | None = None) -> FiniteFinger:
        """Return the finger on a coarse mesh, or on one that is fine at the arc position of a `fold` [mm]."""
        return FiniteFinger.of(self.scene, Sizing(FINENESS, self.load.depth, margin=_MARGIN, fold=fold))

    @property
    def last(self) -> float:
        """The largest value to which the branch is followed; beyond LARGEST_MU the traction bound governs."""
        return self.target if self.parameter == BY_DEPTH else min(self.target, LARGEST_MU)

    def trace(self, finger: FiniteFinger, start: EquilibriumState, length: float | None = None) -> Branch:
        """Return the branch from `start` until it passes the target; `length` is that of its first step."""
        return Continuation(finger, self.parameter, self.critical_stretch).trace(start, self.last, length)

    def stop(self, finger: FiniteFinger, branch: Branch) -> Branch:
        """Return a branch up to the target, which one step from LARGEST_MU reaches."""
        branch = Continuation(finger, self.parameter, self.critical_stretch).stop_at(branch, self.last)
        if branch.ends_early or self.last == self.target:
            return branch
        load = branch.last.load._replace(mu=self.target)
        last = solve_full_slip(finger.newton, load, branch.last, BRANCH.tolerance)
        return Branch((*branch.states, last), self.target, ends_early=False)

    def trace_on_fine_mesh(self, finger: FiniteFinger, rough: Branch) -> tuple[FiniteFinger, Branch, float]:
        """Return a finger with a fine mesh where a `rough` branch ends most compressed, its branch and that place."""
        place = _place_of_least_stretch(finger, rough.last)
        fine = self.finger(place)
        branch = self.trace(fine, self._start_on_fine_mesh(fine, finger, rough.states))
        return fine, self.stop(fine, branch), place

    def start(self, finger: FiniteFinger) -> EquilibriumState:
        """Return the state at which the branch begins. Raises NotConverged."""
        if self.parameter == BY_FRICTION:
            return solve_full_slip(finger.newton, self.load, None, BRANCH.tolerance)
        for part in LIMIT.start_fractions:
            with suppress(NotConverged):
                load = self.load._replace(depth=part * self.target)
                start = solve_full_slip(finger.newton, load, None, BRANCH.tolerance)
                if is_sound(finger, start):
                    return start
        raise NotConverged(
            f"no sliding state was found at mu = {self.load.mu:.3g} even at "
            f"{LIMIT.start_fractions[-1] * self.target:.3g} mm: ask for less friction"
        )

    def _start_on_fine_mesh(
        self, fine: FiniteFinger, rough: FiniteFinger, states: tuple[EquilibriumState, ...]
    ) -> EquilibriumState:
        """Return, on the `fine` mesh, the last of the `states` that the `rough` mesh resolves."""
        for state in reversed(states):
            if rough.skin_compression(state).least_stretch < LIMIT.resolved_stretch:
                continue
            with suppress(NotConverged):
                start = solve_full_slip(fine.newton, state.load, fine.transfer(state, rough), BRANCH.tolerance)
                if is_sound(fine, start) or state is states[0]:
                    return start
        return self.start(fine)


@dataclass(frozen=True, slots=True, eq=False)
class ContinuationLimit:
    """The range of a branch of full slip, from zero friction or from a small depth."""

    search: BranchSearch
    value: float  # friction coefficient or depth [mm] at its end: the target, or the largest value
    ends_early: bool  # whether the branch ends before its target
    corrector_failed: bool  # whether only the corrector failed, so that the branch may continue
    least_stretch: float  # least stretch of the skin at the last state [-]
    numbers: Array  # (3,) SED of the ending, normal and tangential force at the last state

    @property
    def is_certain(self) -> bool:
        """Whether the branch is known to end there."""
        return self.ends_early and not self.corrector_failed

    @property
    def is_near_fold(self) -> bool:
        """Whether the last state lies near a limit."""
        return self.least_stretch < self.search.critical_stretch + LIMIT.near_fold

    @property
    def by_depth(self) -> bool:
        """Whether the branch is followed in depth."""
        return self.search.parameter == BY_DEPTH


def friction_limit(scene: Scene, load: LoadState, target: float) -> ContinuationLimit:
    """Return the range of full slip at the depth and bound of `load`, from mu = 0 to `target`.

    Raises NotConverged where no frictionless state is found, Cancelled.
    """
    return _continuation_limit(
        BranchSearch(scene.frictionless_press(SHALLOW), load._replace(mu=0.0, travel=0.0), BY_FRICTION, target)
    )


def depth_limit(scene: Scene, load: LoadState) -> ContinuationLimit:
    """Return the range of full slip at the friction of `load`, from a small depth to that of `load`.

    Raises NotConverged where no state is found even at a hundredth of that depth, Cancelled.
    """
    return _continuation_limit(
        BranchSearch(scene.frictionless_press(SHALLOW), load._replace(travel=0.0), BY_DEPTH, load.depth)
    )


PIECES = (LARGEST_MU / 8.0, LARGEST_MU / 4.0, LARGEST_MU / 2.0, LARGEST_MU)  # ends of pieces of branches in friction


@lru_cache(maxsize=32)
def _coarse_branch(search: BranchSearch) -> Branch:
    """Return the branch of a search on its coarse mesh; in friction its target is one of PIECES.

    It is cached, because all friction coefficients of a scene share it.
    """
    finger = search.finger()
    if search.parameter == BY_DEPTH or search.target == PIECES[0]:
        return search.trace(finger, search.start(finger))
    before = _coarse_branch(replace(search, target=search.target / 2.0))
    if before.ends_early:
        return before
    after = search.trace(finger, before.last, before.length)
    return replace(after, states=(*before.states, *after.states[1:]))


@lru_cache(maxsize=32)
def _continuation_limit(search: BranchSearch) -> ContinuationLimit:
    """Return the range of a branch, cached because all meshes of a scene need it."""
    by_depth = search.parameter == BY_DEPTH
    whole = search if by_depth else replace(search, target=min(end for end in PIECES if end >= search.last))
    coarse = _coarse_branch(whole)
    if coarse.value < search.last < LARGEST_MU and not by_depth:
        end = _continuation_limit(replace(search, target=LARGEST_MU))
        if end.ends_early and end.value < search.target:
            return end
    finger = search.finger()
    branch = search.stop(finger, coarse)
    if branch.ends_early or not is_sound(finger, branch.last, LIMIT.safe_stretch):
        finger, branch, place = search.trace_on_fine_mesh(finger, branch)
        shift = abs(_place_of_least_stretch(finger, branch.last) - place)
        if shift > LIMIT.max_fold_shift * search.scene.finger.tip_radius:
            finger, branch, _ = search.trace_on_fine_mesh(finger, branch)
    least = finger.skin_compression(branch.last).least_chord
    numbers = finger.numbers([branch.last])[0]
    return ContinuationLimit(search, float(branch.value), branch.ends_early, branch.corrector_failed, least, numbers)


def _place_of_least_stretch(finger: FiniteFinger, state: EquilibriumState) -> float:
    """Return the arc position of the least stretch of the skin [mm]."""
    place = finger.skin_compression(state).element
    return float(finger.geometry.arcs[place : place + 2].mean())


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
    if load.mostly_shear_limited:
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
    ways = (
        (start is not None, lambda: solve_full_slip(newton, load, start)),
        (not load.mostly_shear_limited, lambda: solve_full_slip(newton, load)),
        (load.tau < np.inf, lambda: slide_from_limited_skin(newton, load)),
    )
    for search in (search for applies, search in ways if applies):
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
    there, end, here = f"{load.depth:.3g} mm of indentation", f"mu = {proof.value:.3g}", f"mu = {load.mu:.3g}"
    if proof.by_depth:
        there, end, here = here, f"{proof.value:.3g} mm of indentation", there
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
