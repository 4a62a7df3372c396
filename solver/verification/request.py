"""The request to a subject, with the rows that it may use, and the clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median
from time import get_clock_info, perf_counter, thread_time
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Kind = TypeVar("Kind")
Row = TypeVar("Row")
# Processor time of this thread, which excludes other work of a busy machine. Where the system's counter is too coarse,
# elapsed time.
PROCESSOR_TIME = get_clock_info("thread_time").resolution <= 1e-6
clock = thread_time if PROCESSOR_TIME else perf_counter


@dataclass(frozen=True, slots=True)
class LeftOut:
    """An omitted measurement and its reason, in one sentence."""

    reason: str


@dataclass(frozen=True, slots=True)
class Host:
    """The program that measures."""

    versions: Mapping[str, str] = field(default_factory=dict[str, str])  # program and libraries
    python: tuple[str, ...] = ("python3",)  # command that starts another Python


@dataclass(frozen=True, slots=True)
class Request:
    """Limits of a measurement, and the rows of all earlier subjects.

    No work starts after the instant `until` of the clock `now`.
    """

    quick: bool
    until: float
    now: Callable[[], float] = perf_counter
    host: Host = Host()
    rows: Sequence[DataclassInstance] = ()

    @property
    def seconds_left(self) -> float:
        """Seconds left; negative when the time is up."""
        return self.until - self.now()

    def pick(self, full: Iterable[Kind], quick: Iterable[Kind]) -> list[Kind]:
        """Return the items of a full or a quick run."""
        return list(quick if self.quick else full)

    def of(self, kind: type[Kind]) -> list[Kind]:
        """Return the rows of one class, in order."""
        return [row for row in self.rows if isinstance(row, kind)]


def repetitions(count: int, most_s: float) -> Iterator[int]:
    """Yield the numbers below `count` for `most_s` seconds of `clock`, at least the first."""
    start = clock()
    for number in range(count):
        yield number
        if clock() - start > most_s:
            return


def median_time(work: Callable[[], object], repeats: int = 5, most_s: float = 1.0) -> float:
    """Return the median time of `work()` [s] over up to `repeats` runs; slow work runs less often, at least once."""
    spans: list[float] = []
    for _ in repetitions(repeats, most_s):
        start = clock()
        work()
        spans.append(clock() - start)
    return median(spans)


def rows_within(
    request: Request, work: Iterable[Kind], what: str, rows: Callable[[Kind], Iterable[Row]]
) -> Iterator[Row | LeftOut]:
    """Yield the `rows` of each item of `work` until the time is up, at least of one; then report the omitted items."""
    items = list(work)
    for number, item in enumerate(items):
        if number and request.seconds_left <= 0.0:
            yield LeftOut(f"Time was over after {number} of {len(items)} {what}.")
            return
        yield from rows(item)
