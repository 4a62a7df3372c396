"""From strokes to scenes, and to the prediction of a session: the model's input for each trial and its variants.

All scenes of a session are solved together on one mesh, so that differences are accurate.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from sessions.plan.plan import DISTAL_TO_PROXIMAL, PROXIMAL_TO_DISTAL, Block, SessionPlan, Trial
from sessions.prediction.options import PredictionOptions, bound, template, with_own_finger
from sessions.prediction.stored import SessionPrediction, TrialPrediction, Variant, known_error, settled_numbers
from sessions.strokes import Analysis, FrictionParameters, Stroke
from solver import Finger, Friction, Loading, Prediction, Scene, SceneError, Slide, Solve, SolveFailure, solve_many
from solver.accuracy.audits import inside_out_warning
from solver.continuation.small_states import matching_depths
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import Instant
from solver.progress import Progress, report_part
from solver.response.nearby import Gradient, Nearby, nearby
from solver.scene.published import BOUND_SCALE

SLIDES: dict[int, Slide] = {PROXIMAL_TO_DISTAL: "+x", DISTAL_TO_PROXIMAL: "-x"}
CONTRAST = 0.05  # error of differences between surfaces, relative to their range: far below the resolution of scores
DEFAULT_SPEED = 20.0  # where none was measured [mm/s]; rescales only the time of a course


# The row of one trial or stroke as known before it is solved, and its scene; None without one to solve
ModelInput = tuple[TrialPrediction, Scene | None]


def scenes_of(analysis: Analysis, plan: SessionPlan, options: PredictionOptions) -> Mapping[int, Scene]:
    """Return the scene of each trial that `predict` would solve, by the trial's number."""
    inputs = model_inputs(analysis, plan, with_own_finger(options, plan))
    return {row.trial: scene for row, scene in inputs if row.trial is not None and scene is not None}


def model_inputs(analysis: Analysis, plan: SessionPlan, options: PredictionOptions) -> Iterator[ModelInput]:
    """Yield the model's input for every planned trial, or for every stroke without a plan."""
    if not plan.blocks:
        by_stroke = {friction.stroke: friction for friction in analysis.friction}
        for number in range(len(analysis.strokes)):
            yield _model_input(analysis, number, by_stroke.get(number), options)
        return
    if not plan.forces:
        return
    by_trial = {friction.trial: friction for friction in analysis.friction}
    first_stroke = {stroke.trial: number for number, stroke in reversed([*enumerate(analysis.strokes)])}
    for block in plan.blocks:
        for trial in block.trials if block.phase == "main" else ():
            friction = by_trial.get(trial.number)
            number = first_stroke.get(trial.number) if friction is None else friction.stroke
            yield _model_input(analysis, number, friction, options, trial, block)


def _model_input(
    analysis: Analysis,
    number: int | None,
    friction: FrictionParameters | None,
    options: PredictionOptions,
    trial: Trial | None = None,
    block: Block | None = None,
) -> ModelInput:
    """Return the model's input for stroke `number`, with the reason for every missing result."""
    stroke = None if number is None else analysis.strokes[number]
    direction = friction.direction if friction is not None else None
    if direction is None and trial is not None:
        direction = trial.direction
    planned_depth = None if block is None else block.indentation
    row = TrialPrediction(
        trial=None if trial is None else trial.number,
        stroke=number,
        block=None if block is None else block.name,
        stimulus=None if trial is None else trial.stimulus,
        mu=None if friction is None else friction.mu,
        mu_rule="" if friction is None else friction.rule,
        tau_max=None if friction is None else bound(friction.tau_max, options),
        indentation=planned_depth if options.indentation is None else options.indentation,
        direction=direction,
        speed=None if friction is None else friction.speed,
        measured_normal=None if stroke is None else stroke.normal_force,
        measured_tangential=None if stroke is None else stroke.tangential_force,
    )
    reason = _missing_reason(row, stroke)
    if reason is not None:
        names = ("sed", "normal_force", "tangential_force", "matching_depth", "opposite_sed")
        return replace(row, reasons=dict.fromkeys(names, reason)), None
    return row, _scene(row, options)


