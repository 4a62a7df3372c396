"""Run the subjects one after another within the available time; an early end keeps the rows so far."""

import datetime
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import chain
from math import nan
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from solver.failures import SolveFailure
from solver.response.solution import solve
from solver.response.stepper import stepper
from solver.verification import (
    costs,
    estimates,
    growth,
    hard_cases,
    histories,
    machine,
    orders,
    processes,
    speed,
    targets,
    truth,
    warm,
)
from solver.verification.published import problems
from solver.verification.request import Host, LeftOut, Request

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FULL_S, QUICK_S = 140.0, 12.5  # time for the subjects; running items are finished, and drawing takes additional time
_ALWAYS = ("machine", "targets")  # run even after a stop, since they take no time
Progress = Callable[[float, str], None]
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Subject:
    """The measurement of one file."""

    name: str  # key in the JSON file
    doing: str  # shown while it runs
    shares: tuple[float, float]  # of the time, in a full and in a quick run; later subjects get unused time
    measure: "Callable[[Request], Iterator[DataclassInstance]]"
    kinds: "tuple[type[DataclassInstance], ...]"  # of its rows


# The order matters: a subject may use the rows of earlier ones, and processes run even without time left.
_SUBJECTS = (
    Subject("machine", "machine", (0.0, 0.0), machine.measure, (machine.Machine,)),
    Subject("truth", "overkill solves for the truth", (30.0, 1.5), truth.measure, (truth.Truth,)),
    Subject("speed", "time against true error", (38.0, 3.5), speed.measure, (speed.Speed,)),
    Subject(
        "estimates", "estimates against true errors", (25.0, 1.8),
        estimates.measure, (estimates.Estimate, estimates.GuaranteedCost),
    ),
    Subject("costs", "cost breakdown", (6.0, 0.6), costs.measure, (costs.Cost,)),
    Subject("warm", "the warm stepper", (10.0, 1.5), warm.measure, (warm.Warm,)),
    Subject("histories", "courses against direct states", (8.0, 0.3), histories.measure, (histories.March,)),
    Subject("problems", "published problems", (10.0, 1.6), problems.measure, (problems.Problem,)),
    Subject("orders", "orders of convergence", (20.0, 1.3), orders.measure, (orders.Order,)),
    Subject("growth", "growth with the unknowns", (12.0, 1.2), growth.measure, (growth.Growth,)),
    Subject("hard_cases", "hard cases", (35.0, 2.0), hard_cases.measure, (hard_cases.HardCase,)),
    Subject("processes", "cold starts and memory", (15.0, 2.5), processes.measure, (processes.Cold, processes.Memory)),
    Subject("targets", "targets of speed", (0.0, 0.0), targets.measure, (targets.Target,)),
)  # fmt: skip
_KINDS = {kind.__name__: kind for subject in _SUBJECTS for kind in subject.kinds}  # by their names in the JSON file


@dataclass(frozen=True, slots=True)
class RunResults:
    """Results of one run."""

    begun: str  # date and time, UTC
    quick: bool
    stopped: bool  # by the user, before all subjects were done
    took_s: dict[str, float]  # by subject
    rows: "Mapping[str, tuple[DataclassInstance, ...]]"  # by subject
    left_out: tuple[str, ...]

    def of(self, kind: type[R]) -> list[R]:
        """Return all rows of one class."""
        return [row for rows in self.rows.values() for row in rows if isinstance(row, kind)]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for a JSON file; nan becomes null."""
        rows = {
            name: [{"kind": type(row).__name__, **asdict(row)} for row in subject_rows]
            for name, subject_rows in self.rows.items()
        }
        whole = {
            "begun": self.begun, "quick": self.quick, "stopped": self.stopped, "took_s": self.took_s,
            "left_out": self.left_out, **rows,
        }  # fmt: skip
        return msgspec.json.decode(msgspec.json.encode(whole))


def restore(document: dict[str, Any]) -> RunResults:
    """Return the results from the data of `to_dict`. Raises msgspec.ValidationError for data of another form."""
    names = [subject.name for subject in _SUBJECTS if subject.name in document]
    rows = {name: tuple(map(_restore_row, document[name])) for name in names}
    return RunResults(
        document["begun"], document["quick"], document["stopped"], document["took_s"], rows, tuple(document["left_out"])
    )


def _restore_row(row: dict[str, Any]) -> "DataclassInstance":
    """Return a row from its data, where the null of a field that is always a number is nan."""
    kind = _KINDS[row["kind"]]
    numbers = {field.name for field in fields(kind) if field.type is float}
    data = {name: nan if value is None and name in numbers else value for name, value in row.items() if name != "kind"}
    return msgspec.convert(data, kind)


def measure(
    quick: bool, progress: Progress, host: Host, subjects: Sequence[Subject] = _SUBJECTS,
    seconds: float | None = None, clock: Callable[[], float] = perf_counter,
) -> RunResults:  # fmt: skip
    """Run the subjects and return their results. Ctrl-C ends the run and keeps the rows so far.

    The run takes `seconds` of `clock`. With a processor-time clock, a busy machine measures as much as an idle one.
    """
    begun = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    warm_up(progress)  # before the clock starts: the first run on a machine compiles, later ones load
    start = clock()
    end = start + (seconds or (QUICK_S if quick else FULL_S))
    rows: dict[str, tuple[DataclassInstance, ...]] = {}
    took: dict[str, float] = {}
    left_out: list[str] = []
    stopped = False
    for number, subject in enumerate(subjects):
        if stopped and subject.name not in _ALWAYS:
            left_out.append(f"Stopped before: {subject.doing}.")
            continue
        part = subject.shares[quick] / max(sum(later.shares[quick] for later in subjects[number:]), 1e-9)
        now = clock()
        request = Request(quick, now + max(end - now, 0.0) * part, clock, host, tuple(chain(*rows.values())))
        subject_rows: list[DataclassInstance] = []
        try:
            for row in subject.measure(request):
                progress(min((clock() - start) / (end - start), 0.99), subject.doing)
                if isinstance(row, LeftOut):
                    left_out.append(row.reason)
                else:
                    subject_rows.append(row)
        except KeyboardInterrupt:
            stopped = True
            left_out.append(f"Stopped during: {subject.doing}.")
        except (SolveFailure, ArithmeticError, MemoryError, ValueError) as failure:
            left_out.append(f"{subject.doing.capitalize()} broke off: {failure}")
        rows[subject.name], took[subject.name] = tuple(subject_rows), clock() - now
    return RunResults(begun, quick, stopped, took, rows, tuple(left_out))


def warm_up(progress: Progress) -> None:
    """Solve once in each kinematics and take one step, so that all compiled loops are loaded."""
    progress(0.0, "loading compiled loops")
    for kinematics in ("small", "finite"):
        scene = truth.cases(kinematics)[-1]
        request = replace(scene, solve=replace(scene.solve, tolerance=0.1))
        solve(request)
        if kinematics == "small":
            solve(replace(request, solve=replace(request.solve, course="history")))
        stepper(scene).step(1e-3, 0.0)
