"""The settled sliding state where there is one, and where there is none, how far there would be."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from solver import kernels
from solver.failures import NoSteadyState, NotConverged
from solver.kernels import CAP, OPEN
from solver.limit import largest_depth, largest_friction, leapt
from solver.mesh import Indices
from solver.newton import Newton, Pull, Shape
from solver.sliding import settled

SQUEEZED = " It folds before its limit point, at one place, and on finer meshes with up to a tenth less friction."
SOUND = 0.6  # least stretch of the skin that needs no proof: neo-Hookean surfaces fold from 0.544 on (Biot 1963)


def steady(
    newton: Newton,
    pull: Pull,
    outline: Indices,
    tolerance: float = 1e-10,
    start: Shape | None = None,
    stop: Callable[[], bool] = lambda: False,
    *,
    proven: bool = False,
) -> Shape:
    """Return the settled sliding state under `pull`, proven to lie on the branch that begins without friction.

    A state whose skin is squeezed so far that it might have folded, or that was not found directly, is approached by
    raising the friction coefficient along the branch. `outline` (o,) are the nodes of the whole skin in order; `start`
    a state nearby; where that is `proven`, so is what it leads to without a leap. Raises NoSteadyState with both limits
    where the branch ends before, NotConverged where it cannot be begun, Cancelled where `stop` says so.
    """
    for begin in dict.fromkeys((start, None)):  # where the nearby state leads nowhere, the undeformed one may
        try:
            shape = settled(newton, pull, begin, tolerance, stop)
        except NotConverged:
            continue
        if sound(newton, shape, outline) or (proven and begin is not None and not leapt(newton, begin, shape, outline)):
            return shape
    if pull.tau < np.inf:
        with suppress(NotConverged):
            shape = _all_at_the_bound(newton, pull, tolerance, stop)
            if sound(newton, shape, outline):
                return shape
    branch = largest_friction(newton, pull, outline, pull.mu, stop)
    if not branch.limited:
        return settled(newton, pull, branch.last, tolerance, stop)
    depth = None
    try:
        deepest = largest_depth(newton, pull, outline, stop)
    except NotConverged:
        beyond = ""
    else:
        depth = deepest.value
        beyond = f", and with this friction up to {depth:.3g} mm"
    raise NoSteadyState(
        f"At {pull.depth:.3g} mm of indentation there is settled sliding up to mu = {branch.value:.3g}{beyond}, but "
        f"not at mu = {pull.mu:.3g}: the skin behind the contact folds; ask for less depth, less friction or small "
        f"strain.{SQUEEZED if branch.squeezed else ''}",
        limit_mu=branch.value,
        limit_indentation=depth,
    )


def doubts(newton: Newton, shape: Shape, outline: Indices) -> tuple[str, ...]:
    """Return the sentence that a state needs whose skin is squeezed nearly as far as surfaces fold, or none."""
    least = kernels.squeezed(newton.body.mesh.nodes, shape.u, outline)
    if least >= SOUND:
        return ()
    return (
        f"The skin is squeezed to {100 * least:.0f} % of its length at one place, where neo-Hookean surfaces fold from "
        "54 % on: whether there is settled sliding here depends on the mesh, within a tenth of the friction.",
    )


def _all_at_the_bound(newton: Newton, pull: Pull, tolerance: float, stop: Callable[[], bool]) -> Shape:
    """Return the settled state begun where nothing rubs, all that touches there first thought to slip at the bound.

    A low bound with a large coefficient of friction is felt where hardly anything presses: there slip is a bad guess.
    Raises NotConverged.
    """
    bare = settled(newton, pull._replace(mu=0.0), None, tolerance, stop)
    state = np.where(bare.touching, CAP, OPEN).astype(bare.state.dtype)
    return settled(newton, pull, replace(bare, state=state, pull=pull), tolerance, stop)


def sound(newton: Newton, shape: Shape, outline: Indices) -> bool:
    """Return whether the skin is nowhere squeezed so far that it may have folded, and does not cross itself."""
    nodes = newton.body.mesh.nodes
    return kernels.squeezed(nodes, shape.u, outline) >= SOUND and not kernels.crosses(nodes, shape.u, outline)
