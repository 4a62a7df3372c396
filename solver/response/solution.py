"""From scenes to predictions: one mesh for all that share a finger, and an error estimate with every answer."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver._kernels.contact_system import STEEP
from solver.accuracy.error_estimate import ContrastError, compared_sets, contrast_error
from solver.accuracy.omitted_effects import COARSE, Answers, measure_differences
from solver.accuracy.refinement import refine_lines
from solver.accuracy.residual_overstress import with_viscosity
from solver.equilibrium.expected_depth import expected_depth
from solver.equilibrium.finger import LinearFinger
from solver.equilibrium.load_path import Instant
from solver.failures import NoSteadyState, NotConverged, SolveFailure
from solver.mesh import Lines
from solver.mesh.mesher import FingerMesh
from solver.prediction import Prediction
from solver.progress import Progress, interruptible, report_progress
from solver.response.answers import MESHINGS, Answer, Meshing, Watch
from solver.scene import Scene

KNOWN = 0.03  # of a limit of friction, to which it is known
WORTH = 0.1  # error estimate up to which a coarser mesh's number near a limit is worth more than the limit alone
NEAR_LIMIT = "That mesh ends settled sliding at mu = {:.3g}, which is known to {:.0f} %: this state may lie beyond."
MISSES = "The finest mesh leaves an error estimate above the tolerance asked for."
UNKNOWN = "How far this is off is not known, since the nested mesh has no such state: ask for less friction or depth."
NOT_NESTED = NotConverged("The nested mesh has no such state.")
DEFAULT = {"small": 8.0, "finite": 6.0}  # fineness where no tolerance is asked for: estimates of 0.1 % and 0.4 %
FIRST = 4.0  # fineness where one is asked for: on 3 and on 5 ten surfaces take as long to 1 %
NEXT = 1.2  # times as fine, or as coarse, is the mesh that is asked next where one may have no state by chance
NOT_KNOWN = 4.0  # times the tolerance, that an error is taken for of which nothing is known
Rough = Callable[[Prediction], None]  # called with an answer before it is refined: what there is, should work stop


def solve(scene: Scene, progress: Progress | None = None, *, rough: Rough | None = None) -> Prediction:
    """Return the prediction of one scene; `rough` as in `solve_many`.

    Raises NoSteadyState where the scene has no settled sliding, NotConverged where none was found, SceneError where
    its finger cannot be meshed, Cancelled where `progress` says so.
    """
    answer = solve_many((scene,), progress, rough=rough)[0]
    if isinstance(answer, SolveFailure):
        raise answer
    return answer


def solve_many(
    scenes: Sequence[Scene], progress: Progress | None = None, watch: Watch | None = None, *, rough: Rough | None = None
) -> tuple[Prediction | SolveFailure, ...]:
    """Return the prediction of each scene, in their order, or the failure that says why it has none.

    Scenes with the same finger, materials and receptor share meshes; those whose tolerance is missed are solved again
    on a finer one. Where a `contrast_tolerance` is asked for, surfaces pressed alike share a mesh so fine that
    differences in SED between them are as good as that, as estimated. Where they may be off by more than 5 % of their
    range, a warning says by how much.

    At small strain `watch` is given each answer, by the position of its scene, as soon as it is found, with the finger
    and the way that led to it; where another mesh is needed it is given once more. `rough` is given the answers that a
    tolerance sends to a finer mesh, or that await their evidence. Raises SceneError where a finger cannot be meshed,
    Cancelled where `progress` says so.
    """
    known: dict[int, tuple[Answer, Answer]] = {}  # an answer's evidence is made once

    def add_evidence(answer: Answer) -> Answer:
        if id(answer) not in known:
            if rough is not None and isinstance(answer, Prediction):
                rough(answer)
            known[id(answer)] = answer, _with_evidence(answer, progress)
        return known[id(answer)][1]

    def watch_with_evidence(number: int, answer: Answer, finger: LinearFinger, way: tuple[Instant, ...] | None) -> None:
        assert watch is not None
        watch(number, add_evidence(answer), finger, way)

    answers = _answers(scenes, progress, watch_with_evidence if watch else None, rough)
    return tuple(add_evidence(answer) for answer in answers)


def _answers(
    scenes: Sequence[Scene], progress: Progress | None = None, watch: Watch | None = None, rough: Rough | None = None
) -> tuple[Answer, ...]:
    """Do the same, evidence as far as it comes with the answers."""
    out: dict[int, Answer] = {}
    for group in _groups(scenes):
        answers = _solve_group([scenes[i] for i in group], progress, _within(watch, group), rough)
        out |= dict(zip(group, answers, strict=True))
    answers = (out[i] for i in range(len(scenes)))
    return tuple(one.in_a_sentence() if isinstance(one, SolveFailure) else one for one in answers)


def _with_evidence(prediction: Answer, progress: Progress | None) -> Answer:
    """Return the answer with its evidence marched, and measured where its scene asks for that."""
    if not isinstance(prediction, Prediction) or prediction.scene.solve.evidence == "quick":
        return prediction
    report_progress("estimating what the model leaves out")
    with interruptible(progress, lambda: 1.0):
        prediction = with_viscosity(prediction)
    prediction = _with_earlier_slides(prediction, lambda scenes: _answers(scenes, progress))
    if prediction.scene.solve.evidence == "estimated":
        return prediction
    report_progress("measuring what the model leaves out")
    return measure_differences(prediction, lambda scenes: _answers(scenes, progress))


def _with_earlier_slides(prediction: Prediction, solved: Answers) -> Prediction:
    """Return a settled answer with a warning of every slide before that would not have settled, on a coarse mesh."""
    before = prediction.scene.earlier_slides() if prediction.scene.solve.course == "steady" else ()
    quick = [replace(leg, solve=replace(leg.solve, tolerance=COARSE, evidence="estimated")) for leg in before]
    lost = [leg for leg in solved(quick) if isinstance(leg, SolveFailure)] if quick else []
    more = (
        f"A slide before this one, the other way, has no settled state that it could come from: {leg}" for leg in lost
    )
    return replace(prediction, warnings=(*prediction.warnings, *more))


def _groups(scenes: Sequence[Scene]) -> list[list[int]]:
    groups: dict[object, list[int]] = {}
    for number, scene in enumerate(scenes):
        groups.setdefault((scene.solve.kinematics, scene.finger, scene.materials, scene.receptor), []).append(number)
    return list(groups.values())


def _within(watch: Watch | None, group: Sequence[int]) -> Watch | None:
    """Return `watch` for a group, called with positions in the group."""
    if watch is None:
        return None
    return lambda number, answer, finger, way: watch(group[number], answer, finger, way)


def _solve_group(
    scenes: list[Scene], progress: Progress | None, watch: Watch | None, rough: Rough | None
) -> list[Answer]:
    """Solve scenes that share a mesh on the coarsest that does."""
    kind = scenes[0].solve.kinematics
    depth = max(expected_depth(scene) for scene in scenes)
    limited = any(scene.solve.tolerance or scene.solve.contrast_tolerance for scene in scenes)
    fineness = FIRST if limited else DEFAULT[kind]
    on_mesh = MESHINGS[kind](depth, progress)
    marched = kind == "small" and any(scene.solve.course == "history" for scene in scenes)
    if marched and (limited or compared_sets(scenes)):
        return _march(scenes, fineness, on_mesh, watch)
    refined = _refine(scenes, fineness, on_mesh, watch, rough)
    return [_add_warnings(answer, more) for answer, more in zip(refined.answers, refined.warnings, strict=True)]


def _march(scenes: list[Scene], fineness: float, on_mesh: Meshing, watch: Watch | None) -> list[Answer]:
    """March courses on the mesh that their settled ends ask for, so that each is marched, and watched, once.

    What is to be said of an end is said of its course.
    """
    ends = [replace(scene, solve=replace(scene.solve, course="steady")) for scene in scenes]
    ended = _refine(ends, fineness, on_mesh, None, None)
    out: dict[int, Answer] = {}

    def record(number: int, answer: Answer, finger: LinearFinger, way: tuple[Instant, ...] | None) -> None:
        out[number] = _add_warnings(answer, ended.warnings[number])
        if watch is not None:
            watch(number, out[number], finger, way)

    answers = on_mesh.answers(scenes, ended.fineness, record)
    return [out.get(number, answer) for number, answer in enumerate(answers)]


@dataclass(frozen=True, slots=True)
class _Refinement:
    """What was found of scenes that share a mesh."""

    answers: list[Answer]
    warnings: list[tuple[str, ...]]  # of each, sentences about what the finest mesh has left undone
    fineness: float | Lines  # of the last mesh


def _refine(
    scenes: list[Scene], fineness: float, on_mesh: Meshing, watch: Watch | None, rough: Rough | None
) -> _Refinement:
    """Refine until every estimate is known and meets its tolerance, of differences too, or no mesh is finer.

    Scenes that share a mesh are solved again together on the finer one. Where that has no answer, the coarser mesh's
    is the answer if it `_stands`.
    """
    surfaces, kind = compared_sets(scenes), scenes[0].solve.kinematics
    answers: dict[int, Answer] = {}
    best: dict[int, Answer] = {}  # of each, by its estimate
    lost: dict[int, SolveFailure] = {}  # what finer meshes made of scenes whose coarser answers stand
    work: dict[float | Lines, list[int]] = {fineness: list(range(len(scenes)))}
    last: float | Lines = fineness
    while True:
        for last, todo in work.items():
            solved = on_mesh.answers([scenes[i] for i in todo], last, watch)
            for i, answer in zip(todo, solved, strict=True):
                failure = _loss(answer, answers.get(i))
                if failure is not None:
                    lost[i] = failure
                    continue
                answers[i] = answer
                best[i] = min(answer, best.get(i, answer), key=_estimate)
        limits = last != FIRST
        missed = [0.0 if i in lost else _error_by_tolerance(answers[i], limits=limits) for i in range(len(scenes))]
        apart = [
            contrast_error([p for i in together if isinstance(p := answers[i], Prediction)]) for together in surfaces
        ]
        # What has no state on a finer mesh stays as it is, or there would be no end.
        refinable = [
            [i for i in together if isinstance(answers[i], Prediction) and i not in lost] for together in surfaces
        ]
        wanted = _error_reductions(scenes, missed, refinable, apart)
        work = _finer({i: answers[i] for i in sorted(wanted)}, wanted, DEFAULT[kind])
        if not work:
            break
        for answer in answers.values():
            if rough is not None and isinstance(answer, Prediction):
                rough(answer)
    answers |= {i: best[i] for i, miss in enumerate(missed) if miss > 1.0}
    if kind == "finite":  # where a fine mesh may lose its way
        lost |= _fallen_back(scenes, answers, fineness, on_mesh)
    of = {i: off for together, off in zip(surfaces, apart, strict=True) for i in together}
    warnings = [_sentences(of.get(i), missed[i], answers[i], lost.get(i)) for i in range(len(scenes))]
    return _Refinement([answers[i] for i in range(len(scenes))], warnings, last)


def _error_reductions(
    scenes: Sequence[Scene], missed: Sequence[float], surfaces: Sequence[Sequence[int]], apart: Sequence[ContrastError]
) -> dict[int, float]:
    """Return by what the errors of scenes to be solved again have to fall: what is compared shares a mesh.

    `missed` are the errors of all by their tolerances, `apart` those of differences within each of the sets `surfaces`.
    """
    out = {i: miss for i, miss in enumerate(missed) if miss > 1.0}
    for together, off in zip(surfaces, apart, strict=True):
        tolerance = min((t for i in together if (t := scenes[i].solve.contrast_tolerance)), default=np.inf)
        if tolerance < np.inf and (off.share > tolerance or any(i in out for i in together)):
            out |= {i: max(missed[i], off.share / tolerance) for i in together}
    return out


def _finer(
    answers: Mapping[int, Answer], wanted: Mapping[int, float], default: float
) -> dict[float | Lines, list[int]]:
    """Return the scenes to be solved again on each finer mesh, none where none may be finer.

    `answers` are those of scenes whose errors have to fall by what is `wanted` of each. What had a mesh together keeps
    one together. A refusal is asked once more at the `default` fineness.
    """
    on: dict[FingerMesh | None, list[int]] = {}
    for i, answer in answers.items():
        on.setdefault(answer.geometry if isinstance(answer, Prediction) else None, []).append(i)
    out: dict[float | Lines, list[int]] = {}
    for mesh, together in on.items():
        finer: float | Lines | None = default
        if mesh is not None:
            nested = [(wanted[i], one.nested) for i in together if isinstance(one := answers[i], Prediction)]
            parts = [miss * one.shares for miss, one in nested if one is not None and one.shares is not None]
            unknown = any(one is None for _, one in nested)
            finer = refine_lines(mesh, None if unknown or not parts else np.max(parts, axis=0))
        if finer is not None:
            out.setdefault(finer, []).extend(together)
    return out


def _fallen_back(
    scenes: list[Scene], answers: dict[int, Answer], first: float, on_mesh: Meshing
) -> dict[int, SolveFailure]:
    """Put answers of coarser meshes in place of what the `first` mesh has none of; return what that made of them.

    Where friction is steep any one mesh may have no state, and the next finer one is asked at last.
    """
    lost: dict[int, SolveFailure] = {}
    for i, scene in enumerate(scenes):
        if isinstance(failure := answers[i], SolveFailure) and _is_doubtful(scene, failure):
            answer = on_mesh.answers([scene], first / NEXT)[0]
            if _stands(answer, failure):
                answers[i], lost[i] = answer, failure
        if isinstance(answers[i], NotConverged) and scene.friction.mu > STEEP:
            answers[i] = on_mesh.answers([scene], first * NEXT)[0]
    return lost


def _is_doubtful(scene: Scene, failure: SolveFailure) -> bool:
    """Return whether there may be a state nevertheless: none was found, or the limit is as near as limits are known."""
    if isinstance(failure, NotConverged):
        return True
    limit = failure.limit_mu
    return limit is not None and float(scene.friction.mu) <= (1.0 + KNOWN) * limit


def _stands(coarser: Answer, failure: SolveFailure) -> bool:
    """Return whether the answer of a coarser mesh counts where a finer one has none.

    Where the finer one is sure that there is none it is not; nor near a limit at which numbers grow so that the coarser
    mesh knows little of them: then the limit is the answer.
    """
    if not isinstance(coarser, Prediction) or not _is_doubtful(coarser.scene, failure):
        return False
    return isinstance(failure, NotConverged) or coarser.error_estimate <= WORTH


def _loss(answer: Answer, coarser: Answer | None) -> SolveFailure | None:
    """Return why the answer of a coarser mesh, if there is one, counts in place of this one; None where it does not."""
    failure = answer if isinstance(answer, SolveFailure) else None
    if isinstance(answer, Prediction) and answer.nested is None and _estimate(coarser) < 1.0:
        failure = NOT_NESTED
    return failure if failure is not None and coarser is not None and _stands(coarser, failure) else None


def _estimate(answer: Answer | None) -> float:
    """Return the error estimate of an answer; 1 where nothing is known."""
    return answer.error_estimate if isinstance(answer, Prediction) and answer.nested is not None else 1.0


def _sentences(off: ContrastError | None, missed: float, answer: Answer, lost: SolveFailure | None) -> tuple[str, ...]:
    """Return what is to be said of an answer for what the finest mesh has left undone."""
    warnings: list[str] = []
    if lost is not None:
        warnings.append("A finer mesh did not find this state: this is the coarser one's, and its error estimate.")
        if lost.limit_mu is not None:
            warnings.append(NEAR_LIMIT.format(lost.limit_mu, 100.0 * KNOWN))
    if isinstance(answer, Prediction) and answer.nested is None:
        warnings.append(UNKNOWN)
    elif missed > 1.0:
        warnings.append(MISSES)
    if off is not None and off.warning:
        warnings.append(off.warning)
    return tuple(warnings)


def _add_warnings(answer: Answer, more: tuple[str, ...]) -> Answer:
    """Return the answer with more warnings."""
    return replace(answer, warnings=(*answer.warnings, *more)) if more and isinstance(answer, Prediction) else answer


def _error_by_tolerance(answer: Answer, *, limits: bool) -> float:
    """Return an answer's error estimate by the tolerance of its scene; 4 where nothing is known of the error.

    So it is of a refusal on a mesh whose `limits` are not known to 3 %.
    """
    if isinstance(answer, NoSteadyState) and not limits:
        return NOT_KNOWN
    if not isinstance(answer, Prediction):
        return 0.0
    if answer.nested is None:
        return NOT_KNOWN
    tolerance = answer.scene.solve.tolerance
    return 0.0 if tolerance is None else answer.error_estimate / tolerance
