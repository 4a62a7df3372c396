"""From the friction of a session's strokes to what the model predicts: the only door to the solver.

Each trial becomes a scene: its measured friction, its block's indentation, its direction and speed, and one finger. All
scenes are solved together on one mesh, so that differences between surfaces are accurate.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal

from sessions.alternative import Alternative, Variant
from sessions.analysis import Analysis, FrictionParameters, Stroke
from sessions.analysis.area import FIXED, AreaLaw
from sessions.decisions import Decision
from sessions.plan import DISTAL_TO_PROXIMAL, PROXIMAL_TO_DISTAL, Block, SessionPlan, Stimulus, Trial
from sessions.sed_interval import SedInterval
from solver.audits import inside_out
from solver.failures import Cancelled, SolveFailure
from solver.fields import Fields, fields_of
from solver.finger import FingerModel
from solver.matching import matching_depths
from solver.nearby import Nearby, nearby
from solver.prediction import History, Prediction, Skin
from solver.reference import SCALE
from solver.reference import Reading as TauReading
from solver.scene import Finger, Friction, Loading, Scene, SceneError, Slide, Solve
from solver.solution import answers
from solver.stepping import March

SLIDES: dict[int, Slide] = {PROXIMAL_TO_DISTAL: "+x", DISTAL_TO_PROXIMAL: "-x"}
DEFAULT_SPEED = 20.0  # where none was measured [mm/s]; rescales the time of a course and nothing else

Progress = Callable[[float], bool]

_NOT_TOLD = ("prediction", "opposite")  # of a row as plain data: all that the solver found
_TOLD_OTHERWISE = ("stimulus", "alternatives", "interval", "opposite_interval")


@dataclass(frozen=True, slots=True)
class PredictionOptions:
    """What a user may ask of the model."""

    tau_reading: TauReading = "computed"  # "as-printed": a hundredth of it, as the paper's tables are headed
    scene: Scene | None = None  # whose finger, width, materials, receptor and tolerance to take; None: the published
    indentation: float | None = None  # [mm], instead of each block's own
    course: Literal["steady", "history"] = "history"
    kinematics: Literal["small", "finite"] = "small"
    intervals: bool = False  # also what the uncertainty of friction makes of each SED, see `sessions.uncertainty`
    beside_intervals: bool = False  # those of each variant too, which takes longer
    beside: Literal["none", "small", "both"] = "none"  # also otherwise, see `sessions.side_by_side`; at which strain


@dataclass(frozen=True, slots=True, eq=False)
class TrialPrediction:
    """What the model says of one trial, or of one stroke of a recording without trials.

    A number is None where `reasons` says why, under the number's name.
    """

    trial: int | None
    stroke: int | None  # position in `Analysis.strokes`; None where the trial has none
    block: str | None
    stimulus: Stimulus | None
    mu: float | None  # that the model got [-]
    mu_rule: str  # which mu that is
    tau_max: float | None  # that the model got [MPa]
    indentation: float | None  # [mm]
    direction: int | None  # +1 proximal to distal, -1 back; as measured, or else as planned
    speed: float | None  # [mm/s]
    sed: float | None  # averaged over the ending [MPa]
    error_estimate: float | None  # relative, of sed
    normal_per_mm: float | None  # [N/mm]
    tangential_per_mm: float | None  # [N/mm]
    normal_force: float | None  # normal_per_mm times the finger's width [N]
    tangential_force: float | None  # [N]
    measured_normal: float | None  # mean over the steady window [N]
    measured_tangential: float | None  # [N]
    matching_depth: float | None  # indentation at which the model's normal force is the measured one [mm]
    opposite_sed: float | None  # at the same depth, slid the other way [MPa]
    wall_s: float | None  # the solve [s]
    prediction: Prediction | None  # all that the solver found
    reasons: Mapping[str, str]
    opposite: Prediction | None = None  # that slid the other way
    alternatives: tuple[Alternative, ...] = ()  # the same trial predicted otherwise, where that was asked for
    interval: SedInterval | None = None  # of `sed`, where it was asked for
    opposite_interval: SedInterval | None = None  # of `opposite_sed`

    @property
    def history(self) -> History | None:
        """Return the course in time, where it was asked for."""
        return None if self.prediction is None else self.prediction.history

    def picture(self) -> tuple[Fields, Skin] | None:
        """Return the deformed finger with its SED, and the skin's pressures; None where there is no prediction."""
        return None if self.prediction is None else (fields_of(self.prediction), self.prediction.skin)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        row = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in (*_NOT_TOLD, *_TOLD_OTHERWISE)}
        row["stimulus"] = None if self.stimulus is None else asdict(self.stimulus)
        row["reasons"] = dict(self.reasons)
        row["alternatives"] = [asdict(one) for one in self.alternatives]
        told = {"interval": self.interval, "opposite_interval": self.opposite_interval}
        row |= {name: asdict(one) for name, one in told.items() if one is not None}
        row["solver"] = None if self.prediction is None else self.prediction.to_dict()
        return row


