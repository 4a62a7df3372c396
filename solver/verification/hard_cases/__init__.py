"""The hard cases at small and at finite strain: a named, repeatable suite for tests, page and docs.

A case is a scene or a body. Some require an answer, others an answer or the reason why no state exists. A case passes
when its outcome meets that, is in balance, violates no law, has no nan, and agrees with a neighbouring case.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from solver.verification.hard_cases import bodies
from solver.verification.hard_cases.outcome import Outcome
from solver.verification.hard_cases.scenes import ANSWER, Case, hard_scenes
from solver.verification.methods import Kinematics
from solver.verification.request import LeftOut, Request, clock, rows_within

TELLING = {  # cases of a quick run, and of `make test` at finite strain
    "nu 0.0", "nu 0.4999999", "bone 1e10 times stiffer than fat", "mu 0", "tau_max 0 MPa", "tau_max 1e+09 MPa",
    "depth 1 mm", "depth 2 mm without friction", "angle 30 degrees", "angle 75 degrees, backwards",
    "epidermis and dermis of 0.05 mm each", "a part 1e+10 times stiffer", "one node touching", "direction reversal",
    "contact edge at a mesh node", "elements distorted to 0.45 of an edge", "elements of aspect 50",
}  # fmt: skip
OF_BODIES: dict[str, Callable[[bodies.Bodies], Outcome]] = {
    **{f"a part {ratio:g} times stiffer": partial(bodies.stiff_part, ratio=ratio) for ratio in (1e3, 1e6, 1e10)},
    "one node touching": bodies.one_node,
    "direction reversal": bodies.reversal,
    "steps over four decades": bodies.steps,
    "contact edge at a mesh node": bodies.edge_at_node,
    "elements distorted to 0.45 of an edge": bodies.distorted_finger,
    "elements of aspect 50": bodies.aspect,
}


@dataclass(frozen=True, slots=True)
class HardCase:
    """A row of the table."""

    kinematics: Kinematics
    case: str
    must: str
    answered: bool
    flaw: str  # "" for the required outcome
    summary: str  # the outcome's summary
    took_s: float


def cases(kinematics: Kinematics) -> tuple[Case, ...]:
    """Return the suite in one kinematics."""
    on_bodies = bodies.BODIES[kinematics]
    of_bodies = (
        Case(kinematics, name, ANSWER, partial(run, on_bodies), slow=run is bodies.steps)
        for name, run in OF_BODIES.items()
    )
    return (*hard_scenes(kinematics), *of_bodies)


def judge(case: Case, neighbour: Outcome | None = None) -> HardCase:
    """Run one case and return its flaw, if any; `neighbour` is the outcome of the case named in `same_as`."""
    start, outcome = clock(), case.run()
    flaws = [outcome.flaw] if outcome.flaw else []
    if not outcome.answered and case.must == ANSWER:
        flaws.append("no answer")
    if not all(abs(number) < float("inf") for number in outcome.numbers):
        flaws.append("a number is not finite")
    if neighbour is not None and neighbour.numbers and outcome.numbers:
        deviation = abs(outcome.numbers[0] / neighbour.numbers[0] - 1.0)
        if deviation > case.within:
            flaws.append(f"{deviation:.1g} from {case.same_as}, not {case.within:g}")
    took_s = clock() - start
    return HardCase(case.kinematics, case.name, case.must, outcome.answered, "; ".join(flaws), outcome.summary, took_s)


def measure(request: Request) -> Iterator[HardCase | LeftOut]:
    """Yield a row for every case; in a quick run only for the most informative ones."""
    suite = {(case.kinematics, case.name): case for kinematics in bodies.BODIES for case in cases(kinematics)}
    todo = [case for case in suite.values() if not request.quick or case.name in TELLING]
    if len(todo) < len(suite):
        yield LeftOut(f"{len(suite) - len(todo)} hard cases are left to a full run.")

    def rows(case: Case) -> Iterator[HardCase]:
        yield judge(case, suite[case.kinematics, case.same_as].run() if case.same_as else None)

    yield from rows_within(request, todo, "hard cases", rows)
