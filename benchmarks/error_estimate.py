"""Whether the error estimates are true: estimate against true error, on random scenes, for every mesh and tolerance.

Run from the root: python -m benchmarks.error_estimate --scenes 170 --jobs 2 (about 6 s a scene and job). `--keep FILE`
appends what was solved to FILE, and a run that finds a scene there does not solve it again: estimates can be compared
without solving.

A scene is drawn from its number: indentation 0.5 to 2 mm, mu 0 to 0.7, contact angle 30 to 75 degrees, the stiffness of
each tissue within 30 % of the published one, both directions; every other scene with a bound of 0.003 to 0.06 MPa on
its traction. The truth is the mean of three solves on overkill meshes whose nodes lie elsewhere. A scene is counted
only where none of the three is further from their mean than a third of what is tested.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import json
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from solver.estimate import FINENESS, coarsest_for, estimates
from solver.finger import FingerModel
from solver.mesher import Sizing
from solver.scene import Finger, Friction, Loading, Material, Materials, Scene
from solver.small_states import numbers_on, settled
from solver.wedging import WIDE

NAMES = ("SED of the ending", "normal force", "drag")
OVERKILL = ((26.0, False), (26.0, True), (23.0, False))  # fineness, and whether moved by half an element
CHECKED = FINENESS["small"][:6]  # finer ones are too near the overkill
MESHES = sorted({(float(n), False) for n in CHECKED} | {(n / 2.0, True) for n in CHECKED})
TOLERANCES = (0.01, 0.003, 0.001)
SMALL = 2e-4  # relative error below which nobody minds by how much an estimate is too large


def random_scene(number: int) -> Scene:
    """Return the scene of this number, always the same."""
    rng = np.random.default_rng([2026, number])
    base = Materials()
    softer = rng.uniform(0.7, 1.3, 3)
    tissues = (base.epidermis, base.dermis, base.fat)
    depth, mu, angle = rng.uniform(0.5, 2.0), rng.uniform(0.0, 0.7), rng.uniform(30.0, 75.0)
    slide = "+x" if rng.random() < 0.5 else "-x"
    bound = float(np.exp(rng.uniform(np.log(0.003), np.log(0.06)))) if number % 2 else None
    return Scene(
        finger=Finger(contact_angle=float(angle)),
        materials=Materials(*(Material(t.E * float(s), t.nu) for t, s in zip(tissues, softer, strict=True))),
        friction=Friction(float(mu), bound),
        loading=Loading(float(depth), slide),
    )


def on_mesh(scene: Scene, fineness: float, shift: bool) -> list[float]:
    """Return the three numbers on one mesh."""
    depth = scene.loading.indentation
    for margin in (1.0, 4.0, WIDE):
        finger = FingerModel.of(scene, Sizing(fineness, depth, shift, margin))
        contact = settled(scene, finger)
        if not finger.reaches_out(contact, finger.displacement(contact), depth):
            break
    return numbers_on(finger, [contact])[0].tolist()


def measured(number: int) -> dict[str, Any]:
    """Return what one scene gives on all meshes, as plain data."""
    scene = random_scene(number)
    found = {_key(*mesh): on_mesh(scene, *mesh) for mesh in MESHES}
    return {"number": number, "meshes": found, "truth": [on_mesh(scene, *mesh) for mesh in OVERKILL]}


def _key(fineness: float, shift: bool) -> str:
    return f"{fineness:g} {int(shift)}"


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One scene solved."""

    scene: Scene
    meshes: dict[str, list[float]]
    truth: np.ndarray  # (3,)
    doubt: np.ndarray  # (3,) how far the overkill solves lie from it, relative

    @staticmethod
    def of(row: dict[str, Any]) -> "Case":
        """Return the case that `measured` found."""
        solves = np.abs(row["truth"])
        truth = solves.mean(axis=0)
        return Case(random_scene(row["number"]), row["meshes"], truth, np.abs(solves / truth - 1.0).max(axis=0))

    def on(self, fineness: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the estimates and the true errors (3,), relative, of the solver's answer on a mesh."""
        own = np.abs(self.meshes[_key(fineness, False)])
        other = np.abs(self.meshes[_key(fineness / 2.0, True)])
        return estimates(self.scene, fineness, own, other[None]), np.abs(own / self.truth - 1.0)

    def asked(self, tolerance: float) -> float:
        """Return the mesh that the solver ends on when asked for this tolerance."""
        finer = [n for n in CHECKED if n >= coarsest_for(self.scene, tolerance)]
        return next((n for n in finer if self.on(n)[0][0] <= tolerance), finer[-1])


def solved(scenes: int, first: int, jobs: int, keep: Path | None) -> Iterator[Case]:
    """Yield all cases, from the file where it has them."""
    kept: dict[int, dict[str, Any]] = {}
    if keep is not None and keep.exists():
        kept = {row["number"]: row for row in map(json.loads, keep.read_text().splitlines())}
    numbers = range(first, first + scenes)
    yield from (Case.of(kept[n]) for n in numbers if n in kept)
    with ProcessPoolExecutor(jobs) as pool:
        for row in pool.map(measured, [n for n in numbers if n not in kept]):
            if keep is not None:
                with keep.open("a") as file:
                    print(json.dumps(row), file=file)
            yield Case.of(row)


def shares(cases: list[Case], fineness: float, number: int) -> tuple[int, float, float, list[float]]:
    """Return how many scenes were counted, the share of estimates above the error and below the bound, and errors."""
    above: list[bool] = []
    below: list[bool] = []
    errors: list[float] = []
    for case in cases:
        estimate, error = (float(x[number]) for x in case.on(fineness))
        bound = 10.0 * max(error, SMALL)
        errors.append(error)
        if case.doubt[number] <= estimate / 3.0:
            above.append(estimate >= error)
        if case.doubt[number] <= bound / 3.0:
            below.append(estimate < bound)
    return len(above), float(np.mean(above)), float(np.mean(below)), errors


def report(cases: list[Case]) -> None:
    """Print the tables."""
    for number, name in enumerate(NAMES):
        print(
            f"{name}\nfineness  counted  estimate above error %  below 10 x max(error, 0.02 %) %  error %: median, most"
        )
        for fineness in CHECKED:
            counted, above, below, errors = shares(cases, fineness, number)
            ends = f"{100 * np.median(errors):15.3f} {100 * max(errors):9.3f}"
            print(f"{fineness:8g} {counted:8d} {100 * above:23.1f} {100 * below:31.1f} {ends}")
    print("tolerance %  counted  true error below %  estimate below %  meshes taken")
    for tolerance in TOLERANCES:
        meshes = [case.asked(tolerance) for case in cases]
        found = [case.on(mesh) for case, mesh in zip(cases, meshes, strict=True)]
        sound = [case.doubt[0] <= tolerance / 3.0 for case in cases]
        met = np.mean([error[0] <= tolerance for (_, error), good in zip(found, sound, strict=True) if good])
        told = np.mean([estimate[0] <= tolerance for estimate, _ in found])
        taken = ", ".join(f"{n:g}: {count}" for n, count in sorted(Counter(meshes).items()))
        print(f"{100 * tolerance:11g} {sum(sound):8d} {100 * met:19.1f} {100 * told:17.1f}  {taken}")


def main() -> None:
    """Solve and print."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=170)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="file of solved scenes")
    asked = parser.parse_args()
    report(list(solved(asked.scenes, asked.first, asked.jobs, asked.keep)))


if __name__ == "__main__":
    main()
