"""Check every checksum of a session, and make every number that was derived from it once more.

Exit code 0: whole; 3: readable, with what is lost or differs named; 1: unreadable.
"""

import argparse
import json
from pathlib import Path

from daq_app.batch.derived import ANALYSIS, PREDICTION, analysed_again, kept, made_under, predicted_again, settings_of
from daq_app.console import Console
from sessions.recording import Recording, RecordingError
from sessions.recording.archive import problems
from sessions.recording.calibration_uncertainty import GAIN_ERROR, gain_error_set
from sessions.recording.provenance import software_versions
from sessions.recording.verification import differences, told, why
from sessions.strokes import analyse
from sessions.strokes.decisions import DECISIONS, read
from sessions.strokes.doubtful_readings import doubtful_readings
from sessions.toml_file import SettingsError

EXAMPLE = "daq-app verify recordings/P07"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the session folder."""
    parser.add_argument("session", type=Path, metavar="SESSION")


def run(options: argparse.Namespace, console: Console) -> int:
    """Verify and tell."""
    folder: Path = options.session
    found = list(problems(folder))
    recording = Recording.open(folder)
    found += doubtful_readings(recording)
    checked = ["files"]
    decided = read(folder)
    found += decided.problems
    checked += [DECISIONS] if decided.lines or decided.problems else []
    try:
        checked += [] if gain_error_set(folder) is None else [GAIN_ERROR]
    except RecordingError as damaged:
        found.append(str(damaged))
    for name in (ANALYSIS, PREDICTION):
        console.progress(0.5, f"making {name} again")
        try:
            stored = kept(folder, name)
            if stored is None:
                continue
            if not made_under(stored, decided):
                found.append(f"{name} was made under other decisions than those in force: make it anew")
            if name == ANALYSIS:
                fresh = analysed_again(recording, stored, decided)
            else:
                fresh = predicted_again(recording, analyse(recording, settings_of(stored), decided), stored)
        except (RecordingError, SettingsError) as damaged:
            found.append(" ".join(str(damaged).split()))
            continue
        changed = told(list(differences(stored, json.loads(json.dumps(fresh)), name)))
        if changed:
            found += [*changed, why(name, stored, software_versions())]
        checked.append(name)
    console.result({"session": str(folder), "checked": checked, "problems": found})
    for sentence in found:
        console.say(sentence)
    console.say(f"{folder}: {'whole' if not found else 'readable, with the above'} ({', '.join(checked)} checked)")
    return 3 if found else 0
