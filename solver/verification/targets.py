"""Targets for the solver's speed, row by row: required and desired value, measured value, met or missed.

A speed belongs to a true error. It is the time on the cheapest mesh, without the estimate, mesh and tables, whose error
on slipperiness 0 to 100 and stickiness 0 stays below this error within the truth's doubt. The floor is one assembly,
factorisation and solve of the same system, timed in the same run.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import median

from solver.prediction import percent
from solver.verification.estimates import GuaranteedCost
from solver.verification.growth import Growth, exponent, large
from solver.verification.histories import March
from solver.verification.methods import Kinematics
from solver.verification.processes import Cold, Memory
from solver.verification.request import Request
from solver.verification.speed import MESHES, QUICK, Speed
from solver.verification.truth import JUDGED, KINEMATICS, cases, known_truths
from solver.verification.warm import WARM_SCENES, Warm

_AGREED = 1e-10  # largest relative difference of a load path from the direct state
PEAK = 0.02  # largest error of the warm stepper, relative to the peak


@dataclass(frozen=True, slots=True)
class Target:
    """One row. Times are in ms; `reach` and `aim` are None in a row that only reports."""

    work: str
    at_error: str
    unit: str
    reach: float | None
    aim: float | None
    measured: float | None = None  # None: not measured, or no mesh met the error
    floors: float | None = None  # `measured` relative to the floor
    how: str = ""  # method, mesh and error
    tried: bool = True  # whether all candidates were measured before the time was up
    part: str = ""  # the measured part, where it is less than required

    @property
    def verdict(self) -> str:
        """Whether the target was met, as a phrase."""
        if self.measured is None:
            return "missed" if self.tried and self.how != "" else "not measured"
        if self.reach is None:
            return "reported"
        where = f" by {self.part}" if self.part else ""
        if self.aim is not None and self.measured <= self.aim:
            return f"aim met{where}"
        return f"reach met{where}" if self.measured <= self.reach else "missed"


def measure(request: Request) -> Iterator[Target]:
    """Yield every row, from the rows of the other subjects."""
    further = "finite strain, each further surface"
    at_errors: tuple[tuple[str, Kinematics, float, float, float, Callable[[Speed], float | None]], ...] = (
        ("small strain, all ten surfaces, from scratch", "small", 0.01, 5.0, 2.0, lambda s: s.all_s),
        ("finite strain, one surface from undeformed", "finite", 0.01, 12.0, 8.0, lambda s: s.first_s),
        (further, "finite", 0.01, 4.0, 2.0, lambda s: s.next_s),
        (further, "finite", 0.003, 12.0, 6.0, lambda s: s.next_s),
        ("finite strain, one surface", "finite", 0.0015, 150.0, 80.0, lambda s: s.first_s),
        ("finite strain, one surface", "finite", 0.0006, 400.0, 100.0, lambda s: s.first_s),
    )
    for work, kinematics, error, reach, aim, time in at_errors:
        yield _at_error(request, Target(work, percent(error), "ms", reach, aim), kinematics, error, time)
    for kinematics, reach, aim in (("finite", 1.5, 1.0), ("small", 0.3, 0.1)):
        work = f"warm stepper, {kinematics} strain, p99 of a reading"
        rows = [row for row in request.of(Warm) if row.kinematics == kinematics]
        yield _warm(rows, Target(work, f"{percent(PEAK)} of peak", "ms", reach, aim))
    yield _march(
        request.of(March), Target("a course of 200 substeps, by the direct solve", "1e-10", "times", 60.0, 30.0)
    )
    cold = Target("`daq-app solve` as a cold process, compiled code cached", "", "ms", 1000.0, 400.0)
    yield _cold([row for row in request.of(Cold) if row.what.startswith("daq-app")], cold)
    yield from map(_guarantee, request.of(GuaranteedCost))
    for row in request.of(Memory):
        work, how = f"memory of a solve, {row.kinematics} strain, above idle", f"{row.dofs} unknowns, estimate "
        how += percent(row.error_estimate)
        yield Target(work, percent(row.tolerance), "MB", 100.0, None, row.solve_mb, how=how)
    for kinematics in KINEMATICS:
        rows = [row for row in request.of(Growth) if row.kinematics == kinematics]
        yield _growth(rows, Target(f"growth of the floor with unknowns, {kinematics} strain", "", "power", 1.5, None))


def _at_error(
    request: Request, target: Target, kinematics: Kinematics, error: float, time: Callable[[Speed], float | None]
) -> Target:
    rows = [row for row in request.of(Speed) if row.kinematics == kinematics]
    doubts = {name: truth.doubt[0] for name, truth in known_truths(request, kinematics).items()}
    with_error = [r for r in rows if r.judged_error is not None]
    accurate = [(took, r) for r in with_error if r.largest_error(doubts) <= error and (took := time(r)) is not None]
    if not accurate:
        best = min(with_error, key=lambda r: r.largest_error({}), default=None)
        if best is None:
            return target
        coarse = best.largest_error({}) > error
        sentence = "no measured mesh is below: the best has"
        if not coarse:
            sentence = "the truth is too uncertain to decide:"
        tried = coarse and len(rows) >= len((QUICK if request.quick else MESHES)[kinematics])
        return replace(target, how=f"{sentence} {_error(best, doubts)}", tried=tried)
    took, best = min(accurate, key=lambda pair: pair[0])
    how = f"{best.dofs} unknowns, error {_error(best, doubts)}"
    part = f"{best.surfaces} of them" if kinematics == "small" and best.surfaces < len(cases("small")) else ""
    return replace(target, measured=1e3 * took, floors=took / best.floor_s, how=how, part=part)


def _error(row: Speed, doubts: Mapping[str, float]) -> str:
    """Return the largest error of a mesh, and its upper bound within the truth's doubt."""
    return f"{percent(row.largest_error({}))}, {percent(row.largest_error(doubts))} at most"