def _missing_reason(row: TrialPrediction, stroke: Stroke | None) -> str | None:
    """Return why there is nothing to solve; None with complete input."""
    if stroke is None:
        return "No stroke was found in this trial."
    if not stroke.kept:
        return f"The stroke was left out: {stroke.decided['kept']}."
    if row.mu is None or row.tau_max is None:
        number = "coefficient of friction" if row.mu is None else "traction bound"
        flaws = ", ".join(stroke.flaws) or "no steady sliding"
        return f"The stroke gives no {number} ({flaws})."
    if row.direction is None:
        return "Neither the stroke nor a plan gives the direction."
    if row.indentation is None:
        return "No plan gives the depth of the press: give it with 'daq-app predict --indentation MM'."
    return None


def _scene(row: TrialPrediction, options: PredictionOptions) -> Scene:
    assert row.mu is not None  # `_missing_reason` has checked these three
    assert row.indentation is not None
    assert row.direction is not None
    base = template(options)
    surface = "" if row.stimulus is None else row.stimulus.display_name
    return replace(
        base,
        title=f"trial {row.trial}: {surface}" if surface else f"stroke {row.stroke}",
        friction=Friction(max(row.mu, 0.0), row.tau_max),
        loading=Loading(row.indentation, SLIDES[row.direction], row.speed or DEFAULT_SPEED),
        solve=Solve(options.kinematics, options.course, base.solve.tolerance, contrast_tolerance=CONTRAST),
    )


def opposite(scene: Scene) -> Scene:
    """Return the same press with the opposite slide, settled state only."""
    slide = SLIDES[-scene.loading.direction]
    return replace(scene, loading=replace(scene.loading, slide=slide), solve=replace(scene.solve, course="steady"))


def scene_along(row: TrialPrediction, variant: Variant, options: PredictionOptions) -> Scene | str:
    """Return the settled scene of a trial in a variant, or the reason for its absence."""
    if row.mu is None or row.tau_max is None or row.direction is None or row.indentation is None:
        return row.reasons.get("sed", "The trial gives no scene.")
    if variant.driven == "force" and (row.measured_normal is None or row.measured_normal <= 0.0):
        return "The stroke gives no steady normal force."
    try:
        scene = _scene(row, replace(options, kinematics=variant.kinematics, course="steady"))
    except SceneError as unfit:  # a finger whose tissues have no law at that strain
        return str(unfit)
    tau_max = row.tau_max / BOUND_SCALE[options.tau_reading] * BOUND_SCALE[variant.tau_reading]
    scene = replace(scene, friction=replace(scene.friction, tau_max=tau_max))
    if variant.driven == "other way":
        return opposite(scene)
    if variant.driven == "force":
        slide, speed = scene.loading.slide, scene.loading.speed
        force = Loading(slide=slide, speed=speed, normal_force=row.measured_normal, force_unit="N")
        return replace(scene, loading=force)
    return scene


def with_loads(scene: Scene, loads: Mapping[str, float]) -> Scene:
    """Return a scene with another "mu" [-], "tau_max" [MPa] in the model's reading, or driving "force" [N]."""
    friction, loading = scene.friction, scene.loading
    mu, tau_max = loads.get("mu", friction.mu), loads.get("tau_max", friction.tau_max)
    force = loads.get("force", loading.normal_force)
    return replace(
        scene,
        friction=replace(friction, mu=mu, tau_max=tau_max),
        loading=loading if force == loading.normal_force else replace(loading, normal_force=force),
    )


def part_of(progress: Progress | None, low: float, high: float) -> Progress | None:
    """Scale a progress callback to the part from `low` to `high` of the whole."""
    return None if progress is None else lambda share: progress(low + (high - low) * share)


