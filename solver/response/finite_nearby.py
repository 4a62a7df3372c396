"""A settled slide at finite strain that was predicted, taken up again: `solver.response.nearby`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver import _kernels as kernels
from solver.arrays import Array
from solver.body.finite_measures import pressure
from solver.continuation.arc_length import jumped_branch
from solver.continuation.limit_point import sound
from solver.equilibrium import force_control as finite_forced
from solver.equilibrium import full_slip as sliding
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.newton import EquilibriumState, Given, Pull
from solver.failures import NotConverged
from solver.prediction import Prediction
from solver.response.derivatives import Derivatives
from solver.response.finite_derivatives import of_shape
from solver.response.nearby import states
from solver.scene import Scene

GOOD = 1e-8  # tolerance of the displacements [mm]: far less than a difference of friction that anybody could tell


def met_again(found: Prediction) -> "FiniteNearby | None":
    """Return the settled slide of `found` from what is kept of it, None where it is not met again."""
    finger, scene, skin = FiniteFinger.on(found.scene, found.geometry), found.scene, found.skin
    body, sense = finger.newton.body, -scene.loading.direction
    length = np.empty(len(skin.x))
    kernels.tributary(skin.x, body.middle, length)
    pull = Pull(found.indentation, float(scene.friction.mu), scene.friction.cap, sense)
    state = states(skin).astype(np.int32)
    reaction = np.stack([skin.traction, skin.pressure], axis=1) * length[:, None]
    modes = pressure(body, found.displacement)
    start = EquilibriumState(found.displacement, modes, state, np.full(len(state), sense, np.int32), reaction, pull, 0)
    try:
        return FiniteNearby(scene, finger, finger.newton.settle(start, pull))
    except NotConverged:
        return None


@dataclass(frozen=True, slots=True, eq=False)
class FiniteNearby:
    """A settled slide, and those beside it: the same branch of states, followed from here."""

    scene: Scene
    finger: FiniteFinger
    here: EquilibriumState

    def derivatives(self) -> Derivatives:
        """Return its derivatives, by the tangent at convergence."""
        return of_shape(self.finger, self.scene, self.here)

    def seds(self, scenes: Sequence[Scene]) -> Array:
        """Return the SED of ending and its middle (n, 2) [MPa] of scenes beside this one, nan where none settles."""
        found = [self._beside(scene) for scene in scenes]
        return np.array([(np.nan, np.nan) if shape is None else self.finger.seds(shape) for shape in found])

    def _beside(self, scene: Scene) -> EquilibriumState | None:
        newton, here = self.finger.newton, self.here
        pull = here.pull._replace(mu=float(scene.friction.mu), tau=scene.friction.cap)
        try:
            if scene.normal_force is None:
                there = sliding.settled(newton, pull._replace(depth=scene.loading.depth), here, GOOD)
            else:
                there = finite_forced.balanced(newton, replace(here, pull=pull), Given(scene.normal_force, None), GOOD)
        except NotConverged:
            return None
        reaches_out = (there.touching & ~here.touching)[[0, -1]].any()  # then skin may touch that nobody looked at
        beyond = there.pull.mu > here.pull.mu or there.pull.depth > here.pull.depth
        # Skin that may have folded since: whether the branch goes on as far as that, this mesh cannot tell.
        unproven = beyond and not sound(self.finger, there)
        return None if reaches_out or unproven or jumped_branch(self.finger, here, there) else there
