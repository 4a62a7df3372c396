"""Three hundred seeded scenes of every kind, and their outcomes, for comparing two states of the solver.

    python -m tests.solver.scene_set record FILE      # solve all of them and write their numbers
    python -m tests.solver.scene_set compare FILE     # solve them again and list what differs

Two exact solvers of one scene agree to the solver's tolerance, so a difference above it is a finding.
"""

import json
import math
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

SEED = 1118
AGREEMENT = 1e-8  # relative difference of two exact solutions [-]
NEAR_LIMIT = 1e-6  # the same where numbers grow without bound [-]
ABSOLUTE = 1e-13  # below which a number is round-off, in its own unit
SKIPPED = ("wall_s", "setup_s", "estimate_s", "evidence_s", "newton_iterations")


def scenes():
    """Return the scenes by name, always the same."""
    from solver.scene.published import SLIPPERINESS, STICKINESS, scene

    scenes_by_name = {}
    for kinematics in ("small", "finite"):
        for surface in STICKINESS + SLIPPERINESS:
            published = scene(surface)
            name = f"{kinematics} published {surface.descriptor} {surface.index}"
            scenes_by_name[name] = replace(published, solve=replace(published.solve, kinematics=kinematics))
    kinds = {
        "depth": (60, 60), "tolerance": (15, 15), "force": (18, 18), "drag": (10, 10), "press": (6, 6),
        "history": (6, 4), "reversal": (4, 2), "relaxing": (5, 2), "steep": (8, 8), "finger": (10, 8), "light": (3, 2),
    }  # fmt: skip
    for kind, counts in kinds.items():
        for kinematics, count in zip(("small", "finite"), counts, strict=True):
            for number in range(count):
                scenes_by_name[f"{kinematics} {kind} {number}"] = _random_scene(kind, kinematics, number)
    return scenes_by_name


def _random_scene(kind, kinematics, number):
    from solver import Finger, Friction, Loading, Material, Materials, Receptor, Relaxation, Scene, Solve

    rng = np.random.default_rng([SEED, sum(map(ord, kind + kinematics)), number])
    factors = rng.uniform(0.7, 1.3, 3).tolist()
    moduli = [E * s for E, s in zip((0.136, 0.08, 0.034), factors, strict=True)]
    nu = float(rng.choice([0.4, 0.48, 0.48, 0.48, 0.495]))
    depth, mu, angle = float(rng.uniform(0.4, 2.0)), float(rng.uniform(0.05, 0.7)), float(rng.uniform(30.0, 75.0))
    slide = "+x" if rng.random() < 0.5 else "-x"
    bound = math.exp(rng.uniform(math.log(0.003), math.log(0.06))) if number % 2 else None
    finger, solve, law, prony = Finger(contact_angle=angle), Solve(kinematics, evidence="quick"), None, ()
    loading, receptor = Loading(depth, slide), Receptor()
    if kind == "depth" and number % 6 == 0:
        solve = Solve(kinematics)
    if kind == "tolerance":
        solve = Solve(kinematics, tolerance=float(rng.choice([0.01, 0.003, 0.001])), evidence="quick")
    if kind in ("force", "drag", "press", "light", "history", "reversal", "relaxing"):
        loading = _loading(rng, kind, number, (depth, slide, mu))
    if kind in ("history", "reversal", "relaxing"):
        course = "steady" if (kind, number) == ("relaxing", 0) else "history"
        mu, solve = min(mu, 0.5), Solve(kinematics, course=course, tolerance=0.02, evidence="quick")
    if kind == "relaxing":
        prony = (Relaxation(float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.01, 1.0))),)
    if kind == "steep":
        mu, bound = float(rng.uniform(0.9, 4.0)), bound if number % 4 == 1 else None
    if kind == "finger":
        finger = _finger(rng, number, angle)
        radius = finger.tip_radius
        loading, receptor = Loading(0.2 * radius, slide), Receptor(0.28 * radius, (0.04 * radius, 0.2 * radius))
        law = "ogden" if kinematics == "finite" and number % 3 == 0 else None
    tissues = [Material(E, nu, law, None, prony) for E in moduli]
    return Scene(
        title=f"{kind} {number}", finger=finger, materials=Materials(*tissues), friction=Friction(mu, bound),
        loading=loading, receptor=receptor, solve=solve,
    )  # fmt: skip


