"""A course of 200 substeps against the settled state found directly: the same state, at how many times the cost."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from daq_app.accuracy.asked import Asked, Found, LeftOut, clock, timed, within
from daq_app.accuracy.methods import FiniteMeshed, Kinematics, SmallMeshed
from daq_app.accuracy.truth import JUDGED, cases
from solver.contact.active_set import Course, untouched
from solver.contact.law import FrictionLaw
from solver.equilibrium.march import march, press_and_slide
from solver.scene import Scene

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
    mesh = SmallMeshed(scene, FINENESS["small"], False)
    touch, depth, way = mesh.finger.body.touchable, scene.loading.depth, scene.loading.direction
    law = FrictionLaw(float(scene.friction.mu), scene.friction.cap)

    def direct() -> float:
        return float(mesh.numbers(Course(touch, law).sliding(depth, way))[0])

    span = timed(direct, 9)
    course, state, begun = Course(touch, law), untouched(touch), clock()
    for n in range(PRESS):
        state = course.step(state, depth * (n + 1) / PRESS, 0.0)
    for n in range(SLIDES):
        state = course.step(state, depth, way * DISTANCE * (n + 1) / SLIDES)
    sed = float(mesh.numbers(state)[0])
    took = clock() - begun
    return Marched("small", scene.title, mesh.dofs, mesh.prepared_s + span, mesh.prepared_s + took, sed / direct() - 1)


def _finite(scene: Scene) -> Marched:
    mesh = FiniteMeshed(scene, FINENESS["finite"], False)
    friction, loading = scene.friction, scene.loading
    course = press_and_slide(
        loading.depth, friction.mu, friction.cap if friction.tau_max is not None else np.inf, loading.direction,
        press=PRESS, slides=SLIDES, distance=DISTANCE,
    )  # fmt: skip
    span = timed(lambda: mesh.numbers(mesh.solve(scene)), 5)
    begun = clock()
    *_, last = march(mesh.finger.newton, course)
    sed = float(mesh.numbers(last)[0])
    took = clock() - begun
    off = sed / float(mesh.numbers(mesh.solve(scene))[0]) - 1
    return Marched("finite", scene.title, mesh.dofs, span, took, off)
