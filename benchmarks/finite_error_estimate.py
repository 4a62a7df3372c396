"""Whether the error estimates at finite strain are true: estimate against true error, on random scenes.

Run from the root: python -m benchmarks.finite_error_estimate --scenes 60 (about 10 s a scene). `--keep FILE` appends
what was solved to FILE, and a run that finds a scene there does not solve it again.

A scene is drawn from its number: indentation 0.5 to 2 mm, mu 0 to 0.7, contact angle 30 to 75 degrees, the stiffness of
each tissue within 30 % of the published one, both directions; half of them with a bound of 0.005 to 0.05 MPa, which
acts in few. With `--bounded` mu is 0.15 at least and the bound 0.003 to 0.012 MPa; with `--fingers` outline and
receptor are drawn too, and the indentation grows with the tip (`other_finger`). The truth is the mean of three
solves on overkill meshes whose nodes lie elsewhere, their numbers carried on to elements of no length where the cut
meets the bone; one of them has no lines at the edges of contact, but with `--bounded`, where such a mesh is not good
enough. A scene is counted only where none of the three is further from their mean than a third of what is tested.
Scenes without a settled state are left out and counted, and so are those whose elements at the cut cannot be shortened.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import json
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.error_estimate import of_answers, other_finger, shares
from solver import Finger, Friction, Loading, Material, Materials, Scene, Solve, SolveFailure
from solver.accuracy.adaptivity import MARGIN, nested_solution, sized
from solver.accuracy.error_estimate import FINENESS, coarsest_for, estimates
from solver.accuracy.finite_errors import compared
from solver.mesh.mesher import AT_CUT, Sizing
from solver.verification.methods import overkill

NAMES = ("SED of the ending", "normal force", "drag")
MESHES = FINENESS["finite"][:4]
OVERKILL = (23.0, 26.0, 29.0)  # finenesses of the meshes with lines at the edges of contact, the last where bounded
PLAIN = 17.0  # and of that without
TOLERANCES = (0.01, 0.003, 0.001)


def random_scene(number: int, *, bounded: bool = False, fingers: bool = False) -> Scene:
    """Return the scene of this number, always the same."""
    scene = _of_published_finger(number, bounded=bounded)
    return other_finger(number, scene) if fingers else scene


def _of_published_finger(number: int, *, bounded: bool) -> Scene:
    draw = np.random.default_rng([number, 28])
    usual = Materials()
    tissues = {
        name: Material(getattr(usual, name).E * draw.uniform(0.7, 1.3), 0.48) for name in ("epidermis", "dermis", "fat")
    }
    found = Scene(
        finger=Finger(contact_angle=draw.uniform(30.0, 75.0)),
        materials=replace(usual, **tissues),
        friction=Friction(draw.uniform(0.0, 0.7), None if draw.random() < 0.5 else draw.uniform(0.005, 0.05)),
        loading=Loading(draw.uniform(0.5, 2.0), "+x" if draw.random() < 0.5 else "-x", 20.0),
        solve=Solve("finite"),
    )
    bound = float(np.exp(draw.uniform(np.log(0.003), np.log(0.012))))
    return replace(found, friction=Friction(max(found.friction.mu, 0.15), bound)) if bounded else found


def going_on() -> bool:
    """Return that nobody asked to stop."""
    return False


def measured(number: int, **drawn: bool) -> dict[str, Any]:
    """Return what one scene gives on all meshes, as plain data; nothing but how it was drawn where it has no state."""
    scene, bounded = random_scene(number, **drawn), drawn["bounded"]
    try:
        depth = scene.loading.depth
        over = overkill(scene, Sizing(PLAIN, depth, margin=MARGIN))
        solves = [] if bounded else [over]
        for fineness in OVERKILL if bounded else OVERKILL[:2]:
            over = overkill(scene, sized(fineness, over.at), over.at)
            solves.append(over)
        meshes: dict[str, list[Any]] = {}
        for fineness in MESHES:
            way_up = nested_solution(scene, depth, fineness, going_on)
            found = compared(scene, fineness, way_up, way_up.top.finger.all_numbers(way_up.top.shape), going_on)
            meshes[f"{fineness:g}"] = [numbers[..., :3].tolist() for numbers in found[:3]]
    except SolveFailure:
        return {"number": number, **drawn}
    truth = [over.numbers.tolist() for over in solves]
    at_cut = [over.at_cut for over in solves]
    return {"number": number, **drawn, "meshes": meshes, "truth": truth, "at_cut": at_cut}


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One scene solved."""

    scene: Scene
    meshes: dict[str, list[Any]]  # by fineness: numbers of the answer and of the other meshes, and `felt`
    truth: np.ndarray  # (3,)
    doubt: np.ndarray  # (3,) how far the overkill solves lie from it, relative

    @staticmethod
    def of(row: dict[str, Any]) -> "Case":
        """Return the case that `measured` found."""
        solves = np.array(row["truth"])
        truth = solves.mean(axis=0)
        scene = random_scene(row["number"], bounded=row["bounded"], fingers=row["fingers"])
        return Case(scene, row["meshes"], truth, np.abs(solves / truth - 1.0).max(axis=0))

    def on(self, fineness: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the estimates and the true errors (3,), relative, of the solver's answer on a mesh."""
        own, others, felt = (np.array(found) for found in self.meshes[f"{fineness:g}"])
        return estimates(self.scene, fineness, own, others, felt), np.abs(own / self.truth - 1.0)

    def asked(self, tolerance: float) -> float:
        """Return the mesh that the solver ends on when asked for this tolerance."""
        return next(
            (n for n in MESHES if n >= coarsest_for(self.scene, tolerance) and self.on(n)[0][0] <= tolerance),
            MESHES[-1],
        )


def solved(scenes: int, first: int, keep: Path | None, **drawn: bool) -> Iterator[dict[str, Any]]:
    """Yield what was found of all scenes, from the file where it has them."""
    kept: dict[tuple[int, ...], dict[str, Any]] = {}
    if keep is not None and keep.exists():
        rows = map(json.loads, keep.read_text().splitlines())
        kept = {(row["number"], *(row[name] for name in drawn)): row for row in rows}
    for number in range(first, first + scenes):
        row = kept.get((number, *drawn.values()))
        if row is None:
            row = measured(number, **drawn)
            if keep is not None:
                with keep.open("a") as file:
                    print(json.dumps(row), file=file)
        yield row


def report(cases: list[Case]) -> None:
    """Print the tables."""
    for number, name in enumerate(NAMES):
        print(
            f"{name}\nfineness  counted  estimate above error %  below 10 x max(error, 0.02 %) %  error %: median, most"
        )
        for fineness in MESHES:
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
        good = [case.doubt[0] <= tolerance / 3.0 for case in cases]
        met = np.mean([error[0] <= tolerance for (_, error), sure in zip(found, good, strict=True) if sure])
        told = np.mean([estimate[0] <= tolerance for estimate, _ in found])
        taken = ", ".join(f"{n:g}: {count}" for n, count in sorted(Counter(meshes).items()))
        taken += f"; {of_answers(found, doubts)}"
        print(f"{100 * tolerance:11g} {sum(good):8d} {100 * met:19.1f} {100 * told:17.1f}  {taken}")


def main() -> None:
    """Solve and print."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--keep", type=Path, help="file of solved scenes")
    parser.add_argument("--bounded", action="store_true", help="scenes whose traction bound acts")
    parser.add_argument("--fingers", action="store_true", help="other fingers than the published one")
    asked = parser.parse_args()
    rows = list(solved(asked.scenes, asked.first, asked.keep, bounded=asked.bounded, fingers=asked.fingers))
    there = [row for row in rows if "truth" in row]
    every = [Case.of(row) for row in there]
    cases = [
        case
        for case, row in zip(every, there, strict=True)
        if case.scene.loading.direction < 0 or max(row["at_cut"]) < AT_CUT
    ]
    print(f"{len(rows)} scenes, {len(rows) - len(there)} without a settled state, {len(there) - len(cases)} not known")
    report(cases)


if __name__ == "__main__":
    main()
