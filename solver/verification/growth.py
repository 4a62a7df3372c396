"""Growth of time with the number of unknowns: one assembly, factorisation and solve, up to 100,000 unknowns."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median

from solver.verification.methods import MESHED, Kinematics
from solver.verification.orders import slope
from solver.verification.request import LeftOut, Request, rows_within
from solver.verification.truth import KINEMATICS, cases

_MESHES = (3.0, 4.0, 6.0, 9.0, 13.0, 18.0, 26.0, 34.0, 46.0)
_QUICK = (8.0, 11.0, 16.0)
FEWEST = 3000  # fewest unknowns in the fit of the exponent: with fewer, arithmetic does not dominate the time


@dataclass(frozen=True, slots=True)
class Growth:
    """Times of one mesh: its setup, and one linear system."""

    kinematics: str
    fineness: float
    dofs: int
    setup_s: float
    floor_s: float  # one assembly, factorisation and solve: median


def measure(request: Request) -> Iterator[Growth | LeftOut]:
    """Return an iterator over rows, one for each mesh and kinematics, coarse meshes first."""
    works: list[tuple[float, Kinematics]] = [
        (fineness, kind) for fineness in request.pick(_MESHES, _QUICK) for kind in KINEMATICS
    ]
    return rows_within(request, works, "meshes whose growth is measured", lambda work: [_row(*work)])


def _row(fineness: float, kinematics: Kinematics) -> Growth:
    mesh = MESHED[kinematics](cases(kinematics)[0], fineness, False)
    mesh.floor()  # the first run allocates memory, which takes at least as long as the work
    floor = median(mesh.floor() for _ in range(5 if mesh.dofs < 20000 else 3))
    return Growth(kinematics, fineness, mesh.dofs, mesh.setup_s, floor)


def large(rows: Sequence[Growth]) -> list[Growth]:
    """Return the meshes large enough for the exponent."""
    return [row for row in rows if row.dofs >= FEWEST]


def exponent(rows: Sequence[Growth]) -> float | None:
    """Return the exponent of the time in the number of unknowns, by least squares; None without two large meshes."""
    pairs = [(row.dofs, row.floor_s) for row in large(rows)]
    return slope(*zip(*pairs, strict=True)) if len(pairs) > 1 else None
