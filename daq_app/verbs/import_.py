"""Make a session folder of a foreign recording; every other verb accepts it.

A header that names its units and a time column (t_s, Fx_N ... Tz_Nm) needs no options: N = -Fz and height 0 are taken
as defaults and marked so. Otherwise say what the columns are, in which units, and at which rate they were taken.
"""

import argparse
from dataclasses import asdict
from pathlib import Path

from daq_app.cli import WrongValue
from daq_app.console import Console, number

EXAMPLE = "daq-app import strokes.csv --units N,Nmm --axes t,Fx,Fy,Fz,Tx,Ty,Tz --normal -z --height 12"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the file, what it holds and where it goes."""
    parser.add_argument("file", type=Path, metavar="FILE.csv")
    parser.add_argument("--units", metavar="N,Nmm", help="of forces and torques: N,Nmm or N,Nm")
    parser.add_argument("--axes", metavar="t,Fx,...", help="what the columns are, from the first on; - leaves one out")
    parser.add_argument("--normal", metavar="AXIS", help="axis along which pressing is positive, e.g. -z")
    parser.add_argument("--height", type=float, metavar="MM", help="of the stimulus's face above the origin")
    parser.add_argument("--rate", type=float, metavar="HZ", help="readings a second, where the file has no times")
    parser.add_argument("--zeroed", action="store_true", help="the file's zeros are those of the unloaded transducer")
    parser.add_argument("--subject", default="unknown", metavar="CODE", help="a code, never a name")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the session's folder (recordings/FILE)")


def run(options: argparse.Namespace, console: Console) -> int:
    """Import the file, seal the session and say what nobody stated."""
    from sessions.import_csv import ORIGINAL_FILE, ImportOptions, import_csv
    from sessions.recording import Recording
    from sessions.recording.archive import seal
    from sessions.recording.manifest import list_in_manifest

    units = _parts(options.units)
    if units is not None and len(units) != 2:
        raise WrongValue(f"--units {options.units} is not allowed: give two, of forces and torques, such as N,Nmm")
    stated = ImportOptions(
        units=None if units is None else (units[0], units[-1]),
        axes=_parts(options.axes),
        normal=options.normal,
        height=options.height,
        rate=options.rate,
        zeroed=options.zeroed,
        subject=options.subject,
    )
    folder = options.out or Path("recordings") / options.file.stem
    made = import_csv(options.file, folder, stated)
    seal(made.folder)
    list_in_manifest(made.folder, (ORIGINAL_FILE,), Recording.open(made.folder).simulated_sentence)
    console.result({"session": str(made.folder), **{k: v for k, v in asdict(made).items() if k != "folder"}})
    console.say(f"{made.folder}: {made.readings} readings at {number(made.rate, 4)} a second")
    for default in made.defaults:
        console.say(f"default: {default}")
    if made.extra:
        console.say(f"kept in the original file alone: {', '.join(made.extra)}")
    return 0


def _parts(text: str | None) -> tuple[str, ...] | None:
    return None if text is None else tuple(part.strip() for part in text.split(","))
