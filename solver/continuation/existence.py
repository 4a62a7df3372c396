"""The settled sliding state where there is one, and where there is none, how far there would be."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from solver._kernels import OPEN, SHEAR_LIMITED, STEEP
from solver.continuation import limit_point as reach
from solver.continuation.arc_length import follow
from solver.continuation.limit_point import PLAIN, Reach, folded, sound
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.full_slip import settled
from solver.equilibrium.newton import BY_FRICTION, EquilibriumState, LoadState, Newton
from solver.failures import NoSteadyState, NotConverged
from solver.scene.scene import Scene

FAR = 0.9  # of the friction asked for, below which a limit is beyond doubt
APART = 0.06  # of a limit, which a mesh has to 3 %: so much beyond it another path must end before it arrives [-]
ALIKE = 0.1  # relative difference of SED and forces within which a state is that of another mesh


def steady(
    finger: FiniteFinger,
    load: LoadState,
    tolerance: float = 1e-10,
    start: EquilibriumState | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> EquilibriumState:
    """Return the settled sliding state under `load`, proven to lie on the branch that begins without friction.

    A state, sought from `start` first, whose skin is squeezed so far that it might have folded, or that is not found
    directly, is proven by following the branch on meshes made for it (`limit_point`). Raises NoSteadyState with both
    limits where the branch ends before, NotConverged where it cannot be begun, Cancelled where `stop` says so.
    """
    found: list[EquilibriumState] = []
    for shape in _tried(finger.newton, load, tolerance, start, stop):
        if sound(finger, shape, PLAIN):
            return shape
        found.append(shape)
    proof = _followed(finger.scene, load, stop)
    if proof.lost:
        raise _not_known(load, proof.value)
    if proof.limited:
        raise _refused(finger.scene, load, proof, stop)
    for shape in found:
        if _proven(finger, shape, proof):
            return shape
    if steep(load):
        raise NotConverged(
            f"At {load.depth:.3g} mm of indentation there is settled sliding at mu = {load.mu:.3g}, nearly all of the "
            "skin slipping at the bound, and this mesh does not find it: another tolerance has another mesh"
        )
    begin = settled(finger.newton, load._replace(mu=0.0), None, tolerance, stop)
    branch = follow(finger, begin, BY_FRICTION, load.mu, 0.0, stop)
    if not branch.limited:
        shape = settled(finger.newton, load, branch.last, tolerance, stop)
        if _proven(finger, shape, proof):
            return shape
    raise NotConverged(
        f"At {load.depth:.3g} mm of indentation and mu = {load.mu:.3g} there is settled sliding, but near the limit of "
        "friction, and this mesh does not find it: ask for a little less friction, or another tolerance"
    )


def stands(finger: FiniteFinger, shape: EquilibriumState, stop: Callable[[], bool]) -> bool:
    """Return whether a state lies on the branch that begins without friction: plainly, or since that was followed."""
    if sound(finger, shape, PLAIN):
        return True
    if not sound(finger, shape):
        return False
    proof = _followed(finger.scene, shape.load, stop)
    return not proof.limited and _proven(finger, shape, proof)


def steep(load: LoadState) -> bool:
    """Return whether friction is so steep that nearly all of the skin slips at a bound."""
    return load.mu > STEEP and load.tau < np.inf


def refuse_far_beyond(scene: Scene, load: LoadState, stop: Callable[[], bool]) -> None:
    """Raise NoSteadyState where the branch ends far below the friction of `load`.

    Asked where a rough mesh finds nothing, or skin that has folded: to see a fine mesh fail takes longer than to follow
    the branch. Nothing is raised where it goes on, or ends so near that another mesh may have the state, or where
    friction is so steep that the bound decides.
    """
    if load.mu > STEEP:
        return
    with suppress(NotConverged):
        proof = _followed(scene, load, stop)
        if proof.limited and not proof.lost and proof.value < FAR * load.mu:
            raise _refused(scene, load, proof, stop)


def _tried(
    newton: Newton, load: LoadState, tolerance: float, start: EquilibriumState | None, stop: Callable[[], bool]
) -> Iterator[EquilibriumState]:
    """Yield the states found directly: from `start`, from undeformed, and from all skin slipping at the bound.

    Where friction is steep, so that nearly all skin slips at the bound, undeformed leads nowhere that this does not.
    """
    ways: list[Callable[[], EquilibriumState]] = []
    if not steep(load):
        ways.append(lambda: settled(newton, load, None, tolerance, stop))
    if load.tau < np.inf:
        ways.append(lambda: all_at_the_bound(newton, load, tolerance, stop))
    if start is not None:
        ways.insert(0, lambda: settled(newton, load, start, tolerance, stop))
    for way in ways:
        with suppress(NotConverged):
            yield way()


def doubts(finger: FiniteFinger, shape: EquilibriumState, stop: Callable[[], bool] = lambda: False) -> tuple[str, ...]:
    """Return the sentence that a settled slide needs whose friction is as large as may be, or none."""
    if shape.load.sense == 0 or sound(finger, shape, PLAIN):
        return ()
    proof = reach.of_friction(finger.scene, shape.load, shape.load.mu, stop)
    if not proof.near:
        return ()
    return (
        f"The skin is squeezed to {100 * proof.least:.0f} % of its length at one place and folds at "
        f"{100 * proof.folds:.0f} %: this is within some 2 % of the largest friction with settled sliding, which is "
        "known as well.",
    )


def _followed(scene: Scene, load: LoadState, stop: Callable[[], bool]) -> Reach:
    """Return how far the branch goes as friction grows, or as depth does where that alone leads to what `load` asks.

    Where nearly all skin slips at a bound the coefficient hardly matters, and how far it may grow is hardly known.
    """
    proof = reach.of_friction(scene, load, load.mu, stop)
    if proof.limited:
        with suppress(NotConverged):
            deepest = reach.of_depth(scene, load, stop)
            return proof if deepest.limited else deepest
    return proof


def _refused(scene: Scene, load: LoadState, proof: Reach, stop: Callable[[], bool]) -> NoSteadyState | NotConverged:
    """Return why there is no state: with both limits, each only where no state lies a little beyond it."""
    largest, depth = proof.value, None
    if not _none_at(scene, load._replace(mu=(1.0 + APART) * largest), load, stop):
        return _not_known(load, largest)
    ends = (
        "the skin behind the contact folds"
        if proof.near or all(tissue.law != "ogden" for tissue in scene.materials.by_region)
        else f"friction is largest there, with the skin behind the contact squeezed to {100 * proof.least:.0f} %"
    )
    beyond = ""
    with suppress(NotConverged):
        deepest = reach.of_depth(scene, load, stop)
        further = load._replace(depth=(1.0 + APART) * deepest.value)
        if deepest.limited and not deepest.lost and _none_at(scene, further, load, stop):
            depth = deepest.value
            beyond = f", and with this friction up to {depth:.4g} mm"
    return NoSteadyState(
        f"At {load.depth:.4g} mm of indentation there is settled sliding up to mu = {largest:.3g}{beyond}, but "
        f"not at mu = {load.mu:.3g}: {ends}; ask for less depth, less friction or small strain.",
        limit_mu=largest,
        limit_indentation=depth,
    )


def _not_known(load: LoadState, largest: float) -> NotConverged:
    return NotConverged(
        f"At {load.depth:.3g} mm of indentation settled sliding was followed up to mu = {largest:.3g} and lost "
        f"there; whether there is any at mu = {load.mu:.3g} is not known: ask for less friction or depth"
    )


def _none_at(scene: Scene, further: LoadState, load: LoadState, stop: Callable[[], bool]) -> bool:
    """Return whether `further`, a little beyond a limit, has no state by the path that did not find the limit.

    A limit of depth is looked at along friction, one of friction along depth. Beyond `load` nothing is looked at: it is
    what has no state.
    """
    if further.depth >= load.depth and further.mu >= load.mu:
        return True
    if further.depth < load.depth:
        proof = reach.of_friction(scene, further, load.mu, stop)
    else:
        proof = reach.of_depth(scene, further, stop)
    return proof.limited and not proof.lost


def _proven(finger: FiniteFinger, shape: EquilibriumState, proof: Reach) -> bool:
    """Return whether a state is the one that was reached along the branch on another mesh, and not a folded one."""
    if folded(finger, shape):
        return False
    return bool(np.all(np.abs(finger.numbers([shape])[0] - proof.numbers) <= ALIKE * np.abs(proof.numbers)))


def all_at_the_bound(newton: Newton, load: LoadState, tolerance: float, stop: Callable[[], bool]) -> EquilibriumState:
    """Return the settled state begun where nothing rubs, all that touches there slipping at a bound that grows.

    A low bound with a large coefficient of friction is felt where hardly anything presses: there slip is a bad guess.
    Raises NotConverged.
    """
    bare = settled(newton, load._replace(mu=0.0), None, tolerance, stop)
    state = np.where(bare.touching, SHEAR_LIMITED, OPEN).astype(bare.state.dtype)
    return settled(newton, load, replace(bare, state=state, load=load._replace(tau=0.0)), tolerance, stop)
