"""How long the warm steppers take for a reading and how true they are: forces in, SED out.

The truth is a course driven by depth on a finer mesh, 200 readings of pressing and 60 of sliding at 20 mm/s and 200 Hz;
its forces, without noise, are what the stepper is given. A busy machine stops a process for some milliseconds now and
then: so each reading counts with its median over several passes, and the plain percentiles of one pass stand beside.

Run it alone, single-threaded: OPENBLAS_NUM_THREADS=1 python -m benchmarks.stepper
"""

from collections.abc import Iterator
from time import perf_counter

import numpy as np

from solver.contact import Course, untouched
from solver.finger import FingerModel
from solver.finite_solution import FiniteFinger
from solver.friction import FrictionLaw
from solver.march import march, press_and_slide
from solver.mesher import Sizing
from solver.scene import Friction, Loading, Scene, Slide, Solve
from solver.stepper import Stepper, stepper

PASSES = 5
CASES: list[tuple[str, float, float, Slide]] = [
    ("slip 100", 1.5, 0.24, "-x"),
    ("slip 55", 1.5, 0.44, "-x"),
    ("slip 0", 1.5, 0.62, "-x"),
    ("stick 0", 2.0, 0.28, "+x"),
    ("stick 100", 2.0, 0.67, "+x"),  # has no settled slide at finite strain
]
PRESS, SLIDES, DISTANCE = 200, 60, 6.0
Reading = tuple[float, float, float]  # normal and tangential force [N/mm], SED [MPa]


def small_course(scene: Scene) -> Iterator[Reading]:
    """Yield the readings of a course at small strain."""
    finger = FingerModel.of(scene, Sizing(16, scene.loading.indentation))
    course = Course(finger.body.touchable, FrictionLaw(scene.friction.mu, np.inf))
    found = untouched(finger.body.touchable)
    depth, direction = scene.loading.indentation, scene.loading.direction
    press = [(depth * (n + 1) / PRESS, 0.0) for n in range(PRESS)]
    slide = [(depth, direction * DISTANCE * (n + 1) / SLIDES) for n in range(SLIDES)]
    for down, along in press + slide:
        found = course.step(found, down, along)
        sed = finger.sed_ending(finger.displacement(found))
        yield float(found.normal.sum()), float(found.tangential.sum()), sed


def finite_course(scene: Scene) -> Iterator[Reading]:
    """Yield the readings of a course at finite strain."""
    finger = FiniteFinger.of(scene, Sizing(12, scene.loading.indentation, margin=3.0))
    depth, mu, direction = scene.loading.indentation, scene.friction.mu, scene.loading.direction
    course = press_and_slide(depth, mu, np.inf, direction, press=PRESS, slides=SLIDES, distance=DISTANCE)
    for shape in march(finger.newton, course, tolerance=1e-6):
        yield float(shape.force[1]), float(shape.force[0]), finger.sed_ending(shape)


def timed(follows: Stepper, readings: list[Reading]) -> tuple[np.ndarray, np.ndarray]:
    """Return what each reading took in each pass (passes, n) [ms], and the SED found (n,)."""
    spans = np.zeros((PASSES, len(readings)))
    found = np.zeros(len(readings))
    for number in range(PASSES):
        follows.forget()
        for n, (normal, tangential, _) in enumerate(readings):
            begin = perf_counter()
            found[n] = follows.step(normal, tangential)
            spans[number, n] = 1e3 * (perf_counter() - begin)
    return spans, found


def row(scene: Scene) -> str:
    """Return the figures of one case."""
    course = small_course if scene.solve.kinematics == "small" else finite_course
    readings = list(course(scene))
    begin = perf_counter()
    follows = stepper(scene)
    setup = 1e3 * (perf_counter() - begin)
    spans, found = timed(follows, readings)
    truth = np.array([sed for _, _, sed in readings])
    worst = float(np.abs(found - truth).max() / truth.max())
    each = np.median(spans, axis=0)
    once = spans[-1]
    drawn: list[float] = []
    for _ in range(50):
        begin = perf_counter()
        follows.row()
        follows.outline()
        drawn.append(1e3 * (perf_counter() - begin))
    return (
        f"p50 {np.median(each):.3f}  p99 {np.percentile(each, 99):.3f} ms "
        f"(one pass: {np.median(once):.3f}, {np.percentile(once, 99):.3f})  row and outline {np.median(drawn):.3f} ms  "
        f"error {worst:.2%} of peak  set-up {setup:.0f} ms"
    )


def main() -> None:
    """Print the figures of both kinematics."""
    for kinematics in ("small", "finite"):
        print(f"{kinematics} strain")
        for name, depth, mu, slide in CASES:
            if kinematics == "finite" and name == "stick 100":
                continue
            loading = Loading(depth, slide, 20.0)
            scene = Scene(friction=Friction(mu), loading=loading, solve=Solve(kinematics=kinematics))
            print(f"  {name:10} {row(scene)}")


if __name__ == "__main__":
    main()
