"""The warm steppers of a live view: measured forces in, the state of the finger and its SED out.

At small strain the finger is condensed once onto the skin that may touch: its stiffness, and the SED of the ending as a
quadratic form of the skin's displacements. A reading is then one search for contact states under given forces. At
finite strain, depth and travel follow from the forces by Newton's method on a bordered system, usually in one iteration
a reading. The next iteration continues from its residual.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from solver._kernels.compiling import OPEN, SLIP, STICK
from solver.arrays import Array
from solver.body import Endings, Patches, Probes
from solver.continuation.small_states import expected_depth
from solver.equilibrium import BY_DEPTH, EquilibriumState, ForceLoad, LoadState, lower_onto_surface
from solver.equilibrium.finger import Finger, FiniteFinger, LinearFinger
from solver.equilibrium.load_stepping import correct
from solver.failures import ContactLost
from solver.mesh.mesher import Sizing
from solver.scene import Scene

SLIDING = 0.995  # part of the friction limit beyond which the tangential force means sliding
LIGHT = 1e-7  # N/mm: less than this is no touch


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
        """Start untouched, for a surface of friction `mu` and traction bound `tau` [MPa]."""
        self.finger, self.newton = finger, finger.newton
        self.mu = mu  # coefficient of friction, taken anew with every reading [-]
        self.tau = tau  # traction bound, likewise [MPa]
        self.state = EquilibriumState.undeformed(self.newton.condensed)

    @property
    def depth(self) -> float:
        """Indentation found [mm]."""
        return self.state.load.depth

    @property
    def travel(self) -> float:
        """Travel of the bone along +x while some skin stuck [mm]; forces do not determine the travel of a slide."""
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
        return self.advance(normal, min(max(tangential, -self.mu * normal), self.mu * normal))

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        self.state = EquilibriumState.undeformed(self.newton.condensed)

    @abstractmethod
    def advance(self, normal: float, tangential: float) -> float:
        """Return what `step` does of forces [N/mm] that press the finger and that friction carries."""

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa], at `prediction.ROW`; nan beyond the finger."""
        return self.finger.row.average(self.finger.displacement(self.state))

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""
        whole = self.finger.geometry.whole
        displacement = self.finger.displacement(self.state)
        return self.finger.geometry.mesh.nodes[whole] + displacement[whole] - [0.0, self.depth]

    def under_friction(self, *, slides: bool, sense: int) -> EquilibriumState:
        """Return the last state under today's friction; all that touches slips to `sense` where it `slides`."""
        last, load = self.state, self.state.load
        state = np.where(last.state == STICK, SLIP, last.state).astype(np.int32) if slides else last.state.copy()
        senses = np.full(len(state), sense, np.int32) if slides else last.sense.copy()
        load = LoadState(load.depth, self.mu, self.tau, sense if slides else 0, load.travel)
        return replace(last, state=state, sense=senses, load=load)


CHANGES = 60  # systems after which a reading is given up: 1 to 3 are usual


class SmallStepper(Stepper):
    """Follows one finger on one surface at small strain."""

    finger: LinearFinger

    def advance(self, normal: float, tangential: float) -> float:
        """Do as `Stepper` says.

        Backward Euler: a point sticks where it was, or slips from there against its friction force.
        """
        slides = abs(tangential) >= SLIDING * self._most(normal)
        start = self.under_friction(slides=slides, sense=1 if tangential > 0.0 else -1)
        if not start.state.any():
            start = lower_onto_surface(self.newton.condensed, start)
        forces = ForceLoad(normal, None, start.load.travel) if slides else ForceLoad(normal, tangential)
        x = start.u[:, 0] + self.newton.skin_x
        try:
            state = self.newton.solve_linear(start, start.load, x, forces, CHANGES)
        except ContactLost:
            self.forget()
            return float("nan")
        if state.reaches_end:
            self.forget()
            return float("nan")
        self.state = state
        stretched = self.finger.ending_by_skin @ state.u.ravel()
        return float(stretched @ stretched)

    def _most(self, normal: float) -> float:
        """Return the largest tangential force the surface can carry [N/mm], pressures shared out as they last were."""
        if self.tau == np.inf:
            return self.mu * normal
        push = self.state.normal
        total = float(push.sum())
        if total <= 0.0:
            return self.mu * normal
        part = self.mu * normal / total
        return float(np.minimum(part * push, self.tau * self.newton.skin.fixed_length).sum())


