"""Run one session: plan it from a protocol and a seed, record everything as it happens, then seal the recording.

Experimenter and subject answer at this terminal, or are simulated (on the simulated bench only).
"""

import argparse
import secrets
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path
from typing import get_args

from daq_app.cli.options import add_body_arguments, add_flag, add_number, add_shared, body_of, measures_sentence
from daq_app.cli.terminal import attend_session, further_keys, open_device
from daq_app.console import Console, WrongValue
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import People, StartSession
from drivers.transducer import flagged_words
from sessions.plan.plan import NORMALS, Phase
from sessions.plan.protocols.planning import Body, StudyPlace, VisitSetting, plan
from sessions.plan.protocols.protocol import AREAS, Protocol, protocol
from sessions.plan.study import enrolled_visit
from sessions.recording import Setting
from sessions.run.resuming import RESUMABLE

EXAMPLE = "daq-app run sensotact-friction --device sim:?seed=7 --subject P07 --headless --simulate-subject 7 --pace 20"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    meaning = "a built-in protocol such as sensotact-friction, or a TOML file"
    parser.add_argument("protocol", nargs="?", metavar="PROTOCOL", help=meaning)
    parser.add_argument("--study", type=Path, metavar="STUDY", help="take protocol, order and finger from this study")
    device = parser.add_mutually_exclusive_group(required=True)
    device.add_argument("--device", metavar="URI", help="the transducer, e.g. sim: or net-ft://192.168.1.1")
    device.add_argument("--scores-only", action="store_true", help="a visit without a transducer")
    parser.add_argument("--subject", required=True, metavar="CODE", help="a code, never a name")
    parser.add_argument("--seed", type=int, help="seed of the stimulus order (a random one, which is recorded)")
    phases, meaning = get_args(Phase), f"phases of the visit: {', '.join(get_args(Phase))} (the protocol's own)"
    parser.add_argument("--phases", nargs="+", choices=phases, metavar="PHASE", help=meaning)
    add_body_arguments(parser)
    height = "height of the stimulus's face above the sensor's origin"
    add_shared(parser, "headless", simulate_subject="seed of simulated people", height=height)
    meaning = "simulated seconds per real second, for simulated people only (1)"
    parser.add_argument("--pace", type=float, default=1.0, help=meaning)
    parser.add_argument("--normal", choices=NORMALS, help="axis along which pressing is positive")
    allowed = f"{AREAS[0]:g} to {AREAS[1]:g} (mm2)"
    add_number(parser, "--contact-area", float, AREAS, "contact area, for tau_max", None, "MM2", allowed)
    parser.add_argument("--stroking-hand", choices=["left", "right"], help="hand that strokes, recorded (unknown)")
    parser.add_argument("--answering-hand", choices=["left", "right"], help="hand that answers, recorded (unknown)")
    meaning = "language that the subject reads, such as de; the protocol must have it (its own)"
    parser.add_argument("--language", metavar="XX", help=meaning)
    parser.add_argument("--out", type=Path, metavar="DIR", help="the session's folder (one below recordings/)")
    add_flag(parser, "--any-folder", "allow a network drive or a synchronised folder, at your own risk")


def run(options: argparse.Namespace, console: Console) -> int:
    _refuse_mixtures(options, simulated_bench=options.device is not None and options.device.startswith("sim:"))
    session_protocol, seed, body, study_place = _choices(options)
    hands = options.stroking_hand, options.answering_hand
    session_plan = plan(
        session_protocol,
        options.subject,
        seed,
        forces=options.device is not None,
        setting=VisitSetting(None, options.contact_area, *hands, options.language),
        phases=options.phases,
        body=body,
        place=study_place,
    )
    folder = options.out or (options.study or Path("recordings")) / session_plan.folder_name(datetime.now())
    console.note(measures_sentence(session_plan))
    simulated = options.simulate_subject
    surfaces = session_protocol.simulated_friction
    people = People() if simulated is None else People("simulated people", simulated, surfaces)
    settings = (Setting("seed", seed, "", "default" if options.seed is None else "set"),)
    with Recorder.start(options.pace, debug=options.debug) as recorder:
        bench = open_device(recorder, options.device) if options.device else None
        frame = session_plan.frame if bench is None else bench.frame or session_plan.frame
        session_plan = replace(session_plan, frame=frame.with_values(options.normal, options.height))
        request = StartSession(session_plan, str(folder.absolute()), people, settings, any_folder=options.any_folder)
        with further_keys(lambda: {"seed": seed}):
            outcome = attend_session(recorder, request, console)
    end = outcome.end
    if Path(outcome.folder) != folder.absolute():  # the folder was removed during the session
        folder = Path(outcome.folder)
    console.result(session=str(folder), end=asdict(end), sealed=outcome.sealed, seed=seed)
    console.say(f"{folder}: {end.reason}; {end.readings} readings, {end.health.lost} lost")
    if end.health.flagged:
        console.say(f"status of the readings: {flagged_words(end.health.flagged)}")
    if end.cause in RESUMABLE:
        console.note(f"it is not sealed yet: 'daq-app resume {folder}' resumes it at the same trial, --end seals it")
    return outcome.exit_code


def _choices(options: argparse.Namespace) -> tuple[Protocol, int, Body, StudyPlace | None]:
    """Return protocol, seed, the subject's own values and study place, from a study or the command line."""
    if options.study is None:
        seed = secrets.randbelow(2**31) if options.seed is None else options.seed
        return protocol(options.protocol), seed, body_of(options), None
    return enrolled_visit(options.study, options.subject)


def _refuse_mixtures(options: argparse.Namespace, *, simulated_bench: bool) -> None:
    if (options.protocol is None) == (options.study is None):
        raise WrongValue("give either a PROTOCOL, or --study, which has its own")
    if options.study is not None and (options.seed is not None or options.finger or options.depth):
        raise WrongValue("--seed, --finger and --depth are not allowed with --study: they were decided at enrolment")
    if options.simulate_subject is not None and not (simulated_bench or options.scores_only):
        raise WrongValue("--simulate-subject strokes the simulated bench only: give --device sim: or --scores-only")
    if options.pace != 1.0 and not (options.simulate_subject is not None and 0.1 <= options.pace <= 200):
        raise WrongValue(f"--pace {options.pace:g} is not allowed: 0.1 to 200, and only with --simulate-subject")
