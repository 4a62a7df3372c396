"""What is asked of a subject, what it may know of the others, and how time is taken."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from statistics import median
from time import get_clock_info, perf_counter, thread_time
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Kind = TypeVar("Kind")
Row = TypeVar("Row")
# Processor time of the thread that works: on a quiet machine the time that passes, and on a busy one still the solver's
# own. Where the system counts it too coarsely, the time that passes.
PROCESSOR_TIME = get_clock_info("thread_time").resolution <= 1e-6
clock = thread_time if PROCESSOR_TIME else perf_counter


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Something that was not measured, and why: one sentence."""

    reason: str


@dataclass(frozen=True, slots=True)
class Host:
    """The program that measures."""

    versions: Mapping[str, str] = field(default_factory=dict[str, str])  # of it and its libraries, by name
    python: tuple[str, ...] = ("python3",)  # the command that starts another Python


@dataclass(frozen=True, slots=True)
class Request:
    """How much may be measured. `until` is an instant of the clock `now` after which nothing new is begun."""

    quick: bool
    until: float
    now: Callable[[], float] = perf_counter
    host: Host = Host()

    @property
    def seconds_left(self) -> float:
        """Seconds left; below 0 when time is over."""
        return self.until - self.now()

    def pick(self, full: Iterable[Kind], quick: Iterable[Kind]) -> list[Kind]:
        """Return what a full or a quick run measures."""
        return list(quick if self.quick else full)


@dataclass(slots=True)
class Measurements:
    """All rows so far, of every subject."""

    rows: list[DataclassInstance] = field(default_factory=list["DataclassInstance"])

    def of(self, kind: type[Kind]) -> list[Kind]:
        """Return the rows of one kind, in their order."""
        return [row for row in self.rows if isinstance(row, kind)]


def median_time(work: Callable[[], object], repeats: int = 5, most_s: float = 1.0) -> float:
    """Return the median time of `work()` [s] over up to `repeats` runs; slow work is run less often, at least once."""
    spans: list[float] = []
    start_s = clock()
    for _ in range(repeats):
        start = clock()
        work()
        spans.append(clock() - start)
        if clock() - start_s > most_s:
            break
    return median(spans)


def rows_within(
    request: Request, work: Iterable[Kind], what: str, rows: Callable[[Kind], Iterable[Row]]
) -> Iterator[Row | LeftOut]:
    """Yield the `rows` of each item of `work`, of one at least, until time is over; then that the rest is left out."""
    items = list(work)
    for number, item in enumerate(items):
        if number and request.seconds_left <= 0.0:
            yield LeftOut(f"Time was over after {number} of {len(items)} {what}.")
            return
        yield from rows(item)