@dataclass(frozen=True, slots=True)
class FollowControl:
    """When a finger at finite strain is shown, hurried, led to a state anew, and given up."""

    met: float = 0.02  # part of the normal force by which a state may miss the forces and still be shown
    eased: float = 0.7  # of the normal force at which a state was lost for good: from there it is sought again
    stairs: int = 12  # that lead a finger from nothing to forces it bears already
    leading: int = 3  # iterations on each
    arriving: int = 8  # iterations on the last, as after a state that was not shown
    near: float = 0.01  # size of one after which no more are made [mm]
    least_stretch: float = 0.65  # of the skin that is shown: it folds from 0.544 on, less so on a coarse mesh
    largest_kink: float = 0.3  # that is shown: a coarse mesh has this where skin folds behind the contact
    far: float = 0.15  # displacement in one iteration from which on there is another [mm]
    hurried: int = 3  # and how many at most
    stiff: float = 1e3  # bulk over shear stiffness from which on a tangent from elsewhere leads astray (nu 0.4995)
    furthest: float = 5.0  # displacement in one iteration beyond which the state is lost [mm]


CONTROL = FollowControl()


class FiniteStepper(Stepper):
    """Follows one finger on one surface at finite strain."""

    finger: FiniteFinger

    def __init__(self, finger: FiniteFinger, mu: float, tau: float = np.inf) -> None:
        """Start untouched, as `Stepper`."""
        super().__init__(finger, mu, tau)
        self._lost_at: float | None = None  # normal force [N/mm]
        self._hopeless = False  # whether these forces were led to in vain
        self._behind = False  # whether the last state had not caught up with its forces
        self._stiffness = 0.0  # of the finger pressed deeper, in the last iteration [N/mm per mm]

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        super().forget()
        self._lost_at, self._hopeless, self._behind = None, False, False

    def advance(self, normal: float, tangential: float) -> float:
        """Do as `Stepper` says.

        A state is lost where contact leaves the skin that may touch, and where skin is squeezed so far that it may have
        folded. The next reading leads to it from nothing. Where that is in vain, it is tried again once the normal
        force has eased. One that has not caught up with the forces is not shown.
        """
        if self._lost_at is None:
            return self._follow(normal, tangential)
        if self._hopeless and normal >= CONTROL.eased * self._lost_at:
            return float("nan")
        return self._lead(normal, tangential)

    def _lead(self, normal: float, tangential: float) -> float:
        """Return what `step` does of a finger led from nothing to these forces."""
        self.forget()
        sed = float("nan")
        for part in np.linspace(1.0 / CONTROL.stairs, 1.0, CONTROL.stairs).tolist():
            self._behind = part == 1.0
            sed = self._follow(part * normal, part * tangential, CONTROL.leading)
            if self.lost:
                self._lost_at, self._hopeless = normal, True
                break
        return sed

    @property
    def lost(self) -> bool:
        """Whether there is no state until the normal force eases."""
        return self._lost_at is not None

    def _follow(self, normal: float, tangential: float, iterations: int = 1) -> float:
        """Return what `step` does of a state that is not lost, or of the untouched finger."""
        newton = self.newton
        state = self._ready(normal, tangential)
        origin, before = state.place(newton.condensed)[:, 0], state.load.travel
        forces, hurried = ForceLoad(normal, tangential), self._goes_far(normal)
        far, turns = (CONTROL.near, CONTROL.arriving) if self._behind else (CONTROL.far, CONTROL.hurried)
        for number in range(1, max(iterations, turns) + 1):
            kept = hurried and number == 1
            done = correct(newton, state, forces, origin, before, kept=kept)
            if kept and (done is None or done[1] > CONTROL.furthest):
                continue
            if done is None or done[1] > CONTROL.furthest or done[0].reaches_end:
                return self._lose(normal)
            state = done[0]
            if number >= iterations and not kept and done[1] < far:
                break
        self._stiffness = float(newton.follows(newton.steps)[1, BY_DEPTH])
        compression = self.finger.skin_compression(state)
        if compression.least < CONTROL.least_stretch:
            return self._lose(normal)
        self.state = state
        x, y = state.force
        behind = max(abs(y - normal), abs(x - tangential) if (state.state == STICK).any() else 0.0)
        self._behind = behind > CONTROL.met * normal
        if self._behind:
            return float("nan")
        if compression.lowest < CONTROL.least_stretch or compression.kink > CONTROL.largest_kink:
            return self._lose(normal)
        return self.finger.sed_ending(state.u)

    def _goes_far(self, normal: float) -> bool:
        """Return whether the finger is about to move far: then the tangent of the last reading leads a part of the way.

        With it an iteration takes a third of the time, and only where the finger has come to is worth a new one.
        """
        missing = abs(normal - float(self.state.force[1]))
        far = self.state.touching.any() and 0.0 < CONTROL.far * self._stiffness < missing
        return bool(far) and self.newton.bulk < CONTROL.stiff

    def _lose(self, normal: float) -> float:
        self.forget()
        self._lost_at = normal
        return float("nan")

    def _ready(self, normal: float, tangential: float) -> EquilibriumState:
        """Return the last state, its skin in contact states that can carry the forces: slip, or stick somewhere."""
        slides = abs(tangential) > SLIDING * self.mu * normal
        state = self.under_friction(slides=slides, sense=1 if tangential > 0.0 else -1)
        if not state.touching.any():
            state.state[int(np.argmin(state.place(self.newton.condensed)[:, 1]))] = SLIP if slides else STICK
        elif not slides and not (state.state == STICK).any():
            state.state[state.state != OPEN] = STICK
        return state