@dataclass(frozen=True, slots=True, eq=False)
class SessionPrediction:
    """What the model says of a session."""

    simulated: bool
    trials: tuple[TrialPrediction, ...]
    width: float  # of the finger [mm]
    width_origin: str  # "set" or "assumed"
    options: PredictionOptions
    decisions: tuple[Decision, ...] = ()  # of people about the strokes, in force
    area: AreaLaw = FIXED  # by which tau_max was told
    gain_error: float | None = None  # of each axis, which the intervals hold [-]; None: the assumed one

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, None where honesty allows no number."""
        return {
            **({"simulated": "SIMULATED"} if self.simulated else {}),
            "trials": [trial.to_dict() for trial in self.trials],
            "decisions": [decision.to_dict() for decision in self.decisions],
            "area": asdict(self.area),
            "gain_error": self.gain_error,
            "width": self.width,
            "width_origin": self.width_origin,
            "options": asdict(self.options),
            "options_origin": {
                field.name: "default" if getattr(self.options, field.name) == field.default else "set"
                for field in fields(self.options)
            },
            "scene": asdict(_template(self.options)),  # finger, materials and settings as used, defaults filled in
        }


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """How the model came to its answer for one trial, for pictures of it."""

    scene: Scene
    finger: FingerModel
    march: March | None  # None where it has none that can be drawn


Watch = Callable[[int, TrialPrediction, Way | None], None]  # position of the row, the row, how it was found


def predict(
    analysis: Analysis,
    plan: SessionPlan,
    options: PredictionOptions | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
    first: int | None = None,
) -> SessionPrediction:
    """Return what the model predicts for every trial of `plan`, or for every stroke where it plans none.

    The finger is the one asked for, or else the published one with what the plan knows of the subject's own. A trial
    without friction, without depth or without a settled state keeps its row, with the reason. The row at position
    `first` is solved before the others; `watch` is told each row as soon as it is known. Raises SceneError where the
    options make no scene, Cancelled where `progress` (told the part done) returns False.
    """
    asked = with_own_finger(options or PredictionOptions(), plan)
    prepared = [_prepared(case, asked) for case in _cases(analysis, plan)]
    rows = [one.row for one in prepared]
    told = watch or _unseen
    for number, one in enumerate(prepared):
        if one.scene is None:
            told(number, one.row, None)
    solved = sorted((n for n, one in enumerate(prepared) if one.scene is not None), key=lambda n: (n != first, n))
    scenes = [scene for n in solved if (scene := prepared[n].scene) is not None]
    # A depth is matched on the small-strain finger, whose answer at finite strain would be another one.
    matches = asked.kinematics == "small"
    forces = [_force_per_mm(prepared[n]) if matches else None for n in solved]
    wanted = [(scene, force) for scene, force in zip(scenes, forces, strict=True) if force is not None]
    matched = iter(matching_depths([scene for scene, _ in wanted], [force for _, force in wanted], in_loops=True))
    depths = [None if force is None else next(matched) for force in forces]
    ways: dict[int, Way] = {}
    found: dict[int, Prediction | SolveFailure] = {}

    def known(at: int) -> TrialPrediction:
        return _filled(prepared[solved[at]], found[2 * at], found[2 * at + 1], depths[at])

    def seen(number: int, answer: Prediction | SolveFailure, finger: FingerModel, march: March | None) -> None:
        found[number] = answer
        at, back = divmod(number, 2)
        if not back:
            ways[at] = Way(scenes[at], finger, march)
        elif 2 * at in found:
            told(solved[at], known(at), ways.get(at))

    both = [one for scene in scenes for one in (scene, _quick(opposite(scene)))]
    found |= dict(enumerate(answers(both, progress, seen if watch else None, in_loops=True)))
    for at, number in enumerate(solved):
        rows[number] = known(at)
    base = asked.scene
    return SessionPrediction(
        simulated=analysis.simulated,
        trials=tuple(rows),
        width=_template(asked).finger.width,
        width_origin="assumed" if base is None or base.finger.width == Finger().width else "set",
        options=asked,
        decisions=analysis.decisions,
        area=analysis.settings.area,
        gain_error=analysis.settings.gain_error,
    )


def _unseen(_number: int, _row: TrialPrediction, _way: Way | None) -> None:
    """Tell nobody."""


def with_loads(scene: Scene, loads: Mapping[str, float]) -> Scene:
    """Return a scene with another "mu" [-], "tau_max" [MPa] as the model gets it, or driving "force" [N]."""
    friction, loading = scene.friction, scene.loading
    mu, tau_max = loads.get("mu", friction.mu), loads.get("tau_max", friction.tau_max)
    force = loads.get("force", loading.normal_force)
    return replace(
        scene,
        friction=replace(friction, mu=mu, tau_max=tau_max),
        loading=loading if force == loading.normal_force else replace(loading, normal_force=force),
    )


def slides(predictions: Sequence[Prediction], progress: Progress | None = None) -> Iterator[Nearby | None]:
    """Yield the slide of each prediction, from which others and derivatives are a few small systems away.

    None where there is none that does not depend on the way to it. Raises Cancelled.
    """
    for number, slide in enumerate(nearby(predictions, in_loops=True)):
        if progress is not None and not progress(number / len(predictions)):
            raise Cancelled
        yield slide


def sed_by(slide: Nearby, scene: Scene) -> Mapping[str, float]:
    """Return the derivatives of the SED by each load that `with_loads` knows, at the slide of a scene."""
    by, force = slide.derivatives().sed, scene.loading.normal_force
    driven = 0.0 if by.normal_force is None or force is None else by.normal_force * (scene.normal_force or 0.0) / force
    return {"mu": by.mu, "tau_max": by.tau_max, "force": driven}


def seds_at(
    strokes: Sequence[tuple[float, float, float, int, float]], options: PredictionOptions
) -> tuple[float | None, ...]:
    """Return the settled SED [MPa] of the options' finger for each mu, tau_max [MPa], depth [mm], direction and speed.

    None where there is no settled state.
    """
    base = _template(options)
    course = Solve(options.kinematics, "steady", base.solve.tolerance)
    scenes = [
        replace(
            base,
            friction=Friction(mu, _bound(tau_max, options)),
            loading=Loading(depth, SLIDES[direction], speed),
            solve=course,
        )
        for mu, tau_max, depth, direction, speed in strokes
    ]
    return tuple(None if one is None else one.sed_ending for one in settled(scenes))


def traction_reached(found: Prediction) -> float:
    """Return the greatest friction traction on the skin [MPa]: any tau_max beyond it has the same solution."""
    return float(abs(found.skin.traction).max())


def doubt_of(found: Prediction) -> str:
    """Return why numbers are not to be believed where the model was driven beyond its range, else ""."""
    return inside_out(found.audits)


def settled(scenes: Sequence[Scene], progress: Progress | None = None) -> tuple[Prediction | None, ...]:
    """Return what the solver finds of each scene, None where it finds no settled state. Raises Cancelled."""
    return tuple(None if isinstance(one, SolveFailure) else one for one in _answers(scenes, progress))


def solved(scenes: Sequence[Scene], progress: Progress | None = None) -> tuple[Prediction | str, ...]:
    """Return what the solver finds of each scene, or why it finds no settled state. Raises Cancelled."""
    return tuple(str(one) if isinstance(one, SolveFailure) else one for one in _answers(scenes, progress))


def _answers(scenes: Sequence[Scene], progress: Progress | None) -> tuple[Prediction | SolveFailure, ...]:
    return answers([_quick(scene) for scene in scenes], progress, in_loops=True)


def _quick(scene: Scene) -> Scene:
    """Return a scene whose evidence nobody will read: to march it takes as long as the answer."""
    return replace(scene, solve=replace(scene.solve, evidence="quick"))


def scene_along(row: TrialPrediction, variant: Variant, options: PredictionOptions) -> Scene | str:
    """Return the settled scene of a predicted trial in a variant, or why there is none."""
    if row.mu is None or row.tau_max is None or row.direction is None or row.indentation is None:
        return row.reasons.get("sed", "The trial gives no scene.")
    if variant.driven == "force" and (row.measured_normal is None or row.measured_normal <= 0.0):
        return "The stroke gives no steady normal force."
    try:
        scene = _scene(row, replace(options, kinematics=variant.kinematics, course="steady"))
    except SceneError as unfit:  # a finger whose tissues have no law at that strain
        return str(unfit)
    tau_max = row.tau_max / SCALE[options.tau_reading] * SCALE[variant.tau_reading]
    scene = replace(scene, friction=replace(scene.friction, tau_max=tau_max))
    if variant.driven == "other way":
        return opposite(scene)
    if variant.driven == "force":
        slide, speed = scene.loading.slide, scene.loading.speed
        force = Loading(slide=slide, speed=speed, normal_force=row.measured_normal, force_unit="N")
        return replace(scene, loading=force)
    return scene


def scenes_of(analysis: Analysis, plan: SessionPlan, options: PredictionOptions) -> Mapping[int, Scene]:
    """Return the scene of each trial that `predict` would solve, by the trial's number."""
    asked = with_own_finger(options, plan)
    prepared = [_prepared(case, asked) for case in _cases(analysis, plan)]
    return {one.row.trial: one.scene for one in prepared if one.scene is not None and one.row.trial is not None}


