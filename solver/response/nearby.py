"""A settled slide that was predicted, taken up again: its derivatives, and the SED of slides beside it.

It goes on where the prediction stopped, on the same mesh and from the same state, without all else that a prediction
carries: a state beside it costs a few small systems, and its SED differs for its friction alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from solver._kernels import SLIP
from solver.arrays import Array
from solver.contact.law import NAMES
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.full_slip import slide_beside
from solver.equilibrium.loads import sliding_pull
from solver.equilibrium.newton import EquilibriumState
from solver.failures import ContactLost
from solver.prediction import Prediction, Skin
from solver.response.derivatives import Derivatives, of_contact
from solver.scene import Scene

NUMBERS = {name: state for state, name in NAMES.items()}


class Nearby(Protocol):
    """A settled slide, and those beside it."""

    def derivatives(self) -> Derivatives:
        """Return its derivatives, by the tangent at convergence."""
        ...

    def seds(self, scenes: Sequence[Scene]) -> Array:
        """Return the SED (n, 2) [MPa] of scenes that differ from its own in friction, depth or force alone.

        First that averaged over the ending, then that in its middle. nan where no settled slide is found beside
        this one; how far there would be one is not looked for.
        """
        ...


def nearby(predictions: Sequence[Prediction]) -> Iterator[Nearby | None]:
    """Yield the slide of each prediction.

    None where the finger is only pressed or held by a drag, so that its state depends on the way to it, and where the
    state is not met again.
    """
    model: FingerModel | None = None
    for found in predictions:
        scene = found.scene
        if scene.loading.direction == 0 or scene.loading.dragged:
            yield None
            continue
        if scene.solve.kinematics == "finite":
            # Imported here: small strain need not wait for the compiled loops to be loaded.
            from solver.response.finite_nearby import met_again

            yield met_again(found)
            continue
        if model is None or model.geometry is not found.geometry:
            model = FingerModel.on(scene, found.geometry)
        guess = states(found.skin)
        try:
            yield _SmallNearby(scene, model, _slide(model, scene, guess))
        except ContactLost:
            yield None


@dataclass(frozen=True, slots=True, eq=False)
class _SmallNearby:
    scene: Scene
    finger: FingerModel
    here: EquilibriumState

    def derivatives(self) -> Derivatives:
        return of_contact(self.finger, self.scene, self.here)

    def seds(self, scenes: Sequence[Scene]) -> Array:
        out = np.full((len(scenes), 2), np.nan)
        held: list[tuple[int, EquilibriumState]] = []
        for number, scene in enumerate(scenes):
            try:
                contact = _slide(self.finger, scene, self.here.state)
            except ContactLost:
                continue
            if not (contact.touching & ~self.here.touching)[[0, -1]].any():  # else skin may touch that nobody looked at
                held.append((number, contact))
        if held:
            out[[number for number, _ in held]] = self.finger.seds([contact for _, contact in held])
        return out


def states(skin: Skin) -> NDArray[np.int64]:
    """Return the states (k,) of a skin that slides: what still stuck slips once it has settled."""
    return np.array([SLIP if state == "stick" else NUMBERS[state] for state in skin.state])


def _slide(finger: FingerModel, scene: Scene, guess: NDArray[np.integer]) -> EquilibriumState:
    """Return the settled slide of a scene that a guess of its states leads to. Raises ContactLost."""
    return slide_beside(finger.newton, sliding_pull(scene), guess, scene.normal_force)
