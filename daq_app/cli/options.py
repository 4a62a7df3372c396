"""Options shared by several verbs, options about a session, and checks of typed values."""

import argparse
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from daq_app.console import WrongValue, point_advice
from sessions.plan.plan import Finger, SessionPlan
from sessions.plan.protocols.planning import Body
from sessions.plan.protocols.protocol import HEIGHTS
from sessions.plan.protocols.protocol import LARGEST_SEED as LARGEST
from sessions.strokes.stroke import FIXED, HERTZ_EXPONENT, PLANNED_AT, AreaLaw
from solver.quantities import NAMES, SED

LARGEST_STUDY_SEED = 10_000_000  # of a study of simulated people, whose own seeds are a hundred times as large


def number_in_range(
    name: str, number_type: type[int] | type[float], least: float, greatest: float, allowed: str = "", per: int = 1
) -> Callable[[str], float]:
    """Return an argparse `type` for numbers in a range, which raises WrongValue for any other.

    `allowed` describes the range where `least` and `greatest` do not. The typed number is `per` times the value.
    """
    limits = f"{least:g} on" if math.isinf(greatest) else f"{least:.12g} to {greatest:.12g}"
    usual = f"a whole number from {limits}" if number_type is int else limits

    def parse(text: str) -> float:
        try:
            value = number_type(text)
            label = str(value) if number_type is int else f"{value:g}"
        except ValueError:
            value, label = math.nan, repr(text)
        if not least <= value <= greatest:
            raise WrongValue(f"{name} {label} is not allowed: {allowed or usual}{point_advice(text)}")
        return value if per == 1 else value / per

    return parse


def add_number(
    parser: argparse.ArgumentParser,
    name: str,
    number_type: type[int] | type[float],
    span: tuple[float, float],
    meaning: str,
    default: float | None = None,
    metavar: str | None = None,
    allowed: str = "",
) -> None:
    """Declare an option that takes a number in a span; `allowed` describes the span where its ends do not."""
    parse = number_in_range(name, number_type, *span, allowed)
    parser.add_argument(name, type=parse, default=default, metavar=metavar, help=meaning)


def add_flag(parser: argparse.ArgumentParser, name: str, meaning: str) -> None:
    """Declare an option without a value, True if it is given."""
    parser.add_argument(name, action="store_true", help=meaning)


def add_seed(
    parser: argparse.ArgumentParser, use: str, default: int | None = 0, largest: float = LARGEST_STUDY_SEED
) -> None:
    """Declare --seed for a random draw."""
    add_number(parser, "--seed", int, (0, largest), use, default)


def numbers_by_key(texts: Sequence[str], option: str, example: str) -> dict[str, float]:
    """Return the numbers of a NAME=VALUE option, by name. Raises WrongValue with the example."""
    numbers: dict[str, float] = {}
    for text in texts:
        key, _, value = (piece.strip() for piece in text.partition("="))
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not key or not math.isfinite(number):
            raise WrongValue(f"{option} {text} is not allowed: NAME=VALUE, such as {example}{point_advice(value)}")
        if key in numbers:
            raise WrongValue(f"{option} {key} is given twice")
        numbers[key] = number
    return numbers


def add_session(parser: argparse.ArgumentParser) -> None:
    """Declare the argument for a session's folder."""
    parser.add_argument("session", type=Path, metavar="SESSION", help="a session folder")


def add_visit(parser: argparse.ArgumentParser, further: str = "") -> None:
    """Declare a folder of a session or of a study, and --subject, which chooses a visit; `further` extends its help."""
    parser.add_argument("session", type=Path, metavar="SESSION|STUDY", help="the folder of a session or of a study")
    parser.add_argument("--subject", metavar="CODE", help=f"of a study: subject of the visit with forces{further}")


def _address(text: str) -> str:
    if re.fullmatch(r"[a-z]+://[^/\s]+:\d+", text) is None:
        raise WrongValue(f"--scheduler {text} is not allowed: scheme, host and port, as tcp://host:8786")
    return text


_STRAINS = ["small", "finite"]
_HEIGHTS = f"{HEIGHTS[0]:g} to {HEIGHTS[1]:g} (mm)"
# Options of several verbs. {} stands for the verb's own words, which are the whole help where none is given here.
_SHARED: Mapping[str, dict[str, Any]] = {
    "quantity": {
        "choices": NAMES, "default": SED.name, "metavar": "NAME",
        "help": f"quantity at the ending {{}} in place of the SED: {', '.join(NAMES)}",
    },
    "kinematics": {"choices": _STRAINS, "default": "small"},
    "tau": {"choices": ["computed", "as-printed"], "default": "computed"},
    "paths": {"nargs": "?", "const": "small", "choices": _STRAINS, "default": "none", "metavar": "finite"},
    "variants": {"choices": ["none", "small", "both"]},
    "height": {"type": number_in_range("--height", float, *HEIGHTS, _HEIGHTS), "metavar": "MM"},
    "simulate_subject": {"type": number_in_range("--simulate-subject", int, 0, LARGEST), "metavar": "SEED"},
    "headless": {"action": "store_true", "help": "no effect: this verb never opens a window"},
    "workers": {
        "type": number_in_range("--workers", int, 1, 1024), "metavar": "N",
        "help": "processes on this computer (as many as cores)",
    },
    "scheduler": {
        "type": _address, "metavar": "ADDRESS",
        "help": "address of a Dask cluster you trust, such as tls://host:8786, in place of this computer",
    },
}  # fmt: skip
_BEFORE = {"variants": ["--beside"]}  # former names of options


