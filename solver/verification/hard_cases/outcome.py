"""Outcome of a hard case, and its flaw, if any."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.failures import SolveFailure
from solver.prediction import Prediction, percent
from solver.response.solution import solve_many
from solver.scene import Scene

BALANCE = ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance")  # audits of balance
_LIMITS = ("penetration", "tension", "cone_violation")
UNBALANCED, EXCEEDED = 1e-4, 1e-7  # largest residual relative to the forces; largest excess relative to a law's limit
_NOTHING = 1.0  # estimated error of an answer without any accuracy


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a case."""

    answered: bool
    numbers: tuple[float, ...]  # all numbers of the answer; each must be finite
    flaw: str  # "" where the answer is sound, else its flaw
    summary: str  # for readers: the answer with its error, or the reason why there is none


def of_scene(scene: Scene) -> Outcome:
    """Solve a scene of the finger by the public interface."""
    return of_answer(solve_many([scene])[0])


def of_answer(answer: Prediction | SolveFailure) -> Outcome:
    """Return the outcome of a solve."""
    if isinstance(answer, SolveFailure):
        summary = str(answer)
        flaw = "" if summary.endswith(".") and "nan" not in summary.split() else "its reason is no sentence"
        return Outcome(False, (), flaw, summary)
    checks = answer.audits
    flaws = [name for name in BALANCE if name in checks and not checks[name] < UNBALANCED]
    flaws += [name for name in _LIMITS if not checks[name] < EXCEEDED]
    if answer.scene.solve.kinematics == "finite" and not checks["smallest_det_F"] > 0.0:
        flaws.append("smallest_det_F")
    if not answer.sed_ending > 0.0:
        flaws.append("sed_ending")
    if not 0.0 < answer.error_estimate < _NOTHING and answer.unknown is None:
        flaws.append("error_estimate")
    numbers = (answer.sed_ending, answer.sed_point, answer.normal_force, answer.tangential_force, answer.error_estimate)
    balance = max(checks[name] for name in BALANCE if name in checks)
    summary = (
        f"SED {answer.sed_ending:.4g} ± {percent(answer.error_estimate)}, N {answer.normal_force:.4g}, "
        f"T {answer.tangential_force + 0.0:.4g}; {answer.newton_iterations} systems; balance {power(balance)}"
    )
    return Outcome(True, numbers, ", ".join(flaws), summary)


def agree(summary: str, numbers: Sequence[float], within: float) -> Outcome:
    """Return the outcome of a case whose numbers must all agree."""
    spread = float(np.ptp(numbers)) / abs(numbers[0])
    flaw = "" if spread <= within else f"{len(numbers)} ways differ by {spread:.1g}"
    return Outcome(True, tuple(numbers), flaw, f"{summary}: {len(numbers)} ways agree to {power(spread)}")


def power(value: float) -> str:
    """Return the power of ten at or above a round-off, whose digits differ between machines.

    >>> power(3e-12), power(0.0)
    ('1e-11', '1e-16')
    """
    return f"1e{math.ceil(math.log10(max(value, 1e-16)))}"
