"""The solver's error estimates against true errors, and the cost of an answer with a guaranteed tolerance.

All solves use the public interface: scenes with a `tolerance` in, answers with their estimates out. The published
surfaces are solved together, random scenes one by one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.accuracy.convergence_order import trial_warnings
from solver.failures import SolveFailure
from solver.prediction import Prediction, percent
from solver.response.solution import solve, solve_many
from solver.scene.tables import Solve
from solver.verification.fine_meshes import fine_numbers
from solver.verification.methods import Kinematics
from solver.verification.random_scenes import FAMILIES, random_scene
from solver.verification.request import LeftOut, Request, median_time, rows_within
from solver.verification.truth import KINEMATICS, TRUE_NUMBERS, cases, known_truths, mean_and_doubt

_TOLERANCES = (0.01, 0.003, 0.001)
_SMALL = 2e-4  # relative error below which an estimate may be too large by any factor
_MOST = 10.0  # largest ratio of estimate to true error
CORRECTED = "corrected SED of the ending"
GOALS = (TRUE_NUMBERS[0], CORRECTED, *TRUE_NUMBERS[1:])
COARSENING = 2.0  # of the fine meshes of random scenes: enough for answers with a tolerance of 1 %
RANDOM: dict[Kinematics, int] = {"small": 12, "finite": 6}  # scenes, as far as time allows


@dataclass(frozen=True, slots=True)
class Estimate:
    """One result of one answer: its estimated and its true error."""

    kinematics: Kinematics
    case: str
    number: str
    tolerance: float  # of the SED
    dofs: int
    estimate: float  # relative
    error: float  # relative
    doubt: float  # of the truth, relative
    corrected: float | None = None  # error of the value on the nested mesh, relative
    towards: bool = False  # whether the corrected value lies on the truth's side of the answer
    warned: bool = False  # whether the answer warns that it exceeds the trials of the estimates

    @property
    def above(self) -> bool | None:
        """Whether the estimate lies above the true error; None where the truth is too uncertain to decide."""
        return self.estimate >= self.error if self.doubt <= max(self.estimate, self.error) / 3.0 else None

    @property
    def near(self) -> bool | None:
        """Whether the estimate lies below ten times max(true error, 0.02 %); None where the truth is too uncertain."""
        bound = _MOST * max(self.error, _SMALL)
        return self.estimate < bound if self.doubt <= bound / 3.0 else None

    @property
    def meets_tolerance(self) -> bool | None:
        """Whether the true error lies below the requested tolerance; None where the truth is too uncertain."""
        return self.error <= self.tolerance if self.doubt <= self.tolerance / 3.0 else None


@dataclass(frozen=True, slots=True)
class GuaranteedCost:
    """Cost of an answer with a guaranteed tolerance, with compiled loops; all meshes and estimates are included."""

    kinematics: Kinematics
    tolerance: float
    surfaces: int  # number of surfaces solved together
    dofs: int
    took_s: float  # from scenes to answers, median
    wall_s: float  # part of `took_s` for the solves on the last mesh
    setup_s: float  # part for this mesh and its tables
    estimate_s: float  # part for the estimates on it
    worst_estimate: float
    worst_error: float | None  # None where the truth of a surface is not certain to a third of the tolerance


def measure(request: Request) -> Iterator[Estimate | GuaranteedCost | LeftOut]:
    """Yield the published surfaces at each tolerance, then random scenes until the time is up."""
    for kinematics in KINEMATICS:
        yield from _estimate_published(request, kinematics)
    for kinematics in KINEMATICS:
        yield from _random(request, kinematics)


def _estimate_published(request: Request, kinematics: Kinematics) -> Iterator[Estimate | GuaranteedCost | LeftOut]:
    truths = known_truths(request, kinematics)
    surfaces = [scene for scene in cases(kinematics) if scene.title in truths]
    if not surfaces:
        return iter([LeftOut(f"No truth is known at {kinematics} strain.")])

    def rows_at(tolerance: float) -> Iterator[Estimate | GuaranteedCost | LeftOut]:
        scenes = [replace(s, solve=Solve(kinematics, tolerance=tolerance)) for s in surfaces]
        runs: list[Sequence[Prediction | SolveFailure]] = []
        took_s, results = median_time(lambda: runs.append(solve_many(scenes))), runs[-1]
        rows, answers = list[Estimate](), list[Prediction]()
        for scene, result in zip(surfaces, results, strict=True):
            if isinstance(result, SolveFailure):
                yield LeftOut(f"{scene.title} at {kinematics} strain has no answer at {percent(tolerance)}: {result}")
            else:
                answers.append(result)
                truth = truths[scene.title]
                rows += compare(result, tolerance, np.array(truth.numbers), np.array(truth.doubt))
        yield from rows
        if answers:
            sed = [row for row in rows if row.number == TRUE_NUMBERS[0]]
            yield GuaranteedCost(
                kinematics, tolerance, len(answers), max(a.dofs for a in answers), took_s,
                sum(a.wall_s for a in answers), answers[0].setup_s, sum(a.estimate_s for a in answers),
                max(a.error_estimate for a in answers),
                None if any(row.meets_tolerance is None for row in sed) else max(row.error for row in sed),
            )  # fmt: skip

    tolerances = request.pick(_TOLERANCES, _TOLERANCES[:1])
    return rows_within(request, tolerances, f"tolerances at {kinematics} strain", rows_at)


def _random(request: Request, kinematics: Kinematics) -> Iterator[Estimate | LeftOut]:
    def rows_of(number: int) -> Iterator[Estimate | LeftOut]:
        scene = random_scene(list(FAMILIES)[number % len(FAMILIES)], number, kinematics)
        try:
            answer = solve(replace(scene, solve=replace(scene.solve, tolerance=_TOLERANCES[0])))
            yield from compare(answer, _TOLERANCES[0], *mean_and_doubt(fine_numbers([scene], COARSENING)[:, 0]))
        except SolveFailure:
            yield LeftOut(f"The random scene {scene.title} has no settled state at {kinematics} strain to compare.")

    numbers = range(2 if request.quick else RANDOM[kinematics])
    return rows_within(request, numbers, f"random scenes at {kinematics} strain", rows_of)


def compare(answer: Prediction, tolerance: float, truth: np.ndarray, doubt: np.ndarray) -> list[Estimate]:
    """Return the estimates of an answer's results with their errors against `truth` of relative `doubt`.

    The first three of either are those of `TRUE_NUMBERS`. Returns an empty list where the answer's errors are unknown.
    """
    if answer.nested is None:
        return []
    best, warned = answer.sed_ending_corrected, any(trial_warnings(answer.scene, answer.indentation))
    numbers = (  # index in the truth, value and estimate of each of `GOALS`
        (0, answer.sed_ending, answer.error_estimate),
        (0, best, answer.corrected_error),
        (1, answer.normal_force, answer.normal_force_error),
        (2, answer.tangential_force, answer.tangential_force_error),
    )
    rows: list[Estimate] = []
    for name, (place, value, estimate) in zip(GOALS, numbers, strict=True):
        true = float(truth[place])
        if estimate is None or not true > 0.0:
            continue
        error, corrected_error = abs(value) / true - 1.0, best / true - 1.0
        better = None, False
        if name == TRUE_NUMBERS[0]:
            better = abs(corrected_error), error * (error - corrected_error) > 0.0
        row = Estimate(
            answer.scene.solve.kinematics, answer.scene.title, name, tolerance, answer.dofs, estimate, abs(error),
            float(doubt[place]), *better, warned,
        )  # fmt: skip
        rows.append(row)
    return rows
