"""The interval of a predicted SED that the uncertainty of its friction makes; `sessions.uncertainty` finds it."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

Method = Literal["derivatives", "sampling"]


@dataclass(frozen=True, slots=True)
class SedInterval:
    """The 95 % interval of one SED that friction alone makes: not the model's own error."""

    trial: int | None
    stroke: int | None
    low: float | None  # [MPa]; None where `reason` says why
    high: float | None
    method: Method | None
    by_mu: float | None  # derivative of the SED by mu [MPa]
    by_tau_max: float | None  # derivative of the SED by tau_max as the model gets it [-]
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)
