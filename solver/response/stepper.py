"""The warm stepper of a live view: forces in, the state of the finger and its SED out."""

from abc import ABC, abstractmethod
from dataclasses import replace
from math import isfinite

import numpy as np

from solver._kernels import SLIP, STICK
from solver.arrays import Array
from solver.body.condensed import CondensedBody
from solver.equilibrium.newton import EquilibriumState, LoadState

SLIDING = 0.995  # part of the friction limit beyond which the tangential force means sliding
LIGHT = 1e-7  # N/mm: less than this is no touch


class Stepper(ABC):
    """Follows one finger on one surface, reading by reading; holds the last state and memory of fixed size.

    >>> from solver import stepper
    >>> from solver.scene.published import SLIPPERINESS, scene
    >>> follows = stepper(scene(SLIPPERINESS[0]))
    >>> sed = [follows.step(0.001 * n, -0.0002 * n) for n in range(1, 50)]
    >>> 0.0 < sed[0] < sed[-1], bool(0.5 < follows.depth < 1.5)
    (True, True)
    """

    def __init__(self, body: CondensedBody, mu: float, tau: float) -> None:
        """Start untouched."""
        self._rest = body
        self.mu = mu  # coefficient of friction, taken anew with every reading [-]
        self.tau = tau  # traction bound, likewise [MPa]
        self.state = EquilibriumState.undeformed(body)

    @property
    def depth(self) -> float:
        """Indentation found [mm]."""
        return self.state.load.depth

    @property
    def travel(self) -> float:
        """How far the bone has moved along +x while something stuck [mm]; sliding, which forces do not tell, adds 0."""
        return 0.0 - self.state.load.travel

    def step(self, normal: float, tangential: float) -> float:
        """Take one reading and return the SED averaged over the ending [MPa]; nan where there is no state to show.

        `normal` [N/mm] presses the finger, `tangential` [N/mm] is the surface's pull on it along +x. At small strain
        the next reading starts afresh from the untouched finger; at finite strain, where that is in vain, the first
        after the force has eased. A reading that is no number is nan too, and leaves the state as it was.
        """
        normal, tangential = float(normal), float(tangential)  # loops are compiled for these alone
        if not isfinite(normal + tangential):
            return float("nan")
        if normal < LIGHT:
            self.forget()
            return 0.0
        return self._advance(normal, min(max(tangential, -self.mu * normal), self.mu * normal))

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        self.state = EquilibriumState.undeformed(self._rest)

    @abstractmethod
    def _advance(self, normal: float, tangential: float) -> float:
        """Return what `step` does of forces [N/mm] that press the finger and that friction carries."""

    @abstractmethod
    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa], at `receptor.ROW`; nan beyond the finger."""

    @abstractmethod
    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""

    def _under_friction(self, *, slides: bool, sense: int) -> EquilibriumState:
        """Return the last state under today's friction; all that touches slips to `sense` where it `slides`."""
        last, load = self.state, self.state.load
        state = np.where(last.state == STICK, SLIP, last.state).astype(np.int32) if slides else last.state.copy()
        senses = np.full(len(state), sense, np.int32) if slides else last.sense.copy()
        load = LoadState(load.depth, self.mu, self.tau, sense if slides else 0, load.travel)
        return replace(last, state=state, sense=senses, load=load)
