"""The model of the moving finger: measured forces in, the SED at the receptor and a picture out.

The friction of a surface is unknown before its stroke. So mu and the traction bound are the largest values so far in
this contact, of T/N and of T over the contact area. Until the finger slides, the model slips too early. The
model is plane: it applies the whole tangential force along the finger, with the sign of its component along x.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from daq_app.window.live_model import Forces, Kinematics, Picture, Provisional, Settle, SettledSolve, Use
from daq_app.wording import tr
from sessions.plan.plan import SessionPlan
from sessions.prediction import PredictionOptions, with_own_finger
from sessions.prediction.scenes import DEFAULT_SPEED, SLIDES
from sessions.prediction.stored import known_error
from sessions.strokes import FrictionParameters
from sessions.strokes.settings import RatioSettings
from solver import Friction, Loading, Scene, Solve, SolveFailure, solve
from solver.arrays import Array, Indices
from solver.prediction import ROW, Prediction, percent
from solver.response.fields import fields_of
from solver.response.stepper import LivePicture, stepper

TOUCH = 0.05  # least normal force of contact [N]
_FLOOR = RatioSettings().force_floor  # the ratio is meaningless below this normal force [N]
LEAST_MU = 0.05  # before the first measured value [-]
_HISTORY = 60.0  # predictions kept for the difference from the full solve [s]
OBSERVATIONS = 100  # states kept of a stroke, in case its full solve fails
OBSERVATION_EVERY = 0.1  # the time between them [s]
DEFAULT_DEPTH = 2.0  # for the mesh, without a plan [mm]
DEFAULT_AREA = 100.0  # of contact, for the traction bound, without a plan [mm2]


def live_scene(plan: SessionPlan | None, kinematics: Kinematics = "small") -> Scene:
    """Return the finger to follow: the published one with the subject's own values from the plan."""
    options = PredictionOptions() if plan is None else with_own_finger(PredictionOptions(), plan)
    depth = max((block.indentation for block in plan.blocks), default=DEFAULT_DEPTH) if plan else DEFAULT_DEPTH
    base = options.scene or Scene(friction=Friction(0.0), loading=Loading(depth))
    return replace(base, friction=Friction(LEAST_MU), loading=Loading(depth), solve=Solve(kinematics))


def settled_scene(
    plan: SessionPlan, friction: FrictionParameters, normal_force: float, kinematics: Kinematics = "small"
) -> Scene | None:
    """Return the scene of a finished stroke, pressed by its measured force [N]; None if it has no friction."""
    if friction.mu is None or friction.direction is None or normal_force <= 0.0:
        return None
    speed = friction.speed or DEFAULT_SPEED
    loading = Loading(slide=SLIDES[friction.direction], speed=speed, normal_force=normal_force, force_unit="N")
    law = Friction(max(friction.mu, 0.0), friction.tau_max)
    return replace(live_scene(plan, kinematics), friction=law, loading=loading)


@dataclass(frozen=True, slots=True, eq=False)
class _Observation:
    time: float  # [s, device time]
    row: Array
    picture: Picture
    rest_nodes: Array  # (n, 2) undeformed [mm]
    depth: float


class _Model:
    def __init__(self, scene: Scene) -> None:
        self.stepper = stepper(scene)
        self.picture = LivePicture(self.stepper.finger)
        self.picture.sed(self.stepper.state)  # prepares its data in advance

    def picture_and_rest(self) -> tuple[Picture, Array]:
        """Return the picture, and the undeformed positions of its nodes (n, 2) [mm]."""
        state, picture = self.stepper.state, self.picture
        nodes, sed = picture.nodes(state), picture.sed(state)
        return Picture(nodes, picture.faces, sed, self.stepper.outline()), picture.rest


