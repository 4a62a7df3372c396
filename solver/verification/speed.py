"""Time against true error, for every way of solving and every mesh, on the reference cases."""

from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np

from solver.failures import SolveFailure
from solver.response.finite_solution import alike
from solver.scene import Scene
from solver.verification.asked import Asked, Found, LeftOut, clock, timed, within
from solver.verification.methods import FINITE, METHODS, SMALL, Meshed, Method
from solver.verification.truth import JUDGED, Truth, cases, known

MESHES = {  # elements to a tip radius; 840 to 15,000 unknowns, and 1,480 to 11,000 where meshes follow the contact
    SMALL.name: (2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0),
    FINITE.name: (5.5, 6.5, 8.0, 10.0, 12.0, 16.0, 20.0),
}
LITTLE = 0.25  # patience of a quick run
QUICK = {
    SMALL.name: (2.5, 3.0, 5.0, 8.0),
    FINITE.name: (5.5, 10.0, 20.0),
}


@dataclass(frozen=True, slots=True)
class Speed:
    """One way of solving on one mesh. Times are medians; errors relative, by case, of SED, normal force and drag."""

    method: str
    kinematics: str
    element: str
    order: int
    linear_solver: str
    start: str
    fineness: float
    dofs: int
    setup_s: float  # mesh and tables
    prepared_s: float  # assembly and factorisation shared by all surfaces
    floor_s: float  # one assembly, factorisation and solve of the same system
    first_s: float  # one surface from undeformed, `prepared_s` included: median over the cases
    next_s: float | None  # each further surface; None where no two are neighbours
    all_s: float  # all cases one after another, `prepared_s` included
    surfaces: int  # how many those are
    errors: dict[str, tuple[float, ...]]
    failed: dict[str, str]  # cases without an answer on this mesh, and why

    @property
    def judged_error(self) -> float | None:
        """The largest error of the SED on the cases that speeds are asked at; None where one is missing."""
        if any(name in self.failed for name in JUDGED):
            return None
        return max((self.errors[name][0] for name in JUDGED if name in self.errors), default=None)


def measure(asked: Asked, found: Found) -> Iterator[Speed | LeftOut]:
    """Yield a row for every way and mesh, coarse meshes of all ways before fine ones."""
    pairs = [(fineness, method) for method in METHODS for fineness in (QUICK if asked.quick else MESHES)[method.name]]
    if not all(known(found, method.kinematics) for method in METHODS):
        yield LeftOut("Speeds need the truth of both kinematics, which is not known.")
        return
    for item in within(asked, sorted(pairs, key=lambda pair: pair[0]), "meshes and ways of solving"):
        if isinstance(item, LeftOut):
            yield item
        else:
            fineness, method = item
            yield _row(method, fineness, known(found, method.kinematics), LITTLE if asked.quick else 1.0)


def _row(method: Method, fineness: float, truths: dict[str, Truth], patience: float) -> Speed:
    """Return the row of one mesh; `patience` is how long its times are repeated, by that of a full run."""
    chosen = [scene for scene in cases(method.kinematics) if scene.title in truths]
    deepest = max(chosen, key=lambda scene: scene.loading.depth)
    prepared, setup, beside = _made(method, deepest, fineness, 0.3 * patience)
    mesh = method.meshed(deepest, fineness, False)
    first: list[float] = []
    solved: list[Scene] = []
    errors: dict[str, tuple[float, ...]] = {}
    failed: dict[str, str] = {}
    for scene in chosen:
        try:
            state = mesh.solve(scene)
        except SolveFailure as failure:
            failed[scene.title] = str(failure)
            continue
        true = np.array(truths[scene.title].numbers)
        off = np.abs(mesh.numbers(state) - true) / np.where(true > 0.0, true, 1.0)
        errors[scene.title] = tuple(off.tolist())
        solved.append(scene)
        first.append(timed(lambda s=scene: mesh.numbers(mesh.solve(s)), 5, 0.25 * patience))
    together = timed(lambda: mesh.numbers_together([mesh.solve(scene) for scene in solved]), 5, 0.5 * patience)
    onward, between = _onward(mesh, solved, patience)
    floors = beside if prepared else between  # of the same moments as most of the work
    next_s = median(onward) if onward else None
    return Speed(
        method.name, method.kinematics, method.element, method.order, method.linear_solver, method.start,
        fineness, mesh.dofs, setup, prepared, median(floors),
        prepared + median(first), next_s, prepared + together, len(solved), errors, failed,
    )  # fmt: skip


def _made(method: Method, scene: Scene, fineness: float, most_s: float) -> tuple[float, float, list[float]]:
    """Return medians of what a mesh's assembly and factorisation, and what the rest took; and floors in turn with them.

    One is forgotten before the next is made, as in a process that solves again and again, which is given memory once.
    """
    spans: list[tuple[float, float]] = []
    floors: list[float] = []
    began = clock()
    while len(spans) < 5 and (not spans or clock() - began < most_s):
        mesh = method.meshed(scene, fineness, False)
        spans.append((mesh.prepared_s, mesh.setup_s))
        floors.append(mesh.floor())
        del mesh
    prepared, setup = zip(*spans, strict=True)
    return median(prepared), median(setup), floors


def _onward(mesh: Meshed, scenes: list[Scene], most_s: float) -> tuple[list[float], list[float]]:
    """Return what each surface took that was begun at one solved just before, pressed as deep and moved the same way.

    Medians over passes through all of `scenes`, in the order the solver takes them, after one in which meshes are made.
    The floor is taken after each of them: a machine's speed changes within a second, and both must see the same of it.
    """
    scenes = sorted(scenes, key=alike)
    spans: dict[str, list[float]] = {}
    floors: list[float] = []
    began = clock()
    for turn in range(6):
        before, way = None, None
        for scene in scenes:
            near = way == (scene.loading.depth, scene.loading.slide)
            begun = clock()
            before = mesh.solve(scene, before if near else None)
            mesh.numbers(before)
            if turn and near:
                spans.setdefault(scene.title, []).append(clock() - begun)
            if turn:
                floors.append(mesh.floor())
            way = scene.loading.depth, scene.loading.slide
        if turn and clock() - began > most_s:
            break
    return [median(span) for span in spans.values()], floors or [mesh.floor()]
