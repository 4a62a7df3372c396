"""A settled slide at finite strain that was predicted, taken up again: `solver.nearby`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver import finite_forced, kernels, kernels_numpy, sliding
from solver.contact import NAMES
from solver.derivatives import Derivatives
from solver.failures import NotConverged
from solver.finite_derivatives import of_shape
from solver.finite_finger import FiniteFinger
from solver.finite_forced import Given
from solver.limit import leapt
from solver.mesh import Array
from solver.newton import Pull, Shape
from solver.prediction import Prediction
from solver.scene import Scene

GOOD = 1e-8  # tolerance of the displacements [mm]: far less than a difference of friction that anybody could tell


class FiniteNearby:
    """A settled slide, and those beside it: the same branch of states, followed from here."""

    def __init__(self, found: Prediction) -> None:
        """Take up the slide of `found`."""
        self._scene = found.scene
        self._finger = FiniteFinger.on(found.scene, found.geometry)
        self._here = self._taken_up(found)

    def _taken_up(self, found: Prediction) -> Shape:
        """Return the state that was found, from what is kept of it."""
        newton, scene, skin = self._finger.newton, found.scene, found.skin
        body, sense = newton.body, -scene.loading.direction
        length = np.empty(len(skin.x))
        kernels.tributary(skin.x, body.middle, length)
        pull = Pull(found.indentation, float(scene.friction.mu), scene.friction.cap, sense)
        state = np.array([NAMES.index(name) for name in skin.state], np.int32)
        reaction = np.stack([skin.traction, skin.pressure], axis=1) * length[:, None]
        pressure = kernels_numpy.pressure(body, found.displacement)
        start = Shape(found.displacement, pressure, state, np.full(len(state), sense, np.int32), reaction, pull, 0)
        return newton.settle(start, pull)

    def derivatives(self) -> Derivatives:
        """Return its derivatives, by the tangent at convergence."""
        return of_shape(self._finger, self._scene, self._here)

    def seds(self, scenes: Sequence[Scene]) -> Array:
        """Return the ending's SED (n,) [MPa] of scenes beside this one, nan where there is no settled slide."""
        found = [self._beside(scene) for scene in scenes]
        return np.array([np.nan if shape is None else self._finger.sed_ending(shape) for shape in found])

    def _beside(self, scene: Scene) -> Shape | None:
        newton, here = self._finger.newton, self._here
        pull = here.pull._replace(mu=float(scene.friction.mu), tau=scene.friction.cap)
        try:
            if scene.normal_force is None:
                there = sliding.settled(newton, pull._replace(depth=scene.loading.depth), here, GOOD)
            else:
                there = finite_forced.balanced(newton, replace(here, pull=pull), Given(scene.normal_force, None), GOOD)
        except NotConverged:
            return None
        return None if leapt(newton, here, there, self._finger.geometry.whole) else there
