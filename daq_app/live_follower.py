"""What the model says of the finger while it moves: measured forces in, the SED at the receptor and a picture out.

The friction of a surface is not known before it was stroked. So mu and the traction bound are those of this touch so
far: the largest T/N, and the largest T over the contact area. Until the finger slides, the model slips too early. The
whole tangential force is taken to act along the finger, in the sense of its part along x: the model is plane.
"""

from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from daq_app.live_model import Forces, Kinematics, Picture, Provisional, Settle, Settled, Use
from sessions.analysis import FrictionParameters
from sessions.plan import SessionPlan
from sessions.prediction import DEFAULT_SPEED, SLIDES, PredictionOptions, with_own_finger
from solver.failures import SolveFailure
from solver.fields import fields_of
from solver.finger import FingerModel
from solver.live_picture import LivePicture
from solver.mesher import Sizing
from solver.receptor import ROW
from solver.scene import Friction, Loading, Scene, Solve
from solver.small_stepper import Condensed, SmallStepper
from solver.solution import solve
from solver.stepper import FINENESS, MARGIN, Stepper, stepper

Array = NDArray[np.float64]

TOUCH = 0.05  # less normal force is no touch [N]
FLOOR = 0.3  # a ratio means nothing below this normal force [N]
LEAST_MU = 0.05  # before any was measured [-]
KEPT = 60.0  # predictions that are kept for the difference to the full solve [s]
DEFAULT_DEPTH = 2.0  # for which the mesh is made where no plan tells one [mm]
DEFAULT_AREA = 100.0  # of contact, for the traction bound, likewise [mm2]


def live_scene(plan: SessionPlan | None, kinematics: Kinematics = "small") -> Scene:
    """Return the finger to follow: the published one with what the plan knows of the subject's own."""
    options = PredictionOptions() if plan is None else with_own_finger(PredictionOptions(), plan)
    depth = max((block.indentation for block in plan.blocks), default=DEFAULT_DEPTH) if plan else DEFAULT_DEPTH
    base = options.scene or Scene(friction=Friction(0.0), loading=Loading(depth))
    return replace(base, friction=Friction(LEAST_MU), loading=Loading(depth), solve=Solve(kinematics))


def settled_scene(plan: SessionPlan, friction: FrictionParameters, normal_force: float) -> Scene | None:
    """Return the scene of a finished stroke, pressed by its measured force [N]; None where it gives no friction."""
    if friction.mu is None or friction.direction is None or normal_force <= 0.0:
        return None
    return replace(
        live_scene(plan),
        friction=Friction(max(friction.mu, 0.0), friction.tau_max),
        loading=Loading(
            slide=SLIDES[friction.direction],
            speed=friction.speed or DEFAULT_SPEED,
            normal_force=normal_force,
            force_unit="N",
        ),
    )


class Follower:
    """Follows one finger, batch by batch; holds the stepper's state and the last minute of predictions."""

    def __init__(self, use: Use) -> None:
        """Mesh and condense the finger. Raises SceneError or MeshError where it cannot be meshed."""
        scene = live_scene(use.plan, use.kinematics)
        self._scene = scene
        self._area = DEFAULT_AREA if use.plan is None else use.plan.contact_area
        self._kinematics: Kinematics = scene.solve.kinematics
        self._stepper, self._drawn = _stepper(scene)
        self._mu, self._tangential = LEAST_MU, 0.0
        self._stream: int | None = None
        self._said: deque[tuple[float, float]] = deque()

    def take(self, forces: Forces) -> Provisional:
        """Return what the model says of a batch."""
        if forces.stream != self._stream:
            self._stream = forces.stream
            self._said.clear()
            self._untouched()
        sed = np.array([self._step(n, p) for n, p in zip(forces.normal, forces.pull, strict=True)])
        self._said += zip(forces.time.tolist(), sed.tolist(), strict=True)
        while self._said and self._said[0][0] < forces.time[-1] - KEPT:
            self._said.popleft()
        row, outline = self._stepper.row(), self._stepper.outline()
        picture = self._picture(outline)
        return Provisional(
            forces.time, sed, row, picture, self._stepper.depth, self._mu,
            self._kinematics, forces.received_ns, forces.stream,
        )  # fmt: skip

    def settle(self, asked: Settle) -> Settled:
        """Return the full solve of a stroke, beside the mean of what was said of it."""
        first, last = asked.steady
        said = np.array([sed for time, sed in self._said if first <= time <= last])
        said = said[np.isfinite(said)]
        provisional = float(said.mean()) if len(said) else None
        scene = settled_scene(asked.plan, asked.friction, asked.normal_force)
        if scene is None:
            why = "the stroke gives no friction."
            return Settled(asked.trial, None, None, provisional, np.full(len(ROW), np.nan), None, None, why)
        try:
            found = solve(scene)
        except SolveFailure as failure:
            return Settled(asked.trial, None, None, provisional, np.full(len(ROW), np.nan), None, None, str(failure))
        fields = fields_of(found)
        sed = fields.sed[fields.triangles].mean(axis=1)
        picture = Picture(fields.nodes, fields.triangles, sed, fields.outlines["skin"])
        return Settled(
            asked.trial, found.sed_ending, found.error_estimate, provisional, found.row.sed, picture, found.indentation
        )

    def _step(self, normal: float, pull: float) -> float:
        if normal < TOUCH:
            self._untouched()
            return 0.0
        if normal >= FLOOR:
            self._mu = max(self._mu, abs(pull) / normal)
            self._tangential = max(self._tangential, abs(pull))
        follows = self._stepper
        follows.mu, follows.tau = self._mu, self._bound()
        return follows.step(normal / self._scene.width, pull / self._scene.width)

    def _bound(self) -> float:
        """Return the traction bound so far [MPa]: as the analysis has it, the largest T over the contact area."""
        return self._tangential / self._area if self._tangential > 0.0 else np.inf

    def _untouched(self) -> None:
        self._mu, self._tangential = LEAST_MU, 0.0
        self._stepper.forget()

    def _picture(self, outline: Array) -> Picture:
        if self._drawn is None or not isinstance(self._stepper, SmallStepper):
            return Picture(np.empty((0, 2)), np.empty((0, 4), np.int64), np.empty(0), outline)
        forces = self._stepper.forces()
        nodes = self._drawn.nodes(forces, self._stepper.depth)
        return Picture(nodes, self._drawn.faces, self._drawn.sed(forces), outline)


def _stepper(scene: Scene) -> tuple[Stepper, LivePicture | None]:
    """Return a stepper, and the matrices of its picture where it has any."""
    kind = scene.solve.kinematics
    if kind == "finite":
        return stepper(scene), None
    finger = FingerModel.of(scene, Sizing(FINENESS[kind], scene.loading.depth, margin=MARGIN[kind]))
    follows = SmallStepper(Condensed.of(finger), LEAST_MU)
    follows.step(1e-3, 0.0)  # compiles, or loads what was compiled
    follows.forget()
    return follows, LivePicture.of(finger)
