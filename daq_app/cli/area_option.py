"""The option that says how the contact area follows the normal force."""

import argparse

from daq_app.console import WrongValue
from sessions.strokes.contact_area import FIXED, HERTZ, PLANNED_AT, AreaLaw

AS_BEFORE = "as the session was analysed before, or else fixed"


def add_area(parser: argparse.ArgumentParser, otherwise: str = AS_BEFORE) -> None:
    """Declare --area and --area-force; `otherwise` says what holds without."""
    parser.add_argument(
        "--area",
        metavar="LAW",
        help="contact area by which tau_max is told: fixed (the plan's), hertz (grows as N^(2/3)), or an exponent of "
        f"N; where none is given {otherwise}",
    )
    parser.add_argument(
        "--area-force",
        type=float,
        metavar="NEWTON",
        help=f"normal force at which an area that grows is the plan's ({PLANNED_AT:g}, assumed)",
    )


def area_law(options: argparse.Namespace) -> AreaLaw | None:
    """Return the law asked for, None where none was. Raises WrongValue."""
    if options.area is None and options.area_force is None:
        return None
    force = PLANNED_AT if options.area_force is None else options.area_force
    if not 0.01 <= force <= 100.0:
        raise WrongValue(f"--area-force {force:g} is not allowed: 0.01 to 100 (N)")
    if options.area in ("fixed", None):
        if options.area_force is not None:
            raise WrongValue("--area-force says nothing of a fixed area: give --area hertz or an exponent too")
        return FIXED
    if options.area == "hertz":
        return AreaLaw("hertz", HERTZ, force)
    try:
        exponent = float(options.area)
    except ValueError:
        exponent = -1.0
    if not 0.0 <= exponent <= 1.0:
        raise WrongValue(f"--area {options.area} is not allowed: fixed, hertz, or an exponent from 0 to 1")
    return AreaLaw("power", exponent, force)
