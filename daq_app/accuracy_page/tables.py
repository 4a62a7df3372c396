"""The tables of the accuracy page and of the docs: text in cells, made of rows and of nothing else."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from daq_app.console import number
from solver.prediction import percent
from solver.verification.costs import Cost
from solver.verification.estimates import Estimate
from solver.verification.hard_cases import HardCase
from solver.verification.histories import Marched
from solver.verification.machine import Machine
from solver.verification.measuring import Measured
from solver.verification.orders import Order
from solver.verification.processes import Cold
from solver.verification.published.problems import Problem
from solver.verification.speed import Speed
from solver.verification.targets import Target
from solver.verification.truth import NUMBERS, Truth
from solver.verification.warm import Warm

CELL_WORDS = 25  # the limit for a cell of the docs: tests/test_documents_prose.py


@dataclass(frozen=True, slots=True)
class Table:
    """One table."""

    name: str  # its anchor on the page
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """Return the table as it stands in the docs, where a cell has at most `CELL_WORDS` words."""
        lines = [self.header, tuple("---" for _ in self.header), *self.rows]
        return "\n".join("| " + " | ".join(_cell(text) for text in line) + " |" for line in lines)


def _cell(text: str) -> str:
    words = text.replace("|", "\\|").split(" ")
    return " ".join(words if len(words) <= CELL_WORDS else [*words[: CELL_WORDS - 1], "…"])


def tables(measured: Measured) -> dict[str, Table]:
    """Return the tables that there are rows for, by name."""
    builders: tuple[Callable[[Measured], Table], ...] = (
        machine, targets, truths, speeds, estimates, warm, histories, costs, starts, orders, problems, hard_small,
        hard_finite,
    )  # fmt: skip
    return {table.name: table for table in (make(measured) for make in builders) if table.rows}


def machine(measured: Measured) -> Table:
    """Return what the run was made on."""
    rows: list[tuple[str, str]] = []
    for row in measured.of(Machine):
        assert isinstance(row, Machine)
        rows += [
            ("begun", f"{measured.begun} UTC"), ("system", row.system),
            ("processor", f"{row.processor}, {row.cores} cores"),
            ("threads of linear algebra", row.threads),
            ("processes wanting a core before it began", "not told" if row.load is None else f"{row.load:.2f}"),
            ("took", f"{sum(measured.took_s.values()):.0f} s" + (", stopped by hand" if measured.stopped else "")),
            *row.versions.items(),
        ]  # fmt: skip
    return Table("machine", "Machine, load and versions.", ("", ""), tuple(rows))


def targets(measured: Measured) -> Table:
    """Return what was asked of the speed."""
    rows: list[Target] = measured.of(Target)
    cells = [
        (
            row.work, row.at_error, _limit(row.reach, row.unit), _limit(row.aim, row.unit),
            "–" if row.measured is None else f"{number(row.measured)} {row.unit}",
            "–" if row.floors is None else number(row.floors, 2), row.verdict, row.how,
        )
        for row in rows
    ]  # fmt: skip
    caption = (
        "What is asked of the speed, single thread, medians. Floors: the time by that of one assembly, factorisation "
        "and solve of the same system in the same run. Mesh and tables are set-up and not included unless said."
    )
    header = ("work", "at error", "reach", "aim", "measured", "floors", "verdict", "how")
    return Table("targets", caption, header, tuple(cells))


def truths(measured: Measured) -> Table:
    """Return the reference cases."""
    rows: list[Truth] = measured.of(Truth)
    cells: list[tuple[str, ...]] = []
    for row in rows:
        if row.numbers:
            numbers = (*(number(value, 5) for value in row.numbers), percent(max(row.doubt)))
            cells.append((row.kinematics, row.case, *numbers, " / ".join(f"{n:,}" for n in row.dofs)))
        else:
            cells.append((row.kinematics, row.case, "–", "–", "–", "–", row.refused))
    caption = (
        "The reference cases and their truth: mean of three overkill solves on meshes that differ, made "
        "in this run. Doubt: how far they lie from it at most."
    )
    header = ("strain", "case", "SED [MPa]", "N [N/mm]", "drag [N/mm]", "doubt", "unknowns, or why there is none")
    return Table("truths", caption, header, tuple(cells))


def speeds(measured: Measured) -> Table:
    """Return time against error, mesh by mesh."""
    rows: list[Speed] = sorted(measured.of(Speed), key=lambda row: (row.kinematics == "finite", row.dofs))
    cells = [
        (
            row.kinematics, f"{row.dofs:,}", _ms(row.setup_s), _ms(row.floor_s), _ms(row.first_s), _ms(row.next_s),
            "–" if row.judged_error is None else percent(row.judged_error), ", ".join(row.failed) or "–",
        )
        for row in rows
    ]  # fmt: skip
    header = (
        "strain", "unknowns", "set-up [ms]", "floor [ms]", "first [ms]", "next [ms]",
        "largest error", "no answer",
    )  # fmt: skip
    caption = (
        "Time against true error, mesh by mesh of Q2/P-1 elements, eliminated by nested dissection. Floor: one "
        "assembly, factorisation and solve. First, next: a surface from undeformed, a further one. What lost to these "
        "is in a picture of the decision on what the solver is made of, docs/decisions."
    )
    return Table("speeds", caption, header, tuple(cells))


def estimates(measured: Measured) -> Table:
    """Return how often estimates are above and near, by kinematics and number."""
    rows: list[Estimate] = measured.of(Estimate)
    cells: list[tuple[str, ...]] = []
    for kinematics in dict.fromkeys(row.kinematics for row in rows):
        for name in NUMBERS:
            mine = [row for row in rows if row.kinematics == kinematics and row.number == name]
            if mine:
                met = _share([row.met for row in mine]) if name == NUMBERS[0] else "–"
                ratios = [row.estimate / max(row.error, 1e-9) for row in mine if row.above is not None]
                ratio = number(median(ratios), 2) if ratios else "–"
                above, near = _share([row.above for row in mine]), _share([row.near for row in mine])
                cells.append((f"{kinematics} strain", name, str(len(mine)), above, near, met, ratio))
    caption = (
        "Estimates against true errors, of answers asked for with a tolerance. Above: the estimate is at least the "
        "true error. Near: below ten times the larger of true error and 0.02 %. Counted only where the truth can tell."
    )
    header = ("", "number", "answers", "above", "near", "tolerance met", "estimate by error, median")
    return Table("estimates", caption, header, tuple(cells))


def _share(answers: Sequence[bool | None]) -> str:
    verdicts = [answer for answer in answers if answer is not None]
    return f"{sum(verdicts)} of {len(verdicts)}" if verdicts else "–"


def warm(measured: Measured) -> Table:
    """Return the warm stepper's rows."""
    rows: list[Warm] = measured.of(Warm)
    cells = [
        (
            f"{row.kinematics} strain", row.case, str(row.readings), _ms(row.median_s), _ms(row.p99_s),
            _ms(row.once_p99_s), percent(row.worst_error),
        )
        for row in rows
    ]  # fmt: skip
    header = ("", "surface", "readings", "median [ms]", "p99 [ms]", "p99 of one pass [ms]", "largest error, by peak")
    caption = "The warm stepper, fed reading by reading; p99 of each reading's median over five passes."
    return Table("warm", caption, header, tuple(cells))


