"""Options about a session: what is a subject's own, how its contact area grows, how uncertain its calibration is."""

import argparse

from daq_app.cli.options import add_number, numbers_by_key
from daq_app.console import WrongValue
from sessions.plan.plan import Finger, SessionPlan
from sessions.plan.protocols import Body
from sessions.strokes.friction import FIXED, HERTZ, PLANNED_AT, AreaLaw

FINGER = ("tip_radius", "width", "contact_angle")


def add_body_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the subject's own finger and depths."""
    parser.add_argument(
        "--finger",
        nargs="+",
        default=[],
        metavar="NAME=VALUE",
        help="as measured on the subject: tip_radius [mm], width of the contact [mm], contact_angle [degrees]",
    )
    parser.add_argument(
        "--depth", nargs="+", default=[], metavar="BLOCK=MM", help="the subject's own, in place of a block's"
    )


def body_of(options: argparse.Namespace) -> Body:
    """Return what the options state. Raises WrongValue."""
    finger = numbers_by_key(options.finger, "--finger", "tip_radius=6.5")
    for key in finger:
        if key not in FINGER:
            raise WrongValue(f"--finger {key} is not known; allowed here: {', '.join(FINGER)}")
    return Body(
        Finger(finger.get("tip_radius"), finger.get("width")),
        finger.get("contact_angle"),
        numbers_by_key(options.depth, "--depth", "stickiness=1.9"),
    )


def own_sentence(plan: SessionPlan) -> str | None:
    """Return what is the subject's own in a plan, for whoever runs the session; None where nothing is."""
    parts: list[str] = []
    if plan.finger.tip_radius is not None:
        parts.append(f"tip radius {plan.finger.tip_radius:g} mm")
    if plan.finger.width is not None:
        parts.append(f"width {plan.finger.width:g} mm")
    if plan.contact_angle_origin == "measured":
        parts.append(f"contact angle {plan.contact_angle:g} degrees")
    own = [block for block in plan.blocks if block.indentation_origin == "measured"]
    parts += [f"depth of {block.name} {block.indentation:g} mm" for block in own]
    return f"{plan.subject}'s own: {', '.join(parts)}" if parts else None


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