def settled_predictions(scenes: Sequence[Scene], progress: Progress | None = None) -> tuple[Prediction | None, ...]:
    """Return the prediction of each scene, None where it has no settled state. Raises Cancelled."""
    return tuple(None if isinstance(answer, str) else answer for answer in predict_scenes(scenes, progress))


def predict_scenes(scenes: Sequence[Scene], progress: Progress | None = None) -> tuple[Prediction | str, ...]:
    """Return the prediction of each scene, or why it has no settled state. Raises Cancelled."""
    answers = solve_many([quick(scene) for scene in scenes], progress)
    return tuple(str(answer) if isinstance(answer, SolveFailure) else answer for answer in answers)


def quick(scene: Scene) -> Scene:
    """Return a scene without the full estimates of omitted effects, which take as long as the answer."""
    return replace(scene, solve=replace(scene.solve, evidence="quick"))


def seds_at(
    strokes: Sequence[tuple[float, float, float, int, float]], options: PredictionOptions
) -> tuple[float | None, ...]:
    """Return the settled SED [MPa] for mu, tau_max [MPa], depth [mm], direction and speed; None where none settles."""
    base = template(options)
    scenes = [
        replace(
            base,
            friction=Friction(mu, bound(tau_max, options)),
            loading=Loading(depth, SLIDES[direction], speed),
            solve=Solve(options.kinematics, "steady", base.solve.tolerance),
        )
        for mu, tau_max, depth, direction, speed in strokes
    ]
    return tuple(None if prediction is None else prediction.sed_ending for prediction in settled_predictions(scenes))


def slides(predictions: Sequence[Prediction], progress: Progress | None = None) -> Iterator[Nearby | None]:
    """Yield the slide of each prediction, from which neighbours and derivatives take only a few small systems.

    None where the slide depends on the path to it. Raises Cancelled.
    """
    for number, slide in enumerate(nearby(predictions)):
        report_part(progress, number / len(predictions))
        yield slide


def derivatives_by(slide: Nearby, scene: Scene) -> Mapping[str, Mapping[str, float]]:
    """Return the derivatives, by each load of `with_loads`, at the slide of a scene.

    They are of "sed" [MPa], the finger's "normal_force" and "tangential_force" [N], and the "indentation" [mm].
    """
    derivatives, force, width = slide.derivatives(), scene.loading.normal_force, scene.finger.width
    per_mm = 0.0 if force is None else (scene.normal_force or 0.0) / force  # per unit of the given force

    def by_load(slope: Gradient, unit: float = 1.0) -> dict[str, float]:
        by_force = per_mm * (slope.normal_force or 0.0)
        return {"mu": unit * slope.mu, "tau_max": unit * slope.tau_max, "force": unit * by_force}

    return {
        "sed": by_load(derivatives.sed),
        "normal_force": by_load(derivatives.normal, width),
        "tangential_force": by_load(derivatives.tangential, width),
        "indentation": by_load(derivatives.indentation),
    }


def doubt_of(prediction: Prediction) -> str:
    """Return a warning where the model was driven beyond its range, else ""."""
    return inside_out_warning(prediction.audits)


@dataclass(frozen=True, slots=True, eq=False)
class SolutionPath:
    """The model's way to the answer of one trial, for pictures."""

    scene: Scene
    finger: LinearFinger
    march: tuple[Instant, ...] | None  # None without one that can be drawn


Watch = Callable[[int, TrialPrediction, SolutionPath | None], None]  # position of the row, the row, its solution path


