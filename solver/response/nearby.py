"""The SED and its derivatives of slides near a predicted one, on its mesh and from its state.

A nearby slide costs a few small systems, and its SED differs for its load alone.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from solver import _kernels as kernels
from solver._kernels import SLIP
from solver.arrays import Array
from solver.contact.law import NAMES
from solver.continuation.arc_length import jumped_branch
from solver.continuation.existence import sound
from solver.equilibrium import force_control, full_slip
from solver.equilibrium.finger import FiniteFinger, LinearFinger, sliding_load
from solver.equilibrium.full_slip import slide_beside
from solver.equilibrium.newton import EquilibriumState, Given, LoadState
from solver.failures import ContactLost, NotConverged
from solver.prediction import Prediction, Skin
from solver.response.derivatives import Derivatives, by_stiffness, of_slide
from solver.scene.scene import Scene

GOOD = 1e-8  # tolerance of the displacements [mm]: far less than a difference of friction that anybody could tell
NUMBERS = {name: state for state, name in NAMES.items()}


@dataclass(frozen=True, slots=True, eq=False)
class Nearby(ABC):
    """A settled slide, and those near it."""

    scene: Scene
    here: EquilibriumState

    @abstractmethod
    def derivatives(self) -> Derivatives:
        """Return its derivatives, by the tangent at convergence."""

    @abstractmethod
    def seds(self, scenes: Sequence[Scene]) -> Array:
        """Return the SED (n, 2) [MPa] of scenes that differ from its own in friction, depth or force alone.

        First that averaged over the ending, then that in its middle. nan where no settled slide is found near this one;
        how far there would be one is not looked for.
        """

    def _reaches_out(self, there: EquilibriumState) -> bool:
        """Return whether a state touches at an end of the skin where this one does not: skin beyond may touch too."""
        return bool((there.touching & ~self.here.touching)[[0, -1]].any())


def nearby(predictions: Sequence[Prediction]) -> Iterator[Nearby | None]:
    """Yield the slide of each prediction.

    None where the finger is only pressed or held by a drag, so that its state depends on the way to it, and where the
    state is not met again.
    """
    model: LinearFinger | None = None
    for found in predictions:
        scene = found.scene
        if scene.loading.direction == 0 or scene.loading.dragged:
            yield None
            continue
        try:
            if scene.solve.kinematics == "finite":
                yield _FiniteNearby.of(found)
                continue
            if model is None or model.geometry is not found.geometry:
                model = LinearFinger.on(scene, found.geometry)
            yield _SmallNearby(scene, _slide(model, scene, states(found.skin)), model)
        except NotConverged:
            yield None


def stiffness_shares(predictions: Sequence[Prediction]) -> Array:
    """Return d log N / d log E (n, 4) of presses that slide without friction at small strain, by tissue.

    Raises ValueError for others, and where a press is not met again.
    """
    found: list[Array] = []
    for slide in nearby(predictions):
        if not isinstance(slide, _SmallNearby):
            raise ValueError("no press at small strain that slides without friction")
        found.append(by_stiffness(slide.finger, slide.here))
    return np.array(found)


@dataclass(frozen=True, slots=True, eq=False)
class _SmallNearby(Nearby):
    finger: LinearFinger

    def derivatives(self) -> Derivatives:
        return of_slide(self.finger, self.scene, self.here)

    def seds(self, scenes: Sequence[Scene]) -> Array:
        out = np.full((len(scenes), 2), np.nan)
        held: dict[int, EquilibriumState] = {}
        for number, scene in enumerate(scenes):
            with suppress(ContactLost):
                contact = _slide(self.finger, scene, self.here.state)
                if not self._reaches_out(contact):
                    held[number] = contact
        if held:
            out[list(held)] = self.finger.seds(list(held.values()))
        return out


def states(skin: Skin) -> NDArray[np.int64]:
    """Return the states (k,) of a skin that slides: what still stuck slips once it has settled."""
    return np.array([SLIP if state == "stick" else NUMBERS[state] for state in skin.state])


def _slide(finger: LinearFinger, scene: Scene, guess: NDArray[np.integer]) -> EquilibriumState:
    """Return the settled slide of a scene that a guess of its states leads to. Raises ContactLost."""
    return slide_beside(finger.newton, sliding_load(scene), guess, scene.normal_force)


@dataclass(frozen=True, slots=True, eq=False)
class _FiniteNearby(Nearby):
    """Near slides lie on the same branch of states, continued from here."""

    finger: FiniteFinger

    @classmethod
    def of(cls, found: Prediction) -> Self:
        """Return the settled slide of `found` from what is kept of it. Raises NotConverged where it is not met."""
        finger, scene, skin = FiniteFinger.on(found.scene, found.geometry), found.scene, found.skin
        body, sense = finger.body, -scene.loading.direction
        length = np.empty(len(skin.x))
        kernels.tributary(skin.x, body.middle, length)
        load = LoadState(found.indentation, float(scene.friction.mu), scene.friction.cap, sense)
        state = states(skin).astype(np.int32)
        reaction = np.stack([skin.traction, skin.pressure], axis=1) * length[:, None]
        modes, senses = body.pressure(found.displacement), np.full(len(state), sense, np.int32)
        start = EquilibriumState(found.displacement, modes, state, senses, reaction, load, 0)
        return cls(scene, finger.newton.settle(start, load), finger)

    def derivatives(self) -> Derivatives:
        return of_slide(self.finger, self.scene, self.here)

    def seds(self, scenes: Sequence[Scene]) -> Array:
        found = [self._beside(scene) for scene in scenes]
        return np.array([(np.nan, np.nan) if shape is None else tuple(self.finger.seds([shape])[0]) for shape in found])

    def _beside(self, scene: Scene) -> EquilibriumState | None:
        newton, here = self.finger.newton, self.here
        load = here.load._replace(mu=float(scene.friction.mu), tau=scene.friction.cap)
        try:
            if scene.normal_force is None:
                there = full_slip.settled(newton, load._replace(depth=scene.loading.depth), here, GOOD)
            else:
                there = force_control.balanced(newton, replace(here, load=load), Given(scene.normal_force, None), GOOD)
        except NotConverged:
            return None
        beyond = there.load.mu > here.load.mu or there.load.depth > here.load.depth
        # Skin that may have folded since: whether the branch goes on as far as that, this mesh cannot tell.
        unproven = beyond and not sound(self.finger, there)
        return None if self._reaches_out(there) or unproven or jumped_branch(self.finger, here, there) else there
