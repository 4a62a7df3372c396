"""Steppers for a live view, which follow the state of a finger and its SED through readings of its forces.

At small strain the stiffness is condensed once to the skin that may touch, and the ending's SED becomes a quadratic
form of the skin's displacements. A reading then takes one search for contact states under given forces. At finite
strain, a reading usually takes one iteration of Newton's method on the bordered system. The next reading continues from
its residual.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from solver._kernels import OPEN, SLIP, STICK
from solver.arrays import Array
from solver.body import Endings, Patches, Probes
from solver.contact import ForceLoad, LoadState
from solver.continuation.small_states import expected_depth
from solver.equilibrium import BY_DEPTH, EquilibriumState, lower_onto_surface
from solver.equilibrium.finger import KINDS, Finger, FiniteFinger, LinearFinger
from solver.failures import ContactLost
from solver.mesh.mesher import Sizing
from solver.scene import Scene

SLIDING_SHARE = 0.995  # fraction of the friction limit beyond which the finger counts as sliding
_MIN_FORCE = 1e-7  # normal force below which there is no contact [N/mm]


class Stepper(ABC):
    """Follows one finger on one surface, reading by reading, in memory of fixed size.

    >>> from solver import stepper
    >>> from solver.scene.published import SLIPPERINESS, scene
    >>> follows = stepper(scene(SLIPPERINESS[0]))
    >>> sed = [follows.step(0.001 * n, -0.0002 * n) for n in range(1, 50)]
    >>> 0.0 < sed[0] < sed[-1], bool(0.5 < follows.depth < 1.5)
    (True, True)
    """

    def __init__(self, finger: Finger[Patches], mu: float, tau: float = np.inf) -> None:
        """Start undeformed, on a surface with friction `mu` and traction bound `tau` [MPa]."""
        self.finger, self.newton = finger, finger.newton
        self.mu = mu  # coefficient of friction, which may change between readings [-]
        self.tau = tau  # traction bound, which may change between readings [MPa]
        self.state = EquilibriumState.undeformed(self.newton.condensed)

    @property
    def depth(self) -> float:
        """Indentation [mm]."""
        return self.state.load.depth

    @property
    def travel(self) -> float:
        """Travel of the bone along +x while some skin sticks [mm]; forces do not determine the travel in full slip."""
        return 0.0 - self.state.load.travel

    def step(self, normal: float, tangential: float) -> float:
        """Take one reading and return the SED averaged over the ending [MPa]; nan where no valid state was found.

        `normal` [N/mm] presses the finger, `tangential` [N/mm] is the tangential force on it along +x. After an invalid
        state the next reading starts from the undeformed finger. At finite strain, if that fails, the next attempt
        waits until the normal force has decreased. A reading that is not finite changes no state.
        """
        normal, tangential = float(normal), float(tangential)  # the kernels take floats
        if not isfinite(normal + tangential):
            return float("nan")
        if normal < _MIN_FORCE:
            self.reset()
            return 0.0
        return self.advance(normal, min(max(tangential, -self.mu * normal), self.mu * normal))

    def reset(self) -> None:
        """Return to the undeformed finger."""
        self.state = EquilibriumState.undeformed(self.newton.condensed)

    @abstractmethod
    def advance(self, normal: float, tangential: float) -> float:
        """Return the result of `step` for forces [N/mm] within the friction limit."""

    def row(self) -> Array:
        """Return the SED (r,) [MPa] of the endings at `prediction.ROW` in the last state; nan outside the finger."""
        return self.finger.row.average(self.finger.displacement(self.state))

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip; the surface is y = 0."""
        skin = self.finger.geometry.all_skin
        displacement = self.finger.displacement(self.state)
        return self.finger.geometry.mesh.nodes[skin] + displacement[skin] - [0.0, self.depth]

    def with_friction(self, *, slides: bool, sense: int) -> EquilibriumState:
        """Return the last state under the present friction; where it `slides`, its contact slips towards `sense`."""
        last, load = self.state, self.state.load
        state = np.where(last.state == STICK, SLIP, last.state).astype(np.int32) if slides else last.state.copy()
        senses = np.full(len(state), sense, np.int32) if slides else last.sense.copy()
        load = LoadState(load.depth, self.mu, self.tau, sense if slides else 0, load.travel)
        return replace(last, state=state, sense=senses, load=load)


_MAX_SYSTEMS = 60  # systems for a reading, at most: 1 to 3 are usual


