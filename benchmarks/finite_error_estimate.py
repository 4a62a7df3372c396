"""How often the error estimate at finite strain lies above the true error, on seeded random scenes.

Run: python -m benchmarks.finite_error_estimate [SCENES] (from the root). Truth is the mean of two meshes of fineness
28, one moved by half an element; a scene counts where they agree to a third of its estimate. Scenes without a settled
state, or squeezed so near their limit that a coarser mesh has none, are left out and counted.
"""

import sys
from dataclasses import replace

import numpy as np

from solver.failures import SolveFailure
from solver.finite_solution import MARGIN, FiniteFinger, answers
from solver.mesher import Sizing
from solver.scene import Finger, Friction, Loading, Material, Materials, Scene, Solve

FINENESS = (8, 12, 16)
TRUTH = 28


def random_scene(seed: int) -> Scene:
    """Return a scene of depth 0.5 to 2, mu 0 to 0.7, angle 30 to 75, stiffnesses ±30 %, half of them with a bound."""
    draw = np.random.default_rng([seed, 28])
    usual = Materials()
    tissues = {
        name: Material(getattr(usual, name).E * draw.uniform(0.7, 1.3), 0.48) for name in ("epidermis", "dermis", "fat")
    }
    return Scene(
        finger=Finger(contact_angle=draw.uniform(30.0, 75.0)),
        materials=replace(usual, **tissues),
        friction=Friction(draw.uniform(0.0, 0.7), None if draw.random() < 0.5 else draw.uniform(0.005, 0.05)),
        loading=Loading(draw.uniform(0.5, 2.0), "+x" if draw.random() < 0.5 else "-x", 20.0),
        solve=Solve("finite"),
    )


def main(count: int) -> None:
    """Compare estimate and truth on `count` scenes and print how they lie."""
    rows: dict[int, list[tuple[float, float]]] = {fineness: [] for fineness in FINENESS}
    refused = unsure = 0
    for seed in range(count):
        scene = random_scene(seed)
        depth = scene.loading.indentation
        try:
            fingers = [FiniteFinger.of(scene, Sizing(TRUTH, depth, shift, margin=MARGIN)) for shift in (False, True)]
            seds = [finger.sed_ending(finger.settled(scene, lambda: False)) for finger in fingers]
        except SolveFailure:
            refused += 1
            continue
        truth = float(np.mean(seds))
        for fineness in FINENESS:
            (found,) = answers([scene], fineness)
            if isinstance(found, SolveFailure) or found.error_estimate >= 1.0:
                unsure += 1
            elif abs(seds[0] - seds[1]) / truth < found.error_estimate / 3.0:
                rows[fineness].append((found.error_estimate, abs(found.sed_ending / truth - 1.0)))
            else:
                unsure += 1
    print(f"{count} scenes, {refused} without a settled state, {unsure} comparisons left out")
    for fineness, pairs in rows.items():
        estimate, error = np.array(pairs).T
        above, tight = np.mean(estimate >= error), np.mean(estimate < 10.0 * np.maximum(error, 2e-4))
        print(
            f"fineness {fineness}: {len(pairs)} scenes, above the true error in {100 * above:.0f} %, "
            f"below ten times it in {100 * tight:.0f} %, true error median {100 * np.median(error):.2f} %, "
            f"worst {100 * error.max():.2f} %"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
