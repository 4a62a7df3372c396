"""Coulomb friction whose traction never exceeds a bound, point by point."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """|t| <= min(mu p, tau_max)."""

    mu: float  # coefficient of friction [-]
    tau_max: float  # traction bound [MPa], infinite where there is none

    def __post_init__(self) -> None:
        """Raise ValueError for friction that is negative or no number."""
        if not 0.0 <= self.mu < np.inf:
            raise ValueError(f"mu = {self.mu} is not allowed: a coefficient of friction is a number from 0 on")
        if not self.tau_max >= 0.0:
            raise ValueError(f"tau_max = {self.tau_max} is not allowed: a bound is a traction from 0 on, or infinite")

    def limit(self, force: Array, length: Array) -> Array:
        """Return the largest tangential force (n,) [N/mm] at points pressed with `force` (n,) [N/mm].

        `length` (n,) [mm] is the skin that each point stands for: the bound on a point's force is tau_max times it.

        >>> FrictionLaw(0.5, 0.02).limit(np.array([0.01, 0.1, 0.0]), np.array([1.0, 1.0, 1.0]))
        array([0.005, 0.02 , 0.   ])
        """
        return np.minimum(self.mu * np.maximum(force, 0.0), self.bound(length))

    def bound(self, length: Array) -> Array:
        """Return the largest tangential force (n,) [N/mm] whatever the pressure, on `length` (n,) [mm] of skin."""
        return np.full(length.shape, np.inf) if self.tau_max == np.inf else self.tau_max * length

    @property
    def frictionless(self) -> bool:
        """True where no tangential force is possible."""
        return self.mu == 0.0 or self.tau_max == 0.0
