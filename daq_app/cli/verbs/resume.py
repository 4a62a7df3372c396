"""Resume a session that was cut short: at the same trial, in the same file, with the people it began with.

Nothing recorded is altered: the open take is discarded with its reason, and the gap is recorded.
"""

import argparse
from dataclasses import asdict
from pathlib import Path

from daq_app.cli.options import add_flag, add_session, add_shared
from daq_app.cli.terminal import attend_session, further_keys
from daq_app.console import DONE, FLAWED, Console, WrongValue
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import People, ResumeSession
from sessions.recording import Recording, RecordingError
from sessions.recording.archive import seal
from sessions.recording.manifest import is_sealed

EXAMPLE = "daq-app resume recordings/P07 --device net-ft://192.168.1.1"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_session(parser)
    parser.add_argument("--device", metavar="URI", help="the transducer (its address when the session began)")
    add_shared(parser, "headless", simulate_subject="seed of simulated people (as at the beginning)")
    parser.add_argument("--pace", type=float, help="simulated seconds per real second (as at the beginning)")
    add_flag(parser, "--end", "seal the session as it is, without resuming it")


def run(options: argparse.Namespace, console: Console) -> int:
    folder: Path = options.session
    if is_sealed(folder):
        raise RecordingError(f"{folder} is sealed: nothing is added to it; begin a new session")
    recording = Recording.open(folder)
    if options.end:
        seal(folder)
        console.result(session=str(folder), sealed=True, readings=sum(map(len, recording.blocks())))
        console.say(f"{folder}: sealed as it is")
        return DONE if recording.end is not None and recording.end.get("complete") else FLAWED
    factor = float(recording.provenance["clock"]["factor"])
    if options.pace not in (None, factor):
        raise WrongValue(f"--pace {options.pace:g} is not allowed: the session began with {factor:g}")
    simulated = options.simulate_subject
    people = None if simulated is None else People("simulated people", simulated)
    with Recorder.start(factor, debug=options.debug) as recorder, further_keys(lambda: {"gap": _gap(folder)}):
        outcome = attend_session(recorder, ResumeSession(str(folder.absolute()), options.device, people), console)
    end, folder = outcome.end, Path(outcome.folder)
    console.result(session=str(folder), end=asdict(end), sealed=outcome.sealed, gap=_gap(folder))
    console.say(f"{folder}: {end.reason}; {end.readings} readings in all, {end.health.lost} lost since it was resumed")
    return outcome.exit_code


def _gap(folder: Path) -> float | None:
    """Return the gap before the last resumption [s]; None if the wall clock did not tell."""
    resumptions = (event for event in reversed(Recording.open(folder).events) if event.kind == "resumed")
    return next((event.data["gap"] for event in resumptions), None)
