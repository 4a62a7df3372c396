"""Write a session in a format of others: csv, bids, hdf5 or nwb.

Numbers kept in the session (analysis.json, prediction.json) go with it; the analysis is made where none was kept. An
export as csv, bids or hdf5 can be imported again and is the session it was.
"""

import argparse
from pathlib import Path

from daq_app.batch.derived import (
    ANALYSIS,
    PREDICTION,
    analysed_again,
    kept,
    made_otherwise,
    made_under,
    predicted_again,
    settings_of,
)
from daq_app.cli.main import FLAWED
from daq_app.console import Console
from sessions.exchange import FORMATS, ExportSource, export
from sessions.recording import Recording
from sessions.recording.calibration_uncertainty import gain_error_set
from sessions.recording.provenance import software_versions
from sessions.recording.unblinding import revealed
from sessions.strokes import analyse
from sessions.strokes.decisions import read

EXAMPLE = "daq-app export recordings/P07 --format csv --out P07-csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the session, the format and where it goes."""
    parser.add_argument("session", type=Path, metavar="SESSION")
    parser.add_argument("--format", required=True, choices=sorted(FORMATS), help="what is written")
    parser.add_argument("--out", type=Path, metavar="DIR", help="a new folder (exports/SESSION-FORMAT)")


def run(options: argparse.Namespace, console: Console) -> int:
    """Export, and name what the session had lost."""
    recording = revealed(Recording.open(options.session))
    folder = options.out or Path("exports") / f"{options.session.resolve().name}-{options.format}"
    source = _source(recording, console)
    export(source, options.format, folder, lambda part: console.progress(part, f"writing {options.format}"))
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    losses = list(recording.losses)
    console.result({"folder": str(folder), "files": [str(path) for path in files], "losses": losses})
    if recording.simulated_sentence:
        console.say(recording.simulated_sentence)
    for sentence in losses:
        console.say(sentence)
    console.say(f"{folder}: {len(files)} files, {sum(path.stat().st_size for path in files) / 1e6:.1f} MB")
    return FLAWED if losses else 0


def _source(recording: Recording, console: Console) -> ExportSource:
    """Return the session with the numbers kept in it; those made under other decisions are made anew."""
    decided = read(recording.folder)
    made_by = {"made_by": software_versions()}
    analysis, prediction = kept(recording.folder, ANALYSIS), kept(recording.folder, PREDICTION)
    if analysis is None or not made_under(analysis, decided):
        analysis = made_by | analysed_again(
            recording, analysis or {"gain_error": gain_error_set(recording.folder)}, decided
        )
    if prediction is not None and not made_under(prediction, decided):
        console.note(f"{PREDICTION} was made under other decisions than those in force, and is made anew")
        found = analyse(recording, settings_of(prediction), decided)
        prediction = made_by | predicted_again(recording, found, prediction)
    older = made_otherwise(recording, settings_of(analysis))
    if older is not None:
        console.note(older)
    return ExportSource(recording, analysis, prediction)
