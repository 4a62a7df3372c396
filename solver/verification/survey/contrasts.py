"""Differences between surfaces solved together, against 5 % of their range, on random sets of three.

The error of a set is that of the worst difference between two of its surfaces, by the range of all three. A number
counts only where no fine mesh puts a difference further from their mean than a third of 5 % of the range.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from solver.accuracy.contrasts import WARNED
from solver.arrays import Array
from solver.failures import SolveFailure
from solver.response.solution import solve_many
from solver.scene.scene import Scene
from solver.verification.asked import clock
from solver.verification.methods import Kinematics
from solver.verification.random_scenes import surface_set
from solver.verification.survey.fine_meshes import numbers_on_mesh
from solver.verification.survey.statistics import ASKED, times, wanted
from solver.verification.truth import NUMBERS, SHIFTED


@dataclass(frozen=True, slots=True)
class Answer:
    """Three surfaces solved together."""

    numbers: list[list[float]]  # (3 surfaces, 3)
    warned: bool  # that their differences may be off
    dofs: int
    took_s: float


@dataclass(frozen=True, slots=True)
class Row:
    """What one set gives; nothing but its key and the reason where a surface has no state."""

    family: str
    number: int
    kinematics: Kinematics
    answers: list[Answer] = field(default_factory=list[Answer])  # by tolerance
    truth: list[list[list[float]]] = field(default_factory=list[list[list[float]]])  # (3 meshes, 3 surfaces, 3)
    refusal: str = ""


def solve(family: str, number: int, kinematics: Kinematics) -> Row:
    """Return the answers of one set, and its numbers on fine meshes."""
    scenes = surface_set(number, kinematics)
    try:
        answers = [_answer(scenes, tolerance) for tolerance in ASKED]
        truth = [numbers_on_mesh(scenes, *mesh) for mesh in SHIFTED[kinematics]]
    except SolveFailure as failure:
        return Row(family, number, kinematics, refusal=str(failure))
    return Row(family, number, kinematics, answers, [one.tolist() for one in truth])


def _answer(scenes: Sequence[Scene], tolerance: float | None) -> Answer:
    begun = clock()
    found = solve_many([replace(s, solve=replace(s.solve, tolerance=tolerance, evidence="estimated")) for s in scenes])
    took = clock() - begun
    for one in found:
        if isinstance(one, SolveFailure):
            raise one
    good = [one for one in found if not isinstance(one, SolveFailure)]
    warned = any("Differences" in warning for warning in good[0].warnings)
    return Answer(
        [[one.sed_ending, one.normal_force, abs(one.tangential_force)] for one in good], warned, good[0].dofs, took
    )


def errors(numbers: Array, solves: Array) -> Array:
    """Return the errors (3,) of differences between `numbers` (3, 3), by their range; nan where the truth cannot tell.

    `solves` (m, 3, 3) are the same on m fine meshes.
    """
    truth = solves.mean(axis=0)
    span = np.ptp(truth, axis=0)
    known = np.ptp(solves - truth, axis=1).max(axis=0) <= WARNED / 3.0 * span
    return np.where(known, np.ptp(numbers - truth, axis=0) / span, np.nan)


def report(rows: Sequence[Row]) -> Iterator[str]:
    """Yield how many differences are off by more than 5 %, and how many of those nobody was warned of."""
    yield from (f"set {row.number}: {row.refusal}" for row in rows if row.refusal)
    solved = [row for row in rows if not row.refusal]
    if not solved:
        return
    for place, tolerance in enumerate(ASKED):
        answers = [row.answers[place] for row in solved]
        pairs = zip(answers, solved, strict=True)
        off = np.array([errors(np.array(one.numbers), np.array(row.truth)) for one, row in pairs])
        far = np.nan_to_num(off) > WARNED
        silent = [
            row.number for row, one, bad in zip(solved, answers, far, strict=True) if bad.any() and not one.warned
        ]
        took, dofs = times([one.took_s for one in answers]), Counter(one.dofs for one in answers)
        warned = f"{sum(one.warned for one in answers)} of {len(answers)} warned of"
        yield f"{wanted(tolerance)}: {warned}; above 5 % without a warning: {silent or 'none'}"
        yield f"  {took}; unknowns {dict(sorted(dofs.items()))}"
        for name, column, bad in zip(NUMBERS, off.T, far.T, strict=True):
            counted = column[np.isfinite(column)]
            yield f"  {name}: {bad.sum()} of {len(counted)} above 5 %, worst {100 * counted.max(initial=0.0):.1f} %"
