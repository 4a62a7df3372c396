"""The prediction of a session: all its scenes solved together on one mesh, so that differences are accurate."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from sessions.plan.plan import SessionPlan
from sessions.prediction.options import PredictionOptions, template, with_own_finger
from sessions.prediction.scenes import Prepared, Progress, opposite, prepared_cases, quick
from sessions.prediction.stored import ERROR_NOT_KNOWN, SessionPrediction, TrialPrediction, known_error
from sessions.strokes import Analysis
from solver import Finger, Prediction, Scene, SolveFailure, solve_many
from solver.continuation.small_states import matching_depths
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import Instant


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """How the model came to its answer for one trial, for pictures of it."""

    scene: Scene
    finger: LinearFinger
    march: tuple[Instant, ...] | None  # None where it has none that can be drawn


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
    without friction, depth or a settled state keeps its row, with the reason. The row at position `first` is solved
    first. `watch` takes each row as soon as it is known, at finite strain once all are. Raises SceneError where the
    options make no scene, Cancelled where `progress` says so.
    """
    chosen = with_own_finger(options or PredictionOptions(), plan)
    prepared, width = prepared_cases(analysis, plan, chosen), template(chosen).finger.width
    rows = [one.row for one in prepared]
    report: Watch = watch or (lambda _number, _row, _way: None)
    for number, one in enumerate(prepared):
        if one.scene is None:
            report(number, one.row, None)
    solved = sorted((n for n, one in enumerate(prepared) if one.scene is not None), key=lambda n: (n != first, n))
    scenes = [scene for n in solved if (scene := prepared[n].scene) is not None]
    small = chosen.kinematics == "small"  # a depth is matched on its finger, which finite strain would put elsewhere
    measured = [prepared[n].row.measured_normal if small else None for n in solved]
    depths = _depths(scenes, [None if f is None else f / s.finger.width for f, s in zip(measured, scenes, strict=True)])
    ways: dict[int, Way] = {}
    answers: dict[int, Prediction | SolveFailure] = {}

    def known(at: int) -> TrialPrediction:
        return _filled(prepared[solved[at]], answers[2 * at], answers[2 * at + 1], depths[at])

    def seen(
        number: int, answer: Prediction | SolveFailure, finger: LinearFinger, march: tuple[Instant, ...] | None
    ) -> None:
        answers[number] = answer
        at, back = divmod(number, 2)
        if not back:
            ways[at] = Way(scenes[at], finger, march)
        elif 2 * at in answers:
            report(solved[at], known(at), ways.get(at))

    pairs = [one for scene in scenes for one in (scene, quick(opposite(scene)))]
    answers |= dict(enumerate(solve_many(pairs, progress, seen if watch else None)))
    for at, number in enumerate(solved):
        rows[number] = known(at)
        if not small:
            report(number, rows[number], None)
    return SessionPrediction(
        simulated=analysis.simulated,
        trials=tuple(rows),
        width=width,
        width_origin="assumed" if width == Finger().width else "set",
        options=chosen,
        decisions=analysis.decisions,
        area=analysis.settings.area,
        gain_error=analysis.settings.gain_error,
        bootstrap_seed=analysis.settings.bootstrap_seed,
    )


def _depths(scenes: Sequence[Scene], forces: Sequence[float | None]) -> list[float | None]:
    """Return for each scene the depth at which it bears its force [N/mm], or None where it has none."""
    wanted = [(scene, force) for scene, force in zip(scenes, forces, strict=True) if force is not None]
    matched = iter(matching_depths([scene for scene, _ in wanted], [force for _, force in wanted]))
    return [None if force is None else next(matched) for force in forces]


def _filled(
    prepared: Prepared, answer: Prediction | SolveFailure, back: Prediction | SolveFailure, depth: float | None
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
            why = "The model would have to be pressed nearly to its bone, or has no settled state there."
            reasons["matching_depth"] = why
    row = replace(row, matching_depth=depth)
    if isinstance(back, SolveFailure):
        reasons["opposite_sed"] = str(back)
    else:
        error = known_error(back, back.error_estimate)
        row = replace(row, opposite_sed=back.sed_ending, opposite_error=error, opposite=back)
    if isinstance(answer, SolveFailure):
        reasons |= dict.fromkeys(("sed", "normal_force", "tangential_force"), str(answer))
        return replace(row, reasons=reasons)
    if answer.nested is None:
        reasons["error_estimate"] = ERROR_NOT_KNOWN
    return replace(
        row,
        sed=answer.sed_ending,
        error_estimate=known_error(answer, answer.error_estimate),
        normal_per_mm=answer.normal_force,
        tangential_per_mm=answer.tangential_force,
        normal_force=answer.normal_force * scene.finger.width,
        tangential_force=answer.tangential_force * scene.finger.width,
        normal_force_error=known_error(answer, answer.normal_force_error),
        tangential_force_error=known_error(answer, answer.tangential_force_error),
        wall_s=answer.wall_s,
        prediction=answer,
        reasons=reasons,
    )
