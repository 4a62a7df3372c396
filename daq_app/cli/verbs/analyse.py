"""Find every stroke of a session: onset, lift, steady window, friction, speed, direction, and what is wrong with it.

Each flaw is named; where honesty allows no number there is none. With flaws the exit code is 3. Intervals come from a
seeded block bootstrap over sensor noise, zero, calibration and choice of window.
"""

import argparse
from pathlib import Path

from daq_app.batch.derived import analysed, analysis_document, made_otherwise
from daq_app.cli.area_option import add_area, area_law
from daq_app.cli.calibration_option import add_calibration, calibration_error
from daq_app.console import Console, WrongValue, number, span, table
from sessions.recording import Recording
from sessions.strokes.bootstrap import StrokeIntervals, drawn_from
from sessions.strokes.tilt import Tilt

EXAMPLE = "daq-app analyse recordings/P07 --json"
HEAD = ["trial", "onset [s]", "steady [s]", "mu static", "mu dynamic", "mu max", "tau_max [kPa]", "speed [mm/s]", "way"]
INTERVALS = ["trial", "mu static", "mu dynamic", "mu max", "tau_max [kPa]", "speed [mm/s]"]
COURSES = ["trial", "N [N]", "T [N]", "heading [°]", "same way", "onset [s]", "break-away [s]", "slide onset [s]"]
WAYS = {1: "p → d", -1: "d → p", None: "–"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the session folder."""
    parser.add_argument("session", type=Path, metavar="SESSION", help="a session folder")
    add_calibration(parser)
    parser.add_argument("--bootstrap-seed", type=int, metavar="SEED", help="of the intervals (as before, or 0)")
    add_area(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    """Analyse the session, keep the result in its folder and print it."""
    given = calibration_error(options)
    if options.bootstrap_seed is not None and options.bootstrap_seed < 0:
        raise WrongValue(f"--bootstrap-seed {options.bootstrap_seed} is not allowed: a whole number from 0 on")
    recording = Recording.open(options.session)
    analysis = analysed(recording, console, area_law(options), seed=options.bootstrap_seed, gain_error=given)
    older = made_otherwise(recording, analysis.settings)
    if older is not None:
        console.note(older)
    chosen = drawn_from(analysis.settings, analysis.tilt)
    console.result(analysis_document(analysis, chosen))
    if recording.simulated_sentence:
        console.say(recording.simulated_sentence)
    rows = [
        [
            ("–" if stroke.trial is None else str(stroke.trial)) + ("*" if stroke.decided else ""),
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
    for decision in analysis.decisions:
        console.say(f"* {decision.sentence}")
    intervals = analysis.intervals
    if any(end != "–" for found in intervals for end in _row(found)[1:] + _course(found)[1:]):
        console.say(f"\n{chosen.kind}:")
        console.say(table([_row(found) for found in intervals], head=INTERVALS))
        console.say("\nof the same repeats; same way: share of them with the direction told:")
        console.say(table([_course(found) for found in intervals], head=COURSES))
        for name, kind in chosen.kinds.items():
            console.say(f"  {name.replace('_', ' ')}: {kind}")
    if analysis.tilt is not None:
        console.say(_leaning(analysis.tilt, analysis.settings.tilt))
    for flaw in analysis.flaws:
        where = "" if flaw.trial is None else f"trial {flaw.trial}: "
        console.say(f"{flaw.grade}: {where}{flaw.sentence}")
    return 3 if analysis.flawed else 0


def _leaning(tilt: Tilt, levelled: tuple[float, float]) -> str:
    """Say how the face leans, and whether that was levelled."""
    ends = (tilt.x_interval, tilt.y_interval)
    told = [
        f"{number(a)}° ({number(low)} to {number(high)}) to +{axis}"
        for axis, a, (low, high) in zip("xy", tilt.lean, ends, strict=True)
    ]
    done = f"levelled by {levelled[0]:g}° and {levelled[1]:g}°" if levelled != (0.0, 0.0) else "not levelled"
    return f"tilt of the face, if the hand pressed straight down: {', '.join(told)}; {tilt.kind}; {done}"


def _row(found: StrokeIntervals) -> list[str]:
    kilo = None if found.tau_max is None else (1e3 * found.tau_max[0], 1e3 * found.tau_max[1])
    pairs = (found.mu_static, found.mu_dynamic, found.mu_max, kilo, found.speed)
    return ["–" if found.trial is None else str(found.trial), *map(_ends, pairs)]


def _course(found: StrokeIntervals) -> list[str]:
    share = "–" if found.direction_agrees is None else f"{100 * found.direction_agrees:.3g} %"
    forces = map(_ends, (found.normal_force, found.tangential_force))
    instants = (_ends(pair, 5) for pair in (found.onset, found.break_away, found.slide_onset))
    trial = "–" if found.trial is None else str(found.trial)
    return [trial, *forces, _ends(found.heading), share, *instants]


def _ends(pair: tuple[float, float] | None, figures: int = 3) -> str:
    return "–" if pair is None else span(*pair, figures)
