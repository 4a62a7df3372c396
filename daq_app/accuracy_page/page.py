"""The accuracy page: one self-contained HTML file, its pictures as SVG, its data as JSON."""

import json
from collections.abc import Mapping
from pathlib import Path

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, select_autoescape

from daq_app.accuracy_page.figures import plates
from daq_app.accuracy_page.tables import tables
from sessions.report.figures.style import Plate
from sessions.report.html import drawn, swap_in
from solver.verification.measuring import Measured
from solver.verification.request import PROCESSOR_TIME

PAGE, DATA, FIGURES = "accuracy.html", "accuracy.json", "figures"
# anchor, words, and the figures and tables under them, by name
SECTIONS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("asked", "What is asked of the speed", ("targets",)),
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


def page(measured: Measured, figures: Mapping[str, Plate] | None = None) -> str:
    """Return the page: no script, nothing asked of any network; `figures` where they are drawn already."""
    figures, listed = plates(measured) if figures is None else figures, tables(measured)
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("daq_app.accuracy_page", "."), PackageLoader("sessions.report", ".")]),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    there = [section for section in SECTIONS if any(part in figures or part in listed for part in section[2])]
    return environment.get_template("accuracy.html.jinja").render(
        found=measured,
        figures=figures,
        tables=listed,
        sections=[(name, words) for name, words, _ in there],
        parts={name: parts for name, _, parts in there},
        wide=("benchmarks", "orders", "costs"),
        drawn=drawn,
        processor_time=PROCESSOR_TIME,
    )


def write(measured: Measured, folder: Path) -> tuple[Path, ...]:
    """Write page, pictures and data to `folder`; return the files. Raises ReportError where that cannot be done."""
    data = folder / DATA
    swap_in(data, json.dumps(measured.to_dict(), indent=1, allow_nan=False) + "\n")
    written = [data]
    figures = plates(measured)
    for plate in figures.values():
        for panel in plate.panels:
            path = folder / FIGURES / f"{panel.name}.svg"
            swap_in(path, panel.svg)
            written.append(path)
    swap_in(folder / PAGE, page(measured, figures))
    return (folder / PAGE, *written)