def predict(
    analysis: Analysis,
    plan: SessionPlan,
    options: PredictionOptions | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
    first: int | None = None,
) -> SessionPrediction:
    """Return the predictions for every trial of `plan`, or for every stroke where it has none.

    The finger is that of the options, or else the published one with the plan's values of the subject. A trial without
    friction, depth or a settled state keeps its row, with the reason. The row at position `first` is solved first.
    `watch` takes each row when it is solved, at finite strain when all are. Raises SceneError where the options give no
    valid scene, Cancelled when `progress` returns False.
    """
    options = with_own_finger(options or PredictionOptions(), plan)
    inputs, width = list(model_inputs(analysis, plan, options)), template(options).finger.width
    rows = [row for row, _ in inputs]
    scene_of_row = {n: scene for n, (_, scene) in enumerate(inputs) if scene is not None}
    report: Watch = watch or (lambda _number, _row, _path: None)
    for number in (n for n in range(len(rows)) if n not in scene_of_row):
        report(number, rows[number], None)
    order = sorted(scene_of_row, key=lambda n: (n != first, n))
    scenes = [scene_of_row[n] for n in order]
    is_small = options.kinematics == "small"  # depths are matched at small strain; finite strain has others
    forces = {n: force / width for n in order if is_small and (force := rows[n].measured_normal) is not None}
    depths = dict(zip(forces, matching_depths([scene_of_row[n] for n in forces], [*forces.values()]), strict=True))
    solutions: dict[int, SolutionPath] = {}
    answers: dict[int, Prediction | SolveFailure] = {}

    def fill_row(position: int) -> TrialPrediction:
        number = order[position]
        return _fill_row(inputs[number], answers[2 * position], answers[2 * position + 1], depths.get(number))

    def take_answer(
        number: int, answer: Prediction | SolveFailure, finger: LinearFinger, march: tuple[Instant, ...] | None
    ) -> None:
        answers[number] = answer
        position, is_opposite = divmod(number, 2)
        if not is_opposite:
            solutions[position] = SolutionPath(scenes[position], finger, march)
        elif 2 * position in answers:
            report(order[position], fill_row(position), solutions.get(position))

    pairs = [variant for scene in scenes for variant in (scene, quick(opposite(scene)))]
    answers |= dict(enumerate(solve_many(pairs, progress, take_answer if watch else None)))
    for position, number in enumerate(order):
        rows[number] = fill_row(position)
        if not is_small:
            report(number, rows[number], None)
    return SessionPrediction(
        analysis=analysis,
        trials=tuple(rows),
        width=width,
        width_origin="assumed" if width == Finger().width else "set",
        options=options,
    )


def _fill_row(
    model_input: ModelInput, answer: Prediction | SolveFailure, mirror: Prediction | SolveFailure, depth: float | None
) -> TrialPrediction:
    """Return the row with the solver's numbers, and with reasons for missing ones."""
    row, scene = model_input
    assert scene is not None  # the caller solved it
    reasons: dict[str, str] = {}
    if depth is None:
        if scene.solve.kinematics == "finite":
            reasons["matching_depth"] = "The depth that matches is found at small strain only."
        elif row.measured_normal is None:
            reasons["matching_depth"] = "The stroke gives no steady normal force."
        else:
            reason = "The model would have to be pressed nearly to its bone, or has no settled state there."
            reasons["matching_depth"] = reason
    row = replace(row, matching_depth=depth)
    if isinstance(mirror, SolveFailure):
        reasons["opposite_sed"] = str(mirror)
    else:
        error = known_error(mirror, mirror.error_estimate)
        row = replace(row, opposite_sed=mirror.sed_ending, opposite_error=error, opposite=mirror)
    if isinstance(answer, SolveFailure):
        reasons |= dict.fromkeys(("sed", "normal_force", "tangential_force"), str(answer))
        return replace(row, reasons=reasons)
    if answer.unknown is not None:
        reasons["error_estimate"] = f"The error is not known, since {answer.unknown}."
    return replace(
        row,
        **settled_numbers(answer),
        normal_per_mm=answer.normal_force,
        tangential_per_mm=answer.tangential_force,
        wall_s=answer.wall_s,
        prediction=answer,
        reasons=reasons,
    )
