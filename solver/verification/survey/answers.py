"""Answers as users ask for them, without a tolerance, at 1 % and at 0.3 %, against fine meshes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.failures import SolveFailure
from solver.response.solution import solve_many
from solver.verification.asked import clock
from solver.verification.estimates import Estimate, compared
from solver.verification.methods import Kinematics
from solver.verification.random_scenes import FAMILIES, HARD
from solver.verification.survey.fine_meshes import fine_numbers
from solver.verification.survey.statistics import ASKED, shares, times, wanted
from solver.verification.truth import judged


@dataclass(frozen=True, slots=True)
class Row:
    """What one scene gives."""

    family: str
    number: int
    kinematics: Kinematics
    estimates: tuple[Estimate, ...] = ()  # of the answers; those without a tolerance have 0
    took_s: tuple[float, ...] = ()  # by tolerance
    refusals: tuple[str, ...] = ()  # of the answers, or of the truth


def solve(family: str, number: int, kinematics: Kinematics) -> Row:
    """Return the answers of one scene with their estimates and true errors."""
    scene = FAMILIES[family](number, kinematics)
    estimates: list[Estimate] = []
    took: list[float] = []
    refusals: list[str] = []
    try:
        truth, doubt = judged(fine_numbers(scene, hard=family in HARD))
    except SolveFailure as failure:
        truth, doubt = np.zeros(3), np.zeros(3)
        refusals.append(f"no truth: {failure}")
    for tolerance in ASKED:
        begun = clock()
        (answer,) = solve_many([replace(scene, solve=replace(scene.solve, tolerance=tolerance))])
        took.append(clock() - begun)
        if isinstance(answer, SolveFailure):
            refusals.append(str(answer))
        else:
            estimates += compared(answer, tolerance or 0.0, truth, doubt)
    return Row(family, number, kinematics, tuple(estimates), tuple(took), tuple(dict.fromkeys(refusals)))


def report(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the refusals, and the shares of estimates by tolerance."""
    yield from (f"scene {row.number}: {sentence}" for row in rows for sentence in row.refusals)
    for place, tolerance in enumerate(ASKED):
        yield f"{wanted(tolerance)}: {times([row.took_s[place] for row in rows])}"
        yield from shares([one for row in rows for one in row.estimates if one.tolerance == (tolerance or 0.0)])
