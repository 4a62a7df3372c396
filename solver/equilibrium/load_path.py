"""The load path of a finger in time: a press over 1 s, then a slide until the state is settled, or a drag.

Where tissues relax, the path ends with a wait for their relaxation. `LoadSteps` defines the load steps.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil
from threading import get_ident
from typing import NamedTuple

import numpy as np

from solver._kernels import OPEN, STICK
from solver.arrays import Array
from solver.body import Patches
from solver.contact import ForceLoad, LoadState
from solver.equilibrium import EquilibriumState, Newton, Termination, lower_onto_surface
from solver.equilibrium.finger import Finger, FiniteFinger, LinearFinger, relaxing_laws
from solver.equilibrium.load_stepping import StepControl, advance, load_of, solve_under_forces
from solver.equilibrium.relaxation import FiniteTissue, LinearTissue, RelaxingBody, Tissue
from solver.failures import NotConverged, SolveFailure, at_end_of_path, beyond_friction
from solver.mesh import Mesh
from solver.progress import report_progress
from solver.scene import Scene
from solver.scene.tables import Loading, Materials

PRESSING_TIME = 1.0  # duration of the press [s]
DRAGGING_TIME = 1.0  # duration of the growth of a given tangential force [s]
FULL_SLIP_TOLERANCE = 1e-6  # relative difference of a given drag from the friction limit that counts as full slip
SED_TOLERANCE = 1e-10  # relative change of the ending's SED per step below which a slide at finite strain is settled
_CONTROL = StepControl(min_step=2.0**-13, step_growth=2.0)
Report = Callable[[str, float], None]  # called with a text and the completed fraction of the load path


@dataclass(frozen=True, slots=True)
class LoadSteps:
    """The load steps of a path; lengths are relative to the indentation."""

    press_steps: int  # also of a drag
    first_slide_step: float
    slide_growth: float  # ratio of consecutive steps
    max_slide_step: float
    max_slide: float  # slide after which a state that still changes is refused
    plateau_steps: int = 0  # steps beyond the settled state, which show that it does not change
    tolerance: float = 0.0  # of displacements; a body of constant stiffness needs none

    def finer(self, step_factor: float) -> "LoadSteps":
        """Return `step_factor` times as many steps."""
        return replace(
            self,
            press_steps=round(self.press_steps * step_factor),
            first_slide_step=self.first_slide_step / step_factor,
            max_slide_step=self.max_slide_step / step_factor,
        )


SMALL_STEPS = LoadSteps(
    25, first_slide_step=0.01, slide_growth=1.2, max_slide_step=0.06, max_slide=100.0, plateau_steps=4
)
FINITE_STEPS = LoadSteps(40, first_slide_step=0.1, slide_growth=1.0, max_slide_step=0.1, max_slide=8.0, tolerance=1e-7)
RELAXING_STEPS = LoadSteps(
    25, first_slide_step=0.02, slide_growth=1.2, max_slide_step=0.1, max_slide=25.0, tolerance=1e-8
)
USUAL_SLIDE = 25.0  # slide within which states settle, relative to the indentation, except near the wedging limit


@dataclass(frozen=True, slots=True)
class RelaxationSteps:
    """The steps of the wait for relaxation at the end of a load path."""

    min_wait: float = 14.0  # relative to the largest retardation time: e^-14 is 8e-7
    equal_steps: int = 6  # steps of one length, before the length doubles
    sed_tolerance: float = 1e-6  # relative change of the SED over equal steps below which tissue is relaxed
    max_doublings: int = 60  # of the step length


RELAXATION_STEPS = RelaxationSteps()


@dataclass(frozen=True, slots=True, eq=False)
class Instant:
    """A state of a load path, and its time."""

    time: float  # [s]
    state: EquilibriumState

    @property
    def depth(self) -> float:
        """Indentation of the bone [mm]."""
        return self.state.load.depth

    @property
    def travel(self) -> float:
        """Travel of the bone along +x [mm]."""
        return 0.0 - self.state.load.travel


class LoadPoint(NamedTuple):
    """The prescribed motion or forces of the bone at an instant."""

    time: float  # [s]
    press: float  # depth [mm], or a given normal force [N/mm]
    along: float  # travel along +x [mm], or a given tangential force on the skin along +x [N/mm]

    def towards(self, target: "LoadPoint", part: float) -> "LoadPoint":
        """Return the point a `part` of the way to `target`."""
        return LoadPoint(*(a + part * (b - a) for a, b in zip(self, target, strict=True)))


class LoadPath:
    """A load path: its states so far, the step to the next one, and the energies of relaxing tissues."""

    def __init__(
        self,
        newton: Newton,
        friction: LoadState,
        loading: Loading,
        tolerance: float = 0.0,
        tissue: Tissue | None = None,
    ) -> None:
        """Start undeformed, with mu and bound of `friction`; `loading` prescribes depth or forces.

        `tolerance` is that of displacements relative to a given indentation. `tissue` is given where tissues relax.
        """
        self.tissue = tissue
        self.energies: list[Array] = []  # of the endings in relaxing tissue, at every instant after the first [MPa]
        self.sense = 0  # direction of the friction force on relaxing skin; 0: unknown
        self.newton = newton
        self._termination = Termination(tolerance * (loading.indentation or 0.0) / newton.length_scale)
        self.frictionless = friction.frictionless
        self.by_force = loading.normal_force is not None
        # a drag needs friction
        self.by_drag = loading.dragged and not self.frictionless
        start = EquilibriumState.undeformed(newton.condensed, LoadState(0.0, friction.mu, friction.tau))
        self.instants = [Instant(0.0, start)]
        self.point = LoadPoint(0.0, 0.0, 0.0)

    @property
    def last(self) -> EquilibriumState:
        """The last state."""
        return self.instants[-1].state

    def advance_to(self, point: LoadPoint) -> None:
        """Append the state at `point`; a step that fails is halved, which appends intermediate states too."""
        begin = self.point

        def step(part: float) -> None:
            step_point = point if part == 1.0 else begin.towards(point, part)
            self.instants.append(Instant(step_point.time, self.solve_step(self.last, step_point)))
            self.point = step_point

        advance(step, self._refusal, _CONTROL)

    def _refusal(self, _fraction: float, _part: float, reason: NotConverged) -> NotConverged:
        return at_end_of_path(self.last.load.depth, self.last.load.travel, reason)

    def solve_step(self, previous: EquilibriumState, point: LoadPoint) -> EquilibriumState:
        """Return the state at `point` one step from `previous`, and advance the tissues. Raises NotConverged."""
        step = point.time - self.point.time
        if self.tissue is not None:
            self.newton = self.tissue.ready(step)
            previous = replace(previous, load=previous.load._replace(sense=self.sense))
        if self.by_force:
            forces = ForceLoad(point.press, point.along) if self.by_drag else ForceLoad(point.press, None, -point.along)
            state = solve_under_forces(self.newton, lower_onto_surface(self.newton.condensed, previous), forces)
        else:
            load = previous.load._replace(depth=point.press, travel=-point.along)
            state = self.newton.solve(previous, load, self._termination)
        if self.tissue is not None:
            self.energies.append(self.tissue.commit(state, step))
        return state


def march_scene(
    scene: Scene,
    finger: Finger[Patches],
    step_factor: float = 1.0,
    *,
    relaxing: bool = False,
    report: Report = report_progress,
) -> LoadPath:
    """Return the load path of a scene by backward Euler steps: the press, then slides until they settle, or a drag.

    It takes `step_factor` times the usual steps. With `relaxing` the tissues relax, and a wait for them ends the path;
    otherwise they are relaxed from the start. A given drag must be less than the friction limit. Raises NotConverged
    where a step fails or a slide does not settle, Cancelled.
    """
    steps, loading = steps_of(finger, relaxing=relaxing).finer(step_factor), scene.loading_per_mm
    path = undeformed_path(scene, finger, relaxing=relaxing)
    apply_loading(path, finger, loading, steps, step_factor, report)
    if path.tissue is not None:
        _relax(path, loading, scene.materials.longest_creep, step_factor, report)
    return path


def end_of_path(scene: Scene, finger: Finger[Patches], step_factor: float = 1.0) -> EquilibriumState:
    """Return the end of the load path of a scene in `step_factor` times the usual steps. Raises as `march_scene`."""
    return march_scene(scene, finger, step_factor, relaxing=scene.viscoelastic).last


def slide_or_hold(
    scene: Scene, finger: Finger[Patches], slide: Callable[[], EquilibriumState], step_factor: float
) -> EquilibriumState:
    """Return the state under the normal force of a scene: `slide`, or a load path for a drag below the friction limit.

    A drag may have a state where full slip does not exist. Raises NoSteadyState for a drag beyond the friction limit,
    and as `slide` and `march_scene` do.
    """
    force, drag = scene.normal_force, scene.tangential_force
    try:
        state = slide()
    except SolveFailure:
        if drag is None:
            raise
        return march_scene(scene, finger, step_factor).last
    most = abs(float(state.force[0]))
    if drag is None or abs(drag - most) <= FULL_SLIP_TOLERANCE * most:
        return state
    if drag > most:
        raise beyond_friction(drag, most, force or 0.0)
    return march_scene(scene, finger, step_factor).last


def steps_of(finger: Finger[Patches], *, relaxing: bool = False) -> LoadSteps:
    """Return the usual load steps of a finger."""
    return SMALL_STEPS if isinstance(finger, LinearFinger) else RELAXING_STEPS if relaxing else FINITE_STEPS


def undeformed_path(scene: Scene, finger: Finger[Patches], *, relaxing: bool = False) -> LoadPath:
    """Return the load path of a scene at its undeformed beginning."""
    tissue = tissue_of(scene, finger) if relaxing else None
    tolerance = steps_of(finger, relaxing=relaxing).tolerance
    return LoadPath(finger.newton, load_of(scene), scene.loading_per_mm, tolerance, tissue)


def tissue_of(scene: Scene, finger: Finger[Patches]) -> Tissue:
    """Return the relaxing tissues of a scene's finger, at rest."""
    if isinstance(finger, FiniteFinger):
        return FiniteTissue(finger.body, relaxing_laws(scene.materials), finger.ending_and_midpoint)
    assert isinstance(finger, LinearFinger)
    body = copy(_relaxing_body(finger.geometry.mesh, scene.materials, get_ident()))
    body.reset()
    return LinearTissue(body, finger.ending_and_midpoint.endings)


