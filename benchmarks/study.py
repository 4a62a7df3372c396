"""How a study's time falls with processes: the same simulated session many times over, on one process and on two.

Run it on an idle machine: python -m benchmarks.study [SESSIONS] [small|finite]. Every copy has a name of its own, so
none is taken from what was computed before. Both ways take turns, so that whatever else the machine does falls on both
alike. Prints wall times, their ratio, processor time, and what 1,000 would take.
"""

import argparse
import os
import resource
import shutil
import tempfile
import time
from pathlib import Path
from statistics import median

from daq_app.batch.pool import Shelf, visits
from daq_app.console import Console
from daq_app.simulation.synthetic import synthetic_study
from sessions.statistics.visit import VisitOptions

REPEATS = 2


def measure(folders: list[Path], shelf: Path, options: VisitOptions, workers: int) -> tuple[float, float]:
    """Return the wall time and the workers' processor time [s] of computing all sessions."""
    processor_s, start = _children(), time.perf_counter()
    results, failures = visits(folders, options, Shelf(shelf, options), Console(as_json=True), workers=workers)
    assert len(results) == len(folders), failures
    return time.perf_counter() - start, _children() - processor_s


def _children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def main(count: int, options: VisitOptions) -> None:
    """Make the sessions, time them, and print the results."""
    with tempfile.TemporaryDirectory() as room:
        base = Path(room)
        synthetic_study(base / "one", 1, Console(as_json=True), subjects=1)
        folders = [base / f"copy{i:04d}" for i in range(count)]
        for folder in folders:
            shutil.copytree(base / "one" / "S01", folder)
        wall: dict[int, list[float]] = {1: [], 2: []}
        work: dict[int, list[float]] = {1: [], 2: []}
        for repeat in range(REPEATS):
            for workers in (1, 2):
                wall_s, work_s = measure(folders, base / f"shelf-{workers}-{repeat}", options, workers)
                wall[workers].append(wall_s)
                work[workers].append(work_s / count)
        one_s, two_s = (median(wall[workers]) for workers in (1, 2))
        processor = [median(work[workers]) for workers in (1, 2)]
        print(f"load average at the end: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        print(f"{count} sessions: {one_s:.1f} s with one process, {two_s:.1f} s with two, ", end="")
        print(f"{one_s / two_s:.2f} times as fast")
        print(f"processor time a session: {processor[0]:.2f} s with one process, {processor[1]:.2f} s with two")
        print(f"1,000 sessions with two: {1000 * two_s / count / 60:.1f} min here, ", end="")
        print(f"{1000 * processor[1] / 2 / 60:.1f} min where nothing else runs")
        print(f"once computed: {measure(folders, base / 'shelf-2-0', options, 2)[0]:.2f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sessions", nargs="?", type=int, default=100)
    parser.add_argument("paths", nargs="?", choices=("none", "small", "finite"), default="none", help="many paths too")
    arguments = parser.parse_args()
    main(arguments.sessions, VisitOptions(paths=arguments.paths))
