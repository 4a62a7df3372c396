"""Whether error estimates are true of harder scenes: steep friction with a bound, stiff skin, endings like points.

Run from the root: python -m benchmarks.hard_estimates steep --scenes 20 (10 to 60 s a scene), stiff or point; `--small`
for small strain. `--keep FILE` appends what was solved to FILE; a run that finds a scene there solves it no more.

"steep": depth 0.01 to 2 mm, mu 1.2 to 1000, a bound of 0.002 to 0.02 MPa, all drawn evenly by their logarithms, both
directions, the published finger. "stiff": 1 to 2 mm, mu 0.1 to 0.5, both directions, angles 30 to 75; in every other
scene epidermis and dermis 8 to 100 times as stiff as fat, in the others Ogden's law in both with an exponent of 3 to
14. "point": scenes of `error_estimate` with an ending of 0.001 to 0.1 by 0.001 to 0.2 mm anywhere in the skin, at
finite strain with half their friction. Each is solved as users do, without a tolerance, at 1 % and at 0.3 %. The truth
is the mean of three or more fine meshes; a number is counted where none of them is further from their mean than a third
of what is tested.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import json
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import product
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.error_estimate import on_mesh, random_scene
from solver import (
    Finger,
    Friction,
    Loading,
    Material,
    Materials,
    NotConverged,
    Prediction,
    Receptor,
    Scene,
    Solve,
    SolveFailure,
    solve_many,
)
from solver.accuracy.adaptivity import MARGIN, sized
from solver.arrays import Array
from solver.mesh.mesher import Sizing
from solver.verification.methods import overkill

NAMES = ("SED of the ending", "normal force", "drag")
ASKED = (None, 0.01, 0.003)
FINEST = (30.0, 28.0, 26.0, 24.0)  # of truths at small strain, each also moved by half an element: some have no state
PLAIN, LINED = 17.0, (23.0, 26.0, 29.0)  # and at finite strain: the first without lines at the edges of contact
ENOUGH = 3  # of them
SMALL = 2e-4  # relative error below which nobody minds by how much an estimate is too large


def steep_scene(number: int) -> Scene:
    """Return the scene of this number whose coefficient of friction is large, and bounded."""
    draw = np.random.default_rng([number, 99])
    depth, mu, bound = (float(np.exp(draw.uniform(*np.log(ends)))) for ends in ((0.01, 2.0), (1.2, 1e3), (2e-3, 2e-2)))
    return Scene(friction=Friction(mu, bound), loading=Loading(depth, "+x" if draw.random() < 0.5 else "-x"))


def stiff_scene(number: int) -> Scene:
    """Return the scene of this number whose skin is stiff, or becomes it."""
    draw = np.random.default_rng([number, 98])
    fat = Materials().fat
    if number % 2:
        skin = [Material(fat.E * float(np.exp(draw.uniform(*np.log((8.0, 100.0))))), 0.48) for _ in range(2)]
    else:
        usual, exponent = Materials(), float(draw.uniform(3.0, 14.0))
        skin = [replace(one, law="ogden", stiffening=exponent) for one in (usual.epidermis, usual.dermis)]
    return Scene(
        finger=Finger(contact_angle=float(draw.uniform(30.0, 75.0))),
        materials=replace(Materials(), epidermis=skin[0], dermis=skin[1]),
        friction=Friction(float(draw.uniform(0.1, 0.5))),
        loading=Loading(float(draw.uniform(1.0, 2.0)), "+x" if draw.random() < 0.5 else "-x"),
        solve=Solve("finite"),
    )


def point_scene(number: int, kinematics: str) -> Scene:
    """Return the scene of this number whose ending is hardly more than a point."""
    draw = np.random.default_rng([number, 97])
    drawn = random_scene(number)
    across, along = (float(np.exp(draw.uniform(*np.log(ends)))) for ends in ((1e-3, 0.1), (1e-3, 0.2)))
    skin = drawn.finger.epidermis + drawn.finger.dermis
    depth = float(draw.uniform(0.6 * across, skin - 0.6 * across))
    friction = drawn.friction if kinematics == "small" else replace(drawn.friction, mu=drawn.friction.mu / 2.0)
    return replace(drawn, receptor=Receptor(depth, (across, along)), friction=friction)


FAMILIES = ("point", "steep", "stiff")


def drawn_scene(family: str, number: int, kinematics: str) -> Scene:
    """Return the scene of this number, always the same."""
    if family == "point":
        found = point_scene(number, kinematics)
    else:
        found = steep_scene(number) if family == "steep" else stiff_scene(number)
    return replace(found, solve=Solve(kinematics))


def _numbers(found: Prediction) -> list[list[float | None]]:
    off = found.error_estimate, found.normal_force_error, found.tangential_force_error
    return [[found.sed_ending, found.normal_force, abs(found.tangential_force)], list(off)]


def truths(scene: Scene) -> list[list[float]]:
    """Return the numbers (n, 3) on three or more meshes finer than an answer's. Raises SolveFailure."""
    if scene.solve.kinematics == "small":
        solves: list[list[float]] = []
        for fineness, moved in product(FINEST, (False, True)):
            with suppress(SolveFailure):
                solves.append(on_mesh(scene, fineness, moved))
        if len(solves) < ENOUGH:
            raise NotConverged("Fewer than three fine meshes have a state.")
        return np.abs(solves).tolist()
    over = overkill(scene, Sizing(PLAIN, scene.loading.depth, margin=MARGIN))
    found: list[Array] = []
    for fineness in LINED:
        over = overkill(scene, sized(fineness, over.at), over.at)
        found.append(np.abs(over.numbers))
    return np.array(found).tolist()


