"""The published problems as rows: source, expected value, obtained value, allowed error."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from solver.contact import FrictionLaw
from solver.verification.methods import Kinematics
from solver.verification.published import contacts, locking
from solver.verification.request import LeftOut, Request, clock, rows_within


@dataclass(frozen=True, slots=True)
class Problem:
    """One result of one problem; `off` and `allowed` are relative to the expected value, or to the value named `of`."""

    problem: str
    source: str
    quantity: str
    expected: float
    obtained: float
    off: float
    allowed: float
    took_s: float = 0.0
    of: str = "expected"

    @property
    def agrees(self) -> bool:
        """Whether the obtained value is within the allowed error."""
        return self.off <= self.allowed


# E, nu [MPa], R [mm], P [N/mm], and the closed form's a [mm] and p0 [MPa]
HERTZ_PROBLEMS = (
    ("Hertz, R 5, P 0.01", 0.08, 0.48, 5.0, 0.01, 0.782578, 0.008135),
    ("Hertz, R 5, P 0.05", 0.08, 0.48, 5.0, 0.05, 1.749897, 0.018190),
    ("Hertz, fat, P 0.02", 0.034, 0.48, 5.0, 0.02, 1.697650, 0.007500),
    ("Hertz, epidermis, P 0.1", 0.136, 0.48, 5.0, 0.1, 1.898030, 0.033541),
    ("two metals as one body", 57692.3 * (1 - 0.3**2), 0.3, 50.0, 35000.0, 6.2146, 3585.4),
)
JOHNSON, KONTER = "Johnson 1985, ch. 4", "Konter 2005, FENET-UNOTT-DLE-09"
MINDLIN = "Cattaneo 1938, Mindlin 1949"
# E, nu, F, and u_y at the right edge's middle and upper end; plane stress as the equivalent plane strain. Published
# values have too few digits for the tolerance: these come from another code's meshes up to 128 x 128
_REFINED = "another code, 128 x 128"
COOK = (
    ("Cook's membrane, plane stress", f"{_REFINED}; 23.96 in Cook 1989", 0.9375, 0.25, 1.0, 23.967, 25.18),
    ("Cook's membrane, nu 0.4999", f"{_REFINED}; 7.7 and 8.1 published", 240.565, 0.4999, 100.0, 7.693, 8.072),
    ("Cook's membrane, nu 0.499999975", f"{_REFINED}; 16.442 published", 1.12499998, 0.499999975, 1.0, 16.447, None),
)
# x and z relative to a; sigma_x, sigma_z, tau_xz relative to p0 (quadrature of the Flamant kernels)
BELOW = {
    0.0: (
        (0.0, 0.25, -0.59141, -0.97014, 0.0),
        (0.0, 0.786, -0.18564, -0.78621, 0.0),
        (0.5, 0.5, -0.31352, -0.74465, -0.17579),
        (1.0, 0.5, -0.29741, -0.30308, -0.23664),
    ),
    0.25: (
        (0.0, 0.5, -0.34164, -0.89443, -0.08541),
        (0.5, 0.5, -0.39810, -0.78860, -0.25417),
        (-0.5, 0.5, -0.22893, -0.70071, 0.09741),
        (1.0, 0.5, -0.42584, -0.36224, -0.31099),
    ),
}
CAPPED = ((1.0, 1.0), (0.8, 0.895912), (0.6, 0.715243), (0.4, 0.495368))  # k, Q/(mu P)
# Q/(mu P) of partial slip; elements at finite strain are three times as long
TANGENTIAL_LOADS: dict[Kinematics, tuple[float, ...]] = {
    "small": (0.1, 0.25, 0.5, 0.75, 0.9, 0.99),
    "finite": (0.25, 0.5, 0.75),
}
WHERE: dict[Kinematics, str] = {"small": "", "finite": " at finite strain"}
SECOND_MOMENT = "half-width a, from <x^2> of the pressure [mm]"


def measure(request: Request) -> Iterator[Problem | LeftOut]:
    """Return an iterator over all results, until the time is up."""
    works = [
        thick_cylinders, membranes, hertz, partial_slip, bound_on_hertz, cylinder, below,
        light_finite, partial(bound_on_hertz, "finite"), partial(partial_slip, "finite"),
    ]  # fmt: skip
    return rows_within(request, works, "groups of published problems", lambda work: _timed(work()))


def _timed(rows: Iterable[Problem]) -> Iterator[Problem]:
    """Yield the rows, each with its time; further results of one solve take none."""
    start = clock()
    for row in rows:
        yield replace(row, took_s=clock() - start)
        start = clock()


def _row(problem: str, source: str, quantity: str, expected: float, obtained: float, allowed: float) -> Problem:
    return Problem(problem, source, quantity, expected, obtained, abs(obtained / expected - 1.0), allowed)


def thick_cylinders() -> Iterator[Problem]:
    """Yield the widening of a thick cylinder with five elements across its wall."""
    for nu in (0.3, 0.48, 0.49, 0.499, 0.4999, 0.49999, 0.4999999):
        problem, obtained = f"thick cylinder, nu {nu}", locking.hole_displacement(nu, 5, 20)
        yield _row(problem, "MacNeal and Harder 1985", "u(a) [mm]", locking.widening(nu), obtained, 2e-4)


def membranes() -> Iterator[Problem]:
    """Yield the rise of Cook's membrane with 32 elements along each side."""
    for problem, source, young, nu, force, middle, corner in COOK:
        numbers = locking.cook(young, nu, force, 32)
        yield _row(problem, source, "u_y at (48, 52)", middle, numbers[0], 0.002)
        if corner is not None:
            yield _row(problem, source, "u_y at (48, 60)", corner, numbers[1], 0.002)