def _warm(rows: Sequence[Warm], target: Target) -> Target:
    if not rows:
        return target
    worst = max(row.worst_error for row in rows)
    how = f"error {percent(worst)} of peak, median {1e3 * median(r.median_s for r in rows):.3g} ms"
    slowest = 1e3 * max(row.p99_s for row in rows)
    part = _part(len(rows), len(WARM_SCENES), "surfaces")
    return replace(target, measured=slowest if worst <= PEAK else None, how=how, part=part)


def _march(rows: Sequence[March], target: Target) -> Target:
    if not rows:
        return target
    difference = max(abs(row.difference) for row in rows)
    small = sum(row.kinematics == "small" for row in rows)
    how = f"largest difference {difference:.0e}; courses: {small} at small strain, {len(rows) - small} at finite strain"
    times = max(row.marched_s / row.direct_s for row in rows)
    part = _part(len(rows), 2 * len(JUDGED), "courses")
    return replace(target, measured=times if difference <= _AGREED else None, how=how, part=part)


def _cold(rows: Sequence[Cold], target: Target) -> Target:
    if not rows:
        return target
    how = ", ".join(f"{row.what.removeprefix('daq-app solve, ')} {1e3 * row.took_s:.0f} ms" for row in rows)
    part = _part(len(rows), len(KINEMATICS), "processes")
    return replace(target, measured=1e3 * max(row.took_s for row in rows), how=how, part=part)


def _guarantee(row: GuaranteedCost) -> Target:
    error = "" if row.worst_error is None else f", true error {percent(row.worst_error)}"
    how = f"{row.dofs} unknowns, estimate {percent(row.worst_estimate)}{error}"
    work = f"guaranteed tolerance, {row.kinematics} strain, {row.surfaces} surfaces, mesh to evidence included"
    return Target(work, percent(row.tolerance), "ms", None, None, 1e3 * row.took_s, how=how)


def _growth(rows: Sequence[Growth], target: Target) -> Target:
    if (power := exponent(rows)) is None:
        return target
    powers = [exponent(pair) or 0.0 for pair in pairwise(large(rows))]
    how = f"up to {max(row.dofs for row in rows):,} unknowns; from mesh to mesh {min(powers):.2f} to {max(powers):.2f}"
    return replace(target, measured=power, how=how)


def _part(count: int, total: int, what: str) -> str:
    return f"{count} of {total} {what}" if count < total else ""
