"""How long `daq-app solve` takes as a process of its own, compiled code cached: medians over fresh processes.

Run it alone: python -m benchmarks.cold_start. Processor time stands beside: a busy machine changes it less.
"""

import os
import subprocess
import sys
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median
from tempfile import NamedTemporaryFile
from time import perf_counter

REPEATS = 9
SCENE = """title = "slipperiness 100"
[friction]
mu = 0.24
tau_max = 0.00877
[loading]
indentation = 1.5
slide = "-x"
[solve]
kinematics = "{}"
"""


def spent() -> float:
    """Return the processor time of all processes that were started and have ended [s]."""
    used = getrusage(RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Print both kinematics."""
    for kinematics in ("small", "finite"):
        with NamedTemporaryFile("w", suffix=".toml") as file:
            file.write(SCENE.format(kinematics))
            file.flush()
            call = [sys.executable, "-m", "daq_app", "solve", file.name]
            wall: list[float] = []
            processor: list[float] = []
            for _ in range(REPEATS + 1):  # the first may compile
                begin, before = perf_counter(), spent()
                subprocess.run(call, check=True, capture_output=True, env=os.environ)
                wall.append(perf_counter() - begin)
                processor.append(spent() - before)
        print(f"{kinematics:6}: {median(wall[1:]):.2f} s, of which {median(processor[1:]):.2f} s on the processor")


if __name__ == "__main__":
    main()
