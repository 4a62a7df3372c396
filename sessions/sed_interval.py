"""The interval of a predicted SED that the uncertainty of its friction makes; `sessions.uncertainty` finds it."""

from dataclasses import dataclass
from typing import Literal

Method = Literal["derivatives", "sampling"]  # by the solver's converged tangent; by draws that are solved


@dataclass(frozen=True, slots=True)
class SedInterval:
    """The 95 % interval of one SED that friction makes, and the force where that drives: not the model's error."""

    low: float | None  # [MPa]; None where `reason` says why
    high: float | None
    method: Method | None
    # Derivatives by the converged tangent: where the method is sampling, they hold close to the friction found alone
    by_mu: float | None = None  # of the SED by mu [MPa]
    by_tau_max: float | None = None  # by tau_max as the model gets it [-]
    by_force: float | None = None  # by the normal force, where that drives the model [MPa/N]
    reason: str = ""
