"""The settled sliding state of a body that was handed in, where its mesh leads to it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver import _kernels as kernels
from solver.body.finite import FiniteBody
from solver.constitutive.hyperelastic import Law
from solver.contact.skin_compression import SkinCompression
from solver.continuation.arc_length import LARGEST_MU, continue_branch, jumped_branch
from solver.continuation.surface_instability import folds_at
from solver.equilibrium.full_slip import settled
from solver.equilibrium.newton import BY_FRICTION, EquilibriumState, LoadState, Newton
from solver.failures import NoSteadyState, NotConverged

CRUSHED = 0.3  # det F in a corner of what is held, below which the mesh ends the branch and not the body


def steady(
    whole: FiniteBody,
    load: LoadState,
    skin: Law,
    start: EquilibriumState | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> EquilibriumState:
    """Return the settled sliding state under `load`, followed on this mesh from the one without friction.

    That is sought from undeformed, or from `start`. `skin` is the law of what may fold. Raises NoSteadyState where the
    branch ends before, at a limit point or where the skin folds, with the largest friction as this mesh has it;
    NotConverged where it is lost before, which tells nothing of the body, or cannot be begun; Cancelled where `stop`
    says so.
    """
    newton = Newton(whole.condensed)
    body = _OwnBody(whole, newton)
    bare = settled(newton, load._replace(mu=0.0), start, stop=stop)
    branch = continue_branch(body, bare, BY_FRICTION, min(load.mu, LARGEST_MU), folds_at(skin), stop)
    where = f"at {load.depth:.4g} mm settled sliding was followed up to mu = {branch.value:.3g}"
    if branch.limited and (branch.lost or body.spoilt(branch.last)):
        raise NotConverged(f"{where} and lost there; whether there is any at mu = {load.mu:.3g} is not known")
    if branch.limited:
        raise NoSteadyState(f"{where}, where it ends on this mesh", limit_mu=branch.value)
    found = settled(newton, load, branch.last, stop=stop)
    if jumped_branch(body, branch.last, found):
        raise NotConverged(f"{where}, and beyond only with its skin folded")
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _OwnBody:
    """A body of which all skin is looked at that may touch."""

    body: FiniteBody
    newton: Newton

    def skin_compression(self, shape: EquilibriumState) -> SkinCompression:
        """Return how far the skin is squeezed, and whether it has a crease."""
        mesh, every = self.body.mesh, np.ones(len(shape.state) // 2, bool)
        return SkinCompression(*kernels.pinched(mesh.nodes, shape.u, mesh.skin, every, shape.state, 0))

    def crosses(self, shape: EquilibriumState) -> bool:
        """Return whether the skin crosses itself."""
        mesh = self.body.mesh
        return kernels.crosses(mesh.nodes, shape.u, mesh.skin)

    def spoilt(self, shape: EquilibriumState) -> bool:
        """Return whether contact has come to an end of the skin, or an element is crushed."""
        return bool(shape.touching[[0, -1]].any()) or self.body.smallest_det(shape.u) < CRUSHED
