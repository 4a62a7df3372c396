"""How well surfaces solved together are told apart: what their differences may be off by, and which mesh mends it.

Much of what a mesh makes wrong is the same for all surfaces of one finger and falls out of their differences; what is
left comes from the edges of contact, which each has elsewhere. How far a difference may be off is a part of what it
changes by from the answer's mesh to another. At small strain one other mesh agreed by chance in one of six sets, so
that there are two. The parts were chosen and measured with the contrasts of `solver.verification.survey`.
"""

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from solver.arrays import Array
from solver.prediction import Prediction
from solver.scene import Scene

NAMES = ("SED", "normal force", "drag", "indentation")  # what is told apart
PART = {"small": 0.6, "finite": 1.0}  # of what another mesh changes in a difference
TOLD = 0.05  # part of their range to which differences are asked for
LEAST = 1e-5  # part of the numbers below which nobody minds
NOTICED = 1e-3  # part of a force or depth that a sensor may tell


def together(scenes: Sequence[Scene]) -> list[list[int]]:
    """Return the sets of scenes that are told apart: two or more surfaces of one finger, pressed and moved alike.

    Scenes asked for with quick evidence are variants of one surface, whose differences have their own ways
    (`solver.response.nearby`), and belong to none.
    """
    sets: dict[object, list[int]] = {}
    for number, scene in enumerate(scenes):
        if scene.solve.evidence != "quick":
            sets.setdefault(scene.pressed, []).append(number)
    return [numbers for numbers in sets.values() if len({scenes[n] for n in numbers}) > 1]


class Off(NamedTuple):
    """By how much of their range differences between surfaces may be off."""

    share: float  # at worst, of those numbers that are held to a part of their range
    warning: str = ""  # a sentence where that is too much


def off(found: Sequence[Prediction]) -> Off:
    """Return what differences between these surfaces may be off by.

    Without a tolerance the SED's alone are held to their range; of forces and depth only what is off by more than
    sensors tell is warned of. A surface that has no state on another mesh is left out: nothing is known of it.
    """
    known = [one for one in found if len(one.beside)]
    if len(known) < 2:
        return Off(0.0)
    count = min(len(one.beside) for one in known)
    numbers = np.array([told(one) for one in known])
    shares = off_by(numbers, np.array([one.beside[:count] for one in known]), PART[known[0].scene.solve.kinematics])
    of_numbers = shares * np.ptp(numbers, axis=0) / np.where(numbers[0] == 0.0, 1.0, np.abs(numbers).mean(axis=0))
    held = np.full(len(NAMES), any(one.scene.solve.tolerance is not None for one in known))
    held[0] = True
    warned = np.where((shares > TOLD) & (held | (of_numbers > NOTICED)), shares, 0.0)
    worst = int(warned.argmax())
    return Off(float(shares[held].max()), _in_a_sentence(NAMES[worst], float(warned[worst])) if warned.any() else "")


def _in_a_sentence(name: str, share: float) -> str:
    part = f"{100.0 * share:.2g} %" if share < 1.0 else "more than all"
    small = f"Differences in {name} from the surfaces solved with this one are small"
    return f"{small}, and may be off by {part} of their range."


def told(one: Prediction) -> tuple[float, float, float, float]:
    """Return the numbers that are told apart."""
    return one.sed_ending, one.normal_force, abs(one.tangential_force), one.indentation


def those_of(numbers: Array) -> Array:
    """Return the same of all numbers of a state (n, 6) (`solver.accuracy.error_estimate.errors`)."""
    return np.abs(numbers[:, :4])


def off_by(numbers: Array, others: Array, part: float) -> Array:
    """Return by how much of their range differences may be off (n,), at worst between any two surfaces.

    `numbers` (s, n) are those of the surfaces, `others` (s, m, n) those of m other meshes.
    """
    changed = np.ptp(others - numbers[:, None], axis=0).max(axis=0)
    mind = LEAST * np.abs(numbers).mean(axis=0) / TOLD
    span = np.maximum(np.ptp(numbers, axis=0), mind)
    return part * changed / np.where(span > 0.0, span, 1.0)


def finer(meshes: Sequence[int], fineness: float, share: float) -> int:
    """Return which of the finer `meshes`, coarsest first, is to tell apart what `fineness` leaves off by `share`.

    Errors fall with the square of the fineness at best: what lies between would not do.
    """
    wanted = fineness * sqrt(share / TOLD)
    return next((mesh for mesh in meshes if mesh >= wanted), meshes[-1])
