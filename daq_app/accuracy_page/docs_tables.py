"""The tables of `daq-app accuracy`, written into the pages of the docs between their marks."""

from collections.abc import Mapping
from pathlib import Path

from daq_app.accuracy_page.tables import Table
from solver.verification.marked_page import filled

PAGES: Mapping[str, tuple[str, ...]] = {
    "benchmarks.md": ("targets", "estimates", "machine"),
    "benchmarks/published-problems.md": ("problems",),
    "benchmarks/convergence.md": ("orders",),
    "benchmarks/hard-cases-small.md": ("hard-small",),
    "benchmarks/hard-cases-finite.md": ("hard-finite",),
}


def fill(docs: Path, tables: Mapping[str, Table]) -> None:
    """Write the tables into the pages below `docs`. Raises OSError, and ValueError for a page without marks."""
    for page, names in PAGES.items():
        text = (docs / page).read_text(encoding="utf-8")
        for name in names:
            if name in tables:
                text = filled(text, name, f"{tables[name].caption}\n\n{tables[name].markdown()}")
        (docs / page).write_text(text, encoding="utf-8")
