"""The exponent of Stevens' law from magnitude estimates: answers grow as a power of what was measured.

log answer = level of the subject + exponent log magnitude (Stevens 1957, Psychol. Rev. 64, 153). Levels of the subjects
take away the unit each has chosen. What was measured errs too, which makes a plain slope too flat; Deming's slope
(1943) allows for both errors by the ratio of their variances.
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.statistics.mixed_model import Term, mixed_model

Array = NDArray[np.float64]
NAME = "log magnitude"
RESAMPLES = 1000
LEAST_SUBJECTS = 3


@dataclass(frozen=True, slots=True)
class Exponent:
    """Stevens' exponent, by two routes. None where `reason` says why."""

    subjects: int
    trials: int
    plain: Term | None  # slope of the mixed model, the magnitude taken as exact
    deming: tuple[float, float, float] | None = None  # Deming's slope through the surfaces, and its 95 % interval
    error_ratio: float | None = None  # variance of a surface's log answer by that of its log magnitude [-]
    reason: str = ""


def stevens_exponent(
    subjects: Sequence[str],
    surfaces: Sequence[int],
    answers: Sequence[float],
    magnitudes: Sequence[float],
    seed: int = 0,
) -> Exponent:
    """Return the exponent of answers (n,) by magnitudes (n,), both above 0, in trials of subjects and surfaces (n,).

    The interval of Deming's slope is a bootstrap over subjects. Others must have left out what is not above 0.
    """
    y, x = np.log(np.asarray(answers, np.float64)), np.log(np.asarray(magnitudes, np.float64))
    people = sorted(set(subjects))
    if len(people) < LEAST_SUBJECTS or len(set(surfaces)) < LEAST_SUBJECTS:
        why = f"it takes {LEAST_SUBJECTS} subjects and {LEAST_SUBJECTS} surfaces"
        return Exponent(len(people), len(y), None, reason=why)
    model = mixed_model(subjects, y.tolist(), {NAME: x.tolist()}, slopes_differ=True)
    plain = None if isinstance(model, str) else model.term(NAME)
    reason = model if isinstance(model, str) else ""
    cells = _cells(subjects, surfaces, y, x)
    if cells is None:
        return Exponent(len(people), len(y), plain, reason=reason or "some subject missed a surface")
    here = _deming(cells)
    if here is None:
        return Exponent(len(people), len(y), plain, reason=reason or "magnitudes or answers do not vary over surfaces")
    rng = np.random.default_rng(seed)
    drawn = [_deming(cells[rng.integers(0, len(cells), len(cells))]) for _ in range(RESAMPLES)]
    slopes = [one[0] for one in drawn if one is not None]
    low, high = np.quantile(slopes, [0.025, 0.975]).tolist()
    return Exponent(len(people), len(y), plain, (here[0], low, high), here[1], reason)


def _cells(subjects: Sequence[str], surfaces: Sequence[int], y: Array, x: Array) -> Array | None:
    """Return log answers and magnitudes (s, k, 2), each subject's mean taken away; None where a cell is empty."""
    by_cell: defaultdict[tuple[str, int], list[tuple[float, float]]] = defaultdict(list)
    for subject, surface, one, other in zip(subjects, surfaces, y.tolist(), x.tolist(), strict=True):
        by_cell[subject, surface].append((one, other))
    people, indices = sorted(set(subjects)), sorted(set(surfaces))
    if any((subject, index) not in by_cell for subject in people for index in indices):
        return None
    cells = np.array([[np.mean(by_cell[subject, index], axis=0) for index in indices] for subject in people])
    return cells - cells.mean(axis=1, keepdims=True)


def _deming(cells: Array) -> tuple[float, float] | None:
    """Return Deming's slope through surfaces' means, and the ratio of error variances; None where nothing varies.

    The errors are what subjects differ by on one surface, levels taken away.
    """
    means = cells.mean(axis=0)
    rest = cells - means
    error_y, error_x = np.sum(rest**2, axis=(0, 1)).tolist()
    (yy, xy), (_, xx) = (means.T @ means).tolist()
    if not (error_x > 0.0 and xy != 0.0):
        return (xy / xx, math.inf) if xx > 0.0 and error_x == 0.0 else None
    ratio = error_y / error_x
    off = yy - ratio * xx
    return (off + math.sqrt(off**2 + 4.0 * ratio * xy**2)) / (2.0 * xy), ratio
