"""How many times faster than real time a session of 200 readings a second is replayed, the solver left out.

Run from the repository's root: python -m benchmarks.replay [SESSION]; without one a simulated one is recorded first.
"""

import tempfile
import time
from pathlib import Path
from statistics import median

from benchmarks.given_session import given_session
from sessions.recording import Recording
from sessions.run.replay import different_events, different_readings, replay
from sessions.strokes import analyse

RUNS = 7


def main() -> None:
    """Print the medians."""
    with tempfile.TemporaryDirectory() as room:
        recording = Recording.open(given_session(Path(room)))
        lasted = (recording.events[-1].time_ns - recording.events[0].time_ns) * 1e-9
        replayed: list[float] = []
        compared: list[float] = []
        for number in range(RUNS):
            began = time.perf_counter()
            again = replay(recording, Path(room) / f"replay-{number}", None, lambda *_: None)
            replayed.append(time.perf_counter() - began)
            differences = [*different_readings(recording, again), *different_events(recording, again)]
            analyse(again)
            compared.append(time.perf_counter() - began)
    print(f"session of {lasted:.1f} s, {recording.events[-1].readings} readings")
    print(f"replayed in {median(replayed):.3f} s: {lasted / median(replayed):.0f} times real time (median of {RUNS})")
    print(f"compared and analysed too: {median(compared):.3f} s, {lasted / median(compared):.0f} times real time")
    print(f"differences: {len(differences)}")


if __name__ == "__main__":
    main()
