"""Go on with a session that a crash or a lost transducer cut short: at the same trial, in the same file.

Nothing recorded is altered: the take that was open is discarded with its reason, and the gap is recorded.
"""

import argparse
from contextlib import nullcontext
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from daq_app.cli import DONE, FLAWED, WrongValue
from daq_app.conduct import carried_on
from daq_app.console import Console
from daq_app.terminal import Terminal
from daq_app.wiring import SimulatedPeople, connected
from drivers.clock import PacedClock, RealClock
from sessions.recording import Recording, RecordingError, SessionWriter
from sessions.recording.archive import seal
from sessions.recording.head import simulated_sentence
from sessions.recording.manifest import is_sealed
from sessions.recording.provenance import software_versions
from sessions.resuming import check_resumable, check_same_transducer, continued, resumed_data, resumption
from sessions.runner import Resumed

EXAMPLE = "daq-app resume recordings/P07 --device net-ft://192.168.1.1"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare session, device and people."""
    parser.add_argument("session", type=Path, metavar="SESSION")
    parser.add_argument("--device", metavar="URI", help="the transducer (where it was when the session began)")
    parser.add_argument("--headless", action="store_true", help="no window: answers at the terminal, or simulated")
    parser.add_argument("--simulate-subject", type=int, metavar="SEED", help="simulated people, as at the beginning")
    parser.add_argument("--pace", type=float, default=1.0, help="told seconds a real second, simulated people only (1)")
    parser.add_argument("--end", action="store_true", help="seal the session as it is, and do not go on")


def run(options: argparse.Namespace, console: Console) -> int:
    """Go on to the end, or seal what there is."""
    folder: Path = options.session
    if is_sealed(folder):
        raise RecordingError(f"{folder} is sealed: nothing is added to it; begin a new session")
    recording = Recording.open(folder)
    if options.end:
        seal(folder)
        console.result({"session": str(folder), "sealed": True, "readings": sum(map(len, recording.blocks()))})
        console.say(f"{folder}: sealed as it is")
        return DONE if recording.end is not None and recording.end.get("complete") else FLAWED
    check_resumable(recording)
    simulated = options.simulate_subject is not None
    if options.pace != 1.0 and not (simulated and 0.1 <= options.pace <= 200):
        raise WrongValue(f"--pace {options.pace:g} is not allowed: 0.1 to 200, and only with --simulate-subject")
    if options.device is not None and recording.info is None:
        raise WrongValue("--device is not allowed: the session began without a transducer")
    at, last = resumption(recording.plan, recording.events), recording.last_block()
    factor = float(recording.provenance["clock"]["factor"])
    if options.pace != factor:
        raise WrongValue(f"--pace {options.pace:g} is not allowed: the session began with {factor:g}")
    real = RealClock() if options.pace == 1.0 else PacedClock(options.pace)
    clock, gap = continued(recording, last, real, datetime.now(UTC))
    uri = options.device or (recording.info and recording.info.uri)
    with connected(uri, clock) if uri else nullcontext() as bench:
        transducer = None if bench is None else bench.transducer
        info = None if transducer is None else transducer.info
        check_same_transducer(recording.info, info)
        if simulated_sentence(info, simulated) != recording.simulated_sentence:
            raise WrongValue("what was simulated at the beginning must be simulated again, and nothing else")
        writer = SessionWriter.open(folder, clock)
        people = (
            SimulatedPeople(options.simulate_subject, clock, bench) if simulated else Terminal(forces=bench is not None)
        )
        resumed = Resumed(at, resumed_data(gap, info, software_versions()), last)
        end = carried_on(recording.plan, writer, people, transducer, clock, console, shown=simulated, resumed=resumed)
    console.result({"session": str(folder), "end": asdict(end), "gap": gap.duration})
    console.say(f"{folder}: {end.reason}; {end.readings} readings in all, {end.health.lost} lost since it was resumed")
    return DONE if end.complete and not end.health.lost else FLAWED
