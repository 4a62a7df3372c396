"""The accuracy page, one self-contained HTML file, and its tables, which are also in the docs."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from typing import TypeVar

from daq_app.accuracy_page.figures import plates
from daq_app.wording import number
from sessions.file_access import check_replaceable
from sessions.report.figures.style import Plate
from sessions.report.pages import embed, make_place, swap_in, template
from solver.prediction import percent
from solver.verification.costs import Cost
from solver.verification.estimates import GOALS, Estimate
from solver.verification.hard_cases import HardCase
from solver.verification.histories import March
from solver.verification.machine import Machine
from solver.verification.marked_page import fill_marks
from solver.verification.measuring import RunResults
from solver.verification.orders import Order
from solver.verification.processes import Cold
from solver.verification.published.problems import Problem
from solver.verification.request import PROCESSOR_TIME
from solver.verification.speed import Speed
from solver.verification.targets import Target
from solver.verification.truth import TRUE_NUMBERS, Truth
from solver.verification.warm import Warm

R = TypeVar("R")

CELL_WORDS = 25  # the limit for a cell of the docs: tests/test_documents_prose.py
PAGES: Mapping[str, tuple[str, ...]] = {
    "benchmarks.md": ("targets", "estimates", "machine"),
    "benchmarks/published-problems.md": ("problems",),
    "benchmarks/convergence.md": ("orders",),
    "benchmarks/hard-cases-small.md": ("hard-small",),
    "benchmarks/hard-cases-finite.md": ("hard-finite",),
}


@dataclass(frozen=True, slots=True)
class Table:
    """One table."""

    name: str  # its anchor on the page
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """Return the table in the form of the docs, where a cell has at most `CELL_WORDS` words."""
        lines = [self.header, tuple("---" for _ in self.header), *self.rows]
        return "\n".join("| " + " | ".join(_cell(text) for text in line) + " |" for line in lines)


def _cell(text: str) -> str:
    words = text.replace("|", "\\|").split(" ")
    return " ".join(words if len(words) <= CELL_WORDS else [*words[: CELL_WORDS - 1], "…"])


def _table_maker(
    name: str,
    row_type: type[R],
    caption: str,
    columns: Mapping[str, Callable[[R], str]],
    order: Callable[[R], tuple[bool, int]] = lambda _: (False, 0),
) -> Callable[[RunResults], Table]:
    """Return a function that makes a table with a line for each row of a type, each cell computed by its column."""

    def table(results: RunResults) -> Table:
        rows = (tuple(cell(row) for cell in columns.values()) for row in sorted(results.of(row_type), key=order))
        return Table(name, caption, tuple(columns), tuple(rows))

    return table


def _machine(results: RunResults) -> Table:
    rows: list[tuple[str, str]] = []
    for row in results.of(Machine):
        rows += [
            ("begun", f"{results.begun} UTC"), ("system", row.system),
            ("processor", f"{row.processor}, {row.cores} cores"),
            ("threads of linear algebra", row.threads),
            ("running processes before the start", "not known" if row.load is None else f"{row.load:.2f}"),
            ("took", f"{sum(results.took_s.values()):.0f} s" + (", stopped by hand" if results.stopped else "")),
            *row.versions.items(),
            *(("not measured", sentence) for sentence in results.left_out),
        ]  # fmt: skip
    return Table("machine", "Machine, load and versions.", ("", ""), tuple(rows))


def _estimates(results: RunResults) -> Table:
    """Return the shares of estimates that are above and near the true error, by kinematics and number."""
    rows = results.of(Estimate)
    cells: list[tuple[str, ...]] = []
    for kinematics, name in product(dict.fromkeys(row.kinematics for row in rows), GOALS):
        if group := [row for row in rows if row.kinematics == kinematics and row.number == name]:
            met = _share([row.meets_tolerance for row in group]) if name == TRUE_NUMBERS[0] else "–"
            ratios = [row.estimate / max(row.error, 1e-9) for row in group if row.above is not None]
            above, near = _share([row.above for row in group]), _share([row.near for row in group])
            ratio = number(median(ratios) if ratios else None, 2)
            cells.append((f"{kinematics} strain", name, str(len(group)), above, near, met, ratio))
    caption = (
        "Estimates against true errors, of answers at a requested tolerance. Above: the estimate is at least the true "
        "error. Near: below ten times the larger of true error and 0.02 %. Counted only where the reference is "
        "accurate enough."
    )
    header = ("", "number", "answers", "above", "near", "tolerance met", "estimate by error, median")
    return Table("estimates", caption, header, tuple(cells))


def _share(answers: Sequence[bool | None]) -> str:
    verdicts = [answer for answer in answers if answer is not None]
    return f"{sum(verdicts)} of {len(verdicts)}" if verdicts else "–"


def _hard(results: RunResults, kinematics: str) -> Table:
    rows = [row for row in results.of(HardCase) if row.kinematics == kinematics]
    count = sum(not row.flaw for row in rows)
    caption = f"Hard cases at {kinematics} strain: {count} of {len(rows)} ended as expected."
    outcomes = [f"FAILED, {row.flaw}: {row.summary}" if row.flaw else row.summary for row in rows]
    cells = tuple((row.case, row.must, outcome) for row, outcome in zip(rows, outcomes, strict=True))
    return Table(f"hard-{kinematics}", caption, ("case", "expected", "outcome"), cells)


def _ms(seconds: float | None) -> str:
    return number(seconds, factor=1e3)


def _limit(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{value:g} {unit}"


def _value(row: Truth, index: int) -> str:
    return number(row.numbers[index], 5) if row.numbers else "–"


_TABLES: tuple[Callable[[RunResults], Table], ...] = (
    _machine,
    _table_maker(
        "targets", Target,
        "Targets of speed, single thread, medians. Floors: the time by that of one assembly, factorisation "
        "and solve of the same system in the same run. Mesh and tables are set-up and not included unless said.",
        {
            "work": lambda row: row.work, "at error": lambda row: row.at_error,
            "reach": lambda row: _limit(row.reach, row.unit), "aim": lambda row: _limit(row.aim, row.unit),
            "measured": lambda row: "–" if row.measured is None else f"{number(row.measured)} {row.unit}",
            "floors": lambda row: number(row.floors, 2),
            "verdict": lambda row: row.verdict, "how": lambda row: row.how,
        },
    ),
    _table_maker(
        "truths", Truth,
        "The reference cases and their true values: mean of three overkill solves on different meshes, computed "
        "in this run. Uncertainty: their greatest deviation from the mean.",
        {
            "strain": lambda row: row.kinematics, "case": lambda row: row.case,
            "SED [MPa]": lambda row: _value(row, 0), "N [N/mm]": lambda row: _value(row, 1),
            "drag [N/mm]": lambda row: _value(row, 2),
            "uncertainty": lambda row: percent(max(row.doubt)) if row.numbers else "–",
            "unknowns, or why there is no value":
                lambda row: " / ".join(f"{n:,}" for n in row.dofs) if row.numbers else row.refused,
        },
    ),
    _table_maker(
        "speeds", Speed,
        "Time against true error, mesh by mesh of Q2/P-1 elements, eliminated by nested dissection. Floor: one "
        "assembly, factorisation and solve. First, next: a surface from undeformed, a further one. What lost to these "
        "is in a picture of the decision on what the solver is made of, docs/decisions.",
        {
            "strain": lambda row: row.kinematics, "unknowns": lambda row: f"{row.dofs:,}",
            "set-up [ms]": lambda row: _ms(row.setup_s), "floor [ms]": lambda row: _ms(row.floor_s),
            "first [ms]": lambda row: _ms(row.first_s), "next [ms]": lambda row: _ms(row.next_s),
            "largest error": lambda row: "–" if row.judged_error is None else percent(row.judged_error),
            "no answer": lambda row: ", ".join(row.failed) or "–",
        },
        order=lambda row: (row.kinematics == "finite", row.dofs),
    ),
    _estimates,
    _table_maker(
        "warm", Warm, "The warm stepper, fed reading by reading; p99 of each reading's median over five passes.",
        {
            "": lambda row: f"{row.kinematics} strain", "surface": lambda row: row.case,
            "readings": lambda row: str(row.readings), "median [ms]": lambda row: _ms(row.median_s),
            "p99 [ms]": lambda row: _ms(row.p99_s), "p99 of one pass [ms]": lambda row: _ms(row.once_p99_s),
            "largest error, by peak": lambda row: percent(row.worst_error),
        },
    ),
    _table_maker(
        "histories", March, "A course of 200 substeps against the state found directly.",
        {
            "": lambda row: f"{row.kinematics} strain", "surface": lambda row: row.case,
            "unknowns": lambda row: str(row.dofs), "direct [ms]": lambda row: _ms(row.direct_s),
            "200 substeps [ms]": lambda row: _ms(row.marched_s),
            "times": lambda row: number(row.marched_s / row.direct_s, 2),
            "difference of the SED": lambda row: f"{abs(row.difference):.0e}",
        },
    ),
    _table_maker(
        "costs", Cost,
        "Time for one surface at a requested tolerance: in all, from scene to answer. Set-up, solve and estimate are "
        "of the answer's mesh, as the answer states them; parts: shares of all, by a profiler.",
        {
            "": lambda row: f"{row.kinematics} strain", "tolerance": lambda row: percent(row.tolerance),
            "unknowns": lambda row: f"{row.dofs:,}", "in all [ms]": lambda row: _ms(row.took_s),
            "set-up [ms]": lambda row: _ms(row.setup_s), "solve [ms]": lambda row: _ms(row.wall_s),
            "estimate [ms]": lambda row: _ms(row.estimate_s),
            "by part": lambda row: ", ".join(f"{name} {100 * part:.0f} %" for name, part in row.parts.items()),
        },
    ),
    _table_maker(
        "starts", Cold,
        "Start-up: processes from start to end, medians. What Python and the solver take to load is in the last ones.",
        {
            "process": lambda row: row.what, "runs": lambda row: str(row.runs),
            "processor time [ms]": lambda row: _ms(row.took_s), "time that passed [ms]": lambda row: _ms(row.passed_s),
        },
    ),
    _table_maker(
        "orders", Order, "Observed orders of convergence. Time: of a solve on each mesh, the mesh included.",
        {
            "problem": lambda row: row.problem, "quantity": lambda row: row.quantity,
            "strain": lambda row: row.kinematics,
            "errors, coarse to fine": lambda row: " / ".join(f"{error:.1e}" for error in row.errors),
            "time [ms]": lambda row: " / ".join(number(1e3 * span) for span in row.took_s),
            "order": lambda row: f"{row.order:.2f}", "at least": lambda row: f"{row.least:g}",
        },
    ),
    _table_maker(
        "problems", Problem, "Published problems, run through the same code as the finger.",
        {
            "problem": lambda row: row.problem, "source": lambda row: row.source,
            "quantity": lambda row: row.quantity, "expected": lambda row: number(row.expected, 5),
            "obtained": lambda row: number(row.obtained, 5), "off": lambda row: percent(row.off),
            "of": lambda row: row.of, "allowed": lambda row: percent(row.allowed),
            "verdict": lambda row: "met" if row.agrees else "MISSED",
        },
    ),
    partial(_hard, kinematics="small"),
    partial(_hard, kinematics="finite"),
)  # fmt: skip


def tables(results: RunResults) -> dict[str, Table]:
    """Return the tables that have rows, by name."""
    return {table.name: table for table in (make(results) for make in _TABLES) if table.rows}


def filled_pages(docs: Path, tables: Mapping[str, Table]) -> dict[Path, str]:
    """Return the text of the pages below `docs`, by file, with the tables of this run only.

    A table without rows in the run is marked as missing. Raises OSError, and ValueError for a page without marks.
    """
    texts: dict[Path, str] = {}
    for page, names in PAGES.items():
        text = (docs / page).read_text(encoding="utf-8")
        for name in names:
            content = f"{tables[name].caption}\n\n{tables[name].markdown()}" if name in tables else "Not measured."
            text = fill_marks(text, name, content)
        texts[docs / page] = text
    return texts


_DATA_MARK = ' "begun": "'  # how the second line of our data begins
PAGE, DATA, FIGURES = "accuracy.html", "accuracy.json", "figures"
# anchor, words, and the names of the figures and tables below them
SECTIONS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("asked", "Targets of speed", ("targets",)),
    ("time", "Time against true error", ("speed", "speeds", "benchmarks")),
    ("estimate", "Estimates against true errors", ("estimates",)),
    ("cases", "The reference cases", ("truths",)),
    ("cost", "Where the time goes", ("costs", "starts", "warm", "histories")),
    ("size", "Growth with the unknowns", ("growth",)),
    ("convergence", "Orders of convergence", ("orders",)),
    ("published", "Published problems", ("problems",)),
    ("hard", "Hard cases", ("hard-small", "hard-finite")),
    ("on", "Measured on", ("machine",)),
)


def page(results: RunResults, figures: Mapping[str, Plate] | None = None) -> str:
    """Return the page, without scripts or network access; pass `figures` if they are already drawn."""
    figures, by_name = plates(results) if figures is None else figures, tables(results)
    sections = [section for section in SECTIONS if any(item in figures or item in by_name for item in section[2])]
    return template("accuracy.html.jinja", "daq_app.accuracy_page").render(
        results=results,
        figures=figures,
        tables=by_name,
        sections=[(name, title) for name, title, _ in sections],
        parts={name: parts for name, _, parts in sections},
        wide=("benchmarks", "orders", "costs"),
        embed=embed,
        processor_time=PROCESSOR_TIME,
    )


def check_folder(folder: Path) -> None:
    """Raise ReportError where a folder cannot be written into, NotOurs where `write` would replace others' files."""
    make_place(folder)
    check_replaceable(folder / DATA, _DATA_MARK, folder / PAGE, folder / FIGURES)


def write(results: RunResults, folder: Path) -> tuple[Path, ...]:
    """Write page, pictures and data to `folder`; return the files. Raises ReportError if that fails."""
    data = folder / DATA
    swap_in(data, json.dumps(results.to_dict(), indent=1, allow_nan=False) + "\n")
    figures = plates(results)
    pictures = {
        folder / FIGURES / f"{panel.name}.svg": panel.svg for plate in figures.values() for panel in plate.panels
    }
    for path, text in (pictures | {folder / PAGE: page(results, figures)}).items():
        swap_in(path, text)
    return (folder / PAGE, data, *pictures)
