"""Observed orders of convergence: errors and times on sequences of meshes, and the slope between them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from solver.scene import Scene
from solver.verification.methods import MESHED, Kinematics
from solver.verification.published import contacts, locking
from solver.verification.request import LeftOut, Request, clock, rows_within
from solver.verification.truth import KINEMATICS, cases

Errors = Sequence[float]  # errors, sizes or times
Size = TypeVar("Size", int, float)
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Order:
    """One quantity of one problem on a sequence of finer meshes."""

    problem: str
    quantity: str
    kinematics: str
    element: str
    sizes: tuple[float, ...]  # element sizes, relative to the coarsest
    errors: tuple[float, ...]  # relative; for contact, root mean square over meshes of nearly one size
    took_s: tuple[float, ...]  # of the solves that gave each error
    order: float  # observed: slope of the least-squares line through the logarithms
    least: float  # theory's order, less the uncertainty of three meshes


def slope(sizes: Errors, errors: Errors) -> float:
    """Return the slope of the least-squares line through the logarithms.

    >>> slope([1.0, 0.5, 0.25], [4.0, 1.0, 0.25])
    2.0
    """
    return round(float(np.polyfit(np.log(sizes), np.log(errors), 1)[0]), 12)


def measure(request: Request) -> Iterator[Order | LeftOut]:
    """Return an iterator over rows, one for each quantity, until the time is up."""
    on_fingers = (partial(fingers, kinematics=kinematics) for kinematics in KINEMATICS)
    works: list[Callable[[bool], Iterator[Order]]] = [cylinders, membranes, *on_fingers, press_orders]
    return rows_within(request, works, "problems whose order is observed", lambda work: work(request.quick))


def _row(
    problem: str, quantity: str, kinematics: str, sizes: Errors, errors: Errors, took: Errors, least: float
) -> Order:
    return Order(
        problem, quantity, kinematics, "Q2/P-1", tuple(sizes), tuple(errors), tuple(took), slope(sizes, errors), least
    )


def cylinders(quick: bool) -> Iterator[Order]:
    """Yield distorted thick cylinders under inner pressure: orders 3, 2 and 4 of displacement, stress and energy."""
    sizes = (1 / 16, 1 / 32) if quick else (1 / 8, 1 / 16, 1 / 32)
    for nu in (0.3, 0.4999999):
        errors, took = _each(sizes, lambda size, nu=nu: locking.cylinder_errors(nu, round(1 / size)))
        for (quantity, least), column in zip(
            (("displacement", 2.9), ("stress", 1.9), ("energy", 3.7)), zip(*errors, strict=True), strict=True
        ):
            yield _row(f"thick cylinder, nu {nu}", quantity, "small", sizes, column, took, least)


def membranes(quick: bool) -> Iterator[Order]:
    """Yield Cook's membrane, whose clamped and free edges meet at 108 degrees: the singularity's order is 0.9 to 1.5.

    The error of a mesh is its change of displacement to the next mesh, with elements half as wide.
    """
    counts = (4, 8, 16, 32) if quick else (4, 8, 16, 32, 64)
    rises, took = _each(counts, lambda count: locking.cook(240.565, 0.4999, 100.0, count)[0])
    changes = np.diff(rises) / rises[-1]
    sizes = [1 / count for count in counts[:-1]]
    yield _row("Cook's membrane, nu 0.4999", "displacement", "small", sizes, changes.tolist(), took[:-1], 0.9)


def press_orders(quick: bool) -> Iterator[Order]:
    """Yield the force on a half-plane under a round body: order 2, root mean square over meshes of nearly one size."""
    sizes = (0.4, 0.2, 0.1) if quick else (0.4, 0.2, 0.1, 0.05)
    true = float(np.mean([contacts.press(0.025 * s, 0.4999) for s in (1.0, 1.1)]))
    near = np.linspace(0.9, 1.1, 4).tolist()
    errors, took = _each(sizes, lambda size: _rms([contacts.press(size * s, 0.4999) / true - 1 for s in near]))
    yield _row("half-plane under a round body", "force", "small", sizes, errors, [t / len(near) for t in took], 1.7)


def fingers(quick: bool, kinematics: Kinematics) -> Iterator[Order]:
    """Yield the SED of the finger's ending over shifted meshes of nearly one size: order 2, that of a contact."""
    overkill, finenesses = (14.0, (3.0, 4.0, 5.0, 7.0)) if quick else (20.0, (3.0, 4.0, 5.0, 7.0, 10.0))
    for case in cases(kinematics):
        if kinematics == "small" and case.title in ("stickiness 0", "stickiness 100"):
            yield _finger(case, overkill, finenesses)
        if kinematics == "finite" and case.title == "slipperiness 100":
            yield _finger(case, overkill, finenesses[:-1])


def _finger(case: Scene, overkill: float, meshes: Errors) -> Order:
    true = float(np.mean([_sed(case, overkill, shift) for shift in (False, True)]))
    near = [(part, shift) for part in (0.92, 1.0, 1.08) for shift in (False, True)]
    errors, took = _each(meshes, lambda size: _rms([_sed(case, size * part, shift) / true - 1 for part, shift in near]))
    sizes, took = [meshes[0] / fineness for fineness in meshes], [duration / len(near) for duration in took]
    return _row(f"finger, {case.title}", "SED of the ending", case.solve.kinematics, sizes, errors, took, 1.8)


def _sed(case: Scene, fineness: float, shift: bool) -> float:
    mesh = MESHED[case.solve.kinematics](case, fineness, shift)
    return float(mesh.numbers(mesh.solve(case))[0])


def _each(meshes: Sequence[Size], error: Callable[[Size], Value]) -> tuple[list[Value], list[float]]:
    """Return the result of `error` on each mesh, and its time [s]."""
    errors, took = list[Value](), list[float]()
    for mesh in meshes:
        start = clock()
        errors.append(error(mesh))
        took.append(clock() - start)
    return errors, took


def _rms(values: Errors) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
