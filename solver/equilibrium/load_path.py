"""The course in time: the bone comes down over 1 s, then slides until nothing changes any more, or is dragged."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from solver.contact.active_set import (
    SHEAR_LIMITED,
    SLIP,
    Contact,
    ContactLost,
    Course,
    Touchable,
    forced,
    lowered,
    untouched,
)
from solver.contact.law import FrictionLaw
from solver.equilibrium.root import UNMET, met
from solver.failures import Cancelled, NotConverged, followed_to
from solver.scene import Loading

PRESSING_TIME = 1.0  # of the pre-indentation [s]
PRESSING_STEPS = 25
DRAGGING_TIME = 1.0  # within which a given tangential force grows [s]
DRAGGING_STEPS = 25
LONG = 25.0  # travel within which all but slides near the wedging limit settle, in indentations
FURTHEST = 100.0  # and after which a slide that has not settled is given up
HALVINGS = 13  # how often a step that failed is cut in two before it is given up


@dataclass(frozen=True, slots=True, eq=False)
class Instant:
    """One state on the way."""

    time: float  # [s]
    depth: float  # of the bone's indentation [mm]
    travel: float  # of the bone along +x [mm]
    contact: Contact


@dataclass(frozen=True, slots=True, eq=False)
class March:
    """The way from first touch to the last state."""

    instants: tuple[Instant, ...]
    iterations: int


class Aim(NamedTuple):
    """What drives the bone at an instant."""

    time: float  # [s]
    press: float  # depth [mm], or normal force where that is given [N/mm]
    along: float  # travel along +x [mm], or the surface's pull along +x where that is given [N/mm]

    def towards(self, other: "Aim", part: float) -> "Aim":
        """Return what lies `part` of the way to `other`."""
        return Aim(*(a + part * (b - a) for a, b in zip(self, other, strict=True)))


Progress = Callable[[float], bool]  # told the part done, 0 to 1; False asks to stop


def march(
    body: Touchable, law: FrictionLaw, loading: Loading, progress: Progress | None = None, times: float = 1.0
) -> March:
    """Drive `body` down and along, step by step (backward Euler), until every slide of `loading` has settled.

    So many `times` the usual steps are taken. Forces of `loading` are per mm. A given drag must be less than what
    friction carries. Raises NotConverged where a step cannot be made or sliding does not settle, Cancelled where
    `progress` says so.
    """
    way = Way(body, law, loading)
    course(way, loading, progress, times)
    return way.march()


def course(way: "Way", loading: Loading, progress: Progress | None = None, times: float = 1.0) -> None:
    """Press, and slide or drag, along `way`, in so many `times` the usual steps. Raises as `march`."""
    presses, drags = round(PRESSING_STEPS * times), round(DRAGGING_STEPS * times)
    press = loading.depth if loading.normal_force is None else loading.normal_force
    for number in range(1, presses + 1):
        part = number / presses
        way.go(Aim(PRESSING_TIME * part, press * part, 0.0))
        _report(progress, part / 2.0)
    if loading.tangential_force is not None:
        pull = -loading.direction * loading.tangential_force
        for number in range(1, drags + 1):
            part = number / drags
            way.go(Aim(PRESSING_TIME + DRAGGING_TIME * part, press, pull * part))
            _report(progress, (1.0 + part) / 2.0)
    else:
        for direction in loading.directions:
            slide(way, direction, loading.speed, progress, times)


def _report(progress: Progress | None, part: float) -> None:
    if progress is not None and not progress(part):
        raise Cancelled


class Way:
    """The states so far, and how the next one is found."""

    def __init__(self, body: Touchable, law: FrictionLaw, loading: Loading) -> None:
        """Start at rest, untouched; `loading` says what is driven and what is found."""
        self.by_force = loading.normal_force is not None
        # without friction there is no drag to speak of, and nothing that it could hold
        self.by_drag = loading.tangential_force is not None and not law.frictionless
        start = untouched(body)
        self._body = body
        if self.by_force:
            body = forced(body, 0.0, 0.0 if self.by_drag else None)
            start = replace(lowered(law, start), motion=np.zeros(len(body.resultants)))
        self.course = Course(body, law)
        self.instants = [Instant(0.0, 0.0, 0.0, start)]
        self.aim = Aim(0.0, 0.0, 0.0)

    def march(self) -> March:
        """Return the way so far."""
        return March(tuple(self.instants), sum(i.contact.iterations for i in self.instants))

    def go(self, aim: Aim, halvings: int = HALVINGS) -> None:
        """Append the state at `aim`, in smaller steps where one of that size fails."""
        before = self.instants[-1].contact
        try:
            contact = self.found(before, aim)
        except ContactLost as lost:
            if halvings == 0:
                raise followed_to(self.instants[-1].depth, self.instants[-1].travel, lost) from lost
            self.go(self.aim.towards(aim, 0.5), halvings - 1)
            self.go(aim, halvings - 1)
            return
        depth = -float(contact.motion[0]) if self.by_force else aim.press
        travel = float(contact.motion[1]) if self.by_drag else aim.along
        self.instants.append(Instant(aim.time, depth, travel, contact))
        self.aim = aim

    def found(self, before: Contact, aim: Aim) -> Contact:
        """Return the state at `aim`, coming from `before`. Raises ContactLost."""
        if not self.by_force:
            return self.course.step(before, aim.press, aim.along)
        if not self.by_drag:
            return self.course.step(before, 0.0, aim.along, np.array([aim.press]))
        try:
            return self.course.step(before, 0.0, 0.0, np.array([aim.press, aim.along]))
        except ContactLost:  # as where friction is so small that all but one point slip
            found = self._met_by_travel(before, aim)
            if found is None:
                raise
            return found

    def _met_by_travel(self, before: Contact, aim: Aim) -> Contact | None:
        """Return the state at `aim` by search for the travel, which holds what nothing else does; None where none is.

        The drag falls as the bone moves along +x.
        """
        course = Course(forced(self._body, 0.0), self.course.law)
        near = before

        def at(travel: float) -> tuple[float, Contact]:
            nonlocal near
            guess = replace(before, state=near.state, sense=near.sense)
            near = course.step(guess, 0.0, -travel, np.array([aim.press]))
            return float(near.tangential.sum()) - aim.along, replace(near, motion=np.append(near.motion, -travel))

        return met(at, -float(before.motion[1]), UNMET * self.course.law.mu * aim.press)


def slide(way: Way, direction: int, speed: float, progress: Progress | None, times: float) -> None:
    """Append the sliding states until they do not change, and a stretch of them beyond."""
    begun, depth = way.aim, way.instants[-1].depth
    step, distance = 0.01 / times * depth, 0.0
    largest = 0.06 / times * depth

    def at(distance: float) -> Aim:
        return Aim(begun.time + distance / speed, begun.press, begun.along + direction * distance)

    while distance < FURTHEST * depth:
        if _settled(way.instants[-1].contact, direction, way.course.law):
            plateau = max(1.3 * distance, distance + depth)
            for part in np.linspace(distance, plateau, 5)[1:]:
                way.go(at(float(part)))
            return
        distance += step
        way.go(at(distance))
        step = min(step * 1.2, largest)
        _report(progress, 0.5 + 0.5 * min(distance / (LONG * depth), 1.0))
    message = f"sliding had not settled after {distance:.1f} mm at {depth:.4g} mm indentation"
    raise NotConverged(
        f"{message}: the drag still grew, as it does where the finger wedges itself in; ask for less friction or depth."
    )


def _settled(contact: Contact, direction: int, law: FrictionLaw) -> bool:
    """Return whether every touching point slips against the slide, so that further sliding changes nothing."""
    slips = (contact.state == SLIP) | (contact.state == SHEAR_LIMITED)
    along = contact.sense == -direction
    return bool((~contact.touching | (slips & (along | law.frictionless))).all())
