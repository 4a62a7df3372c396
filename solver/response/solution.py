"""Solve scenes to predictions with error estimates, refining the mesh until tolerances are met."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from solver._kernels.contact_system import SHEAR_LIMITED_MU
from solver.accuracy.adaptivity import refine_lines
from solver.accuracy.convergence_order import trial_warnings
from solver.accuracy.error_estimate import ContrastError, compared_sets, contrast_error
from solver.accuracy.omitted_effects import COARSE, Answer, measure_differences, with_viscosity
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import Instant
from solver.failures import Folds, NotConverged, SolveFailure
from solver.mesh import Fineness
from solver.mesh.mesher import FingerMesh
from solver.prediction import Prediction, percent
from solver.progress import Progress, check_stop, interruptible, report_progress
from solver.response import FIRST_FINENESS, Answers, Meshing, Scenes, Watch
from solver.response.finite_answers import FiniteMeshing
from solver.response.small_answers import SmallMeshing
from solver.scene import Scene

LIMIT_ACCURACY = 0.03  # relative, of a friction limit
USABLE_ESTIMATE = 0.1  # largest error estimate with which a coarser mesh's answer near a limit is given
NEAR_LIMIT = "On that mesh settled sliding ends at mu = {:.3g}, which is known to {:.0f} %: this state may lie beyond."
TOLERANCE_MISSED = "The finest mesh leaves an error estimate above the tolerance, {}."
# Of a mesh for scenes without a state on the first mesh: a fineness of 8 refuses the same ones of 316 scenes.
LIMIT_FINENESS = 6.0
FINENESS_RATIO = 1.2  # to the next mesh to try where one mesh may have no state by chance
ASSUMED_ERROR = 4.0  # error relative to the tolerance, where it is unknown
MESHINGS: dict[str, type[Meshing]] = {"small": SmallMeshing, "finite": FiniteMeshing}  # by kinematics
Rough = Callable[[Prediction], None]  # called with each answer before its refinement, to be kept if work stops


def solve(scene: Scene, progress: Progress | None = None, *, rough: Rough | None = None) -> Prediction:
    """Return the prediction of one scene; `rough` as in `solve_many`.

    Raises NoSteadyState where the scene has no full slip, NotConverged where no state was found, SceneError where its
    finger cannot be meshed, Cancelled where `progress` says so.
    """
    answer = solve_many((scene,), progress, rough=rough)[0]
    if isinstance(answer, SolveFailure):
        raise answer
    return answer


def solve_many(
    scenes: Iterable[Scene], progress: Progress | None = None, watch: Watch | None = None, *, rough: Rough | None = None
) -> tuple[Prediction | SolveFailure, ...]:
    """Return the prediction of each scene, in their order, or the failure that explains why it has none.

    Scenes with the same finger, materials and receptor share meshes. A scene that misses its tolerance is solved again
    on a finer mesh. With a `contrast_tolerance`, surfaces under the same loading share a mesh on which the estimated
    error of their differences in SED meets it. A warning says where differences may be off by more than 5 % of their
    range.

    At small strain `watch` receives each answer as soon as it is available: the position of its scene, the answer, the
    finger and the load path. It receives the answer again from every finer mesh. `rough` receives answers before they
    are refined or completed by evidence. Raises SceneError where a finger cannot be meshed, Cancelled where `progress`
    says so.
    """
    by_id: dict[int, tuple[Answer, Answer]] = {}  # each answer without and with its evidence, by its id

    def add_evidence(answer: Answer) -> Answer:
        if id(answer) not in by_id:
            if rough is not None and isinstance(answer, Prediction):
                rough(answer)
            by_id[id(answer)] = answer, _with_evidence(answer)
        return by_id[id(answer)][1]

    def watch_with_evidence(
        number: int, answer: Answer, finger: LinearFinger, path: tuple[Instant, ...] | None
    ) -> None:
        assert watch is not None
        watch(number, add_evidence(answer), finger, path)

    with interruptible(progress):
        answers = _answers(tuple(scenes), watch_with_evidence if watch else None, rough)
        return tuple(add_evidence(answer) for answer in answers)


def _answers(scenes: Sequence[Scene], watch: Watch | None = None, rough: Rough | None = None) -> tuple[Answer, ...]:
    """Return the answers of `solve_many` before `_with_evidence`."""
    groups: dict[object, Scenes] = {}  # of scenes that share meshes
    for number, scene in enumerate(scenes):
        groups.setdefault((scene.solve.kinematics, scene.finger, scene.materials, scene.receptor), {})[number] = scene
    out: dict[int, Answer] = {}
    for group in groups.values():
        out |= _solve_group(group, watch, rough)
    answers = (out[number] for number in range(len(scenes)))
    return tuple(answer.in_a_sentence() if isinstance(answer, SolveFailure) else answer for answer in answers)


def _with_evidence(prediction: Answer) -> Answer:
    """Return a prediction with the evidence on omitted effects that its scene requests; a failure unchanged."""
    if not isinstance(prediction, Prediction) or prediction.scene.solve.evidence == "quick":
        return prediction
    report_progress("estimating what the model leaves out")
    check_stop(1.0)
    prediction = _with_earlier_slides(with_viscosity(prediction))
    if prediction.scene.solve.evidence == "estimated":
        return prediction
    report_progress("measuring what the model leaves out")
    return measure_differences(prediction, _answers)


def _with_earlier_slides(prediction: Prediction) -> Prediction:
    """Return a prediction with a warning for each earlier slide that has no settled state on a coarse mesh."""
    earlier = prediction.scene.earlier_slides() if prediction.scene.solve.course == "steady" else ()
    coarse = [replace(slide, solve=replace(slide.solve, tolerance=COARSE, evidence="estimated")) for slide in earlier]
    sentences = (
        f"A slide before this one, the other way, has no settled state that it could come from: {slide}"
        for slide in _answers(coarse)
        if isinstance(slide, SolveFailure)
    )
    return replace(prediction, warnings=(*prediction.warnings, *sentences))


def _solve_group(scenes: Scenes, watch: Watch | None, rough: Rough | None) -> Answers:
    """Return the answers of scenes that share meshes."""
    kind = next(iter(scenes.values())).solve.kinematics
    meshing = MESHINGS[kind](scenes)
    if kind == "small" and any(scene.solve.course == "history" for scene in scenes.values()):
        return _march(scenes, meshing, watch)
    answers, warnings = _refine(scenes, meshing, watch, rough)
    return {number: _add_warnings(answer, warnings[number]) for number, answer in answers.items()}


def _march(scenes: Scenes, meshing: Meshing, watch: Watch | None) -> Answers:
    """Return the answers of load paths, each marched once, on the finest mesh that a settled state needs.

    Warnings of a settled state apply to its load path too.
    """
    ends = {i: replace(scene, solve=replace(scene.solve, course="steady")) for i, scene in scenes.items()}
    answers, warnings = _refine(ends, meshing, None, None)
    settled = [answer for answer in answers.values() if isinstance(answer, Prediction)]
    mesh: Fineness = LIMIT_FINENESS
    if settled:
        mesh = max(settled, key=lambda answer: answer.dofs).geometry.sizing.fineness
    with_warnings: dict[int, Answer] = {}

    def record(number: int, answer: Answer, finger: LinearFinger, path: tuple[Instant, ...] | None) -> None:
        with_warnings[number] = _add_warnings(answer, warnings[number])
        if watch is not None:
            watch(number, with_warnings[number], finger, path)

    return meshing.answers(scenes, mesh, record) | with_warnings


def _refine(
    scenes: Scenes, meshing: Meshing, watch: Watch | None, rough: Rough | None
) -> tuple[dict[int, Answer], dict[int, tuple[str, ...]]]:
    """Refine until every error estimate meets its tolerance, including those of contrasts, or no mesh may be finer.

    Returns the answers, and warnings about errors that the finest mesh leaves. Scenes that share a mesh share the finer
    one. Where that has no state, `_coarser_counts` decides which answer stays.
    """
    contrast_sets = compared_sets(scenes)
    answers: Answers = {}
    best: dict[int, Answer] = {}  # the answer of each scene with the smallest estimate
    failures: dict[int, SolveFailure] = {}  # on finer meshes, of scenes whose coarser answers count
    work: dict[Fineness, list[int]] = {FIRST_FINENESS: list(scenes)}
    meshes: dict[int, Fineness] = {}  # the last mesh of each scene
    while True:
        for mesh, todo in work.items():
            meshes |= dict.fromkeys(todo, mesh)
            for i, answer in meshing.answers({i: scenes[i] for i in todo}, mesh, watch).items():
                failure = _loss(answer, answers.get(i))
                if failure is not None:
                    failures[i] = failure
                    continue
                answers[i] = answer
                best[i] = min(answer, best.get(i, answer), key=_estimate)
        errors = _errors(answers, failures, meshes)
        contrasts = [
            contrast_error([p for i in together if isinstance(p := answers[i], Prediction)])
            for together in contrast_sets
        ]
        # A scene without a state on a finer mesh is not refined again, or the loop would not end.
        refinable = [
            [i for i in together if isinstance(answers[i], Prediction) and i not in failures]
            for together in contrast_sets
        ]
        reductions = _error_reductions(scenes, errors, refinable, contrasts)
        work = _finer({i: answers[i] for i in sorted(reductions)}, reductions)
        if not work:
            break
        for answer in answers.values():
            if rough is not None and isinstance(answer, Prediction):
                rough(answer)
    answers |= {i: best[i] for i, miss in errors.items() if miss > 1.0}
    if isinstance(meshing, FiniteMeshing):  # where a fine mesh may miss the state
        failures |= _fall_back(scenes, answers, meshing)
    contrast_of = {i: contrast for together, contrast in zip(contrast_sets, contrasts, strict=True) for i in together}
    errors = _errors(answers, failures, meshes)
    return answers, {i: _sentences(contrast_of.get(i), errors[i], answers[i], failures.get(i)) for i in scenes}


def _error_reductions(
    scenes: Scenes,
    errors: Mapping[int, float],
    contrast_sets: Sequence[Sequence[int]],
    contrasts: Sequence[ContrastError],
) -> dict[int, float]:
    """Return the factor by which the error of each scene that is solved again must fall.

    `errors` are those of all scenes relative to their tolerances, `contrasts` those of differences within each of
    `contrast_sets`. Surfaces that are compared are refined together.
    """
    out = {i: miss for i, miss in errors.items() if miss > 1.0}
    for together, contrast in zip(contrast_sets, contrasts, strict=True):
        tolerance = min((t for i in together if (t := scenes[i].solve.contrast_tolerance)), default=np.inf)
        if tolerance < np.inf and (contrast.share > tolerance or any(i in out for i in together)):
            out |= {i: max(errors[i], contrast.share / tolerance) for i in together}
    return out


def _finer(answers: Answers, reductions: Mapping[int, float]) -> dict[Fineness, list[int]]:
    """Return the scenes to solve again, grouped by the finer mesh that they need; empty where no mesh may be finer.

    The errors of these `answers` must fall by the factors `reductions`. Scenes that share a mesh share the finer one. A
    scene without a state is solved once more at `LIMIT_FINENESS`.
    """
    members: dict[FingerMesh | None, list[int]] = {}
    for i, answer in answers.items():
        members.setdefault(answer.geometry if isinstance(answer, Prediction) else None, []).append(i)
    out: dict[Fineness, list[int]] = {}
    for mesh, together in members.items():
        finer: Fineness | None = LIMIT_FINENESS
        if mesh is not None:
            nested = [(reductions[i], answer.nested) for i in together if isinstance(answer := answers[i], Prediction)]
            with_nested = [(miss, numbers.shares) for miss, numbers in nested if numbers is not None]
            parts = [miss * shares for miss, shares in with_nested if shares is not None]
            finer = refine_lines(mesh, None if len(with_nested) < len(nested) or not parts else np.max(parts, axis=0))
        if finer is not None:
            out.setdefault(finer, []).extend(together)
    return out


def _fall_back(scenes: Scenes, answers: Answers, meshing: Meshing) -> dict[int, SolveFailure]:
    """Solve scenes without a state on a coarser mesh than the first; return the failures that this replaces.

    Under steep friction a single mesh may have no state by chance, so a slightly finer one is tried last.
    """
    failures: dict[int, SolveFailure] = {}
    for i, scene in scenes.items():
        if isinstance(failure := answers[i], SolveFailure) and _is_doubtful(scene, failure):
            answer = meshing.answers({i: scene}, FIRST_FINENESS / FINENESS_RATIO)[i]
            if _coarser_counts(answer, failure):
                answers[i], failures[i] = answer, failure
        if isinstance(answers[i], NotConverged) and scene.friction.mu > SHEAR_LIMITED_MU:
            answers[i] = meshing.answers({i: scene}, FIRST_FINENESS * FINENESS_RATIO)[i]
    return failures


def _is_doubtful(scene: Scene, failure: SolveFailure) -> bool:
    """Return whether a state may exist despite the failure: not converged, or a limit within its accuracy."""
    if isinstance(failure, NotConverged):
        return True
    limit = failure.limit_mu
    return limit is not None and float(scene.friction.mu) <= (1.0 + LIMIT_ACCURACY) * limit


def _coarser_counts(coarser: Answer, failure: SolveFailure) -> bool:
    """Return whether the answer of a coarser mesh counts where a finer mesh has no state.

    It does not count where the finer mesh shows that no state exists, nor where its error estimate is too large, as it
    is close to a limit: then the limit is the answer.
    """
    if not isinstance(coarser, Prediction) or not _is_doubtful(coarser.scene, failure):
        return False
    return isinstance(failure, NotConverged) or coarser.error_estimate <= USABLE_ESTIMATE


def _loss(answer: Answer, coarser: Answer | None) -> SolveFailure | None:
    """Return the failure for which the answer of the coarser mesh counts in place of this one, or None."""
    failure = answer if isinstance(answer, SolveFailure) else None
    if isinstance(answer, Prediction) and _estimate(coarser) < 1.0:
        failure = answer.unknown
    return failure if failure is not None and coarser is not None and _coarser_counts(coarser, failure) else None


def _estimate(answer: Answer | None) -> float:
    """Return the error estimate of an answer, 1 where it is unknown."""
    return answer.error_estimate if isinstance(answer, Prediction) and answer.nested is not None else 1.0


def _sentences(
    contrast: ContrastError | None, error: float, answer: Answer, failure: SolveFailure | None
) -> tuple[str, ...]:
    """Return the warnings of an answer from the finest mesh."""
    warnings: list[str] = []
    if isinstance(failure, Folds):
        warnings.append(f"This is a coarse mesh's answer, and its error estimate: on finer ones {failure}.")
    elif failure is not None:
        warnings.append("A finer mesh did not find this state: this is the coarser one's, and its error estimate.")
        if failure.limit_mu is not None:
            warnings.append(NEAR_LIMIT.format(failure.limit_mu, 100.0 * LIMIT_ACCURACY))
    if isinstance(answer, Prediction) and answer.unknown is not None:
        warnings.append(f"The error of this answer is not known, since {answer.unknown}.")
    elif error > 1.0 and isinstance(answer, Prediction) and (target := answer.scene.solve.target) is not None:
        warnings.append(TOLERANCE_MISSED.format(percent(target)))
    if isinstance(answer, Prediction):
        warnings += trial_warnings(answer.scene, answer.indentation)
    if contrast is not None and contrast.warning:
        warnings.append(contrast.warning)
    return tuple(warnings)


def _add_warnings(answer: Answer, sentences: tuple[str, ...]) -> Answer:
    return (
        replace(answer, warnings=(*answer.warnings, *sentences))
        if sentences and isinstance(answer, Prediction)
        else answer
    )


def _errors(answers: Answers, failures: Mapping[int, SolveFailure], meshes: Mapping[int, Fineness]) -> dict[int, float]:
    """Return the errors of all answers relative to their tolerances, 0 for coarser answers in place of `failures`."""
    return {
        i: 0.0 if i in failures else _error_by_tolerance(answer, on_first=meshes[i] == FIRST_FINENESS)
        for i, answer in answers.items()
    }


def _error_by_tolerance(answer: Answer, *, on_first: bool) -> float:
    """Return an answer's error estimate relative to the tolerance of its scene, `ASSUMED_ERROR` where it is unknown.

    A failure on the first mesh (`on_first`) counts as unknown, because a finer mesh may have a state. Where the free
    cut folds, the error is unknown on finer meshes too, and counts as 0.
    """
    if isinstance(answer, SolveFailure) and on_first:
        return ASSUMED_ERROR
    if not isinstance(answer, Prediction) or isinstance(answer.unknown, Folds):
        return 0.0
    if answer.nested is None:
        return ASSUMED_ERROR
    target = answer.scene.solve.target
    return 0.0 if target is None else answer.error_estimate / target
