"""Whether the error estimates are true: estimate against true error, on random scenes, for every mesh and tolerance.

Run from the root: python -m benchmarks.error_estimate --scenes 170 --jobs 2 (about 6 s a scene and job). `--keep FILE`
appends what was solved to FILE, and a run that finds a scene there does not solve it again: estimates can be compared
without solving.

A scene is drawn from its number: indentation 0.5 to 2 mm, mu 0 to 0.7, contact angle 30 to 75 degrees, the stiffness of
each tissue within 30 % of the published one, both directions; every other scene with a bound of 0.003 to 0.06 MPa on
its traction. With `--fingers` outline and receptor are drawn too (`other_finger`). The truth is the mean of three
solves on overkill meshes whose nodes lie elsewhere. A scene is counted only where none of the three is further from
their mean than a third of what is tested; one without a settled state is left out.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import json
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from solver import Finger, Friction, Loading, Material, Materials, Receptor, Scene, SceneError, SolveFailure
from solver.accuracy.error_estimate import FINENESS, coarsest_for, estimates
from solver.continuation.small_states import numbers_on, settled
from solver.continuation.wedging import WIDE
from solver.equilibrium.finger import FingerModel
from solver.mesh.mesher import Sizing

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


def other_finger(number: int, scene: Scene) -> Scene:
    """Return the scene with a finger that is not the published one, always the same for this number.

    In every other scene each length of it is within 30 % of the published one, in the others tip radius (3.5 to 8 mm),
    epidermis (0.3 to 1.2), dermis (0.5 to 1.8) and bone radius (0.8 to 2) are drawn freely. Indentation and bone grow
    with the tip. Outlines that are none are drawn again.
    """
    draw = np.random.default_rng([2027, number])
    usual = Finger()
    while True:
        part = draw.uniform(0.7, 1.3, 7)
        names = ("tip_radius", "epidermis", "dermis", "shaft_length", "bone_radius")
        lengths = {name: float(getattr(usual, name) * p) for name, p in zip(names, part, strict=False)}
        if number % 4 > 1:
            wide = {"tip_radius": (3.5, 8.0), "epidermis": (0.3, 1.2), "dermis": (0.5, 1.8), "bone_radius": (0.8, 2.0)}
            lengths |= {name: float(draw.uniform(*span)) for name, span in wide.items()}
        grown = lengths["tip_radius"] / usual.tip_radius
        x, y = usual.bone_centre
        centre = (float(x * part[5]) * grown, float(y * part[6]) * grown)
        skin = lengths["epidermis"] + lengths["dermis"]
        try:
            return replace(
                scene,
                finger=Finger(contact_angle=scene.finger.contact_angle, bone_centre=centre, **lengths),
                receptor=Receptor(float(draw.uniform(0.5, 0.9)) * skin, (0.1 * skin, float(draw.uniform(0.5, 2.0)))),
                loading=replace(scene.loading, indentation=scene.loading.depth * grown),
            )
        except SceneError:
            continue


def on_mesh(scene: Scene, fineness: float, shift: bool) -> list[float]:
    """Return the three numbers on one mesh."""
    depth = scene.loading.indentation
    for margin in (1.0, 4.0, WIDE):
        finger = FingerModel.of(scene, Sizing(fineness, depth, shift, margin))
        contact = settled(scene, finger)
        if not finger.reaches_out(contact, finger.displacement(contact), depth):
            break
    return numbers_on(finger, [contact])[0].tolist()


def measured(drawn: tuple[int, bool]) -> dict[str, Any]:
    """Return what one scene gives on all meshes, as plain data; its number alone where it has no state."""
    number, fingers = drawn
    scene = _scene(number, fingers=fingers)
    try:
        found = {_key(*mesh): on_mesh(scene, *mesh) for mesh in MESHES}
        truth = [on_mesh(scene, *mesh) for mesh in OVERKILL]
    except SolveFailure:
        return {"number": number, "fingers": fingers}
    return {"number": number, "fingers": fingers, "meshes": found, "truth": truth}


def _scene(number: int, *, fingers: bool) -> Scene:
    return other_finger(number, random_scene(number)) if fingers else random_scene(number)


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
        scene = _scene(row["number"], fingers=row["fingers"])
        return Case(scene, row["meshes"], truth, np.abs(solves / truth - 1.0).max(axis=0))

    def on(self, fineness: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the estimates and the true errors (3,), relative, of the solver's answer on a mesh."""
        own = np.abs(self.meshes[_key(fineness, False)])
        other = np.abs(self.meshes[_key(fineness / 2.0, True)])
        return estimates(self.scene, fineness, own, other[None]), np.abs(own / self.truth - 1.0)

    def asked(self, tolerance: float) -> float:
        """Return the mesh that the solver ends on when asked for this tolerance."""
        finer = [n for n in CHECKED if n >= coarsest_for(self.scene, tolerance)] or [CHECKED[-1]]
        return next((n for n in finer if self.on(n)[0][0] <= tolerance), finer[-1])


