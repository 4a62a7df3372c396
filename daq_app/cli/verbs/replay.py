"""Run a recorded session again from its readings, and compare the results with the recording.

The recording supplies the readings (sequence, device counter, status and host time) and what people did, and when.
This program supplies course, detector and analysis. The event log, the readings and every number computed from them
are then compared. Exit code 0: all are identical; 3: the differences are named.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from daq_app.batch import derived
from daq_app.batch.derived import ANALYSIS, PREDICTION
from daq_app.cli.options import add_session, number_in_range
from daq_app.console import DONE, FLAWED, Console
from sessions.recording import Recording
from sessions.recording.derived import first_sentences
from sessions.run.replay import Stopped, different_events, different_readings, replay
from sessions.strokes.decisions import read

EXAMPLE = "daq-app replay recordings/P07 --fast"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_session(parser)
    pace = parser.add_mutually_exclusive_group()
    parse = number_in_range("--speed", float, 0.01, 10_000, "0.01 to 10000, or --fast for as fast as possible")
    pace.add_argument("--speed", type=parse, default=1.0, metavar="X", help="speed relative to the recording (1)")
    pace.add_argument("--fast", action="store_true", help="as fast as this computer can")
    parser.add_argument("--no-prediction", action="store_true", help="do not compare the prediction")


def run(options: argparse.Namespace, console: Console) -> int:
    recording = Recording.open(options.session)
    with tempfile.TemporaryDirectory(prefix="daq-app-replay-") as room:
        start = time.perf_counter()
        try:
            copy = replay(recording, Path(room) / "replay", None if options.fast else options.speed, console.progress)
        except Stopped:
            raise KeyboardInterrupt from None
        wall_s = time.perf_counter() - start
        differences = [*different_readings(recording, copy), *first_sentences(list(different_events(recording, copy)))]
        items = ["readings", "events", ANALYSIS]
        decisions = read(recording.folder)  # decisions belong to the recording, not to its replay
        notes = list(_notes(recording))

        def compare(name: str, document: Mapping[str, Any]) -> list[str]:
            """Return the differences of a document made again with its own decisions; note it if others apply now."""
            notes.extend(filter(None, [derived.stale_sentence(name, document, decisions)]))
            fresh = derived.repeat(name, document, copy, derived.decisions_of(document, decisions), recording)
            return derived.changes(name, document, fresh)

        analysis = derived.stored_document(options.session, ANALYSIS)
        if analysis is None:
            analysis = json.loads(json.dumps(derived.repeat(ANALYSIS, {}, recording, decisions)))
        differences += compare(ANALYSIS, analysis)
        prediction = None if options.no_prediction else derived.stored_document(options.session, PREDICTION)
        if prediction is not None:
            console.progress(0.9, f"making {PREDICTION} again")
            differences += compare(PREDICTION, prediction)
            items.append(PREDICTION)
    events = recording.events
    duration_s = (events[-1].time_ns - events[0].time_ns) * 1e-9 if events else 0.0
    times = {"duration_s": duration_s, "wall_s": wall_s}
    console.result(session=str(options.session), compared=items, differences=differences, notes=notes, **times)
    outcome = "identical" if not differences else "not identical, as named above"
    console.say(
        recording.simulated_sentence,
        *notes,
        *differences,
        f"{options.session}: {outcome} ({', '.join(items)} compared)",
        f"{duration_s:.1f} s of session in {wall_s:.2f} s, without the comparison",
    )
    return FLAWED if differences else DONE


def _notes(recording: Recording) -> Iterator[str]:
    """Yield a note on each aspect that a replay of this recording cannot check."""
    if not recording.plan.forces:
        yield "a visit with scores only: there are no readings, and its course follows what people did"
    elif not recording.plan.trials:
        yield "an imported recording: it has no course, so only its readings and the results from them were replayed"
    yield from recording.losses
