"""A course of 200 substeps against the settled state found directly: the same state, at how many times the cost."""

from collections.abc import Iterator
from dataclasses import dataclass

from solver.equilibrium.load_stepping import march, press_and_slide
from solver.scene import Scene
from solver.verification.methods import MESHED, Kinematics
from solver.verification.request import LeftOut, Measurements, Request, clock, rows_within, timed
from solver.verification.truth import JUDGED, KINEMATICS, cases

PRESS, SLIDES, DISTANCE = 40, 160, 8.0  # substeps of the press and of the slide, and how far it goes [mm]
FINENESS: dict[Kinematics, float] = {"small": 4.0, "finite": 3.0}


@dataclass(frozen=True, slots=True)
class Marched:
    """One surface marched and solved directly, on the same mesh."""

    kinematics: Kinematics
    case: str
    dofs: int
    direct_s: float
    marched_s: float
    difference: float  # of the SED, relative


def measure(request: Request, measurements: Measurements) -> Iterator[Marched | LeftOut]:
    """Return an iterator over a row a surface and kinematics."""
    del measurements
    names = ("slipperiness 100", "stickiness 0") if request.quick else JUDGED
    scenes = [s for kind in KINEMATICS for s in cases(kind) if s.title in names]
    return rows_within(request, scenes, "courses of 200 substeps", lambda scene: [_marched(scene)])


def _marched(scene: Scene) -> Marched:
    kind = scene.solve.kinematics
    mesh = MESHED[kind](scene, FINENESS[kind], False)
    friction, loading = scene.friction, scene.loading
    course = press_and_slide(
        loading.depth, float(friction.mu), friction.cap, loading.direction,
        press=PRESS, slides=SLIDES, distance=DISTANCE,
    )  # fmt: skip
    span = timed(lambda: mesh.numbers(mesh.solve(scene)), 5)
    begun = clock()
    *_, last = march(mesh.finger.newton, course)
    sed = float(mesh.numbers(last)[0])
    took = mesh.prepared_s + clock() - begun
    off = sed / float(mesh.numbers(mesh.solve(scene))[0]) - 1
    return Marched(kind, scene.title, mesh.dofs, mesh.prepared_s + span, took, off)
