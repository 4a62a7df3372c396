"""The reference cases and their truth: very fine solves on meshes with different nodes, made in the same run.

The cases are the ten published surfaces, at small and at finite strain. The truth of a result is the mean of three
solves on fine meshes, one of them moved along the skin by half an element. Its doubt is their largest distance from the
mean. No truth is stored, so it is never older than the solver. A surface without full slip has the solver's refusal
instead.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.failures import SolveFailure
from solver.response.solution import solve
from solver.scene import Scene
from solver.scene.published import scenes
from solver.scene.tables import Solve
from solver.verification.methods import MESHED, FiniteMethod, Kinematics, SmallMethod
from solver.verification.request import LeftOut, Request, clock

KINEMATICS = tuple(MESHED)
TRUE_NUMBERS = ("SED of the ending", "normal force", "drag")
# fineness of the meshes, finer than those in `speed`, in a full and in a quick run; the first is also moved
TRUE_FINENESS = {"small": ((26.0, 23.0), (18.0, 16.0)), "finite": ((30.0, 26.0), (20.0, 18.0))}
# the judged cases, whose speeds count
JUDGED = ("slipperiness 0", "slipperiness 20", "slipperiness 55", "slipperiness 75", "slipperiness 100", "stickiness 0")


@dataclass(frozen=True, slots=True)
class Truth:
    """The true results of one case, or the reason why it has no answer."""

    kinematics: Kinematics
    case: str
    numbers: tuple[float, ...]  # SED [MPa], normal force, drag [N/mm]; empty where refused
    doubt: tuple[float, ...]  # of each: largest distance of the three solves from their mean, relative
    dofs: tuple[int, ...]  # of the three meshes
    took_s: float
    refused: str  # the solver's sentence, "" where there is an answer


def cases(kinematics: Kinematics) -> list[Scene]:
    """Return the ten published scenes in one of the two kinematics."""
    return [replace(scene, solve=Solve(kinematics)) for scene in scenes()]


def measure(request: Request) -> Iterator[Truth | LeftOut]:
    """Yield the truth of every case; a quick run has coarser meshes and only the judged cases."""
    for kinematics in KINEMATICS:
        surfaces = [s for s in cases(kinematics) if s.title in JUDGED or not request.quick]
        yield from _truths(request, kinematics, surfaces)


def mean_and_doubt(solves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and doubt (c,) of c results on three meshes (3, c)."""
    mean = solves.mean(axis=0)
    return mean, np.abs(solves / np.where(mean > 0.0, mean, 1.0) - 1.0).max(axis=0)


def _truths(request: Request, kinematics: Kinematics, surfaces: list[Scene]) -> Iterator[Truth | LeftOut]:
    start = clock()
    deepest = max(surfaces, key=lambda scene: scene.loading.depth)
    first, second = TRUE_FINENESS[kinematics][request.quick]
    meshes = [MESHED[kinematics](deepest, *mesh) for mesh in ((first, False), (first, True), (second, False))]
    setup_s = (clock() - start) / len(surfaces)
    for number, scene in enumerate(sorted(surfaces, key=lambda scene: scene.title not in JUDGED)):
        if request.seconds_left <= 0.0 and scene.title not in JUDGED:  # other subjects need these
            count = len(surfaces) - number
            yield LeftOut(f"Time was over before the truth of {count} cases at {kinematics} strain was known.")
            return
        yield _truth(scene, meshes, setup_s)


def _truth(scene: Scene, meshes: Sequence[SmallMethod | FiniteMethod], setup_s: float) -> Truth:
    """Return the truth of a case; the solver decides whether a case outside `JUDGED` has one."""
    start, kinematics = clock(), scene.solve.kinematics
    try:
        if scene.title not in JUDGED:
            solve(replace(scene, solve=Solve(kinematics, tolerance=0.02)))
        solves = np.array([mesh.numbers(mesh.solve(scene)) for mesh in meshes])
    except SolveFailure as failure:
        return Truth(kinematics, scene.title, (), (), (), clock() - start, str(failure))
    mean, doubt = mean_and_doubt(solves)
    elapsed_s, dofs = clock() - start + setup_s, tuple(mesh.dofs for mesh in meshes)
    return Truth(kinematics, scene.title, tuple(mean.tolist()), tuple(doubt.tolist()), dofs, elapsed_s, "")


def known_truths(request: Request, kinematics: Kinematics) -> dict[str, Truth]:
    """Return the truths of the cases that have one, by case name."""
    return {t.case: t for t in request.of(Truth) if t.kinematics == kinematics and t.numbers}
