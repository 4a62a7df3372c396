"""What recording costs: an hour's worth of readings at 7000 Hz written, opened, read and sealed (or `--seconds N`).

Run: python -m benchmarks.recording. With --process instead what the recorder's process costs in a session, and how old
a reading is when the client has it, at 200 and 7000 Hz. The simulated box runs in this process then.
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
import psutil

from daq_app.recorder import messages as m
from daq_app.recorder.client import Recorder
from drivers.calibration import Calibration
from drivers.clock import RealClock, SimulatedClock
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Frame, SessionPlan
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Recording, SessionWriter, provenance
from sessions.recording.archive import problems, seal
from sessions.recording.schema import COLUMNS
from sessions.run.runner import Status
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox

RATE = 7000
PLAN = plan(protocol("sensotact-friction"), "S01", 1)
STOPS = 5
BLOCK = 140  # readings per call: 20 ms
INFO = TransducerInfo(
    "bench://", "bench", "bench", "0", True, RATE, RATE, Calibration("0", "counts", np.eye(6), np.ones(6), "none")
)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, help="of readings (3600), or listened at each rate (10)")
    parser.add_argument("--folder", type=Path, help="where to write; a temporary folder when left out")
    parser.add_argument("--process", action="store_true", help="the recorder's process")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as room:
        if not options.process:
            measure_writer(Path(room) / "session", options.seconds or 3600)
            return
        for rate in (200, RATE):
            box = NetFtBox(Bench(1), RealClock(), rate=rate)
            box.start()
            measure_process(box.uri, rate, options.seconds or 10, Path(room))
            box.close()


@contextmanager
def print_time(task: str) -> Iterator[None]:
    """Print the elapsed time and the processor time of a block; other work affects only the first."""
    start, cpu = time.perf_counter(), time.process_time()
    yield
    print(f"{task}: {time.perf_counter() - start:.2f} s ({time.process_time() - cpu:.2f} s of processor time)")


def memory() -> float:
    """Return the peak memory so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def measure_writer(folder: Path, seconds: int) -> None:
    """Write, open, read and seal one recording."""
    clock = SimulatedClock()
    writer = SessionWriter.create(
        folder, SessionPlan("bench", "S00", 0, "none", (), True, Frame()), INFO, provenance(clock), clock=clock
    )
    raw = np.round(np.random.default_rng(0).normal(0, 4000, (BLOCK, 6)))
    calls: list[float] = []
    early_s = min(10, seconds // 2)
    cpu_s = time.process_time()
    for first in range(0, seconds * RATE, BLOCK):
        i = np.arange(first, first + BLOCK)
        block = ReadingBlock(i, i, i * 0, i / RATE, np.full(BLOCK, clock.now_ns()), raw)
        clock.sleep(BLOCK / RATE)
        start = time.perf_counter()
        writer.readings(block)
        calls.append(time.perf_counter() - start)
        if first == early_s * RATE:
            early = memory()
    cpu_s = time.process_time() - cpu_s
    late = memory()
    event_times: list[float] = []
    for _ in range(50):
        start = time.perf_counter()
        writer.event("scored", data={"score": 1.0})
        event_times.append(time.perf_counter() - start)
    writer.event("ended", data={"reason": "the benchmark is over"})
    writer.close()
    print(
        f"writing: {100 * sum(calls) / seconds:.2f} % of real time by the clock, {100 * cpu_s / seconds:.2f} % by the"
        f" processor, the making of the readings included; longest call {1e3 * max(calls):.0f} ms"
    )
    print(f"memory of the writer: {early:.0f} MB after {early_s} s, {late:.0f} MB after {seconds} s")
    print(
        f"an event made safe: median {1e3 * statistics.median(event_times):.1f} ms,"
        f" most {1e3 * max(event_times):.0f} ms"
    )
    print(f"file: {(folder / 'session.sqlite').stat().st_size / 1e6:.0f} MB")
    with print_time("opening"):
        recording = Recording.open(folder)
    memory_before = memory()
    with print_time("reading it whole"):
        block = recording.readings()
    size = sum(getattr(block, name).nbytes for name in COLUMNS) / 1e6
    print(f"{len(block)} readings, {size:.0f} MB; memory grew by {memory() - memory_before:.0f} MB")
    del block
    with print_time("sealing"):
        seal(folder)
    with print_time("checking"):
        damage = problems(folder)
    print(f"{len(damage)} problems; largest memory: {memory():.0f} MB")


def measure_process(uri: str, rate: int, seconds: int, room: Path) -> None:
    """Run sessions at one rate, and print their cost."""
    start = time.perf_counter()
    with Recorder.start() as recorder:
        recorder.send(m.Connect(uri))
        until(recorder, m.Device)
        print(f"{rate} Hz: connected {time.perf_counter() - start:.2f} s after the start of the process")
        stops: list[float] = []
        for number in range(STOPS):
            recorder.send(m.StartSession(PLAN, str(room / f"{rate}-{number}")))
            until(recorder, m.SessionBegun)
            if number == 0:
                listen(recorder, seconds)
            stop_time = time.perf_counter()
            recorder.send(m.Stop())
            until(recorder, m.SessionEnded)
            stops.append(time.perf_counter() - stop_time)
        print(f"{rate} Hz: from a stop to the written end, median of {STOPS}: {statistics.median(stops) * 1e3:.0f} ms")


def listen(recorder: Recorder, seconds: int) -> None:
    """Receive the live reports of a session, and print their age and amount."""
    ages: list[float] = []
    lags: list[float] = []
    readings = left_out = 0
    process = psutil.Process(recorder.pid)
    cpu_s, start = sum(process.cpu_times()[:2]), time.perf_counter()
    while time.perf_counter() - start < seconds:
        for report in recorder.poll(0.005):
            if isinstance(report, m.Live):
                ages.append((time.monotonic_ns() - int(report.received_ns[-1])) * 1e-6)
                readings, left_out = readings + len(report.sequence), left_out + report.left_out
            elif isinstance(report, Status):
                lags.append(report.lag_ms)
    wall_s = time.perf_counter() - start
    share = (sum(process.cpu_times()[:2]) - cpu_s) / wall_s
    ages.sort()
    late = ages[len(ages) * 99 // 100]
    print(f"  {readings / wall_s:.0f} readings a second in {len(ages) / wall_s:.0f} messages, {left_out} left out")
    print(f"  newest reading at the client: median {statistics.median(ages):.1f} ms old, 99 % within {late:.1f} ms")
    print(f"  newest reading at the recorder: median {statistics.median(lags):.2f} ms old")
    print(f"  processor: {100 * share:.0f} % of one core")


def until(recorder: Recorder, report_type: type[m.Report]) -> None:
    """Wait for a report of a kind. Raises RuntimeError where the request failed."""
    while True:
        for report in recorder.poll(0.01):
            if isinstance(report, report_type):
                return
            if isinstance(report, m.Failed):
                raise RuntimeError(report.sentence)


if __name__ == "__main__":
    main()
