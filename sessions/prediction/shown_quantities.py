"""Quantities at the receptor by their names, and the unit in which people read them."""

from collections.abc import Mapping

from solver.quantities import QUANTITIES, Quantity

BY_NAME: Mapping[str, Quantity] = {quantity.name: quantity for quantity in QUANTITIES}


def shown_unit(quantity: Quantity) -> tuple[str, float]:
    """Return the unit in which people read a quantity, and a number in it by the one that is kept.

    >>> shown_unit(BY_NAME["sed"]), shown_unit(BY_NAME["shear_along_skin"])
    (('kPa', 1000.0), ('1', 1.0))
    """
    return ("kPa", 1e3) if quantity.unit == "MPa" else ("1", 1.0)
