"""Find every stroke of a session: onset, lift, steady window, friction, speed, direction and flaws.

Each flaw is named; numbers that cannot be given honestly are withheld. With flaws the exit code is 3. Intervals come
from a seeded block bootstrap over sensor noise, zero, calibration and choice of window.
"""

import argparse
import math

from daq_app.batch.derived import analyse_session, analysis_document, outdated_prediction
from daq_app.cli.options import add_analysis, add_number, add_session, area_law
from daq_app.console import DONE, FLAWED, Console, table
from daq_app.wording import no_strokes, number
from sessions.recording import Recording
from sessions.strokes import Analysis
from sessions.strokes.trial_analysis import Tilt

EXAMPLE = "daq-app analyse recordings/P07 --json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_session(parser)
    add_number(parser, "--bootstrap-seed", int, (0, math.inf), "seed of the intervals (last one, or 0)", metavar="SEED")
    add_analysis(parser)


def run(options: argparse.Namespace, console: Console) -> int:
    recording = Recording.open(options.session)
    analysis = analyse_session(
        recording, console, area_law(options), seed=options.bootstrap_seed, gain_error=options.calibration_error
    )
    console.note(outdated_prediction(recording, analysis.settings))
    console.result(**analysis_document(analysis))
    console.say(recording.simulated_sentence)
    if not console.as_json:
        _print(recording, analysis, console)
    console.say(*(f"* {decision.sentence}" for decision in analysis.decisions))
    console.say(None if analysis.tilt is None else _tilt_text(analysis.tilt, analysis.settings.tilt))
    for flaw in analysis.flaws:
        prefix = "" if flaw.trial is None else f"trial {flaw.trial}: "
        console.say(f"{flaw.grade}: {prefix}{flaw.sentence}")
    return FLAWED if analysis.flawed else DONE


def _print(recording: Recording, analysis: Analysis, console: Console) -> None:
    """Print the times of each stroke, and the report's tables of its numbers."""
    from daq_app.cli.report_tables import table_texts  # slow to load
    from sessions.report import Further, numbers_alone

    report = numbers_alone(recording, analysis, None, Further())
    rows: list[list[str]] = []
    for stroke in report.strokes:
        steady = "–" if stroke.steady is None else f"{stroke.steady[0]:.2f} to {stroke.steady[1]:.2f}"
        mark = "*" if stroke.decided else ""
        rows.append([f"{stroke.number}{mark}", number(stroke.onset, 5), number(stroke.lift, 5), steady])
    times = table(rows, header=["stroke", "onset [s]", "lift [s]", "steady [s]"])
    console.say(times if rows else no_strokes(recording.info), *table_texts(report, "strokes"))


def _tilt_text(tilt: Tilt, angles: tuple[float, float]) -> str:
    axes = zip("xy", tilt.lean, (tilt.x_interval, tilt.y_interval), strict=True)
    rows = [f"{number(angle)}° ({number(low)} to {number(high)}) to +{axis}" for axis, angle, (low, high) in axes]
    levelling = f"levelled by {angles[0]:g}° and {angles[1]:g}°" if angles != (0.0, 0.0) else "not levelled"
    return f"tilt of the face, if the hand pressed straight down: {', '.join(rows)}; {tilt.kind}; {levelling}"