class SmallStepper(Stepper):
    """Follows one finger on one surface at small strain."""

    finger: LinearFinger

    def advance(self, normal: float, tangential: float) -> float:
        """Return the ending's SED [MPa] for forces [N/mm] within the friction limit; nan without a valid state.

        Backward Euler: a point sticks where it was, or slips from there against its friction force.
        """
        slides = abs(tangential) >= SLIDING_SHARE * self._friction_limit(normal)
        start = self.with_friction(slides=slides, sense=1 if tangential > 0.0 else -1)
        if not start.state.any():
            start = lower_onto_surface(self.newton.condensed, start)
        forces = ForceLoad(normal, None, start.load.travel) if slides else ForceLoad(normal, tangential)
        x = start.u[:, 0] + self.newton.skin_x
        state = None
        with suppress(ContactLost):
            state = self.newton.solve_linear(start, x, forces, _MAX_SYSTEMS)
        if state is None or state.reaches_end:
            self.reset()
            return float("nan")
        self.state = state
        gradient = self.finger.ending_by_skin @ state.u.ravel()
        return float(gradient @ gradient)

    def _friction_limit(self, normal: float) -> float:
        """Return the friction limit [N/mm] for the last distribution of pressure."""
        if self.tau == np.inf:
            return self.mu * normal
        push = self.state.normal
        total = float(push.sum())
        if total <= 0.0:
            return self.mu * normal
        part = self.mu * normal / total
        return float(np.minimum(part * push, self.tau * self.newton.skin.fixed_length).sum())


@dataclass(frozen=True, slots=True)
class StepperControl:
    """Iterations for a reading at finite strain, and criteria for a valid state and for a lost one."""

    max_force_error: float = 0.02  # of a valid state, relative to the normal force
    retry_ratio: float = 0.7  # normal force relative to that of the last failure, below which a lost state is retried
    restart_steps: int = 12  # load steps from the undeformed finger to the forces of a reading
    restart_iterations: int = 3  # iterations for each restart step
    max_catch_up_iterations: int = 8  # for the last restart step, and after an invalid state
    catch_up_step: float = 1e-3  # displacement in an iteration that ends the catch-up, relative to the length scale
    min_stretch: float = 0.65  # of valid skin: it folds at 0.544, later on a coarse mesh
    max_kink: float = 0.3  # of valid skin: a coarse mesh has this where skin folds
    large_step: float = 0.01  # displacement in an iteration after which another follows, relative to the length scale
    max_iterations: int = 3  # for a reading with such displacements
    max_stiffness_ratio: float = 1e3  # ratio of bulk to shear stiffness from which a kept tangent diverges (nu 0.4995)
    divergence: float = 0.4  # displacement in an iteration beyond which the state is lost, relative to the length scale


_CONTROL = StepperControl()


