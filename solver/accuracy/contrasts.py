"""How well surfaces solved together are distinguished: what the differences between them may be off by.

Much of what a mesh makes wrong is the same for all surfaces of one finger and falls out of their differences. What is
left is estimated as for one number (`solver.accuracy.error_estimate`): from what halving every element changes in a
difference, and from the edges of contact, which each surface has elsewhere.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from solver.accuracy.error_estimate import FROM_EDGES, FROM_HALVING
from solver.prediction import Prediction
from solver.scene.scene import Scene

NAMES = ("SED", "normal force", "drag", "indentation")  # what is compared: the first four of all numbers
WARNED = 0.05  # part of their range from which on a warning says how far differences may be off
LEAST = 1e-5  # part of the numbers below which nobody minds
NOTICED = 1e-3  # part of a force or depth that a sensor may tell


def compared_sets(scenes: Sequence[Scene]) -> list[list[int]]:
    """Return the sets of scenes that are compared: two or more surfaces of one finger, pressed and moved alike.

    Scenes asked for with quick evidence are variants of one surface, whose differences have their own ways
    (`solver.response.nearby`), and belong to none.
    """
    sets: dict[object, list[int]] = {}
    for number, scene in enumerate(scenes):
        if scene.solve.evidence != "quick":
            sets.setdefault(scene.pressed, []).append(number)
    return [numbers for numbers in sets.values() if len({scenes[n] for n in numbers}) > 1]


class ContrastError(NamedTuple):
    """By how much of their range differences between surfaces may be off."""

    share: float  # in SED, at worst [-]
    warning: str = ""  # a sentence where that is too much of it, or of a force or depth


def contrast_error(found: Sequence[Prediction]) -> ContrastError:
    """Return what differences between these surfaces may be off by.

    Of forces and depth only what is off by more than sensors tell is warned of. A surface that has no state on the
    nested mesh is left out: nothing is known of it.
    """
    known = [(one, one.nested) for one in found if one.nested is not None]
    if len(known) < 2:
        return ContrastError(0.0)
    count = len(NAMES)
    numbers = np.abs([(o.sed_ending, o.normal_force, o.tangential_force, o.indentation) for o, _ in known])
    change = np.abs([nested.numbers[:count] for _, nested in known]) - numbers
    edges = np.array([nested.of_edges[:count] for _, nested in known])
    pairs = np.array(list(combinations(range(len(known)), 2))).T
    worst = FROM_HALVING * np.abs(change[pairs[0]] - change[pairs[1]])
    worst += FROM_EDGES * np.hypot(edges[pairs[0]], edges[pairs[1]])
    off_by, mean = worst.max(axis=0), numbers.mean(axis=0)
    shares = off_by / np.maximum(np.maximum(np.ptp(numbers, axis=0), LEAST * mean / WARNED), np.finfo(float).tiny)
    minded = off_by > NOTICED * mean
    minded[0] = True
    warned = np.where((shares > WARNED) & minded, shares, 0.0)
    first = int(warned.argmax())
    return ContrastError(float(shares[0]), _in_a_sentence(NAMES[first], float(warned[first])) if warned.any() else "")


def _in_a_sentence(name: str, share: float) -> str:
    part = f"{100.0 * share:.2g} %" if share < 1.0 else "more than all"
    small = f"Differences in {name} from the surfaces solved with this one are small"
    return f"{small}, and may be off by {part} of their range."
