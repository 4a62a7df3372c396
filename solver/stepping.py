"""The course in time: the bone comes down over 1 s, then slides until nothing changes any more."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver.contact import CAP, SLIP, Contact, ContactLost, Course, Touchable, untouched
from solver.failures import Cancelled, NotConverged
from solver.friction import FrictionLaw
from solver.scene import Loading

PRESSING_TIME = 1.0  # of the pre-indentation [s]
PRESSING_STEPS = 25
FURTHEST = 25.0  # travel after which sliding that has not settled is given up, in indentations
SMALLEST = 1e-4  # step below which a step that failed is given up, in indentations


@dataclass(frozen=True, slots=True, eq=False)
class Instant:
    """One state on the way."""

    time: float  # [s]
    depth: float  # of the bone's indentation [mm]
    travel: float  # of the bone along +x [mm]
    contact: Contact


@dataclass(frozen=True, slots=True, eq=False)
class March:
    """The way from first touch to the settled state."""

    instants: tuple[Instant, ...]
    settled_after: float | None  # sliding travel after which nothing changed [mm]; None without a slide
    iterations: int


Progress = Callable[[float], bool]  # told the part done, 0 to 1; False asks to stop


def march(body: Touchable, law: FrictionLaw, loading: Loading, progress: Progress | None = None) -> March:
    """Drive `body` down and along, step by step (backward Euler), until sliding has settled.

    Raises NotConverged where a step cannot be made or sliding does not settle, Cancelled where `progress` says so.
    """
    course = Course(body, law)
    way = [Instant(0.0, 0.0, 0.0, untouched(body))]
    for number in range(1, PRESSING_STEPS + 1):
        part = number / PRESSING_STEPS
        _advance(course, way, loading, loading.indentation * part, 0.0, PRESSING_TIME * part)
        _report(progress, part / 2.0)
    settled = None if loading.direction == 0 else _slide(course, way, loading, progress)
    return March(tuple(way), settled, sum(instant.contact.iterations for instant in way))


def _report(progress: Progress | None, part: float) -> None:
    if progress is not None and not progress(part):
        raise Cancelled


def _slide(course: Course, way: list[Instant], loading: Loading, progress: Progress | None) -> float:
    """Append the sliding states and return the travel after which they did not change."""
    step, distance = 0.01 * loading.indentation, 0.0
    largest = 0.06 * loading.indentation
    while distance < FURTHEST * loading.indentation:
        before = way[-1].contact
        if _settled(before, loading.direction, course.law):
            plateau = max(1.3 * distance, distance + loading.indentation)
            for part in np.linspace(distance, plateau, 5)[1:]:
                _advance(course, way, loading, loading.indentation, float(part), None)
            return distance
        distance += step
        _advance(course, way, loading, loading.indentation, distance, None)
        step = min(step * 1.2, largest)
        _report(progress, 0.5 + 0.5 * distance / (FURTHEST * loading.indentation))
    message = f"sliding had not settled after {distance:.1f} mm at {loading.indentation:g} mm indentation"
    raise NotConverged(f"{message}: the drag still grew, as it does where the finger wedges itself in.")


def _settled(contact: Contact, direction: int, law: FrictionLaw) -> bool:
    """Return whether every touching point slips against the slide, so that further sliding changes nothing."""
    slips = (contact.state == SLIP) | (contact.state == CAP)
    along = contact.sense == -direction
    return bool((~contact.touching | (slips & (along | law.frictionless))).all())


def _advance(
    course: Course, way: list[Instant], loading: Loading, depth: float, distance: float, time: float | None
) -> None:
    """Append the state at `depth` after sliding `distance`, in smaller steps where one of that size fails."""
    start = way[-1]
    when = PRESSING_TIME + distance / loading.speed if time is None else time
    try:
        contact = course.step(start.contact, depth, distance * loading.direction)
    except ContactLost as lost:
        begun = abs(start.travel)
        if max(depth - start.depth, distance - begun) < SMALLEST * loading.indentation:
            place = f"at {depth:.4g} mm indentation, after {distance:.4g} mm of sliding"
            raise NotConverged(
                f"No state of contact was found {place}: {lost}, in steps down to the smallest."
            ) from lost
        middle = None if time is None else (start.time + time) / 2.0
        _advance(course, way, loading, (start.depth + depth) / 2.0, (begun + distance) / 2.0, middle)
        _advance(course, way, loading, depth, distance, time)
        return
    way.append(Instant(when, depth, distance * loading.direction, contact))