def _loading(rng, kind, number, sample):
    from solver import Loading

    depth, slide, mu = sample
    if kind == "force":
        unit = "N" if number % 5 == 0 else "N/mm"
        force = math.exp(rng.uniform(math.log(0.004), math.log(0.12)))
        return Loading(None, slide, normal_force=force * (15.0 if unit == "N" else 1.0), force_unit=unit)
    if kind == "drag":
        force = math.exp(rng.uniform(math.log(0.01), math.log(0.1)))
        return Loading(None, slide, normal_force=force, tangential_force=float(rng.uniform(0.0, 1.0)) * mu * force)
    if kind == "press":
        return Loading(depth, "none") if number % 3 else Loading(None, "none", normal_force=0.02 * depth)
    if kind == "light":
        return Loading(float(10.0 ** rng.uniform(-5.0, -2.0)), slide)
    return Loading(min(depth, 1.2), ("+x", "-x") if kind == "reversal" else slide)


def _finger(rng, number, angle):
    from solver import Finger

    radius = float(rng.uniform(3.5, 8.0))
    return Finger(
        tip_radius=radius, epidermis=0.12 * radius, dermis=float(rng.uniform(0.22, 0.3)) * radius,
        shaft_length=3.0 * radius, bone_radius=float(rng.uniform(0.2, 0.32)) * radius,
        bone_centre=(-0.2 * radius, float(rng.uniform(0.0, 0.1)) * radius), contact_angle=angle,
        bone="meshed" if number % 4 == 1 else "rigid", cut="driven" if number % 4 == 2 else "free",
        nail_length=0.6 * radius if number % 4 == 3 else 0.0,
    )  # fmt: skip


def outcome(scene):
    """Return what the solver says of a scene: its numbers or its refusal, without what it took."""
    from solver import SolveFailure, solve

    try:
        numbers = solve(scene).to_dict()
    except SolveFailure as failure:
        return failure.to_dict()
    except Exception as error:  # noqa: BLE001 - a finding as well
        return {"crash": f"{type(error).__name__}: {error}"}
    return {key: value for key, value in numbers.items() if key not in SKIPPED}


def _time_outcome(name):
    start = time.perf_counter()
    return name, outcome(scenes()[name]), time.perf_counter() - start


def solve_all(names=None, workers=2):
    """Return the outcomes by name; the time each took [s] beside them."""
    names = list(scenes()) if names is None else names
    outcomes, seconds_by_name = {}, {}
    with ProcessPoolExecutor(workers) as pool:
        for number, (name, result, seconds) in enumerate(pool.map(_time_outcome, names)):
            outcomes[name], seconds_by_name[name] = result, seconds
            if (number + 1) % 50 == 0:
                print(f"{number + 1} of {len(names)}", file=sys.stderr, flush=True)
    return outcomes, seconds_by_name


def differences(before, after, path=""):
    """Yield (path, before, after, relative difference) of every leaf that differs by more than round-off."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in sorted(before.keys() | after.keys()):
            yield from differences(before.get(key), after.get(key), f"{path}.{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (item_before, item_after) in enumerate(zip(before, after, strict=True)):
            yield from differences(item_before, item_after, f"{path}[{number}]")
    elif isinstance(before, int | float) and isinstance(after, int | float):
        size = max(abs(before), abs(after))
        if abs(before - after) > ABSOLUTE and size > 0.0:
            yield path, before, after, abs(before - after) / size
    elif before != after:
        yield path, before, after, math.inf


def main(arguments):
    """Record the outcomes, or compare them with those recorded."""
    command, file = arguments[0], Path(arguments[1])
    names = [name for name in scenes() if len(arguments) < 3 or arguments[2] in name]
    if command == "record":
        results, seconds_by_name = solve_all(names)
        file.write_text(json.dumps({"outcomes": results, "took_s": seconds_by_name}, indent=0))
        return 0
    recording = json.loads(file.read_text())["outcomes"]
    outcomes, _ = solve_all([name for name in names if name in recording])
    findings = 0
    for name, after in outcomes.items():
        after = json.loads(json.dumps(after))
        rows = [row for row in differences(recording[name], after) if row[3] > AGREEMENT and ".audits" not in row[0]]
        findings += bool(rows)
        for path, value_before, value_after, difference in sorted(rows, key=lambda row: -row[3])[:6]:
            print(f"{name}{path}: {value_before!s:.70} -> {value_after!s:.70} ({difference:.1e})")
    print(f"{len(outcomes)} scenes, {findings} with differences above {AGREEMENT:g}")
    return int(findings > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
