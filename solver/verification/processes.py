"""Measurements in separate processes: the cold start of `daq-app solve`, and the memory of one solve."""

import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter

from solver.verification.methods import Kinematics
from solver.verification.request import LeftOut, Request
from solver.verification.truth import KINEMATICS

SCENE = """[friction]
mu = 0.24
tau_max = 0.00877
[loading]
indentation = 1.5
slide = "-x"
[solve]
kinematics = "{kinematics}"
"""
TOLERANCE = 0.0015  # of the solve whose memory is measured
_LONGEST = 60.0  # seconds after which a process is stopped
# Code of a separate process: idle memory is measured with loops loaded, then the peak is reset (Linux only).
MEMORY = """
import json
from dataclasses import replace
from solver.scene.published import SLIPPERINESS, scene
from solver.scene.tables import Solve
from solver.response.solution import solve
asked = scene(SLIPPERINESS[4])
solve(replace(asked, solve=Solve("{kinematics}", tolerance=0.05)))
def held(name):
    with open("/proc/self/status") as file:
        return next(float(line.split()[1]) * 1024 / 1e6 for line in file if line.startswith(name))
with open("/proc/self/clear_refs", "w") as file:
    file.write("5")
before = held("VmRSS")
found = solve(replace(asked, solve=Solve("{kinematics}", tolerance={tolerance})))
print(json.dumps([before, held("VmHWM") - before, found.dofs, found.error_estimate]))
"""


@dataclass(frozen=True, slots=True)
class Cold:
    """Medians of a process from start to end."""

    what: str
    runs: int
    took_s: float  # processor time where the system reports it, else elapsed time
    passed_s: float  # elapsed time, including other work of a busy machine


@dataclass(frozen=True, slots=True)
class Memory:
    """Memory of one solve above the idle process."""

    kinematics: Kinematics
    tolerance: float
    dofs: int
    error_estimate: float
    idle_mb: float
    solve_mb: float  # peak above idle


def measure(request: Request) -> Iterator[Cold | Memory | LeftOut]:
    """Yield cold starts and the memory of a solve in each kinematics."""
    with tempfile.TemporaryDirectory() as folder:
        for what, command in _commands(Path(folder), request.host.python):
            if request.seconds_left <= 0.0 and not what.startswith("daq-app"):
                yield LeftOut(f"Time was over before the cold start of {what}.")
                continue
            runs = 5 if not request.quick else 2 if what.startswith("daq-app") else 1
            try:
                took, wall_s = zip(*(_run(command) for _ in range(runs)), strict=True)
                yield Cold(what, runs, median(took), median(wall_s))
            except (subprocess.SubprocessError, OSError) as bad:
                yield LeftOut(f"The cold start of {what} could not be measured: {bad}.")
    for kinematics in KINEMATICS:
        left_out = LeftOut(f"Memory of a solve at {kinematics} strain is left to a full run.")
        yield left_out if request.quick else _memory(kinematics, request.host.python)


def _commands(folder: Path, python: tuple[str, ...]) -> list[tuple[str, list[str]]]:
    out: list[tuple[str, list[str]]] = [
        ("Python alone", [*python, "-c", "pass"]),
        ("Python and its arrays", [*python, "-c", "import numpy, scipy.linalg"]),
        ("the solver loaded", [*python, "-c", "import solver.response.solution"]),
    ]
    for kinematics in ("small", "finite"):
        scene = folder / f"{kinematics}.toml"
        scene.write_text(SCENE.format(kinematics=kinematics), encoding="utf-8")
        out.append((f"daq-app solve, {kinematics} strain", [*python, "-m", "daq_app", "solve", str(scene), "--json"]))
    return out


def _run(command: list[str]) -> tuple[float, float]:
    """Return processor and elapsed time of a process; elapsed time twice where the system reports no processor time."""
    start, before = perf_counter(), _of_children()
    subprocess.run(command, check=True, capture_output=True, timeout=_LONGEST)
    wall_s, spent = perf_counter() - start, _of_children() - before
    return (spent if spent > 0.0 else wall_s), wall_s


def _of_children() -> float:
    """Return the processor time of all child processes that have ended; 0 where the system does not report it."""
    times = os.times()
    return times.children_user + times.children_system


def _memory(kinematics: Kinematics, python: tuple[str, ...]) -> Memory | LeftOut:
    code = MEMORY.format(kinematics=kinematics, tolerance=TOLERANCE)
    try:
        process = subprocess.run([*python, "-c", code], check=True, capture_output=True, text=True, timeout=_LONGEST)
    except (subprocess.SubprocessError, OSError) as bad:
        return LeftOut(f"Memory of a solve at {kinematics} strain could not be measured here: {bad}.")
    idle, solving, dofs, estimate = json.loads(process.stdout)
    return Memory(kinematics, TOLERANCE, dofs, estimate, idle, solving)
