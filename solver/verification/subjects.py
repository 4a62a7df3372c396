"""All subjects in order: a later subject may use the rows of an earlier one."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

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
from solver.verification.request import Measurements, Request

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True, slots=True)
class Subject:
    """The measurement of one file."""

    name: str  # key in the JSON file
    doing: str  # shown while it runs
    share: float  # share of the time; unused time is left to later subjects
    quick_share: float
    measure: "Callable[[Request, Measurements], Iterator[DataclassInstance]]"


SUBJECTS = (
    Subject("machine", "machine", 0.0, 0.0, machine.measure),
    Subject("truth", "overkill solves for the truth", 30.0, 1.5, truth.measure),
    Subject("speed", "time against true error", 38.0, 3.5, speed.measure),
    Subject("estimates", "estimates against true errors", 25.0, 1.8, estimates.measure),
    Subject("costs", "cost breakdown", 6.0, 0.6, costs.measure),
    Subject("warm", "the warm stepper", 10.0, 1.5, warm.measure),
    Subject("histories", "courses against direct states", 8.0, 0.3, histories.measure),
    Subject("processes", "cold starts and memory", 15.0, 2.5, processes.measure),
    Subject("problems", "published problems", 10.0, 1.6, problems.measure),
    Subject("orders", "orders of convergence", 20.0, 1.3, orders.measure),
    Subject("growth", "growth with the unknowns", 12.0, 1.2, growth.measure),
    Subject("hard_cases", "hard cases", 35.0, 2.0, hard_cases.measure),
    Subject("targets", "targets of speed", 0.0, 0.0, targets.measure),
)
