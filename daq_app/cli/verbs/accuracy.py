"""Measure on this machine how fast the solver is and how true, and write one page of it.

Time against true error, estimates against true errors, orders of convergence, hard cases, costs, and whether targets of
speed are met. Ctrl-C stops it and keeps what was measured until then. Run it while nothing else runs.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from daq_app.child_process import interpreter
from daq_app.console import DONE, STOPPED, Console, WrongValue, table

if TYPE_CHECKING:
    from solver.verification.measuring import RunResults

EXAMPLE = "daq-app accuracy --quick --out accuracy"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="20 seconds instead of three minutes, and coarser truths")
    parser.add_argument("--out", type=Path, default=Path("accuracy"), metavar="DIR", help="the folder (accuracy)")
    parser.add_argument("--docs", type=Path, metavar="DIR", help="also write the tables into the pages of these docs")
    parser.add_argument(
        "--data", type=Path, metavar="accuracy.json", help="page and tables of an earlier run; nothing is measured"
    )


def run(options: argparse.Namespace, console: Console) -> int:
    from daq_app.accuracy_page.page import PAGE, fill, tables, write

    console.progress(0.0, "loading")
    options.out.mkdir(parents=True, exist_ok=True)  # said before three minutes are spent
    measured = _measure_or_restore(options, console)
    if measured.stopped:
        console.note("stopped; drawing what was measured until now")
    console.progress(0.99, "drawing")
    write(measured, options.out)
    console.result({"page": str(options.out / PAGE), **measured.to_dict()})
    page_tables = tables(measured)
    if options.docs is not None:
        fill(options.docs, page_tables)
    if "targets" in page_tables:
        rows = [[cell for n, cell in enumerate(row) if n != 7] for row in page_tables["targets"].rows]
        console.say(table(rows, head=list(page_tables["targets"].header[:7])))
    console.say(*(page_tables[name].caption for name in ("hard-small", "hard-finite") if name in page_tables))
    console.note(*(f"note: {sentence}" for sentence in measured.left_out))
    console.say(f"{options.out / PAGE}")
    return STOPPED if measured.stopped else DONE


def _measure_or_restore(options: argparse.Namespace, console: Console) -> "RunResults":
    """Measure, or return the results of an earlier run. Raises WrongValue for a file that holds none."""
    from sessions.file_access import json_object, read_within_limit
    from sessions.recording.head import software_versions
    from solver.verification.measuring import measure, restore
    from solver.verification.request import Host

    if options.data is None:
        return measure(options.quick, console.progress, Host(software_versions(), tuple(interpreter())))
    try:
        return restore(json_object(read_within_limit(options.data)))
    except (ValueError, KeyError, TypeError) as error:
        raise WrongValue(f"{options.data} is no accuracy.json of this program ({error}); give another file") from error
