"""The settled state of a scene at small strain on one mesh, or why it has none and how far there would be one."""

from contextlib import suppress

from numpy.linalg import LinAlgError

from solver._kernels import STICK
from solver.continuation.small_states import followed_under, settled
from solver.continuation.wedging import continue_branch, limits
from solver.equilibrium.finger import LinearFinger, sliding_load
from solver.equilibrium.newton import EquilibriumState
from solver.failures import ContactLost, NoSteadyState, NotConverged
from solver.scene.scene import Scene


def direct(scene: Scene, finger: LinearFinger, times: float = 1.0) -> EquilibriumState:
    """Return the settled state; where it depends on its way, after so many `times` the usual load steps.

    Near a limit, or beyond it, guesses can end in states that no sliding leads to. Where none was found, or one that is
    folded, only what is reached by following the state from mu = 0 counts. Raises NoSteadyState, NotConverged.
    """
    direction = scene.loading.direction
    try:
        state = settled(scene, finger, times)
        on_way = direction == 0 or bool((state.state == STICK).any())
        if on_way or not _folded(finger, state):
            return state
        why = "the state found is folded"
    except ContactLost as lost:
        why = str(lost)
    if direction == 0:
        raise _no_answer(scene, why, 0.0)
    if scene.normal_force is None:
        reached, limit = continue_branch(finger.newton, sliding_load(scene))
    else:
        reached, limit = followed_under(scene, finger)
    if reached is None:
        raise _no_answer(scene, why, limit)
    return reached


def _folded(finger: LinearFinger, state: EquilibriumState) -> bool:
    """Return whether tissue is turned inside out somewhere, as in states that no sliding leads to."""
    return finger.body.smallest_det(finger.displacement(state)) <= 0.0


def _pressed(scene: Scene) -> str:
    """Say how hard or deep the finger is pressed."""
    force = scene.normal_force
    return f"{scene.loading.depth:g} mm indentation" if force is None else f"a normal force of {force:g} N/mm"


def _no_answer(scene: Scene, why: str, limit_mu: float) -> NoSteadyState | NotConverged:
    """Return the failure that says what is known."""
    mu = float(scene.friction.mu)
    at = f"{_pressed(scene)} and mu = {mu:g}"
    if scene.friction.tau_max is not None:
        at += f" with tau_max = {scene.friction.tau_max:g} MPa"
    if scene.loading.direction == 0 or limit_mu <= 0.0:
        return NotConverged(
            f"No settled state was found at {at}, from any first guess: {why}; ask for less friction or depth."
        )
    limit_force = limit_depth = None
    with suppress(LinAlgError, ContactLost):  # of stiffnesses that a mesh for less depth does not stand
        limit_force, limit_depth = limits(scene, sliding_load(scene))
    known = ((limit_force, "N/mm"), (limit_depth, "mm"))
    others = " and ".join(f"{limit:.3g} {unit}" for limit, unit in known if limit is not None)
    along = "+x" if scene.loading.direction > 0 else "-x"
    given = "at this depth" if scene.normal_force is None else "under this force"
    message = (
        f"There is no steady sliding along {along} at {at}: the drag presses the finger against the surface faster "
        f"than it yields, so it wedges; followed from mu = 0, steady sliding {given} ends at mu = {limit_mu:.3g}"
    )
    if others:
        message += f", and with this friction at {others}"
    return NoSteadyState(
        f"{message}.", limit_mu=limit_mu, limit_indentation=limit_depth, limit_normal_force=limit_force
    )
