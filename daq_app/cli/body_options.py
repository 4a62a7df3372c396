"""What is a subject's own, as the command line states it: finger, contact angle, depths."""

import argparse

from daq_app.cli.options import numbers_by_key
from daq_app.console import WrongValue
from sessions.plan.plan import Finger, SessionPlan
from sessions.plan.protocols import Body

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