def solved(scenes: int, first: int, jobs: int, keep: Path | None, *, fingers: bool) -> Iterator[Case]:
    """Yield all cases that have a state, from the file where it has them."""
    kept: dict[tuple[int, bool], dict[str, Any]] = {}
    if keep is not None and keep.exists():
        kept = {(row["number"], row["fingers"]): row for row in map(json.loads, keep.read_text().splitlines())}
    drawn = [(number, fingers) for number in range(first, first + scenes)]
    yield from (Case.of(kept[one]) for one in drawn if "truth" in kept.get(one, {}))
    with ProcessPoolExecutor(jobs) as pool:
        for row in pool.map(measured, [one for one in drawn if one not in kept]):
            if keep is not None:
                with keep.open("a") as file:
                    print(json.dumps(row), file=file)
            if "truth" in row:
                yield Case.of(row)


def shares(estimates: np.ndarray, errors: np.ndarray, doubts: np.ndarray) -> tuple[int, float, float]:
    """Return of how many scenes (n,) an estimate counts, and which shares are above the error and below the bound."""
    bounds = 10.0 * np.maximum(errors, SMALL)
    known, sure = doubts <= estimates / 3.0, doubts <= bounds / 3.0
    return int(known.sum()), float(np.mean((estimates >= errors)[known])), float(np.mean((estimates < bounds)[sure]))


def of_answers(found: list[tuple[np.ndarray, np.ndarray]], doubts: np.ndarray) -> str:
    """Return the shares, in per cent, of all three numbers of answers: `found` is what `Case.on` says of each scene."""
    told = np.array(found)
    parts = [shares(told[:, 0, number], told[:, 1, number], doubts[:, number])[1:] for number in range(len(NAMES))]
    return ", ".join(f"{100 * above:.0f} {100 * near:.0f}" for above, near in parts)


def report(cases: list[Case]) -> None:
    """Print the tables."""
    for number, name in enumerate(NAMES):
        print(
            f"{name}\nfineness  counted  estimate above error %  below 10 x max(error, 0.02 %) %  error %: median, most"
        )
        for fineness in CHECKED:
            told = np.array([case.on(fineness) for case in cases])[:, :, number]
            errors = told[:, 1]
            counted, above, below = shares(told[:, 0], errors, np.array([case.doubt[number] for case in cases]))
            ends = f"{100 * np.median(errors):15.3f} {100 * errors.max():9.3f}"
            print(f"{fineness:8g} {counted:8d} {100 * above:23.1f} {100 * below:31.1f} {ends}")
    print("tolerance %  counted  true error below %  estimate below %  meshes taken; above, near of SED, forces %")
    for tolerance in TOLERANCES:
        meshes = [case.asked(tolerance) for case in cases]
        found = [case.on(mesh) for case, mesh in zip(cases, meshes, strict=True)]
        doubts = np.array([case.doubt for case in cases])
        sound = [case.doubt[0] <= tolerance / 3.0 for case in cases]
        met = np.mean([error[0] <= tolerance for (_, error), good in zip(found, sound, strict=True) if good])
        told = np.mean([estimate[0] <= tolerance for estimate, _ in found])
        taken = ", ".join(f"{n:g}: {count}" for n, count in sorted(Counter(meshes).items()))
        taken += f"; {of_answers(found, doubts)}"
        print(f"{100 * tolerance:11g} {sum(sound):8d} {100 * met:19.1f} {100 * told:17.1f}  {taken}")


def main() -> None:
    """Solve and print."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=170)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="file of solved scenes")
    parser.add_argument("--fingers", action="store_true", help="other fingers than the published one")
    asked = parser.parse_args()
    report(list(solved(asked.scenes, asked.first, asked.jobs, asked.keep, fingers=asked.fingers)))


if __name__ == "__main__":
    main()