@dataclass(frozen=True, slots=True)
class _Case:
    """One thing to predict: a planned trial, or a stroke of a recording without a plan."""

    trial: Trial | None
    block: Block | None
    friction: FrictionParameters | None
    number: int | None  # of its stroke
    stroke: Stroke | None


def _cases(analysis: Analysis, plan: SessionPlan) -> Iterator[_Case]:
    if not plan.blocks:
        given = {friction.stroke: friction for friction in analysis.friction}
        for number, stroke in enumerate(analysis.strokes):
            yield _Case(None, None, given.get(number), number, stroke)
        return
    if not plan.forces:
        return
    of_trial = {friction.trial: friction for friction in analysis.friction}
    first: dict[int | None, int] = {}
    for number, stroke in enumerate(analysis.strokes):
        first.setdefault(stroke.trial, number)
    for block in plan.blocks:
        for trial in block.trials if block.phase == "main" else ():
            friction = of_trial.get(trial.number)
            number = first.get(trial.number) if friction is None else friction.stroke
            stroke = None if number is None else analysis.strokes[number]
            yield _Case(trial, block, friction, number, stroke)


def with_own_finger(options: PredictionOptions, plan: SessionPlan) -> PredictionOptions:
    """Return the options with the subject's own finger, as far as the plan knows it and no other was asked for."""
    if options.scene is not None:
        return options
    published = _template(options)
    own = replace(
        published.finger,
        tip_radius=plan.finger.tip_radius or published.finger.tip_radius,
        contact_angle=plan.contact_angle,
        width=plan.finger.width or published.finger.width,
    )
    scene = replace(published, finger=own)
    return options if scene == published else replace(options, scene=scene)