@lru_cache(maxsize=1)
def _relaxing_body(mesh: Mesh, materials: Materials, _thread: int) -> RelaxingBody:
    """Return the relaxing body of a mesh, cached for consecutive load paths in one thread."""
    return RelaxingBody(mesh, relaxing_laws(materials), checked=True)


def apply_loading(
    path: LoadPath, finger: Finger[Patches], loading: Loading, steps: LoadSteps, step_factor: float, report: Report
) -> None:
    """Append the press, and the slides or the drag. Raises as `march_scene`."""
    press = loading.depth if loading.normal_force is None else loading.normal_force
    parts = [number / steps.press_steps for number in range(1, steps.press_steps + 1)]
    points = [LoadPoint(PRESSING_TIME * part, press * part, 0.0) for part in parts]
    share = 0.5  # of the work, for progress
    if loading.tangential_force is not None:
        load, share = -loading.direction * loading.tangential_force, 1.0
        points += [LoadPoint(PRESSING_TIME + DRAGGING_TIME * part, press, load * part) for part in parts]
    for number, point in enumerate(points, 1):
        path.advance_to(point)
        report("pressing and dragging step by step" + _reason(path), share * number / len(points))
    for direction in () if loading.dragged else loading.directions:
        settled = _settling_criterion(path, finger, direction, step_factor)
        _slide(path, direction * loading.speed, steps, settled, report)


