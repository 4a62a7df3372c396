"""The intervals that the uncertainty of friction makes of what is predicted; `prediction.uncertainty` finds them."""

from dataclasses import dataclass
from typing import Literal

Method = Literal["derivatives", "sampling"]  # by the solver's converged tangent; by draws that are solved


Ends = tuple[float, float]


@dataclass(frozen=True, slots=True)
class SedInterval:
    """The 95 % interval of one SED that friction makes, and the force where that drives: not the model's error.

    With it those of the same state's forces and depth, by the tangent alone; None where there is no tangent.
    """

    low: float | None  # [MPa]; None where `reason` says why
    high: float | None
    method: Method | None
    # Derivatives by the converged tangent: where the method is sampling, they hold close to the friction found alone
    by_mu: float | None = None  # of the SED by mu [MPa]
    by_tau_max: float | None = None  # by tau_max as the model gets it [-]
    by_force: float | None = None  # by the normal force, where that drives the model [MPa/N]
    reason: str = ""
    normal_force: Ends | None = None  # of the whole finger [N]
    tangential_force: Ends | None = None  # [N]
    indentation: Ends | None = None  # found under a force [mm]; both ends alike where it was given