def measured(family: str, number: int, kinematics: str) -> dict[str, Any]:
    """Return what one scene gives, as plain data: answers with their estimates or reasons, and the truth or why not."""
    drawn = drawn_scene(family, number, kinematics)
    row: dict[str, Any] = {"scene": [family, number, kinematics], "answers": []}
    for tolerance in ASKED:
        begun = process_time()
        asked = replace(drawn, solve=replace(drawn.solve, tolerance=tolerance))
        answer = solve_many([asked])[0]
        told = _numbers(answer) if isinstance(answer, Prediction) else str(answer)
        row["answers"].append({"told": told, "seconds": process_time() - begun})
    try:
        row["truth"] = truths(drawn)
    except SolveFailure as failure:
        row["truth"] = str(failure)
    return row


def solved(family: str, first: int, scenes: int, kinematics: str, keep: Path | None) -> Iterator[dict[str, Any]]:
    """Yield what was found of all scenes, from the file where it has them."""
    kept: dict[tuple[str, int, str], dict[str, Any]] = {}
    if keep is not None and keep.exists():
        rows = map(json.loads, keep.read_text().splitlines())
        kept = {(one[0], one[1], one[2]): row for row in rows for one in [row["scene"]]}
    for number in range(first, first + scenes):
        row = kept.get((family, number, kinematics))
        if row is None:
            row = measured(family, number, kinematics)
            if keep is not None:
                with keep.open("a") as file:
                    print(json.dumps(row), file=file)
        yield row


def report(rows: list[dict[str, Any]]) -> None:
    """Print who is above, who is near, and what is worst."""
    for place, tolerance in enumerate(ASKED):
        found = [row["answers"][place] for row in rows]
        seconds = [one["seconds"] for one in found]
        told = [(row, one["told"]) for row, one in zip(rows, found, strict=True) if not isinstance(one["told"], str)]
        asked = "no tolerance" if tolerance is None else f"{100 * tolerance:g} %"
        print(f"{asked}: {len(told)} answers, {np.median(seconds):.2f} s in the median, {max(seconds):.1f} s at most")
        for number, name in enumerate(NAMES):
            above: list[bool] = []
            near: list[bool] = []
            worst = (0.0, 0.0, 0.0, 0)
            for row, (numbers, estimates) in told:
                if isinstance(row["truth"], str) or not numbers[number]:
                    continue
                truth = np.array(row["truth"])[:, number]
                doubt = float(np.abs(truth / truth.mean() - 1.0).max())
                error, estimate = abs(numbers[number] / float(truth.mean()) - 1.0), estimates[number]
                bound = 10.0 * max(error, SMALL)
                if doubt <= max(estimate, error) / 3.0:
                    above.append(estimate >= error)
                    worst = max(worst, (error / estimate, error, estimate, row["scene"][1]))
                if doubt <= bound / 3.0:
                    near.append(estimate < bound)
            shares = (f"{sum(kind)} of {len(kind)}" for kind in (above, near))
            ratio, error, estimate, scene = worst
            print(
                f"  {name}: above {next(shares)}, near {next(shares)}; worst {ratio:.2f}, "
                f"{100 * error:.2f} % estimated at {100 * estimate:.2f} % in scene {scene}"
            )


def main() -> None:
    """Solve and print."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("family", choices=FAMILIES)
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--small", action="store_true", help="small strain")
    parser.add_argument("--keep", type=Path, help="file of solved scenes")
    asked = parser.parse_args()
    if asked.small and asked.family == "stiff":
        parser.error("skin that stiffens is of finite strain")
    kinematics = "small" if asked.small else "finite"
    rows = list(solved(asked.family, asked.first, asked.scenes, kinematics, asked.keep))
    for row in rows:
        reasons = [one["told"] for one in row["answers"] if isinstance(one["told"], str)]
        if reasons:
            print(f"scene {row['scene'][1]}: {reasons[-1]}")
        elif isinstance(row["truth"], str):
            print(f"scene {row['scene'][1]} has answers and no truth: {row['truth']}")
    report(rows)


if __name__ == "__main__":
    main()
