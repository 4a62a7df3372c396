"""How a study's time falls with processes: the same simulated session many times over, on one and on two.

Run it on an idle machine: python -m benchmarks.study [SESSIONS]. Every copy has a name of its own, so none is taken
from what was computed before. Prints wall time of each, their ratio, and what 1,000 sessions would take.
"""

import shutil
import sys
import tempfile
import time
from pathlib import Path

from daq_app.console import Console
from daq_app.pooling import Shelf, visits
from daq_app.synthetic import synthetic_study
from sessions.pooling.visit import VisitOptions

OPTIONS = VisitOptions()


def timed(folders: list[Path], shelf: Path, workers: int) -> float:
    """Return the wall time [s] of computing all sessions."""
    begun = time.perf_counter()
    done, failed = visits(folders, OPTIONS, Shelf(shelf, OPTIONS), Console(as_json=True), workers=workers)
    assert len(done) == len(folders), failed
    return time.perf_counter() - begun


def main(count: int) -> None:
    """Make the sessions, time them, print."""
    with tempfile.TemporaryDirectory() as room:
        base = Path(room)
        synthetic_study(base / "one", 1, Console(as_json=True), subjects=1)
        folders = [base / f"copy{i:04d}" for i in range(count)]
        for folder in folders:
            shutil.copytree(base / "one" / "S01", folder)
        one = timed(folders, base / "shelf-one", 1)
        two = timed(folders, base / "shelf-two", 2)
        print(f"{count} sessions: {one:.1f} s with one process, {two:.1f} s with two: {one / two:.2f} times as fast")
        print(f"1,000 sessions would take {1000 * two / count / 60:.1f} min with two")
        again = timed(folders, base / "shelf-two", 2)
        print(f"once computed: {again:.2f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
