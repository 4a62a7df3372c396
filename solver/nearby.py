"""A settled slide that was predicted, taken up again: its derivatives, and the SED of slides beside it.

It goes on where the prediction stopped, on the same mesh and from the same state, without all else that a prediction
carries: a state beside it costs a few small systems, and its SED differs for its friction alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from solver.contact import NAMES, OPEN, Contact, ContactLost, Course, States, forced
from solver.derivatives import Derivatives, of_contact
from solver.finger import FingerModel
from solver.mesh import Array
from solver.prediction import Prediction
from solver.scene import Scene
from solver.small_states import law_of


class Nearby(Protocol):
    """A settled slide, and those beside it."""

    def derivatives(self) -> Derivatives:
        """Return its derivatives, by the tangent at convergence."""
        ...

    def seds(self, scenes: Sequence[Scene]) -> Array:
        """Return the ending's SED (n,) [MPa] of scenes that differ from its own in friction, depth or force alone.

        nan where no settled slide is found beside this one; how far there would be one is not looked for.
        """
        ...


def nearby(predictions: Sequence[Prediction], *, in_loops: bool = False) -> Iterator[Nearby | None]:
    """Yield the slide of each prediction, None where its finger does not slide and its state depends on the way to it.

    `in_loops` as in `solver.solution.answers`. Each is done with when the next is asked for: they may share memory.
    """
    model: FingerModel | None = None
    for found in predictions:
        scene = found.scene
        if scene.loading.direction == 0 or found.shift is not None or "stick" in found.skin.state:
            yield None
        elif scene.solve.kinematics == "finite":
            # Imported here: small strain need not wait for the compiled loops to be loaded.
            from solver.finite_nearby import FiniteNearby

            yield FiniteNearby(found)
        else:
            if model is None or model.geometry is not found.geometry:
                model = FingerModel.on(scene, found.geometry, in_loops=in_loops)
            yield _SmallNearby(found, model)


@dataclass(frozen=True, eq=False)  # without slots: what few ask for is made when they ask
class _SmallNearby:
    found: Prediction
    finger: FingerModel

    def derivatives(self) -> Derivatives:
        return of_contact(self.finger, self.found.scene, self._slide(self.found.scene))

    def seds(self, scenes: Sequence[Scene]) -> Array:
        out, here = np.full(len(scenes), np.nan), self._guess != OPEN
        held: list[tuple[int, Contact]] = []
        for number, scene in enumerate(scenes):
            try:
                contact = self._slide(scene)
            except ContactLost:
                continue
            ends = contact.touching[[0, -1]] & ~here[[0, -1]]  # it may touch beyond the skin that was looked at
            if not ends.any():
                held.append((number, contact))
        if held:
            out[[number for number, _ in held]] = self.finger.sed_endings([contact for _, contact in held])
        return out

    @cached_property
    def _guess(self) -> States:
        return np.array([NAMES.index(state) for state in self.found.skin.state], np.int8)

    def _slide(self, scene: Scene) -> Contact:
        """Return the slide of a scene, its points first thought to do what they do here. Raises ContactLost."""
        touch, law, direction = self.finger.body.touchable, law_of(scene), scene.loading.direction
        if scene.normal_force is None:
            return Course(touch, law).sliding(scene.loading.depth, direction, self._guess)
        return Course(forced(touch, scene.normal_force), law).sliding(0.0, direction, self._guess)
