"""The course of a finger in time: the bone comes down over 1 s, then slides until nothing changes, or is dragged.

Tissues that relax are marched in time, and at last waited for. The steps are those of `CourseSteps`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil
from typing import NamedTuple

import numpy as np

from solver._kernels.compiling import OPEN, STICK
from solver.body import Patches
from solver.equilibrium import EquilibriumState, ForceLoad, LoadState, Newton, lower_onto_surface
from solver.equilibrium.finger import Finger, FiniteFinger, LinearFinger, relaxing_laws
from solver.equilibrium.load_stepping import StepControl, advance, load_of, solve_under_forces
from solver.equilibrium.relaxation import FiniteTissue, LinearTissue, RelaxingBody, Tissue
from solver.failures import NotConverged, SolveFailure, at_end_of_path, beyond_friction
from solver.progress import report_progress
from solver.scene import Scene
from solver.scene.tables import Loading

PRESSING_TIME = 1.0  # of the pre-indentation [s]
DRAGGING_TIME = 1.0  # within which a given tangential force grows [s]
ALL_SLIPS = 1e-6  # part of the friction limit within which a given drag is that of sliding
SED_STILL = 1e-10  # relative change of the ending's SED in a step from which on a slide at finite strain has settled
CONTROL = StepControl(smallest=2.0**-13, growth=2.0)
Report = Callable[[str, float], None]  # called with what is being done, and the part of the course done, 0 to 1


@dataclass(frozen=True, slots=True)
class CourseSteps:
    """How a course is cut into steps; those of a slide by the indentation."""

    press: int  # of the pre-indentation, and as many of a drag that grows
    first: float
    growth: float  # of each step of a slide by the one before
    largest: float
    furthest: float  # slide after which a course that has not settled is given up
    plateau: int = 0  # steps beyond the settled state, to show that nothing changes
    tolerance: float = 1e-10  # of displacements [mm]
    by_depth: float = 1.0  # the same by the indentation, where that is less

    def finer(self, times: float) -> "CourseSteps":
        """Return so many `times` the steps."""
        press = round(self.press * times)
        return replace(self, press=press, first=self.first / times, largest=self.largest / times)


SMALL = CourseSteps(25, first=0.01, growth=1.2, largest=0.06, furthest=100.0, plateau=4)
FINITE = CourseSteps(40, first=0.1, growth=1.0, largest=0.1, furthest=8.0, tolerance=1e-7, by_depth=1e-7)
RELAXING = CourseSteps(25, first=0.02, growth=1.2, largest=0.1, furthest=25.0, tolerance=1e-8, by_depth=1e-7)
LONG = 25.0  # slide within which all but those near the wedging limit settle, by the indentation


@dataclass(frozen=True, slots=True)
class Waiting:
    """How long tissues are waited for when nothing but relaxation goes on."""

    relaxed: float = 14.0  # times of the slowest tissue after which a body may count as relaxed: e^-14 is 8e-7
    equal: int = 6  # steps of equal length before they are doubled
    still: float = 1e-6  # change of the SED over such steps from which on it counts as relaxed [-]
    doublings: int = 60  # of the steps at most


WAITING = Waiting()


@dataclass(frozen=True, slots=True, eq=False)
class Instant:
    """One state on the way."""

    time: float  # [s]
    state: EquilibriumState

    @property
    def depth(self) -> float:
        """The bone's indentation [mm]."""
        return self.state.load.depth

    @property
    def travel(self) -> float:
        """How far the bone has moved along +x [mm]."""
        return 0.0 - self.state.load.travel


class Aim(NamedTuple):
    """What drives the bone at an instant."""

    time: float  # [s]
    press: float  # depth [mm], or normal force where that is given [N/mm]
    along: float  # travel along +x [mm], or the surface's pull along +x where that is given [N/mm]

    def towards(self, other: "Aim", part: float) -> "Aim":
        """Return what lies `part` of the way to `other`."""
        return Aim(*(a + part * (b - a) for a, b in zip(self, other, strict=True)))


