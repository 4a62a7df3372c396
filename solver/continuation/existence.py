"""Existence of the settled slide at finite strain: a proof for a state, or the limits of friction and depth.

Limits are found on meshes made for them. The branch is followed on a coarse mesh to near its end, which shows where the
skin is compressed most. Skin folds within some tenths of a millimetre, so the branch is continued on a mesh with small
elements there. `daq-app accuracy` measures the accuracy of these limits.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from solver._kernels.compiling import OPEN, SHEAR_LIMITED
from solver._kernels.contact_system import STEEP
from solver.arrays import Array
from solver.contact import LoadState
from solver.continuation import BRANCH, LARGEST_MU, Branch, Continuation, folds_at
from solver.equilibrium import BY_DEPTH, BY_FRICTION, EquilibriumState, Newton
from solver.equilibrium.finger import FiniteFinger, finite_laws
from solver.equilibrium.load_stepping import solve_full_slip
from solver.failures import NoSteadyState, NotConverged
from solver.mesh.mesher import EPIDERMIS, Sizing
from solver.scene import Scene
from solver.scene.tables import SHALLOW

FINENESS = 7.0  # elements to a tip radius of both meshes, except at a fold
_MARGIN = 6.0  # by the indentation: height of the undeformed skin up to which contact is considered


@dataclass(frozen=True, slots=True)
class ProofControl:
    """Which states need a proof, and which proof counts; least stretches of the skin, and fractions."""

    smooth: float = 0.66  # stretch above which states of the coarse mesh agree with those of the fine one
    sound: float = 0.65  # stretch of a state from which others may start: neo-Hookean surfaces fold at 0.54
    plain: float = 0.71  # stretch above which a state needs no proof: meshes just below a limit have up to 0.70
    astray: float = 0.5  # distance of the fold from its expected place for which the mesh is made anew [mm]
    starts: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01)  # fractions of the depth at which its branch may begin
    nearly: float = 0.02  # stretch above the folding one that counts as near a limit: some 2 % of the friction
    far: float = 0.9  # fraction of the given friction below which a limit is certain
    alike: float = 0.1  # relative difference of SED and forces below which states of two meshes are the same


PROOF = ProofControl()


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """The range of a branch of settled slides, from zero friction or from a small depth."""

    value: float  # friction coefficient or depth [mm] at its end: the target, or the largest
    limited: bool  # whether the branch ends there
    lost: bool  # whether only the corrector failed there, so that the branch may continue
    least: float  # least stretch of the skin at its last state [-]
    folds: float  # stretch at which it would fold [-]
    numbers: Array  # (3,) SED of the ending, normal and tangential force at its last state

    @property
    def ends(self) -> bool:
        """Whether the branch is known to end there."""
        return self.limited and not self.lost

    @property
    def near(self) -> bool:
        """Whether the last state lies near a limit."""
        return self.least < self.folds + PROOF.nearly


def of_friction(scene: Scene, load: LoadState, target: float) -> Reach:
    """Return the range of slides at the depth and bound of `load`, from mu = 0 to `target`.

    Raises NotConverged where not even the frictionless state is found, Cancelled.
    """
    return _reach(_Search(scene.frictionless_press(SHALLOW), load._replace(mu=0.0, travel=0.0), BY_FRICTION, target))


def of_depth(scene: Scene, load: LoadState) -> Reach:
    """Return the range of slides at the friction of `load`, from a small depth to that of `load`.

    Raises NotConverged where no slide is found even at a hundredth of that depth, Cancelled.
    """
    return _reach(_Search(scene.frictionless_press(SHALLOW), load._replace(travel=0.0), BY_DEPTH, load.depth))


def sound(finger: FiniteFinger, state: EquilibriumState, least: float = PROOF.sound) -> bool:
    """Return whether the skin is stretched to more than `least` everywhere, without a crease or self-contact."""
    compression = finger.skin_compression(state)
    return compression.lowest >= least and compression.kink <= BRANCH.crease and not finger.crosses(state)


def is_folded(finger: FiniteFinger, state: EquilibriumState) -> bool:
    """Return whether the skin has a crease or crosses itself."""
    return finger.skin_compression(state).kink > BRANCH.crease or finger.crosses(state)


@dataclass(frozen=True, slots=True)
class _Search:
    """A branch of settled slides to be followed on meshes made for it."""

    scene: Scene  # unloaded
    load: LoadState  # at the beginning of the branch by friction, at the end of one by depth
    parameter: int  # the parameter: BY_FRICTION or BY_DEPTH
    target: float  # its last value

    @property
    def folds(self) -> float:
        """The stretch at which the skin folds [-]."""
        return folds_at(finite_laws(self.scene.materials)[EPIDERMIS])

    def finger(self, fold: float | None = None) -> FiniteFinger:
        """Return the finger on a coarse mesh, or on one that is fine at the arc position of a `fold` [mm]."""
        return FiniteFinger.of(self.scene, Sizing(FINENESS, self.load.depth, margin=_MARGIN, fold=fold))

    @property
    def last(self) -> float:
        """The largest value to which the branch is followed; beyond LARGEST_MU the bound governs."""
        return self.target if self.parameter == BY_DEPTH else min(self.target, LARGEST_MU)

    def to(self, target: float) -> "_Search":
        """Return the search with another target."""
        return replace(self, target=target)

    def trace(self, finger: FiniteFinger, start: EquilibriumState, length: float | None = None) -> Branch:
        """Return the branch from `start` until it passes the target; its first step has the `length`."""
        return self._on(finger).trace(start, self.last, length)

    def _on(self, finger: FiniteFinger) -> Continuation:
        return Continuation(finger, self.parameter, self.folds)

    def stop(self, finger: FiniteFinger, branch: Branch) -> Branch:
        """Return a branch up to the target, which one step from LARGEST_MU reaches."""
        branch = self._on(finger).stop_at(branch, self.last)
        if branch.limited or self.last == self.target:
            return branch
        load = branch.last.load._replace(mu=self.target)
        last = solve_full_slip(finger.newton, load, branch.last, BRANCH.tolerance)
        return Branch((*branch.states, last), self.target, limited=False)

    def trace_on_fine_mesh(
        self, finger: FiniteFinger, states: tuple[EquilibriumState, ...]
    ) -> tuple[FiniteFinger, Branch, float]:
        """Return a finger that is fine where the last of `states` is compressed most, its branch, and that place."""
        place = _place_of_least_stretch(finger, states[-1])
        fine = self.finger(place)
        branch = self.trace(fine, self._start_on_fine_mesh(fine, finger, states))
        return fine, self.stop(fine, branch), place

    def start(self, finger: FiniteFinger) -> EquilibriumState:
        """Return the state at which the branch begins. Raises NotConverged."""
        if self.parameter == BY_FRICTION:
            return solve_full_slip(finger.newton, self.load, None, BRANCH.tolerance)
        for part in PROOF.starts:
            with suppress(NotConverged):
                load = self.load._replace(depth=part * self.target)
                start = solve_full_slip(finger.newton, load, None, BRANCH.tolerance)
                if sound(finger, start):
                    return start
        raise NotConverged(
            f"no sliding state was found at mu = {self.load.mu:.3g} even at {PROOF.starts[-1] * self.target:.3g} "
            "mm: ask for less friction"
        )

    def _start_on_fine_mesh(
        self, fine: FiniteFinger, rough: FiniteFinger, states: tuple[EquilibriumState, ...]
    ) -> EquilibriumState:
        """Return the state on the `fine` mesh of the last of `states` that the `rough` mesh resolves."""
        for state in reversed(states):
            if rough.skin_compression(state).lowest < PROOF.smooth:
                continue
            with suppress(NotConverged):
                start = solve_full_slip(fine.newton, state.load, fine.transfer(state, rough), BRANCH.tolerance)
                if sound(fine, start) or state is states[0]:
                    return start
        return self.start(fine)


PIECES = (LARGEST_MU / 8.0, LARGEST_MU / 4.0, LARGEST_MU / 2.0, LARGEST_MU)  # ends of pieces of branches in friction


@lru_cache(maxsize=32)
def _coarse_branch(search: _Search) -> Branch:
    """Return the branch of a search on its coarse mesh; in friction its target is one of PIECES.

    It is cached, because all friction coefficients of a scene share it.
    """
    finger = search.finger()
    if search.parameter == BY_DEPTH or search.target == PIECES[0]:
        return search.trace(finger, search.start(finger))
    before = _coarse_branch(search.to(search.target / 2.0))
    if before.limited:
        return before
    after = search.trace(finger, before.last, before.length)
    return replace(after, states=(*before.states, *after.states[1:]))


@lru_cache(maxsize=32)
def _reach(search: _Search) -> Reach:
    """Return the range of a branch, cached because all meshes of a scene need the same."""
    by_depth = search.parameter == BY_DEPTH
    coarse = _coarse_branch(search if by_depth else search.to(min(end for end in PIECES if end >= search.last)))
    if coarse.value < search.last < LARGEST_MU and not by_depth:
        end = _reach(search.to(LARGEST_MU))
        if end.limited and end.value < search.target:
            return end
    finger = search.finger()
    branch = search.stop(finger, coarse)
    if branch.limited or not sound(finger, branch.last, PROOF.plain):
        finger, branch, place = search.trace_on_fine_mesh(finger, branch.states)
        if abs(_place_of_least_stretch(finger, branch.last) - place) > PROOF.astray:
            finger, branch, _ = search.trace_on_fine_mesh(finger, branch.states)
    least = finger.skin_compression(branch.last).least
    numbers = finger.numbers([branch.last])[0]
    return Reach(float(branch.value), branch.limited, branch.lost, least, search.folds, numbers)


def _place_of_least_stretch(finger: FiniteFinger, state: EquilibriumState) -> float:
    """Return the arc position of the least stretch of the skin [mm]."""
    place = finger.skin_compression(state).place
    return float(finger.geometry.arcs[place : place + 2].mean())


BEYOND_LIMIT = 0.06  # relative distance beyond a limit at which another path is tried: twice the 3 % accuracy of limits


def steady(
    finger: FiniteFinger, load: LoadState, tolerance: float = 1e-10, start: EquilibriumState | None = None
) -> EquilibriumState:
    """Return the settled slide under `load` that lies on the branch from the frictionless state.

    The search begins at `start`. A state whose skin might have folded, or that is not found directly, is proven by
    following the branch on meshes made for it. Raises NoSteadyState with both limits where the branch ends before,
    NotConverged where it has no first state, Cancelled.
    """
    candidates: list[EquilibriumState] = []
    for state in _direct_states(finger.newton, load, tolerance, start):
        if sound(finger, state, PROOF.plain):
            return state
        candidates.append(state)
    proof = _reach_towards(finger.scene, load)
    if proof.lost:
        raise _undecided(load, proof.value)
    if proof.limited:
        raise _refusal(finger.scene, load, proof)
    for state in candidates:
        if _proven(finger, state, proof):
            return state
    if steep(load):
        raise NotConverged(
            f"At {load.depth:.3g} mm of indentation there is settled sliding at mu = {load.mu:.3g}, nearly all of the "
            "skin slipping at the bound, and this mesh does not find it: another tolerance has another mesh"
        )
    begin = solve_full_slip(finger.newton, load._replace(mu=0.0), None, tolerance)
    branch = Continuation(finger, BY_FRICTION, 0.0).trace(begin, load.mu)
    if not branch.limited:
        state = solve_full_slip(finger.newton, load, branch.last, tolerance)
        if _proven(finger, state, proof):
            return state
    raise NotConverged(
        f"At {load.depth:.3g} mm of indentation and mu = {load.mu:.3g} there is settled sliding, but near the limit of "
        "friction, and this mesh does not find it: ask for a little less friction, or another tolerance"
    )


def stands(finger: FiniteFinger, state: EquilibriumState) -> bool:
    """Return whether a state lies on the branch from the frictionless state, where need be by following that."""
    if sound(finger, state, PROOF.plain):
        return True
    if not sound(finger, state):
        return False
    proof = _reach_towards(finger.scene, state.load)
    return not proof.limited and _proven(finger, state, proof)


def steep(load: LoadState) -> bool:
    """Return whether mu is so large that nearly all skin in contact is shear-limited."""
    return load.mu > STEEP and load.tau < np.inf


def refuse_far_beyond(scene: Scene, load: LoadState) -> None:
    """Raise NoSteadyState where the branch ends far below the friction of `load`.

    For a coarse mesh without a state, or with folded skin: a failing fine mesh costs more than following the branch.
    Nothing is raised where the branch ends so near that another mesh may have the state.
    """
    with suppress(NotConverged):
        proof = _reach_towards(scene, load)
        if proof.ends and proof.value < PROOF.far * load.mu:
            raise _refusal(scene, load, proof)


def _direct_states(
    newton: Newton, load: LoadState, tolerance: float, start: EquilibriumState | None
) -> Iterator[EquilibriumState]:
    """Yield the states found directly from `start`, from the undeformed state, and from shear-limited skin.

    Where friction is `steep`, the undeformed state leads to no further state.
    """
    ways: list[Callable[[], EquilibriumState]] = []
    if not steep(load):
        ways.append(lambda: solve_full_slip(newton, load, None, tolerance))
    if load.tau < np.inf:
        ways.append(lambda: all_at_the_bound(newton, load, tolerance))
    if start is not None:
        ways.insert(0, lambda: solve_full_slip(newton, load, start, tolerance))
    for search in ways:
        with suppress(NotConverged):
            yield search()


def doubts(finger: FiniteFinger, state: EquilibriumState) -> tuple[str, ...]:
    """Return a warning for a settled slide near the limit of friction, else nothing."""
    if state.load.sense == 0 or sound(finger, state, PROOF.plain):
        return ()
    proof = of_friction(finger.scene, state.load, state.load.mu)
    if not proof.near:
        return ()
    return (
        f"The skin is squeezed to {100 * proof.least:.0f} % of its length at one place and folds at "
        f"{100 * proof.folds:.0f} %: this is within some 2 % of the largest friction with settled sliding, which is "
        "known as well.",
    )


def _reach_towards(scene: Scene, load: LoadState) -> Reach:
    """Return the range of the branch by friction, or by depth where only that reaches `load`.

    Where nearly all skin is shear-limited, states hardly depend on mu, so that its limit is ill-conditioned.
    """
    proof = of_friction(scene, load, load.mu)
    if proof.limited:
        with suppress(NotConverged):
            deepest = of_depth(scene, load)
            return proof if deepest.limited else deepest
    return proof


def _refusal(scene: Scene, load: LoadState, proof: Reach) -> NoSteadyState | NotConverged:
    """Return the failure with both limits, each only where no state lies a little beyond it."""
    largest, depth = proof.value, None
    if not _none_at(scene, load._replace(mu=(1.0 + BEYOND_LIMIT) * largest), load):
        return _undecided(load, largest)
    ends = (
        "the skin behind the contact folds"
        if proof.near or all(tissue.law != "ogden" for tissue in scene.materials.by_region)
        else f"friction is largest there, with the skin behind the contact squeezed to {100 * proof.least:.0f} %"
    )
    beyond = ""
    with suppress(NotConverged):
        deepest = of_depth(scene, load)
        further = load._replace(depth=(1.0 + BEYOND_LIMIT) * deepest.value)
        if deepest.ends and _none_at(scene, further, load):
            depth = deepest.value
            beyond = f", and with this friction up to {depth:.4g} mm"
    return NoSteadyState(
        f"At {load.depth:.4g} mm of indentation there is settled sliding up to mu = {largest:.3g}{beyond}, but "
        f"not at mu = {load.mu:.3g}: {ends}; ask for less depth, less friction or small strain.",
        limit_mu=largest,
        limit_indentation=depth,
    )


def _undecided(load: LoadState, largest: float) -> NotConverged:
    return NotConverged(
        f"At {load.depth:.3g} mm of indentation settled sliding was followed up to mu = {largest:.3g} and lost "
        f"there; whether there is any at mu = {load.mu:.3g} is not known: ask for less friction or depth"
    )


def _none_at(scene: Scene, further: LoadState, load: LoadState) -> bool:
    """Return whether `further`, a little beyond a limit, has no state along the other parameter's branch.

    A limit of depth is checked by friction, a limit of friction by depth. Nothing is checked beyond `load`, which has
    no state.
    """
    if further.depth >= load.depth and further.mu >= load.mu:
        return True
    shallower = further.depth < load.depth
    proof = of_friction(scene, further, load.mu) if shallower else of_depth(scene, further)
    return proof.ends


def _proven(finger: FiniteFinger, state: EquilibriumState, proof: Reach) -> bool:
    """Return whether a state agrees with the end of the branch on another mesh, and is not folded."""
    if is_folded(finger, state):
        return False
    return bool(np.all(np.abs(finger.numbers([state])[0] - proof.numbers) <= PROOF.alike * np.abs(proof.numbers)))


def all_at_the_bound(newton: Newton, load: LoadState, tolerance: float) -> EquilibriumState:
    """Return the settled slide from the frictionless one, with all its contact shear-limited and a growing bound.

    Under a low bound and a large mu, skin is shear-limited at small pressures, so that slip is a bad first guess.
    Raises NotConverged.
    """
    bare = solve_full_slip(newton, load._replace(mu=0.0), None, tolerance)
    state = np.where(bare.touching, SHEAR_LIMITED, OPEN).astype(bare.state.dtype)
    return solve_full_slip(newton, load, replace(bare, state=state, load=load._replace(tau=0.0)), tolerance)
