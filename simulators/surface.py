"""Stimuli with planted friction, and the ten that the paper reports."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

CONTACT_AREA = 100.0  # [mm2] 1 cm², over which the paper spreads the greatest tangential force


@dataclass(frozen=True, slots=True)
class Surface:
    """A flat stimulus: how a finger rubs on it, and how the paper's subject stroked it."""

    mu: float  # coefficient of friction, the same at every force and speed [-]
    descriptor: str = "stickiness"
    index: int = 50  # its maker's number on the descriptor, 0 to 100
    tau_max: float = 0.02  # greatest tangential force of the stroke over CONTACT_AREA [MPa]
    speed: float = 20.0  # speed of the stroke [mm/s]
    direction: int = 1  # of the stroke: +1 proximal to distal, -1 distal to proximal
    holds: bool = True  # blocks the finger first, so that T/N climbs to mu before anything slides

    def __post_init__(self) -> None:
        """Refuse what no surface can be."""
        if not (self.mu > 0.0 and self.tau_max > 0.0 and self.speed > 0.0):
            raise ValueError(
                f"surface needs mu, tau_max and speed above 0, not {self.mu}, {self.tau_max}, {self.speed}"
            )
        if self.direction not in (1, -1):
            raise ValueError(f"surface has direction {self.direction}, which must be 1 or -1")

    @property
    def peak_normal_force(self) -> float:
        """Normal force at which friction reaches the stroke's greatest tangential force [N].

        >>> round(Surface(mu=0.28, tau_max=0.008033).peak_normal_force, 2)
        2.87
        """
        return self.tau_max * CONTACT_AREA / self.mu


# Tables 1 and 2 of the paper. tau_max there is headed 1e-4 MPa; with the stated 1 cm² the exponent can only belong to
# pascals (0.8 N and not 0.008 N of tangential force), so the numbers here are the printed ones times 1e4 Pa.
_TABLE_1 = {  # index: mu [-], tau_max [MPa], speed [mm/s]
    0: (0.28, 0.008033, 20.0),
    20: (0.44, 0.015478, 22.0),
    50: (0.48, 0.019038, 21.0),
    80: (0.64, 0.049998, 17.5),
    100: (0.67, 0.05255, 15.0),
}
_TABLE_2 = {
    0: (0.62, 0.04707, 13.0),
    20: (0.55, 0.042404, 33.0),
    55: (0.44, 0.03009, 39.0),
    75: (0.52, 0.0260, 38.0),
    100: (0.24, 0.00877, 39.0),
}


def paper_surfaces() -> Mapping[tuple[str, int], Surface]:
    """Return the ten surfaces of the paper's Tables 1 and 2 by (descriptor, index).

    Stickiness is judged proximal to distal, where the surface blocks the finger first; slipperiness distal to
    proximal, where the finger slides at once (the paper's section 3).
    """
    sticky = {
        ("stickiness", index): Surface(mu, "stickiness", index, tau_max, speed, direction=1, holds=True)
        for index, (mu, tau_max, speed) in _TABLE_1.items()
    }
    slippery = {
        ("slipperiness", index): Surface(mu, "slipperiness", index, tau_max, speed, direction=-1, holds=False)
        for index, (mu, tau_max, speed) in _TABLE_2.items()
    }
    return MappingProxyType(sticky | slippery)
