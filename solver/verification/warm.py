"""The warm stepper that a live view calls: time a reading, and how far the response is off while forces come in.

The truth is a course driven by depth on a finer mesh: the finger is pressed, slides, and lifts off while it slides, in
so few readings that each moves it far. Its forces, without noise and without a bound on traction, are what the stepper
is given. A busy machine stops a process for milliseconds now and then: so
each reading counts with its median over several passes, and the percentile of one pass stands beside.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from solver.equilibrium.full_slip import settled
from solver.equilibrium.march import march, press_and_slide
from solver.equilibrium.newton import LoadState
from solver.response.stepper import Stepper, stepper
from solver.scene import Friction, Scene
from solver.verification.asked import Asked, Found, LeftOut, clock, within
from solver.verification.methods import FiniteMeshed, Kinematics, SmallMeshed
from solver.verification.truth import cases

PASSES, QUICK_PASSES = 5, 3
PRESS, SLIDES, DISTANCE = 200, 60, 6.0  # readings of the press and of the slide, and how far it goes [mm]
LIFTS = 8  # readings in which it lifts off: 40 ms at 200 Hz
FINER: dict[Kinematics, float] = {"small": 10.0, "finite": 8.0}  # fineness of the truth's mesh
SURFACES = ("slipperiness 100", "slipperiness 55", "slipperiness 0", "stickiness 0")
FULL: dict[Kinematics, tuple[str, ...]] = {"small": SURFACES, "finite": SURFACES}
QUICK: dict[Kinematics, tuple[str, ...]] = {"finite": SURFACES[:1], "small": SURFACES[::3]}
Reading = tuple[float, float, float]  # normal and tangential force [N/mm], SED [MPa]


@dataclass(frozen=True, slots=True)
class Warm:
    """One surface followed reading by reading."""

    kinematics: Kinematics
    case: str
    readings: int
    median_s: float
    p99_s: float  # of each reading's median over the passes
    once_p99_s: float  # of the last pass alone
    worst_error: float  # of the SED, by its peak
    setup_s: float


def measure(asked: Asked, found: Found) -> Iterator[Warm | LeftOut]:
    """Yield a row a surface and kinematics."""
    del found
    scenes = [s for kind, names in (QUICK if asked.quick else FULL).items() for s in cases(kind) if s.title in names]
    for scene in within(asked, scenes, "surfaces followed reading by reading"):
        yield (
            scene
            if isinstance(scene, LeftOut)
            else _row(replace(scene, friction=Friction(scene.friction.mu)), QUICK_PASSES if asked.quick else PASSES)
        )


def _row(scene: Scene, passes: int) -> Warm:
    kinematics = scene.solve.kinematics
    readings = list(_small(scene) if kinematics == "small" else _finite(scene))
    begun = clock()
    follows = stepper(scene)
    setup = clock() - begun
    spans, found = timed_passes(follows, readings, passes)
    truth = np.array([sed for _, _, sed in readings])
    each = np.median(spans, axis=0)
    return Warm(
        kinematics, scene.title, len(readings), float(np.median(each)), float(np.percentile(each, 99)),
        float(np.percentile(spans[-1], 99)), float(np.abs(found - truth).max() / truth.max()), setup,
    )  # fmt: skip


def timed_passes(follows: Stepper, readings: list[Reading], passes: int = PASSES) -> tuple[np.ndarray, np.ndarray]:
    """Return what each reading took in each pass (passes, n) [s], and the SED found in the last (n,)."""
    spans = np.zeros((passes, len(readings)))
    found = np.zeros(len(readings))
    for number in range(passes):
        follows.forget()
        for n, (normal, tangential, _) in enumerate(readings):
            begun = clock()
            found[n] = follows.step(normal, tangential)
            spans[number, n] = clock() - begun
    return spans, found


def _small(scene: Scene) -> Iterator[Reading]:
    finger = SmallMeshed(scene, FINER["small"], False).finger
    depth, direction = scene.loading.depth, scene.loading.direction
    course = press_and_slide(depth, scene.friction.mu, np.inf, direction, press=PRESS, slides=SLIDES, distance=DISTANCE)
    lifts = [(down, DISTANCE + depth * (n + 1)) for n, down in enumerate(_lifts(depth))]
    course += [LoadState(down, scene.friction.mu, travel=-direction * along) for down, along in lifts]
    for state in march(finger.newton, course):
        sed = finger.sed_ending(finger.displacement(state))
        yield float(state.force[1]), float(state.force[0]), sed


def _finite(scene: Scene) -> Iterator[Reading]:
    finger = FiniteMeshed(scene, FINER["finite"], False).finger
    depth, mu, direction = scene.loading.depth, scene.friction.mu, scene.loading.direction
    course = press_and_slide(depth, mu, np.inf, direction, press=PRESS, slides=SLIDES, distance=DISTANCE)
    for shape in march(finger.newton, course, tolerance=1e-6):
        yield float(shape.force[1]), float(shape.force[0]), finger.sed_ending(shape.u)
    shape = None
    for down in _lifts(depth):
        shape = settled(finger.newton, LoadState(down, mu, np.inf, -direction), shape)
        yield float(shape.force[1]), float(shape.force[0]), finger.sed_ending(shape.u)


def _lifts(depth: float) -> list[float]:
    """Return the depths of a finger that lifts off, at each of whose readings it slides as if settled."""
    return [depth * (1.0 - n / LIFTS) for n in range(1, LIFTS)]
