"""Estimates of every mesh an answer can come from: kept numbers can be judged again with other factors unsolved."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from solver.accuracy.adaptivity import nested_solution
from solver.accuracy.error_estimate import FINENESS, coarsest_for, estimates
from solver.accuracy.finite_errors import compared
from solver.arrays import Array
from solver.failures import SolveFailure
from solver.scene import Scene
from solver.verification.estimates import TOLERANCES, Estimate
from solver.verification.methods import Kinematics
from solver.verification.random_scenes import FAMILIES, HARD
from solver.verification.survey.fine_meshes import fine_numbers, numbers_on_mesh
from solver.verification.survey.statistics import shares
from solver.verification.truth import NUMBERS, judged

MESHES = {"small": FINENESS["small"][:6], "finite": FINENESS["finite"][:4]}  # finer ones are too near the truth's
Numbers = list[list[float]]
OnMesh = tuple[Numbers, Numbers, Numbers]  # of the answer (1, 3), of other meshes (n, 3), and their sensitivity (1, 3)


@dataclass(frozen=True, slots=True)
class Row:
    """One scene on all meshes; nothing but its key and the reason where it has no state."""

    family: str
    number: int
    kinematics: Kinematics
    numbers: dict[str, OnMesh] = field(default_factory=dict[str, OnMesh])
    truth: Numbers = field(default_factory=Numbers)
    refusal: str = ""


def solve(family: str, number: int, kinematics: Kinematics) -> Row:
    """Return the numbers of one scene on all meshes, of the other meshes that estimates ask, and of the truth."""
    scene = FAMILIES[family](number, kinematics)
    on_mesh = _small if kinematics == "small" else _finite
    try:
        truth = fine_numbers(scene, hard=family in HARD).tolist()
        numbers = {f"{fineness:g}": on_mesh(scene, fineness) for fineness in MESHES[kinematics]}
    except SolveFailure as failure:
        return Row(family, number, kinematics, refusal=str(failure))
    return Row(family, number, kinematics, numbers, truth)


def _small(scene: Scene, fineness: float) -> OnMesh:
    own, other = (numbers_on_mesh([scene], *mesh) for mesh in ((fineness, False), (fineness / 2.0, True)))
    return own.tolist(), other.tolist(), [[0.0] * 3]


def _finite(scene: Scene, fineness: float) -> OnMesh:
    way_up = nested_solution(scene, scene.loading.depth, fineness, lambda: False)
    found = compared(scene, fineness, way_up, way_up.top.finger.all_numbers(way_up.top.shape), lambda: False)
    own, others, sensitivity = (np.atleast_2d(numbers[..., :3]).tolist() for numbers in found[:3])
    return own, others, sensitivity


def _estimates(row: Row) -> dict[float, list[Estimate]]:
    """Return the estimates of one scene by fineness, with their true errors."""
    scene = FAMILIES[row.family](row.number, row.kinematics)
    truth, doubt = judged(np.array(row.truth))
    rows: dict[float, list[Estimate]] = {}
    for fineness in MESHES[row.kinematics]:
        own, others, sensitivity = (np.array(part) for part in row.numbers[f"{fineness:g}"])
        estimated: Array = estimates(scene, fineness, own[0], others, sensitivity[0])
        errors = np.abs(np.abs(own[0]) / truth - 1.0)
        rows[fineness] = [
            Estimate(row.kinematics, f"scene {row.number}", name, 0.0, 0, *values)
            for name, *values in zip(NUMBERS, estimated.tolist(), errors.tolist(), doubt.tolist(), strict=True)
        ]
    return rows


def report(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the shares of estimates by mesh, and by tolerance on the mesh that an answer ends on."""
    yield from (f"scene {row.number}: {row.refusal}" for row in rows if row.refusal)
    solved = [(row, _estimates(row)) for row in rows if not row.refusal]
    if not solved:
        return
    kinematics = solved[0][0].kinematics
    for fineness in MESHES[kinematics]:
        yield f"fineness {fineness:g}"
        yield from shares([one for _, found in solved for one in found[fineness]])
    for tolerance in TOLERANCES:
        ends = [_end(row, found, tolerance) for row, found in solved]
        taken = ", ".join(f"{fineness:g}: {count}" for fineness, count in sorted(Counter(ends).items()))
        yield f"asked for {100 * tolerance:g} %; scenes by fineness: {taken}"
        pairs = zip(solved, ends, strict=True)
        yield from shares([replace(one, tolerance=tolerance) for (_, found), end in pairs for one in found[end]])


def _end(row: Row, found: dict[float, list[Estimate]], tolerance: float) -> float:
    """Return the fineness that the solver ends on when asked for a tolerance."""
    least = coarsest_for(FAMILIES[row.family](row.number, row.kinematics), tolerance)
    meshes = [fineness for fineness in found if fineness >= least] or [max(found)]
    return next((fineness for fineness in meshes if found[fineness][0].estimate <= tolerance), meshes[-1])
