"""Export a session for other programs, in one of the formats of --format.

The stored analysis.json and prediction.json are exported too; an analysis that was not stored is computed. Most
formats hold the whole session: 'daq-app import' makes the same session of such an export.
"""

import argparse
from pathlib import Path

from daq_app.batch import derived
from daq_app.batch.derived import ANALYSIS, PREDICTION
from daq_app.cli.options import add_session
from daq_app.console import DONE, FLAWED, Console
from sessions.exchange import FORMATS, ExportSource, export
from sessions.recording import Recording
from sessions.recording.derived import gain_error_set, reveal
from sessions.recording.head import software_versions
from sessions.strokes.decisions import read

EXAMPLE = "daq-app export recordings/P07 --format csv --out P07-csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_session(parser)
    parser.add_argument("--format", required=True, choices=sorted(FORMATS), help="format of the export")
    parser.add_argument("--out", type=Path, metavar="DIR", help="a new folder (exports/SESSION-FORMAT)")


def run(options: argparse.Namespace, console: Console) -> int:
    recording = reveal(Recording.open(options.session))
    folder = options.out or Path("exports") / f"{options.session.resolve().name}-{options.format}"
    source = _source(recording, console)
    export(source, options.format, folder, lambda fraction: console.progress(fraction, f"writing {options.format}"))
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    losses = list(recording.losses)
    console.result(folder=str(folder), files=[str(path) for path in files], losses=losses)
    size = sum(path.stat().st_size for path in files) / 1e6
    count = f"{len(files)} file{'s' * (len(files) > 1)}"
    console.say(recording.simulated_sentence, *losses, f"{folder}: {count}, {size:.1f} MB")
    return FLAWED if losses else DONE


def _source(recording: Recording, console: Console) -> ExportSource:
    """Return the session with its stored numbers; those made under other decisions are computed again."""
    decisions = read(recording.folder)
    made_by = {"made_by": software_versions()}
    analysis, prediction = (derived.stored_document(recording.folder, name) for name in (ANALYSIS, PREDICTION))
    if analysis is None or not derived.is_current(analysis, decisions):
        settings = analysis or {"gain_error": gain_error_set(recording.folder)}
        analysis = made_by | derived.repeat(ANALYSIS, settings, recording, decisions)
    if prediction is not None and not derived.is_current(prediction, decisions):
        console.note(f"{PREDICTION} was made under other decisions than those in force, and is computed again")
        prediction = made_by | derived.repeat(PREDICTION, prediction, recording, decisions)
    console.note(derived.outdated_prediction(recording, derived.settings_of(analysis)))
    return ExportSource(recording, analysis, prediction)
