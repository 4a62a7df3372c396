"""Growth of time with the number of unknowns: one assembly, factorisation and solve, up to 100,000 unknowns."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import log
from statistics import median

from solver.verification.methods import MESHED
from solver.verification.request import LeftOut, Request
from solver.verification.truth import cases

MESHES = (3.0, 4.0, 6.0, 9.0, 13.0, 18.0, 26.0, 34.0, 46.0)
QUICK = (3.0, 6.0, 10.0)
FEWEST = 3000  # fewest unknowns in the fit of the exponent: below, arithmetic does not dominate the time
SHARE = 0.4  # largest part of the time left that the next mesh may be expected to take


@dataclass(frozen=True, slots=True)
class Growth:
    """Times of one mesh: its setup, and one linear system."""

    kinematics: str
    fineness: float
    dofs: int
    setup_s: float
    floor_s: float  # one assembly, factorisation and solve: median


def measure(request: Request) -> Iterator[Growth | LeftOut]:
    """Yield a row for each kinematics and mesh, until the next mesh would take too long."""
    for kinematics, meshed in MESHED.items():
        scene = cases(kinematics)[0]
        last: Growth | None = None
        for fineness in request.pick(MESHES, QUICK):
            if last is not None and not request.quick:
                larger = last.dofs * (fineness / last.fineness) ** 1.6
                expected_s = (last.setup_s + 5.0 * last.floor_s) * (larger / last.dofs) ** 2.2
                if expected_s > SHARE * request.seconds_left:
                    yield LeftOut(
                        f"Growth at {kinematics} strain was not followed beyond {last.dofs} unknowns: no time."
                    )
                    break
            mesh = meshed(scene, fineness, False)
            mesh.floor()  # the first run allocates memory, which takes as long as the work, and longer on large meshes
            floor = median(mesh.floor() for _ in range(5 if mesh.dofs < 20000 else 3))
            last = Growth(kinematics, fineness, mesh.dofs, mesh.setup_s, floor)
            yield last


def between(rows: list[Growth]) -> list[float]:
    """Return the exponent between each of the larger meshes and the next."""
    large = [row for row in rows if row.dofs >= FEWEST]
    return [log(b.floor_s / a.floor_s) / log(b.dofs / a.dofs) for a, b in pairwise(large)]


def exponent(rows: list[Growth]) -> float | None:
    """Return the exponent of the time in the number of unknowns, by least squares; None without two large meshes."""
    import numpy as np

    large = [row for row in rows if row.dofs >= FEWEST]
    if len(large) < 2:
        return None
    return float(np.polyfit(np.log([r.dofs for r in large]), np.log([r.floor_s for r in large]), 1)[0])
