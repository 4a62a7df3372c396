"""What recording costs: an hour's worth of readings at 7000 Hz written, opened, read and sealed (or `--seconds N`).

Run: python -m benchmarks.recording
"""

import argparse
import resource
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from drivers.calibration import Calibration
from drivers.clock import SimulatedClock
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Frame, SessionPlan
from sessions.recording import Recording, SessionWriter, provenance
from sessions.recording.archive import problems, seal
from sessions.recording.schema import COLUMNS

RATE = 7000
BLOCK = 140  # readings handed over at once: 20 ms
INFO = TransducerInfo(
    "bench://", "bench", "bench", "0", True, RATE, RATE, Calibration("0", "counts", np.eye(6), np.ones(6), "none")
)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=3600)
    parser.add_argument("--folder", type=Path, help="where to write; a temporary folder when left out")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as room:
        measure(Path(room) / "session", options.seconds)


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Print how long something took, by the clock and by the processor: others may be using the machine."""
    began, worked = time.perf_counter(), time.process_time()
    yield
    print(f"{what}: {time.perf_counter() - began:.2f} s ({time.process_time() - worked:.2f} s of processor time)")


def memory() -> float:
    """Return the largest memory so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def measure(folder: Path, seconds: int) -> None:
    """Write, open, read and seal one recording."""
    clock = SimulatedClock()
    plan = SessionPlan("bench", "S00", 0, "none", (), True, Frame())
    writer = SessionWriter.create(folder, plan, INFO, provenance(clock), clock=clock)
    raw = np.round(np.random.default_rng(0).normal(0, 4000, (BLOCK, 6)))
    calls: list[float] = []
    worked = time.process_time()
    for first in range(0, seconds * RATE, BLOCK):
        i = np.arange(first, first + BLOCK)
        block = ReadingBlock(i, i, i * 0, i / RATE, np.full(BLOCK, clock.now_ns()), raw)
        clock.sleep(BLOCK / RATE)
        began = time.perf_counter()
        writer.readings(block)
        calls.append(time.perf_counter() - began)
        if first == 10 * RATE:
            early = memory()
    worked = time.process_time() - worked
    late = memory()
    began = time.perf_counter()
    event_times: list[float] = []
    for _ in range(50):
        began = time.perf_counter()
        writer.event("scored", data={"score": 1.0})
        event_times.append(time.perf_counter() - began)
    writer.event("ended", data={"reason": "the benchmark is over"})
    writer.close()
    print(
        f"writing: {100 * sum(calls) / seconds:.2f} % of real time by the clock, {100 * worked / seconds:.2f} % by the"
        f" processor, the making of the readings included; longest call {1e3 * max(calls):.0f} ms"
    )
    print(f"memory of the writer: {early:.0f} MB after 10 s, {late:.0f} MB after {seconds} s")
    print(
        f"an event made safe: median {1e3 * statistics.median(event_times):.1f} ms,"
        f" most {1e3 * max(event_times):.0f} ms"
    )
    print(f"file: {(folder / 'session.sqlite').stat().st_size / 1e6:.0f} MB")
    with timed("opening"):
        recording = Recording.open(folder)
    before = memory()
    with timed("reading it whole"):
        block = recording.readings()
    size = sum(getattr(block, name).nbytes for name in COLUMNS) / 1e6
    print(f"{len(block)} readings, {size:.0f} MB; memory grew by {memory() - before:.0f} MB")
    del block
    with timed("sealing"):
        seal(folder)
    with timed("checking"):
        damage = problems(folder)
    print(f"{len(damage)} problems; largest memory: {memory():.0f} MB")


if __name__ == "__main__":
    main()
