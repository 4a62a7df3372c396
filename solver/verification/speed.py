"""Time against true error, at both kinematics and on every mesh, for the reference cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from statistics import median

import numpy as np

from solver.failures import SolveFailure
from solver.response.finite_answers import solution_order
from solver.scene import Scene
from solver.verification.methods import MESHED, FiniteMethod, Kinematics, SmallMethod
from solver.verification.request import LeftOut, Request, clock, median_time, repetitions, rows_within
from solver.verification.truth import JUDGED, Truth, cases, known_truths

MESHES: dict[Kinematics, tuple[float, ...]] = {  # elements per tip radius
    "small": (2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0),
    "finite": (5.5, 6.5, 8.0, 10.0, 12.0, 16.0, 20.0),
}
LITTLE = 0.25  # patience of a quick run
QUICK: dict[Kinematics, tuple[float, ...]] = {"small": (2.5, 3.0, 5.0, 8.0), "finite": (5.5, 8.0, 12.0)}


@dataclass(frozen=True, slots=True)
class Speed:
    """One mesh. Times are medians; errors are relative, for SED, normal force and drag of each case."""

    kinematics: Kinematics
    fineness: float
    dofs: int
    setup_s: float  # mesh and tables
    prepared_s: float  # assembly and factorisation shared by all surfaces
    floor_s: float  # one assembly, factorisation and solve of the same system
    first_s: float  # one surface from undeformed, `prepared_s` included: median over the cases
    next_s: float | None  # each further surface; None where no two have the same loading
    all_s: float  # all cases one after another, `prepared_s` included
    surfaces: int  # number of cases in `all_s`
    errors: dict[str, tuple[float, ...]]
    failed: dict[str, str]  # cases without an answer on this mesh, and why

    @property
    def judged_error(self) -> float | None:
        """Largest error of the SED on the judged cases; None where one is missing."""
        return self.largest_error({}) if self.errors.keys() >= set(JUDGED) else None

    def largest_error(self, doubts: Mapping[str, float]) -> float:
        """Return the largest SED error on the judged cases if each truth is off by its doubt."""
        return max(self.errors[name][0] + doubts.get(name, 0.0) for name in JUDGED)


def measure(request: Request) -> Iterator[Speed | LeftOut]:
    """Yield a row for each kinematics and mesh, coarse meshes first."""
    pairs: list[tuple[float, Kinematics]] = [
        (fineness, kind) for kind, all_of in (QUICK if request.quick else MESHES).items() for fineness in all_of
    ]
    if not all(known_truths(request, kind) for kind in MESHED):
        yield LeftOut("Speeds need the truth of both kinematics, which is not known.")
        return
    patience = LITTLE if request.quick else 1.0
    yield from rows_within(
        request, sorted(pairs), "meshes whose speed is measured",
        lambda pair: [_row(pair[1], pair[0], known_truths(request, pair[1]), patience)],
    )  # fmt: skip


def _row(kind: Kinematics, fineness: float, truths: dict[str, Truth], patience: float) -> Speed:
    """Return the row of one mesh; `patience` is the time for repetitions, relative to a full run."""
    surfaces = [scene for scene in cases(kind) if scene.title in truths]
    deepest = max(surfaces, key=lambda scene: scene.loading.depth)
    preparation, setup, floors_before = _prepare(kind, deepest, fineness, 0.3 * patience)
    mesh = MESHED[kind](deepest, fineness, False)
    first: list[float] = []
    solvable: list[Scene] = []
    errors: dict[str, tuple[float, ...]] = {}
    failed: dict[str, str] = {}
    for scene in surfaces:
        try:
            state = mesh.solve(scene)
        except SolveFailure as failure:
            failed[scene.title] = str(failure)
            continue
        true = np.array(truths[scene.title].numbers)
        relative = np.abs(mesh.numbers(state) - true) / np.where(true > 0.0, true, 1.0)
        errors[scene.title] = tuple(relative.tolist())
        solvable.append(scene)
        first.append(median_time(lambda s=scene: mesh.numbers(mesh.solve(s)), 5, 0.25 * patience))
    together = median_time(lambda: mesh.numbers_together([mesh.solve(scene) for scene in solvable]), 5, 0.5 * patience)
    onward, between = _onward(mesh, solvable, patience)
    floors = floors_before if preparation else between  # measured at the same time as most of this work
    next_s = median(onward) if onward else None
    return Speed(
        kind, fineness, mesh.dofs, setup, preparation, median(floors),
        preparation + median(first), next_s, preparation + together, len(solvable), errors, failed,
    )  # fmt: skip


def _prepare(kind: Kinematics, scene: Scene, fineness: float, most_s: float) -> tuple[float, float, list[float]]:
    """Return median times of a mesh's assembly and factorisation, and of its setup, and floors measured in between.

    Each mesh is released before the next is made, as in a process that solves repeatedly in the same memory.
    """
    spans: list[tuple[float, float]] = []
    floors: list[float] = []
    for _ in repetitions(5, most_s):
        mesh = MESHED[kind](scene, fineness, False)
        spans.append((mesh.prepared_s, mesh.setup_s))
        floors.append(mesh.floor())
        del mesh
    preparation, setup = zip(*spans, strict=True)
    return median(preparation), median(setup), floors


def _onward(mesh: SmallMethod | FiniteMethod, scenes: list[Scene], most_s: float) -> tuple[list[float], list[float]]:
    """Return the time of each surface that starts from the previous one, at the same depth and direction, and floors.

    Times are medians over passes through `scenes` in the solver's order, after a first pass that makes the meshes. The
    floor is measured after each solve, because the speed of a machine changes within a second.
    """
    scenes = sorted(scenes, key=solution_order)
    spans: dict[str, list[float]] = {}
    floors: list[float] = []
    began = clock()
    for turn in range(6):
        before, loading = None, None
        for scene in scenes:
            near = loading == (scene.loading.depth, scene.loading.slide)
            start = clock()
            before = mesh.solve(scene, before if near else None)
            mesh.numbers(before)
            if turn and near:
                spans.setdefault(scene.title, []).append(clock() - start)
            if turn:
                floors.append(mesh.floor())
            loading = scene.loading.depth, scene.loading.slide
        if turn and clock() - began > most_s:
            break
    return [median(span) for span in spans.values()], floors or [mesh.floor()]
