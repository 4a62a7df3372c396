"""Where the time of one solve goes: mesh, assembly, factorisation, contact, estimate.

A solve through the front door is run once to load what must be loaded, timed, and run again under a profiler whose
shares are then of the time without it. What a function outside the solver takes is its caller's; all that is done for
the error estimate is the estimate's, on whatever mesh.
"""

import cProfile
import pstats
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import cast

from solver.response.solution import solve
from solver.scene import Solve
from solver.verification.asked import Asked, Found, LeftOut, clock, timed, within
from solver.verification.methods import Kinematics
from solver.verification.truth import KINEMATICS, cases

# What a file of the solver does, and what a compiled loop does whose file does more than one thing.
FILES = {
    "mesher": "mesh and tables", "grid": "mesh and tables", "outline": "mesh and tables", "mesh": "mesh and tables",
    "finite_body": "mesh and tables", "carrying": "carrying states", "elements": "assembly", "stiffness": "assembly",
    "nested_dissection": "factorisation", "linear_elimination": "factorisation", "multifrontal": "factorisation",
    "body": "factorisation",
    "contact": "contact", "friction": "contact", "skin": "contact", "receptor": "receptor", "newton": "iteration",
    "sliding": "iteration", "existence": "proof of existence", "crossing": "proof of existence",
    "limit": "proof of existence", "audits": "audits and evidence", "evidence": "audits and evidence",
    "hooke": "assembly", "rubbing": "contact", "small_states": "contact", "holding": "audits and evidence",
    "finite_audits": "audits and evidence",
}  # fmt: skip
LOOPS = {"energies": "receptor", "displace": "factorisation"}
ESTIMATE, OTHER = "error estimate", "the rest"
Function = tuple[str, int, str]  # file, line, name
Spent = tuple[
    int, int, float, float, dict["Function", tuple[int, int, float, float]]
]  # calls, own and total time, callers


@dataclass(frozen=True, slots=True)
class Cost:
    """The parts of one solve, mesh and estimate included."""

    kinematics: Kinematics
    tolerance: float
    dofs: int
    took_s: float  # from scene to answer: median
    setup_s: float  # as the answer itself tells, of the mesh it is from
    wall_s: float
    estimate_s: float
    parts: dict[str, float]  # shares of `took_s`


def measure(asked: Asked, found: Found) -> Iterator[Cost | LeftOut]:
    """Yield a row a kinematics and tolerance."""
    del found
    works: list[tuple[Kinematics, float]] = [
        (kinematics, tolerance) for tolerance in asked.pick((0.01, 0.003), (0.01,)) for kinematics in KINEMATICS
    ]
    for work in within(asked, works, "solves whose cost is broken down"):
        if isinstance(work, LeftOut):
            yield work
            return
        kinematics, tolerance = work
        scene = replace(cases(kinematics)[-1], solve=Solve(kinematics, tolerance=tolerance))
        solve(scene)
        begun, before = clock(), perf_counter()
        answer = solve(scene)
        own = (clock() - begun) / (perf_counter() - before)  # of the time that passed, by which answers tell theirs
        span = timed(partial(solve, scene), 5, 1.5)
        profile = cProfile.Profile(builtins=False)
        profile.enable()
        solve(scene)
        profile.disable()
        yield Cost(
                kinematics, tolerance, answer.dofs, span, own * answer.setup_s, own * answer.wall_s,
                own * answer.estimate_s, shares(pstats.Stats(profile)),
            )  # fmt: skip


def shares(profile: pstats.Stats) -> dict[str, float]:
    """Return the share of every part in a profile, the largest first."""
    raw = cast("dict[Function, Spent]", vars(profile)["stats"])
    part_of: dict[Function, dict[str, float]] = {}

    def parts(function: Function, above: frozenset[Function]) -> dict[str, float]:
        """Return which parts a function works for, as shares that sum to 1."""
        own = _part(function)
        if own is not None:
            return {own: 1.0}
        if function in part_of:
            return part_of[function]
        callers = {c: spent[3] for c, spent in raw[function][4].items() if c not in above}
        total = sum(callers.values())
        out: dict[str, float] = {}
        for caller, spent in callers.items():
            for name, share in parts(caller, above | {function}).items():
                out[name] = out.get(name, 0.0) + share * (spent / total if total > 0.0 else 1.0 / len(callers))
        part_of[function] = out or {OTHER: 1.0}
        return part_of[function]

    spent: dict[str, float] = {}
    estimating = _estimating(raw)
    for function, row in raw.items():
        its = estimating[function]
        spent[ESTIMATE] = spent.get(ESTIMATE, 0.0) + its * row[2]
        for name, share in parts(function, frozenset()).items():
            spent[name] = spent.get(name, 0.0) + (1.0 - its) * share * row[2]
    spent = {name: value for name, value in spent.items() if value > 0.0}
    total = sum(spent.values())
    return {name: value / total for name, value in sorted(spent.items(), key=lambda item: -item[1])}


def _estimating(raw: dict[Function, Spent]) -> dict[Function, float]:
    """Return which part of each function's time is spent for the error estimate: on coarser meshes, and in judging."""
    known: dict[Function, float] = {}

    def its(function: Function, above: frozenset[Function]) -> float:
        path, _, name = function
        file = Path(path).stem
        if file.endswith("_errors") or name.endswith("error_estimates") or name == "_coarser":
            return 1.0
        if function not in known:
            callers = {c: spent[3] for c, spent in raw[function][4].items() if c not in above}
            total = sum(callers.values())
            theirs = sum(spent * its(c, above | {function}) for c, spent in callers.items())
            known[function] = theirs / total if total > 0.0 else 0.0
        return known[function]

    return {function: its(function, frozenset()) for function in raw}


def _part(function: Function) -> str | None:
    """Return the part a function belongs to; None where it is its caller's."""
    path, _, name = function
    file = Path(path)
    if "solver" not in file.parts:
        return None
    if name in LOOPS and file.stem.startswith(("kernels", "elements", "multifrontal", "skin")):
        return LOOPS[name]
    return FILES.get(file.stem)
