"""Check every checksum of a session, and compute every derived number again.

Exit code 0: whole; 3: readable, with losses or differences named; 1: unreadable.
"""

import argparse
from pathlib import Path

from daq_app.batch.derived import ANALYSIS, PREDICTION, changes, decisions_of, repeat, stale_sentence, stored_document
from daq_app.cli.options import add_session
from daq_app.console import DONE, FLAWED, Console
from sessions.recording import Recording, RecordingError
from sessions.recording.archive import problems
from sessions.recording.derived import GAIN_ERROR, gain_error_set
from sessions.strokes.decisions import DECISIONS, read
from sessions.strokes.signal_quality import doubtful_readings
from sessions.toml_file import SettingsError

EXAMPLE = "daq-app verify recordings/P07"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_session(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    folder: Path = options.session
    flaws = list(problems(folder))
    recording = Recording.open(folder)
    flaws += doubtful_readings(recording)
    checks = ["files"]
    decisions = read(folder)
    flaws += decisions.problems
    checks += [DECISIONS] if decisions.lines or decisions.problems else []
    try:
        checks += [] if gain_error_set(folder) is None else [GAIN_ERROR]
    except RecordingError as damaged:
        flaws.append(str(damaged))
    for name in (ANALYSIS, PREDICTION):
        console.progress(0.5, f"making {name} again")
        try:
            document = stored_document(folder, name)
            if document is None:
                continue
            stale = stale_sentence(name, document, decisions)
            flaws += [] if stale is None else [stale]
            fresh = repeat(name, document, recording, decisions_of(document, decisions))
        except (RecordingError, SettingsError) as damaged:
            flaws.append(" ".join(str(damaged).split()))
            continue
        flaws += changes(name, document, fresh)
        checks.append(name)
    console.result(session=str(folder), checked=checks, problems=flaws)
    outcome = "readable, with the above" if flaws else "whole"
    console.say(*flaws, f"{folder}: {outcome} ({', '.join(checks)} checked)")
    return FLAWED if flaws else DONE