def _template(options: PredictionOptions) -> Scene:
    """Return the scene whose finger is predicted; its friction and loading are put in for each trial."""
    return options.scene or Scene(friction=Friction(0.0), loading=Loading(1.0))


@dataclass(frozen=True, slots=True)
class _Prepared:
    row: TrialPrediction  # as far as it is known before solving
    scene: Scene | None  # None where there is nothing to solve


def _prepared(case: _Case, options: PredictionOptions) -> _Prepared:
    """Return what the model gets of one case, with the reason for every number that is missing."""
    friction, stroke, trial = case.friction, case.stroke, case.trial
    direction = friction.direction if friction is not None else None
    if direction is None and trial is not None:
        direction = trial.direction
    planned = None if case.block is None else case.block.indentation
    row = TrialPrediction(
        trial=None if trial is None else trial.number,
        stroke=case.number,
        block=None if case.block is None else case.block.name,
        stimulus=None if trial is None else trial.stimulus,
        mu=None if friction is None else friction.mu,
        mu_rule="" if friction is None else friction.rule,
        tau_max=None if friction is None else _bound(friction.tau_max, options),
        indentation=planned if options.indentation is None else options.indentation,
        direction=direction,
        speed=None if friction is None else friction.speed,
        sed=None,
        error_estimate=None,
        normal_per_mm=None,
        tangential_per_mm=None,
        normal_force=None,
        tangential_force=None,
        measured_normal=None if stroke is None else stroke.normal_force,
        measured_tangential=None if stroke is None else stroke.tangential_force,
        matching_depth=None,
        opposite_sed=None,
        wall_s=None,
        prediction=None,
        reasons={},
    )
    why = _missing(row, stroke)
    if why is not None:
        names = ("sed", "normal_force", "tangential_force", "matching_depth", "opposite_sed")
        return _Prepared(replace(row, reasons=dict.fromkeys(names, why)), None)
    return _Prepared(row, _scene(row, options))


