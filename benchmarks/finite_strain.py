"""How long the finite-strain solver takes and how true it is: medians, and the ratio to one assembly and solve.

Run it single-threaded: OPENBLAS_NUM_THREADS=1 python -m benchmarks.finite_strain
Times are processor time of the one thread: on an idle machine that is the time it takes, on a busy one it still is.
"""

from collections.abc import Callable
from itertools import pairwise
from statistics import median
from time import perf_counter, thread_time

import numpy as np

from solver.failures import NotConverged
from solver.finite_body import FiniteBody, FiniteProbes
from solver.hyperelastic import NeoHooke
from solver.march import march, press_and_slide
from solver.materials import Hooke
from solver.mesher import Sizing, finger_mesh
from solver.newton import Newton, Pull, Shape
from solver.receptor import endings
from solver.scene import Finger, Materials, Receptor
from solver.sliding import settled
from solver.stiffness import Elastic

# ending-averaged SED [MPa] of two independent codes, which agree to 0.05-0.22 %
REFERENCE = {
    "slip 100": (Pull(1.5, 0.24, 0.00877, 1), 3.9081e-3),
    "slip 55": (Pull(1.5, 0.44, 0.03009, 1), 2.5631e-3),
    "slip 0": (Pull(1.5, 0.62, 0.04707, 1), 1.9115e-3),
    "stick 0": (Pull(2.0, 0.28, 0.008033, -1), 9.656e-3),
}
TOLERANCE = 1e-5  # of displacements [mm]: errors of the SED below 1e-6
TISSUES = Materials()
MODULI = [(tissue.E, tissue.nu) for tissue in (TISSUES.epidermis, TISSUES.dermis, TISSUES.fat)]


class Meshed:
    """One mesh of the published finger."""

    def __init__(self, fineness: float) -> None:
        """Mesh and prepare it."""
        begin = perf_counter()
        self.finger = finger_mesh(Finger(), Receptor(), Sizing(fineness, 2.0, margin=3.0))
        self.body = FiniteBody.of(self.finger.mesh, [NeoHooke(*moduli) for moduli in MODULI])
        elastic = Elastic.of(self.finger.mesh, [Hooke(*moduli) for moduli in MODULI])
        self.probes = FiniteProbes.of(self.body, endings(self.finger, elastic, Receptor(), np.zeros(1)))
        self.newton = Newton(self.body)
        self.setup = perf_counter() - begin

    def sed(self, shape: Shape) -> float:
        """Return the ending-averaged SED [MPa]."""
        return float(self.probes.average(self.body, shape.u)[0])


def timed(work: Callable[[], object], repeats: int = 5) -> float:
    """Return the median time of `work()` in ms."""
    spans: list[float] = []
    for _ in range(repeats):
        begin = thread_time()
        work()
        spans.append(thread_time() - begin)
    return 1e3 * median(spans)


def sliding_row(level: Meshed) -> str:
    """Return the figures of settled sliding on one mesh."""
    direct: list[float] = []
    onward: list[float] = []
    error: list[float] = []
    failed: list[str] = []
    for name, (pull, expected) in REFERENCE.items():
        try:
            error.append(abs(level.sed(settled(level.newton, pull, tolerance=1e-6)) / expected - 1.0))
            direct.append(timed(lambda p=pull: settled(level.newton, p, tolerance=TOLERANCE)))
        except NotConverged:
            failed.append(name)
    neighbours = [REFERENCE[name][0] for name in ("slip 100", "slip 55", "slip 0")]
    for one, other in pairwise(neighbours):
        spans: list[float] = []
        for _ in range(5):
            start = settled(level.newton, one, tolerance=TOLERANCE)  # leaves its tangent behind
            begin = thread_time()
            settled(level.newton, other, start, TOLERANCE)
            spans.append(1e3 * (thread_time() - begin))
        onward.append(median(spans))
    shape = settled(level.newton, neighbours[0])
    floor = timed(lambda: level.newton.linearise(shape, shape.pull, level.newton.skin_x))
    return (
        f"{level.body.dofs:6} {floor:6.2f} {median(direct):11.1f} ({median(direct) / floor:4.1f}) "
        f"{median(onward):11.1f} ({median(onward) / floor:4.1f}) "
        f"{max(error):12.2%} {1e3 * level.setup:8.0f} {' '.join(failed)}"
    )


def history_row(level: Meshed, pull: Pull) -> str:
    """Return the figures of a course of 200 substeps beside those of the direct state."""
    course = press_and_slide(pull.depth, pull.mu, pull.tau, -pull.sense, press=40, slides=160, distance=8.0)
    direct = timed(lambda: settled(level.newton, pull))
    begin = thread_time()
    *_, last = march(level.newton, course)
    span = 1e3 * (thread_time() - begin)
    difference = level.sed(last) / level.sed(settled(level.newton, pull)) - 1.0
    return f"{span:6.0f} ms, {span / direct:4.0f} times the direct solve, SED differs by {difference:.0e}"


def main() -> None:
    """Print the tables."""
    levels = {fineness: Meshed(fineness) for fineness in (5, 8, 12, 16, 24, 32)}
    settled(levels[5].newton, REFERENCE["slip 100"][0])  # compiles
    print("times in ms, ratio to one assembly, factorisation and solve (floor); error: worst of slip 0-100 and stick 0")
    print("  dofs  floor   undeformed         next surface           error     mesh  not found directly")
    for level in levels.values():
        print(sliding_row(level))
    print("history of 200 substeps:")
    for name, (pull, _) in REFERENCE.items():
        print(f"  {name:9} {history_row(levels[5], pull)}")


if __name__ == "__main__":
    main()
