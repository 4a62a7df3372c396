"""Make a session folder from a foreign recording or from an export of this program; every other verb accepts it.

An export that holds the whole session (such as a csv folder, or a file session.h5) is restored completely and compared
reading by reading; it needs no options. A foreign CSV file needs none either if its header names units and a time
column (t_s, Fx_N ... Tz_Nm): N = -Fz and height 0 are then assumed, and marked as defaults. Otherwise give the columns,
their units and their rate.
"""

import argparse
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from daq_app.cli.options import add_shared
from daq_app.console import DONE, FLAWED, Console, WrongValue
from daq_app.wording import number

if TYPE_CHECKING:
    from sessions.exchange.exported import ExportedSession

EXAMPLE = "daq-app import strokes.csv --units N,Nmm --axes t,Fx,Fy,Fz,Tx,Ty,Tz --normal -z --height 12"

_OF_FOREIGN = ("units", "axes", "normal", "height", "rate", "zeroed", "subject")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="FILE.csv, or what 'daq-app export' wrote")
    parser.add_argument("--units", metavar="N,Nmm", help="units of forces and torques: N,Nmm or N,Nm")
    parser.add_argument("--axes", metavar="t,Fx,...", help="quantities in the columns, from the first on; - skips one")
    parser.add_argument("--normal", metavar="AXIS", help="axis along which pressing is positive, e.g. -z")
    add_shared(parser, height="height of the stimulus's face above the origin")
    parser.add_argument("--rate", type=float, metavar="HZ", help="readings per second, if the file has no times")
    parser.add_argument("--zeroed", action="store_true", help="the file's zero is that of the unloaded transducer")
    parser.add_argument("--subject", metavar="CODE", help="a code, never a name (unknown)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the session's folder (recordings/FILE)")


def run(options: argparse.Namespace, console: Console) -> int:
    from sessions.exchange.exported import read_export

    session, folder = read_export(options.file), options.out or Path("recordings") / options.file.stem
    if session is None:
        return _import_foreign(folder, options, console)
    return _restore_export(session, folder, options, console)


@contextmanager
def _whole_session(folder: Path) -> Generator[None]:
    """Leave a complete session or nothing; the error of a full disk says that nothing can be resumed."""
    from sessions.file_access import whole_or_nothing
    from sessions.recording.schema import DiskRefused, NotEmpty, RecordingError

    try:
        with whole_or_nothing(folder, unless=NotEmpty):
            yield
    except DiskRefused as error:
        raise RecordingError(
            f"{folder} cannot be written {error.reason}, and import again: nothing is left of it"
        ) from error


def _restore_export(session: "ExportedSession", folder: Path, options: argparse.Namespace, console: Console) -> int:
    from sessions.exchange.exported import import_session
    from sessions.recording.archive import seal

    names = [name for name in _OF_FOREIGN if getattr(options, name) not in (None, False)]
    if names:
        raise WrongValue(f"--{names[0]} does not apply to an export, which already says it: leave it out")
    with _whole_session(folder):
        summary = import_session(session, folder)
        seal(folder)
    console.result(session=str(folder), format=session.form, **asdict(summary))
    outcome = "with the above" if summary.differences else "as they were"
    console.say(*summary.differences, f"{folder}: {summary.readings} readings, {summary.events} events, {outcome}")
    return FLAWED if summary.differences else DONE


def _import_foreign(folder: Path, options: argparse.Namespace, console: Console) -> int:
    from sessions.exchange.import_csv import ORIGINAL_FILE, ImportOptions, import_csv
    from sessions.recording.archive import seal
    from sessions.recording.manifest import list_in_manifest

    units = _names(options.units)
    if units is not None and len(units) != 2:
        raise WrongValue(f"--units {options.units} is not allowed: give two, of forces and torques, such as N,Nmm")
    import_options = ImportOptions(
        units=None if units is None else (units[0], units[-1]),
        axes=_names(options.axes),
        normal=options.normal,
        height=options.height,
        rate=options.rate,
        zeroed=options.zeroed,
        subject=options.subject or "unknown",
    )
    with _whole_session(folder):
        summary = import_csv(options.file, folder, import_options)
        seal(summary.folder)
        list_in_manifest(summary.folder, (ORIGINAL_FILE,))
    document = asdict(summary)
    console.result(session=str(document.pop("folder")), **document)
    console.note(None if summary.doubt is None else f"doubtful: {summary.doubt}")
    console.say(
        f"{summary.folder}: {summary.readings} readings at {number(summary.rate, 4)} per second",
        *(f"default: {default}" for default in summary.defaults),
        f"kept only in the original file: {', '.join(summary.extra)}" if summary.extra else None,
        f"against the header, by --axes: {', '.join(summary.renamed)}" if summary.renamed else None,
    )
    return DONE


def _names(text: str | None) -> tuple[str, ...] | None:
    return None if text is None else tuple(name.strip() for name in text.split(","))
