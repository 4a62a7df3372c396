"""The warm stepper at finite strain: a measured force in, the state of the finger and its response out.

The depth and the sideways travel of the surface are unknown and follow from the two forces: Newton on a bordered
system, with as many iterations per reading as it is given, usually one, and more where a reading moves it far, as those
of a finger do that lifts. Between readings nothing is lost: what one iteration leaves over, the next takes up.
"""

import numpy as np

from solver._kernels import OPEN, SLIP, STICK
from solver.arrays import Array
from solver.equilibrium.finger import FiniteFinger
from solver.equilibrium.force_control import corrected
from solver.equilibrium.newton import BY_DEPTH, EquilibriumState, Given
from solver.response.stepper import SLIDING, Stepper

MET = 0.02  # part of the normal force by which a state may miss the forces and still be shown
EASED = 0.7  # of the normal force at which the state was lost and led to in vain: from there it is sought again [-]
STAIRS, LEADING = 12, 3  # that lead a finger from nothing to forces it bears already, and iterations on each
ARRIVING, NEAR = 8, 0.01  # iterations on the last, as after a state that was not shown, until one is so small [mm]
FOLDING = 0.65  # least stretch of the skin that is shown: it folds from 0.544 on, and a coarse mesh squeezes it less
CREASING = 0.3  # largest kink that is shown: where skin folds behind the last node that touches, that mesh has this
FAR, HURRIED = 0.15, 3  # displacement in one iteration from which on there is another [mm], and how many at most
STIFF = 1e3  # bulk over shear stiffness from which on a tangent from elsewhere leads astray (nu 0.4995)
FURTHEST = 5.0  # displacement in one iteration beyond which the state is lost [mm]


class FiniteStepper(Stepper):
    """Follows one finger on one surface at finite strain."""

    def __init__(self, finger: FiniteFinger, mu: float, tau: float = np.inf) -> None:
        """Start untouched, for a surface of friction `mu` and traction bound `tau` [MPa]."""
        super().__init__(finger.body.condensed, mu, tau)
        self._finger, self._newton = finger, finger.newton
        self._lost_at: float | None = None  # normal force [N/mm]
        self._hopeless = False  # whether these forces were led to in vain
        self._behind = False  # whether the last state had not caught up with its forces
        self._stiffness = 0.0  # of the finger pressed deeper, in the last iteration [N/mm per mm]

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        super().forget()
        self._lost_at, self._hopeless, self._behind = None, False, False

    def _advance(self, normal: float, tangential: float) -> float:
        """Do as `Stepper` says.

        A state is lost where contact leaves the skin that may touch, and where skin is squeezed so far that it may have
        folded. The next reading leads to it from nothing. Where that is in vain, it is tried again once the normal
        force has eased. One that has not caught up with the forces is not shown.
        """
        if self._lost_at is None:
            return self._followed(normal, tangential)
        if self._hopeless and normal >= EASED * self._lost_at:
            return float("nan")
        return self._led(normal, tangential)

    def _led(self, normal: float, tangential: float) -> float:
        """Return what `step` does of a finger led from nothing to these forces."""
        self.forget()
        sed = float("nan")
        for part in np.linspace(1.0 / STAIRS, 1.0, STAIRS).tolist():
            self._behind = part == 1.0
            sed = self._followed(part * normal, part * tangential, LEADING)
            if self.lost:
                self._lost_at, self._hopeless = normal, True
                break
        return sed

    @property
    def lost(self) -> bool:
        """Whether there is no state until the normal force eases."""
        return self._lost_at is not None

    def _followed(self, normal: float, tangential: float, iterations: int = 1) -> float:
        """Return what `step` does of a state that is not lost, or of the untouched finger."""
        newton = self._newton
        shape = self._ready(normal, tangential)
        origin, before = shape.place(newton.condensed)[:, 0], shape.load.travel
        given, hurried = Given(normal, tangential), self._goes_far(normal)
        far, turns = (NEAR, ARRIVING) if self._behind else (FAR, HURRIED)
        for number in range(1, max(iterations, turns) + 1):
            kept = hurried and number == 1
            done = corrected(newton, shape, given, origin, before, kept=kept)
            if kept and (done is None or done[1] > FURTHEST):
                continue
            if done is None or done[1] > FURTHEST or self._finger.runs_out(done[0]):
                return self._lose(normal)
            shape = done[0]
            if number >= iterations and not kept and done[1] < far:
                break
        self._stiffness = float(newton.follows(newton.steps)[1, BY_DEPTH])
        compression = self._finger.skin_compression(shape)
        if compression.least < FOLDING:
            return self._lose(normal)
        self.state = shape
        x, y = shape.force
        behind = max(abs(y - normal), abs(x - tangential) if (shape.state == STICK).any() else 0.0)
        self._behind = behind > MET * normal
        if self._behind:
            return float("nan")
        if compression.lowest < FOLDING or compression.kink > CREASING:
            return self._lose(normal)
        return self._finger.sed_ending(shape.u)

    def _goes_far(self, normal: float) -> bool:
        """Return whether the finger is about to move far: then the tangent of the last reading leads a part of the way.

        With it an iteration takes a third of the time, and only where the finger has come to is worth a new one.
        """
        missing = abs(normal - float(self.state.force[1]))
        far = self.state.touching.any() and 0.0 < FAR * self._stiffness < missing
        return bool(far) and self._newton.bulk < STIFF

    def _lose(self, normal: float) -> float:
        self.forget()
        self._lost_at = normal
        return float("nan")

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa]; nan where the finger ends before one."""
        return self._finger.row.average(self.state.u)

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""
        whole = self._finger.geometry.whole
        return self._finger.geometry.mesh.nodes[whole] + self.state.u[whole] - [0.0, self.depth]

    def _ready(self, normal: float, tangential: float) -> EquilibriumState:
        """Return the last shape with states that can carry the forces: something touches, and slides or does not."""
        slides = abs(tangential) > SLIDING * self.mu * normal
        shape = self._under_friction(slides=slides, sense=1 if tangential > 0.0 else -1)
        if not shape.touching.any():
            shape.state[int(np.argmin(shape.place(self._newton.condensed)[:, 1]))] = SLIP if slides else STICK
        elif not slides and not (shape.state == STICK).any():
            shape.state[shape.state != OPEN] = STICK
        return shape
