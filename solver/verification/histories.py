"""A load path of 200 substeps against the directly solved settled state: the same state at a multiple of the cost."""

from collections.abc import Iterator
from dataclasses import dataclass

from solver.contact import LoadState
from solver.equilibrium.load_stepping import march
from solver.scene import Scene
from solver.verification.methods import MESHED, Kinematics
from solver.verification.request import LeftOut, Request, clock, median_time, rows_within
from solver.verification.truth import JUDGED, KINEMATICS, cases

_PRESS, _SLIDES, _DISTANCE = 40, 160, 8.0  # substeps of the press and of the slide, and its distance [mm]
_FINENESS: dict[Kinematics, float] = {"small": 4.0, "finite": 3.0}


@dataclass(frozen=True, slots=True)
class March:
    """One surface, marched and solved directly on the same mesh."""

    kinematics: Kinematics
    case: str
    dofs: int
    direct_s: float
    marched_s: float
    difference: float  # of the SED, relative


def measure(request: Request) -> Iterator[March | LeftOut]:
    """Return an iterator over rows, one for each kinematics and surface."""
    names = ("slipperiness 100", "stickiness 0") if request.quick else JUDGED
    scenes = [s for kind in KINEMATICS for s in cases(kind) if s.title in names]
    return rows_within(request, scenes, "courses of 200 substeps", lambda scene: [_march(scene)])


def press_and_slide(
    depth: float, mu: float, tau: float, direction: int, press: int, slides: int, distance: float
) -> list[LoadState]:
    """Return the load path of a bone driven `depth` [mm] down in `press` steps, then `distance` [mm] along in `slides`.

    `direction` is that of the bone, +1 along +x: the surface moves the other way.

    >>> [(p.depth, p.travel) for p in press_and_slide(1.0, 0.3, 0.02, +1, press=2, slides=2, distance=4.0)]
    [(0.5, 0.0), (1.0, 0.0), (1.0, -2.0), (1.0, -4.0)]
    """
    down = [LoadState(depth * (i + 1) / press, mu, tau) for i in range(press)]
    return down + [LoadState(depth, mu, tau, travel=-direction * distance * (i + 1) / slides) for i in range(slides)]


def _march(scene: Scene) -> March:
    kind = scene.solve.kinematics
    mesh = MESHED[kind](scene, _FINENESS[kind], False)
    friction, loading = scene.friction, scene.loading
    course = press_and_slide(
        loading.depth, float(friction.mu), friction.cap, loading.direction,
        press=_PRESS, slides=_SLIDES, distance=_DISTANCE,
    )  # fmt: skip
    span = median_time(lambda: mesh.numbers(mesh.solve(scene)), 5)
    start = clock()
    *_, last = march(mesh.finger.newton, course)
    sed = float(mesh.numbers(last)[0])
    elapsed_s = mesh.prepared_s + clock() - start
    difference = sed / float(mesh.numbers(mesh.solve(scene))[0]) - 1
    return March(kind, scene.title, mesh.dofs, mesh.prepared_s + span, elapsed_s, difference)
