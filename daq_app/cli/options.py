"""Options that several verbs share, and how a value that somebody typed is checked."""

import argparse
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from daq_app.console import WrongValue
from solver.quantities import NAMES, SED

LARGEST_SEED = 10_000_000  # of a study of simulated people, each of whom has a seed a hundred times as large


def within(
    name: str, kind: type[int] | type[float], least: float, greatest: float, words: str = ""
) -> Callable[[str], float]:
    """Return the `type` of an option for argparse: a number that raises WrongValue where it is not allowed.

    `words` say what is allowed where the least and the greatest value do not.
    """
    ends = f"{least:g} on" if math.isinf(greatest) else f"{least:g} to {greatest:.12g}"
    usual = f"a whole number from {ends}" if kind is int else ends

    def read(text: str) -> float:
        value = kind(text)
        if not least <= value <= greatest:
            shown = value if kind is int else f"{value:g}"
            raise WrongValue(f"{name} {shown} is not allowed: {words or usual}")
        return value

    read.__name__ = kind.__name__  # argparse names it where a text is no number
    return read


def add_number(
    parser: argparse.ArgumentParser,
    name: str,
    kind: type[int] | type[float],
    span: tuple[float, float],
    meaning: str,
    default: float | None = None,
    metavar: str | None = None,
    words: str = "",
) -> None:
    """Declare an option that takes a number in a span; `words` say which where the ends do not."""
    parser.add_argument(name, type=within(name, kind, *span, words), default=default, metavar=metavar, help=meaning)


def add_seed(parser: argparse.ArgumentParser, use: str, default: int | None = 0, largest: float = LARGEST_SEED) -> None:
    """Declare --seed, of something that is drawn at random."""
    add_number(parser, "--seed", int, (0, largest), use, default)


def numbers_by_key(texts: Sequence[str], option: str, example: str) -> dict[str, float]:
    """Return the numbers of an option given as NAME=VALUE, by name. Raises WrongValue with the example."""
    numbers: dict[str, float] = {}
    for text in texts:
        key, _, value = (part.strip() for part in text.partition("="))
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not key or not math.isfinite(number):
            raise WrongValue(f"{option} {text} is not allowed: NAME=VALUE, such as {example}")
        if key in numbers:
            raise WrongValue(f"{option} {key} is given twice")
        numbers[key] = number
    return numbers


def add_session(parser: argparse.ArgumentParser) -> None:
    """Declare the session's folder."""
    parser.add_argument("session", type=Path, metavar="SESSION", help="a session folder")


def add_visit(parser: argparse.ArgumentParser, further: str = "") -> None:
    """Declare a session's folder or a study's, of which --subject chooses a visit; `further` adds to what that does."""
    parser.add_argument("session", type=Path, metavar="SESSION|STUDY", help="the folder of a session or of a study")
    parser.add_argument("--subject", metavar="CODE", help=f"of a study: whose visit with forces{further}")


def add_quantity(parser: argparse.ArgumentParser, use: str) -> None:
    """Declare --quantity, which is put to some use in place of the SED."""
    parser.add_argument(
        "--quantity",
        choices=NAMES,
        default=SED.name,
        metavar="NAME",
        help=f"of the ending, {use} in place of the SED: {', '.join(NAMES)}",
    )


def add_kinematics(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Declare --kinematics."""
    parser.add_argument("--kinematics", choices=["small", "finite"], default="small", help=meaning)


def add_tau(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Declare --tau."""
    parser.add_argument("--tau", choices=["computed", "as-printed"], default="computed", help=meaning)


def add_paths(parser: argparse.ArgumentParser, meaning: str, default: str | None) -> None:
    """Declare --paths, which is `default` where it is not given."""
    choices = ["small", "finite"]
    parser.add_argument(
        "--paths", nargs="?", const="small", choices=choices, default=default, metavar="finite", help=meaning
    )


def add_variants(parser: argparse.ArgumentParser, meaning: str, default: str | None = None) -> None:
    """Declare --variants, which was called --beside before."""
    choices = ["none", "small", "both"]
    parser.add_argument("--variants", "--beside", dest="variants", choices=choices, default=default, help=meaning)


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Declare where many solves run: processes of this computer or a Dask cluster."""
    add_number(parser, "--workers", int, (1, 1024), "processes on this computer (as many as cores)", metavar="N")
    parser.add_argument(
        "--scheduler",
        type=_address,
        metavar="ADDRESS",
        help="of a Dask cluster you trust, such as tls://host:8786, in place of this computer",
    )


def _address(text: str) -> str:
    if re.fullmatch(r"[a-z]+://[^/\s]+:\d+", text) is None:
        raise WrongValue(f"--scheduler {text} is not allowed: scheme, host and port, as tcp://host:8786")
    return text
