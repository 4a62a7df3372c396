"""Measure all that `daq-app accuracy` measures and write its tables into the docs, between their marks.

Run from the root, alone: python -m benchmarks.accuracy [--out DIR] [--seconds S]. With names of subjects (speed, warm,
hard_cases, ...) only those are measured, and their tables printed: python -m benchmarks.accuracy speed
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import json
import sys
from argparse import ArgumentParser
from pathlib import Path
from time import process_time

from daq_app.accuracy.measuring import measured, restored
from daq_app.accuracy.page import write
from daq_app.accuracy.subjects import SUBJECTS
from daq_app.accuracy.tables import tables
from daq_app.console import Console

DOCS = Path(__file__).resolve().parent.parent / "docs"
PAGES = {
    "benchmarks.md": ("targets", "estimates", "machine"),
    "benchmarks/published-problems.md": ("problems",),
    "benchmarks/convergence.md": ("orders",),
    "benchmarks/hard-cases-small.md": ("hard-small",),
    "benchmarks/hard-cases-finite.md": ("hard-finite",),
}


def filled(text: str, name: str, made: str) -> str:
    r"""Return the page with the table put between its marks. Raises ValueError where the marks are not there.

    >>> filled("a <!-- x: begin -->old<!-- x: end --> b", "x", "new")
    'a <!-- x: begin -->\nnew\n<!-- x: end --> b'
    """
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    head, _, rest = text.partition(begin)
    _, found, tail = rest.partition(end)
    if not found:
        raise ValueError(f"The page has no marks for {name}.")
    return f"{head}{begin}\n{made}\n{end}{tail}"


def main() -> int:
    """Measure, write the page to --out and the tables into the docs."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("accuracy"), help="folder of page, pictures and data")
    parser.add_argument("--seconds", type=float, help="of processor time, however long they take on a busy machine")
    parser.add_argument("--data", type=Path, metavar="accuracy.json", help="tables and pictures of a run made before")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("subjects", nargs="*", choices=[[], *(subject.name for subject in SUBJECTS)], default=[])
    asked = parser.parse_args()
    console = Console(as_json=False)
    if asked.subjects:
        chosen = [subject for subject in SUBJECTS if subject.name in {"truth", "targets", *asked.subjects}]
        found = measured(asked.quick, console.progress, chosen, asked.seconds, process_time)
        for name, made in tables(found).items():
            if name != "truths" or "truth" in asked.subjects:
                print(f"\n{made.caption}\n\n{made.markdown()}")
        return 0
    if asked.data:
        found = restored(json.loads(asked.data.read_text(encoding="utf-8")))
    else:
        found = measured(asked.quick, console.progress, seconds=asked.seconds, clock=process_time)
    write(found, asked.out)
    made = tables(found)
    for page, names in PAGES.items():
        text = (DOCS / page).read_text(encoding="utf-8")
        for name in names:
            if name in made:
                text = filled(text, name, f"{made[name].caption}\n\n{made[name].markdown()}")
        (DOCS / page).write_text(text, encoding="utf-8")
    for told in found.left_out:
        console.note(told)
    return 0 if not found.stopped else 130


if __name__ == "__main__":
    sys.exit(main())