class Way:
    """The states so far, and how the next one is found; where tissues relax, with what they store."""

    def __init__(
        self,
        newton: Newton,
        friction: LoadState,
        loading: Loading,
        tolerance: float = SMALL.tolerance,
        tissue: Tissue | None = None,
    ) -> None:
        """Start untouched, with mu and bound of `friction`; `loading` says what is driven and what is found.

        Displacements are found to a `tolerance` [mm] where depth and travel are given. `tissue` is one that relaxes.
        """
        self.tissue = tissue
        self.energies: list[tuple[float, ...]] = []  # of the places that it watches, at every instant after rest [MPa]
        self.sense = 0  # of the friction force on all relaxing skin that touches; 0: it is found
        self.newton, self._tolerance = newton, tolerance
        self.frictionless = friction.frictionless
        self.by_force = loading.normal_force is not None
        # without friction there is no drag to speak of, and nothing that it could hold
        self.by_drag = loading.dragged and not self.frictionless
        rest = EquilibriumState.undeformed(newton.condensed, LoadState(0.0, friction.mu, friction.tau))
        self.instants = [Instant(0.0, rest)]
        self.aim = Aim(0.0, 0.0, 0.0)

    @property
    def last(self) -> EquilibriumState:
        """The state reached."""
        return self.instants[-1].state

    def go(self, aim: Aim) -> None:
        """Append the state at `aim`, and those of smaller steps where one of that size fails."""
        begin = self.aim

        def step(part: float) -> None:
            there = aim if part == 1.0 else begin.towards(aim, part)
            self.instants.append(Instant(there.time, self.solve_step(self.last, there)))
            self.aim = there

        advance(step, self._refusal, CONTROL)

    def _refusal(self, _done: float, _part: float, reason: NotConverged) -> NotConverged:
        return at_end_of_path(self.last.load.depth, self.last.load.travel, reason)

    def solve_step(self, before: EquilibriumState, aim: Aim) -> EquilibriumState:
        """Return the state at `aim`, coming from `before`, and let tissues come to it. Raises NotConverged."""
        step = aim.time - self.aim.time
        if self.tissue is not None:
            self.newton = self.tissue.ready(step)
            before = replace(before, load=before.load._replace(sense=self.sense))
        if self.by_force:
            forces = ForceLoad(aim.press, aim.along) if self.by_drag else ForceLoad(aim.press, None, -aim.along)
            state = solve_under_forces(self.newton, lower_onto_surface(self.newton.condensed, before), forces)
        else:
            load = before.load._replace(depth=aim.press, travel=-aim.along)
            state = self.newton.settle(before, load, self._tolerance)
        if self.tissue is not None:
            self.energies.append(self.tissue.commit(state, step))
        return state


def march(
    scene: Scene,
    finger: Finger[Patches],
    times: float = 1.0,
    *,
    relaxing: bool = False,
    report: Report = report_progress,
) -> Way:
    """Drive the finger of a scene down and along, step by step (backward Euler), until every slide has settled.

    So many `times` the usual steps are taken. With `relaxing` the tissues relax, and are waited for at last; else they
    have relaxed from the start. A given drag must be less than what friction carries. Raises NotConverged where a step
    cannot be made or sliding does not settle, Cancelled.
    """
    steps, loading = steps_of(finger, relaxing=relaxing).finer(times), scene.loading_per_mm
    way = way_of(scene, finger, relaxing=relaxing)
    follow(way, finger, loading, steps, times, report)
    if way.tissue is not None:
        _wait(way, loading, scene.materials.longest_creep, times, report)
    return way


def end(scene: Scene, finger: Finger[Patches], times: float = 1.0) -> EquilibriumState:
    """Return the end of the course of a scene, in so many `times` the usual load steps. Raises as `march`."""
    return march(scene, finger, times, relaxing=scene.viscoelastic).last


def slide_or_hold(
    scene: Scene, slide: Callable[[], EquilibriumState], hold: Callable[[], EquilibriumState]
) -> EquilibriumState:
    """Return the state under the normal force of a scene: the `slide`, or the `hold` of a drag that friction carries.

    A drag may be met where sliding has no state. Raises NoSteadyState where it is more than friction carries, and as
    `slide` and `hold` do.
    """
    force, drag = scene.normal_force, scene.tangential_force
    try:
        state = slide()
    except SolveFailure:
        if drag is None:
            raise
        return hold()
    most = abs(float(state.force[0]))
    if drag is None or abs(drag - most) <= ALL_SLIPS * most:
        return state
    if drag > most:
        raise beyond_friction(drag, most, force or 0.0)
    return hold()


def steps_of(finger: Finger[Patches], *, relaxing: bool = False) -> CourseSteps:
    """Return the usual steps of the courses of a finger."""
    return SMALL if isinstance(finger, LinearFinger) else RELAXING if relaxing else FINITE


def way_of(scene: Scene, finger: Finger[Patches], *, relaxing: bool = False) -> Way:
    """Return the untouched finger of a scene, at the beginning of its course."""
    steps, loading = steps_of(finger, relaxing=relaxing), scene.loading_per_mm
    good = steps.tolerance
    if loading.normal_force is None:
        good = min(good, steps.by_depth * loading.depth)
    tissue = tissue_of(scene, finger) if relaxing else None
    return Way(finger.newton, load_of(scene), loading, good, tissue)


