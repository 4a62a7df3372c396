"""What a session of ten trials costs: replayed, analysed, with bootstrap intervals, and with those of its SEDs."""

import argparse
import tempfile
import time
from functools import partial
from math import inf
from pathlib import Path
from statistics import median

from daq_app.cli.main import run
from sessions.prediction import PredictionOptions, predict
from sessions.prediction.uncertainty import with_alternatives, with_intervals
from sessions.recording import Recording
from sessions.recording.schema import RecordingError
from sessions.run.replay import different_events, different_readings, replay
from sessions.strokes import analyse
from sessions.strokes.bootstrap import stroke_intervals
from solver.verification.request import median_time

RUNS = 9
WORDS = ("run", "sensotact-friction", "--device", "sim:?seed=7&rate=200", "--subject", "P01", "--headless")


def main() -> None:
    """Print the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("session", nargs="?", type=Path, help="folder of a session; without one it is simulated")
    session = parser.parse_args().session
    with tempfile.TemporaryDirectory() as room:
        try:
            recording = Recording.open(session or _session(Path(room)))
        except RecordingError as error:
            parser.error(str(error))
        _print_replay(recording, Path(room))
        _print_analysis(recording)


def _session(room: Path) -> Path:
    """Return the folder of a session recorded in `room`."""
    folder = room / "session"
    run([*WORDS, "--simulate-subject", "1", "--seed", "3", "--pace", "20", "--out", str(folder)])
    return folder


def _print_replay(recording: Recording, room: Path) -> None:
    """Print the speed of a replay relative to real time, without the solver."""
    span_s = (recording.events[-1].time_ns - recording.events[0].time_ns) * 1e-9
    replay_s: list[float] = []
    total_s: list[float] = []
    for number in range(RUNS):
        start = time.perf_counter()
        copy = replay(recording, room / f"replay-{number}", None, lambda *_: None)
        replay_s.append(time.perf_counter() - start)
        differences = [*different_readings(recording, copy), *different_events(recording, copy)]
        analyse(copy)
        total_s.append(time.perf_counter() - start)
    print(f"session of {span_s:.1f} s, {recording.events[-1].readings} readings")
    print(f"replayed in {median(replay_s):.3f} s: {span_s / median(replay_s):.0f} times real time (median of {RUNS})")
    print(f"compared and analysed too: {median(total_s):.3f} s, {span_s / median(total_s):.0f} times real time")
    print(f"differences: {len(differences)}")


def _print_analysis(recording: Recording) -> None:
    """Print the processor time of the analysis and of the prediction."""
    analysis = analyse(recording)  # loads modules before the timing
    strokes = analysis.strokes
    options = PredictionOptions(course="steady", intervals=True, variants="small")
    prediction = predict(analysis, recording.plan, options)
    with_spans = with_intervals(prediction)
    with_alternatives(with_spans)
    time_of = partial(median_time, repeats=RUNS, most_s=inf)
    alone = time_of(lambda: analyse(Recording.open(recording.folder)))
    bootstrap = time_of(lambda: [stroke_intervals(stroke, index) for index, stroke in enumerate(strokes)])
    solves = time_of(lambda: predict(analysis, recording.plan, prediction.options))
    spans = time_of(lambda: with_intervals(prediction))
    alternatives = time_of(lambda: with_alternatives(with_spans))
    print(f"{len(strokes)} strokes, medians of {RUNS}, processor time")
    print(f"opened and analysed   {1000 * alone:6.0f} ms   (reach 1000)")
    print(f"bootstrap intervals   {1000 * bootstrap:6.0f} ms   (both together: reach 5000)")
    pairs = ((row.interval, row.opposite_interval) for row in with_spans.trials)
    intervals = [interval for pair in pairs for interval in pair if interval]
    samplings = sum(interval.method == "sampling" for interval in intervals)
    print(f"predicted both ways   {1000 * solves:6.0f} ms   at small strain")
    print(f"intervals of the SEDs {1000 * spans:6.0f} ms   {len(intervals)} of them, {samplings} by sampling")
    print(f"side by side          {1000 * alternatives:6.0f} ms   at small strain")


if __name__ == "__main__":
    main()
