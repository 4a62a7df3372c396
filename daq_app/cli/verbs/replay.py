"""Run a recorded session once more from its readings, and compare what comes out with what was recorded.

Transducer and people are those of the recording: readings with sequence, device counter, status and host time, and what
was done, when. Course, detector and analysis are those of this program. The event log, the readings and every number
made from them are then compared. Exit code 0: all is identical; 3: the differences are named.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from daq_app.batch.derived import ANALYSIS, PREDICTION, analysed_again, kept, predicted_again, settings_of
from daq_app.console import Console, WrongValue
from sessions.recording import Recording
from sessions.recording.provenance import software_versions
from sessions.recording.verification import differences, told, why
from sessions.run.replay import Stopped, different_events, different_readings, replay
from sessions.strokes import analyse
from sessions.strokes.decisions import read

EXAMPLE = "daq-app replay recordings/P07 --fast"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the session and the pace."""
    parser.add_argument("session", type=Path, metavar="SESSION")
    pace = parser.add_mutually_exclusive_group()
    pace.add_argument("--speed", type=float, default=1.0, metavar="X", help="times as fast as it was recorded (1)")
    pace.add_argument("--fast", action="store_true", help="as fast as the machine goes")
    parser.add_argument("--no-prediction", action="store_true", help="leave the solver's numbers out")


def run(options: argparse.Namespace, console: Console) -> int:
    """Replay, compare and tell."""
    if not 0.01 <= options.speed <= 10_000:
        raise WrongValue(f"--speed {options.speed:g} is not allowed: 0.01 to 10000, or --fast for as fast as it goes")
    recording = Recording.open(options.session)
    with tempfile.TemporaryDirectory(prefix="daq-app-replay-") as room:
        began = time.perf_counter()
        try:
            replayed = replay(
                recording, Path(room) / "replay", None if options.fast else options.speed, console.progress
            )
        except Stopped:
            raise KeyboardInterrupt from None
        taken = time.perf_counter() - began
        found = [*different_readings(recording, replayed), *told(list(different_events(recording, replayed)))]
        compared = ["readings", "events", ANALYSIS]
        decided = read(recording.folder)  # people decided about the recording, not about its replay
        stored = kept(options.session, ANALYSIS)
        fresh = _plain(analysed_again(replayed, stored or {}, decided))
        expected = _plain(analysed_again(recording, {}, decided)) if stored is None else stored
        found += _changed(ANALYSIS, expected, fresh)
        if not options.no_prediction:
            predicted = kept(options.session, PREDICTION)
            if predicted is not None:
                console.progress(0.9, f"making {PREDICTION} again")
                analysis = analyse(replayed, settings_of(predicted), decided)
                again = _plain(predicted_again(recording, analysis, predicted))
                found += _changed(PREDICTION, predicted, again)
                compared.append(PREDICTION)
    lasted = _duration(recording)
    notes = list(_notes(recording))
    console.result(
        {
            "session": str(options.session),
            "compared": compared,
            "differences": found,
            "notes": notes,
            "duration_s": lasted,
            "wall_s": taken,
        }
    )
    if recording.simulated_sentence:
        console.say(recording.simulated_sentence)
    for sentence in (*notes, *found):
        console.say(sentence)
    outcome = "identical" if not found else "not identical, as named above"
    console.say(f"{options.session}: {outcome} ({', '.join(compared)} compared)")
    console.say(f"{lasted:.1f} s of session in {taken:.2f} s, the comparison not counted")
    return 3 if found else 0


def _changed(name: str, stored: dict[str, Any], fresh: dict[str, Any]) -> list[str]:
    """Return a sentence for each number that came out otherwise, and why that may be."""
    found = told(list(differences(stored, fresh, name)))
    return [*found, why(name, stored, software_versions())] if found else []


def _notes(recording: Recording) -> Iterator[str]:
    """Say what a replay of such a recording cannot show."""
    if not recording.plan.forces:
        yield "a visit that only scored: there are no readings, and its course follows what people did"
    elif not recording.plan.trials:
        yield "an imported recording: it had no course, so only its readings and what is made of them were gone through"
    yield from recording.losses


def _duration(recording: Recording) -> float:
    """Return the time from the first event to the last on the session clock [s]."""
    events = recording.events
    return (events[-1].time_ns - events[0].time_ns) * 1e-9 if events else 0.0


def _plain(document: dict[str, Any]) -> dict[str, Any]:
    """Return a document as it is once it was stored."""
    return json.loads(json.dumps(document))
