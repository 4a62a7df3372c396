"""Measure the solver's speed and accuracy on this machine, and write one page.

It shows time against true error, estimates against true errors, orders of convergence, hard cases, costs, and whether
targets of speed are met. Ctrl-C stops it and keeps the measurements made so far. Run it on an idle machine.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from daq_app.child_process import interpreter
from daq_app.console import DONE, STOPPED, Console, WrongValue, table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from daq_app.accuracy_page.page import Table
    from solver.verification.measuring import RunResults

EXAMPLE = "daq-app accuracy --quick --out accuracy"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="half a minute instead of three, with coarser references")
    parser.add_argument("--out", type=Path, default=Path("accuracy"), metavar="DIR", help="folder to write (accuracy)")
    parser.add_argument("--docs", type=Path, metavar="DIR", help="also write the tables into these docs")
    meaning = "make page and tables from an earlier run; nothing is measured"
    parser.add_argument("--data", type=Path, metavar="accuracy.json", help=meaning)


def run(options: argparse.Namespace, console: Console) -> int:
    from daq_app.accuracy_page.page import PAGE, check_folder, tables, write

    console.progress(0.0, "loading")
    check_folder(options.out)  # fails before three minutes are spent
    _docs(options, {})
    results = _measure_or_restore(options, console)
    if results.stopped:
        remark = "; the docs are not changed" if options.docs else ""
        console.note(f"stopped; drawing the measurements made so far{remark}")
    console.progress(0.99, "drawing")
    write(results, options.out)
    console.result(page=str(options.out / PAGE), **results.to_dict())
    page_tables = tables(results)
    if not results.stopped:
        for page, text in _docs(options, page_tables).items():
            page.write_text(text, encoding="utf-8")
    if "targets" in page_tables:
        header, *rows = ([*line[:7]] for line in (page_tables["targets"].header, *page_tables["targets"].rows))
        console.say(table(rows, header=header))
    console.say(*(page_tables[name].caption for name in ("hard-small", "hard-finite") if name in page_tables))
    console.note(*(f"note: {sentence}" for sentence in results.left_out))
    console.say(f"{options.out / PAGE}")
    return STOPPED if results.stopped and options.data is None else DONE


def _docs(options: argparse.Namespace, page_tables: "Mapping[str, Table]") -> dict[Path, str]:
    """Return the text of the docs pages with these tables, by file. Raises OSError and WrongValue for other folders."""
    from daq_app.accuracy_page.page import filled_pages

    if options.docs is None:
        return {}
    try:
        return filled_pages(options.docs, page_tables)
    except ValueError as error:
        raise WrongValue(f"{options.docs} is not the docs folder ({error}); give another folder") from error


def _measure_or_restore(options: argparse.Namespace, console: Console) -> "RunResults":
    """Return new measurements, or the results of an earlier run. Raises WrongValue for a file without any."""
    from sessions.file_access import json_object, name_failure, read_within_limit
    from sessions.recording.head import software_versions
    from solver.verification.measuring import measure, restore
    from solver.verification.request import Host

    if options.data is None:
        return measure(options.quick, console.progress, Host(software_versions(), tuple(interpreter())))
    with name_failure(OSError, f"{options.data} cannot be read"):
        content = read_within_limit(options.data)
    try:
        return restore(json_object(content))
    except (ValueError, KeyError, TypeError) as error:
        raise WrongValue(f"{options.data} is not an accuracy.json ({error}); give another file") from error
