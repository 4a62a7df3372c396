"""Find every stroke of a session: onset, lift, steady window, friction, speed, direction, and what is wrong with it.

Each flaw is named; where honesty allows no number there is none. With flaws the exit code is 3. Intervals come from a
seeded block bootstrap over sensor noise, zero, calibration and choice of window.
"""

import argparse
import math

from daq_app.batch.derived import analyse_session, analysis_document, outdated_prediction
from daq_app.cli.options import add_analysis, add_number, add_session, area_law, calibration_error
from daq_app.console import DONE, FLAWED, Console, table
from daq_app.wording import number, span
from sessions.recording import Recording
from sessions.strokes.bootstrap import StrokeIntervals
from sessions.strokes.trial_analysis import Tilt

EXAMPLE = "daq-app analyse recordings/P07 --json"
HEAD = ["trial", "onset [s]", "steady [s]", "mu static", "mu dynamic", "mu max", "tau_max [kPa]", "speed [mm/s]", "way"]
INTERVALS = ["trial", "mu static", "mu dynamic", "mu max", "tau_max [kPa]", "speed [mm/s]"]
COURSES = ["trial", "N [N]", "T [N]", "heading [°]", "same way", "onset [s]", "break-away [s]", "slide onset [s]"]
WAYS = {1: "p → d", -1: "d → p", None: "–"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_session(parser)
    add_number(parser, "--bootstrap-seed", int, (0, math.inf), "of the intervals (as before, or 0)", metavar="SEED")
    add_analysis(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    recording = Recording.open(options.session)
    analysis = analyse_session(
        recording, console, area_law(options), seed=options.bootstrap_seed, gain_error=calibration_error(options)
    )
    console.note(outdated_prediction(recording, analysis.settings))
    console.result(analysis_document(analysis))
    console.say(recording.simulated_sentence)
    rows = [
        [
            _trial(stroke.trial) + ("*" if stroke.decided else ""),
            number(stroke.onset, 5),
            "–" if stroke.steady is None else f"{stroke.steady[0]:.2f} to {stroke.steady[1]:.2f}",
            number(stroke.mu_static),
            number(stroke.mu_dynamic),
            number(stroke.mu_max),
            number(stroke.tau_max, factor=1e3),
            number(stroke.speed),
            WAYS[stroke.direction],
        ]
        for stroke in analysis.strokes
    ]
    console.say(table(rows, head=HEAD) if rows else "no stroke")
    console.say(*(f"* {decision.sentence}" for decision in analysis.decisions))
    rows, courses = [_row(one) for one in analysis.intervals], [_course(one) for one in analysis.intervals]
    if any(end != "–" for row in (*rows, *courses) for end in row[1:]):
        console.say(f"\n{analysis.bootstrap.kind}:", table(rows, head=INTERVALS))
        console.say("\nfrom the same repeats; same way: share of repeats with the reported direction:")
        console.say(table(courses, head=COURSES))
        console.say(*(f"  {name.replace('_', ' ')}: {kind}" for name, kind in analysis.bootstrap.kinds.items()))
    if analysis.tilt is not None:
        console.say(_leaning(analysis.tilt, analysis.settings.tilt))
    for flaw in analysis.flaws:
        where = "" if flaw.trial is None else f"trial {flaw.trial}: "
        console.say(f"{flaw.grade}: {where}{flaw.sentence}")
    return FLAWED if analysis.flawed else DONE


def _leaning(tilt: Tilt, levelled: tuple[float, float]) -> str:
    """Say how the face leans, and whether that was levelled."""
    ends = (tilt.x_interval, tilt.y_interval)
    rows = [
        f"{number(a)}° ({number(low)} to {number(high)}) to +{axis}"
        for axis, a, (low, high) in zip("xy", tilt.lean, ends, strict=True)
    ]
    done = f"levelled by {levelled[0]:g}° and {levelled[1]:g}°" if levelled != (0.0, 0.0) else "not levelled"
    return f"tilt of the face, if the hand pressed straight down: {', '.join(rows)}; {tilt.kind}; {done}"


def _row(intervals: StrokeIntervals) -> list[str]:
    kilo = None if intervals.tau_max is None else (1e3 * intervals.tau_max[0], 1e3 * intervals.tau_max[1])
    pairs = (intervals.mu_static, intervals.mu_dynamic, intervals.mu_max, kilo, intervals.speed)
    return [_trial(intervals.trial), *map(_ends, pairs)]


def _course(intervals: StrokeIntervals) -> list[str]:
    share = "–" if intervals.direction_agrees is None else f"{100 * intervals.direction_agrees:.3g} %"
    forces = map(_ends, (intervals.normal_force, intervals.tangential_force))
    instants = (_ends(pair, 5) for pair in (intervals.onset, intervals.break_away, intervals.slide_onset))
    return [_trial(intervals.trial), *forces, _ends(intervals.heading), share, *instants]


def _trial(number_of: int | None) -> str:
    return "–" if number_of is None else str(number_of)


def _ends(pair: tuple[float, float] | None, figures: int = 3) -> str:
    return "–" if pair is None else span(*pair, figures)
