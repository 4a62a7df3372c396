"""What the recorder's process costs, and how old a reading is when the client has it: at 200 and 7000 Hz, in a session.

The simulated box runs in this process, so that the recorder's own cost is seen. Run: python -m benchmarks.recorder
"""

import argparse
import statistics
import tempfile
import time
from pathlib import Path

from daq_app.recorder import messages as m
from daq_app.recorder.client import Recorder
from drivers.clock import RealClock
from sessions.plan.protocols import plan, protocol
from sessions.run.runner import Status
from simulators.bench import Bench
from simulators.net_ft_box import NetFtBox

PLAN = plan(protocol("sensotact-friction"), "S01", 1)
STOPS = 5


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="listened at each rate")
    seconds = parser.parse_args().seconds
    for rate in (200, 7000):
        box = NetFtBox(Bench(1), RealClock(), rate=rate)
        box.start()
        with tempfile.TemporaryDirectory() as room:
            measure(box.uri, rate, seconds, Path(room))
        box.close()


def measure(uri: str, rate: int, seconds: float, room: Path) -> None:
    """Run sessions at one rate, and print what they cost."""
    began = time.perf_counter()
    with Recorder.start() as recorder:
        recorder.send(m.Connect(uri))
        until(recorder, m.Device)
        print(f"{rate} Hz: connected {time.perf_counter() - began:.2f} s after the start of the process")
        stops: list[float] = []
        for number in range(STOPS):
            recorder.send(m.StartSession(PLAN, str(room / str(number))))
            until(recorder, m.SessionBegun)
            if number == 0:
                listen(recorder, seconds)
            stop_time = time.perf_counter()
            recorder.send(m.Stop())
            until(recorder, m.SessionEnded)
            stops.append(time.perf_counter() - stop_time)
        print(f"{rate} Hz: from a stop to the written end, median of {STOPS}: {statistics.median(stops) * 1e3:.0f} ms")


def listen(recorder: Recorder, seconds: float) -> None:
    """Take what a session shows, and print how old and how much it is."""
    ages: list[float] = []
    lags: list[float] = []
    readings = left_out = 0
    worked, began = processor_time(recorder.pid), time.perf_counter()
    while time.perf_counter() - began < seconds:
        for report in recorder.poll(0.005):
            if isinstance(report, m.Live):
                ages.append((time.monotonic_ns() - int(report.received_ns[-1])) * 1e-6)
                readings, left_out = readings + len(report.sequence), left_out + report.left_out
            elif isinstance(report, Status):
                lags.append(report.lag_ms)
    passed = time.perf_counter() - began
    share = (processor_time(recorder.pid) - worked) / passed
    ages.sort()
    late = ages[len(ages) * 99 // 100]
    print(f"  {readings / passed:.0f} readings a second in {len(ages) / passed:.0f} messages, {left_out} left out")
    print(f"  newest reading at the client: median {statistics.median(ages):.1f} ms old, 99 % within {late:.1f} ms")
    print(f"  newest reading at the recorder: median {statistics.median(lags):.2f} ms old")
    print(f"  processor: {100 * share:.0f} % of one core")


def until(recorder: Recorder, kind: type[m.Report]) -> None:
    """Wait for a report of a kind."""
    while not any(isinstance(report, kind) for report in recorder.poll(0.01)):
        pass


def processor_time(pid: int) -> float:
    """Return the processor time a process has used [s]; Linux tells it in hundredths."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100.0


if __name__ == "__main__":
    main()
