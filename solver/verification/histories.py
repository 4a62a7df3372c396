"""A course of 200 substeps against the settled state found directly: the same state, at how many times the cost."""

from collections.abc import Iterator
from dataclasses import dataclass

from solver.equilibrium.march import march, press_and_slide
from solver.scene import Scene
from solver.verification.asked import Asked, Found, LeftOut, clock, timed, within
from solver.verification.methods import FiniteMeshed, Kinematics, SmallMeshed
from solver.verification.truth import JUDGED, cases

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


def measure(asked: Asked, found: Found) -> Iterator[Marched | LeftOut]:
    """Yield a row a surface and kinematics."""
    del found
    names = ("slipperiness 100", "stickiness 0") if asked.quick else JUDGED
    scenes = [s for kind in ("small", "finite") for s in cases(kind) if s.title in names]
    for scene in within(asked, scenes, "courses of 200 substeps"):
        if isinstance(scene, LeftOut):
            yield scene
        else:
            yield _small(scene) if scene.solve.kinematics == "small" else _finite(scene)


def _small(scene: Scene) -> Marched:
    return _marched(scene, SmallMeshed(scene, FINENESS["small"], False))


def _finite(scene: Scene) -> Marched:
    return _marched(scene, FiniteMeshed(scene, FINENESS["finite"], False))


def _marched(scene: Scene, mesh: SmallMeshed | FiniteMeshed) -> Marched:
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
    return Marched(scene.solve.kinematics, scene.title, mesh.dofs, mesh.prepared_s + span, took, off)
