"""Responses of the tissue at a receptor: a file a family, one list of all. The first is the published one.

At an ending each is averaged over the ending's patch: the mean of the values at its places.
"""

from solver.quantities import energy, strain, stress
from solver.quantities.local_state import LocalState, Quantity

QUANTITIES: tuple[Quantity, ...] = (*energy.QUANTITIES, *strain.QUANTITIES, *stress.QUANTITIES)
NAMES: tuple[str, ...] = tuple(quantity.name for quantity in QUANTITIES)
SED = energy.SED
# What is drawn over the whole tissue. Principal stresses are drawn only: no receptor is said to answer to them.
FIELDS: tuple[Quantity, ...] = (
    SED,
    strain.GREATEST,
    strain.LEAST,
    stress.GREATEST,
    stress.LEAST,
    stress.VON_MISES,
    stress.PRESSURE,
)

__all__ = ["FIELDS", "NAMES", "QUANTITIES", "SED", "LocalState", "Quantity"]
