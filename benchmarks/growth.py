"""How time and memory of one linear system grow with the unknowns, to 100,000, at both kinematics.

Run it single-threaded: OPENBLAS_NUM_THREADS=1 python -m benchmarks.growth
Times are processor time of the one thread: of one assembly, elimination and solve (`finite`), and of one assembly and
elimination down to the skin's compliance (`small`); new memory is given before. Memory is the peak above what the
process held before its first solve on that mesh: mesh, plan and tables included. Exponents are those of lines through
the logarithms.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import subprocess
import sys
from resource import RUSAGE_SELF, getrusage
from statistics import median
from time import thread_time

import numpy as np

from solver.body.linear import LinearBody
from solver.constitutive.linear import Hooke
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.full_slip import settled
from solver.equilibrium.newton import Pull
from solver.mesh.mesher import Sizing
from solver.scene.published import SLIPPERINESS, scene

FINENESS = (3, 5, 7, 10, 14, 18, 26, 34, 46)
SCENE = scene(SLIPPERINESS[4])
PULL = Pull(1.5, 0.24, 0.00877, 1)  # slipperiness 100


def peak() -> float:
    """Return the most memory this process has held [MB]."""
    return getrusage(RUSAGE_SELF).ru_maxrss / 1024.0


def finite(fineness: float, repeats: int = 9) -> tuple[int, float, float]:
    """Return the unknowns, the time of one linear system [ms] and the memory of a solve [MB] at finite strain."""
    settled(FiniteFinger.of(SCENE, Sizing(5.0, 2.0, margin=3.0)).newton, PULL, tolerance=1e-5)  # compiles
    before = peak()
    newton = FiniteFinger.of(SCENE, Sizing(fineness, 2.0, margin=3.0)).newton
    shape = settled(newton, PULL, tolerance=1e-5)
    held = peak() - before
    spans: list[float] = []
    for _ in range(repeats):
        begin = thread_time()
        newton.linearise(shape, PULL, newton.skin_x)
        newton.moved(shape, PULL, newton.steps[:, 0], newton.skin_x)
        spans.append(1e3 * (thread_time() - begin))
    return newton.body.dofs, median(spans), held


def small(fineness: float, repeats: int = 5) -> tuple[int, float, float]:
    """Return the unknowns, the time of assembly and elimination [ms] and the memory [MB] at small strain."""
    FingerModel.of(SCENE, Sizing(5.0, 2.0))
    before = peak()
    models = [FingerModel.of(SCENE, Sizing(fineness, 2.0))]
    held = peak() - before
    mesh = models[0].geometry.mesh
    tissues = (SCENE.materials.epidermis, SCENE.materials.dermis, SCENE.materials.fat)
    materials = [Hooke(t.E, t.nu) for t in tissues]
    spans: list[float] = []
    for _ in range(repeats):
        begin = thread_time()
        LinearBody.of(mesh, materials)
        spans.append(thread_time() - begin)
    return models[0].body.dofs, 1e3 * median(spans), held


def main() -> None:
    """Print the tables; each mesh is measured in a process of its own, so that memory is its alone."""
    if len(sys.argv) > 1:
        kind, fineness = sys.argv[1], float(sys.argv[2])
        print(*(finite if kind == "finite" else small)(fineness))
        return
    for kind in ("small", "finite"):
        print(f"{kind} strain\n  dofs       ms       MB")
        rows: list[tuple[float, float]] = []
        for fineness in FINENESS:
            call = [sys.executable, "-m", "benchmarks.growth", kind, str(fineness)]
            out = subprocess.run(call, capture_output=True, text=True, check=True).stdout
            dofs, ms, held = map(float, out.split())
            rows.append((dofs, ms))
            print(f"{dofs:6.0f} {ms:8.2f} {held:8.1f}", flush=True)
        size, span = np.log(np.array(rows)).T
        powers = np.diff(span) / np.diff(size)
        whole, upper = np.polyfit(size, span, 1)[0], np.polyfit(size[4:], span[4:], 1)[0]
        print(f"exponent {whole:.2f}; upper half {upper:.2f}; mesh to mesh {powers.min():.2f} to {powers.max():.2f}")


if __name__ == "__main__":
    main()
