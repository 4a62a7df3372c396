"""The option that says how uncertain the transducer's calibration is."""

import argparse

from daq_app.console import WrongValue


def add_calibration(parser: argparse.ArgumentParser) -> None:
    """Declare --calibration-error."""
    parser.add_argument(
        "--calibration-error",
        type=float,
        metavar="PERCENT",
        help="standard uncertainty of each axis of the transducer (else as set before for the session, or 1, assumed)",
    )


def calibration_error(options: argparse.Namespace) -> float | None:
    """Return the standard uncertainty of each axis' gain [-], None where it was not given. Raises WrongValue."""
    percent: float | None = options.calibration_error
    if percent is not None and not 0.0 <= percent <= 20.0:
        raise WrongValue(f"--calibration-error {percent:g} is not allowed: 0 to 20 (per cent)")
    return None if percent is None else percent / 100.0
