"""Run the subjects one after another within the time there is; an early end keeps the rows so far."""

import datetime
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from math import nan
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from solver.failures import SolveFailure
from solver.response.solution import solve
from solver.response.stepper import stepper
from solver.verification.costs import Cost
from solver.verification.estimates import Estimate, GuaranteedCost
from solver.verification.growth import Growth
from solver.verification.hard_cases import HardCase
from solver.verification.histories import March
from solver.verification.machine import Machine
from solver.verification.orders import Order
from solver.verification.processes import Cold, Memory
from solver.verification.published.problems import Problem
from solver.verification.request import Host, LeftOut, Measurements, Request
from solver.verification.speed import Speed
from solver.verification.subjects import SUBJECTS, Subject
from solver.verification.targets import Target
from solver.verification.truth import Truth, cases
from solver.verification.warm import Warm

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FULL_S, QUICK_S = 140.0, 12.5  # time for the subjects; a running item is finished, and drawing takes more
# row classes by their names in the JSON file
KINDS = {
    kind.__name__: kind
    for kind in (
        Machine, Truth, Speed, Estimate, GuaranteedCost, Cost, Warm, March, Cold, Memory, Problem, Order, Growth,
        HardCase, Target,
    )
}  # fmt: skip
ALWAYS = ("machine", "targets")  # run even after a stop, since they take no time
Progress = Callable[[float, str], None]
R = TypeVar("R")


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
            name: [{"kind": type(row).__name__, **asdict(row)} for row in measurements]
            for name, measurements in self.rows.items()
        }
        whole = {
            "begun": self.begun, "quick": self.quick, "stopped": self.stopped, "took_s": self.took_s,
            "left_out": self.left_out, **rows,
        }  # fmt: skip
        return msgspec.json.decode(msgspec.json.encode(whole))


def restore(document: dict[str, Any]) -> RunResults:
    """Return the results from the data of `to_dict`. Raises msgspec.ValidationError for data of another form."""
    names = [subject.name for subject in SUBJECTS if subject.name in document]
    rows = {name: tuple(map(_restore_row, document[name])) for name in names}
    return RunResults(
        document["begun"], document["quick"], document["stopped"], document["took_s"], rows, tuple(document["left_out"])
    )


def _restore_row(row: dict[str, Any]) -> "DataclassInstance":
    """Return a row from its data, where the null of a field that is always a number is nan."""
    kind = KINDS[row["kind"]]
    numbers = {field.name for field in fields(kind) if field.type is float}
    data = {name: nan if value is None and name in numbers else value for name, value in row.items() if name != "kind"}
    return msgspec.convert(data, kind)


def measure(
    quick: bool, progress: Progress, host: Host, subjects: Sequence[Subject] = SUBJECTS,
    seconds: float | None = None, clock: Callable[[], float] = perf_counter,
) -> RunResults:  # fmt: skip
    """Run the subjects and return their results. Ctrl-C ends the run and keeps the rows so far.

    The run takes `seconds` of `clock`. With a clock of processor time, a busy machine measures as much as an idle one.
    """
    begun = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    warm_up(progress)  # before the clock starts: the first run on a machine compiles, later ones load
    start = clock()
    end = start + (seconds or (QUICK_S if quick else FULL_S))
    measurements = Measurements()
    rows: dict[str, tuple[DataclassInstance, ...]] = {}
    took: dict[str, float] = {}
    left_out: list[str] = []
    stopped = False
    for number, subject in enumerate(subjects):
        if stopped and subject.name not in ALWAYS:
            left_out.append(f"Stopped before: {subject.doing}.")
            continue
        part = _share(subject, quick) / max(sum(_share(s, quick) for s in subjects[number:]), 1e-9)
        now = clock()
        request = Request(quick, now + max(end - now, 0.0) * part, clock, host)
        subject_rows: list[DataclassInstance] = []
        try:
            for row in subject.measure(request, measurements):
                progress(min((clock() - start) / (end - start), 0.99), subject.doing)
                if isinstance(row, LeftOut):
                    left_out.append(row.reason)
                else:
                    subject_rows.append(row)
                    measurements.rows.append(row)
        except KeyboardInterrupt:
            stopped = True
            left_out.append(f"Stopped during: {subject.doing}.")
        except (SolveFailure, ArithmeticError, ValueError) as failure:
            left_out.append(f"{subject.doing.capitalize()} broke off: {failure}")
        rows[subject.name], took[subject.name] = tuple(subject_rows), clock() - now
    return RunResults(begun, quick, stopped, took, rows, tuple(left_out))


def warm_up(progress: Progress) -> None:
    """Solve once in each kinematics and take one step, so that all compiled loops are loaded."""
    progress(0.0, "loading compiled loops")
    for kinematics in ("small", "finite"):
        scene = cases(kinematics)[-1]
        request = replace(scene, solve=replace(scene.solve, tolerance=0.1))
        solve(request)
        if kinematics == "small":
            solve(replace(request, solve=replace(request.solve, course="history")))
        stepper(scene).step(1e-3, 0.0)


def _share(subject: Subject, quick: bool) -> float:
    return subject.quick_share if quick else subject.share