FINENESS = {"small": 4.0, "finite": 2.7}  # meshes on which the response is good to about 1 % of its peak
MARGIN = {"small": 4.0, "finite": 6.0}  # how far above the indentation undeformed skin is looked at for contact
# A nine-node element as four quadrilaterals, and the middle of each in its coordinates.
QUARTERS = np.array([[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]])
MIDDLES = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


class LivePicture:
    """A finger in quadrilaterals, four to an element: `faces` (f, 4) of nodes that lie at `rest` (n, 2) [mm]."""

    def __init__(self, finger: Finger[Patches]) -> None:
        """Place a probe in the middle of each face."""
        mesh, count = finger.geometry.mesh, 4 * len(finger.geometry.mesh.elements)
        self.faces, self.rest = mesh.elements[:, QUARTERS].reshape(-1, 4), mesh.nodes
        each = np.arange(count)
        probes = Probes.at(mesh, finger.body.centre, each // 4, MIDDLES[each % 4])
        middles = Endings(probes, np.ones(count), each, count, np.tile([1.0, 0.0], (count, 1)))
        self._finger, self._middles = finger, finger.patches(middles)

    def nodes(self, state: EquilibriumState) -> Array:
        """Return where the nodes are (n, 2) [mm], the surface being y = 0."""
        return self.rest + self._finger.displacement(state) - [0.0, state.load.depth]

    def sed(self, state: EquilibriumState) -> Array:
        """Return the SED in the middle of each face (f,) [MPa]."""
        return self._middles.average(self._finger.displacement(state))


def stepper(scene: Scene) -> Stepper:
    """Return a stepper for the finger and the surface of `scene`, on a mesh made for its indentation or force.

    Forces that press much deeper lose the state. Raises SceneError where the finger cannot be meshed.
    """
    kind = scene.solve.kinematics
    sizing = Sizing(FINENESS[kind], expected_depth(scene), margin=MARGIN[kind])
    mu, tau = float(scene.friction.mu), scene.friction.cap
    follower: Stepper
    if kind == "finite":
        follower = FiniteStepper(FiniteFinger.of(scene, sizing), mu, tau)
    else:
        follower = SmallStepper(LinearFinger.of(scene, sizing), mu, tau)
    follower.step(1e-3, 0.0)  # compiles, or loads what was compiled
    follower.forget()
    return follower
