"""The warm stepper at finite strain: a measured force in, the state of the finger and its response out.

The depth and the sideways travel of the surface are unknown and follow from the two forces: Newton on a bordered
system, with as many iterations per reading as it is given, usually one. Between readings nothing is lost: what one
iteration leaves over, the next reading's takes up.
"""

from dataclasses import replace

import numpy as np

from solver.finite_solution import FiniteFinger
from solver.kernels import OPEN, SLIP, STICK
from solver.mesh import Array
from solver.newton import BY_DEPTH, BY_TRAVEL, EQUILIBRIUM, Pull, Shape

SLIDING = 0.995  # part of the friction limit beyond which the tangential force means sliding
LIGHT = 1e-7  # N/mm: less than this is no touch
STRIDE = 0.3  # largest change of depth or travel in one iteration [mm]


class FiniteStepper:
    """Follows one finger on one surface; holds the last state."""

    def __init__(self, finger: FiniteFinger, mu: float, tau: float = np.inf) -> None:
        """Start untouched, for a surface of friction `mu` and traction bound `tau` [MPa]."""
        newton = finger.newton
        self._finger, self._newton = finger, newton
        self.mu, self.tau = mu, tau
        self.shape = Shape.undeformed(newton.body)

    @property
    def depth(self) -> float:
        """Indentation found [mm]."""
        return self.shape.pull.depth

    @property
    def travel(self) -> float:
        """How far the bone has moved along +x while something stuck [mm]; sliding, which forces do not tell, adds 0."""
        return -self.shape.pull.travel

    def forget(self) -> None:
        """Start afresh from the untouched finger."""
        self.shape = Shape.undeformed(self._newton.body)

    def step(self, normal: float, tangential: float, iterations: int = 1) -> float:
        """Take one reading and return the SED averaged over the ending [MPa]; nan where the state was lost.

        `normal` [N/mm] presses the finger, `tangential` [N/mm] is the surface's pull on it along +x. After nan the next
        reading starts afresh from the untouched finger.
        """
        newton = self._newton
        if normal < LIGHT:
            self.forget()
            return 0.0
        most = self.mu * normal
        pull_back = float(np.clip(tangential, -most, most))
        shape = self._ready(normal, pull_back)
        origin, before = shape.place(newton.body)[:, 0], shape.pull.travel
        for _ in range(iterations):
            moved = self._corrected(shape, normal, pull_back, origin, before)
            if moved is None or moved.state[0] != OPEN or moved.state[-1] != OPEN:
                self.forget()
                return float("nan")
            shape = moved
        self.shape = shape
        return self._finger.sed_ending(shape)

    def row(self) -> Array:
        """Return the SED of the row of endings as it is now (r,) [MPa]; nan where the finger ends before one."""
        return self._finger.row.average(self._newton.body, self.shape.u)

    def outline(self) -> Array:
        """Return the deformed skin (w, 2) [mm] from the palmar cut round the tip, the surface being y = 0."""
        whole = self._finger.geometry.whole
        return self._newton.body.mesh.nodes[whole] + self.shape.u[whole] - [0.0, self.depth]

    def _ready(self, normal: float, tangential: float) -> Shape:
        """Return the last shape with states that can carry the forces: something touches, and slides or does not."""
        shape = self.shape
        state, sense, pull = shape.state.copy(), shape.sense.copy(), shape.pull
        if not shape.touching.any():
            lowest = int(np.argmin(shape.place(self._newton.body)[:, 1]))
            state[lowest] = STICK
        sliding = abs(tangential) > SLIDING * self.mu * normal
        if sliding:
            state[state == STICK] = SLIP
            turned = 1 if tangential > 0.0 else -1
            sense[:] = turned
        elif not (state == STICK).any():
            state[state != OPEN] = STICK
        turned = int(np.sign(tangential)) if sliding else 0
        return replace(shape, state=state, sense=sense, pull=Pull(pull.depth, self.mu, self.tau, turned, pull.travel))

    def _corrected(self, shape: Shape, normal: float, tangential: float, origin: Array, before: float) -> Shape | None:
        """Return the shape after one iteration towards the forces, None where there is no way."""
        newton, pull = self._newton, shape.pull
        if not newton.linearise(shape, pull, origin + pull.travel - before):
            return None
        steps = newton.steps
        here = newton.reaction(steps[:, EQUILIBRIUM]).sum(axis=0)
        by_depth = newton.reaction(steps[:, BY_DEPTH], still=True).sum(axis=0)
        deeper = along = 0.0
        if (shape.state == STICK).any():
            by_travel = newton.reaction(steps[:, BY_TRAVEL], still=True).sum(axis=0)
            matrix = np.array([[by_depth[1], by_travel[1]], [by_depth[0], by_travel[0]]])
            missing = np.array([normal - here[1], tangential - here[0]])
            det = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
            if det == 0.0:
                return None
            deeper = (missing[0] * matrix[1, 1] - missing[1] * matrix[0, 1]) / det
            along = (matrix[0, 0] * missing[1] - matrix[1, 0] * missing[0]) / det
        elif by_depth[1] != 0.0:
            deeper = (normal - here[1]) / by_depth[1]
        most = max(abs(deeper), abs(along))
        if not np.isfinite(most):
            return None
        if most > STRIDE:
            deeper, along = deeper * STRIDE / most, along * STRIDE / most
        step = steps[:, EQUILIBRIUM] + deeper * steps[:, BY_DEPTH] + along * steps[:, BY_TRAVEL]
        pull = pull._replace(depth=pull.depth + deeper, travel=pull.travel + along)
        after, largest, _ = newton.moved(shape, pull, step, origin + pull.travel - before)
        return after if largest < 5.0 else None
