"""The warm steppers of a live view: measured forces in, the state of the finger and its SED out.

At small strain all that is ever asked of the finger is condensed once onto the skin that may touch: its stiffness, the
skin's outline (a matrix) and the SED of every ending (a quadratic form of the skin's displacements). A reading is then
one search for contact states, forces given. At finite strain depth and travel follow from the forces by Newton on a
bordered system, usually in one iteration a reading. What one iteration leaves over, the next takes up.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import isfinite
from typing import Self

import numpy as np
from numpy.typing import NDArray

from solver._kernels import OPEN, SLIP, STICK
from solver.arrays import Array
from solver.body.condensed import CondensedBody
from solver.body.linear import CondensedLinear
from solver.body.receptor import LinearPatches
from solver.equilibrium.finger import FiniteFinger, LinearFinger
from solver.equilibrium.force_control import corrected
from solver.equilibrium.newton import BY_DEPTH, EquilibriumState, Given, LoadState, Newton, lowered
from solver.failures import ContactLost

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


CHANGES = 60  # systems after which a reading is given up: 1 to 3 are usual
NOTHING = 1e-14  # part of an energy that is left out of its quadratic form


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """A finger as the displacements (2 k,) of its skin see it, x and y of one node after the other."""

    skin: CondensedLinear
    ending: Array  # (a, 2 k): the reference ending's SED is the sum of squares of this times the displacements
    row: Array  # (b, 2 k): likewise, one ending of the row after the other
    row_starts: NDArray[np.int64]  # (r,) first line of each ending in `row`
    row_known: NDArray[np.bool_]  # (r,) whether the finger reaches there
    outline: Array  # (w, 2) undeformed skin, from the palmar cut round the tip to the dorsal one [mm]
    outline_by_skin: Array  # (2 w, 2 k) its displacements, x and y in turn [-]

    @classmethod
    def of(cls, finger: LinearFinger) -> Self:
        """Condense `finger`."""
        everywhere = finger.body.every_step()  # (nodes, 2, 2 k)
        parts = _square_roots(finger.row, everywhere)
        starts = np.cumsum([0, *(len(part) for part in parts[:-1])])
        whole = finger.geometry.whole
        return cls(
            finger.body.condensed,
            _square_roots(finger.ending, everywhere)[0],
            np.concatenate(parts),
            starts,
            np.array([bool(part.any()) for part in parts]),
            finger.geometry.mesh.nodes[whole],
            np.ascontiguousarray(everywhere[whole].reshape(2 * len(whole), -1)),
        )


def _square_roots(patches: LinearPatches, everywhere: Array) -> list[Array]:
    """Return for each ending a matrix (a, 2 k): the SED is the sum of squares of it times the skin's unknowns."""
    mesh, elastic, endings = patches.mesh, patches.elastic, patches.endings
    probes = endings.probes
    shear, lame = elastic.shear[probes.element, None, None], elastic.lame[probes.element, None, None]
    lines = probes.strains(mesh, everywhere)  # (p, 4, 2 k)
    lines *= np.sqrt(np.concatenate([shear, shear, shear, lame / 2.0], axis=1))  # W = G eps:eps + lambda/2 theta^2
    area = endings.areas
    out: list[Array] = []
    for number in range(endings.count):
        mine = endings.patch == number
        if not mine.any():
            out.append(np.zeros((1, lines.shape[2])))
            continue
        scaled = np.sqrt(endings.weights[mine] / area[number])[:, None, None] * lines[mine]
        _, sizes, turns = np.linalg.svd(scaled.reshape(-1, lines.shape[2]), full_matrices=False)
        kept = sizes**2 > NOTHING * sizes[0] ** 2
        out.append(sizes[kept, None] * turns[kept])
    return out


class SmallStepper(Stepper):
    """Follows one finger on one surface at small strain."""

    def __init__(self, finger: Condensed, mu: float, tau: float = np.inf) -> None:
        """Start untouched, for a surface of friction `mu` and traction bound `tau` [MPa]."""
        super().__init__(finger.skin, mu, tau)
        self._finger, self._newton = finger, Newton(finger.skin)

    def _advance(self, normal: float, tangential: float) -> float:
        """Do as `Stepper` says.

        Backward Euler: a point sticks where it was, or slips from there against its friction force.
        """
        slides = abs(tangential) >= SLIDING * self._most(normal)
        start = self._under_friction(slides=slides, sense=1 if tangential > 0.0 else -1)
        if not start.state.any():
            start = lowered(self._newton.condensed, start)
        given = Given(normal, None, start.load.travel) if slides else Given(normal, tangential)
        x = start.u[:, 0] + self._newton.skin_x
        try:
            found = self._newton.solved(start, start.load, x, given, CHANGES)
        except ContactLost:
            self.forget()
            return float("nan")
        if found.touching[0] or found.touching[-1]:
            self.forget()
            return float("nan")
        self.state = found
        stretched = self._finger.ending @ found.u.ravel()
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
        return float(np.minimum(part * push, self.tau * self._finger.skin.fixed_length).sum())

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa]; nan where the finger ends before one."""
        finger = self._finger
        stretched = finger.row @ self.state.u.ravel()
        sed = np.add.reduceat(stretched * stretched, finger.row_starts)
        return np.where(finger.row_known, sed, np.nan)

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""
        finger = self._finger
        moved = (finger.outline_by_skin @ self.state.u.ravel()).reshape(-1, 2)
        return finger.outline + moved - [0.0, self.depth]


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
