"""The published finger and its ten surfaces (the paper's Tables 1 and 2), with both readings of the traction bound.

The tables head the bound "x 10^-4 (MPa)". It was computed as the largest tangential force on 1 cm2 of contact. As
printed, that force would be some millinewtons, below the transducer's resolution. So the power of ten must belong to
pascals: 0.8033e4 Pa, not 0.8033e-4 MPa. "computed" is this reading, "as-printed" the other.
"""

from dataclasses import dataclass
from typing import Literal

from solver.scene import Scene
from solver.scene.tables import Friction, Loading

Reading = Literal["computed", "as-printed"]
BOUND_SCALE: dict[Reading, float] = {"computed": 1e-2, "as-printed": 1e-4}  # of the printed number, to MPa


@dataclass(frozen=True, slots=True)
class Surface:
    """One row of the tables."""

    descriptor: str
    index: int
    mu: float
    printed_bound: float  # tau_max as printed, in its unclear unit
    speed: float  # [mm/s]


STICKINESS = (
    Surface("stickiness", 0, 0.28, 0.8033, 20.0),
    Surface("stickiness", 20, 0.44, 1.5478, 22.0),
    Surface("stickiness", 50, 0.48, 1.9038, 21.0),
    Surface("stickiness", 80, 0.64, 4.9998, 17.5),
    Surface("stickiness", 100, 0.67, 5.255, 15.0),
)
SLIPPERINESS = (
    Surface("slipperiness", 0, 0.62, 4.707, 13.0),
    Surface("slipperiness", 20, 0.55, 4.2404, 33.0),
    Surface("slipperiness", 55, 0.44, 3.009, 39.0),
    Surface("slipperiness", 75, 0.52, 2.6, 38.0),
    Surface("slipperiness", 100, 0.24, 0.877, 39.0),
)
INDENTATION = {"stickiness": 2.0, "slipperiness": 1.5}  # [mm]


def scene(surface: Surface, reading: Reading = "computed") -> Scene:
    """Return the published scene of one surface.

    >>> scene(STICKINESS[0]).friction
    Friction(mu=0.28, tau_max=0.008033)
    """
    return Scene(
        title=f"{surface.descriptor} {surface.index}",
        friction=Friction(surface.mu, round(surface.printed_bound * BOUND_SCALE[reading], 12)),
        loading=Loading(
            INDENTATION[surface.descriptor], "+x" if surface.descriptor == "stickiness" else "-x", surface.speed
        ),
    )


def scenes(reading: Reading = "computed") -> tuple[Scene, ...]:
    """Return the ten published scenes, stickiness first."""
    return tuple(scene(surface, reading) for surface in STICKINESS + SLIPPERINESS)
