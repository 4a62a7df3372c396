"""Options of the analysis: how the contact area follows the normal force, how uncertain the calibration is."""

import argparse

from daq_app.cli.options import add_number
from daq_app.console import WrongValue
from sessions.strokes.friction import FIXED, HERTZ, PLANNED_AT, AreaLaw

AS_BEFORE = "as the session was analysed before, or else fixed"


def add_analysis(parser: argparse.ArgumentParser, otherwise: str = AS_BEFORE) -> None:
    """Declare --area, --area-force and --calibration-error; `otherwise` says which area holds without."""
    parser.add_argument(
        "--area",
        metavar="LAW",
        help="contact area for tau_max: fixed (the plan's), hertz (grows as N^(2/3)), or an exponent of "
        f"N; where none is given {otherwise}",
    )
    meaning = f"normal force at which an area that grows is the plan's ({PLANNED_AT:g}, assumed)"
    add_number(parser, "--area-force", float, (0.01, 100.0), meaning, None, "NEWTON", "0.01 to 100 (N)")
    add_calibration(parser)


def add_calibration(parser: argparse.ArgumentParser) -> None:
    """Declare --calibration-error."""
    meaning = "standard uncertainty of each axis of the transducer (else as set before for the session, or 1, assumed)"
    add_number(parser, "--calibration-error", float, (0.0, 20.0), meaning, None, "PERCENT", "0 to 20 (per cent)")


def area_law(options: argparse.Namespace) -> AreaLaw | None:
    """Return the law that the options state, None where they state none. Raises WrongValue."""
    if options.area is None and options.area_force is None:
        return None
    if options.area in ("fixed", None):
        if options.area_force is not None:
            raise WrongValue("--area-force says nothing of a fixed area: give --area hertz or an exponent too")
        return FIXED
    force = PLANNED_AT if options.area_force is None else options.area_force
    if options.area == "hertz":
        return AreaLaw("hertz", HERTZ, force)
    try:
        exponent = float(options.area)
    except ValueError:
        exponent = -1.0
    if not 0.0 <= exponent <= 1.0:
        raise WrongValue(f"--area {options.area} is not allowed: fixed, hertz, or an exponent from 0 to 1")
    return AreaLaw("power", exponent, force)


def calibration_error(options: argparse.Namespace) -> float | None:
    """Return the standard uncertainty of each axis' gain [-], None where it was not given."""
    percent: float | None = options.calibration_error
    return None if percent is None else percent / 100.0