class Follower:
    """Follows one finger, batch by batch; holds the steppers' states and the last minute of predictions.

    Small strain is always followed. If finite strain is requested, its values are shown wherever it has any.
    """

    def __init__(self, use: Use) -> None:
        """Mesh and condense the finger. Raises SceneError or MeshError if it cannot be meshed."""
        self._finger = _finger(use)
        scene, self._area, _ = self._finger
        self._kinematics: Kinematics = use.kinematics
        self._scene = scene
        finite = (live_scene(use.plan, "finite"),) if use.kinematics == "finite" else ()
        self._models = [*map(_Model, (scene, *finite))]  # at small strain, and at finite strain
        self._reached = False  # whether finite strain reached the last step
        self._mu, self._tangential = LEAST_MU, 0.0
        self._stream: int | None = None
        self._seds: deque[tuple[float, float]] = deque()
        self._observations: deque[_Observation] = deque(maxlen=OBSERVATIONS)

    def follows(self, use: Use) -> bool:
        """Say whether it already follows this finger."""
        return self._finger == _finger(use)

    def take(self, forces: Forces) -> Provisional:
        """Return the model's prediction for a batch of forces."""
        if forces.stream != self._stream:
            self._stream = forces.stream
            self._seds.clear()
            self._observations.clear()
            self._forget_contact()
        steps = [self._step(normal, pull) for normal, pull in zip(forces.normal, forces.pull, strict=True)]
        sed = np.array([value for value, _ in steps])
        instead = np.array([len(self._models) > 1 and not reached for _, reached in steps])
        self._seds += zip(forces.time.tolist(), sed.tolist(), strict=True)
        while self._seds and self._seds[0][0] < forces.time[-1] - _HISTORY:
            self._seds.popleft()
        model = self._models[1 if self._reached and len(self._models) > 1 else 0]
        row, now, (picture, rest_nodes) = model.stepper.row(), float(forces.time[-1]), model.picture_and_rest()
        if sed[-1] > 0.0 and (not self._observations or abs(now - self._observations[-1].time) >= OBSERVATION_EVERY):
            self._observations.append(_Observation(now, row, picture, rest_nodes, model.stepper.depth))
        return Provisional(
            forces.time, sed, row, picture, model.stepper.depth, self._mu,
            self._kinematics, instead, forces.received_ns, forces.stream,
        )  # fmt: skip

    def settled_solver(self, request: Settle) -> Callable[[], SettledSolve]:
        """Return a function that solves a stroke in full; it may run in parallel and uses the predictions so far."""
        first, last = request.steady
        values = np.array([sed for time, sed in self._seds if first <= time <= last])
        values = values[np.isfinite(values)]
        provisional = float(values.mean()) if len(values) else None
        observations = [observation for observation in self._observations if first <= observation.time <= last]
        latest = observations[-1] if observations else None
        return lambda: _solve_settled(request, self._kinematics, provisional, latest)

    def _step(self, normal: float, pull: float) -> tuple[float, bool]:
        """Return the SED under forces [N], and whether it is of finite strain; nan beyond the model's reach."""
        if normal < TOUCH:
            self._forget_contact()
            return 0.0, True
        if normal >= _FLOOR:
            self._mu = max(self._mu, abs(pull) / normal)
            self._tangential = max(self._tangential, abs(pull))
        normal, pull = normal / self._scene.finger.width, pull / self._scene.finger.width
        # The traction bound so far [MPa] is the largest T over the contact area, as in the analysis.
        bound = self._tangential / self._area if self._tangential > 0.0 else np.inf
        for model in self._models:
            model.stepper.mu, model.stepper.tau = self._mu, bound
        small, *finite = (model.stepper.step(normal, pull) for model in self._models)
        self._reached = bool(finite) and not np.isnan(finite[0])
        return (finite[0], True) if self._reached else (small, False)

    def _forget_contact(self) -> None:
        self._mu, self._tangential = LEAST_MU, 0.0
        self._reached = len(self._models) > 1
        for model in self._models:
            model.stepper.reset()


def _solve_settled(
    request: Settle, kinematics: Kinematics, provisional: float | None, last: _Observation | None
) -> SettledSolve:
    """Return the full solve of a stroke; if it fails, the reason and the last followed state in its window."""
    scene = settled_scene(request.plan, request.friction, request.normal_force, kinematics)
    reason, failed, prediction = tr("The stroke gives no friction."), False, None
    try:
        prediction = None if scene is None else solve(scene)
    except SolveFailure as failure:
        reason, failed = str(failure.in_a_sentence()), True
    if prediction is None:
        row, picture, depth = np.full(len(ROW), np.nan), None, None
        if last is not None:
            picture = last.picture
            lost = place_of_greatest_shortening(last.rest_nodes, picture.nodes, picture.faces) if failed else None
            row, picture, depth = last.row, replace(picture, lost=lost), last.depth
        return SettledSolve(request.steady, None, None, provisional, row, picture, depth, kinematics, reason)
    fields = fields_of(prediction)
    sed = fields.sed[fields.triangles].mean(axis=1)
    picture = Picture(fields.nodes, fields.triangles, sed, fields.outlines["skin"])
    return SettledSolve(
        request.steady, prediction.sed_ending, known_error(prediction, prediction.error_estimate), provisional,
        prediction.row.sed, picture, prediction.indentation, kinematics, effect=_greatest_effect(prediction),
    )  # fmt: skip


def _greatest_effect(prediction: Prediction) -> str:
    """Return the largest omitted effect on the SED and its size; "" without an estimate."""
    effects = ((effect["estimate"], name) for name, effect in prediction.model["left_out"].items())
    size, name = max((pair for pair in effects if pair[0] is not None), default=(0.0, ""))
    return name and f"{name} {percent(size)} of the SED"


def place_of_greatest_shortening(undeformed: Array, deformed: Array, faces: Indices) -> tuple[float, float]:
    """Return the centre (x, y) [mm] of the face with the smallest stretch in any direction.

    `undeformed` and `deformed` are nodes (n, 2), `faces` (f, 4); the diagonals of a face define its stretch.

    >>> square = np.array([[0.0, 0.0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]])
    >>> pressed = square * [1.0, 0.5] + [[0, 0], [0, 0], [-0.8, 0]] * 2
    >>> place_of_greatest_shortening(square, pressed, np.array([[0, 1, 4, 3], [1, 2, 5, 4]]))
    (1.1, 0.25)
    """
    new, old = (np.moveaxis(nodes[faces[:, 2:]] - nodes[faces[:, :2]], 1, 2) for nodes in (deformed, undeformed))
    stretches = np.linalg.svd(new @ np.linalg.inv(old), compute_uv=False)  # the least last
    x, y = deformed[faces[int(np.argmin(stretches[:, -1]))]].mean(axis=0).tolist()
    return x, y


def _finger(use: Use) -> tuple[Scene, float, Kinematics]:
    """Return everything that distinguishes one finger from another."""
    return live_scene(use.plan), DEFAULT_AREA if use.plan is None else use.plan.contact_area, use.kinematics
