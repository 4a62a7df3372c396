"""Answers as users request them, at 1 % and at 0.3 %, against fine meshes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.accuracy.error_estimate import contrast_error
from solver.arrays import Array
from solver.failures import SolveFailure
from solver.prediction import Prediction, percent
from solver.response.solution import solve_many
from solver.scene import Scene
from solver.verification.estimates import Estimate, compare
from solver.verification.fine_meshes import fine_numbers
from solver.verification.methods import Kinematics
from solver.verification.random_scenes import random_scene, surface_set
from solver.verification.survey.statistics import HEADER, TOLERANCES, judgement, misses
from solver.verification.truth import TRUE_NUMBERS, mean_and_doubt

SURFACE_SET = "surfaces"  # the set of three surfaces solved together, whose differences are relative to their range
BY_TOLERANCE = 5.0  # ratio of the tolerance of a difference to that of a scene


@dataclass(frozen=True, slots=True)
class Row:
    """Result of one scene, or set of surfaces."""

    family: str
    number: int
    kinematics: Kinematics
    estimates: tuple[Estimate, ...] = ()  # of the answers
    refusals: tuple[str, ...] = ()  # of the answers, or of the truth


def solve(family: str, number: int, kinematics: Kinematics) -> Row:
    """Return the answers of one scene with their estimates and true errors."""
    together = family == SURFACE_SET
    scenes = surface_set(number, kinematics) if together else [random_scene(family, number, kinematics)]
    estimates: list[Estimate] = []
    refusals: list[str] = []
    try:
        truth = fine_numbers(scenes)
    except SolveFailure as failure:
        return Row(family, number, kinematics, refusals=(f"no truth: {failure}",))
    for tolerance in TOLERANCES:
        answers = solve_many([_with_tolerance(scene, tolerance, together=together) for scene in scenes])
        refusals += [str(answer) for answer in answers if isinstance(answer, SolveFailure)]
        predictions = [answer for answer in answers if isinstance(answer, Prediction)]
        refusals += [f"errors unknown at {percent(tolerance)}" for answer in predictions if answer.nested is None]
        if together and len(predictions) == len(scenes):
            estimates.append(_difference(predictions, BY_TOLERANCE * tolerance, truth))
        elif predictions:
            estimates += compare(predictions[0], tolerance, *mean_and_doubt(truth[:, 0]))
    return Row(family, number, kinematics, tuple(estimates), tuple(dict.fromkeys(refusals)))


def _with_tolerance(scene: Scene, tolerance: float, *, together: bool) -> Scene:
    solve = replace(scene.solve, evidence="estimated")
    if together:
        return replace(scene, solve=replace(solve, contrast_tolerance=BY_TOLERANCE * tolerance))
    return replace(scene, solve=replace(solve, tolerance=tolerance))


def _difference(answers: Sequence[Prediction], tolerance: float, solves: Array) -> Estimate:
    """Return estimate and error of differences in SED, relative to the range of the truth `solves` (3, n, 3)."""
    sed = np.array([answer.sed_ending for answer in answers])
    error, doubt = apart(sed, solves[:, :, 0])
    first = answers[0]
    title, estimate = first.scene.title, contrast_error(answers).share
    return Estimate(first.scene.solve.kinematics, title, TRUE_NUMBERS[0], tolerance, first.dofs, estimate, error, doubt)


def apart(numbers: Array, solves: Array) -> tuple[float, float]:
    """Return the worst error of a difference between `numbers` (n,), and the truth's doubt, both relative to its range.

    `solves` (m, n) are the values on m fine meshes, whose mean is the truth.
    """
    truth = solves.mean(axis=0)
    span = float(np.ptp(truth))
    return float(np.ptp(numbers - truth)) / span, float(np.ptp(solves - truth, axis=1).max()) / span


def report(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the refusals, the misses, and a table with a row for each set and kinematics."""
    yield from (f"{row.family} {row.number}: {sentence}" for row in rows for sentence in row.refusals)
    yield from misses(estimate for row in rows for estimate in row.estimates)
    yield from table(rows)


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of a Markdown table with a row for each set and kinematics."""
    yield _line(HEADER)
    yield _line(["---"] * len(HEADER))
    for kinematics, family in dict.fromkeys((row.kinematics, row.family) for row in rows):
        selection = [row for row in rows if (row.kinematics, row.family) == (kinematics, family)]
        yield _line(judgement(family, kinematics, (estimate for row in selection for estimate in row.estimates)))


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