def histories(measured: Measured) -> Table:
    """Return courses against direct states."""
    rows: list[Marched] = measured.of(Marched)
    cells = [
        (
            f"{row.kinematics} strain", row.case, str(row.dofs), _ms(row.direct_s), _ms(row.marched_s),
            number(row.marched_s / row.direct_s, 2), f"{abs(row.difference):.0e}",
        )
        for row in rows
    ]  # fmt: skip
    header = ("", "surface", "unknowns", "direct [ms]", "200 substeps [ms]", "times", "difference of the SED")
    return Table("histories", "A course of 200 substeps against the state found directly.", header, tuple(cells))


def costs(measured: Measured) -> Table:
    """Return where the time goes."""
    rows: list[Cost] = measured.of(Cost)
    cells = [
        (
            f"{row.kinematics} strain", percent(row.tolerance), f"{row.dofs:,}", _ms(row.took_s), _ms(row.setup_s),
            _ms(row.wall_s), _ms(row.estimate_s),
            ", ".join(f"{name} {100 * part:.0f} %" for name, part in row.parts.items()),
        )
        for row in rows
    ]  # fmt: skip
    header = ("", "tolerance", "unknowns", "in all [ms]", "set-up [ms]", "solve [ms]", "estimate [ms]", "by part")
    caption = (
        "Where the time of one surface goes, asked for with a tolerance: in all, from scene to answer. Set-up, solve "
        "and estimate are of the mesh that the answer is from, as it tells itself; parts: shares of all, by a profiler."
    )
    return Table("costs", caption, header, tuple(cells))