def hertz() -> Iterator[Problem]:
    """Yield half-width and peak pressure under the gap of a parabola."""
    for problem, young, nu, radius, load, half_width, peak in HERTZ_PROBLEMS:
        numbers = contacts.hertz(young, nu, radius, load, half_width, peak)
        source = KONTER if radius == 50.0 else JOHNSON
        yield _row(problem, source, SECOND_MOMENT, half_width, numbers.half_width, 0.001)
        yield _row(problem, source, "peak p0 [MPa]", peak, numbers.peak, 0.001)


def cylinder() -> Iterator[Problem]:
    """Yield the results of a whole cylinder between plates; a/R = 0.16, whose square the theory neglects."""
    numbers = contacts.whole_cylinder(0.01, 0.782578, 0.008135)
    problem, source = "whole cylinder between plates", "Johnson 1985, eq. 5.57"
    yield _row(problem, source, "approach [mm]", 0.167860, numbers.approach, 0.005)
    yield _row(problem, source, SECOND_MOMENT, 0.782578, numbers.half_width, 0.01)
    yield _row(problem, source, "peak p0 [MPa]", 0.008135, numbers.peak, 0.01)


def below() -> Iterator[Problem]:
    """Yield the largest difference of stresses below a contact, relative to p0, with and without friction."""
    for mu, table in BELOW.items():
        light, rows = contacts.light(wide=300.0), np.array(table)
        stresses = light.stress(light.slip(FrictionLaw(mu, math.inf), -1), rows[:, :2])
        worst = float(np.abs(stresses[:, (0, 1, 0), (0, 1, 1)] - rows[:, 2:]).max())
        yield Problem(
            f"stresses below a contact, mu {mu:g}", "Flamant's kernels, as Smith and Liu 1953",
            "largest difference by p0", 0.0, worst, worst, 0.005, of="p0",
        )  # fmt: skip


def light_finite() -> Iterator[Problem]:
    """Yield half-width and peak of a contact at finite strain, so light that small-strain theory applies."""
    light = contacts.light("finite")
    problem, width = "Hertz at finite strain, a/R 0.001", light.width(light.press) / light.half_width
    yield _row(problem, JOHNSON, "half-width a, by a", 1.0, width, 0.003)
    yield _row(problem, JOHNSON, "peak p0, by p0", 1.0, light.at_middle(light.press.normal) / light.peak, 0.003)


def partial_slip(kinematics: Kinematics = "small") -> Iterator[Problem]:
    """Yield half the width of the stick zone and the traction at its middle, for nu = 0.4999."""
    light, mu = contacts.light(kinematics), 0.3
    for part in TANGENTIAL_LOADS[kinematics]:
        state = light.shear(mu, part)
        problem, half = f"partial slip{WHERE[kinematics]}, Q/(mu P) {part:g}", math.sqrt(1 - part)
        traction = -light.at_middle(state.tangential) / (mu * light.peak)
        yield _row(problem, MINDLIN, "half stick c/a", half, light.stick_width(state, mu), 0.02)
        yield _row(problem, MINDLIN, "q(0)/(mu p0)", 1 - half, traction, 0.005)


def bound_on_hertz(kinematics: Kinematics = "small") -> Iterator[Problem]:
    """Yield the drag of a traction bound on a Hertz pressure, and half the width of its zone, if it has one."""
    light, mu, source = contacts.light(kinematics), 0.3, "elementary integral"
    for k, force in CAPPED:
        law = FrictionLaw(mu, k * mu * light.peak)
        state = light.slip(law)
        problem = f"bound on a Hertz pressure{WHERE[kinematics]}, k {k:g}"
        yield _row(
            problem, source, "Q/(mu P)", force, -float(state.tangential.sum() / (mu * state.normal.sum())), 0.005
        )
        if k < 1.0:
            width = light.capped_width(state, law)
            yield _row(problem, source, "half width at the bound xc/a", math.sqrt(1 - k**2), width, 0.005)