def _reason(path: LoadPath) -> str:
    return ", since the tissues relax" if path.tissue is not None else ""


def _settling_criterion(
    path: LoadPath, finger: Finger[Patches], direction: int, step_factor: float
) -> Callable[[], bool]:
    """Return a criterion that a slide is settled, to be evaluated before every step.

    At small strain every point in contact must slip against the slide. At finite strain the ending's SED must be
    constant too, unless tissues relax, for which a wait follows.
    """
    previous: float | None = None

    def slips() -> bool:
        state = path.last
        against = (state.sense == -direction) | path.frictionless
        return bool(((state.state == OPEN) | ((state.state != STICK) & against)).all())

    def is_still() -> bool:
        nonlocal previous
        before, relaxes = previous, path.tissue is not None
        sed = previous = 0.0 if relaxes else finger.sed_ending(path.last.u)
        still = before is not None and (relaxes or abs(sed - before) * step_factor <= SED_TOLERANCE * sed)
        return still and not (path.last.state == STICK).any()

    return slips if isinstance(finger, LinearFinger) else is_still


def _slide(path: LoadPath, speed: float, steps: LoadSteps, settled: Callable[[], bool], report: Report) -> None:
    """Append the states of a slide until it is settled, and the plateau that follows. Raises NotConverged."""
    start, depth = path.point, path.instants[-1].depth
    step, distance = steps.first_slide_step * depth, 0.0
    direction, longest = np.sign(speed).item(), min(USUAL_SLIDE, steps.max_slide) * depth

    def go(distance: float) -> None:
        path.advance_to(LoadPoint(start.time + distance / abs(speed), start.press, start.along + direction * distance))

    while not settled():
        if distance >= steps.max_slide * depth:
            raise NotConverged(
                f"after {distance:.3g} mm of sliding at {depth:.4g} mm of indentation and mu = {path.last.load.mu:.3g} "
                "the state still changes, as it does where the finger wedges itself in; ask for less friction or depth"
            )
        distance += step
        go(distance)
        step = min(step * steps.slide_growth, steps.max_slide_step * depth)
        report("sliding step by step until settled" + _reason(path), 0.5 + 0.5 * min(distance / longest, 1.0))
    beyond = max(0.3 * distance, depth)
    for number in range(1, steps.plateau_steps + 1):
        go(distance + beyond * number / steps.plateau_steps)


def _relax(path: LoadPath, loading: Loading, slowest: float, step_factor: float, report: Report) -> None:
    """Append states in doubling steps until the `slowest` tissue [s] has relaxed, while a slide continues.

    Near a limit of full slip a body relaxes more slowly than its tissues, so that the energy must be constant too.
    """
    speed = 0.0 if loading.dragged else loading.direction * loading.speed
    if not isinstance(path.tissue, LinearTissue):
        path.sense = -int(np.sign(speed))  # here all skin in contact slips
    step, elapsed, longest = path.instants[-1].time - path.instants[-2].time, 0.0, RELAXATION_STEPS.min_wait * slowest
    for _ in range(RELAXATION_STEPS.max_doublings):
        previous = path.energies[-1][0]
        for _ in range(ceil(RELAXATION_STEPS.equal_steps * step_factor)):
            report("waiting step by step until the tissues have relaxed", min(elapsed / longest, 1.0))
            path.advance_to(LoadPoint(path.point.time + step, path.point.press, path.point.along + speed * step))
            elapsed += step
        if elapsed >= longest and abs(path.energies[-1][0] - previous) <= RELAXATION_STEPS.sed_tolerance * abs(
            path.energies[-1][0]
        ):
            return
        step *= 2.0
