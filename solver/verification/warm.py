"""The warm stepper of a live view: its time per reading, and the error of its response to a sequence of forces.

The truth is a load path driven by depth on a finer mesh. The finger is pressed, slides, and lifts off while it slides,
in so few readings that each moves it far. The stepper gets the path's forces, without noise and traction bound. A busy
machine pauses processes for milliseconds, so the time of a reading is its median over several passes; the percentile of
one pass is given too.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from solver.contact import LoadState
from solver.equilibrium import EquilibriumState
from solver.equilibrium.load_stepping import march, solve_full_slip
from solver.response.stepper import Stepper, stepper
from solver.scene import Scene
from solver.scene.tables import Friction
from solver.verification.histories import press_and_slide
from solver.verification.methods import MESHED, Kinematics
from solver.verification.request import LeftOut, Request, clock, rows_within
from solver.verification.truth import KINEMATICS, cases

PASSES, QUICK_PASSES = 5, 3
_PRESS, _SLIDES, _DISTANCE = 200, 60, 6.0  # readings of the press and of the slide, and its distance [mm]
LIFTS = 8  # readings of the lift-off: 40 ms at 200 Hz
FINER: dict[Kinematics, float] = {"small": 10.0, "finite": 8.0}  # fineness of the truth's mesh
WARM_SCENES = ("slipperiness 100", "slipperiness 55", "slipperiness 0", "stickiness 0")
_QUICK: dict[Kinematics, tuple[str, ...]] = {"finite": WARM_SCENES[:1], "small": WARM_SCENES[::3]}
Reading = tuple[float, float, float]  # normal and tangential force [N/mm], SED [MPa]


@dataclass(frozen=True, slots=True)
class Warm:
    """One surface, followed reading by reading."""

    kinematics: Kinematics
    case: str
    readings: int
    median_s: float
    p99_s: float  # of each reading's median over the passes
    once_p99_s: float  # of the last pass alone
    worst_error: float  # of the SED, relative to its peak
    setup_s: float


def measure(request: Request) -> Iterator[Warm | LeftOut]:
    """Return an iterator over rows, one for each kinematics and surface."""
    scenes = [
        s for kind in KINEMATICS for s in cases(kind) if s.title in (_QUICK[kind] if request.quick else WARM_SCENES)
    ]
    unbounded = [replace(scene, friction=Friction(scene.friction.mu)) for scene in scenes]
    passes = QUICK_PASSES if request.quick else PASSES
    return rows_within(request, unbounded, "surfaces followed reading by reading", lambda scene: [_row(scene, passes)])


def _row(scene: Scene, passes: int) -> Warm:
    kinematics = scene.solve.kinematics
    readings = list(_readings(scene))
    start = clock()
    follows = stepper(scene)
    setup = clock() - start
    spans, seds = timed_passes(follows, readings, passes)
    truth = np.array([sed for _, _, sed in readings])
    each = np.median(spans, axis=0)
    return Warm(
        kinematics, scene.title, len(readings), float(np.median(each)), float(np.percentile(each, 99)),
        float(np.percentile(spans[-1], 99)), float(np.abs(seds - truth).max() / truth.max()), setup,
    )  # fmt: skip


def timed_passes(follows: Stepper, readings: list[Reading], passes: int = PASSES) -> tuple[np.ndarray, np.ndarray]:
    """Return the time of each reading in each pass (passes, n) [s], and the SED of the last pass (n,)."""
    spans = np.zeros((passes, len(readings)))
    seds = np.zeros(len(readings))
    for number in range(passes):
        follows.reset()
        for n, (normal, tangential, _) in enumerate(readings):
            start = clock()
            seds[n] = follows.step(normal, tangential)
            spans[number, n] = clock() - start
    return spans, seds


def _readings(scene: Scene) -> Iterator[Reading]:
    """Yield the readings on a finer mesh of a press, a slide, and a lift-off in states of full slip."""
    kind, loading, mu = scene.solve.kinematics, scene.loading, float(scene.friction.mu)
    finger = MESHED[kind](scene, FINER[kind], False).finger
    course = press_and_slide(
        loading.depth, mu, np.inf, loading.direction, press=_PRESS, slides=_SLIDES, distance=_DISTANCE
    )
    states = [*march(finger.newton, course, tolerance=1e-7)]
    state: EquilibriumState | None = None
    for n in range(1, LIFTS):
        load = LoadState(loading.depth * (1.0 - n / LIFTS), mu, np.inf, -loading.direction)
        state = solve_full_slip(finger.newton, load, state)
        states.append(state)
    for sed, push, drag in finger.numbers(states).tolist():
        yield push, drag, sed
