"""Find every stroke of a session: onset, lift, steady window, friction, speed, direction, and what is wrong with it.

Each flaw is named; where honesty allows no number there is none. With flaws the exit code is 3.
"""

import argparse
from pathlib import Path

from daq_app.console import Console, number, table
from daq_app.derived import analysed
from sessions.recording import Recording

EXAMPLE = "daq-app analyse recordings/P07 --json"
HEAD = ["trial", "onset [s]", "steady [s]", "mu static", "mu dynamic", "mu max", "tau_max [kPa]", "speed [mm/s]", "way"]
WAYS = {1: "p → d", -1: "d → p", None: "–"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the session folder."""
    parser.add_argument("session", type=Path, metavar="SESSION", help="a session folder")


def run(options: argparse.Namespace, console: Console) -> int:
    """Analyse the session, keep the result in its folder and print it."""
    recording = Recording.open(options.session)
    analysis = analysed(recording, console)
    console.result(analysis.to_dict())
    if recording.simulated_sentence:
        console.say(recording.simulated_sentence)
    rows = [
        [
            "–" if stroke.trial is None else str(stroke.trial),
            number(stroke.onset, 5),
            "–" if stroke.steady is None else f"{stroke.steady[0]:.2f} to {stroke.steady[1]:.2f}",
            number(stroke.mu_static),
            number(stroke.mu_dynamic),
            number(stroke.mu_max),
            number(None if stroke.tau_max is None else stroke.tau_max * 1e3),
            number(stroke.speed),
            WAYS[stroke.direction],
        ]
        for stroke in analysis.strokes
    ]
    console.say(table(rows, head=HEAD) if rows else "no stroke")
    for flaw in analysis.flaws:
        where = "" if flaw.trial is None else f"trial {flaw.trial}: "
        console.say(f"{flaw.grade}: {where}{flaw.sentence}")
    return 3 if analysis.flaws else 0