def tissue_of(scene: Scene, finger: Finger[Patches]) -> Tissue:
    """Return the tissues of a scene's finger at rest, as they relax."""
    laws = relaxing_laws(scene.materials)
    if isinstance(finger, FiniteFinger):
        return FiniteTissue(finger.body, laws, (finger.ending, finger.point))
    assert isinstance(finger, LinearFinger)
    body = RelaxingBody(finger.geometry.mesh, laws, checked=True)
    return LinearTissue(body, (finger.ending.endings, finger.point.endings))


def follow(
    way: Way, finger: Finger[Patches], loading: Loading, steps: CourseSteps, times: float, report: Report
) -> None:
    """Press, and slide or drag, along `way`. Raises as `march`."""
    press = loading.depth if loading.normal_force is None else loading.normal_force
    share = 1.0 if loading.dragged else 0.5  # of the work
    count = steps.press * (2 if loading.dragged else 1)
    doing = "pressing and dragging step by step" + _why(way)
    for number in range(1, steps.press + 1):
        part = number / steps.press
        way.go(Aim(PRESSING_TIME * part, press * part, 0.0))
        report(doing, share * number / count)
    if loading.tangential_force is not None:
        load = -loading.direction * loading.tangential_force
        for number in range(1, steps.press + 1):
            part = number / steps.press
            way.go(Aim(PRESSING_TIME + DRAGGING_TIME * part, press, load * part))
            report(doing, share * (steps.press + number) / count)
        return
    for direction in loading.directions:
        _slide(way, direction * loading.speed, steps, _EndOfSlide(way, finger, direction, times), report)


def _why(way: Way) -> str:
    return ", since the tissues relax" if way.tissue is not None else ""


class _EndOfSlide:
    """Whether a slide has settled, asked before every step of it."""

    def __init__(self, way: Way, finger: Finger[Patches], direction: int, times: float) -> None:
        self._way, self._finger, self._direction, self._times = way, finger, direction, times
        self._sed: float | None = None

    def __call__(self) -> bool:
        """Return whether further sliding changes nothing.

        At small strain that is so once every touching point slips against the slide. At finite strain states may go on
        to change: there the ending's SED must stay too, or the tissues be waited for.
        """
        state = self._way.last
        if isinstance(self._finger, LinearFinger):
            slips = (state.sense == -self._direction) | self._way.frictionless
            return bool(((state.state == OPEN) | ((state.state != STICK) & slips)).all())
        before = self._sed
        relaxes = self._way.tissue is not None
        sed = self._sed = 0.0 if relaxes else self._finger.sed_ending(state.u)
        still = before is not None and (relaxes or abs(sed - before) * self._times <= SED_STILL * sed)
        return still and not (state.state == STICK).any()


def _slide(way: Way, speed: float, steps: CourseSteps, settled: Callable[[], bool], report: Report) -> None:
    """Append the sliding states until they do not change, and a stretch of them beyond. Raises NotConverged."""
    begun, depth = way.aim, way.instants[-1].depth
    step, distance = steps.first * depth, 0.0
    direction, longest = np.sign(speed).item(), min(LONG, steps.furthest) * depth

    def go(distance: float) -> None:
        way.go(Aim(begun.time + distance / abs(speed), begun.press, begun.along + direction * distance))

    while not settled():
        if distance >= steps.furthest * depth:
            raise NotConverged(
                f"after {distance:.3g} mm of sliding at {depth:.4g} mm of indentation and mu = {way.last.load.mu:.3g} "
                "the state still changes, as it does where the finger wedges itself in; ask for less friction or depth"
            )
        distance += step
        go(distance)
        step = min(step * steps.growth, steps.largest * depth)
        report("sliding step by step until nothing changes" + _why(way), 0.5 + 0.5 * min(distance / longest, 1.0))
    beyond = max(0.3 * distance, depth)
    for number in range(1, steps.plateau + 1):
        go(distance + beyond * number / steps.plateau)


def _wait(way: Way, loading: Loading, slowest: float, times: float, report: Report) -> None:
    """Go on in steps that double until the `slowest` tissue [s] has relaxed, the bone sliding on where it slid last.

    Longer where the energy at the ending still moves: near a limit of sliding a body settles more slowly than any of
    its tissues.
    """
    speed = 0.0 if loading.dragged else loading.direction * loading.speed
    if not isinstance(way.tissue, LinearTissue):
        way.sense = -int(np.sign(speed))  # by now all that touches slips
    step, waited, longest = way.instants[-1].time - way.instants[-2].time, 0.0, WAITING.relaxed * slowest
    for _ in range(WAITING.doublings):
        before = way.energies[-1][0]
        for _ in range(ceil(WAITING.equal * times)):
            report("waiting step by step until the tissues have relaxed", min(waited / longest, 1.0))
            way.go(Aim(way.aim.time + step, way.aim.press, way.aim.along + speed * step))
            waited += step
        if waited >= longest and abs(way.energies[-1][0] - before) <= WAITING.still * abs(way.energies[-1][0]):
            return
        step *= 2.0