def starts(measured: Measured) -> Table:
    """Return cold starts."""
    rows: list[Cold] = measured.of(Cold)
    cells = [(row.what, str(row.runs), _ms(row.took_s), _ms(row.passed_s)) for row in rows]
    header = ("process", "runs", "processor time [ms]", "time that passed [ms]")
    caption = (
        "Start-up: processes from start to end, medians. What Python and the solver take to load is in the last ones."
    )
    return Table("starts", caption, header, tuple(cells))


def orders(measured: Measured) -> Table:
    """Return observed orders of convergence."""
    rows: list[Order] = measured.of(Order)
    cells = [
        (
            row.problem, row.quantity, row.kinematics, " / ".join(f"{error:.1e}" for error in row.errors),
            " / ".join(number(1e3 * took) for took in row.took_s), f"{row.order:.2f}", f"{row.least:g}",
        )
        for row in rows
    ]  # fmt: skip
    header = ("problem", "quantity", "strain", "errors, coarse to fine", "time [ms]", "order", "at least")
    caption = "Observed orders of convergence. Time: of a solve on each mesh, the mesh included."
    return Table("orders", caption, header, tuple(cells))


def problems(measured: Measured) -> Table:
    """Return the published problems."""
    rows: list[Problem] = measured.of(Problem)
    cells = [
        (
            row.problem, row.source, row.quantity, number(row.expected, 5), number(row.obtained, 5), percent(row.off),
            row.of, percent(row.allowed), "met" if row.met else "MISSED",
        )
        for row in rows
    ]  # fmt: skip
    header = ("problem", "source", "quantity", "expected", "obtained", "off", "of", "allowed", "verdict")
    return Table("problems", "Published problems, run through the same code as the finger.", header, tuple(cells))


def hard_small(measured: Measured) -> Table:
    """Return the hard cases at small strain."""
    return _hard(measured, "small")


def hard_finite(measured: Measured) -> Table:
    """Return the hard cases at finite strain."""
    return _hard(measured, "finite")


def _hard(measured: Measured, kinematics: str) -> Table:
    rows: list[HardCase] = [row for row in measured.of(HardCase) if row.kinematics == kinematics]
    cells = [(row.case, row.must, f"FAILED, {row.flaw}: {row.told}" if row.flaw else row.told) for row in rows]
    passed = sum(not row.flaw for row in rows)
    caption = f"Hard cases at {kinematics} strain: {passed} of {len(rows)} ended as they must."
    return Table(f"hard-{kinematics}", caption, ("case", "must", "outcome"), tuple(cells))


def _ms(seconds: float | None) -> str:
    return "–" if seconds is None else number(1e3 * seconds)


def _limit(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{value:g} {unit}"
