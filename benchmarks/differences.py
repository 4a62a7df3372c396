"""Whether differences between surfaces solved together are true to 5 % of their range, on random sets of three.

Run from the root: python -m benchmarks.differences --sets 40 --kinematics small (about 8 s a set, 20 s at finite
strain). `--keep FILE` appends what was solved to FILE, and a run that finds a set there does not solve it again.

A set is drawn from its number: one finger (contact angle 30 to 75 degrees, the stiffness of each tissue within 30 % of
the published one), one indentation of 0.5 to 2 mm and one direction; three surfaces of mu 0.05 to 0.7 (finite strain:
0.6), in every other set within 0.06 of the first; each with even odds of a bound of 0.004 to 0.05 MPa. The error of a
set is that of the worst difference between two of its surfaces, by the range of all three. The truth is the mean of
three solves on overkill meshes whose nodes lie elsewhere; a number is counted only where none of the three puts a
difference further from their mean than a third of 5 % of the range. Sets without settled states are left out.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import json
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any, Literal

import numpy as np

from solver import Finger, Friction, Loading, Material, Materials, Scene, Solve, SolveFailure, solve_many
from solver.accuracy.adaptivity import nested_solution
from solver.accuracy.contrasts import told
from solver.continuation.small_states import numbers_on, settled
from solver.continuation.wedging import WIDE
from solver.equilibrium.finger import FingerModel
from solver.mesh.mesher import Sizing

NAMES = ("SED", "normal force", "drag")
TOLERANCES = (None, 0.01, 0.003)
OVERKILL = ((34.0, False), (34.0, True), (31.0, False))  # small strain: fineness, and whether moved by half an element
CLIMBED = (27.0, 30.0, 33.0)  # finite strain
ASKED = 0.05  # of the range
CLOSE = 0.06  # of every other set, the coefficients


def random_set(number: int, kinematics: Literal["small", "finite"]) -> list[Scene]:
    """Return the three surfaces of this number, always the same."""
    draw = np.random.default_rng([number, 71 if kinematics == "small" else 72])
    usual = Materials()
    tissues = [Material(getattr(usual, n).E * draw.uniform(0.7, 1.3), 0.48) for n in ("epidermis", "dermis", "fat")]
    most = 0.7 if kinematics == "small" else 0.6
    first = draw.uniform(0.05, most)
    if number % 2:
        others = [float(np.clip(first + draw.uniform(-CLOSE, CLOSE), 0.02, most)) for _ in range(2)]
        mus = [first, *others]
    else:
        mus = draw.uniform(0.05, most, 3).tolist()
    bounds = [None if draw.random() < 0.5 else float(np.exp(draw.uniform(*np.log([0.004, 0.05])))) for _ in range(3)]
    base = Scene(
        finger=Finger(contact_angle=draw.uniform(30.0, 75.0)),
        materials=Materials(*tissues),
        friction=Friction(0.0),
        loading=Loading(draw.uniform(0.5, 2.0), "+x" if draw.random() < 0.5 else "-x"),
        solve=Solve(kinematics),
    )
    return [replace(base, friction=Friction(float(mu), bound)) for mu, bound in zip(mus, bounds, strict=True)]


def on_mesh(scenes: Sequence[Scene], fineness: float, shift: bool) -> list[list[float]]:
    """Return the numbers (3, 3) of the surfaces on one mesh at small strain."""
    depth = scenes[0].loading.depth
    for margin in (1.0, 4.0, WIDE):
        finger = FingerModel.of(scenes[0], Sizing(fineness, depth, shift, margin))
        contacts = [settled(scene, finger) for scene in scenes]
        if not any(finger.reaches_out(contact, finger.displacement(contact), depth) for contact in contacts):
            break
    return np.abs(numbers_on(finger, contacts)).tolist()


def solution_on(scenes: Sequence[Scene], fineness: float) -> list[list[float]]:
    """Return the same at finite strain, each surface on a mesh of its own."""
    tops = [nested_solution(scene, scene.loading.depth, fineness, lambda: False).top for scene in scenes]
    return [np.abs(top.finger.numbers(top.shape)).tolist() for top in tops]


def measured(number: int, kinematics: Literal["small", "finite"]) -> dict[str, Any]:
    """Return what one set gives, as plain data; nothing but its number where a surface has no state."""
    scenes = random_set(number, kinematics)
    answers: dict[str, Any] = {}
    try:
        for tolerance in TOLERANCES:
            asked = [replace(s, solve=replace(s.solve, tolerance=tolerance, evidence="estimated")) for s in scenes]
            begun = process_time()
            found = solve_many(asked)
            answers[str(tolerance)] = {
                "numbers": [told(one)[:3] for one in found],
                "warned": any("Differences" in warning for warning in found[0].warnings),
                "unknowns": found[0].dofs,
                "took_s": process_time() - begun,
            }
        if kinematics == "small":
            truth = [on_mesh(scenes, *mesh) for mesh in OVERKILL]
        else:
            truth = [solution_on(scenes, fineness) for fineness in CLIMBED]
    except SolveFailure:
        return {"number": number, "kinematics": kinematics}
    return {"number": number, "kinematics": kinematics, "answers": answers, "truth": truth}


def report(rows: Sequence[dict[str, Any]]) -> None:
    """Print the table."""
    print(f"{len(rows)} sets")
    for tolerance in map(str, TOLERANCES):
        worst: list[np.ndarray] = []
        silent: list[str] = []
        for row in rows:
            solves, found = np.array(row["truth"]), row["answers"][tolerance]
            truth = solves.mean(axis=0)
            span = np.ptp(truth, axis=0)
            known = np.ptp(solves - truth, axis=1).max(axis=0) <= ASKED / 3.0 * span
            error = np.where(known, np.ptp(np.array(found["numbers"]) - truth, axis=0) / span, np.nan)
            worst.append(error)
            if (np.nan_to_num(error) > ASKED).any() and not found["warned"]:
                silent.append(f"{row['number']}: {100 * np.nanmax(error):.1f} %")
        errors = np.array(worst)
        answers = [row["answers"][tolerance] for row in rows]
        print(f"tolerance {tolerance}: {sum(a['warned'] for a in answers)} warned of, {len(silent)} not, but above 5 %")
        for name, column in zip(NAMES, errors.T, strict=True):
            counted = column[np.isfinite(column)]
            above = int((counted > ASKED).sum())
            print(f"    {name}: {above} of {len(counted)} above 5 %, worst {100 * counted.max():.1f} %")
        print(f"    above and not warned of: {', '.join(silent) or 'none'}")
        print(f"    unknowns {dict(sorted(Counter(a['unknowns'] for a in answers).items()))}")
        took = [a["took_s"] for a in answers]
        print(f"    median {np.median(took):.2f} s, most {max(took):.2f} s")


def main() -> None:
    """Solve and print."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--kinematics", choices=("small", "finite"), default="small")
    parser.add_argument("--keep", type=Path, help="file of solved sets")
    asked = parser.parse_args()
    kept: dict[tuple[int, str], dict[str, Any]] = {}
    if asked.keep is not None and asked.keep.exists():
        rows = map(json.loads, asked.keep.read_text().splitlines())
        kept = {(row["number"], row["kinematics"]): row for row in rows}
    found: list[dict[str, Any]] = []
    for number in range(asked.first, asked.first + asked.sets):
        row = kept.get((number, asked.kinematics)) or measured(number, asked.kinematics)
        if asked.keep is not None and (number, asked.kinematics) not in kept:
            with asked.keep.open("a") as file:
                print(json.dumps(row), file=file)
        found.append(row)
    report([row for row in found if "truth" in row])


if __name__ == "__main__":
    main()