def _bound(tau_max: float | None, options: PredictionOptions) -> float | None:
    """Return the traction bound [MPa] in the reading asked for."""
    return None if tau_max is None else tau_max * tau_scale(options)


def tau_scale(options: PredictionOptions) -> float:
    """Return what tau_max as measured is multiplied by in the reading asked for."""
    return SCALE[options.tau_reading] / SCALE["computed"]


def _missing(row: TrialPrediction, stroke: Stroke | None) -> str | None:
    """Return why there is nothing to solve; None where all is there."""
    if stroke is None:
        return "No stroke was found in this trial."
    if not stroke.kept:
        return f"The stroke was left out: {stroke.decided['kept']}."
    if row.mu is None or row.tau_max is None:
        what = "coefficient of friction" if row.mu is None else "traction bound"
        flaws = ", ".join(stroke.flaws) or "no steady sliding"
        return f"The stroke gives no {what} ({flaws})."
    if row.direction is None:
        return "Neither the stroke nor a plan tells the direction."
    if row.indentation is None:
        return "No plan tells how deep the model is to press: give an indentation."
    return None


def _scene(row: TrialPrediction, options: PredictionOptions) -> Scene:
    assert row.mu is not None  # `_missing` said so, and the same of the next two
    assert row.indentation is not None
    assert row.direction is not None
    base = _template(options)
    surface = "" if row.stimulus is None else row.stimulus.called
    return replace(
        base,
        title=f"trial {row.trial}: {surface}" if surface else f"stroke {row.stroke}",
        friction=Friction(max(row.mu, 0.0), row.tau_max),
        loading=Loading(row.indentation, SLIDES[row.direction], row.speed or DEFAULT_SPEED),
        solve=Solve(options.kinematics, options.course, base.solve.tolerance),
    )


def opposite(scene: Scene) -> Scene:
    """Return the same press, slid the other way, its settled state alone."""
    slide = SLIDES[-scene.loading.direction]
    return replace(scene, loading=replace(scene.loading, slide=slide), solve=replace(scene.solve, course="steady"))


def _force_per_mm(prepared: _Prepared) -> float | None:
    measured = prepared.row.measured_normal
    return None if measured is None or prepared.scene is None else measured / prepared.scene.finger.width


def _filled(
    prepared: _Prepared,
    found: Prediction | SolveFailure,
    back: Prediction | SolveFailure,
    depth: float | None,
) -> TrialPrediction:
    """Return the row with what the solver found, or with the reason for what it did not."""
    row, scene = prepared.row, prepared.scene
    assert scene is not None  # the caller solved it
    reasons: dict[str, str] = {}
    if depth is None:
        if scene.solve.kinematics == "finite":
            reasons["matching_depth"] = "The depth that matches is found at small strain only."
        elif row.measured_normal is None:
            reasons["matching_depth"] = "The stroke gives no steady normal force."
        else:
            reasons["matching_depth"] = (
                "The model would have to be pressed nearly to its bone, or has no settled state there."
            )
    if isinstance(back, SolveFailure):
        reasons["opposite_sed"] = str(back)
    else:
        row = replace(row, opposite_sed=back.sed_ending, opposite=back)
    row = replace(row, matching_depth=depth)
    if isinstance(found, SolveFailure):
        reasons |= dict.fromkeys(("sed", "normal_force", "tangential_force"), str(found))
        return replace(row, reasons=reasons)
    return replace(
        row,
        sed=found.sed_ending,
        error_estimate=found.error_estimate,
        normal_per_mm=found.normal_force,
        tangential_per_mm=found.tangential_force,
        normal_force=found.normal_force * scene.finger.width,
        tangential_force=found.tangential_force * scene.finger.width,
        wall_s=found.wall_s,
        prediction=found,
        reasons=reasons,
    )