def add_shared(parser: argparse.ArgumentParser, *names: str, **uses: str) -> None:
    """Declare options that several verbs have; `uses` give the meaning of some of them in this verb."""
    for name in (*names, *uses):
        options = [f"--{name.replace('_', '-')}", *_BEFORE.get(name, ())]
        settings: dict[str, Any] = {"help": "{}"} | _SHARED[name]
        settings["help"] = settings["help"].format(uses.get(name))
        parser.add_argument(*options, **settings)


_FINGER = ("tip_radius", "width", "contact_angle")


def add_body_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare --finger and --depth, the subject's own finger and depths."""
    meaning = "measured on the subject: tip_radius [mm], width of the contact [mm], contact_angle [degrees]"
    parser.add_argument("--finger", nargs="+", default=[], metavar="NAME=VALUE", help=meaning)
    meaning = "the subject's own indentation, in place of the block's"
    parser.add_argument("--depth", nargs="+", default=[], metavar="BLOCK=MM", help=meaning)


def body_of(options: argparse.Namespace) -> Body:
    """Return the subject's own finger and depths. Raises WrongValue."""
    finger = numbers_by_key(options.finger, "--finger", "tip_radius=6.5")
    for key in finger:
        if key not in _FINGER:
            raise WrongValue(f"--finger {key} is not known; allowed here: {', '.join(_FINGER)}")
    angle, depths = finger.pop("contact_angle", None), numbers_by_key(options.depth, "--depth", "stickiness=1.9")
    return Body(Finger(**finger), angle, depths)


def measures_sentence(plan: SessionPlan) -> str | None:
    """Return a sentence on the subject's own values in a plan, for the experimenter; None if there are none."""
    lengths = {"tip radius": plan.finger.tip_radius, "width": plan.finger.width}
    facts = [f"{name} {length:g} mm" for name, length in lengths.items() if length is not None]
    if plan.contact_angle_origin == "measured":
        facts.append(f"contact angle {plan.contact_angle:g} degrees")
    blocks = [block for block in plan.blocks if block.indentation_origin == "measured"]
    facts += [f"depth of {block.name} {block.indentation:g} mm" for block in blocks]
    return f"{plan.subject}'s own: {', '.join(facts)}" if facts else None


AS_BEFORE = "as in the session's last analysis, or fixed"


def add_analysis(parser: argparse.ArgumentParser, otherwise: str = AS_BEFORE) -> None:
    """Declare --area, --area-force and --calibration-error; `otherwise` names the default area."""
    meaning = "contact area for tau_max: fixed (the plan's), hertz (grows as N^(2/3)), or an exponent of N"
    parser.add_argument("--area", metavar="LAW", help=f"{meaning} ({otherwise})")
    meaning = f"normal force at which a growing area equals the plan's ({PLANNED_AT:g}, assumed)"
    add_number(parser, "--area-force", float, (0.01, 100.0), meaning, None, "NEWTON", "0.01 to 100 (N)")
    add_calibration(parser)


def add_calibration(parser: argparse.ArgumentParser) -> None:
    """Declare --calibration-error, the standard uncertainty of each axis's gain [-], typed in per cent."""
    meaning = "standard uncertainty of each axis of the transducer (as last set for the session, or 1, assumed)"
    parse = number_in_range("--calibration-error", float, 0.0, 20.0, "0 to 20 (per cent)", per=100)
    parser.add_argument("--calibration-error", type=parse, metavar="PERCENT", help=meaning)


def area_law(options: argparse.Namespace) -> AreaLaw | None:
    """Return the area law of the options, None if they give none. Raises WrongValue."""
    if options.area is None and options.area_force is None:
        return None
    if options.area in ("fixed", None):
        if options.area_force is not None:
            raise WrongValue("--area-force has no effect on a fixed area: give --area hertz or an exponent too")
        return FIXED
    force = PLANNED_AT if options.area_force is None else options.area_force
    if options.area == "hertz":
        return AreaLaw("hertz", HERTZ_EXPONENT, force)
    try:
        exponent = float(options.area)
    except ValueError:
        exponent = -1.0
    if not 0.0 <= exponent <= 1.0:
        raise WrongValue(f"--area {options.area} is not allowed: fixed, hertz, or an exponent from 0 to 1")
    return AreaLaw("power", exponent, force)