class FiniteStepper(Stepper):
    """Follows one finger on one surface at finite strain."""

    finger: FiniteFinger

    def __init__(self, finger: FiniteFinger, mu: float, tau: float = np.inf) -> None:
        super().__init__(finger, mu, tau)
        self._lost_at: float | None = None  # normal force [N/mm]
        self._restart_failed = False  # whether the load steps from the undeformed finger failed
        self._forces_missed = False  # whether the forces of the last state differ too much
        self._stiffness = 0.0  # derivative of the normal force with respect to depth, last iteration [N/mm per mm]

    def reset(self) -> None:
        """Return to the undeformed finger."""
        super().reset()
        self._lost_at, self._restart_failed, self._forces_missed = None, False, False

    def advance(self, normal: float, tangential: float) -> float:
        """Return the ending's SED [MPa] for forces [N/mm] within the friction limit; nan without a valid state.

        A state is lost where contact leaves the skin that may touch, and where the skin may have folded. The next
        reading takes load steps from the undeformed finger. If these fail, they are repeated once the normal force has
        decreased. A state whose forces differ too much gives nan.
        """
        if self._lost_at is None:
            return self._follow(normal, tangential)
        if self._restart_failed and normal >= _CONTROL.retry_ratio * self._lost_at:
            return float("nan")
        return self._restart(normal, tangential)

    def _restart(self, normal: float, tangential: float) -> float:
        """Return the result of `step` by load steps from the undeformed finger."""
        self.reset()
        sed = float("nan")
        for part in np.linspace(1.0 / _CONTROL.restart_steps, 1.0, _CONTROL.restart_steps).tolist():
            self._forces_missed = part == 1.0
            sed = self._follow(part * normal, part * tangential, _CONTROL.restart_iterations)
            if self.lost:
                self._lost_at, self._restart_failed = normal, True
                break
        return sed

    @property
    def lost(self) -> bool:
        """Whether the state is lost, until the normal force decreases."""
        return self._lost_at is not None

    def _follow(self, normal: float, tangential: float, iterations: int = 1) -> float:
        """Return the result of `step` by iterations from the last state."""
        newton = self.newton
        state = self._starting_state(normal, tangential)
        anchor = state.anchor(newton.condensed)
        forces, large_step = ForceLoad(normal, tangential), self._expects_large_step(normal)
        scale = newton.length_scale
        far, turns = _CONTROL.large_step, _CONTROL.max_iterations
        if self._forces_missed:
            far, turns = _CONTROL.catch_up_step, _CONTROL.max_catch_up_iterations
        for number in range(1, max(iterations, turns) + 1):
            reuse = large_step and number == 1
            regular = newton.linearise(state, anchor(state.load), 0, forces, reuse=reuse)
            correction = newton.correct(state, anchor) if regular else None
            if reuse and (correction is None or correction[1] > _CONTROL.divergence * scale):
                continue
            if correction is None or correction[1] > _CONTROL.divergence * scale or correction[0].reaches_end:
                return self._lose_state(normal)
            state = correction[0]
            if number >= iterations and not reuse and correction[1] < far * scale:
                break
        self._stiffness = float(newton.force_changes(newton.steps)[1, BY_DEPTH])
        compression = self.finger.skin_compression(state)
        if compression.least_chord < _CONTROL.min_stretch:
            return self._lose_state(normal)
        self.state = state
        x, y = state.force
        miss = max(abs(y - normal), abs(x - tangential) if (state.state == STICK).any() else 0.0)
        self._forces_missed = miss > _CONTROL.max_force_error * normal
        if self._forces_missed:
            return float("nan")
        if compression.least_stretch < _CONTROL.min_stretch or compression.kink > _CONTROL.max_kink:
            return self._lose_state(normal)
        return self.finger.sed_ending(state.u)

    def _expects_large_step(self, normal: float) -> bool:
        """Return whether a large displacement is expected, so that the first iteration keeps the last tangent.

        Such an iteration takes a third of the time, and a new tangent is more useful after it.
        """
        missing = abs(normal - float(self.state.force[1]))
        far = _CONTROL.large_step * self.newton.length_scale
        large_step = self.state.touching.any() and 0.0 < far * self._stiffness < missing
        return bool(large_step) and self.newton.bulk < _CONTROL.max_stiffness_ratio

    def _lose_state(self, normal: float) -> float:
        self.reset()
        self._lost_at = normal
        return float("nan")

    def _starting_state(self, normal: float, tangential: float) -> EquilibriumState:
        """Return the last state with contact states that can carry the forces: slip everywhere, or some stick."""
        slides = abs(tangential) > SLIDING_SHARE * self.mu * normal
        state = self.with_friction(slides=slides, sense=1 if tangential > 0.0 else -1)
        if not state.touching.any():
            state.state[int(np.argmin(state.skin_positions(self.newton.condensed)[:, 1]))] = SLIP if slides else STICK
        elif not slides and not (state.state == STICK).any():
            state.state[state.state != OPEN] = STICK
        return state


_FINENESS = {"small": 4.0, "finite": 2.7}  # meshes on which the response is accurate to about 1 % of its peak
MARGIN = {"small": 4.0, "finite": 6.0}  # `Sizing.margin`: skin lower than 2 or 2.5 times the indentation may touch
# A nine-node element as four quadrilaterals, and the local coordinates of their midpoints.
QUARTERS = np.array([[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]])
MIDPOINTS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


class LivePicture:
    """A finger as quadrilaterals, four per element: `faces` (f, 4) of nodes at `rest` positions (n, 2) [mm]."""

    def __init__(self, finger: Finger[Patches]) -> None:
        """Place a probe at the midpoint of each face."""
        mesh, count = finger.geometry.mesh, 4 * len(finger.geometry.mesh.elements)
        self.faces, self.rest = mesh.elements[:, QUARTERS].reshape(-1, 4), mesh.nodes
        each = np.arange(count)
        probes = Probes.at(mesh, finger.body.centre, each // 4, MIDPOINTS[each % 4])
        middles = Endings(probes, np.ones(count), each, count, np.tile([1.0, 0.0], (count, 1)))
        self._finger, self._middles = finger, finger.patches(middles)

    def nodes(self, state: EquilibriumState) -> Array:
        """Return the positions of the nodes (n, 2) [mm]; the surface is y = 0."""
        return self.rest + self._finger.displacement(state) - [0.0, state.load.depth]

    def sed(self, state: EquilibriumState) -> Array:
        """Return the SED at the midpoint of each face (f,) [MPa]."""
        return self._middles.average(self._finger.displacement(state))


def stepper(scene: Scene) -> Stepper:
    """Return a stepper for the finger and the surface of `scene`, on a mesh for its indentation or force.

    Much larger forces lose the state. Raises SceneError where the finger cannot be meshed.
    """
    kind = scene.solve.kinematics
    sizing = Sizing(_FINENESS[kind], expected_depth(scene), margin=MARGIN[kind])
    steppers: dict[str, Callable[..., Stepper]] = {"small": SmallStepper, "finite": FiniteStepper}
    follower = steppers[kind](KINDS[kind].of(scene, sizing), float(scene.friction.mu), scene.friction.cap)
    follower.step(1e-3, 0.0)  # compiles or loads the kernels
    follower.reset()
    return follower
