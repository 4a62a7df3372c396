"""The parts of the time of one solve: mesh, assembly, factorisation, contact, estimate.

A solve by the public interface runs once to load everything, then timed, and once under a profiler. The profiler gives
shares, the timed runs the total. Time in a function outside the solver counts for its caller. Time on any mesh for the
error estimate or for evidence counts as estimate or evidence.
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
from solver.scene.tables import Solve
from solver.verification.methods import Kinematics
from solver.verification.request import LeftOut, Request, clock, median_time, rows_within
from solver.verification.truth import KINEMATICS, cases

# Part of a solve by folder of the solver; by file or compiled loop where its part differs from the folder's.
COST_PARTS = {
    "mesh": "mesh and tables", "body": "assembly", "constitutive": "assembly", "linalg": "factorisation",
    "contact": "contact", "quantities": "receptor", "equilibrium": "iteration", "continuation": "proof of existence",
    "accuracy": "audits", "body.receptor": "receptor", "body.linear.average": "receptor",
    "body.linear._energy_forms": "receptor", "body.average": "receptor", "body.responses": "receptor",
    "body.state": "receptor", "body.skin": "proof of existence", "equilibrium.finger": "carrying states",
    "continuation.small_states": "iteration", "continuation.finite_states": "iteration",
    "response.finite_answers": "iteration",
    "_kernels.elements": "assembly", "_kernels.multifrontal": "factorisation",
    "_kernels.active_set": "contact", "_kernels.contact_system": "contact",
}  # fmt: skip
ENTIRE = {"nested_numbers_of_all": "error estimate", "solve_nested": "error estimate", "with_viscosity": "evidence"}
OTHER = "the rest"
Function = tuple[str, int, str]  # file, line, name
# calls, own and total time, callers
Spent = tuple[int, int, float, float, dict["Function", tuple[int, int, float, float]]]


@dataclass(frozen=True, slots=True)
class Cost:
    """The parts of one solve, mesh and estimate included."""

    kinematics: Kinematics
    tolerance: float
    dofs: int
    took_s: float  # from scene to answer: median
    setup_s: float  # from the answer, for its mesh
    wall_s: float
    estimate_s: float
    parts: dict[str, float]  # shares of `took_s`


def measure(request: Request) -> Iterator[Cost | LeftOut]:
    """Return an iterator over rows, one for each kinematics and tolerance."""
    works: list[tuple[Kinematics, float]] = [
        (kind, tolerance) for tolerance in request.pick((0.01, 0.003), (0.01,)) for kind in KINEMATICS
    ]
    return rows_within(request, works, "solves whose cost is broken down", lambda work: [_cost(*work)])


def _cost(kinematics: Kinematics, tolerance: float) -> Cost:
    scene = replace(cases(kinematics)[-1], solve=Solve(kinematics, tolerance=tolerance))
    solve(scene)
    start, before = clock(), perf_counter()
    answer = solve(scene)
    own = (clock() - start) / (perf_counter() - before)  # processor time over elapsed time, which answers report
    span = median_time(partial(solve, scene), 5, 1.5)
    profile = cProfile.Profile()
    profile.enable()
    solve(scene)
    profile.disable()
    return Cost(
        kinematics, tolerance, answer.dofs, span, own * answer.setup_s, own * answer.wall_s, own * answer.estimate_s,
        shares(pstats.Stats(profile)),
    )  # fmt: skip


def shares(profile: pstats.Stats) -> dict[str, float]:
    """Return the share of every part in a profile, largest first."""
    raw = cast("dict[Function, Spent]", vars(profile)["stats"])
    cache: dict[Function, dict[str, float]] = {}

    def parts(function: Function, above: frozenset[Function] = frozenset()) -> dict[str, float]:
        """Return the shares of the parts that a function works for; they sum to 1."""
        if function[2] in ENTIRE:
            return {ENTIRE[function[2]]: 1.0}
        if function in cache:
            return cache[function]
        callers = {caller: spent[3] for caller, spent in raw[function][4].items() if caller not in above}
        total, out = sum(callers.values()), dict[str, float]()
        for caller, spent in callers.items():
            for name, share in parts(caller, above | {function}).items():
                out[name] = out.get(name, 0.0) + share * (spent / total if total > 0.0 else 1.0 / len(callers))
        if (own := _part(function)) is not None:
            out = {name: share for name, share in out.items() if name in ENTIRE.values()}
            out[own] = 1.0 - sum(out.values())
        cache[function] = out or {OTHER: 1.0}
        return cache[function]

    spent: dict[str, float] = {}
    for function, row in raw.items():
        for name, share in parts(function).items():
            spent[name] = spent.get(name, 0.0) + share * row[2]
    total = sum(spent.values())
    return {name: value / total for name, value in sorted(spent.items(), key=lambda item: -item[1]) if value > 0.0}


def _part(function: Function) -> str | None:
    """Return the part that a function itself works for; None where it counts for its caller."""
    path, _, name = function
    if name.startswith("<built-in method solver."):  # a compiled loop
        place = name.removeprefix("<built-in method solver.").removesuffix(">").split(".")
    elif "solver" in (names := Path(path).with_suffix("").parts):
        place = [*names[len(names) - names[::-1].index("solver") :], name]
    else:
        return None
    return next((COST_PARTS[key] for n in (3, 2, 1) if (key := ".".join(place[:n])) in COST_PARTS), None)
