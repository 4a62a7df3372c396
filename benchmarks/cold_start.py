"""How long `daq-app solve` takes as a process of its own, compiled code cached: medians over fresh processes.

Run it alone: python -m benchmarks.cold_start. Processor time stands beside: a busy machine changes it less. Python's
own compiled code is kept in a folder of its own, so that what else is set on this machine does not matter.
"""

import os
import subprocess
import sys
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

REPEATS = 15
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
    with TemporaryDirectory() as folder:
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        kept["PYTHONPYCACHEPREFIX"] = folder
        for kinematics in ("small", "finite"):
            scene = Path(folder) / f"{kinematics}.toml"
            scene.write_text(SCENE.format(kinematics), encoding="utf-8")
            call = [sys.executable, "-m", "daq_app", "solve", str(scene)]
            wall: list[float] = []
            processor: list[float] = []
            for _ in range(REPEATS + 1):  # the first may compile
                begin, before = perf_counter(), spent()
                subprocess.run(call, check=True, capture_output=True, env=kept)
                wall.append(perf_counter() - begin)
                processor.append(spent() - before)
            print(f"{kinematics:6}: {median(wall[1:]):.2f} s, of which {median(processor[1:]):.2f} s on the processor")


if __name__ == "__main__":
    main()
