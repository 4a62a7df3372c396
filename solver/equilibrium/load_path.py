"""The way of a finger in time: the bone comes down over 1 s, then slides until nothing changes, or is dragged."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from solver._kernels import OPEN, SHEAR_LIMITED, SLIP
from solver.equilibrium.force_control import balanced
from solver.equilibrium.load_stepping import StepControl, advance, never
from solver.equilibrium.newton import EquilibriumState, Given, LoadState, Newton, lowered
from solver.failures import NotConverged, followed_to
from solver.progress import Progress, report_part
from solver.scene.scene import Loading

PRESSING_TIME = 1.0  # of the pre-indentation [s]
PRESSING_STEPS = 25
DRAGGING_TIME = 1.0  # within which a given tangential force grows [s]
DRAGGING_STEPS = 25
LONG = 25.0  # travel within which all but slides near the wedging limit settle, in indentations
FURTHEST = 100.0  # and after which a slide that has not settled is given up
CONTROL = StepControl(smallest=2.0**-13, growth=2.0)
TOLERANCE = 1e-10  # of displacements [mm]


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


def march(
    newton: Newton, friction: LoadState, loading: Loading, progress: Progress | None = None, times: float = 1.0
) -> tuple[Instant, ...]:
    """Drive a body down and along, step by step (backward Euler), until every slide of `loading` has settled.

    So many `times` the usual steps are taken. Forces of `loading` are per mm. A given drag must be less than what
    friction carries. Raises NotConverged where a step cannot be made or sliding does not settle, Cancelled where
    `progress` says so.
    """
    way = Way(newton, friction, loading)
    course(way, loading, progress, times)
    return tuple(way.instants)


def course(way: "Way", loading: Loading, progress: Progress | None = None, times: float = 1.0) -> None:
    """Press, and slide or drag, along `way`, in so many `times` the usual steps. Raises as `march`."""

    def report(part: float) -> None:
        report_part(progress, part if loading.dragged else part / 2.0)

    press_and_drag(way, loading, report, round(PRESSING_STEPS * times), round(DRAGGING_STEPS * times))
    if not loading.dragged:
        for direction in loading.directions:
            slide(way, direction, loading.speed, progress, times)


def press_and_drag(way: "Way", loading: Loading, report: Callable[[float], None], pressing: int, dragging: int) -> None:
    """Press along `way` in so many steps, and let a given drag grow in so many; `report` the part done, 0 to 1."""
    press = loading.depth if loading.normal_force is None else loading.normal_force
    count = pressing + (dragging if loading.dragged else 0)
    for number in range(1, pressing + 1):
        part = number / pressing
        way.go(Aim(PRESSING_TIME * part, press * part, 0.0))
        report(number / count)
    if loading.tangential_force is not None:
        load = -loading.direction * loading.tangential_force
        for number in range(1, dragging + 1):
            part = number / dragging
            way.go(Aim(PRESSING_TIME + DRAGGING_TIME * part, press, load * part))
            report((pressing + number) / count)


class Way:
    """The states so far, and how the next one is found."""

    def __init__(
        self,
        newton: Newton,
        friction: LoadState,
        loading: Loading,
        tolerance: float = TOLERANCE,
        stop: Callable[[], bool] = never,
    ) -> None:
        """Start untouched, with mu and bound of `friction`; `loading` says what is driven and what is found.

        Displacements are found to a `tolerance` [mm] where depth and travel are given.
        """
        self.newton, self._tolerance, self._stop = newton, tolerance, stop
        self.frictionless = friction.frictionless
        self.by_force = loading.normal_force is not None
        # without friction there is no drag to speak of, and nothing that it could hold
        self.by_drag = loading.dragged and not self.frictionless
        rest = replace(
            EquilibriumState.undeformed(newton.condensed), load=LoadState(0.0, friction.mu, friction.tau).checked()
        )
        self.instants = [Instant(0.0, rest)]
        self.aim = Aim(0.0, 0.0, 0.0)

    @property
    def last(self) -> EquilibriumState:
        """The state reached."""
        return self.instants[-1].state

    @property
    def states(self) -> list[EquilibriumState]:
        """The states after rest."""
        return [instant.state for instant in self.instants[1:]]

    def go(self, aim: Aim) -> None:
        """Append the state at `aim`, and those of smaller steps where one of that size fails."""
        begin = self.aim

        def step(part: float) -> None:
            there = aim if part == 1.0 else begin.towards(aim, part)
            self.instants.append(Instant(there.time, self.found(self.last, there)))
            self.aim = there

        advance(step, self._refusal, CONTROL, self._stop)

    def _refusal(self, _done: float, _part: float, reason: NotConverged) -> NotConverged:
        return followed_to(self.last.load.depth, self.last.load.travel, reason)

    def found(self, before: EquilibriumState, aim: Aim) -> EquilibriumState:
        """Return the state at `aim`, coming from `before`. Raises NotConverged."""
        if not self.by_force:
            return self.newton.settle(before, before.load._replace(depth=aim.press, travel=-aim.along), self._tolerance)
        given = Given(aim.press, aim.along) if self.by_drag else Given(aim.press, None, -aim.along)
        return balanced(self.newton, lowered(self.newton.condensed, before), given)


def slide(way: Way, direction: int, speed: float, progress: Progress | None, times: float) -> None:
    """Append the sliding states until they do not change, and a stretch of them beyond."""
    begun, depth = way.aim, way.instants[-1].depth
    step, distance = 0.01 / times * depth, 0.0
    largest = 0.06 / times * depth

    def at(distance: float) -> Aim:
        return Aim(begun.time + distance / speed, begun.press, begun.along + direction * distance)

    while distance < FURTHEST * depth:
        if _settled(way.instants[-1].state, direction, frictionless=way.frictionless):
            plateau = max(1.3 * distance, distance + depth)
            for part in np.linspace(distance, plateau, 5)[1:]:
                way.go(at(float(part)))
            return
        distance += step
        way.go(at(distance))
        step = min(step * 1.2, largest)
        report_part(progress, 0.5 + 0.5 * min(distance / (LONG * depth), 1.0))
    message = f"sliding had not settled after {distance:.1f} mm at {depth:.4g} mm indentation"
    raise NotConverged(
        f"{message}: the drag still grew, as it does where the finger wedges itself in; ask for less friction or depth."
    )


def _settled(state: EquilibriumState, direction: int, *, frictionless: bool) -> bool:
    """Return whether every touching point slips against the slide, so that further sliding changes nothing."""
    slips = (state.state == SLIP) | (state.state == SHEAR_LIMITED)
    along = state.sense == -direction
    return bool(((state.state == OPEN) | (slips & (along | frictionless))).all())
