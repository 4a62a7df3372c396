"""How long the small-strain solver takes and how true it is on the ten published surfaces.

Run from the root: python -m benchmarks.solver. Prints medians over repeated runs on one thread, and the ratio to the
floor, which is one assembly and elimination of the same mesh in the same run. Mesh and tables stand apart, as set-up.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

from dataclasses import replace
from statistics import median
from time import perf_counter

from solver.contact import Contact, Course, untouched
from solver.finger import FingerModel
from solver.friction import FrictionLaw
from solver.mesher import Sizing
from solver.reference import scenes
from solver.scene import Scene, Solve
from solver.solution import DEFAULT, FINENESS, solve, solve_together

REPEATS = 9
# sed_ending [MPa], good to 0.1 %: mean of two independent codes on the same scenes
TRUTH = {
    "stickiness 0": 0.008566,
    "stickiness 50": 0.008811,
    "stickiness 100": 0.009553,
    "slipperiness 0": 0.0053575,
    "slipperiness 55": 0.00525,
    "slipperiness 100": 0.005185,
}


def history_row(asked: Scene, fineness: float) -> str:
    """Return what a course of 200 substeps costs beside the direct state, assembly and elimination included in both."""
    finger = FingerModel.of(asked, Sizing(fineness, 2.0, margin=3.0))
    touch, loading = finger.body.touchable, asked.loading
    law = FrictionLaw(float(asked.friction.mu), asked.friction.cap)
    depth, direction = loading.depth, loading.direction

    def course() -> Contact:
        steps, now = Course(touch, law), untouched(touch)
        for step in range(1, 41):
            now = steps.step(now, depth * step / 40, 0.0)
        for step in range(1, 161):
            now = steps.step(now, depth, direction * 8.0 * step / 160)
        return now

    spans: list[list[float]] = [[], []]
    for _ in range(REPEATS):
        for span, work in zip(spans, (lambda: Course(touch, law).sliding(depth, direction), course), strict=True):
            begun = perf_counter()
            work()
            span.append(1e3 * (perf_counter() - begun + finger.solve_s))
    found = [
        finger.sed_ending(finger.displacement(c)) for c in (Course(touch, law).sliding(depth, direction), course())
    ]
    direct, marched = map(median, spans)
    return (
        f"{asked.title:17} {marched:6.1f} ms, {marched / direct:4.1f} times the direct solve of {direct:.1f} ms, "
        f"SED differs by {found[1] / found[0] - 1.0:.0e}"
    )


def main() -> None:
    """Print the tables."""
    ten = scenes()
    marched = [replace(s, solve=Solve(course="history")) for s in ten]
    floor = median(FingerModel.of(ten[0], Sizing(DEFAULT, 2.0)).solve_s for _ in range(REPEATS))
    print(f"floor: one assembly and elimination {1e3 * floor:.1f} ms")
    for name, asked in (("ten steady", ten), ("ten with their course", marched)):
        took = []
        for _ in range(REPEATS):
            begun = perf_counter()
            found = solve_together(asked)
            took.append(perf_counter() - begun)
        solving = sum(p.wall_s for p in found)
        print(
            f"{name}: {1e3 * median(took):.0f} ms in all; "
            f"solving {1e3 * solving:.0f} ms ({solving / floor:.1f} floors), "
            f"set-up {1e3 * found[0].setup_s:.0f} ms, error estimates {1e3 * sum(p.estimate_s for p in found):.0f} ms"
        )
    print("tolerance   dofs   worst error %   worst estimate %   ms a surface, set-up and estimate included")
    for tolerance in (0.01, 0.003, 0.001):
        asked = [replace(s, solve=Solve(tolerance=tolerance)) for s in ten]
        begun = perf_counter()
        found = solve_together(asked)
        took_ms = 1e3 * (perf_counter() - begun) / len(asked)
        errors = [abs(p.sed_ending / TRUTH[p.scene.title] - 1.0) for p in found if p.scene.title in TRUTH]
        estimate = max(p.error_estimate for p in found)
        print(f"{tolerance:9g} {found[0].dofs:6d} {100 * max(errors):15.3f} {100 * estimate:18.3f} {took_ms:16.1f}")
    print(f"meshes that can be asked for: {FINENESS}; without a tolerance: {DEFAULT}")
    print("history of 200 substeps:")
    for asked in ten[::3]:
        print(f"  {history_row(asked, 6.0)}")
    begun = perf_counter()
    solve(ten[0])
    print(f"one surface alone: {1e3 * (perf_counter() - begun):.0f} ms")


if __name__ == "__main__":
    main()
