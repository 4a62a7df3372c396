"""Processor time of the analysis of a session of ten trials, of its bootstrap intervals, and of those of its SEDs.

Run from the repository's root: python -m benchmarks.analysis [SESSION]; without one a simulated one is recorded first.
"""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from benchmarks.given_session import given_session
from sessions.prediction import PredictionOptions, predict
from sessions.prediction.side_by_side import with_alternatives
from sessions.prediction.uncertainty import with_intervals
from sessions.recording import Recording
from sessions.strokes import analyse
from sessions.strokes.bootstrap import stroke_intervals

RUNS = 9


def main() -> None:
    """Print the medians."""
    with tempfile.TemporaryDirectory() as room:
        folder = given_session(Path(room))
        recording = Recording.open(folder)
        analysis = analyse(recording)  # what is loaded once is loaded now
        strokes = analysis.strokes
        prediction = predict(
            analysis, recording.plan, PredictionOptions(course="steady", intervals=True, variants="small")
        )
        carried = with_intervals(analysis, prediction)
        with_alternatives(carried)
        alone = _taken(lambda: analyse(Recording.open(folder)))
        drawn = _taken(lambda: [stroke_intervals(stroke, at) for at, stroke in enumerate(strokes)])
        solved = _taken(lambda: predict(analysis, recording.plan, prediction.options))
        spans = _taken(lambda: with_intervals(analysis, prediction))
        alternatives = _taken(lambda: with_alternatives(carried))
    print(f"{len(strokes)} strokes, medians of {RUNS}, processor time")
    print(f"opened and analysed   {1000 * alone:6.0f} ms   (reach 1000)")
    print(f"bootstrap intervals   {1000 * drawn:6.0f} ms   (both together: reach 5000)")
    ways = [one.method for row in carried.trials for one in (row.interval, row.opposite_interval) if one]
    print(f"predicted both ways   {1000 * solved:6.0f} ms   at small strain")
    print(f"intervals of the SEDs {1000 * spans:6.0f} ms   {len(ways)} of them, {ways.count('sampling')} by sampling")
    print(f"side by side          {1000 * alternatives:6.0f} ms   at small strain")


def _taken(work: Callable[[], object]) -> float:
    """Return the median processor time of some work [s]."""
    times: list[float] = []
    for _ in range(RUNS):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return median(times)


if __name__ == "__main__":
    main()
